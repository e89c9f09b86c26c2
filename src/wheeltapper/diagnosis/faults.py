"""The catalogue of faults: what each changes in a scenario, and the prior of its size.

The facts stand in docs/theory/diagnosis.rst, section 8.6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, pi
from typing import Any

from wheeltapper.describe.irregularity.flat import WheelFlat
from wheeltapper.describe.irregularity.out_of_round import OutOfRound
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.inference.problem import Prior
from wheeltapper.ground.errors import InputError, shown, suggested
from wheeltapper.ground.quantities import to_si
from wheeltapper.march import run
from wheeltapper.record.arguments import as_scenario

MASS, DAMPING, LOAD = "vehicle.mass", "vehicle.damping", "vehicle.load"
"""Paths of the fields that the faults of suspension, damper and load change."""
PLAIN = (MASS, DAMPING, LOAD)
"""Fields that the plain faults change: unsprung mass, damping and load. One fit with all three free serves all plain
faults."""
ADDED_MASS = 670.0
"""Mass of the bogie, kg, that moves with the wheelset after a primary spring has become a rigid link."""
ORDER = 12
"""Number of waves around the circumference of a wheel out of round, if none is given."""

Made = Callable[[Scenario, float, float], Scenario]
Believed = Callable[[Scenario], dict[str, Prior]]


@dataclass(frozen=True)
class Fault:
    """One fault of a wheelset.

    Attributes
    ----------
    name, part
        Name, and the part of the wheelset: "suspension", "damper", "wheel", "load".
    meaning
        One sentence for the reader of the finding.
    size, unit, usual
        What the size is, its unit, and its usual value.
    path
        Field of the faulty scenario that holds its size; "" where the size only scales other fields.
    made
        (passage, size, place) to the faulty passage; `place`, 0 to 1, is where on the wheel's circumference it is.
    believed
        From the healthy passage to the priors of the fields that the fault changes; they replace what the site states.
    plain
        Whether it changes only mass, damping and load.
    """

    name: str
    part: str
    meaning: str
    size: str
    unit: str
    usual: float
    path: str
    made: Made
    believed: Believed
    plain: bool = True

    def passage(self, healthy: Scenario, size: float | None = None, place: float = 0.5) -> Scenario:
        """Return a passage with this fault, of its usual size if none is given."""
        size = self.usual if size is None else to_si(size, "number", "size")
        if not isfinite(size):
            raise InputError("", "size", shown(size), "a finite number")
        return self.made(as_scenario(healthy), size, as_place(place))


def as_place(given: Any) -> float:
    """Return where on a wheel's circumference a fault is."""
    place = to_si(given, "number", "place")
    if not 0.0 <= place <= 1.0:
        raise InputError("", "place", shown(given), "a share of the wheel's circumference, 0 to 1")
    return place


# -- suspension and load ----------------------------------------------------------------------------------------------


def _heavier(passage: Scenario, added: float) -> Scenario:
    vehicle = passage.vehicle
    return passage.replaced({MASS: vehicle.mass + added, LOAD: vehicle.load - added * vehicle.gravity})


def _broken_spring(passage: Scenario) -> dict[str, Prior]:
    return {MASS: Prior(passage.vehicle.mass + ADDED_MASS, 0.03, "lognormal")}


def _scaled(path: str) -> Made:
    def made(passage: Scenario, size: float, _: float) -> Scenario:
        return passage.replaced({path: size * getattr(passage.vehicle, path.rpartition(".")[2])})

    return made


def _about(path: str, centre: float, deviation: float) -> Believed:
    def believed(passage: Scenario) -> dict[str, Prior]:
        held = getattr(passage.vehicle, path.rpartition(".")[2])
        return {path: Prior(centre * held, deviation, "lognormal")}

    return believed


# -- wheel ------------------------------------------------------------------------------------------------------------


def _with(passage: Scenario, item: Any) -> Scenario:
    return passage.replaced({"irregularity": (*passage.irregularity, item)})


def _flat(shape: str) -> Made:
    def made(passage: Scenario, size: float, place: float) -> Scenario:
        where = place * 2.0 * pi * passage.vehicle.radius
        return _with(passage, WheelFlat(length=size, position=where, shape=shape))

    return made


def _flat_believed(passage: Scenario) -> dict[str, Prior]:
    own = f"irregularity.{len(passage.irregularity)}"
    half = pi * passage.vehicle.radius
    return {f"{own}.length": Prior(0.04, 0.7, "lognormal"), f"{own}.position": Prior(half, half, "uniform")}


