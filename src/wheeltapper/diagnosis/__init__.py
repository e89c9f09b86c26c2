"""Diagnosis of wheelsets that bounce over a site: sites and recordings, findings, performance, design."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.ground.lazily import lazily

if TYPE_CHECKING:
    from wheeltapper.describe.sensor.base import Sensor as Sensor
    from wheeltapper.describe.site import Site as Site
    from wheeltapper.diagnosis.axle_box.reading import diagnose_axle_box as diagnose_axle_box
    from wheeltapper.diagnosis.dataset.make import make_dataset as make_dataset
    from wheeltapper.diagnosis.dataset.plan import DatasetPlan as DatasetPlan
    from wheeltapper.diagnosis.detection.hit_miss import hit_miss as hit_miss
    from wheeltapper.diagnosis.detection.roc import false_calls as false_calls
    from wheeltapper.diagnosis.detection.roc import roc as roc
    from wheeltapper.diagnosis.detection.signal_response import noise_threshold as noise_threshold
    from wheeltapper.diagnosis.detection.signal_response import signal_response as signal_response
    from wheeltapper.diagnosis.faults.base import CATALOGUE as CATALOGUE
    from wheeltapper.diagnosis.faults.base import Fault as Fault
    from wheeltapper.diagnosis.finding import Finding as Finding
    from wheeltapper.diagnosis.folder import diagnose_all as diagnose_all
    from wheeltapper.diagnosis.force.imitation_map import imitation_map as imitation_map
    from wheeltapper.diagnosis.force.reconstruction import imitation as imitation
    from wheeltapper.diagnosis.force.reconstruction import reconstructed as reconstructed
    from wheeltapper.diagnosis.gauges.growth import wheel_growth as wheel_growth
    from wheeltapper.diagnosis.identification import identify as identify
    from wheeltapper.diagnosis.inference.combinations import combinations as combinations
    from wheeltapper.diagnosis.inference.information import information as information
    from wheeltapper.diagnosis.inference.problem import Prior as Prior
    from wheeltapper.diagnosis.performance import assess as assess
    from wheeltapper.diagnosis.site.neighbours import Condition as Condition
    from wheeltapper.diagnosis.site.neighbours import Neighbour as Neighbour
    from wheeltapper.diagnosis.site.synthetic import synthesise_train as synthesise_train
    from wheeltapper.diagnosis.train import diagnose_train as diagnose_train
    from wheeltapper.diagnosis.wayside.calibrate import calibrate_site as calibrate_site
    from wheeltapper.diagnosis.wayside.channels import read_channels as read_channels
    from wheeltapper.diagnosis.wayside.measure import calibrated as calibrated
    from wheeltapper.diagnosis.wayside.measure import measure_trains as measure_trains
    from wheeltapper.diagnosis.wayside.seen import blind_shares as blind_shares
    from wheeltapper.record.limits.rule import read_rules as read_rules
    from wheeltapper.record.recordings.recording import Recording as Recording
    from wheeltapper.record.recordings.writing import write_recording as write_recording

_HOMES = {
    "CATALOGUE": "diagnosis.faults.base",
    "Fault": "diagnosis.faults.base",
    "Finding": "diagnosis.finding",
    "DatasetPlan": "diagnosis.dataset.plan",
    "Condition": "diagnosis.site.neighbours",
    "Neighbour": "diagnosis.site.neighbours",
    "Prior": "diagnosis.inference.problem",
    "Recording": "record.recordings.recording",
    "Sensor": "describe.sensor.base",
    "Site": "describe.site",
    "assess": "diagnosis.performance",
    "blind_shares": "diagnosis.wayside.seen",
    "calibrate_site": "diagnosis.wayside.calibrate",
    "calibrated": "diagnosis.wayside.measure",
    "combinations": "diagnosis.inference.combinations",
    "diagnose_all": "diagnosis.folder",
    "diagnose_axle_box": "diagnosis.axle_box.reading",
    "diagnose_train": "diagnosis.train",
    "false_calls": "diagnosis.detection.roc",
    "hit_miss": "diagnosis.detection.hit_miss",
    "identify": "diagnosis.identification",
    "imitation": "diagnosis.force.reconstruction",
    "imitation_map": "diagnosis.force.imitation_map",
    "information": "diagnosis.inference.information",
    "make_dataset": "diagnosis.dataset.make",
    "measure_trains": "diagnosis.wayside.measure",
    "noise_threshold": "diagnosis.detection.signal_response",
    "read_channels": "diagnosis.wayside.channels",
    "read_rules": "record.limits.rule",
    "reconstructed": "diagnosis.force.reconstruction",
    "roc": "diagnosis.detection.roc",
    "signal_response": "diagnosis.detection.signal_response",
    "synthesise_train": "diagnosis.site.synthetic",
    "wheel_growth": "diagnosis.gauges.growth",
    "write_recording": "record.recordings.writing",
}
"""Public names of the room, and the module that holds each."""

__all__ = [*_HOMES]

__getattr__, __dir__ = lazily(__name__, _HOMES)
