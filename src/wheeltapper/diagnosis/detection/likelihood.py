"""The likelihood of the outcomes of an inspection: hits, misses, and measured signals.

One form serves hit/miss data and censored signals, with η linear in θ (Olsen 1978, Econometrica 46, 1211):

hit, signal beyond its largest    log(c·F(η)),      η = offset + row·θ
miss, signal below its smallest   log(1 - c·F(η))
signal                            log(c·h) - η²/2 - log(2π)/2,  h the last of θ: one over the deviation

F is the distribution of the link. The ceiling c is the probability that a fault is seen at all. For c = 1 the
log-likelihood is concave.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log, log1p, pi, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Link = Literal["probit", "logit"]

GAIN = 1e-13
"""Newton's method ends if the predicted rise of the log-likelihood is smaller than this, of the order of rounding."""
STEPS = 200
"""Largest number of Newton's steps. It ends searches for a maximum that lies at infinity."""
REACH = 4.0
"""Largest change of any index η in one step. An index whose magnitude is larger already may double, so that maxima at
infinity are approached quickly."""
SLOPES = (0.3, 1.0, 3.0, 10.0, 40.0, 400.0)
"""Starting slopes of the search below a ceiling, over the reciprocal of the standard deviation of the sizes. The
log-likelihood is not concave there and may have several maxima."""
PLACES, CEILINGS, CLIMBS = 40, 9, 3
"""Numbers of starting sizes and of ceilings, and the number of the best starting points from which the search goes
on."""


class Slopes(NamedTuple):
    """Derivatives of the log-probability of each outcome with respect to η, (n,)."""

    first: FloatArray
    second: FloatArray


