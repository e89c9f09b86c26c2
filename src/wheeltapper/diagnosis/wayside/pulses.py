"""Pulses of a channel: what each axle that passes leaves in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import find_peaks, peak_prominences

from wheeltapper.diagnosis.alarms import PEAKS
from wheeltapper.diagnosis.wayside.channels import Channel, FloatArray, foot_points
from wheeltapper.record.assessment.filtering import low_passed

FAINTEST = 6.0
"""A pulse rises at least this many standard deviations of the noise above the zero line,"""
SMALLEST = (0.3, 0.1, 0.05)
"""and this share of the largest force of the channel: the last one, once the zero line is drawn ever better."""
JOINED, LONGEST_FLIGHT = 0.3, 0.05
"""Pulses closer than this share of their lengths, and than this time, s, are one, in which the wheel left the rail."""
SEATS, AXLES = 0.03, 60.0
"""Least prominence of a pulse at a seat, over its height, and the cut-off of the force where it is looked for, Hz."""
SHORT = 0.6
"""A pulse shorter than this share of the usual ones rings after a strike elsewhere,"""
HIGH = 0.4
"""if it is not as high as this share of them, so that it may be of a wheel that left the rail."""
SURE = 0.25
"""Pulses of this share of the highest are certainly of wheels: by them the usual ones are known."""
OF_EACH = 15
"""The median of the means of so many parts of a piece of a gap is a point of the zero line."""
NEIGHBOURS = (1, 4, 16, 64)
"""Neighbours on either side that are tried to smooth the zero line."""
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


def pulses_of(channel: Channel, occupied: FloatArray | None = None) -> Pulses:
    """Return the pulses of a channel; its zero line is drawn through the gaps between them.

    `occupied` is from when until when wheels are near the sensor, s, (wheel, 2), if it is known: one that stands at the
    edge of a sensor for a long time reads as a zero line does.
    """
    smooth = channel.smooth(PEAKS)
    there = None if occupied is None else np.clip((occupied - channel.start) * channel.rate, 0, len(smooth))
    zero = _zero_line(smooth, channel.rate, there)
    force = smooth - zero
    noise, level = _least_height(force, channel.rate, SMALLEST[-1])
    if np.isnan(channel.length):
        rows = _at_seat(force, channel.rate, level)
    else:
        rows = [
            row
            for span in _spans(force, level, channel.rate).tolist()
            if (row := _half_height(force, *span)) is not None
        ]
    begin, end, heights = np.array(rows).reshape(-1, 3).T
    durations = (end - begin) / channel.rate
    real = _real(durations, heights)
    times = channel.start + 0.5 * (begin + end) / channel.rate
    return Pulses(channel, times[real], durations[real], heights[real], force, zero, noise)


def _zero_line(smooth: FloatArray, rate: float, occupied: FloatArray | None) -> FloatArray:
    """Return the zero line, which is drawn ever better by few of the samples: what lies between them says no more."""
    apart = max(int(rate / (4.0 * PEAKS)), 1)
    few, each = smooth[::apart].copy(), np.arange(-(-len(smooth) // apart), dtype=float)
    line = np.interp(each, *foot_points(few, rate / apart))
    gaps = None if occupied is None else _free(occupied / apart, len(few))
    for share in SMALLEST if gaps is None else ():
        force = few - line
        spans = _spans(force, _least_height(force, rate / apart, share)[1], rate / apart)
        lengths = spans[:, 1] - spans[:, 0]
        gaps = _gaps(spans[lengths >= SHORT * np.median(lengths)], len(few)) if len(spans) else None
        if gaps is not None:
            line = np.interp(each, *_medians(few, *gaps))
    if gaps is not None:
        places, feet = _medians(few, *gaps, fine=True)
        line = np.interp(each, places, _smoothed(places, feet))
    rise = np.diff(line, append=line[-1]) / apart
    return np.asarray((line[:, None] + rise[:, None] * np.arange(apart)).ravel()[: len(smooth)])


def _gaps(spans: NDArray[np.int64], samples: int) -> tuple[NDArray[np.int64], NDArray[np.int64], float] | None:
    """Return first and last sample of the gaps between pulses that are longer than these; None if there are none.

    What is near a pulse is not in the gap. The third is the usual length of a pulse, in samples.
    """
    lengths = spans[:, 1] - spans[:, 0]
    begin = np.concatenate(([0], spans[:, 1] + lengths // 4 + 1))
    end = np.concatenate((spans[:, 0] - lengths // 4 - 1, [samples]))
    usual = float(np.median(lengths))
    wide = end - begin >= max(8.0, usual)
    return (begin[wide], end[wide], usual) if wide.any() else None


def _free(occupied: FloatArray, samples: int) -> tuple[NDArray[np.int64], NDArray[np.int64], float] | None:
    """Return what `_gaps` does, of known times at which wheels are near, in samples."""
    ordered = occupied[np.argsort(occupied[:, 0])]
    begin = np.concatenate(([0], np.maximum.accumulate(ordered[:, 1]))).astype(np.int64)
    end = np.concatenate((ordered[:, 0], [samples])).astype(np.int64)
    usual = float(np.median(ordered[:, 1] - ordered[:, 0]))
    wide = end - begin >= 8
    return (begin[wide], end[wide], usual) if wide.any() else None


def _medians(
    few: FloatArray, begin: NDArray[np.int64], end: NDArray[np.int64], usual: float, *, fine: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return the medians of pieces of the gaps between pulses: where, in samples, and N.

    The pieces are long, so that a missed pulse does not count; or, if `fine`, about as long as a pulse.
    """
    least = max(usual, 8.0) if fine else max(float(np.median(end - begin)), 4.0 * usual, 64.0)
    many = np.clip((end - begin) // least, 1, None).astype(int)
    gap = np.repeat(np.arange(len(many)), many)
    step = ((end - begin) / many)[gap]
    first = begin[gap] + step * (np.arange(len(gap)) - (np.cumsum(many) - many)[gap])
    cuts = first[:, None] + step[:, None] * np.arange(OF_EACH + 1) / OF_EACH
    before = np.minimum(cuts.astype(int), len(few) - 1)
    total = np.concatenate(([0.0], np.cumsum(few)))[before] + (cuts - before) * few[before]
    return first + 0.5 * step, np.median(np.diff(total, axis=1), axis=1) * OF_EACH / step


def _smoothed(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the points of a line: each by the straight line through its neighbours, as many as foretell points best.

    A steady line with much noise takes many neighbours, one that wanders few.
    """
    errors = [float(np.mean(np.abs(_by_neighbours(x, y, many, 0) - y))) for many in NEIGHBOURS]
    best = NEIGHBOURS[int(np.argmin(errors))]
    return y if best == 1 else _by_neighbours(x, y, best, 1)


def _by_neighbours(x: FloatArray, y: FloatArray, many: int, own: int) -> FloatArray:
    """Return what the straight line through so many neighbours on either side says of each point; `own` counts it."""
    k, x = np.arange(len(x)), x - x.mean()
    first, last = np.maximum(k - many, 0), np.minimum(k + many + 1, len(x))
    parts = np.array([np.ones(len(x)), x, y, x * x, x * y])
    total = np.concatenate((np.zeros((5, 1)), np.cumsum(parts, axis=1)), axis=1)
    n, sx, sy, sxx, sxy = total[:, last] - total[:, first] - (1 - own) * parts
    n = np.maximum(n, 1.0)
    spread = n * sxx - sx * sx
    slope = np.where(spread > n * n, n * sxy - sx * sy, 0.0) / np.maximum(spread, 1.0)
    return np.asarray(sy / n + slope * (x - sx / n))


def _least_height(force: FloatArray, rate: float, share: float) -> tuple[float, float]:
    """Return the noise and the least height of a pulse, N."""
    noise = noise_of(force, rate, PEAKS)
    return noise, max(FAINTEST * noise, share * float(force.max(initial=0.0)))


def noise_of(force: FloatArray, rate: float, cutoff: float) -> float:
    """Return the standard deviation of a low-passed noise, N, by what the force changes in a period of the cut-off.

    Neither drift nor axles count, since most samples are beside both.
    """
    steps = np.abs(np.diff(force[:: max(round(rate / cutoff), 1)]))
    return float(1.4826 / 2.0**0.5 * middle_value(steps))


def _spans(force: FloatArray, level: float, rate: float) -> NDArray[np.int64]:
    """Return first and last sample above a level; spans are joined where the force falls away for a moment."""
    above = np.concatenate(([False], force > level, [False]))
    spans = np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2)
    while len(spans) > 1:
        lengths = spans[:, 1] - spans[:, 0]
        gaps = spans[1:, 0] - spans[:-1, 1]
        near = gaps < np.minimum(JOINED * np.maximum(lengths[1:], lengths[:-1]), LONGEST_FLIGHT * rate)
        if not near.any():
            break
        begin, end = spans[np.concatenate(([True], ~near)), 0], spans[np.concatenate((~near, [True])), 1]
        spans = np.column_stack([begin, end])
    return spans


def middle_value(values: FloatArray) -> float:
    """Return the upper median of many samples, quicker than numpy's."""
    half = len(values) // 2
    found = values.copy()
    found.partition(half)
    return float(found[half])


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
    height = middle_value(inner)
    over = force[first:last] > 0.5 * height
    begin, end = first + int(over.argmax()), last - 1 - int(over[::-1].argmax())
    if not over.any() or begin == 0 or end + 1 >= len(force):
        return None
    return _crossing(force, begin - 1, 0.5 * height), _crossing(force, end, 0.5 * height), height


def _crossing(force: FloatArray, i: int, level: float) -> float:
    """Return where the force crosses a level between the samples i and i + 1."""
    before, behind = force[i : i + 2].tolist()
    return i + (min(max((level - before) / (behind - before), 0.0), 1.0) if behind != before else 0.5)


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
