"""Pulses of a channel: what each axle that passes leaves in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import PEAKS, Channel, FloatArray, foot_line

FAINTEST = 6.0
"""A pulse rises at least this many standard deviations of the noise above the zero line,"""
SMALLEST = 0.05
"""and this share of the largest force of the channel."""
JOINED = 0.3
"""Pulses closer than this share of their lengths are one, in which the wheel left the rail."""
SEATS = 0.12
"""Least prominence of a pulse at a seat, over the largest force of the channel."""
SHORT = 0.4
"""A pulse shorter, and lower, than this share of the usual ones is none: it rings after a strike elsewhere."""


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
    for _ in range(2):
        force = smooth - zero
        noise = _noise(force)
        spans = _spans(force, max(FAINTEST * noise, SMALLEST * float(force.max(initial=0.0))))
        zero = _zero_line(smooth, spans, zero)
    force = smooth - zero
    noise = _noise(force)
    rows = [row for span in spans if (row := _half_height(force, *span)) is not None]
    begin, end, heights = np.array(rows).reshape(-1, 3).T
    durations = (end - begin) / channel.rate
    real = _real(durations, heights)
    times = channel.start + 0.5 * (begin + end) / channel.rate
    return Pulses(channel, times[real], durations[real], heights[real], force, zero, noise)


def _noise(force: FloatArray) -> float:
    """Return the standard deviation of what lies below the zero line and as much above: most samples have no axle."""
    low = force[force < np.median(force)]
    return float(1.4826 * np.median(np.median(force) - low) / 1.0) if len(low) else 0.0


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
    """Return lines between the means of the gaps; of each gap, what is near a pulse does not count."""
    if not len(spans):
        return before
    lengths = spans[:, 1] - spans[:, 0]
    begin = np.concatenate(([0], spans[:, 1] + lengths // 4 + 1))
    end = np.concatenate((spans[:, 0] - lengths // 4 - 1, [len(smooth)]))
    wide = end - begin >= 8
    if not wide.any():
        return before
    total = np.concatenate(([0.0], np.cumsum(smooth)))
    middles, means = [], []
    usual = int(np.median(end[wide] - begin[wide]))
    for a, b in zip(begin[wide], end[wide], strict=True):  # long gaps give several points, so that lines follow a drift
        cuts = np.linspace(a, b, int(np.clip((b - a) // max(usual, 64), 1, 64)) + 1).astype(int)
        middles.append(0.5 * (cuts[1:] + cuts[:-1]))
        means.append(np.diff(total[cuts]) / np.diff(cuts))
    return np.interp(np.arange(len(smooth)), np.concatenate(middles), np.concatenate(means))


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


def _real(durations: FloatArray, heights: FloatArray) -> NDArray[np.bool_]:
    """Return which pulses are of wheels, and not of what rings after a strike beside the sensor."""
    if not len(durations):
        return np.zeros(0, dtype=bool)
    return np.array((durations > SHORT * np.median(durations)) | (heights > SHORT * np.median(heights)))
