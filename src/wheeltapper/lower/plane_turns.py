"""Derivatives of the system that a vehicle in the plane is lowered to, with respect to one of its fields.

Matrices of the vehicle, static forces and numbers of the laws are polynomials of a field, or smooth: their central
differences of sixth order are exact but for rounding. Paths change as everywhere (`bends.py`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.paths import keys_of, plain_path, with_value
from wheeltapper.describe.placement import Placement, parsed_place
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import DECK
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.first_order import STEP, WEIGHTS
from wheeltapper.lower.lowered.plane import LoweredPlane
from wheeltapper.lower.many import shapes_the_path
from wheeltapper.lower.paths.bends import table_tangent
from wheeltapper.lower.plane import on_wheels
from wheeltapper.march.general.contract import Bodies
from wheeltapper.march.general.turned import SystemTurn

FloatArray = NDArray[np.float64]
MATRICES = "mass", "damping", "stiffness", "raised", "guides"
"""What a field may change of the bodies."""
OFFERED = "a field of the vehicle, a deck, the contact, the start or the irregularity, the speed or the duration"
"""With respect to what features of such runs are differentiated."""


def turn_along(scenario: Scenario, path: str, lowered: LoweredPlane) -> SystemTurn:
    """Return the derivatives of a lowered scenario's system with respect to a field.

    Raises
    ------
    InputError
        If the field changes what is not differentiated.
    """
    what = not_turned(scenario, path)
    if what:
        raise InputError("", path, f"{what}: `gradient` does not differentiate with respect to it", OFFERED)
    path = plain_path(scenario, path)
    system = lowered.program.system
    held = [getattr(system.bodies, name) for name in MATRICES]
    wheels = len(system.contacts)
    changes = path.startswith(("vehicle.", "contact.", "start.", "track."))
    mass, damping, stiffness, raised, guides, static, laws = (
        _difference(scenario, path, lowered) if changes else (*(0.0 * one for one in held), *np.zeros((2, wheels)))
    )
    shapes = system.bodies.shapes
    bodies = Bodies(mass, damping, stiffness, 0.0 * shapes, shapes @ static, raised, guides=guides)
    paths = tuple(_bent(scenario, path, number, lowered) for number in range(1, wheels + 1))
    return SystemTurn(
        bodies, static, tuple(np.atleast_1d(laws[i]) for i in range(wheels)), paths, float(path == "speed")
    )


def not_turned(scenario: Scenario, path: str) -> str:
    """Return what a field changes, if tangents do not tell the derivatives by it; else nothing."""
    head, *rest = path.split(".")
    if head == "track" and DECK not in scenario.needs:
        return "a field of the track, which changes its modes"
    if head == "contact" and isinstance(scenario.contact, ForceLaw):
        return "a field of a law of one's own, which changes its table"
    if head == "vehicle" and (rest[0] == "positions" or rest[-1] == "wheelbase"):
        return "a distance between wheelsets, which moves them along the track"
    if path == "speed" and scenario.speed == 0.0:
        return "a speed of 0 m/s, at which nothing is rolled over"
    return ""


def _difference(scenario: Scenario, path: str, lowered: LoweredPlane) -> tuple[FloatArray, ...]:
    """Return derivatives of the bodies' matrices, static forces and laws of one rail's part of the vehicle."""
    held = float(Fields(scenario)(path))
    step, rails = STEP * abs(held) or 1.0, lowered.force

    def numbers_at(k: int) -> tuple[FloatArray, ...]:
        near = on_wheels(with_value(scenario, keys_of(scenario, path), held + k * step))
        laws = np.zeros((len(near.laws), 2))
        for row, law in zip(laws, near.laws, strict=True):
            if not isinstance(scenario.contact, ForceLaw):
                row[: len(law.numbers)] = law.numbers
        return *(getattr(near.bodies, name) for name in MATRICES), near.static_force / rails, laws

    near = {k: numbers_at(k) for k in (*WEIGHTS, *(-k for k in WEIGHTS))}
    return tuple(
        np.asarray(sum(weight * (near[k][n] - near[-k][n]) for k, weight in WEIGHTS.items()) / step)
        for n in range(len(MATRICES) + 2)
    )


def _bent(scenario: Scenario, path: str, number: int, lowered: LoweredPlane) -> FloatArray | None:
    """Return the derivatives of the pieces of a wheelset's path; None where they do not change."""
    wheelset = lowered.plane.wheelsets[number - 1]
    own = _own_path(scenario, path, number)
    items = scenario.irregularities_on(number, "left")
    alone = scenario.model_copy(update={"vehicle": wheelset, "irregularity": items})
    if own is None or not items or not shapes_the_path(alone, own):
        return None
    return table_tangent(alone, own, lowered.paths[number - 1], -lowered.plane.positions[number - 1])


def _own_path(scenario: Scenario, path: str, number: int) -> str | None:
    """Return the path of a field for a wheelset alone; None where it is not one of its own."""
    head, *rest = path.split(".")
    if head == "vehicle" and rest[0] == "wheelsets":
        return ".".join(["vehicle", *rest[2:]]) if int(rest[1]) == number - 1 else None
    if head == "irregularity" and isinstance(scenario.irregularity, Placement):
        return _own_place(scenario.irregularity, rest, number)
    return path


def _own_place(placement: Placement, rest: list[str], number: int) -> str | None:
    """Return the path of a field of an irregularity at a place among those that a wheelset meets."""
    where, index, *field = rest
    before = 0
    for place, items in placement.items():
        meets = parsed_place(place)[0] in (None, number)
        if place == where:
            return ".".join(["irregularity", str(before + int(index)), *field]) if meets else None
        before += len(items) if meets else 0
    return None
