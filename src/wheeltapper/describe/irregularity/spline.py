"""Splines through or near samples, as polynomial pieces. SciPy does the work; it is imported only when one is built."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Polynomials, Stretch

FloatArray = NDArray[np.float64]


def interpolating(x: FloatArray, y: FloatArray, periodic: bool = False) -> Polynomials:
    """Return the cubic spline through the samples (twice continuously differentiable)."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(x, y, bc_type="periodic" if periodic else "not-a-knot")
    return Polynomials(np.asarray(spline.x), np.ascontiguousarray(spline.c[::-1].T))


def smoothing(x: FloatArray, y: FloatArray, noise: float, periodic: bool = False) -> Polynomials:
    """Return the quintic spline with the fewest knots whose rms residual equals the noise (Reinsch's criterion)."""
    from scipy.interpolate import BSpline, PPoly, splrep

    t, c, k = splrep(x, y, w=np.full(len(x), 1.0 / noise), k=5, s=len(x) - sqrt(2.0 * len(x)), per=periodic)
    pieces: Any = PPoly.from_spline(BSpline(t, c, k, extrapolate=False))  # type: ignore[arg-type]
    breaks = np.unique(pieces.x)
    coefficients = np.ascontiguousarray(pieces.c[::-1].T)
    last = len(coefficients) - 1
    return Polynomials(breaks, coefficients[np.minimum(_last_of_equal(pieces.x, breaks)[:-1], last)])


def _last_of_equal(knots: FloatArray, breaks: FloatArray) -> NDArray[np.int64]:
    return np.asarray(np.searchsorted(knots, breaks, side="right") - 1)


def stretch(form: Polynomials) -> Stretch:
    """Return the stretch that a spline covers."""

    def derivative(order: int) -> Any:
        return lambda x: form.derivative(np.asarray(x), order)

    return Stretch(float(form.breaks[0]), float(form.breaks[-1]), derivative(0), derivative(1), derivative(2), form)
