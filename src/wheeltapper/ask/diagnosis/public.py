"""Diagnosis of wheelsets that bounce over a site: sites and recordings, findings, performance, design."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wheeltapper.ask.diagnosis.alarms import read_rules as read_rules
    from wheeltapper.ask.diagnosis.combinations import combinations as combinations
    from wheeltapper.ask.diagnosis.faults import CATALOGUE as CATALOGUE
    from wheeltapper.ask.diagnosis.faults import Fault as Fault
    from wheeltapper.ask.diagnosis.finding import Finding as Finding
    from wheeltapper.ask.diagnosis.folder import diagnose_all as diagnose_all
    from wheeltapper.ask.diagnosis.force import imitation as imitation
    from wheeltapper.ask.diagnosis.force import reconstructed as reconstructed
    from wheeltapper.ask.diagnosis.hit_miss import hit_miss as hit_miss
    from wheeltapper.ask.diagnosis.identify import identify as identify
    from wheeltapper.ask.diagnosis.imitation_map import imitation_map as imitation_map
    from wheeltapper.ask.diagnosis.information import information as information
    from wheeltapper.ask.diagnosis.neighbours import Condition as Condition
    from wheeltapper.ask.diagnosis.neighbours import Neighbour as Neighbour
    from wheeltapper.ask.diagnosis.performance import assess as assess
    from wheeltapper.ask.diagnosis.roc import false_calls as false_calls
    from wheeltapper.ask.diagnosis.roc import roc as roc
    from wheeltapper.ask.diagnosis.signal_response import noise_threshold as noise_threshold
    from wheeltapper.ask.diagnosis.signal_response import signal_response as signal_response
    from wheeltapper.ask.diagnosis.synthetic import synthesise_train as synthesise_train
    from wheeltapper.ask.diagnosis.train import diagnose_train as diagnose_train
    from wheeltapper.describe.sensor import Sensor as Sensor
    from wheeltapper.describe.site import Site as Site
    from wheeltapper.record.read_recording import write_recording as write_recording
    from wheeltapper.record.recording import Recording as Recording

_HERE = "wheeltapper.ask.diagnosis"
"""Package of the modules of this room."""
_HOMES = {
    "CATALOGUE": f"{_HERE}.faults",
    "Fault": f"{_HERE}.faults",
    "Finding": f"{_HERE}.finding",
    "Condition": f"{_HERE}.neighbours",
    "Neighbour": f"{_HERE}.neighbours",
    "Recording": "wheeltapper.record.recording",
    "Sensor": "wheeltapper.describe.sensor",
    "Site": "wheeltapper.describe.site",
    "assess": f"{_HERE}.performance",
    "combinations": f"{_HERE}.combinations",
    "diagnose_all": f"{_HERE}.folder",
    "diagnose_train": f"{_HERE}.train",
    "false_calls": f"{_HERE}.roc",
    "hit_miss": f"{_HERE}.hit_miss",
    "identify": f"{_HERE}.identify",
    "imitation": f"{_HERE}.force",
    "imitation_map": f"{_HERE}.imitation_map",
    "information": f"{_HERE}.information",
    "noise_threshold": f"{_HERE}.signal_response",
    "read_rules": f"{_HERE}.alarms",
    "reconstructed": f"{_HERE}.force",
    "roc": f"{_HERE}.roc",
    "signal_response": f"{_HERE}.signal_response",
    "synthesise_train": f"{_HERE}.synthetic",
    "write_recording": "wheeltapper.record.read_recording",
}
"""Public names of the room, and the module that holds each."""

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Import a name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