def out_of_round(passage: Scenario, amplitude: float, place: float, order: int = ORDER) -> Scenario:
    """Return a passage of a wheel with one harmonic of its circumference, m."""
    item = OutOfRound(
        orders=(order,), amplitudes=(amplitude,), position=place * 2.0 * pi * passage.vehicle.radius / order
    )
    return _with(passage, item)


def _out_of_round_believed(passage: Scenario) -> dict[str, Prior]:
    own = f"irregularity.{len(passage.irregularity)}"
    half = pi * passage.vehicle.radius
    return {f"{own}.amplitudes.0": Prior(1e-4, 1.0, "lognormal"), f"{own}.position": Prior(half, half, "uniform")}


# -- damper -----------------------------------------------------------------------------------------------------------


def _play(passage: Scenario, size: float, place: float) -> Scenario:
    return passage.replaced({"vehicle.damper_play": size, "vehicle.damper_play_start": 2.0 * place - 1.0})


def _play_believed(_: Scenario) -> dict[str, Prior]:
    return {
        "vehicle.damper_play": Prior(6e-5, 1.2, "lognormal"),
        "vehicle.damper_play_start": Prior(0.0, 1.0, "uniform"),
    }


def _bush(passage: Scenario, size: float, _: float) -> Scenario:
    return passage.replaced({"vehicle.bush_stiffness": size})


def _bush_believed(_: Scenario) -> dict[str, Prior]:
    return {"vehicle.bush_stiffness": Prior(1e7, 1.2, "lognormal")}


# -- the coach --------------------------------------------------------------------------------------------------------


def imbalance(passage: Scenario, aside: float) -> Scenario:
    """Return a coach's passage with its car body's centre of gravity moved to the left by `aside`, m."""
    run.choose(run.IMBALANCE, passage.needs)
    x, y, z = passage.vehicle.bodies[0].position
    return passage.replaced({"vehicle.bodies.0.position": (x, y + aside, z)})


CATALOGUE: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault(
            "broken spring", "suspension",
            "a primary spring is broken and has become a rigid link: part of the bogie bounces with the wheelset",
            "added mass", "kg", ADDED_MASS, MASS, lambda passage, size, _: _heavier(passage, size), _broken_spring,
        ),
        Fault(
            "lost damper", "damper", "a primary damper does next to nothing",
            "damping over the healthy one's", "", 0.2, DAMPING, _scaled(DAMPING), _about(DAMPING, 0.15, 0.6),
        ),
        Fault(
            "weak damper", "damper", "a primary damper does less than it should",
            "damping over the healthy one's", "", 0.7, DAMPING, _scaled(DAMPING), _about(DAMPING, 0.65, 0.25),
        ),
        Fault(
            "mass deviation", "suspension", "the unsprung mass is not the stated one",
            "mass over the healthy one", "", 1.1, MASS, _scaled(MASS), _about(MASS, 1.0, 0.12),
        ),
        Fault(
            "load deviation", "load", "the wheelset carries another load than stated",
            "load over the stated one", "", 1.5, LOAD, _scaled(LOAD), _about(LOAD, 1.0, 0.5),
        ),
        Fault(
            "free play", "damper", "the damper has play at its ends and acts only where they strike",
            "half the play", "m", 5e-5, "vehicle.damper_play", _play, _play_believed, plain=False,
        ),
        Fault(
            "soft bush", "damper", "the damper acts through a soft bush, only below some frequency",
            "stiffness of the bush", "N/m", 1e7, "vehicle.bush_stiffness", _bush, _bush_believed, plain=False,
        ),
        Fault(
            "wheel flat", "wheel", "a tread has a fresh flat",
            "length", "m", 0.04, "irregularity.-1.length", _flat("fresh"), _flat_believed, plain=False,
        ),
        Fault(
            "rounded flat", "wheel", "a tread has a flat that wear has rounded",
            "length", "m", 0.06, "irregularity.-1.length", _flat("rounded"), _flat_believed, plain=False,
        ),
        Fault(
            "out of round", "wheel", f"a wheel is out of round with order {ORDER} or another one",
            "amplitude", "m", 1e-4, "irregularity.-1.amplitudes.0",
            lambda passage, size, place: out_of_round(passage, size, place), _out_of_round_believed, plain=False,
        ),
    )
}  # fmt: skip
"""The faults of a wheelset, by name."""


def fault_named(name: str) -> Fault:
    """Return a fault of the catalogue."""
    if not isinstance(name, str) or name not in CATALOGUE:
        raise InputError("", "fault", shown(name), suggested(str(name), CATALOGUE))
    return CATALOGUE[name]
