"""Splines through or near samples, as polynomial pieces. SciPy computes them; it is imported when one is built."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Polynomials, Stretch
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]

FEWEST = 5
"""Smallest number of samples that can be smoothed."""
NEIGHBOURS = 200
"""Number of samples on either side of a period that a periodic smoothing spline uses. Farther samples have no
effect."""
PENALTIES = (-6.0, 12.0)
"""Decimal logarithms of the smallest and the largest weight of the second derivative, for samples at a distance of
one."""


def interpolating_spline(x: FloatArray, y: FloatArray, periodic: bool = False) -> Polynomials:
    """Return the cubic spline through the samples (twice continuously differentiable)."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(x, y, bc_type="periodic" if periodic else "not-a-knot")
    return Polynomials(np.asarray(spline.x), np.ascontiguousarray(spline.c[::-1].T))


def smoothing_spline(x: FloatArray, y: FloatArray, noise: float, periodic: bool = False) -> Polynomials:
    """Return the cubic smoothing spline whose rms residual equals the noise.

    It minimises the squared residuals plus a penalty on ∫ y''² dx (Reinsch 1967), and does not oscillate between
    samples. If a straight line is nearer to the samples than the noise, the line is returned.
    """
    if len(x) < FEWEST:
        raise InputError("", "noise", f"{len(x)} samples", f"at least {FEWEST} samples to smooth")
    from scipy.interpolate import PPoly, make_smoothing_spline
    from scipy.optimize import brentq

    unit = (x[-1] - x[0]) / (len(x) - 1)
    first, last = 0, len(x)
    position, height = (x - x[0]) / unit, y
    if periodic:  # enough neighbouring periods, so that the ends of the spline have no effect
        turn, copies = position[-1], 1 + NEIGHBOURS // len(x)
        position = np.concatenate([position[:-1] + turn * k for k in range(-copies, copies + 1)])
        height = np.tile(y[:-1], 2 * copies + 1)
        first, last = copies * (len(x) - 1), (copies + 1) * (len(x) - 1) + 1

    def spline_with_penalty(weight: float) -> Any:
        return make_smoothing_spline(position, height, lam=10.0**weight)

    def excess(weight: float) -> float:
        residual = spline_with_penalty(weight)(position[first:last]) - height[first:last]
        return float(np.sqrt(np.mean(residual**2))) / noise - 1.0

    low, high = PENALTIES
    weight = low if excess(low) >= 0.0 else high if excess(high) <= 0.0 else float(brentq(excess, low, high, rtol=1e-6))
    pieces: Any = PPoly.from_spline(spline_with_penalty(weight))
    start = np.searchsorted(pieces.x, position[first], side="right") - 1
    coefficients = np.ascontiguousarray(pieces.c[::-1].T[start : start + len(x) - 1]) / unit ** np.arange(4)
    return Polynomials(x, coefficients)


def spline_stretch(form: Polynomials) -> Stretch:
    """Return the stretch that a spline covers."""

    def derivative(order: int) -> Any:
        return lambda x: form.derivative(np.asarray(x), order)

    return Stretch(float(form.breaks[0]), float(form.breaks[-1]), derivative(0), derivative(1), derivative(2), form)
