"""Low-pass filters without phase, and sliding means, of sampled forces."""

from __future__ import annotations

from math import atan, pi, tan

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.arguments import as_count, as_quantity
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
PER_PERIOD = 100.0
"""Samples in a period of the cut-off frequency, at least."""
LEAST_PER_PERIOD = 10.0
"""Samples in a period that may be asked for."""
SLOWEST = 20e3
"""Samples per second, at least: impacts last about a millisecond, and what is sampled too coarsely folds back."""


def usual_rate(cutoff: float) -> float:
    """Return the samples per second at which a force is filtered with this cut-off, both in Hz."""
    return max(PER_PERIOD * cutoff, SLOWEST)


def checked_filter(cutoff: float | str, order: int) -> tuple[float, int]:
    """Return cut-off, Hz, and order of a filter; the order is even, since half of it runs each way."""
    order = as_count(order, "order", 2, 20)
    if order % 2:
        raise InputError("", "order", str(order), "an even number: half of it runs forwards, half backwards")
    return as_quantity(cutoff, "cutoff", "frequency"), order


def low_passed(samples: FloatArray, rate: float, cutoff: float, order: int = 4) -> FloatArray:
    """Return samples (along the first axis) after a Butterworth filter without phase.

    A filter of half the order runs forwards and backwards, so that |H|² = 1/(1 + (f/f_c)^order) is what is left of an
    amplitude. It would be 1/2 at f_c. Therefore f_c lies above the cut-off by the factor (√2 - 1)^(-1/order), 1.25 for
    the order 4, and at the cut-off 1/√2 is left, -3 dB; far above it the slope is that of the order, 24 dB per octave
    for the order 4. Frequencies are those of the bilinear transform, tan(π·f/rate).

    Parameters
    ----------
    samples
        Uniform samples.
    rate
        Samples per second, more than twice the cut-off.
    cutoff
        Frequency of -3 dB, Hz.
    order
        An even number.
    """
    from scipy.signal import butter, sosfiltfilt

    corner = atan(tan(pi * cutoff / rate) * (2.0**0.5 - 1.0) ** (-1.0 / order)) * rate / pi
    sections = butter(order // 2, corner, fs=rate, output="sos")
    before = min(len(samples) - 1, int(2.0 * rate / cutoff))  # the first and the last force hold on beyond the ends
    return np.asarray(sosfiltfilt(sections, samples, axis=0, padtype="constant", padlen=before))


def sliding_mean(samples: FloatArray, width: int) -> FloatArray:
    """Return the mean over each window of so many samples along the first axis, which ends inside the record."""
    total = np.cumsum(np.insert(samples, 0, 0.0, axis=0), axis=0)
    return np.asarray((total[width:] - total[:-width]) / width)


def checked_rate(rate: float | str, cutoff: float) -> float:
    """Return the samples per second, Hz, that are asked for."""
    found = as_quantity(rate, "rate", "frequency")
    if found < LEAST_PER_PERIOD * cutoff:
        least = f"at least {LEAST_PER_PERIOD * cutoff:g} Hz, {LEAST_PER_PERIOD:g} times the cut-off"
        raise InputError("", "rate", f"{found:g} Hz for a cut-off of {cutoff:g} Hz", least)
    return found
