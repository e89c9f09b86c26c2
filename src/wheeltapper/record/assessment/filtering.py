"""Low-pass filters without phase, and sliding means, of sampled forces; what of them is a reading.

A filter without phase takes as much of what follows as of what came before. What follows the end of a run is not known:
an event may be cut, or begin just behind it. So readings end one settling time before the end of the run. A run that
starts in equilibrium was in it before, and is read from its beginning (docs/decisions/0042-ends-of-filters.md).
"""

from __future__ import annotations

from functools import lru_cache
from math import atan, ceil, log, pi, sin, tan

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.arguments import as_count, as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note

FloatArray = NDArray[np.float64]
PER_PERIOD = 100.0
"""Samples in a period of the cut-off frequency, at least."""
LEAST_PER_PERIOD = 10.0
"""Samples in a period that may be asked for."""
LEAST, MOST_PER_PERIOD = 1e-2, 1e7
"""Lowest cut-off, Hz, and samples in a period, at most: beyond, rounding moves the filter's poles, near 1."""
SLOWEST = 20e3
"""Samples per second, at least: impacts last about a millisecond, and what is sampled too coarsely folds back."""

RECORDER_ORDER = 8
"""Of a recorder's filter."""

PADDED = 2.0
"""Settling times of samples that are put before and behind those that are filtered."""
REMAINS = 0.002
"""Largest weight of all that is farther away than the settling time, on one side."""
LARGER, DOUBTFUL, NEGLIGIBLE = 0.1, 0.5, 5e-3
"""Shares of the range of the readings by which a value that is not read must exceed them to be told, and to put them in
doubt; beside that by this share of the largest force."""


def usual_rate(cutoff: float) -> float:
    """Return the samples per second at which a force is filtered with this cut-off, both in Hz."""
    return max(PER_PERIOD * cutoff, SLOWEST)


def checked_filter(cutoff: float | str, order: int) -> tuple[float, int]:
    """Return cut-off, Hz, and order of a filter; the order is even, since half of it runs each way."""
    order = as_count(order, "order", 2, 20)
    if order % 2:
        raise InputError("", "order", str(order), "an even number: half of it runs forwards, half backwards")
    found = as_quantity(cutoff, "cutoff", "frequency")
    if found < LEAST:
        raise InputError("", "cutoff", f"{found:g} Hz", f"at least {LEAST:g} Hz")
    return found, order


def low_passed(samples: FloatArray, rate: float, cutoff: float, order: int = 4, *, at_rest: bool = False) -> FloatArray:
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
    at_rest
        Whether the first value held before. Beyond the other end, and before where this is False, the samples are
        mirrored: a guess, in which a force goes on around its mean.
    """
    from scipy.signal import sosfiltfilt

    sections = _sections(rate, cutoff, order)
    beyond = min(len(samples), ceil(PADDED * settling_time(cutoff, order) * rate))
    before = np.repeat(samples[:1], beyond, axis=0) if at_rest else samples[:beyond][::-1]
    padded = np.concatenate([before, samples, samples[len(samples) - beyond :][::-1]])
    return np.asarray(sosfiltfilt(sections, padded, axis=0, padlen=0))[beyond : beyond + len(samples)]


@lru_cache(maxsize=64)
def _sections(rate: float, cutoff: float, order: int) -> FloatArray:
    """Return the filter that runs each way, as sections of second order."""
    from scipy.signal import butter

    return np.asarray(butter(order // 2, _corner(rate, cutoff, order), fs=rate, output="sos"))


def _corner(rate: float, cutoff: float, order: int) -> float:
    """Return the corner of the filter that runs each way, Hz."""
    return atan(tan(pi * cutoff / rate) * (2.0**0.5 - 1.0) ** (-1.0 / order)) * rate / pi


def passed_share(frequencies: FloatArray, rate: float, cutoff: float, order: int) -> FloatArray:
    """Return what `low_passed` leaves of amplitudes at frequencies, Hz."""
    over = np.tan(np.pi * np.minimum(frequencies / rate, 0.4999)) / tan(pi * cutoff / rate)
    return np.asarray(1.0 / (1.0 + (2.0**0.5 - 1.0) * over**order))


def oversampled(rate: float) -> int:
    """Return how many values to a sample a recorder's filter is given: sampled at its own rate, impacts fold back."""
    return max(2, ceil(SLOWEST / rate))


