"""From a smooth function to pieces: polynomials of degree 8 that meet in value and slope exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground import progress
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Function = Callable[[FloatArray], FloatArray]

DEGREE = 8
"""Degree of the polynomials."""
INNER = np.cos(np.pi * (2 * np.arange(5) + 1) / 10)
"""Inner places, on [-1, 1], at which a polynomial equals the function. Its values and slopes at both ends equal the
function's, too."""
CHECK = np.cos(np.pi * np.arange(1, 12) / 12) * 0.99
"""Places, on [-1, 1], at which the error of a polynomial is measured."""
NARROWEST = 1e-8
"""Half-width of an interval, m, below which it is not cut further: no wheel is affected by what lies inside."""


def _condition_matrix() -> FloatArray:
    """Return the matrix from monomial coefficients to end values, end slopes and inner values on [-1, 1]."""
    powers = np.arange(DEGREE + 1)
    ends = np.array([-1.0, 1.0])
    values = ends[:, None] ** powers
    slopes = powers * ends[:, None] ** np.maximum(powers - 1, 0)
    return np.vstack([values, slopes, INNER[:, None] ** powers])


TO_MONOMIALS = np.linalg.inv(_condition_matrix())
NODES = np.concatenate([[-1.0, 1.0], INNER, CHECK])
"""Places, on [-1, 1], at which a function is sampled: the ends, the inner places, and those of the check."""
LOBATTO = np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
"""Chebyshev's extreme places, on [-1, 1], for functions without slopes at the ends."""
FROM_LOBATTO = np.linalg.inv(LOBATTO[:, None] ** np.arange(DEGREE + 1))
ROUNDING = 16.0
"""Ratio of an error to the allowed one up to which it may be rounding. Rounding is only estimated, and does not exceed
its estimate by more."""
CHUNK = 20_000
"""Number of intervals that are fitted together, which bounds the memory."""
MOST_PIECES = 100_000
"""Largest number of pieces, or ten per interval if that is more. A function that needs more is not smooth, or the run
is far too long."""
AT_ONCE = 63
"""If few intervals are left, their halves and quarters are fitted in advance, up to this number of pieces. A call costs
more than that many pieces."""


@dataclass(frozen=True)
class SampledFunction:
    """A function at some places: values, slopes (if neighbours must meet in slope), and scatter of the values."""

    values: FloatArray
    slopes: FloatArray | None = None
    scatter: FloatArray | None = None


@dataclass(frozen=True)
class Factor:
    """The factor on the contact force as a function of the profile's curvature, and the noise of the curvature, 1/m."""

    of: Function
    noise: float

    def sampled_factor(self, curvature: FloatArray) -> SampledFunction:
        """Return the factor at these curvatures, to be fitted."""
        values = self.of(curvature)
        return SampledFunction(values, None, np.abs(self.of(curvature - self.noise) - values) if self.noise else None)


Sample = Callable[[FloatArray, IntArray], list[SampledFunction]]
"""A function from places, and the owner of each place, to the sampled functions that are fitted."""


