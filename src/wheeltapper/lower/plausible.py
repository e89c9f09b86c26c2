"""Numbers that are possible but implausible: usually a unit is missing, or another one was meant."""

from __future__ import annotations

import re
from collections import ChainMap
from collections.abc import Iterator, Mapping
from math import ceil, log, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic import ElasticContact
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.combination import Repeated
from wheeltapper.describe.noun import Noun
from wheeltapper.describe.placement import Placement
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor.along import BetweenPlaces
from wheeltapper.describe.site import Site
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.ground.quantities import UNITS, si_unit
from wheeltapper.lower.laws.ellipse import contact_constant
from wheeltapper.lower.unmet import unmet_notes

FloatArray = NDArray[np.float64]


class Usual(NamedTuple):
    """The usual range of a quantity, and the limits beyond which it is implausible, all in one unit.

    Negative numbers are judged by their magnitude. Zero is always plausible, and so are numbers that stand for zero.

    Attributes
    ----------
    dimension, unit
        A key of `UNITS`, and one of its units.
    usual, least, most
        The usual range, and the limits.
    mixups
        Ranges in which another quantity is likelier, even within the limits, and what it is; "": in another unit.
    zero
        Whether a number may stand for zero.
    """

    dimension: str
    unit: str
    usual: tuple[float, float]
    least: float
    most: float
    mixups: tuple[tuple[float, float, str], ...] = ()
    zero: bool = True


NOTHING = 1e-6
"""A number below this share of the least plausible value stands for zero on purpose, and is accepted without a
warning."""
UNMEANT = ("in", "inch", "lb", "kip", "lbf", "mph", "nm", "km", "us", "µs")
"""Units that no hint proposes: another metric unit is likelier, and nothing here is so small, long or short."""
WRITTEN = (0.01, 1000.0)
"""Sizes of a number as people write it: with a unit that makes it so."""
HEIGHT = Usual("length", "mm", (0.01, 5), 0.0, 50)
SPAN = Usual("length", "mm", (0.01, 10), 0.0, 100)
"""Of heights that are given one by one: from the lowest to the highest, of long waves too."""
WAVE = Usual("length", "m", (0.01, 3), 1e-4, 1e4)
AT_SEAT = 1e-6
"""Of a spacing: a gauge that is nearer to a seat stands at it."""
WHOLE_SLEEPER = "half of a sleeper is asked, not all of it"
WHOLE_WHEELSET = "that of one wheel is asked, half of a wheelset's"
NOT_LINEAR = "Hertz's constant in N/m^1.5 is another quantity, for `Hertz`"
DIAMETER = "the radius is asked, not the diameter"
WHEEL_FOR_AXLE = "a load of one wheel taken for that of an axle doubles it"
AXLE_FOR_WHEEL = "a load of an axle taken for that of each wheel halves it"
KN_FOR_N = "loads in kN taken for N make it 1000"
N_FOR_KN = "readings in kN taken for N make it 0.001"
LENGTH_OF_SENSOR = Usual("length", "m", (0.1, 5), 0.01, 50)
"""From x1 to x2: gauges stand between two sleepers, and an instrumented length has a few."""
UNCERTAINTY = Usual("number", "", (0.001, 0.3), 0.0, 1)
NOT_HERTZ = "a linear stiffness in N/m is another quantity, and so is a compliance G in m/N^(2/3), with C = G^-1.5"
"""Of a steel wheel on a rail C is 6e10 to 1.1e11 N/m^1.5 (docs/theory/contact.rst, section 3.1: radii of 0.3 to 0.5 m
on crowns of 0.08 to 0.5 m). Papers on tracks take G = 4.57e-8·R^-0.149 m/N^(2/3) instead (W. Zhai, K. Wang, C. Cai,
*Vehicle System Dynamics* 47 (2009) 1349-1376), and linear models 1e9 N/m or so."""
ELASTIC = {
    "constant": Usual("Hertz constant", "N/m^1.5", (5e10, 5e11), 1e9, 1e13, ((0.0, 1e10, NOT_HERTZ),), zero=False),
    "constant_per_wheel": Usual(
        "Hertz constant", "N/m^1.5", (3e10, 3e11), 1e9, 1e13, ((0.0, 1e10, NOT_HERTZ),), zero=False
    ),
    "rail_radius": Usual("length", "m", (0.08, 0.5), 0.005, 10),
    "youngs_modulus": Usual("pressure", "GPa", (200, 215), 0.1, 2000),
}
ONE_WHEEL = {"constant": (0.8, 1.2), "constant_per_wheel": (1.7, 2.5)}
"""Ratios of a given constant to one wheel's by radii and elastic constants at which the other of both is likelier."""
LEAST_WHEELSET = 900.0
"""Mass from which on a wheelset has two wheels for sure, kg."""
STRENGTH = Usual("pressure", "MPa", (300, 4000), 10, 1e5)
INERTIA = Usual("moment of inertia", "kg m^2", (50, 3e6), 0.1, 1e9)
CREEP = {"friction": Usual("number", "", (0.05, 0.6), 1e-3, 2)}
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
WHEEL_RADIUS = Usual("length", "m", (0.3, 0.65), 0.02, 2, ((0.75, 1.3, DIAMETER), (750, 1300, f"{DIAMETER}, in mm")))
NOISE = Usual("length", "mm", (1e-4, 0.1), 0.0, 5)
SPEED = Usual("speed", "m/s", (1, 100), 0.0, 200, ((101, 200, ""),))
"""Trains run up to 100 m/s; a number from there to 200 is one in km/h."""
SEATS = {
    "spacing": Usual("length", "m", (0.5, 0.8), 0.05, 10),
    "pad_stiffness": Usual("stiffness", "MN/m", (20, 2000), 1, 1e5),
    "pad_damping": Usual("damping", "kN s/m", (5, 100), 1e-3, 1e4),
}