class Peak(NamedTuple):
    """A maximum of the log-likelihood."""

    value: float
    theta: FloatArray
    ceiling: float


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Outcomes of an inspection.

    Attributes
    ----------
    link
        "probit" or "logit"; with signals, "probit".
    hits, misses, signals
        Rows of each kind of outcome, (n, k). The first column is one, the second the size. With signals there is a
        third one: minus the signal, or minus the limit at which it is censored.
    offset
        Constant part of η, after a constraint has removed the first column.
    """

    link: Link
    hits: FloatArray
    misses: FloatArray
    signals: FloatArray
    offset: float = 0.0

    @property
    def parameter_count(self) -> int:
        """Return the number of parameters, without the ceiling."""
        return int(self.hits.shape[1])

    def constrained(self, vector: FloatArray, value: float) -> Likelihood:
        """Return the likelihood of the other parameters under the constraint vector·θ = value, with vector[0] = 1."""
        hits, misses, signals = (
            rows[:, 1:] - rows[:, :1] * vector[1:] for rows in (self.hits, self.misses, self.signals)
        )
        return Likelihood(self.link, hits, misses, signals, value)

    def without_column(self, column: int) -> Likelihood:
        """Return the likelihood with one parameter fixed at zero."""
        hits, misses, signals = (np.delete(rows, column, axis=1) for rows in (self.hits, self.misses, self.signals))
        return Likelihood(self.link, hits, misses, signals, self.offset)

    def log_likelihood(self, theta: FloatArray, ceiling: float) -> float:
        """Return the log-likelihood; -inf if the standard deviation is not positive."""
        return float(self.log_likelihoods(theta[None, :], ceiling)[0])

    def log_likelihoods(self, thetas: FloatArray, ceiling: float) -> FloatArray:
        """Return the log-likelihoods of several parameter vectors, (m, k)."""
        total = np.zeros(len(thetas))
        if len(self.hits):
            eta = self.offset + thetas @ self.hits.T
            total += len(self.hits) * log(ceiling) + _log_cdf(self.link, eta).sum(axis=1)
        if len(self.misses):
            total += _log_miss(self.link, self.offset + thetas @ self.misses.T, ceiling).sum(axis=1)
        if len(self.signals):
            h, eta = thetas[:, -1], self.offset + thetas @ self.signals.T
            scale = log(ceiling) - 0.5 * log(2.0 * pi) + np.log(np.maximum(h, 1e-300))
            total += np.where(h > 0.0, len(self.signals) * scale - 0.5 * (eta**2).sum(axis=1), -inf)
        return total

    def gradient_and_curvature(self, theta: FloatArray, ceiling: float) -> tuple[FloatArray, FloatArray]:
        """Return the gradient, (k,), and minus the second derivatives, (k, k)."""
        gradient, curvature = np.zeros(self.parameter_count), np.zeros((self.parameter_count, self.parameter_count))
        for rows, slopes in ((self.hits, _of_hit), (self.misses, _of_miss)):
            if len(rows):
                first, second = slopes(self.link, self.offset + rows @ theta, ceiling)
                gradient += first @ rows
                curvature -= (rows.T * second) @ rows
        if len(self.signals):
            gradient -= (self.offset + self.signals @ theta) @ self.signals
            gradient[-1] += len(self.signals) / theta[-1]
            curvature += self.signals.T @ self.signals
            curvature[-1, -1] += len(self.signals) / theta[-1] ** 2
        return gradient, curvature

    def information(self, theta: FloatArray, ceiling: float, ceiling_too: bool) -> FloatArray:
        """Return the information on θ and on the ceiling: expected for hit/miss data, observed with signals."""
        if not len(self.signals):
            return self._expected_information(theta, ceiling, ceiling_too)
        return (
            self._observed_information(theta, ceiling)
            if ceiling_too
            else self.gradient_and_curvature(theta, ceiling)[1]
        )

    def _expected_information(self, theta: FloatArray, ceiling: float, ceiling_too: bool) -> FloatArray:
        rows = np.vstack([self.hits, self.misses])
        eta = self.offset + rows @ theta
        log_p, log_miss = log(ceiling) + _log_cdf(self.link, eta), _log_miss(self.link, eta, ceiling)
        by_eta = np.exp(log(ceiling) + _log_pdf(self.link, eta) - 0.5 * (log_p + log_miss))
        slopes = rows * by_eta[:, None]
        if ceiling_too:
            slopes = np.column_stack([slopes, np.exp(0.5 * (log_p - log_miss)) / ceiling])
        return np.asarray(slopes.T @ slopes)

    def _observed_information(self, theta: FloatArray, ceiling: float) -> FloatArray:
        eta = self.offset + self.misses @ theta
        log_miss = _log_miss(self.link, eta, ceiling)
        mixed = np.exp(_log_pdf(self.link, eta) - 2.0 * log_miss) @ self.misses
        seen = (len(self.hits) + len(self.signals)) / ceiling**2
        own = seen + float(np.exp(2.0 * (_log_cdf(self.link, eta) - log_miss)).sum())
        _, curvature = self.gradient_and_curvature(theta, ceiling)
        return np.block([[curvature, mixed[:, None]], [mixed[None, :], np.array([[own]])]])

    def maximum_from(self, theta: FloatArray, ceiling: float) -> Peak:
        """Return the maximum that Newton's method finds; if it lies at infinity, a point with the same value."""
        value = self.log_likelihood(theta, ceiling)
        for _ in range(STEPS if self.parameter_count else 0):
            gradient, curvature = self.gradient_and_curvature(theta, ceiling)
            step = _newton_step(gradient, curvature)
            eta, moved = self._largest_index(theta), self._largest_index(step, 0.0)
            step *= min(1.0, max(REACH, eta) / max(moved, 1e-300))
            gain = float(gradient @ step)
            if not gain > GAIN:
                break
            trial = self.log_likelihood(theta + step, ceiling)
            while not trial > value and gain > GAIN:
                step, gain = 0.25 * step, 0.25 * gain
                trial = self.log_likelihood(theta + step, ceiling)
            if not trial > value:
                break
            theta, value = theta + step, trial
        return Peak(value, theta, ceiling)

    def _largest_index(self, theta: FloatArray, offset: float | None = None) -> float:
        """Return the largest |η|."""
        start = self.offset if offset is None else offset
        groups = [rows for rows in (self.hits, self.misses, self.signals) if len(rows)]
        return max(float(np.abs(start + rows @ theta).max()) for rows in groups)


def highest_peak(likelihood: Likelihood, ceiling: float, starts: FloatArray, slope: int) -> Peak:
    """Return the highest maximum with a detection that grows with size.

    Parameters
    ----------
    likelihood, ceiling
        The function, and its given ceiling.
    starts
        Starting points, (m, k). The search starts from the best one if the function is concave, else from several.
    slope
        Column of the size; its parameter must not be negative.
    """
    ranked = np.argsort(likelihood.log_likelihoods(starts, ceiling))[::-1]
    begins = starts[ranked[: 1 if ceiling == 1.0 else CLIMBS]]
    best = max((likelihood.maximum_from(start, ceiling) for start in begins), key=lambda peak: peak.value)
    if best.theta[slope] >= 0.0:
        return best
    level = likelihood.without_column(slope).maximum_from(np.delete(best.theta, slope), ceiling)
    return Peak(level.value, np.insert(level.theta, slope, 0.0), ceiling)


