"""Exact vibro-impacts of railway wheels on irregular rails, and the faults that they reveal."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from wheeltapper._version import __version__ as __version__
from wheeltapper.ground import progress as _progress
from wheeltapper.ground import shown as _shown
from wheeltapper.ground.lazily import lazily

if TYPE_CHECKING:
    from wheeltapper import diagnosis as diagnosis
    from wheeltapper import orbits as orbits
    from wheeltapper import profiles as profiles
    from wheeltapper import show as show
    from wheeltapper import tracks as tracks
    from wheeltapper.ask import stability as stability
    from wheeltapper.ask import wear as wear
    from wheeltapper.ask.border import border as border
    from wheeltapper.ask.modes import modes as modes
    from wheeltapper.ask.reduced import reduced as reduced
    from wheeltapper.ask.sweep import gradient as gradient
    from wheeltapper.ask.sweep import sweep as sweep
    from wheeltapper.ask.wear import wear_in as wear_in
    from wheeltapper.describe import contact as contact
    from wheeltapper.describe import creep as creep
    from wheeltapper.describe import irregularity, sensor, vehicle
    from wheeltapper.describe.contact.hertz import Hertz as Hertz
    from wheeltapper.describe.contact.linear import Linear as Linear
    from wheeltapper.describe.irregularity.bump import CosineBump as CosineBump
    from wheeltapper.describe.irregularity.combination import Repeated as Repeated
    from wheeltapper.describe.irregularity.corrugation import Corrugation as Corrugation
    from wheeltapper.describe.irregularity.flat import WheelFlat as WheelFlat
    from wheeltapper.describe.irregularity.measured import Measured as Measured
    from wheeltapper.describe.irregularity.out_of_round import OutOfRound as OutOfRound
    from wheeltapper.describe.irregularity.profile import Profile as Profile
    from wheeltapper.describe.irregularity.step import Step as Step
    from wheeltapper.describe.scenario import Scenario as Scenario
    from wheeltapper.describe.track.deck import FloatingDeck as FloatingDeck
    from wheeltapper.describe.track.stiff import StiffTrack as StiffTrack
    from wheeltapper.describe.vehicle.wagon import Wagon as Wagon
    from wheeltapper.describe.vehicle.wheelset import Wheelset as Wheelset
    from wheeltapper.diagnosis.diagnose import diagnose as diagnose
    from wheeltapper.diagnosis.site.design import design_site as design_site
    from wheeltapper.diagnosis.site.synthetic import synthesise as synthesise
    from wheeltapper.faces.plot import plot as plot
    from wheeltapper.ground.errors import InputError as InputError
    from wheeltapper.record import features as features
    from wheeltapper.record import limits as limits
    from wheeltapper.record.record import Record as Record
    from wheeltapper.record.recordings.read import read_recording as read_recording
    from wheeltapper.record.simulate import simulate as simulate
    from wheeltapper.record.store import load as load

    irregularities, sensors, vehicles = irregularity, sensor, vehicle

_HOMES = {
    "Corrugation": "describe.irregularity.corrugation",
    "CosineBump": "describe.irregularity.bump",
    "FloatingDeck": "describe.track.deck",
    "Hertz": "describe.contact.hertz",
    "InputError": "ground.errors",
    "Linear": "describe.contact.linear",
    "Measured": "describe.irregularity.measured",
    "OutOfRound": "describe.irregularity.out_of_round",
    "Profile": "describe.irregularity.profile",
    "Record": "record.record",
    "Repeated": "describe.irregularity.combination",
    "Scenario": "describe.scenario",
    "Step": "describe.irregularity.step",
    "StiffTrack": "describe.track.stiff",
    "Wagon": "describe.vehicle.wagon",
    "WheelFlat": "describe.irregularity.flat",
    "Wheelset": "describe.vehicle.wheelset",
    "__version__": "_version",
    "border": "ask.border",
    "design_site": "diagnosis.site.design",
    "diagnose": "diagnosis.diagnose",
    "gradient": "ask.sweep",
    "load": "record.store",
    "modes": "ask.modes",
    "plot": "faces.plot",
    "read_recording": "record.recordings.read",
    "reduced": "ask.reduced",
    "simulate": "record.simulate",
    "sweep": "ask.sweep",
    "synthesise": "diagnosis.site.synthetic",
    "wear_in": "ask.wear",
}

_ROOMS = {
    "contact": "describe.contact",
    "creep": "describe.creep",
    "diagnosis": "diagnosis",
    "features": "record.features",
    "irregularities": "describe.irregularity",
    "limits": "record.limits",
    "orbits": "orbits",
    "profiles": "profiles",
    "sensors": "describe.sensor",
    "show": "show",
    "stability": "ask.stability",
    "tracks": "tracks",
    "vehicles": "describe.vehicle",
    "wear": "ask.wear",
}

__all__ = [
    *sorted(_HOMES),
    *sorted(_ROOMS),
]


def _progress_bar() -> AbstractContextManager[None]:
    from wheeltapper.faces.progress import progress_bar

    return progress_bar()


def _draw(what: Any, *arguments: Any, **options: Any) -> Any:
    from wheeltapper.faces.plot import plot

    return plot(what, *arguments, **options)


def _page(what: Any) -> str:
    from wheeltapper.faces.pages import page

    return page(what)


_progress.bar, _shown.draw, _shown.page = _progress_bar, _draw, _page

__getattr__, __dir__ = lazily(__name__, _HOMES, _ROOMS)