def recorded(fine: FloatArray, rate: float, cutoff: float, finer: int) -> FloatArray:
    """Return what a recorder samples, at a rate, behind its filter, both in Hz, of values `finer` times as often."""
    return low_passed(fine, finer * rate, cutoff, RECORDER_ORDER)[::finer]


def settling_time(cutoff: float, order: int = 4) -> float:
    """Return the time, s, beyond which all samples of one side together weigh at most `REMAINS`.

    It is that of the slowest pole, of damping ratio sin(π/order): exp(-σ·T)/2 bounds that weight. For the order 4 it is
    a period of the cut-off.
    """
    decay = 2.0 * pi * cutoff * (2.0**0.5 - 1.0) ** (-1.0 / order) * sin(pi / order)
    return float(log(0.5 / REMAINS) / decay)


def readings(filtered: FloatArray, rate: float, cutoff: float, order: int = 4, *, at_rest: bool = True) -> FloatArray:
    """Return low-passed samples, with NaN where they depend on what is beyond the ends."""
    out, unknown = filtered.copy(), ceil(settling_time(cutoff, order) * rate)
    out[max(len(out) - unknown, 0) :] = np.nan
    if not at_rest:
        out[:unknown] = np.nan
    return out


def note_of_ends(
    filtered: FloatArray, read: FloatArray, cutoff: float, order: int = 4, *, at_rest: bool = True
) -> Note:
    """Return what is not read of a run: whether larger values may be there, with a doubt if they are much larger.

    Parameters
    ----------
    filtered, read
        Samples from `low_passed` and from `readings`; what counts is how large they are.
    cutoff, order, at_rest
        Of both.
    """
    seconds, cause = settling_time(cutoff, order), f"ends of filters of {cutoff:g} Hz, order {order}"
    ends = f"the last {seconds:.2g} s" if at_rest else f"the first and the last {seconds:.2g} s"
    said = f"forces below {cutoff:g} Hz are not read in {ends} of the run, since the filter needs what lies beyond"
    known = read[np.isfinite(read).reshape(len(read), -1).all(axis=1)]
    if not len(known):
        return Note(f"{said}: nothing is left; lengthen the run", cause, 1.0, doubtful=True)
    most, least = known.max(axis=0), known.min(axis=0)
    excess = filtered.max(axis=0) - most - NEGLIGIBLE * np.abs(filtered).max()
    told, doubtful = (bool((excess > share * (most - least)).any()) for share in (LARGER, DOUBTFUL))
    if told:
        said += ": larger values may be there, and a longer run would show them"
    return Note(said, cause, 0.5 * told, doubtful=doubtful and told)


def sliding_mean(samples: FloatArray, width: int) -> FloatArray:
    """Return the mean over each window of so many samples along the first axis, which ends inside the record.

    It is NaN where a sample of the window is.
    """
    missing = np.isnan(samples)
    total, lost = (
        np.cumsum(np.insert(one, 0, 0.0, axis=0), axis=0) for one in (np.where(missing, 0.0, samples), missing * 1.0)
    )
    means = (total[width:] - total[:-width]) / width
    return np.where(lost[width:] > lost[:-width], np.nan, means)


def checked_rate(rate: float | str, cutoff: float) -> float:
    """Return the samples per second, Hz, that are asked for."""
    found = as_quantity(rate, "rate", "frequency")
    if found < LEAST_PER_PERIOD * cutoff:
        least = f"at least {LEAST_PER_PERIOD * cutoff:g} Hz, {LEAST_PER_PERIOD:g} times the cut-off"
        raise InputError("", "rate", f"{found:g} Hz for a cut-off of {cutoff:g} Hz", least)
    if cutoff and found > MOST_PER_PERIOD * cutoff:
        most = f"at most {MOST_PER_PERIOD * cutoff:g} Hz, {MOST_PER_PERIOD:g} times the cut-off"
        raise InputError("", "rate", f"{found:g} Hz for a cut-off of {cutoff:g} Hz", most)
    return found
