"""Pulses of a channel: what each axle that passes leaves in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import find_peaks, peak_prominences

from wheeltapper.diagnosis.wayside.channels import PEAKS, Channel, FloatArray, foot_line
from wheeltapper.record.filtering import low_passed

FAINTEST = 6.0
"""A pulse rises at least this many standard deviations of the noise above the zero line,"""
SMALLEST = (0.3, 0.1, 0.05)
"""and this share of the largest force of the channel: the last one, once the zero line is drawn ever better."""
JOINED = 0.3
"""Pulses closer than this share of their lengths are one, in which the wheel left the rail."""
SEATS, AXLES = 0.03, 60.0
"""Least prominence of a pulse at a seat, over its height, and the cut-off of the force where it is looked for, Hz."""
SHORT = 0.6
"""A pulse shorter than this share of the usual ones rings after a strike elsewhere,"""
HIGH = 0.4
"""if it is not as high as this share of them, so that it may be of a wheel that left the rail."""
SURE = 0.25
"""Pulses of this share of the highest are certainly of wheels: by them the usual ones are known."""
AROUND = 15
"""Number of pulses of which the median is the usual duration."""


@dataclass(frozen=True, eq=False)
class Pulses:
    """The pulses of a channel.

    Attributes
    ----------
    channel
        The channel.
    times
        Middle of each pulse, s.
    durations
        Time between the two places at half of the height, s.
    heights
        Median of the force in the middle half, N.
    force
        Force after the low-pass, above the zero line, N.
    zero
        Zero line, N.
    noise
        Standard deviation of the low-passed noise, N.
    """

    channel: Channel
    times: FloatArray
    durations: FloatArray
    heights: FloatArray
    force: FloatArray
    zero: FloatArray
    noise: float


def pulses_of(channel: Channel) -> Pulses:
    """Return the pulses of a channel; its zero line is drawn through the gaps between them."""
    smooth = channel.smooth(PEAKS)
    zero = foot_line(smooth, channel.rate)
    for share in SMALLEST:
        force = smooth - zero
        noise = noise_of(force, channel.rate, PEAKS)
        spans = _spans(force, max(FAINTEST * noise, share * float(force.max(initial=0.0))))
        lengths = spans[:, 1] - spans[:, 0]
        zero = _zero_line(smooth, spans[lengths >= SHORT * np.median(lengths)] if len(spans) else spans, zero)
    force = smooth - zero
    noise = noise_of(force, channel.rate, PEAKS)
    if np.isnan(channel.length):
        rows = _at_seat(force, channel.rate, max(FAINTEST * noise, SMALLEST[-1] * float(force.max(initial=0.0))))
    else:
        rows = [row for span in spans if (row := _half_height(force, *span)) is not None]
    begin, end, heights = np.array(rows).reshape(-1, 3).T
    durations = (end - begin) / channel.rate
    real = _real(durations, heights)
    times = channel.start + 0.5 * (begin + end) / channel.rate
    return Pulses(channel, times[real], durations[real], heights[real], force, zero, noise)


def noise_of(force: FloatArray, rate: float, cutoff: float) -> float:
    """Return the standard deviation of a low-passed noise, N, by what the force changes in a period of the cut-off.

    Neither drift nor axles count, since most samples are beside both.
    """
    apart = max(round(rate / cutoff), 1)
    return float(1.4826 / 2.0**0.5 * np.median(np.abs(force[apart:] - force[:-apart])))


def _spans(force: FloatArray, level: float) -> NDArray[np.int64]:
    """Return first and last sample above a level; spans are joined where the force falls away for a moment."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (force > level).astype(np.int8), [0]))))
    spans = edges.reshape(-1, 2)
    while len(spans) > 1:
        lengths = spans[:, 1] - spans[:, 0]
        gaps = spans[1:, 0] - spans[:-1, 1]
        near = gaps < JOINED * np.maximum(lengths[1:], lengths[:-1])
        if not near.any():
            break
        begin, end = spans[np.concatenate(([True], ~near)), 0], spans[np.concatenate((~near, [True])), 1]
        spans = np.column_stack([begin, end])
    return spans


