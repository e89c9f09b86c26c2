"""Readings after a low-pass, weighed by noise and roughness: least squares with the covariance σ²·W² + R·Rᵀ.

Theory: docs/theory/gauges.rst, section 16.1.
"""

from __future__ import annotations

from functools import cached_property
from math import ceil
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from wheeltapper.diagnosis.gauges.passing import SAMPLES, Passing
from wheeltapper.record.assessment.filtering import low_passed, passed_share, settling_time

FloatArray = NDArray[np.float64]
T = TypeVar("T", np.float64, np.complex128)
ORDER = 16
"""Of the low-pass."""
CORRELATED = 2.2
"""Noise after the low-pass has a variance of so many times cutoff/rate: its band, and some more, as neighbouring
readings are not quite independent."""


class Band(NamedTuple):
    """Which readings of a passing are compared, after a low-pass.

    Attributes
    ----------
    passing
        What was recorded.
    cutoff
        Hz.
    picked
        (samples, sensors).
    """

    passing: Passing
    cutoff: float
    picked: NDArray[np.bool_]

    def smooth(self, readings: FloatArray) -> FloatArray:
        """Return readings after the low-pass, (samples, sensors)."""
        return low_passed(readings, self.passing.rate, self.cutoff, ORDER)

    def gain(self, frequencies: FloatArray) -> FloatArray:
        """Return what the low-pass leaves of amplitudes."""
        return passed_share(frequencies, self.passing.rate, self.cutoff, ORDER)

    def taken(self, readings: FloatArray) -> FloatArray:
        """Return the readings that are compared, of each sensor one after the other."""
        return np.asarray(readings.T[self.picked.T])

    def of_each(self, readings: FloatArray) -> FloatArray:
        """Return the readings that are compared, those of each sensor in a column of its own, (readings, sensors)."""
        own = np.repeat(np.arange(readings.shape[1]), self.counts)
        return np.where(own[:, None] == np.arange(readings.shape[1]), self.taken(readings)[:, None], 0.0)

    def deviations(self, noise: float) -> FloatArray:
        """Return the standard deviations of the readings that are compared, with noise of such a one, N."""
        doubt = self.passing.doubt
        return np.hypot(noise, np.zeros(self.counts.sum()) if doubt is None else self.taken(doubt))

    @property
    def every(self) -> int:
        """From how many samples one is compared."""
        return max(1, int(self.passing.rate / (SAMPLES * self.cutoff)))

    @property
    def unknown(self) -> int:
        """How many samples at each end the low-pass does not know."""
        return ceil(settling_time(self.cutoff, ORDER) * self.passing.rate)

    @property
    def rows(self) -> NDArray[np.int64]:
        """The samples of which any sensor is compared."""
        return np.flatnonzero(self.picked.any(axis=1))

    def taken_of_rows(self, columns: NDArray[T]) -> NDArray[T]:
        """Return (readings, columns) from what `rows` have, (sensors, columns, rows)."""
        return np.concatenate([one[:, own].T for one, own in zip(columns, self.picked[self.rows].T, strict=True)])

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many of them each sensor has."""
        return np.asarray(self.picked.sum(axis=0))

    @property
    def noise(self) -> float:
        """Standard deviation of their noise, N."""
        return float(self.passing.noise * np.sqrt(CORRELATED * self.cutoff / self.passing.rate))


def band_of(passing: Passing, cutoff: float) -> Band:
    """Return the readings that are compared up to a frequency, Hz: those that the low-pass knows.

    At the ends it takes what was recorded to go on as a mirror image, which a strike there does not.
    """
    band = Band(passing, cutoff, np.zeros_like(passing.used))
    known = slice(-(-band.unknown // band.every) * band.every, len(passing.used) - band.unknown, band.every)
    band.picked[known] = passing.used[known]
    return band


class Weights:
    """Weights of readings: 1 over their deviations, and less for what waves of roughness give.

    Parameters
    ----------
    deviations
        Of each reading, N, without roughness.
    rough
        Columns of readings, N, (readings, columns).
    """

    def __init__(self, deviations: FloatArray, rough: FloatArray) -> None:
        self.deviations = deviations
        self._rough = rough / deviations[:, None]

    @cached_property
    def _factor(self) -> FloatArray:
        """Cholesky's factor L of I + Rᵀ·R, of roughness over the deviations."""
        return np.asarray(cholesky(np.eye(self._rough.shape[1]) + self._rough.T @ self._rough, lower=True))

    @cached_property
    def _taken(self) -> FloatArray:
        """R·L⁻ᵀ: its square is by how much roughness lessens the inverse of the covariance."""
        return np.asarray(solve_triangular(self._factor, self._rough.T, lower=True).T)

    def over(self, readings: FloatArray) -> FloatArray:
        """Return readings over their deviations, (readings, ...)."""
        return (readings.T / self.deviations).T

    def weighed(self, over: FloatArray) -> FloatArray:
        """Return the inverse of the covariance times readings that are over their deviations."""
        return np.asarray(over - self._taken @ (self._taken.T @ over))

    def rough_factors(self, over: FloatArray) -> FloatArray:
        """Return the likeliest factors of the columns of roughness, of readings that are over their deviations."""
        return np.asarray(solve_triangular(self._factor, self._taken.T @ over, lower=True, trans="T"))

    def square(self, over: FloatArray) -> float:
        """Return χ² of readings that are over their deviations."""
        return float((over**2).sum() - ((self._taken.T @ over) ** 2).sum())

    @property
    def logarithm(self) -> float:
        """Logarithm of the determinant of the covariance, but for a constant."""
        return float(2.0 * (np.log(np.diag(self._factor)).sum() + np.log(self.deviations).sum()))


class Freed:
    """Weights of readings from which what is free besides has been taken: gains, zero lines, arrival, speed.

    Parameters
    ----------
    weights
        Of the readings.
    free
        Columns of readings, over their deviations, (readings, columns).
    precision
        One over the variances of their factors before the readings.
    """

    def __init__(self, weights: Weights, free: FloatArray, precision: FloatArray | float = 1e-6) -> None:
        self._weights, self._free = weights, free
        self._tied = weights.weighed(free)
        self._inverse = np.linalg.inv(free.T @ self._tied + precision * np.eye(free.shape[1]))

    def weighed(self, over: FloatArray) -> FloatArray:
        """Return the inverse of the covariance, with what is free in it, times readings over their deviations."""
        held = self._weights.weighed(over)
        return np.asarray(held - self._tied @ (self._inverse @ (self._free.T @ held)))

    def factors(self, over: FloatArray) -> FloatArray:
        """Return the factors of what is free that explain readings best."""
        return np.asarray(self._inverse @ (self._tied.T @ over))
