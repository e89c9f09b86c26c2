"""A fitted curve of detection, and its confidence bounds by the likelihood ratio.

A bound is the extreme of a quantity over all curves whose log-likelihood is at most a *drop* below the maximum. For one
quantity the drop is half of a quantile of χ² with one degree of freedom. MIL-HDBK-1823A takes its bounds from the
contour of the likelihood. That gives the same, because on the contour's extremes the other parameters are optimal.

If the curve is a step (or all faults were found, or all missed), χ² does not hold. Then the drop is -ln(1 - level):
under the curves on the bound, the probability of the data is 1 - level times the largest. With 29 hits of 29, for
example, 0.9 is proved at the 95 % level, as it should be.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, log, sqrt

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.detection.bounds import Index
from wheeltapper.diagnosis.detection.likelihood import (
    Likelihood,
    Peak,
    cdf,
    highest_peak,
    over_ceilings,
    quantile,
    starts_everywhere,
    with_slopes,
)

FloatArray = NDArray[np.float64]

LEAST = 1e-9
"""Smallest probability that is distinguished from zero, and its complement from one: the index F⁻¹ is evaluated between
these two only."""
TINY = 1e-12
"""Smallest distance from one of the probability on a constrained curve, over its ceiling. At one the index would be
infinite."""
CERTAIN = 1e-6
"""If at most one of the sizes has a probability farther than this from both zero and one, the curve is a step: the data
do not determine its slope."""
FARTHEST = 1e4
"""Largest distance from the estimate at which the bound of a size is searched, in standard deviations of the sizes of
the specimens. A bound beyond it counts as infinite."""
LOWEST = 1e-3
"""Lowest ceiling that is considered when the ceiling is estimated."""
NEXT = 1e-6
"""Distance from a step at which the two sides of it are evaluated, in standard deviations of the sizes of the
specimens."""
SMALL = 1e-6
"""Rise of the log-likelihood that counts as none, and distance of the ceiling from one at which it counts as one."""


@dataclass(frozen=True, eq=False)
class DetectionFit:
    """The maximum-likelihood curve: POD = ceiling·F(θ0 + θ1·x + tail·θ'), x the standardised size.

    Attributes
    ----------
    likelihood, peak
        Likelihood of the data, and its maximum.
    tail
        For signals, minus the decision threshold (standardised); otherwise empty.
    centre, width
        Mean and standard deviation of the specimens' sizes, or of their logarithms on a log scale.
    sizes
        x of the specimens, (n,).
    ceiling
        Largest probability of detection.
    is_estimated, is_seen_only
        Whether the ceiling was estimated; whether the data contain only faults that were seen.
    step
        If the curve is a step: the last x without detection and the first one with it; otherwise None.
    """

    likelihood: Likelihood
    peak: Peak
    tail: FloatArray
    centre: float
    width: float
    sizes: FloatArray
    ceiling: float
    is_estimated: bool = False
    is_seen_only: bool = False
    step: tuple[float, float] | None = None

    @property
    def slope(self) -> float:
        """Return the slope of the index over x; zero if detection does not grow with size."""
        return float(self.peak.theta[1])

    @property
    def is_regular(self) -> bool:
        """Return whether the likelihood has a unique maximum, with a curve that grows."""
        return self.step is None and self.slope > 0.0

    @property
    def is_at_one(self) -> bool:
        """Return whether the ceiling was estimated, and its estimate is one."""
        return self.is_estimated and self.ceiling > 1.0 - SMALL

    @property
    def index_row(self) -> FloatArray:
        """Return the row that gives the index from θ at x = 0."""
        return np.concatenate([[1.0, 0.0], self.tail])

    def covariance(self) -> FloatArray:
        """Return the covariance of θ; the last row is the ceiling, if it was estimated and is below one."""
        of_ceiling = self.is_estimated and not self.is_at_one
        information = self.likelihood.information(self.peak.theta, self._data_ceiling(self.ceiling), of_ceiling)
        return np.asarray(np.linalg.inv(information))

    @cached_property
    def index(self) -> Index:
        """Return the index F⁻¹(POD/c) over x of a regular fit."""
        many, covariance = len(self.index_row), self.covariance()
        across = np.zeros((2, len(covariance)))
        across[0, :many], across[1, 1] = self.index_row, 1.0
        across = np.vstack([across, np.eye(len(covariance))[many:]])
        level = float(self.index_row @ self.peak.theta)
        return Index(self.likelihood.link, self.ceiling, level, self.slope, across @ covariance @ across.T)

    def probability_at(self, x: FloatArray) -> FloatArray:
        """Return the probability of detection; NaN if the data do not determine it."""
        if self.step is None:
            return self.ceiling * cdf(self.likelihood.link, self.index_row @ self.peak.theta + self.slope * x)
        below, above = x <= self.step[0], x >= self.step[1]
        return np.where(below == above, np.nan, np.where(above, self.ceiling, 0.0))

    def size_reaching(self, probability: float) -> float:
        """Return the x at which the curve has a probability; infinite if it never has, NaN if undetermined."""
        if probability >= self.ceiling:
            return inf
        if not self.is_regular:
            return np.nan
        index = quantile(self.likelihood.link, probability / self.ceiling)
        return (index - float(self.index_row @ self.peak.theta)) / self.slope

    def likelihood_drop(self, level: float) -> float:
        """Return the largest fall of the log-likelihood within a one-sided bound."""
        from scipy.special import ndtri

        return 0.5 * float(ndtri(level)) ** 2 if self.step is None else -log(1.0 - level)

    def excess_over_bound(self, x: float, probability: float, level: float) -> float:
        """Return how far a probability at a size lies outside the bound; zero or less if it lies within."""
        fall = self.peak.value - self._best_through(x, probability).value
        return sqrt(max(fall, 0.0)) - sqrt(self.likelihood_drop(level))

    def largest_size(self, probability: float, level: float) -> float:
        """Return the largest x at which a probability of detection this low is within the bound."""
        from scipy.optimize import brentq

        if self._is_unbounded(probability, level):
            return inf
        start = self.size_reaching(probability)
        if np.isnan(start):
            start = self._least_possible_bound(probability)
            if self.excess_over_bound(start, probability, level) >= 0.0:
                return start  # the bound is lower still, where there is no specimen
        reach = 0.5
        while self.excess_over_bound(start + reach, probability, level) < 0.0:
            reach *= 2.0
            if reach > FARTHEST:
                return inf
        return float(
            brentq(self.excess_over_bound, start, start + reach, args=(probability, level), xtol=1e-9, rtol=1e-10)
        )

    def least_probability(self, x: float, level: float) -> float:
        """Return the smallest probability of detection at a size that is within the bound."""
        from scipy.optimize import brentq

        link = self.likelihood.link

        def excess_at_index(index: float) -> float:
            return self.excess_over_bound(x, self.ceiling * float(cdf(link, np.array([index]))[0]), level)

        low = quantile(link, LEAST)
        high = min(quantile(link, 1.0 - LEAST), float(self.index_row @ self.peak.theta) + self.slope * x)
        if high <= low or excess_at_index(low) <= 0.0:
            return 0.0
        certain = excess_at_index(high) >= 0.0  # the curve is above every probability that is distinguished from one
        index = high if certain else float(brentq(excess_at_index, low, high, xtol=1e-9, rtol=1e-10))
        return self.ceiling * float(cdf(link, np.array([index]))[0])

    def ceiling_interval(self, level: float) -> tuple[float, float]:
        """Return the confidence interval of the ceiling."""
        from scipy.optimize import brentq

        if not self.is_estimated:
            return self.ceiling, self.ceiling

        def excess_at_ceiling(ceiling: float) -> float:
            fall = self.peak.value - self._peak(ceiling).value
            return sqrt(max(fall, 0.0)) - sqrt(self.likelihood_drop(0.5 + 0.5 * level))

        low = (
            0.0 if excess_at_ceiling(LEAST) <= 0.0 else float(brentq(excess_at_ceiling, LEAST, self.ceiling, xtol=1e-9))
        )
        high = (
            1.0
            if self.is_at_one or excess_at_ceiling(1.0) <= 0.0
            else float(brentq(excess_at_ceiling, self.ceiling, 1.0, xtol=1e-9))
        )
        return low, high

    def _least_possible_bound(self, probability: float) -> float:
        """Return the smallest x that can be a bound, if no x of the curve has this probability."""
        if self.step is None:
            return float(self.sizes.min())
        before, after = self.step
        if before < after:
            return after
        there = float(self.index_row @ self.peak.theta) + self.slope * after  # one size has both hits and misses
        return after + (NEXT if there < quantile(self.likelihood.link, probability / self.ceiling) else -NEXT)

    def _is_unbounded(self, probability: float, level: float) -> bool:
        """Return whether it is within the bound that no size is detected with more than this probability."""
        if probability >= self.ceiling:
            return True
        lost = self.likelihood_drop(level)
        if self.is_estimated and self.peak.value - self._peak(probability).value <= lost:
            return True
        return self.peak.value - self._best_constant(probability).value <= lost

    def _peak(self, ceiling: float) -> Peak:
        starts = _ceiling_starts(self.likelihood, self.peak.theta, self.sizes)
        return highest_peak(self.likelihood, self._data_ceiling(ceiling), starts, 1)

    def _best_constant(self, most: float) -> Peak:
        """Return the most likely constant curve that is not above this probability."""
        level, ceiling = self.likelihood.without_column(1), self._data_ceiling(self.ceiling)
        vector, index = np.delete(self.index_row, 1), quantile(self.likelihood.link, most / self.ceiling)
        start = np.delete(self.peak.theta, 1)
        free = level.maximum_from(start, ceiling)
        if float(vector @ free.theta) <= index:
            return free
        return level.constrained(vector, index).maximum_from(start[1:], ceiling)

    def _best_through(self, x: float, probability: float) -> Peak:
        """Return the most likely growing curve with this probability at this size."""
        vector, theta = self.index_row, self.peak.theta[1:]
        vector[1] = x
        starts = with_slopes(theta, 0)

        def peak_at(ceiling: float, near: FloatArray | None = None) -> Peak:
            index = quantile(self.likelihood.link, min(probability / ceiling, 1.0 - TINY))
            begins = starts if near is None else near[None, :]
            return highest_peak(self.likelihood.constrained(vector, index), self._data_ceiling(ceiling), begins, 0)

        return over_ceilings(peak_at, probability, 1.0) if self.is_estimated else peak_at(self.ceiling)

    def _data_ceiling(self, ceiling: float) -> float:
        """Return the ceiling that holds for the data."""
        return 1.0 if self.is_seen_only else ceiling


def likeliest_peak(likelihood: Likelihood, start: FloatArray, sizes: FloatArray, ceiling: float | None) -> Peak:
    """Return the most likely curve, with a given ceiling or, for None, the most likely one."""
    if ceiling == 1.0:
        return highest_peak(likelihood, ceiling, start[None, :], 1)
    starts = _ceiling_starts(likelihood, start, sizes)
    if ceiling is not None:
        return highest_peak(likelihood, float(ceiling), starts, 1)
    best = over_ceilings(
        lambda c, near: highest_peak(likelihood, c, starts if near is None else near[None, :], 1), LOWEST, 1.0
    )
    level = likelihood.without_column(1).maximum_from(np.delete(start, 1), 1.0)
    if best.value - level.value < SMALL:  # then the data do not determine the ceiling
        return Peak(level.value, np.insert(level.theta, 1, 0.0), 1.0)
    return best


def _ceiling_starts(likelihood: Likelihood, start: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return starting points for a ceiling below one: from the signals if there are any, else from a grid."""
    return with_slopes(start, 1) if len(likelihood.signals) else starts_everywhere(start, sizes)


def step_of(peak: Peak, likelihood: Likelihood, sizes: FloatArray) -> tuple[float, float] | None:
    """Return the sizes between which a curve is a step, so that its slope is arbitrary; None if it is not a step."""
    eta = peak.theta[0] + peak.theta[1] * sizes
    tail, rest = cdf(likelihood.link, eta), cdf(likelihood.link, -eta)
    within = np.unique(sizes[(tail > CERTAIN) & (rest > CERTAIN)])
    if len(within) > 1 or peak.theta[1] <= 0.0:
        return None
    if len(within) == 1:
        return float(within[0]), float(within[0])
    return float(np.max(sizes[tail <= CERTAIN], initial=-inf)), float(np.min(sizes[rest <= CERTAIN], initial=inf))
