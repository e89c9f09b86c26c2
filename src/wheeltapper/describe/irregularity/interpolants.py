"""Slope and curvature of a function of which only values are known: local interpolants, kept as they are needed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Function = Callable[[NDArray[Any]], NDArray[Any]]
COUNT = 13
NODES = np.cos(np.pi * (np.arange(COUNT) + 0.5) / COUNT)
TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(NODES, COUNT - 1))
RESOLVED, ROUNDING = 1e-10, 1e-14
"""An interpolant whose last terms are a larger part of its changes, and more than rounding, is too wide."""
CALM, MENDED = 1e-6, 0.25
"""Last terms below CALM of the changes are rounding where a narrower interpolant's are not below MENDED of them.

Then the wider one stays. Far from zero, rounding of the place is more than that of the value, and curvatures grow with
it over the width squared.
"""
MOST_NARROWER = 6
"""How often an interpolant is made four times narrower at most: beside a kink none is narrow enough."""
MOST_KEPT = 200_000
"""Interpolants of one width that are kept: bounds the memory."""


class _Evaluation(NamedTuple):
    """What interpolants say at some places, their last terms, and which of these are too large, or may be rounding."""

    value: FloatArray
    tail: FloatArray
    coarse: NDArray[np.bool_]
    calm: NDArray[np.bool_]


class _WidthInterpolants:
    """Interpolants of one half-width about its multiples: a place is never farther than half of it from a middle.

    Towards its ends an interpolant's derivatives are hundreds of times noisier than in its inner half.
    """

    def __init__(self, function: Function, start: float, end: float, half: float) -> None:
        self._function, self._first, self._last, self._half = function, start + half, end - half, half
        self._drop_interpolants()

    def _drop_interpolants(self) -> None:
        self._keys = np.empty(0, dtype=np.int64)
        self._derivatives = [np.empty((COUNT - order, 0)) for order in (1, 2)]
        self._tail, self._coarse, self._calm = np.empty(0), np.empty(0, dtype=bool), np.empty(0, dtype=bool)

    def evaluate(self, x: FloatArray, order: int) -> _Evaluation:
        """Return the first or second derivative at x."""
        return self._evaluation_at(x, np.rint(x / self._half).astype(np.int64), order)

    def jump_near(self, x: FloatArray) -> _Evaluation:
        """Return by how much the second derivative jumps between the two interpolants next to x."""
        keys = np.floor(x / self._half).astype(np.int64)
        border = np.clip((keys + 0.5) * self._half, self._first, self._last)
        after, before = self._evaluation_at(border, keys + 1, 2), self._evaluation_at(border, keys, 2)
        return before._replace(value=np.abs(after.value - before.value))

    def _evaluation_at(self, x: FloatArray, keys: NDArray[np.int64], order: int) -> _Evaluation:
        row = self._interpolant_rows(keys)
        xi = (x - self._interpolant_middles(keys)) / self._half
        value: FloatArray = np.asarray(
            chebyshev.chebval(xi, self._derivatives[order - 1][:, row], tensor=False), dtype=np.float64
        )
        return _Evaluation(value, self._tail[row], self._coarse[row], self._calm[row])

    def _interpolant_middles(self, keys: NDArray[np.int64]) -> FloatArray:
        return np.clip(keys * self._half, self._first, self._last)

    def _interpolant_rows(self, keys: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return where the interpolants stand, once those that are missing are made."""
        if len(self._keys):
            row = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
            missing = keys[self._keys[row] != keys]
            if not len(missing):
                return row
        else:
            missing = keys
        if len(self._keys) > MOST_KEPT:
            self._drop_interpolants()
            missing = keys
        self._make_interpolants(np.unique(missing))
        return np.searchsorted(self._keys, keys)

    def _make_interpolants(self, keys: NDArray[np.int64]) -> None:
        places = self._interpolant_middles(keys)[:, None] + self._half * NODES
        coefficients = self._function(places.ravel()).reshape(places.shape) @ TO_CHEBYSHEV.T
        changes = np.abs(coefficients[:, 1:]).max(axis=1)
        allowed = RESOLVED * changes + ROUNDING * np.abs(coefficients[:, 0])
        tail = np.abs(coefficients[:, -2:]).max(axis=1)
        order = np.argsort(np.concatenate([self._keys, keys]))
        self._keys = np.concatenate([self._keys, keys])[order]
        self._tail = np.concatenate([self._tail, tail])[order]
        self._coarse = np.concatenate([self._coarse, tail > allowed])[order]
        self._calm = np.concatenate([self._calm, tail < CALM * changes])[order]
        for k, held in enumerate(self._derivatives):
            made = chebyshev.chebder(coefficients.T, k + 1) / self._half ** (k + 1)
            self._derivatives[k] = np.concatenate([held, made], axis=1)[:, order]


class Interpolants:
    """The first and second derivative of a function that is smooth between two borders.

    Parameters
    ----------
    function
        From places to values.
    start, end
        The borders, m, across which no interpolant reaches.
    half
        Half the width of the widest interpolants, m; where the function changes faster they are narrower.
    """

    def __init__(self, function: Function, start: float, end: float, half: float) -> None:
        half = min(half, 0.5 * (end - start))
        self._widths = [_WidthInterpolants(function, start, end, half * 0.25**n) for n in range(MOST_NARROWER + 1)]

    def derivative(self, x: NDArray[Any], order: int) -> FloatArray:
        """Return the first or second derivative at x."""
        return self._narrow_enough(x, lambda width, x: width.evaluate(x, order))

    def scatter(self, x: NDArray[Any]) -> FloatArray:
        """Return by how much the second derivative jumps near x."""
        return self._narrow_enough(x, _WidthInterpolants.jump_near)

    def _narrow_enough(
        self, x: NDArray[Any], of: Callable[[_WidthInterpolants, FloatArray], _Evaluation]
    ) -> FloatArray:
        """Return what the interpolants say that are narrow enough."""
        x = np.asarray(x, dtype=float)
        places, out, left = x.ravel(), np.empty(x.size), np.arange(x.size)
        best, calm = np.full(x.size, np.inf), np.zeros(x.size, dtype=bool)
        for width in self._widths:
            found = of(width, places[left])
            better = ~calm[left] | (found.tail < MENDED * best[left])
            kept = left[better]
            out[kept], best[kept], calm[kept] = found.value[better], found.tail[better], found.calm[better]
            left = left[better & found.coarse]
            if not len(left):
                break
        return out.reshape(x.shape)
