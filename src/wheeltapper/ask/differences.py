"""Derivatives by differences of whole runs, with the error that they probably have.

A run with its own step control is a smooth function of each number in it, as long as the same happens in it in the same
order, but for a scatter by the errors of its steps. So symmetric differences over steps h, h/2, h/4, … are extrapolated
to h = 0 (Romberg's table). Of its entries each value takes the one whose neighbours agree best, the scatter over the
step added (Ridders 1982, Advances in Engineering Software 4, 75). The scatter is measured, by a step so small that
nothing else is left of the second difference.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Beside = Callable[[float], FloatArray | None]
"""Values for another value of a number; None where they do not continue those of the number itself."""

FIRST = 2.0**-6
"""First step, relative to the number."""
SMALLER, TRIALS = 8.0, 8
"""Ratio of one step to the next, and how many are tried, while no step is small enough that the same happens on both
sides: down to 1e-8 of the number."""
TINY = 2.0**-20
"""The step that measures the scatter, relative to the first one that is small enough."""
LEVELS = 8
"""Largest number of halvings after the first step that is small enough."""
ENOUGH = 1e-8
"""Relative error from which on no further step is made."""
LEAST_SCATTER = 1e-13
"""Smallest relative scatter that values are taken to have."""
CORNER = 0.7
"""Ratio of the differences of both sides' slopes over one step and its half, above which there is a corner; it is one
half or less where values are smooth, and one at a corner."""
SMALLEST_CORNER, SMALLEST_KINK = 1e-5, 1e-7
"""A corner counts if the slopes differ by so much of the slope, and the values by so much of themselves."""
LEAST, LARGER, LARGEST, LARGE = 1e-9, 16.0, 1e8, 1e-4
"""Of a number that is zero, whose size nobody knows: the first step that is tried, the ratio of one to the next, the
largest, and the relative change of a value that is large enough."""


class Slope(NamedTuple):
    """A derivative of values, its probable error, and where there is none.

    Attributes
    ----------
    value
        NaN where there is none.
    error
        Estimate of the absolute error.
    at_corner
        Where the slopes on both sides differ.
    refusal
        Why the number cannot be changed, where no step could be made; else nothing.
    """

    value: FloatArray
    error: FloatArray
    at_corner: BoolArray
    refusal: str = ""


class _Quotients(NamedTuple):
    """Quotients over a step: the derivative, and the difference of those of both sides."""

    step: float
    slope: FloatArray
    bend: FloatArray


def slope_at(beside: Beside, here: FloatArray, at: float, rows: bool = False) -> Slope:
    """Return the derivative of values with respect to a number.

    Parameters
    ----------
    beside
        The values for another value of the number. What it raises as an InputError says that the number cannot have
        this value; then a number that is zero is differentiated on one side.
    here
        The values at the number.
    at
        The number.
    rows
        Whether values along the last axis are of one kind: errors then count over the largest of them.

    Returns
    -------
    Slope
        All NaN if no step is small enough that the same happens on both sides.
    """
    stencil = _Stencil(beside, here, at)
    first = stencil.first_quotients()
    tiny = None if first is None else stencil.quotients(TINY * first.step)
    if first is None or tiny is None:
        none = np.full(here.shape, np.nan)
        return Slope(none, none.copy(), np.zeros(here.shape, dtype=bool), stencil.refusal)
    scatter = 0.5 * np.abs(tiny.bend) * tiny.step + LEAST_SCATTER * np.abs(here)
    base, table, before = 2.0 if stencil.is_one_sided else 4.0, [[first.slope]], first
    best, error, corner = first.slope, np.full(here.shape, np.inf), np.zeros(here.shape, dtype=bool)
    for level in range(1, LEVELS + 1):
        found = stencil.quotients(0.5 * before.step)
        if found is None:
            break
        row, noise = [found.slope], scatter / found.step
        least = (SMALLEST_KINK * np.abs(here) + 30.0 * scatter) / found.step
        stays = np.abs(found.bend) > np.maximum(CORNER * np.abs(before.bend), least)
        for k in range(1, level + 1):
            row.append(row[-1] + (row[-1] - table[-1][k - 1]) / (base**k - 1.0))
            wrong = np.maximum(np.abs(row[k] - row[k - 1]), np.abs(row[k] - table[-1][k - 1])) + noise
            better = wrong < error
            best, error = np.where(better, row[k], best), np.where(better, wrong, error)
            corner = np.where(better, stays & (np.abs(found.bend) > SMALLEST_CORNER * np.abs(row[k])), corner)
        table.append(row)
        before = found
        size = np.nanmax(np.abs(best), axis=-1, keepdims=True, initial=0.0) if rows else np.abs(best)
        if level > 1 and np.all((error <= ENOUGH * size + 2.0 * noise) | np.isnan(here)):
            break
    unknown = corner | ~np.isfinite(error)
    return Slope(np.where(unknown, np.nan, best), np.where(unknown, np.nan, error), corner)


class _Stencil:
    """Difference quotients at a number."""

    def __init__(self, beside: Beside, here: FloatArray, at: float) -> None:
        self.beside, self.here, self.at = beside, here, at
        self.is_one_sided = False
        self.refusal = ""

    def first_quotients(self) -> _Quotients | None:
        """Return those over the first step that is small enough."""
        if self.at == 0.0:
            return self._large_enough()
        steps = (FIRST * abs(self.at) / SMALLER**trial for trial in range(TRIALS))
        return next((found for step in steps if (found := self.quotients(step)) is not None), None)

    def _large_enough(self) -> _Quotients | None:
        """Return those over the first step that changes a value enough, or the largest that is small enough."""
        found, larger = None, self.quotients(LEAST)
        while larger is not None:
            found = larger
            if found.step > LARGEST or np.any(np.abs(found.slope * found.step) > LARGE * np.abs(self.here)):
                break
            larger = self.quotients(LARGER * found.step)
        return found

    def quotients(self, step: float) -> _Quotients | None:
        """Return the quotients over a step; None where the same does not happen on both sides."""
        try:
            above = self.beside(self.at + step)
        except InputError as error:
            self.refusal = str(error)
            return None
        self.refusal = ""
        if above is None:
            return None
        below = None if self.is_one_sided else self._below(step)
        if self.is_one_sided:
            return _Quotients(step, (above - self.here) / step, np.zeros(self.here.shape))
        if below is None:
            return None
        width = (self.at + step) - (self.at - step)  # as it was rounded
        return _Quotients(step, (above - below) / width, (above + below - 2.0 * self.here) / step)

    def _below(self, step: float) -> FloatArray | None:
        try:
            return self.beside(self.at - step)
        except InputError as error:
            self.is_one_sided = self.at == 0.0
            self.refusal = "" if self.is_one_sided else str(error)
            return None