def _rounding_error(coefficients: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the error of a value from rounding of x and of the value itself; no fit can be better."""
    half = np.maximum(0.5 * (right - left), 1e-300)  # an interval without width has halves without width
    rise = (np.abs(coefficients) * np.arange(DEGREE + 1)).sum(axis=1) / half
    place = np.maximum(np.abs(left), np.abs(right))
    return np.asarray(4e-16 * (place * rise + np.abs(coefficients).sum(axis=1)))


def _fitted_pieces(
    sample: Sample, left: FloatArray, right: FloatArray, owner: IntArray, tolerances: list[float], before: FloatArray
) -> tuple[list[FloatArray], IntArray, FloatArray]:
    """Return coefficients of each function on each interval, the number of parts to cut it into, and its error.

    The number is one if all functions are accurate enough. Otherwise it is a power of two that is probably not too
    large. Errors are relative to the allowed ones. If an error is hardly smaller than that of a wider interval,
    `before`, it is rounding, and cutting does not help: that of a smooth function would be hundreds of times smaller.
    """
    middle, half = 0.5 * (left + right)[:, None], 0.5 * (right - left)[:, None]
    places = middle + half * (NODES if len(tolerances) == 1 else np.concatenate([NODES, LOBATTO]))
    places[:, 0], places[:, 1] = left, right  # exactly, because neighbours share their ends
    found = sample(places.ravel(), np.repeat(owner, places.shape[1]))
    rows, excess = [], np.zeros(len(left))
    for one, tolerance in zip(found, tolerances, strict=True):
        level = one.values.reshape(places.shape)[:, :1]
        table = one.values.reshape(places.shape) - level  # otherwise rounding of the level hides the variation
        if one.slopes is None:
            coefficients = table[:, len(NODES) :] @ FROM_LOBATTO.T
        else:
            ends = one.slopes.reshape(places.shape)[:, :2] * half
            inner = slice(2, 2 + len(INNER))
            coefficients = np.concatenate([table[:, :2], ends, table[:, inner]], axis=1) @ TO_MONOMIALS.T
            dot = half[:, 0] <= 1e-15 * np.abs(middle[:, 0])  # too short to show a slope
            coefficients[dot] = 0.0
            coefficients[dot, 0], coefficients[dot, 1] = table[dot, :2].mean(axis=1), ends[dot].mean(axis=1)
        checked = table[:, 2 + len(INNER) : len(NODES)]
        error = np.abs(np.polynomial.polynomial.polyval(CHECK, coefficients.T) - checked).max(axis=1)
        coefficients[:, :1] += level
        scatter = 0.0 if one.scatter is None else one.scatter.reshape(places.shape).max(axis=1)
        excess = np.maximum(excess, error / (tolerance + scatter + _rounding_error(coefficients, left, right)))
        rows.append(coefficients)
    halvings = np.log2(np.clip(excess, 1.0, 1e12)) / (DEGREE + 1)
    rounding = (excess <= ROUNDING) & (excess > 0.5 * before)
    good = (half[:, 0] < NARROWEST) | (excess <= 1.0) | rounding
    return rows, np.where(good, 1, 2 ** np.maximum(halvings.astype(np.int64), 1)), excess


def _cut_intervals(ends: FloatArray, parts: IntArray) -> FloatArray:
    """Return each interval cut into `parts` equal parts, which share their ends."""
    owner = np.repeat(np.arange(len(ends)), parts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    width = np.diff(ends, axis=1)[owner, 0] / parts[owner]
    left, last = ends[owner, 0] + number * width, number == parts[owner] - 1
    right = np.where(last, ends[owner, 1], ends[owner, 0] + (number + 1) * width)
    return np.column_stack([left, right])


def fit(
    sample: Sample, intervals: FloatArray, owner: IntArray, tolerances: list[float]
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Fit several smooth functions with common pieces; neighbours meet in value, and in slope if slopes are given.

    Parameters
    ----------
    sample
        The functions.
    intervals
        (n, 2) left and right ends; all functions are smooth between them.
    owner
        (n,) owner of each interval, passed to `sample` with every place in it.
    tolerances
        Largest allowed deviation of each function. A second one has no slope.

    Returns
    -------
    left, right
        Ends of the pieces, from left to right.
    coefficients
        For each function, (pieces, 9) monomial coefficients in ξ = (x - middle)/half-width.
    """
    done: list[FloatArray] = []
    found: list[list[FloatArray]] = [[] for _ in tolerances]
    unknown = np.full(len(intervals), np.inf)
    blocks = [slice(i, i + CHUNK) for i in range(0, len(intervals), CHUNK)]
    waiting = [(intervals[block], owner[block], unknown[block]) for block in blocks]
    fitted, total, most = 0, float(np.diff(intervals, axis=1).sum()), max(MOST_PIECES, 10 * len(intervals))
    reached = 0.0
    while waiting:
        progress.report("fitting the path", reached, total)
        ends, owned, before = waiting.pop()
        if fitted + len(ends) > most:
            raise InputError(
                "", "irregularity", f"heights that {most} pieces cannot follow (here near x = {ends[0, 0]:.6g} m)",
                "heights that are smooth between their breakpoints (samples: as `Measured`), or a shorter run",
            )  # fmt: skip
        levels = max((AT_ONCE // len(ends) + 1).bit_length() - 1, 1)
        pieces = _halved_intervals(ends, levels)
        owners = np.repeat(owned, pieces.shape[1])
        wider = np.repeat(before, pieces.shape[1])
        rows, parts, excess = _fitted_pieces(
            sample, pieces[..., 0].ravel(), pieces[..., 1].ravel(), owners, tolerances, wider
        )
        good, later = _good_and_later(parts.reshape(pieces.shape[:2]), levels)
        pieces = pieces.reshape(-1, 2)
        done.append(pieces[good])
        fitted += len(done[-1])
        reached += float(np.diff(done[-1], axis=1).sum())
        for kept, coefficients in zip(found, rows, strict=True):
            kept.append(coefficients[good])
        if later.any():
            cut = parts[later]
            waiting.append(
                (_cut_intervals(pieces[later], cut), np.repeat(owners[later], cut), np.repeat(excess[later], cut))
            )
    pieces = np.vstack(done) if done else np.empty((0, 2))
    order = np.argsort(pieces[:, 0])
    return pieces[order, 0], pieces[order, 1], [np.vstack(kept)[order] if kept else np.empty((0, 9)) for kept in found]


@lru_cache
def _fraction_ends(levels: int) -> tuple[FloatArray, FloatArray]:
    """Return the ends of an interval, of its halves, of their halves and so on."""
    first = [np.arange(2**level) / 2**level for level in range(levels)]
    last = [np.arange(1, 2**level + 1) / 2**level for level in range(levels)]
    return np.concatenate(first), np.concatenate(last)


def _halved_intervals(ends: FloatArray, levels: int) -> FloatArray:
    """Return each interval, its halves, their halves and so on: (intervals, pieces, 2)."""
    first, last = _fraction_ends(levels)
    left, right = ends[:, :1], ends[:, 1:]
    out = left[..., None] + (right - left)[..., None] * np.column_stack([first, last])
    out[:, last == 1.0, 1] = right  # exactly
    return np.asarray(out)


def _good_and_later(parts: IntArray, levels: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which pieces are good and which are cut further, from the number of parts for each piece."""
    chosen = np.zeros(parts.shape, dtype=bool)
    chosen[:, 0] = True
    known = [slice(2**level - 1, 2 ** (level + 1) - 1) for level in range(levels)]
    later = np.zeros_like(chosen)
    for level, here in enumerate(known):
        for deeper in range(level + 1, levels):
            cut = 2 ** (deeper - level)
            chosen[:, known[deeper]] |= np.repeat(chosen[:, here] & (parts[:, here] == cut), cut, axis=1)
        later[:, here] = chosen[:, here] & (parts[:, here] >= 2 ** (levels - level))
    return (chosen & (parts == 1)).ravel(), later.ravel()