USUAL: dict[str, dict[str, Usual]] = {
    "Scenario": {
        "speed": SPEED,
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
        "sleeper_mass": Usual("mass", "kg", (30, 250), 1, 1e4, ((251, 700, WHOLE_SLEEPER),)),
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
        "rotary_inertia": Usual("inertia per length", "kg m", (0.02, 1), 1e-4, 100),
        "foot_distance": Usual("length", "mm", (50, 100), 1, 1000),
    },
    "HangingSleeper": {"void": Usual("length", "mm", (0.1, 5), 0.0, 50)},
    "Linear": {
        "stiffness": Usual("stiffness", "MN/m", (500, 5000), 0.1, 1e6, ((2e4, 1e6, NOT_LINEAR),)),
    },
    "Hertz": ELASTIC | {
        "impact_speed": Usual("speed", "m/s", (0.01, 1), 0.0, 20),
        "hysteresis": Usual("time per length", "s/m", (0.01, 2), 0.0, 100),
    },
    **dict.fromkeys(("Thornton", "Stronge", "JacksonGreen", "KogutEtsion"), ELASTIC | {
        "yield_force": Usual("force", "kN", (20, 400), 0.1, 1e4),
        "yield_strength": STRENGTH, "hardness": STRENGTH, "rail_hardness": STRENGTH, "wheel_hardness": STRENGTH,
    }),
    "Law": {"largest": Usual("length", "mm", (0.02, 5), 0.0, 50)},
    **dict.fromkeys(("Polach", "Fastsim", "KalkerLinear", "ShenHedrickElkins"), CREEP),
    "Cones": {
        "conicity": Usual("number", "", (0.01, 0.5), 0.0, 1), "arm": Usual("length", "m", (0.3, 1), 0.03, 5),
    },
    "WheelRail": {
        "gauge": Usual("length", "m", (0.6, 1.7), 0.06, 10),
        "flange_backs": Usual("length", "m", (0.5, 1.65), 0.05, 10),
    },
    "Step": {"height": HEIGHT},
    "CosineBump": {"height": HEIGHT, "length": WAVE},
    "DippedJoint": {
        "depth": HEIGHT, "length": WAVE, "angle": Usual("angle", "mrad", (1, 30), 0.0, 200),
    },
    "Weld": {"height": HEIGHT, "length": WAVE, "noise": NOISE},
    "Measured": {"noise": NOISE},
    "Spectrum": {
        "deviation": Usual("length", "mm", (0.3, 5), 0.0, 50),
        "patch": Usual("length", "mm", (2, 12), 0.1, 50),
    },
    "Corrugation": {"amplitude": HEIGHT, "wavelength": WAVE},
    "WheelFlat": {
        "depth": Usual("length", "mm", (0.05, 3), 0.0, 20),
        "length": Usual("length", "mm", (10, 150), 0.1, 500),
    },
    "OutOfRound": {"amplitudes": Usual("length", "mm", (0.005, 1), 0.0, 20), "noise": NOISE},
    "Repeated": {"period": WAVE},
    "Wheelsets": {"positions": Usual("length", "m", (1, 30), 0.0, 500)},
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
    "Site": {
        "spacing": SEATS["spacing"], "radius": WHEEL_RADIUS, "misfit": Usual("number", "", (0.001, 0.3), 0.0, 1),
        "trigger": Usual("time", "ms", (0.001, 10), 0.0, 1000),
        "unsprung_mass": Usual("mass", "kg", (300, 1000), 30, 3000, ((1001, 3000, WHOLE_WHEELSET),)),
        "static_force": Usual("force", "kN", (20, 150), 2, 500),
    },
    "Sensor": {"rate": Usual("frequency", "kHz", (0.2, 200), 0.02, 2000)},
    "AtSeat": {"x": Usual("length", "m", (0.1, 50), 0.0, 1000)},
    "AtPlace": {"x": Usual("length", "m", (0.1, 50), 0.0, 1000)},
    "BetweenPlaces": {"x1": Usual("length", "m", (0.1, 50), 0.0, 1000)},
    "AlongTrack": {
        "gain": Usual("number", "", (0.8, 1.25), 0.08, 2.4, (
            (1.7, 2.4, WHEEL_FOR_AXLE), (0.08, 0.6, AXLE_FOR_WHEEL), (400, 2500, KN_FOR_N), (4e-4, 2.5e-3, N_FOR_KN),
        )),
        "gain_uncertainty": Usual("number", "", (0.001, 0.2), 0.0, 0.5),
    },
    "DeckAcceleration": {
        "noise": Usual("acceleration noise density", "m/s^2/sqrt(Hz)", (1e-6, 0.1), 0.0, 10),
        "range": Usual("acceleration", "m/s^2", (5, 1e4), 0.05, 1e6),
        "cutoff": Usual("frequency", "Hz", (5, 2e4), 0.5, 1e6),
    },
}  # fmt: skip
"""Plausible values of the fields of each kind of noun. The limits are wide: models of wheels, decks and vehicles in the
literature and on laboratory rigs lie within them."""