def _zero_line(smooth: FloatArray, spans: NDArray[np.int64], before: FloatArray) -> FloatArray:
    """Return lines between the medians of gaps, so that a missed pulse does not count, nor what is near a pulse."""
    if not len(spans):
        return before
    lengths = spans[:, 1] - spans[:, 0]
    begin = np.concatenate(([0], spans[:, 1] + lengths // 4 + 1))
    end = np.concatenate((spans[:, 0] - lengths // 4 - 1, [len(smooth)]))
    wide = end - begin >= max(8.0, float(np.median(lengths)))
    if not wide.any():
        return before
    middles, feet = [], []
    least = int(max(np.median(end[wide] - begin[wide]), 4.0 * np.median(lengths), 64.0))
    for a, b in zip(begin[wide], end[wide], strict=True):  # long gaps give several points, so that lines follow a drift
        cuts = np.linspace(a, b, int(np.clip((b - a) // least, 1, 64)) + 1).astype(int)
        middles += (0.5 * (cuts[1:] + cuts[:-1])).tolist()
        feet += [float(np.median(smooth[i:k])) for i, k in zip(cuts[:-1], cuts[1:], strict=True)]
    return np.interp(np.arange(len(smooth)), middles, feet)


def _at_seat(force: FloatArray, rate: float, level: float) -> list[tuple[float, float, float]]:
    """Return where the pulses at a seat begin and end, in samples, and their heights; those of a bogie overlap."""
    slow = low_passed(force, rate, AXLES) if rate > 2.5 * AXLES else force
    at, _ = find_peaks(slow, height=level)
    at = at[peak_prominences(slow, at)[0] >= SEATS * slow[at]]
    apart = max(round(rate / AXLES / 4.0), 1)
    out = []
    for i in at[(at >= apart) & (at < len(slow) - apart)]:
        before, here, behind = slow[[i - apart, i, i + apart]]
        bend = min(before - 2.0 * here + behind, -1e-9 * here)  # a parabola through three points
        middle, half = i + 0.5 * apart * (before - behind) / bend, apart * np.sqrt(-here / bend)
        out.append((float(middle - half), float(middle + half), float(here)))
    return out


def _half_height(force: FloatArray, first: int, last: int) -> tuple[float, float, float] | None:
    """Return where a pulse begins and ends at half of its height, in samples, and its height, N."""
    inner = force[first + (last - first) // 4 : last - (last - first) // 4]
    if len(inner) < 2:
        return None
    height = float(np.median(inner))
    over = np.flatnonzero(force[first:last] > 0.5 * height) + first
    if not len(over) or over[0] == 0 or over[-1] + 1 >= len(force):
        return None
    return _crossing(force, over[0] - 1, 0.5 * height), _crossing(force, over[-1], 0.5 * height), height


def _crossing(force: FloatArray, i: int, level: float) -> float:
    """Return where the force crosses a level between the samples i and i + 1."""
    step = force[i + 1] - force[i]
    return float(i + (np.clip((level - force[i]) / step, 0.0, 1.0) if step else 0.5))


def usual_height(heights: FloatArray) -> float:
    """Return the median of the heights, N, of pulses that are certainly of wheels."""
    return float(np.median(heights[heights >= SURE * heights.max()]))


def _real(durations: FloatArray, heights: FloatArray) -> NDArray[np.bool_]:
    """Return which pulses are of wheels, and not of what rings after a strike beside the sensor."""
    if not len(durations):
        return np.zeros(0, dtype=bool)
    sure = np.flatnonzero(heights >= SURE * heights.max())
    near = median_filter(durations[sure], size=min(AROUND, len(sure)), mode="nearest")
    usual = np.interp(np.arange(len(durations)), sure, near)
    return np.array((durations > SHORT * usual) | (heights > HIGH * usual_height(heights)))
