"""A profile on which a circle rolls: its smooth cells, its corners, and the contact of the circle inside a cell."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Chord, Course, Harmonic, Polynomials
from wheeltapper.lower.paths.fit import Function
from wheeltapper.lower.paths.point import PlacedStretch, course_cells, sum_function
from wheeltapper.march.wagon import contact_points

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Cell:
    """A smooth cell of the profile between two borders.

    `chord` is the radius of the circle of which the cell is a chord; NaN if it is not a chord.
    """

    start: float
    end: float
    value: Function
    slope: Function
    curvature: Function
    flat: bool
    chord: float
    knots: FloatArray

    @staticmethod
    def summed_cell(start: float, end: float, present: list[PlacedStretch]) -> Cell:
        """Return the cell in which these stretches are summed."""
        uneven = [p.stretch.exact for p in present if not p.stretch.level]
        chord = uneven[0].radius if len(uneven) == 1 and isinstance(uneven[0], Chord) else nan
        knots = [p.stretch.exact.breaks + p.shift for p in present if isinstance(p.stretch.exact, Polynomials)]
        inside = np.concatenate([k[(k > start) & (k < end)] for k in knots]) if knots else np.empty(0)
        return Cell(
            start, end, sum_function(present, "value"), sum_function(present, "slope"),
            sum_function(present, "curvature"), not uneven, chord, np.unique(inside),
        )  # fmt: skip


@dataclass(frozen=True)
class Corner:
    """A border of two cells: its place, its upper height, and the slopes before and after it."""

    position: float
    height: float
    before: float
    after: float

    @property
    def juts_out(self) -> bool:
        """True if the wheel can roll about this corner."""
        return self.before > self.after + 1e-12


def value_at(function: Function, x: float) -> float:
    """Return one value of a vectorised function."""
    return float(function(np.array([x]))[0])


ORDERS = {"value": 0, "slope": 1, "curvature": 2}


def _kernel_terms(present: list[PlacedStretch]) -> list[list[float]] | None:
    """Return the sum of stretches in the form of the kernels; None if one of them is neither a wave nor a chord."""
    rows = []
    for p in present:
        form = p.stretch.exact
        if isinstance(form, Harmonic):
            wave = [form.offset, form.sine, form.cosine, form.wavenumber, form.origin + p.shift]
            rows += [[contact_points.TERM_WAVE, *wave]] if form.offset or not form.level else []
        elif isinstance(form, Chord):
            rows.append([contact_points.CHORD, form.start + p.shift, form.end + p.shift, form.radius, form.below, 0.0])
        else:
            return None
    return rows


class RolledProfile:
    """A profile on which a circle rolls: its cells, its corners, and the circle."""

    def __init__(self, courses: list[Course], start: float, end: float, radius: float, height: float) -> None:
        placed = course_cells(courses, start, end)
        self.cells = [Cell.summed_cell(*cell) for cell in placed]
        terms = [_kernel_terms(present) for _, _, present in placed]
        rows = [row for part in terms if part for row in part]
        self._terms = np.array(rows).reshape(-1, contact_points.TERM) if None not in terms else None
        self._first = np.cumsum([0, *(len(part or ()) for part in terms)])
        self.radius = radius
        self.start, self.end = start, end
        self.corners = self._find_corners(height)

    def _find_corners(self, height: float) -> list[Corner]:
        x, left = np.array([cell.start for cell in self.cells[1:]]), np.arange(len(self.cells) - 1)
        low, high, before, after = (
            self.property_at(x, cell, which) for which in ("value", "slope") for cell in (left, left + 1)
        )
        leaps = np.abs(high - low) > 1e-12 * height
        before, after = np.where(leaps & (high > low), inf, before), np.where(leaps & (high < low), -inf, after)
        each = zip(x.tolist(), np.maximum(low, high).tolist(), before.tolist(), after.tolist(), strict=True)
        return [Corner(*corner) for corner in each]

    def property_at(self, s: FloatArray, cell: IntArray, which: str) -> FloatArray:
        """Return a property of the profile at s, each in the given cell."""
        if self._terms is not None:
            found = np.empty_like(s)
            contact_points.evaluate(self._terms, self._first, cell, s, ORDERS[which], found)
            return found
        if len(s) and cell[0] == cell[-1] and np.all(cell == cell[0]):
            return np.asarray(getattr(self.cells[cell[0]], which)(s))
        out = np.empty_like(s)
        order = np.argsort(cell, kind="stable")
        bounds = np.flatnonzero(np.diff(cell[order])) + 1
        for group in np.split(order, bounds):
            if len(group):
                out[group] = getattr(self.cells[cell[group[0]]], which)(s[group])
        return out

    def circle_drop(self, u: FloatArray) -> FloatArray:
        """Return sqrt(R² - u²) - R without cancellation."""
        return -(u**2) / (self.radius + np.sqrt(self.radius**2 - u**2))

    def circle_slope(self, u: FloatArray) -> FloatArray:
        """Return u/sqrt(R² - u²), the slope at which the circle touches at the offset u."""
        return np.asarray(u / np.sqrt(self.radius**2 - u**2))

    def wheel_places(self, s: FloatArray, cell: IntArray) -> FloatArray:
        """Return the wheel's places at which it touches at s, each in the given cell."""
        slope = self.property_at(s, cell, "slope")
        return np.asarray(s - self.radius * slope / np.sqrt(1.0 + slope**2))

    def is_outer(self, s: FloatArray, cell: IntArray) -> NDArray[np.bool_]:
        """Return True if the circle that touches at s lies above the profile nearby, so that its place rises with s."""
        slope, curvature = self.property_at(s, cell, "slope"), self.property_at(s, cell, "curvature")
        return np.asarray(self.radius * curvature < (1.0 + slope**2) ** 1.5)

    def touch_offset(self, slope: float) -> float:
        """Return the offset u at which the circle touches a slope."""
        return (
            self.radius if slope == inf else -self.radius if slope == -inf else self.radius * slope / sqrt(1 + slope**2)
        )

    def sharpened_contact(
        self, x0: FloatArray, s: FloatArray, lo: FloatArray, hi: FloatArray, cell: IntArray
    ) -> FloatArray:
        """Return the contact inside [lo, hi] of each cell, where p' - lean falls through zero; otherwise an end."""
        s = np.clip(s, lo, hi)
        if self._terms is not None:
            contact_points.refine_contacts(self._terms, self._first, cell, self.radius, x0, lo, hi, s)
            return s
        lo, hi = lo.copy(), hi.copy()
        active = np.arange(len(s))
        for _ in range(contact_points.NEWTON_STEPS):
            at, cells_at = s[active], cell[active]
            u = at - x0[active]
            root = np.sqrt(self.radius**2 - u**2)
            g = self.property_at(at, cells_at, "slope") - u / root
            bend = self.property_at(at, cells_at, "curvature") - self.radius**2 / root**3
            up = g > 0
            lo[active[up]] = at[up]
            hi[active[~up]] = at[~up]
            new = at - g / np.where(bend == 0, -1.0, bend)
            outside = ~((new >= lo[active]) & (new <= hi[active]))
            new[outside] = 0.5 * (lo[active] + hi[active])[outside]
            s[active] = new
            moving = np.abs(new - at) > contact_points.LAST_DIGIT * (np.abs(new) + contact_points.PART * self.radius)
            active = active[moving]
            if not len(active):
                break
        return s