def implausible_notes(scenario: Scenario) -> tuple[Note, ...]:
    """Return one note for each field of a scenario whose number is implausible: what it is, and what is usual."""
    way = scenario.speed * scenario.duration
    return (
        *(
            range_note(path, value, usual)
            for where, noun in _judged_nouns(scenario)
            for path, value, usual in (*_doubtful_numbers(where, noun), *_implausible_span(where, noun, way))
        ),
        *_constant_of_other_wheels(scenario),
    )


def site_notes(site: Site) -> tuple[Note, ...]:
    """Return notes on the implausible numbers of a site itself: one for each field, of its worst sensor."""
    found = [*_doubtful_numbers("", site), *_doubtful_numbers("sensor", site.sensor)]
    if site.track is not None:
        found += [one for where, noun in _of_track(site.track) for one in _doubtful_numbers(where, noun)]
        found += [] if site.contact is None else _doubtful_numbers("contact", site.contact)
    found += [
        (f"uncertainty.{path}", share, UNCERTAINTY)
        for path, share in site.uncertainty.items()
        if not is_plausible(share, UNCERTAINTY)
    ]
    notes = [range_note(*one) for one in found] + _astride_seats(site)
    fields: dict[str, list[tuple[str, float, Usual]]] = {}
    for number, sensor in enumerate(site.sensors):
        where = f"sensors.{number}"
        own = [*_doubtful_numbers(where, sensor)]
        begins, ends = sensor.ends or (0.0, 1.0)
        if not is_plausible(ends - begins, LENGTH_OF_SENSOR):
            own.append((f"the length of {where}", ends - begins, LENGTH_OF_SENSOR))
        for one in own:
            fields.setdefault(re.sub(r"\d+", "", one[0]), []).append(one)
    for several in fields.values():
        note = range_note(*max(several, key=lambda one: _oddness(one[1], one[2])))
        more = f" (the worst of {len(several)} such sensors)" if len(several) > 1 else ""
        notes.append(note.reworded(f"{note}{more}"))
    return tuple(notes)


