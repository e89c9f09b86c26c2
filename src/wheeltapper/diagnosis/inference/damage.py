"""Samples that a sensor or its logger has spoilt, and that count as missing.

spike   A few samples far from a smooth curve through their neighbours, to which the neighbours themselves are near. An
        impact, and a wheel that enters or leaves the deck, bend the neighbours, too.
stuck   One value many times in a row, more often than the noise lets it repeat.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
WIDEST, SHORT = 8, 0.1
"""Number of samples in the widest spike that is looked for, and its largest duration in contact periods: impacts last
more than five times as long. What lies between two spikes so close goes with them."""
AROUND, DEGREE = 5, 3
"""Samples on either side of a spike through which a curve is laid, and its degree."""
FAR = 8.0
"""A spike is this far from the curve through its neighbours: in standard deviations of what the noise, or else the
distance of the neighbours from the curve, makes likely. Noise alone goes so far once in 1e15 samples."""
CHANCE = 1e-6
"""Probability with which noise alone may repeat a value as often in a recording as where it is taken to be stuck."""
MOST = 0.01, 0.05
"""Largest share of the samples that spikes, and stuck values, may be. If there are more, they are what the sensor
measured: nothing is left out."""


def without_damage(recording: Recording, noise: float, period: float) -> Recording:
    """Return a recording without its spikes and stuck samples, and with a note on each kind.

    `noise` is the standard deviation of its samples' noise, m/s², `period` the contact period, s.
    """
    widest = min(WIDEST, int(SHORT * period * recording.rate))
    notes, lost = [], np.zeros(len(recording.samples), dtype=bool)
    for found, most, said in (
        (spikes_in(recording.samples, noise, widest), MOST[0], "spikes"),
        (stuck_in(recording), MOST[1], "at which the sensor is stuck at one value"),
    ):
        if found.any() and found.mean() <= most:
            lost |= found
            first, last = recording.times[np.flatnonzero(found)[[0, -1]]]
            notes.append(f"{int(found.sum())} samples are left out: {said}, {1e3 * first:.1f} to {1e3 * last:.1f} ms")
    if not notes:
        return recording
    samples, clipped = np.where(lost, np.nan, recording.samples), recording.clipped & ~lost
    return replace(recording, samples=samples, clipped=clipped, notes=(*recording.notes, *notes))


def spikes_in(samples: FloatArray, noise: float, widest: int = WIDEST) -> BoolArray:
    """Return which samples are in spikes of at most `widest` samples; `noise` is its standard deviation, m/s²."""
    found = np.zeros(len(samples), dtype=bool)
    for width in range(1, widest + 1):
        many = 2 * AROUND + width
        if len(samples) < many:
            break
        windows = np.lib.stride_tricks.sliding_window_view(samples, many)
        inside = np.arange(AROUND, AROUND + width)
        places = np.linspace(-1.0, 1.0, many)
        beside = np.delete(np.arange(many), inside)
        powers = np.vander(places, DEGREE + 1)
        through = powers @ np.linalg.pinv(powers[beside])  # (places, neighbours): values of the curve
        off = windows - windows[:, beside] @ through.T
        left = np.sqrt((off[:, beside] ** 2).sum(axis=1) / (len(beside) - DEGREE - 1))
        spread = np.sqrt(1.0 + (through[inside] ** 2).sum(axis=1))
        far = np.abs(off[:, inside]) > FAR * np.maximum(left, noise)[:, None] * spread
        for start in np.flatnonzero(far[:, 0] & far[:, -1]):
            found[start + AROUND : start + AROUND + width] = True
    return found


def stuck_in(recording: Recording) -> BoolArray:
    """Return which samples repeat one value for too long; the largest and the smallest may be ends of the range."""
    samples, out = recording.samples, np.zeros(len(recording.samples), dtype=bool)
    ends_of_range = recording.clipped | (samples == np.nanmax(samples)) | (samples == np.nanmin(samples))
    equal = (np.diff(samples) == 0.0) & ~ends_of_range[1:]
    share = float(equal.mean()) if len(equal) else 0.0
    if not 0.0 < share <= MOST[1]:
        return out
    longest = 1.0 + np.log(len(samples) / CHANCE) / np.log(1.0 / share)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], equal, [False]])))
    for first, last in ends.reshape(-1, 2):  # samples first to last, inclusive
        if last - first + 1 > longest:
            out[first : last + 1] = True
    return out
