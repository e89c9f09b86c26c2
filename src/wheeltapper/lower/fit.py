"""From a smooth function to pieces: polynomials of degree 8 that meet in value and slope exactly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Function = Callable[[FloatArray], FloatArray]

DEGREE = 8
INNER = np.cos(np.pi * (2 * np.arange(5) + 1) / 10)
CHECK = np.cos(np.pi * np.arange(1, 12) / 12) * 0.99
NARROWEST = 1e-8
"""Half-width in m below which a piece is not cut further: nothing that a wheel could feel lies inside."""


def _conditions() -> FloatArray:
    """Return the matrix from monomial coefficients to end values, end slopes and inner values on [-1, 1]."""
    powers = np.arange(DEGREE + 1)
    ends = np.array([-1.0, 1.0])
    values = ends[:, None] ** powers
    slopes = powers * ends[:, None] ** np.maximum(powers - 1, 0)
    return np.vstack([values, slopes, INNER[:, None] ** powers])


TO_MONOMIALS = np.linalg.inv(_conditions())
LOBATTO = np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
FROM_LOBATTO = np.linalg.inv(LOBATTO[:, None] ** np.arange(DEGREE + 1))


def interpolate(value: Function, slope: Function | None, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return monomial coefficients in ξ = (x - middle)/half-width, one row for each interval [left, right].

    Neighbours meet in value; with a slope they meet in that as well.
    """
    middle = 0.5 * (left + right)
    half = 0.5 * (right - left)
    if slope is None:
        nodes = middle[:, None] + half[:, None] * LOBATTO
        return np.asarray(value(nodes.ravel()).reshape(nodes.shape) @ FROM_LOBATTO.T)
    inner = middle[:, None] + half[:, None] * INNER
    data = np.column_stack(
        [value(left), value(right), half * slope(left), half * slope(right), value(inner.ravel()).reshape(inner.shape)]
    )
    return np.asarray(data @ TO_MONOMIALS.T)


def _noise(coefficients: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return what rounding of x and of the value alone does to the value: no fit can be better."""
    rise = (np.abs(coefficients) * np.arange(DEGREE + 1)).sum(axis=1) / (0.5 * (right - left))
    place = np.maximum(np.abs(left), np.abs(right))
    return np.asarray(4e-16 * (place * rise + np.abs(coefficients).sum(axis=1)))


def fit(
    functions: list[tuple[Function, Function | None]],
    start: float,
    end: float,
    tolerances: list[float],
    knots: FloatArray | None = None,
) -> tuple[FloatArray, list[FloatArray]]:
    """Fit several smooth functions on [start, end] with common pieces.

    Parameters
    ----------
    functions
        Pairs of value and slope (or None, where only the values need to meet), vectorised over x.
    tolerances
        Largest allowed deviation of each.
    knots
        Places inside at which a piece must end, because a higher derivative jumps there.

    Returns
    -------
    breaks
        Ends of the pieces, (n + 1,).
    coefficients
        For each function, (n, 9) monomial coefficients in ξ = (x - middle)/half-width.
    """
    first = np.array([start, *(knots if knots is not None else ()), end])
    waiting = np.column_stack([first[:-1], first[1:]])
    intervals: list[FloatArray] = []
    found: list[list[FloatArray]] = [[] for _ in functions]
    while len(waiting):
        left, right = waiting[:, 0], waiting[:, 1]
        middle, half = 0.5 * (left + right), 0.5 * (right - left)
        check = (middle[:, None] + half[:, None] * CHECK).ravel()
        good = np.ones(len(waiting), dtype=bool)
        rows = []
        for (value, slope), tolerance in zip(functions, tolerances, strict=True):
            coefficients = interpolate(value, slope, left, right)
            rows.append(coefficients)
            error = np.abs(
                np.polynomial.polynomial.polyval(CHECK, coefficients.T) - value(check).reshape(len(left), -1)
            )
            good &= error.max(axis=1) <= tolerance + _noise(coefficients, left, right)
        good |= half < NARROWEST
        intervals.append(waiting[good])
        for kept, coefficients in zip(found, rows, strict=True):
            kept.append(coefficients[good])
        halves = waiting[~good]
        cut = halves.mean(axis=1)
        waiting = np.vstack([np.column_stack([halves[:, 0], cut]), np.column_stack([cut, halves[:, 1]])])
    done = np.vstack(intervals)
    order = np.argsort(done[:, 0])
    breaks = np.append(done[order, 0], end)
    return breaks, [np.vstack(kept)[order] for kept in found]