def _astride_seats(site: Site) -> list[Note]:
    """Return a note on the pairs of gauges between which the site's track has a seat."""
    if site.track is None:
        return []
    first, spacing = float(site.track.first_sleeper), float(site.track.spacing)
    astride = [
        repr(one.name) for one in site.sensors
        if isinstance(one, BetweenPlaces)
        and ceil((one.x1 - first) / spacing + AT_SEAT) < (one.x2 - first) / spacing - AT_SEAT
    ]  # fmt: skip
    if not astride:
        return []
    words = f"by `track.first_sleeper` a seat lies between the gauges of {', '.join(astride)}: they read its force, too"
    return [Note(words, _cause_text("track.first_sleeper"))]


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
        usual = _usual(nouns.get(where)).get(field)
        if usual is None:
            continue
        doubted = changed[path][~is_plausible(changed[path], usual)].tolist()
        if doubted:
            worst = max(doubted, key=lambda value: _oddness(value, usual))
            notes.append(Shared(range_note(path, worst, usual), len(doubted)))
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
    yield from _of_track(scenario.track)
    yield "contact", scenario.contact
    yield "profiles", scenario.profiles
    if scenario.creep is not None:
        yield "creep", scenario.creep
    places = scenario.irregularity if isinstance(scenario.irregularity, Placement) else {"": scenario.irregularity}
    for place, items in places.items():
        for i, item in enumerate(items):
            yield from _and_what_it_repeats(".".join(part for part in ("irregularity", place, str(i)) if part), item)
    if isinstance(scenario.start, Noun):
        yield "start", scenario.start


def _of_track(track: Noun) -> Iterator[tuple[str, Noun]]:
    yield "track", track
    if isinstance(track, SupportedRail):
        yield "track.rail", track.rail
        for i, anomaly in enumerate(track.anomalies):
            yield f"track.anomalies.{i}", anomaly


def _and_what_it_repeats(where: str, item: Irregularity) -> Iterator[tuple[str, Noun]]:
    yield where, item
    if isinstance(item, Repeated):
        yield from _and_what_it_repeats(f"{where}.of", item.of)


def _doubtful_numbers(where: str, noun: Noun) -> Iterator[tuple[str, float, Usual]]:
    """Return the fields of a noun that hold an implausible number, with the first of these."""
    for field, usual in _usual(noun).items():
        given = getattr(noun, field)
        values = given if isinstance(given, tuple) else () if given is None else (given,)
        value = next((value for value in values if not is_plausible(value, usual)), None)
        if value is not None:
            yield (f"{where}.{field}" if where else field), value, usual


def _usual(noun: Noun | None) -> Mapping[str, Usual]:
    """Return what is usual for the fields of a noun, its own and those of what it is made of."""
    return ChainMap(*(USUAL.get(kind.__name__, {}) for kind in type(noun).__mro__))


def _implausible_span(where: str, noun: Noun, end: float) -> Iterator[tuple[str, float, Usual]]:
    """Return the span of samples, or of a user's function up to x = `end`, m, where it is implausible."""
    span = noun.span_given(end) if isinstance(noun, Irregularity) else None
    if span is not None and not is_plausible(span, SPAN):
        yield f"the span of {where}'s heights", span, SPAN


