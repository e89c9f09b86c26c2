"""A profile to roll over: its smooth cells, its corners, and where a circle touches inside a cell."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course, Harmonic, Polynomials
from wheeltapper.lower.fit import Function
from wheeltapper.lower.point import Placed, cells, total

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Cell:
    """A smooth cell of the profile between two borders."""

    start: float
    end: float
    value: Function
    slope: Function
    curvature: Function
    flat: bool
    knots: FloatArray

    @staticmethod
    def of(start: float, end: float, present: list[Placed]) -> Cell:
        """Return the cell where these stretches are summed."""
        flat = all(isinstance(f := p.stretch.exact, Harmonic) and f.level for p in present)
        knots = [p.stretch.exact.breaks + p.shift for p in present if isinstance(p.stretch.exact, Polynomials)]
        inside = np.concatenate([k[(k > start) & (k < end)] for k in knots]) if knots else np.empty(0)
        return Cell(
            start, end, total(present, "value"), total(present, "slope"), total(present, "curvature"), flat,
            np.unique(inside),
        )  # fmt: skip


@dataclass(frozen=True)
class Corner:
    """A border of two cells: where it is, its upper height, and the slopes before and after it."""

    position: float
    height: float
    before: float
    after: float

    @property
    def juts_out(self) -> bool:
        """True where the wheel can roll about this corner."""
        return self.before > self.after + 1e-12


def value_at(function: Function, x: float) -> float:
    """Return one value of a vectorised function."""
    return float(function(np.array([x]))[0])


def _corner(left: Cell, right: Cell, height: float) -> Corner:
    x = right.start
    low, high = value_at(left.value, x), value_at(right.value, x)
    before, after = value_at(left.slope, x), value_at(right.slope, x)
    if abs(high - low) > 1e-12 * height:
        before, after = (inf, after) if high > low else (before, -inf)
    return Corner(x, max(low, high), before, after)


class Profile:
    """A profile to roll over: its cells, its corners, and the circle."""

    def __init__(self, courses: list[Course], start: float, end: float, radius: float, height: float) -> None:
        self.cells = [Cell.of(*cell) for cell in cells(courses, start, end)]
        self.corners = [_corner(a, b, height) for a, b in zip(self.cells[:-1], self.cells[1:], strict=True)]
        self.radius = radius
        self.start, self.end = start, end
        self.borders = np.array([corner.position for corner in self.corners])

    def each(self, s: FloatArray, cell: IntArray, which: str) -> FloatArray:
        """Return a property of the profile at s, each in the given cell."""
        if len(s) and cell[0] == cell[-1] and np.all(cell == cell[0]):
            return np.asarray(getattr(self.cells[cell[0]], which)(s))
        out = np.empty_like(s)
        order = np.argsort(cell, kind="stable")
        bounds = np.flatnonzero(np.diff(cell[order])) + 1
        for group in np.split(order, bounds):
            if len(group):
                out[group] = getattr(self.cells[cell[group[0]]], which)(s[group])
        return out

    def drop(self, u: FloatArray) -> FloatArray:
        """Return sqrt(R² - u²) - R without cancellation."""
        return -(u**2) / (self.radius + np.sqrt(self.radius**2 - u**2))

    def lean(self, u: FloatArray) -> FloatArray:
        """Return u/sqrt(R² - u²), the slope at which the circle touches at the offset u."""
        return np.asarray(u / np.sqrt(self.radius**2 - u**2))

    def touching(self, s: FloatArray, cell: int) -> FloatArray:
        """Return the wheel's places at which it touches at s."""
        slope = self.cells[cell].slope(s)
        return np.asarray(s - self.radius * slope / np.sqrt(1.0 + slope**2))

    def is_outer(self, s: FloatArray, cell: int) -> NDArray[np.bool_]:
        """Return True where the circle that touches at s lies above the profile nearby: the place rises with s."""
        slope = self.cells[cell].slope(s)
        return np.asarray(self.radius * self.cells[cell].curvature(s) < (1.0 + slope**2) ** 1.5)

    def offset(self, slope: float) -> float:
        """Return the offset u at which the circle touches a slope."""
        return (
            self.radius if slope == inf else -self.radius if slope == -inf else self.radius * slope / sqrt(1 + slope**2)
        )

    def sharpen(self, x0: FloatArray, s: FloatArray, lo: FloatArray, hi: FloatArray, cell: IntArray) -> FloatArray:
        """Return the contact inside [lo, hi] of one cell each, where p' - lean falls through zero (else an end)."""
        lo, hi, s = lo.copy(), hi.copy(), np.clip(s, lo, hi)
        active = np.arange(len(s))
        for _ in range(80):
            at, cells_at = s[active], cell[active]
            u = at - x0[active]
            root = np.sqrt(self.radius**2 - u**2)
            g = self.each(at, cells_at, "slope") - u / root
            bend = self.each(at, cells_at, "curvature") - self.radius**2 / root**3
            up = g > 0
            lo[active[up]] = at[up]
            hi[active[~up]] = at[~up]
            new = at - g / np.where(bend == 0, -1.0, bend)
            outside = ~((new >= lo[active]) & (new <= hi[active]))
            new[outside] = 0.5 * (lo[active] + hi[active])[outside]
            s[active] = new
            moving = np.abs(new - at) > 4e-16 * (np.abs(new) + self.radius * 1e-2)
            active = active[moving]
            if not len(active):
                break
        return s
