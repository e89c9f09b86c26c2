"""Special points of a branch: folds, period doublings, tori, and orbits that just touch a loss of contact."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.section import Section
from wheeltapper.orbits.orbit import multipliers_of
from wheeltapper.orbits.section_map import CLOSED, SectionMap
from wheeltapper.orbits.walk import Branch, Point, shorter_between, walk

FloatArray = NDArray[np.float64]
FOLD, DOUBLING, TORUS = range(3)
KINDS = ("fold", "doubling", "torus")
LOW = 0.3
"""Value of a test function below which it may pass zero twice between two points."""
CLEAR = 0.25
"""Part of the smallest known value above which the lowest value of a parabola shows that a test function stays clear of
zero."""
AROUND = 30
"""Points that are computed to both sides of where a special point is expected."""
HALVINGS = 60
"""Largest number of bisections."""
NARROW = 1e-11
"""Width of the part of a step in which a special point is, at the end."""
BEYOND = 0.2
"""Part of a step in which a special point is looked for beyond its ends."""
CHORDS = 60
"""Largest number of steps with frozen derivatives."""


@dataclass(frozen=True)
class Special:
    """A special point: its kind, its place, and the number of the point of the branch before it."""

    kind: str
    place: FloatArray
    after: int


def special_points(branch: Branch, points: list[Point]) -> list[Special]:
    """Return the special points between the points of a branch, located with the strict method."""
    section = branch.each.section
    if section.method != "strict":
        section = Section(section.given, "strict")
    exact = Branch(SectionMap(section, branch.each.waves, branch.each.paths), branch.low, branch.high)
    found = [*_sign_changes(exact, points), *_touches(exact, points), *_births(exact, points)]
    return [one for _, one in sorted(found, key=lambda pair: pair[0])]


class _Between:
    """The branch between two neighbouring points, by the part of the way from one to the other."""

    def __init__(self, branch: Branch, before: Point, after: Point) -> None:
        self.branch, self.before, self.after = branch, before, after
        self.chord = after.place - before.place
        self.normal = self.chord / np.linalg.norm(self.chord)

    def point(self, part: float) -> Point:
        """Return the point across the given part of the way."""
        guess = self.before.place + part * self.chord
        found = self.branch.corrected(guess, self.normal, self.before.tangent)
        if found is None:  # the nearest that is known
            return self.before if part < 0.5 else self.after
        return found

    def touch(self) -> Point | None:
        """Return where the number of losses changes, by bisection with derivatives from beside."""
        for low, high in ((0.0, 1.0), (-BEYOND, 1.0 + BEYOND)):  # the strict method may move it just over an end
            frozen = self.point(low)
            many = frozen.image.losses
            if self.point(high).image.losses != many:
                break
        else:
            return None
        inverse = self._inverse(frozen)
        place = frozen.place
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            guess = self.before.place + middle * self.chord
            place, losses = self._chord_point(guess, inverse, place)
            if losses == many:
                low = middle
                nearer = self.point(low) if high - low > 1e-3 else frozen
                if nearer is not frozen and nearer.image.losses == many:
                    frozen, inverse = nearer, self._inverse(nearer)
            else:
                high = middle
            if high - low <= NARROW:
                break
        return Point(place, frozen.image, frozen.tangent)

    def _inverse(self, point: Point) -> FloatArray:
        """Return the inverse of the derivatives of the equations in a plane across the step."""
        slopes = np.column_stack([point.image.slopes - np.eye(len(point.place) - 1), self.branch.along(point.place)])
        return np.asarray(np.linalg.inv(np.vstack([slopes, self.normal])))

    def _chord_point(self, guess: FloatArray, inverse: FloatArray, start: FloatArray) -> tuple[FloatArray, int]:
        """Return the place across a guess, and its losses, by Newton's method with given derivatives."""
        branch, each = self.branch, self.branch.each
        place = start + self.normal * (self.normal @ (guess - start))
        for _ in range(CHORDS):
            state, losses = each.losses(each.wave_at(branch.value(place)), place[:-1])
            off = state - place[:-1]
            if not np.all(np.isfinite(off)) or np.abs(off).max() <= 0.1 * CLOSED:
                break
            place = place - inverse @ np.append(off, self.normal @ (place - guess))
        return place, losses


def _sign_changes(branch: Branch, points: list[Point]) -> Iterator[tuple[float, Special]]:
    """Yield where a test function changes its sign, with the place along the branch."""
    for kind in range(len(KINDS)):
        for i, part, point in _roots(branch, points, kind):
            name = _kind_there(branch, point, kind)
            if name:
                yield i + part, Special(name, point.place, i)


