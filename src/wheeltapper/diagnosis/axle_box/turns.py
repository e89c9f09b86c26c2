"""The turns of a wheel in what its axle box recorded, and their average.

Theory: docs/theory/gauges.rst, section 16.11.
"""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares

from wheeltapper.diagnosis.gauges.passing import SAMPLES

FloatArray = NDArray[np.float64]
FEWEST, FIRST = 6, 12
"""Turns that are needed, and among which the period is looked for at first."""
STEP, FINE, BESIDE = 0.5, 0.1, 6
"""Of the period in a search at first, and near what was found: the last turn is moved by this over the cut-off
frequency; and how many such steps are tried to each side."""
CLIPPED = 0.99
"""Accelerations count up to what this part of them does not exceed: so no joint counts for many strikes of a wheel."""
REPEATS, STRIKES = 2.0, 36.0
"""A wheel's turns are seen if the median turn has so many times the energy that chance gives it, or its largest
acceleration."""
LAG, TOGETHER, REFINED = 2e-3, 1e-4, 4
"""Turns are moved by so many seconds to be most like the median turn; lags that differ by less tell of noise, s;
and how often this is done."""
CHANGE = 5e-4
"""Largest change of the period from turn to turn, over it."""
SEATS, APART = 4, 0.07
"""Orders near the first so many harmonics of the seats' passing, nearer than this share, do not tell the period."""
SEEN = 12.0
"""A line of the seats' passing is seen if its power is so many times that around it."""
AROUND, NEXT = 30, 3
"""Lines of the spectrum to each side that tell the power around, and those that do not, next to the line."""


class Turns(NamedTuple):
    """When the wheel turns.

    Attributes
    ----------
    period
        Duration of the first turn, s.
    change
        By how much each turn is longer than the one before, s.
    whole
        How many are whole.
    bins
        Places of the wheel at which turns are compared.
    """

    period: float
    change: float
    whole: int
    bins: int

    @property
    def mean(self) -> float:
        """Mean duration of a turn, s."""
        return float(self.when(float(self.whole)) / self.whole)

    def when(self, turns: FloatArray | float) -> FloatArray:
        """Return the times after the first sample at which so many turns are done, s."""
        return np.asarray(self.period * turns + 0.5 * self.change * np.square(turns))

    def done(self, times: FloatArray) -> FloatArray:
        """Return how many turns are done at times."""
        slow = 2.0 * self.change * times / self.period**2
        return np.asarray(2.0 * times / self.period / (1.0 + np.sqrt(np.maximum(1.0 + slow, 0.0))))

    def folded(self, samples: FloatArray, rate: float) -> FloatArray:
        """Return samples turn by turn, (turns, bins); those beyond the ends are missing."""
        places = np.arange(self.whole)[:, None] + np.arange(self.bins) / self.bins
        return np.asarray(np.interp(self.when(places) * rate, np.arange(len(samples)), samples, right=np.nan))

    def unfolded(self, average: FloatArray, times: FloatArray) -> FloatArray:
        """Return the average turn, (bins,), at times."""
        ring = CubicSpline(np.arange(self.bins + 1), np.append(average, average[0]), bc_type="periodic")
        return np.asarray(ring(np.mod(self.done(times), 1.0) * self.bins))


def turns_of(samples: FloatArray, rate: float, expected: float, spread: float, seats: float, cutoff: float) -> Turns:
    """Return the turns whose average has most energy; those that are expected where none stands out.

    Parameters
    ----------
    samples
        Below the cut-off frequency, m/s².
    rate, cutoff
        Hz.
    expected, spread
        Duration of a turn, s, and how far it may be from it, over it.
    seats
        Distance of the seats over the wheel's circumference.
    """
    level = float(np.quantile(np.abs(samples), CLIPPED))
    samples, duration = np.clip(samples, -level, level), len(samples) / rate
    whole = int(duration / (expected * (1.0 + spread)))
    count = min(FIRST, whole)
    step = STEP / cutoff / count
    periods = expected + _steps(spread * expected, step)
    changes = _steps(CHANGE * expected, 2.0 * step / count)
    best = _best(samples, rate, periods, changes, count, seats, cutoff)
    while True:
        near = _steps(BESIDE * FINE / cutoff / count, FINE / cutoff / count)
        for _ in range(2):
            periods, changes = best.period + near, best.change + near * 2.0 / count
            best = _best(samples, rate, periods, changes, count, seats, cutoff)
        if count == whole:
            break
        count = min(2 * count, whole)
    if _repeats(best.folded(samples, rate)):
        for _ in range(REFINED):
            best = _refined(best, samples, rate)
    else:
        best = Turns(expected, 0.0, whole, ceil(SAMPLES * cutoff * expected))
    return best._replace(whole=int(best.done(np.array([duration]))[0]))