def with_slopes(start: FloatArray, slope: int) -> FloatArray:
    """Return a starting point, and others that differ in their slope."""
    starts = np.tile(start, (1 + len(SLOPES), 1))
    starts[1:, slope] = SLOPES
    return starts


def starts_everywhere(start: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return a starting point, and others whose curves rise at any of the sizes with different slopes, (m, 2)."""
    distinct = np.unique(sizes)
    middles = 0.5 * (distinct[1:] + distinct[:-1])
    if len(middles) > PLACES:
        middles = np.quantile(middles, np.linspace(0.0, 1.0, PLACES))
    places, slopes = (grid.ravel() for grid in np.meshgrid(np.append(distinct[0], middles), SLOPES))
    return np.vstack([start, np.column_stack([-slopes * places, slopes])])


def over_ceilings(peak_at: Callable[[float, FloatArray | None], Peak], low: float, high: float) -> Peak:
    """Return the highest of the maxima at ceilings from low to high.

    `peak_at` takes a ceiling and a starting point; with None, it starts from everywhere.
    """
    from scipy.optimize import minimize_scalar

    ceilings = np.linspace(low, high, CEILINGS)
    peaks = [peak_at(float(c), None) for c in ceilings]
    first = int(np.argmax([peak.value for peak in peaks]))
    best = peaks[first]

    def negative_peak(ceiling: float) -> float:
        nonlocal best
        peak = peak_at(float(ceiling), best.theta)
        best = max(best, peak, key=lambda peak: peak.value)
        return -peak.value

    around = (ceilings[max(first - 1, 0)], ceilings[min(first + 1, CEILINGS - 1)])
    minimize_scalar(negative_peak, bounds=around, method="bounded", options={"xatol": 1e-6})
    return best


def quantile(link: Link, probability: float) -> float:
    """Return the quantile of the link's distribution."""
    from scipy.special import logit, ndtri

    return float(ndtri(probability) if link == "probit" else logit(probability))


def cdf(link: Link, eta: FloatArray) -> FloatArray:
    """Return the link's distribution."""
    return np.asarray(np.exp(_log_cdf(link, eta)))


def _newton_step(gradient: FloatArray, curvature: FloatArray) -> FloatArray:
    """Return a step uphill: Newton's, if the function is concave."""
    sizes = np.maximum(np.abs(np.diag(curvature)), 1e-8 * np.abs(gradient) + 1e-100)  # they vanish far from the maximum
    if len(gradient) == 1:
        return gradient / sizes
    scale = 1.0 / np.sqrt(sizes)
    values, vectors = np.linalg.eigh(curvature * np.outer(scale, scale))
    return np.asarray(scale * (vectors @ ((vectors.T @ (scale * gradient)) / np.maximum(np.abs(values), 1e-10))))


def _of_hit(link: Link, eta: FloatArray, ceiling: float) -> Slopes:
    first = np.exp(_log_pdf(link, eta) - _log_cdf(link, eta))
    return Slopes(first, _log_slope_of_density(link, eta) * first - first**2)


def _of_miss(link: Link, eta: FloatArray, ceiling: float) -> Slopes:
    first = -np.exp(log(ceiling) + _log_pdf(link, eta) - _log_miss(link, eta, ceiling))
    return Slopes(first, _log_slope_of_density(link, eta) * first - first**2)


def _log_cdf(link: Link, eta: FloatArray) -> FloatArray:
    from scipy.special import log_expit, log_ndtr

    return np.asarray(log_ndtr(eta) if link == "probit" else log_expit(eta))


def _log_miss(link: Link, eta: FloatArray, ceiling: float) -> FloatArray:
    """Return log(1 - c·F), accurate also for F near one."""
    log_rest = _log_cdf(link, -eta)
    return log_rest if ceiling == 1.0 else np.logaddexp(log1p(-ceiling), log(ceiling) + log_rest)


def _log_pdf(link: Link, eta: FloatArray) -> FloatArray:
    if link == "probit":
        return -0.5 * eta**2 - log(sqrt(2.0 * pi))
    return _log_cdf(link, eta) + _log_cdf(link, -eta)


def _log_slope_of_density(link: Link, eta: FloatArray) -> FloatArray:
    """Return F''/F'."""
    return -eta if link == "probit" else -np.tanh(0.5 * eta)