def _roots(branch: Branch, points: list[Point], kind: int) -> Iterator[tuple[int, float, Point]]:
    """Yield the roots of a test function: step, part of the step, and point."""
    tests = np.array([point.tests[kind] for point in points])
    for i in range(len(points) - 1):
        step = _Between(branch, points[i], points[i + 1])
        if tests[i] * tests[i + 1] < 0.0:
            yield i, *_root(step, kind, 0.0, 1.0)
            continue
        turning = _lowest(step, kind, tests, i)
        if turning is not None:
            yield i, *_root(step, kind, 0.0, turning)
            yield i, *_root(step, kind, turning, 1.0)


def _lowest(step: _Between, kind: int, tests: FloatArray, i: int) -> float | None:
    """Return where between two points a test function has another sign than at both; None where it has not."""
    sizes = np.abs(tests)
    before, after = np.inf if i == 0 else sizes[i - 1], np.inf if i + 2 == len(tests) else sizes[i + 2]
    if min(sizes[i : i + 2]) > LOW or min(before, after) < min(sizes[i : i + 2]):
        return None
    sign = float(np.sign(tests[i]))
    ends, middle = sizes[i : i + 2], sign * float(step.point(0.5).tests[kind])
    if middle < 0.0:
        return 0.5
    bend = ends.sum() - 2.0 * middle  # of the parabola through the three
    if bend <= 0.0 or middle - (ends[1] - ends[0]) ** 2 / (16.0 * bend) > CLEAR * min(*ends, middle):
        return None
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(lambda part: sign * step.point(part).tests[kind], bounds=(0.0, 1.0), method="bounded")
    return float(found.x) if found.fun < 0.0 else None


def _root(step: _Between, kind: int, low: float, high: float) -> tuple[float, Point]:
    """Return the root of a test function between two parts of a step."""
    from scipy.optimize import brentq

    def test(part: float) -> float:
        return float(step.point(part).tests[kind])

    if test(low) * test(high) > 0.0:  # the strict method moves it just over the end
        part = low if abs(test(low)) < abs(test(high)) else high
        return part, step.point(part)
    part = float(brentq(test, low, high, xtol=NARROW, rtol=1e-12))
    return part, step.point(part)


def _births(branch: Branch, points: list[Point]) -> Iterator[tuple[float, Special]]:
    """Yield where the orbit is one of fewer waves, which doubles its period there: found on the branch of that one."""
    for i in range(len(points) - 1):
        many = shorter_between(points[i], points[i + 1])
        if many:
            middle = 0.5 * (points[i].place + points[i + 1].place)
            shorter = Branch(SectionMap(branch.each.section, many, branch.each.paths), branch.low, branch.high)
            found = nearest_special(shorter, middle, KINDS[DOUBLING])
            if found is not None:
                yield i + 0.5, Special(found.kind, found.place, i)


def nearest_special(branch: Branch, expected: FloatArray, kind: str) -> Special | None:
    """Return the special point of a kind nearest to a place."""
    first = _point_near(branch, expected)
    if first is None:
        return None
    down, up = (walk(branch, [start], AROUND).points for start in (first.turned(), first))
    points = [*(point.turned() for point in reversed(down[1:])), *up]
    found = [one for one in special_points(branch, points) if one.kind == kind]
    away = [float(np.linalg.norm(one.place - expected)) for one in found]
    return found[int(np.argmin(away))] if found else None


def _point_near(branch: Branch, expected: FloatArray) -> Point | None:
    """Return a point of the branch near a place, across one of the axes."""
    for axis in reversed(range(len(expected))):
        normal = np.eye(len(expected))[axis]
        found = branch.corrected(expected, normal, normal)
        if found is not None:
            return found
    return None


def _kind_there(branch: Branch, point: Point, kind: int) -> str:
    """Return what a root of a test function is; "" if it is nothing that orbits do there."""
    if kind == TORUS:
        values = multipliers_of(point.image.slopes)
        on_circle = values[np.argmin(np.abs(np.abs(values) - 1.0))]
        return KINDS[TORUS] if abs(on_circle.imag) > 1e-6 else ""
    return KINDS[kind]


def _touches(branch: Branch, points: list[Point]) -> Iterator[tuple[float, Special]]:
    """Yield where a loss of contact appears or vanishes, with the place along the branch."""
    for i in range(len(points) - 1):
        if points[i].image.losses != points[i + 1].image.losses:
            step = _Between(branch, points[i], points[i + 1])
            point = step.touch()
            if point is not None:
                part = float(step.normal @ (point.place - points[i].place) / np.linalg.norm(step.chord))
                yield i + part, Special("grazing", point.place, i)
