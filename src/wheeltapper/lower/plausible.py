"""Numbers that are possible but implausible: usually a unit is missing, or another one was meant."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from math import log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.combination import Repeated
from wheeltapper.describe.noun import Noun
from wheeltapper.describe.placement import Placement
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.ground.quantities import UNITS, si_unit
from wheeltapper.lower.unmet import unmet_notes

FloatArray = NDArray[np.float64]


class Usual(NamedTuple):
    """The usual range of a quantity, and the limits beyond which it is implausible, all in one unit.

    Negative numbers are judged by their magnitude. Zero is always plausible, and so are numbers that stand for zero.
    """

    dimension: str
    unit: str
    usual: tuple[float, float]
    least: float
    most: float


NOTHING = 1e-6
"""A number below this share of the least plausible value stands for zero on purpose, and is accepted without a
warning."""
IMPERIAL = ("in", "inch", "lb", "kip", "lbf", "mph")
"""Units that no hint proposes. A number without a unit is more likely meant in another metric unit."""
HEIGHT = Usual("length", "mm", (0.01, 5), 0.0, 50)
SPAN = Usual("length", "mm", (0.01, 10), 0.0, 100)
"""Of heights that are given one by one: from the lowest to the highest, of long waves too."""
WAVE = Usual("length", "m", (0.01, 3), 1e-4, 1e4)
ELASTIC = {
    "constant": Usual("Hertz constant", "N/m^1.5", (5e10, 5e11), 1e9, 1e13),
    "constant_per_wheel": Usual("Hertz constant", "N/m^1.5", (3e10, 3e11), 1e9, 1e13),
    "rail_radius": Usual("length", "m", (0.08, 0.5), 0.005, 10),
    "youngs_modulus": Usual("pressure", "GPa", (200, 215), 0.1, 2000),
}
STRENGTH = Usual("pressure", "MPa", (300, 4000), 10, 1e5)
INERTIA = Usual("moment of inertia", "kg m^2", (50, 3e6), 0.1, 1e9)
SUSPENSION = {
    "stiffness": Usual("stiffness", "MN/m", (0.1, 100), 1e-4, 1000),
    "damping": Usual("damping", "kN s/m", (1, 100), 1e-3, 1e4),
    "friction": Usual("force", "kN", (0.5, 50), 1e-3, 1000),
    "friction_stiffness": Usual("stiffness", "MN/m", (0.5, 100), 1e-4, 1e5),
    "bumpstop_gap": Usual("length", "mm", (5, 60), 0.01, 500),
    "rebound_gap": Usual("length", "mm", (5, 60), 0.01, 500),
    "bumpstop_stiffness": Usual("stiffness", "MN/m", (0.5, 100), 1e-4, 1e5),
    "blow_off_force": Usual("force", "kN", (1, 50), 1e-3, 1000),
    "blow_off_damping": Usual("damping", "kN s/m", (0.1, 50), 1e-4, 1e4),
}
WHEEL_RADIUS = Usual("length", "m", (0.3, 0.65), 0.02, 2)
SEATS = {
    "spacing": Usual("length", "m", (0.5, 0.8), 0.05, 10),
    "pad_stiffness": Usual("stiffness", "MN/m", (20, 2000), 0.1, 1e5),
    "pad_damping": Usual("damping", "kN s/m", (5, 100), 1e-3, 1e4),
}

USUAL: dict[str, dict[str, Usual]] = {
    "Scenario": {
        "speed": Usual("speed", "m/s", (1, 100), 0.0, 200),
        "duration": Usual("time", "s", (0.01, 600), 0.0, 1e5),
    },
    "Start": {
        "displacement": Usual("length", "mm", (0.1, 5), 0.0, 100),
        "velocity": Usual("speed", "m/s", (0.01, 2), 0.0, 20),
    },
    "Wheelset": SUSPENSION | {
        "mass": Usual("mass", "kg", (500, 3000), 5, 1e5),
        "load": Usual("force", "kN", (10, 300), 0.1, 2000),
        "radius": WHEEL_RADIUS,
        "gravity": Usual("acceleration", "m/s^2", (9.7, 9.9), 0.1, 100),
        "damper_play": Usual("length", "mm", (0.01, 5), 0.0, 50),
        "bush_stiffness": Usual("stiffness", "MN/m", (0.1, 100), 1e-4, 1e5),
    },
    "FloatingDeck": {
        "mass": Usual("mass", "kg", (100, 1e5), 1, 1e7),
        "stiffness": Usual("stiffness", "MN/m", (1, 1000), 1e-4, 1e6),
        "damping": Usual("damping", "kN s/m", (1, 1000), 1e-3, 1e6),
        "length": Usual("length", "m", (0.5, 50), 0.01, 1e5),
    },
    "Slab": SEATS,
    "Ballasted": SEATS | {
        "sleeper_mass": Usual("mass", "kg", (30, 250), 1, 1e4),
        "ballast_stiffness": Usual("stiffness", "MN/m", (20, 500), 0.1, 1e5),
        "ballast_damping": Usual("damping", "kN s/m", (5, 500), 1e-3, 1e4),
        "sleeper_roll_inertia": Usual("moment of inertia", "kg m^2", (30, 300), 1, 1e4),
        "ballast_roll_stiffness": Usual("angular stiffness", "MN m/rad", (20, 600), 0.1, 1e5),
        "ballast_roll_damping": Usual("angular damping", "kN m s/rad", (5, 600), 1e-3, 1e4),
        "seat_distance": Usual("length", "m", (1.0, 1.9), 0.05, 5),
    },
    "Rail": {
        "bending_stiffness": Usual("bending stiffness", "MN m^2", (1, 10), 1e-4, 1e3),
        "shear_stiffness": Usual("force", "MN", (50, 500), 0.1, 1e5),
        "mass_per_length": Usual("mass per length", "kg/m", (20, 80), 0.5, 1000),
        "foot_distance": Usual("length", "mm", (50, 100), 1, 1000),
    },
    "HangingSleeper": {"void": Usual("length", "mm", (0.1, 5), 0.0, 50)},
    "Linear": {"stiffness": Usual("stiffness", "MN/m", (500, 5000), 0.1, 1e6)},
    "Hertz": ELASTIC | {
        "impact_speed": Usual("speed", "m/s", (0.01, 1), 0.0, 20),
        "hysteresis": Usual("time per length", "s/m", (0.01, 2), 0.0, 100),
    },
    **dict.fromkeys(("Thornton", "Stronge", "JacksonGreen", "KogutEtsion"), ELASTIC | {
        "yield_force": Usual("force", "kN", (20, 400), 0.1, 1e4),
        "yield_strength": STRENGTH, "hardness": STRENGTH, "rail_hardness": STRENGTH, "wheel_hardness": STRENGTH,
    }),
    "Step": {"height": HEIGHT},
    "CosineBump": {"height": HEIGHT, "length": WAVE},
    "DippedJoint": {
        "depth": HEIGHT, "length": WAVE, "angle": Usual("angle", "mrad", (1, 30), 0.0, 200),
    },
    "Weld": {"height": HEIGHT, "length": WAVE},
    "Spectrum": {
        "deviation": Usual("length", "mm", (0.3, 5), 0.0, 50),
        "patch": Usual("length", "mm", (2, 12), 0.1, 50),
    },
    "Corrugation": {"amplitude": HEIGHT, "wavelength": WAVE},
    "WheelFlat": {
        "depth": Usual("length", "mm", (0.05, 3), 0.0, 20),
        "length": Usual("length", "mm", (10, 150), 0.1, 500),
    },
    "OutOfRound": {"amplitudes": Usual("length", "mm", (0.005, 1), 0.0, 20)},
    "Repeated": {"period": WAVE},
    "Wagon": {"gravity": Usual("acceleration", "m/s^2", (9.7, 9.9), 0.1, 100)},
    "Body": {
        "mass": Usual("mass", "kg", (500, 1e5), 5, 1e6),
        "inertia": INERTIA,
        "position": Usual("length", "m", (0.3, 30), 0.0, 500),
    },
    "Axle": {
        "mass": Usual("mass", "kg", (500, 3000), 5, 1e5),
        "inertia": INERTIA,
        "position": Usual("length", "m", (1, 30), 0.0, 500),
        "load": Usual("force", "kN", (10, 300), 0.1, 2000),
        "radius": WHEEL_RADIUS,
    },
    "Bogie": {f"{level}_{name}": usual for level in ("primary", "secondary") for name, usual in SUSPENSION.items()} | {
        "wheelset_mass": Usual("mass", "kg", (500, 3000), 5, 1e5),
        "frame_mass": Usual("mass", "kg", (500, 1e4), 5, 1e6),
        "pitch_inertia": INERTIA,
        "wheelbase": Usual("length", "m", (1, 4), 0.1, 50),
        "wheel_load": Usual("force", "kN", (10, 300), 0.1, 2000),
        "radius": WHEEL_RADIUS,
    },
    "Spring": {
        "stiffness": Usual("stiffness", "MN/m", (0.01, 100), 1e-6, 1e6),
        "bending": Usual("angular stiffness", "N m/rad", (1e3, 1e8), 1, 1e12),
    },
    "Damper": {
        "damping": Usual("damping", "kN s/m", (1, 1000), 1e-3, 1e6),
        "force": Usual("force", "kN", (0.1, 100), 1e-3, 1e5),
        "series_stiffness": Usual("stiffness", "MN/m", (0.1, 100), 1e-4, 1e6),
        "free_play": Usual("length", "mm", (0.01, 5), 0.0, 100),
    },
    "Friction": {
        "force": Usual("force", "kN", (0.1, 100), 1e-3, 1e5),
        "static_force": Usual("force", "kN", (0.1, 100), 1e-3, 1e5),
        "series_stiffness": Usual("stiffness", "MN/m", (0.1, 100), 1e-4, 1e6),
    },
    "Stop": {
        "deflection": Usual("length", "mm", (1, 100), 0.0, 1000),
        "force": Usual("force", "kN", (0.5, 1000), 0.03, 1e6),
    },
}  # fmt: skip
"""Plausible values of the fields of each kind of noun. The limits are wide: models of wheels, decks and vehicles in the
literature and on laboratory rigs lie within them."""


def implausible_notes(scenario: Scenario) -> tuple[Note, ...]:
    """Return one note for each field of a scenario whose number is implausible: what it is, and what is usual."""
    way = scenario.speed * scenario.duration
    return tuple(
        _range_note(path, value, usual)
        for where, noun in _judged_nouns(scenario)
        for path, value, usual in (*_doubtful_numbers(where, noun), *_implausible_span(where, noun, way))
    )


def doubts(scenario: Scenario) -> tuple[Note, ...]:
    """Return notes on what in a scenario is probably not as it was meant: implausible numbers, what is never met."""
    return (*implausible_notes(scenario), *unmet_notes(scenario))


def implausible_cells(scenario: Scenario, changed: Mapping[str, FloatArray], cells: int) -> tuple[Shared, ...]:
    """Return the same notes for some cells of a scenario: of a field that is `changed`, for its worst value."""
    fields = {path: re.sub(r"\.\d+$", "", path) for path in changed}  # of several numbers in a field, each is judged
    varied = {_cause_text(name) for name in fields.values()}
    notes = [Shared(note, cells) for note in implausible_notes(scenario) if note.cause not in varied]
    nouns = dict(_judged_nouns(scenario))
    for path, name in fields.items():
        where, _, field = name.rpartition(".")
        usual = USUAL.get(type(nouns.get(where)).__name__, {}).get(field)
        if usual is None:
            continue
        middle = UNITS[usual.dimension][usual.unit] * sqrt(usual.usual[0] * usual.usual[1])
        doubted = [value for value in changed[path].tolist() if not _is_plausible(value, usual)]
        if doubted:
            worst = max(doubted, key=lambda value: abs(log(max(abs(value), 1e-300) / middle)))
            notes.append(Shared(_range_note(path, worst, usual), len(doubted)))
    return tuple(notes)


def _judged_nouns(scenario: Scenario) -> Iterator[tuple[str, Noun]]:
    """Return the nouns of a scenario whose numbers are judged, with their paths."""
    yield "", scenario
    yield "vehicle", scenario.vehicle
    for part in ("bodies", "axles", "elements"):
        for i, noun in enumerate(getattr(scenario.vehicle, part, ())):
            yield f"vehicle.{part}.{getattr(noun, 'name', f'wheelset {i + 1}')}", noun
    for i, wheelset in enumerate(getattr(scenario.vehicle, "wheelsets", ())):
        yield f"vehicle.wheelsets.{i}", wheelset
    yield "track", scenario.track
    if isinstance(scenario.track, SupportedRail):
        yield "track.rail", scenario.track.rail
        for i, anomaly in enumerate(scenario.track.anomalies):
            yield f"track.anomalies.{i}", anomaly
    yield "contact", scenario.contact
    places = scenario.irregularity if isinstance(scenario.irregularity, Placement) else {"": scenario.irregularity}
    for place, items in places.items():
        for i, item in enumerate(items):
            yield from _and_what_it_repeats(".".join(part for part in ("irregularity", place, str(i)) if part), item)
    if isinstance(scenario.start, Noun):
        yield "start", scenario.start


def _and_what_it_repeats(where: str, item: Irregularity) -> Iterator[tuple[str, Noun]]:
    yield where, item
    if isinstance(item, Repeated):
        yield from _and_what_it_repeats(f"{where}.of", item.of)


def _doubtful_numbers(where: str, noun: Noun) -> Iterator[tuple[str, float, Usual]]:
    """Return the fields of a noun that hold an implausible number, with the first of these."""
    for field, usual in USUAL.get(type(noun).__name__, {}).items():
        given = getattr(noun, field)
        values = given if isinstance(given, tuple) else () if given is None else (given,)
        value = next((value for value in values if not _is_plausible(value, usual)), None)
        if value is not None:
            yield (f"{where}.{field}" if where else field), value, usual


def _implausible_span(where: str, noun: Noun, end: float) -> Iterator[tuple[str, float, Usual]]:
    """Return the span of samples, or of a user's function up to x = `end`, m, where it is implausible."""
    span = noun.span_given(end) if isinstance(noun, Irregularity) else None
    if span is not None and not _is_plausible(span, SPAN):
        yield f"the span of {where}'s heights", span, SPAN


def _is_plausible(value: float, usual: Usual) -> bool:
    factor = UNITS[usual.dimension][usual.unit]
    size = abs(value) / factor
    return size < NOTHING * usual.least or usual.least <= size <= usual.most


def _range_note(path: str, value: float, usual: Usual) -> Note:
    si = si_unit(usual.dimension)
    low, high = usual.usual
    meant = _meant_unit(abs(value), usual)
    hint = f'; did you mean "{value:.6g} {meant}"?' if meant else ""
    text = f"{path} = {value:.6g} {si} is implausible: usual are {low:g} to {high:g} {usual.unit}{hint}"
    return Note(text, _cause_text(path), doubtful=True)


def _cause_text(path: str) -> str:
    return f"implausible {path}"


def _meant_unit(value: float, usual: Usual) -> str:
    """Return the metric unit with which a number would be usual; "" if there is none."""
    units = UNITS[usual.dimension]
    low, high = (bound * units[usual.unit] for bound in usual.usual)
    return next((unit for unit, one in units.items() if unit not in IMPERIAL and low <= value * one <= high), "")
