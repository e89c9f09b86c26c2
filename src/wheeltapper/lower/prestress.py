"""What springs carry under a vehicle's weight, all bodies on wheelsets that do not move: how far they are pressed.

All springs are free at the same time, as if the vehicle were assembled without weight; those that only press may have
a force or a gap of their own under the static load. The sum of all energies is convex. Newton's method with the exact
minimum along each direction finds its only minimum, since the energy is quadratic in pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.freight import CompressionSpring
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
ROUNDS = 200
SETTLED = 1e-13
"""Largest change that ends the search, over the largest displacement."""
FAR = 1e3
"""How far beyond its corners a characteristic goes on, m."""


@dataclass(frozen=True, eq=False)
class OneWay:
    """A spring that only presses, and the row of what parts its ends; in the direction of pressing it is -`row`·q."""

    spring: CompressionSpring
    row: FloatArray

    @property
    def is_stated(self) -> bool:
        """Whether its force under the static load is stated."""
        return self.spring.preload is not None or self.spring.gap is not None

    @cached_property
    def corners(self) -> tuple[FloatArray, FloatArray]:
        """Its corners, of which the first is where it is free, and the last far beyond."""
        pressed, force = (np.array(values, dtype=float) for values in (self.spring.compression, self.spring.force))
        slope = (force[-1] - force[-2]) / (pressed[-1] - pressed[-2])
        return np.append(pressed, pressed[-1] + FAR), np.append(force, force[-1] + FAR * slope)

    def force(self, pressed: float) -> float:
        """Return its force, N, where it is pressed so far, m."""
        return float(np.interp(pressed, *self.corners, left=0.0))

    def slope(self, pressed: float) -> float:
        """Return the slope there; that of its first part where it is free."""
        places, force = self.corners
        piece = min(max(int(np.searchsorted(places, pressed, side="right")) - 1, 0), len(places) - 2)
        return float((force[piece + 1] - force[piece]) / (places[piece + 1] - places[piece]))

    def pressed_if_stated(self) -> float:
        """Return how far it is pressed under the static load, m, as stated; negative with a gap."""
        if self.spring.gap is not None:
            return -float(self.spring.gap)
        places, force = self.corners
        return float(np.interp(self.spring.preload or 0.0, force, places))

    def corners_about(self, pressed: float) -> tuple[FloatArray, FloatArray]:
        """Return the corners of what it pulls less than at rest, over how far its ends part from there, both rising."""
        places, force = self.corners
        held = self.force(pressed)
        return (pressed - places)[::-1], (held - force)[::-1]


class Prestress(NamedTuple):
    """The static state of a vehicle.

    Attributes
    ----------
    sinking
        (n,) displacements of bodies from where all springs are free, m; none of wheelsets.
    loads
        (n,) loads on the wheelsets, N.
    one_ways
        How far springs that only press are pressed, m.
    forces
        Their forces by name, N.
    weight
        Of the whole vehicle, N.
    """

    sinking: FloatArray
    loads: FloatArray
    one_ways: tuple[float, ...]
    forces: tuple[tuple[str, float], ...]
    weight: float

    def force_of(self, name: str) -> float:
        """Return the force of a spring that only presses, N."""
        return dict(self.forces)[name]


def prestress_of(
    motions: Sequence[tuple[str, str]], wheelsets: Sequence[str], stiffness: FloatArray, ties: FloatArray,
    gravity: FloatArray, one_ways: Sequence[OneWay],
) -> Prestress:  # fmt: skip
    """Return the static state of a vehicle whose linear springs have a stiffness matrix.

    Raises
    ------
    InputError
        If nothing holds a body.
    """
    on_wheels = np.array([body in wheelsets for body, _ in motions])
    free, count = ~on_wheels, int((~on_wheels).sum())
    stated = [one for one in one_ways if one.is_stated]
    found = [one for one in one_ways if not one.is_stated]
    weights = gravity + sum((one.row * one.force(one.pressed_if_stated()) for one in stated), np.zeros(len(gravity)))
    u, ties_pull = np.zeros(len(motions)), np.zeros(len(ties))
    for _ in range(ROUNDS):
        springs = [(one, float(-one.row @ u)) for one in found]
        touching = [(one, at) for one, at in springs if at >= 0.0]
        pulls = weights - stiffness @ u + sum((one.row * one.force(at) for one, at in touching), 0.0)
        try:
            step, ties_pull = _solved(_with(touching, stiffness), ties, pulls, free, count, motions)
        except InputError:  # what parted springs alone hold
            step, ties_pull = _solved(_with(springs, stiffness), ties, pulls, free, count, motions)
        share = _best_share(step, u, stiffness, weights, found)
        u = u + share * step
        if not found or np.abs(share * step).max(initial=0.0) <= SETTLED * max(np.abs(u).max(initial=0.0), 1e-9):
            break
    else:
        raise InputError("", "vehicle.elements", "springs that find no static state", "stiffer ones, or fewer corners")
    pressed = [one.pressed_if_stated() if one.is_stated else float(-one.row @ u) for one in one_ways]
    forces = tuple((one.spring.name, one.force(at)) for one, at in zip(one_ways, pressed, strict=True))
    carried = stiffness @ u + ties.T @ ties_pull
    carried = carried - sum((one.row * force for one, (_, force) in zip(one_ways, forces, strict=True)), 0.0)
    loads = np.where(on_wheels, gravity - carried, 0.0)
    return Prestress(u, loads, tuple(pressed), forces, float(np.abs(gravity).sum()))


def _with(springs: Sequence[tuple[OneWay, float]], stiffness: FloatArray) -> FloatArray:
    """Return a stiffness matrix with that of springs that only press, each pressed so far, m."""
    return np.asarray(sum((one.slope(at) * np.outer(one.row, one.row) for one, at in springs), stiffness))


def _solved(
    stiffness: FloatArray, ties: FloatArray, pulls: FloatArray, free: NDArray[np.bool_], count: int,
    motions: Sequence[tuple[str, str]],
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return how far bodies move under forces, (n,), and the forces of the ties."""
    held = ties[:, free]
    whole = np.block([[stiffness[np.ix_(free, free)], held.T], [held, np.zeros((len(held), len(held)))]])
    scale = np.sqrt(np.maximum(np.abs(np.diag(whole)), 1.0))
    scaled = whole / np.outer(scale, scale)
    if count and np.linalg.cond(scaled) > 1e13:
        loose = np.linalg.svd(scaled)[2][-1][:count]
        moving = [motion for motion, is_free in zip(motions, free, strict=True) if is_free]
        body, motion = moving[int(np.argmax(abs(loose)))]
        raise InputError(
            "", "vehicle.elements", f"nothing that holds {body!r} in {motion}", "springs or links that hold every body"
        )
    right = np.concatenate([pulls[free], np.zeros(len(held))]) / scale
    solution = np.linalg.solve(scaled, right) / scale if len(whole) else np.zeros(0)
    step = np.zeros(len(motions))
    step[free] = solution[:count]
    return step, solution[count:]


def _best_share(
    step: FloatArray, u: FloatArray, stiffness: FloatArray, weights: FloatArray, found: Sequence[OneWay]
) -> float:
    """Return the share of a step at which the energy is least: 1 where no spring changes its piece on the way."""

    def downhill(share: float) -> float:
        at = u + share * step
        springs = sum(float(one.row @ step) * one.force(float(-one.row @ at)) for one in found)
        return float(step @ (weights - stiffness @ at)) + springs

    pressed = [(float(-one.row @ u), float(-one.row @ (u + step))) for one in found]
    if all(
        min(ends) >= 0.0 and one.slope(ends[0]) == one.slope(ends[1]) for one, ends in zip(found, pressed, strict=True)
    ):
        return 1.0
    from scipy.optimize import brentq

    high = 1.0
    while downhill(high) > 0.0 and high < 1e6:
        high *= 2.0
    return float(brentq(downhill, 0.0, high, xtol=1e-15)) if downhill(0.0) > 0.0 >= downhill(high) else high
