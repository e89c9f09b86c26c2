"""Confidence bounds of a curve of detection in closed form, from the normal approximation of its parameters.

wald   Bound of the index F⁻¹(POD/c), which is a straight line over t: the index less a multiple of its standard error.
       a90/95 is the size at which this bound reaches 0.9 (Fieller's bound).
delta  Bound of the size: μ + σ·z plus a multiple of its standard error by the delta method.

The bound of a size is the size at which the bound of the probability has the given value.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from wheeltapper.diagnosis.detection.likelihood import FloatArray, Link, cdf, quantile


class Index(NamedTuple):
    """F⁻¹(POD/c) = intercept + slope·x."""

    link: Link
    ceiling: float
    intercept: float
    slope: float
    covariance: FloatArray  # (2, 2); (3, 3) with the ceiling if it was estimated and is below one

    def index_of(self, probability: float) -> float:
        """Return the index of a probability."""
        return quantile(self.link, probability / self.ceiling)


def wald_lower(index: Index, x: FloatArray, level: float) -> FloatArray:
    """Return the lower confidence bounds of the probability of detection."""
    (v11, v12), (_, v22) = index.covariance
    error = np.sqrt(np.maximum(v11 + 2.0 * x * v12 + x**2 * v22, 0.0))
    bound = index.intercept + index.slope * x - quantile("probit", level) * error
    return index.ceiling * cdf(index.link, bound)


def wald_size(index: Index, probability: float, level: float) -> float:
    """Return the x from which on the lower bound exceeds a probability; infinite if it falls below it again."""
    k2 = quantile("probit", level) ** 2
    (v11, v12), (_, v22) = index.covariance
    above = index.intercept - index.index_of(probability)
    a, b, c = index.slope**2 - k2 * v22, above * index.slope - k2 * v12, above**2 - k2 * v11
    if a <= 0.0 or index.slope <= 0.0:
        return inf
    root = sqrt(max(b * b - a * c, 0.0))
    return float((root - b) / a if b < 0.0 else -c / (root + b))


def delta_lower(index: Index, x: FloatArray, level: float) -> FloatArray:
    """Return the lower confidence bounds of the probability of detection: the larger roots z of `delta_size` = x."""
    location, spread, ((v11, v12), (_, v22)) = location_scale(index)
    k2, beyond = quantile("probit", level) ** 2, x - location
    a, b, c = spread**2 - k2 * v22, beyond * spread + k2 * v12, beyond**2 - k2 * v11
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b**2 - a * c)
        z = np.where(b > 0.0, c / (b + root), (b - root) / a)
        is_bound = beyond - z * spread >= 0.0  # else nothing is proved at this size
    return np.where(is_bound, index.ceiling * cdf(index.link, np.nan_to_num(z)), 0.0)


def delta_size(index: Index, probability: float, level: float) -> float:
    """Return the upper confidence bound of the x with a probability."""
    location, spread, covariance = location_scale(index)
    gradient = np.array([1.0, index.index_of(probability)])
    return float(gradient @ [location, spread] + quantile("probit", level) * sqrt(gradient @ covariance @ gradient))


def location_scale(index: Index) -> tuple[float, float, FloatArray]:
    """Return μ and σ in x, and their covariance by the delta method, with the ceiling as in `Index`."""
    by_index = np.eye(len(index.covariance))
    by_index[0, :2] = -1.0 / index.slope, index.intercept / index.slope**2
    by_index[1, 1] = -1.0 / index.slope**2
    return -index.intercept / index.slope, 1.0 / index.slope, by_index @ index.covariance @ by_index.T
