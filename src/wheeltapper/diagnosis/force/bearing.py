"""The force of the deck's bearing, by integrating its acceleration from rest, with a correction of the drift.

Integrated noise drifts. The drift of K·y + C_d·v is a Gaussian process of known covariance. Two conditions give its
value at some times: in flight the contact force is zero, and its mean over a window is the static force. The second one
is the less certain, the more the force varies. Least squares gives the drift at all times, with its standard error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FLIGHT = 0.18
"""Shortest flight that is used as a condition on the drift, in contact periods: a third of the time that an impact
lasts, so that no zero between two of its samples is taken for one."""
PIECE = 0.54
"""Longest piece of a flight whose mean gives one condition, in contact periods. The drift is taken as constant within
it, which is about as long as an impact."""
NEAR_ZERO = 0.02
"""Largest contact force in flight, over the static force. Three standard errors of noise and drift are added to it."""
HIGHEST = 0.5
"""If the limit of `NEAR_ZERO` with its addition exceeds this share of the static force, zero and the static force
cannot be told apart, and no flight is recognised."""
MOST = 100
"""Largest number of flights that are used. Each one costs a pass over all times."""
TIE = 1e-3
"""Standard error of the condition "no force in flight", over the static force. It allows for errors of the model."""
MEAN = 4.5
"""Length of the windows in which the mean contact force is compared with the static force, in contact periods: a few
impacts with their flights."""
OF_SWING, OF_STATIC = 0.1, 2e-3
"""Standard error of the mean force in a window: OF_SWING times the standard deviation of the force in it plus OF_STATIC
times the static force. The mean is the less certain, the more the force varies."""
SLOWEST = 1.0 / 30.0
"""Lowest natural angular frequency of the deck, rad per contact period, that is assumed for its unknown initial motion.
It bounds that motion where the bearing is soft."""
MOST_TIMES = 20_000
"""Largest number of times at which the drift is computed; between them it is interpolated linearly."""
WINDOWS = 100
"""Largest number of windows with a mean force; in longer recordings the windows become longer."""


class Bearing(NamedTuple):
    """Bearing of a deck and samples of its acceleration."""

    mass: float  # kg
    stiffness: float  # N/m
    damping: float  # N·s/m
    interval: float  # s
    period: float  # s, of the wheel on its contact
    noise: float  # m/s²: standard deviation of a sample
    at_rest: bool  # before the first sample

    def samples(self, periods: float) -> int:
        """Return the number of samples in so many contact periods."""
        return round(periods * self.period / self.interval)


class BearingTerm(NamedTuple):
    """K·y + C_d·v over time."""

    values: FloatArray  # N
    variance: FloatArray  # N²
    flights: int


class DriftCondition(NamedTuple):
    """A known value of the drift: a condition."""

    time: float  # s after the first sample
    drift: float  # N
    variance: float  # N²


class Drift:
    """Mean and variance of the drift over time, given the conditions (ties) taken so far.

    Parameters
    ----------
    bearing
        Of the deck.
    time
        s after the first sample, uniform, (n,).
    static
        Static force, N. It is the scale of the unknown force of the bearing at the start, if the deck is not at rest
        then.
    """

    def __init__(self, bearing: Bearing, time: FloatArray, static: float) -> None:
        self._bearing, self._time = bearing, time
        k, c = bearing.stiffness, bearing.damping
        variance = bearing.noise**2 * bearing.interval * (k**2 * time**3 / 3.0 + k * c * time**2 + c**2 * time)
        self._start = 0.0 if bearing.at_rest else static**2
        self._impedance = bearing.mass * max(k, bearing.mass * (SLOWEST / bearing.period) ** 2)
        variance = variance + self._start * (1.0 + (k * time + c) ** 2 / self._impedance)
        self.mean, self.variance = np.zeros(len(time)), variance
        self._rows: list[FloatArray] = []

    def condition_on(self, tie: DriftCondition) -> None:
        """Condition the drift on one more known value."""
        i = round(tie.time / float(self._time[1] - self._time[0]))
        covariance = self._prior_covariance(float(self._time[i]))
        for row in self._rows:
            covariance -= row[i] * row
        total = max(float(covariance[i]), 0.0) + tie.variance
        self.mean = self.mean + covariance * ((tie.drift - self.mean[i]) / total)
        self._rows.append(covariance / np.sqrt(total))
        self.variance = np.maximum(self.variance - self._rows[-1] ** 2, 0.0)

    def _prior_covariance(self, at: float) -> FloatArray:
        """Return the prior covariance with all times, N²: that of integrated white noise, and that of the start."""
        bearing, k, c = self._bearing, self._bearing.stiffness, self._bearing.damping
        here, there = k * at + c, k * self._time + c
        both = np.minimum(self._time, at)
        shape = here * there * both - k * (here + there) * both**2 / 2.0 + k**2 * both**3 / 3.0
        start = self._start * (1.0 + here * there / self._impedance)
        return np.asarray(bearing.noise**2 * bearing.interval * shape + start)


def bearing_term(bearing: Bearing, g: FloatArray, deviation: float, trim: int, static: float) -> BearingTerm:
    """Return the bearing's term.

    Parameters
    ----------
    bearing
        Of the deck.
    g
        -M·a without gaps, smoothed if there is much noise, N.
    deviation
        Standard error of `g`'s samples, N.
    trim
        Number of samples at each end of a flight that are left out, because smoothing mixes them with contact.
    static
        Static force, N.
    """
    time: FloatArray = bearing.interval * np.arange(len(g), dtype=np.float64)
    every = 1 + len(g) // MOST_TIMES
    raw = _integrated_from_rest(bearing, -g / bearing.mass)
    total = g - raw + static
    drift = Drift(bearing, time[::every], static)
    for tie in _mean_conditions(bearing, total, static):
        drift.condition_on(tie)
    shortest, after, flights = max(bearing.samples(FLIGHT), 3), 0, 0
    while True:
        mean, variance = (np.interp(time, time[::every], found) for found in (drift.mean, drift.variance))
        level = NEAR_ZERO * static + 3.0 * np.sqrt(deviation**2 + variance)
        near_zero = (np.abs(total + mean) < level) & (level < HIGHEST * static)
        flight = _first_flight(near_zero, trim, shortest, after)
        if flight is None or flights == MOST:
            return BearingTerm(raw - mean, variance, flights)
        for tie in _flight_conditions(bearing, total, *flight, static):
            drift.condition_on(tie)
        after, flights = flight[1] + 1, flights + 1


def _integrated_from_rest(bearing: Bearing, a: FloatArray) -> FloatArray:
    """Return K·y + C_d·v from rest; the acceleration a is linear between samples."""
    h = bearing.interval
    v = np.append(0.0, np.cumsum(0.5 * h * (a[:-1] + a[1:])))
    y = np.append(0.0, np.cumsum(h * v[:-1] + h**2 * (2.0 * a[:-1] + a[1:]) / 6.0))
    return np.asarray(bearing.stiffness * y + bearing.damping * v)


def _mean_conditions(bearing: Bearing, total: FloatArray, static: float) -> list[DriftCondition]:
    """Return the conditions that the mean force over windows gives."""
    count = len(total)
    size = min(max(bearing.samples(MEAN), count // WINDOWS, 2), count)
    ties = []
    for start in range(0, count - size + 1, size):
        window = total[start : start + size]
        deviation = OF_SWING * float(window.std()) + OF_STATIC * static
        ties.append(
            DriftCondition(bearing.interval * (start + 0.5 * (size - 1)), static - float(window.mean()), deviation**2)
        )
    return ties


def _first_flight(near_zero: NDArray[np.bool_], trim: int, shortest: int, after: int) -> tuple[int, int] | None:
    """Return the trimmed bounds of the first flight that begins at a given sample or later."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near_zero, [False]])))
    for start, end in edges.reshape(-1, 2):
        if start + trim >= after and end - start - 2 * trim >= shortest:
            return int(start + trim), int(end - trim)
    return None


def _flight_conditions(
    bearing: Bearing, total: FloatArray, start: int, end: int, static: float
) -> list[DriftCondition]:
    """Return the conditions that a flight gives, one for each piece."""
    noise, ties = (bearing.mass * bearing.noise) ** 2, []
    for piece in np.array_split(np.arange(start, end), -(-(end - start) // max(bearing.samples(PIECE), 1))):
        variance = noise / len(piece) + (TIE * static) ** 2
        ties.append(DriftCondition(bearing.interval * float(piece.mean()), -float(total[piece].mean()), variance))
    return ties
