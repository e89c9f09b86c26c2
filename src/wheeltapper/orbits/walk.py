"""A walk along a branch of orbits: steps along its tangent, and Newton's method back to it, round folds.

A point is (state, s), s the logarithm of the parameter where its range is positive. From a point a step goes along the
branch's tangent; Newton's method returns to the branch in the plane across it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.progress import report
from wheeltapper.orbits.section_map import BESIDE, CLOSED, Image, SectionMap

FloatArray = NDArray[np.float64]
FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 0.01, 0.06, 1e-7
"""Lengths of steps along the branch, in static indentations and in the logarithm of the parameter."""
TURN = 0.97
"""Smallest cosine of the angle between the tangents at two neighbouring points."""
CHANGE = 0.3
"""Largest change of a test function between two neighbouring points."""
GOAL, LONGER = 0.7, 1.5
"""What of this a step should use, and the largest ratio of two steps in a row."""
ITERATIONS = 8
"""Largest number of Newton's steps in one plane."""
ASTRAY = 0.5
"""Distance from the range of the parameter, as the branch measures it, beyond which Newton's method is lost."""
HARD = 5
"""A point that needed so many of them makes the next step shorter."""
ROUGH = 1e-5
"""Distance from the branch below which the derivative by the parameter is not computed anew."""
CLOSED_BRANCH = "the branch closes"
"""Why a branch ends that has no ends."""
KEPT = 100
"""Points after which a branch is written to its file each time."""
SHORTER = 0.5
"""Distance, in static indentations, that is left to an orbit of fewer waves at the last point before it."""
MOST_POINTS = 20_000
"""Largest number of points in each direction."""


@dataclass(frozen=True)
class Point:
    """A point of a branch.

    Attributes
    ----------
    place
        (n + 1,) state of the map, and the parameter as the branch measures it.
    image
        Image of the state.
    tangent
        (n + 1,) direction of the branch, of length one.
    iterations
        Number of Newton's steps that found it.
    """

    place: FloatArray
    image: Image
    tangent: FloatArray
    iterations: int = 0

    def turned(self) -> Point:
        """Return the point with the opposite tangent."""
        return Point(self.place, self.image, -self.tangent, self.iterations)

    @cached_property
    def tests(self) -> FloatArray:
        """Functions that change their sign at a fold, at a doubling and at a torus."""
        slopes = self.image.slopes
        one = np.eye(len(slopes))
        fold, doubling = np.linalg.det(slopes - one), np.linalg.det(slopes + one)
        return np.array([fold, doubling, np.linalg.det(pairs_of(slopes) - np.eye(6)) if len(slopes) == 4 else 1.0])


def pairs_of(matrix: FloatArray) -> FloatArray:
    """Return the second compound of a (4, 4) matrix: its eigenvalues are the products of pairs of the matrix's."""
    first, second = np.triu_indices(4, 1)
    rows = matrix[first][:, first], matrix[first][:, second], matrix[second][:, first], matrix[second][:, second]
    return np.asarray(rows[0] * rows[3] - rows[1] * rows[2])


class Branch:
    """The curve of the orbits of a map with one parameter.

    Parameters
    ----------
    each
        The map.
    low, high
        Range of the parameter, SI units.
    """

    def __init__(self, each: SectionMap, low: float, high: float) -> None:
        self.each, self.low, self.high = each, low, high
        self.logarithmic = low > 0.0
        self._unit = 1.0 if self.logarithmic else max(abs(low), abs(high))

    def value(self, place: FloatArray) -> float:
        """Return the parameter at a place."""
        return float(np.exp(place[-1]) if self.logarithmic else place[-1] * self._unit)

    def measure(self, value: float) -> float:
        """Return the parameter as the branch measures it."""
        return float(np.log(value) if self.logarithmic else value / self._unit)

    def along(self, place: FloatArray) -> FloatArray:
        """Return the derivative of the image by the parameter, (n,), at a place."""
        less, more = (self.value(place + change * np.eye(len(place))[-1]) for change in (-BESIDE, BESIDE))
        ends = self.each.side_by_side(np.array([[less], [more]]), np.array([place[:-1], place[:-1]]))
        return np.asarray((ends[1] - ends[0]) / (2.0 * BESIDE))

    def corrected(self, guess: FloatArray, normal: FloatArray, like: FloatArray) -> Point | None:
        """Return the point of the branch in the plane across `normal` through a guess; its tangent is like another."""
        place, best, one = guess.copy(), np.inf, np.eye(len(guess) - 1)
        along = self.along(guess)
        for iteration in range(ITERATIONS + 1):
            if not self.measure(self.low) - ASTRAY <= place[-1] <= self.measure(self.high) + ASTRAY:
                return None
            wave = self.each.wave_at(self.value(place))
            image = self.each.image(wave, place[:-1])
            off = image.state - place[:-1]
            size = float(np.abs(off).max())
            if not np.isfinite(size) or not np.all(np.isfinite(image.slopes)) or size > 10.0 * max(best, 1e-3):
                return None
            slopes = np.column_stack([image.slopes - one, along])
            if size <= 0.1 * CLOSED or (size <= CLOSED and size >= 0.5 * best):
                return Point(place, image, _tangent(slopes, like), iteration)
            best = min(best, size)
            if iteration > 0 and size > ROUGH:
                along = self.along(place)
                slopes[:, -1] = along
            try:
                place = place - np.linalg.solve(np.vstack([slopes, normal]), np.append(off, normal @ (place - guess)))
            except np.linalg.LinAlgError:
                return None
        return None

    def point_at(self, place: FloatArray, like: FloatArray) -> Point:
        """Return a place that is known to be on the branch as a point."""
        wave = self.each.wave_at(self.value(place))
        image = self.each.image(wave, place[:-1])
        slopes = np.column_stack([image.slopes - np.eye(len(place) - 1), self.along(place)])
        return Point(place, image, _tangent(slopes, like))

    def at_value(self, guess: FloatArray, value: float, like: FloatArray) -> Point | None:
        """Return the point at a value of the parameter, near a guess."""
        start = np.append(guess[:-1], self.measure(value))
        return self.corrected(start, np.eye(len(guess))[-1], like)