def _steps(ends: float, step: float) -> FloatArray:
    """Return steps about zero, to both ends."""
    many = ceil(ends / step - 1e-9)
    return np.asarray(step * np.arange(-many, many + 1), dtype=np.float64)


def _repeats(folded: FloatArray) -> bool:
    """Return whether turns are alike."""
    chance = 0.5 * pi * uniform_filter1d(np.nanvar(folded, axis=0, ddof=1), 5, mode="wrap") / len(folded)
    squared = (np.nanmedian(folded, axis=0) - np.nanmean(folded)) ** 2
    return bool(squared.mean() > REPEATS * chance.mean() or np.max(squared / chance) > STRIKES)


def _refined(turns: Turns, samples: FloatArray, rate: float) -> Turns:
    """Return turns whose lags behind the median turn do not grow."""
    folded = np.nan_to_num(turns.folded(samples, rate))
    lines = np.fft.rfft(folded, axis=1)
    alike = np.fft.irfft(lines * np.conj(np.fft.rfft(np.median(folded, axis=0))), turns.bins, axis=1)
    most = ceil(LAG / turns.period * turns.bins)
    near = alike[:, np.arange(-most - 1, most + 2)]
    top = 1 + np.argmax(near[:, 1:-1], axis=1)
    a, b, c = (near[np.arange(turns.whole), top + one] for one in (-1, 0, 1))
    lag = (top - most - 1 + 0.5 * (a - c) / (a - 2.0 * b + c)) / turns.bins * turns.period
    number = np.arange(turns.whole) + 0.5
    powers = np.stack([np.ones_like(number), number, number**2], axis=1)

    def left(x: FloatArray) -> FloatArray:
        return np.asarray((powers @ x - lag) / TOGETHER)

    found = least_squares(left, np.zeros(3), loss="cauchy", x_scale="jac").x
    return turns._replace(period=turns.period + float(found[1]), change=turns.change + 2.0 * float(found[2]))


def _best(
    samples: FloatArray, rate: float, periods: FloatArray, changes: FloatArray, count: int, seats: float, cutoff: float
) -> Turns:  # fmt: skip
    tried = [
        Turns(float(period), float(change), count, ceil(SAMPLES * cutoff * float(period)))
        for period in periods for change in changes
    ]  # fmt: skip
    return max(tried, key=lambda one: _energy(one.folded(samples, rate), seats))


def _energy(folded: FloatArray, seats: float) -> float:
    """Return the energy of the average turn, without orders that may be the seats'."""
    lines = np.abs(np.fft.rfft(np.nan_to_num(folded).mean(axis=0)))
    order = np.arange(len(lines)) * seats
    near = np.rint(order)
    own = (abs(order - near) > APART * near) | (near > SEATS)
    return float(np.sum(lines[1:][own[1:]] ** 2) / folded.shape[1] ** 2)


def average_of(folded: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the average turn without its mean, and its standard error; missing samples do not count."""
    count = np.maximum(np.isfinite(folded).sum(axis=0), 2)
    mean = np.nanmean(folded, axis=0)
    variance = uniform_filter1d(np.nanvar(folded, axis=0, ddof=1) / count, 5, mode="wrap")
    return mean - mean.mean(), np.sqrt(variance)


def seats_of(samples: FloatArray, rate: float, expected: float, spread: float) -> float | None:
    """Return the frequency at which seats are passed, Hz, if it is seen in samples; near an expected one."""
    power = np.abs(np.fft.rfft(samples * np.hanning(len(samples)), 2 * len(samples))) ** 2
    line = expected * 2 * len(samples) / rate
    first, last = int(line * (1.0 - spread)), ceil(line * (1.0 + spread))
    if first <= AROUND or last >= len(power) - AROUND:
        return None
    top = first + int(np.argmax(power[first:last]))
    around = power[top - AROUND : top + AROUND + 1]
    beside = np.abs(np.arange(-AROUND, AROUND + 1)) > NEXT
    if power[top] < SEEN * np.mean(around[beside]):
        return None
    a, b, c = np.log(power[top - 1 : top + 2])
    return float((top + 0.5 * (a - c) / (a - 2.0 * b + c)) * rate / (2 * len(samples)))