def _constant_of_other_wheels(scenario: Scenario) -> Iterator[Note]:
    """Return a note on a constant that is as large as one wheel's where a wheelset's is asked, or the other way round.

    It puts nothing in doubt: a softer wheelset may be meant.
    """
    contact, plane = scenario.contact, getattr(scenario.vehicle, "plane", None)
    if not isinstance(contact, ElasticContact) or contact.given is None or plane is None:
        return
    wheelset = plane.wheelsets[0]
    if wheelset.wheels != 2 or wheelset.mass < LEAST_WHEELSET:
        return
    one = contact_constant(wheelset.radius, contact.rail_radius, contact.youngs_modulus, contact.poisson)
    name = "constant" if contact.constant is not None else "constant_per_wheel"
    share = contact.given / one
    if (low_high := ONE_WHEEL.get(name)) and low_high[0] < share < low_high[1]:
        asked, other = ("a wheelset", "constant_per_wheel") if name == "constant" else ("one wheel", "constant")
        yield Note(
            f"contact.{name} = {contact.given:.6g} N/m^1.5 is taken as that of {asked}, but is {share:.3g} times what "
            f"radii and elastic constants give for one wheel, {one:.3g}: perhaps `{other}` is meant",
            _cause_text(f"contact.{name}"),
        )


def is_plausible(value: Any, usual: Usual) -> Any:
    """Return whether a number in SI units, or each of some, is within the limits and not likely another quantity."""
    size = abs(value) / UNITS[usual.dimension][usual.unit]
    known = (usual.least <= size) & (size <= usual.most)
    for low, high, _ in usual.mixups:
        known &= (size < low) | (size > high)
    return known | (size == 0.0) | (usual.zero & (size < NOTHING * usual.least))


def _mixup(size: float, usual: Usual) -> str | None:
    return next((words for low, high, words in usual.mixups if low <= size <= high), None)


def _oddness(value: float, usual: Usual) -> float:
    """Return how far a number is from what is usual."""
    middle = UNITS[usual.dimension][usual.unit] * sqrt(usual.usual[0] * usual.usual[1])
    return abs(log(max(abs(value), 1e-300) / middle))


def range_note(path: str, value: float, usual: Usual) -> Note:
    """Return the note on an implausible number."""
    si = f" {si_unit(usual.dimension)}".rstrip()
    low, high = usual.usual
    unit = f" {usual.unit}".rstrip()
    meant = _meant(value, usual)
    hint = f'; did you mean "{meant}"?' if meant else ""
    words = _mixup(abs(value) / UNITS[usual.dimension][usual.unit], usual)
    hint += f"; {words}" if words else ""
    text = f"{path} = {value:.6g}{si} is implausible: usual are {low:g} to {high:g}{unit}{hint}"
    return Note(text, _cause_text(path), doubtful=True)


def _cause_text(path: str) -> str:
    return f"implausible {path}"


def _meant(value: float, usual: Usual) -> str:
    """Return a number as it was probably written, with the metric unit with which it would be usual; "" if none is.

    It was written in SI units, or, where that number is too long for it, as a short one in another unit.
    """
    units = {unit: one for unit, one in UNITS[usual.dimension].items() if unit not in UNMEANT}
    low, high = (bound * UNITS[usual.dimension][usual.unit] for bound in usual.usual)
    written = [number for number in (value, *(value / one for one in units.values())) if _is_short(number)]
    numbers = [value] if value in written else [*written, value]
    found = [(number, unit) for number in numbers for unit, one in units.items() if low <= abs(number) * one <= high]
    first = next((one for one in found if one[1] == usual.unit and one[0] != value), next(iter(found), None))
    return "" if first is None else f"{first[0]:.6g} {first[1]}".strip()


def _is_short(number: float) -> bool:
    return WRITTEN[0] <= abs(number) < WRITTEN[1] and abs(float(f"{number:.4g}") / number - 1.0) < 1e-9