def _tangent(slopes: FloatArray, like: FloatArray) -> FloatArray:
    """Return the direction in which nothing changes, turned like another one."""
    direction = np.linalg.svd(slopes)[2][-1]
    return np.asarray(direction if direction @ like >= 0.0 else -direction)


@dataclass(frozen=True)
class Walk:
    """Points in one direction, and why there are no more."""

    points: list[Point]
    ended: str


def walk(
    branch: Branch, points: list[Point], most: int = MOST_POINTS, keep: Callable[[list[Point]], None] | None = None
) -> Walk:
    """Go along a branch from the last of some points in the direction of its tangent, up to a bound of the parameter.

    `keep` is given all points now and then.
    """
    points, step, bend = [*points], FIRST_STEP, np.zeros_like(points[0].place)
    bounds = branch.measure(branch.low), branch.measure(branch.high)
    while len(points) < most:
        here = points[-1]
        guess = here.place + step * (here.tangent + 0.5 * step * bend)
        new = branch.corrected(guess, here.tangent, here.tangent)
        use = np.inf if new is None else _use(here, new, step)
        if new is None or use > 1.0:
            step *= 0.5
            bend *= 0.0 if new is None else 1.0
            if step < SHORTEST_STEP:
                return Walk(points, "no orbit was found beside the last one")
            continue
        if not bounds[0] <= new.place[-1] <= bounds[1]:
            last = _at_bound(branch, here, new, bounds)
            return Walk([*points, last] if last is not None else points, "the bound of the parameter is reached")
        points.append(new)
        report("following", branch.value(new.place), 0.0)
        if keep is not None and len(points) % KEPT == 0:
            keep(points)
        if shorter_between(here, new):
            return Walk(points, "it is an orbit of fewer waves, and goes on as its own copy, some waves later")
        if _closes(points, step):
            return Walk(points, CLOSED_BRANCH)
        bend = (new.tangent - here.tangent) / float(np.linalg.norm(new.place - here.place))
        step = min(step * min(LONGER, (GOAL / use) if new.iterations < HARD else 0.7), LONGEST_STEP)
    return Walk(points, f"{most} points are made")


def _use(here: Point, new: Point, step: float) -> float:
    """Return how far a step uses what it may: beyond one, something could hide between its ends."""
    turn = max((1.0 - float(here.tangent @ new.tangent)) / (1.0 - TURN), 0.0)
    scale = CHANGE * np.maximum(1.0, np.minimum(np.abs(new.tests), np.abs(here.tests)))
    change = float((np.abs(new.tests - here.tests) / scale).max())
    if abs(here.image.losses - new.image.losses) > 1 and step > 1e-4:
        return np.inf
    return float(max(turn**0.5, change, 1e-3))


def _at_bound(branch: Branch, here: Point, new: Point, bounds: tuple[float, float]) -> Point | None:
    """Return the point between two at which the parameter is at its bound."""
    bound = bounds[0] if new.place[-1] < bounds[0] else bounds[1]
    part = (bound - here.place[-1]) / (new.place[-1] - here.place[-1])
    guess = here.place + part * (new.place - here.place)
    if part <= 0.0:
        return None
    return branch.at_value(guess, branch.low if bound == bounds[0] else branch.high, here.tangent)


def shorter_between(here: Point, new: Point) -> int:
    """Return after how many of its waves the orbit repeats somewhere between two points; 0: after all of them only."""
    waves = len(new.image.trail)
    for many in (part for part in range(1, waves) if waves % part == 0):
        before, after = (point.image.trail[many - 1] - point.place[:-1] for point in (here, new))
        if before @ after < 0.0 and min(np.linalg.norm(before), np.linalg.norm(after)) < SHORTER:
            return many
    return 0


def _closes(points: list[Point], step: float) -> bool:
    """Return True if the last point is where the first one was, on the way on."""
    if len(points) < 20:
        return False
    first, last = points[0], points[-1]
    away = first.place - last.place
    return bool(np.linalg.norm(away) <= step and away @ last.tangent >= 0.0 and first.tangent @ last.tangent > TURN)
