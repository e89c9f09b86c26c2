"""Forces of each wheel while it is on the sensors of its rail, without a model: mean, peak, and strikes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.axles import Passage
from wheeltapper.diagnosis.wayside.channels import STRIKES, FloatArray
from wheeltapper.diagnosis.wayside.pulses import Pulses

EDGE = 0.1
"""What lies closer than this to a gauge, m, does not count, but at most a quarter of the length on either side."""
BEFORE_GAUGE = 1e-3
"""Peaks closer than this to a gauge in time, s, do not count."""
STRIKE = 0.4
"""A strike is a force that exceeds the mean by this share of it,"""
STANDS_OUT = 6.0
"""and by this many standard deviations of what the wheels of the train show, and of the noise."""
TURNS = (1.9, 3.9)
"""Circumferences of wheels, m, where no radius is stated."""
SAME_PLACE = 0.08
"""Largest deviation of two strikes' distance from a number of circumferences, m."""
AT_ONCE = 3e-3
"""Strikes that are less apart in time, s, are one: that of the wheel in which it is the largest."""


class Strike(NamedTuple):
    """A strike: when, s, where, m, and by how much the force exceeds the mean, N."""

    time: float
    x: float
    excess: float
    channel: str


@dataclass(frozen=True, eq=False)
class Side:
    """What the wheels of one rail show; NaN where no channel shows a wheel.

    Attributes
    ----------
    side
        "left", "right" or None.
    mean, peak
        Force of each wheel, N: mean over the sensors, and largest below 500 Hz.
    of_channels
        Mean of each wheel in each channel, N, (axle, channel).
    names
        Names of the channels.
    strikes
        Those of each wheel, in the order of time.
    clipped
        Which wheels have clipped or missing samples in a channel, which then does not count.
    """

    side: str | None
    mean: FloatArray
    peak: FloatArray
    of_channels: FloatArray
    names: tuple[str, ...]
    strikes: tuple[tuple[Strike, ...], ...]
    clipped: NDArray[np.bool_]


def sides_of(passage: Passage, several: Sequence[Pulses]) -> list[Side]:
    """Return what each rail shows of a train's wheels."""
    sides: dict[str | None, list[int]] = {}
    for number, pulses in enumerate(several):
        if np.isfinite(pulses.channel.length):
            sides.setdefault(pulses.channel.sensor.side, []).append(number)
    order = [side for side in ("left", "right", None) if side in sides]
    return [_side(side, passage, several, sides[side]) for side in order]


def _side(side: str | None, passage: Passage, several: Sequence[Pulses], numbers: list[int]) -> Side:
    axles = len(passage.times)
    means, peaks, excess, whens = np.full((4, axles, len(numbers)), np.nan)
    clipped = np.zeros(axles, dtype=bool)
    noise = np.empty(len(numbers))
    for k, number in enumerate(numbers):
        pulses = several[number]
        channel = pulses.channel
        raw, quick = channel.forces - pulses.zero, channel.smooth(STRIKES) - pulses.zero
        total = np.concatenate(([0.0], np.cumsum(raw)))
        noise[k] = _noise_between(quick, pulses)
        for axle in range(axles):
            inner, sure, wide = _spans(passage, pulses, number, axle)
            if inner[1] - inner[0] < 1 or wide[0] < 0 or wide[1] >= len(raw):
                continue
            if channel.missing[wide[0] : wide[1]].any():
                clipped[axle] = True
                continue
            means[axle, k] = (total[inner[1]] - total[inner[0]]) / (inner[1] - inner[0])
            peaks[axle, k] = pulses.force[sure[0] : sure[1]].max(initial=means[axle, k])
            top = wide[0] + int(np.argmax(quick[wide[0] : wide[1]]))
            excess[axle, k] = quick[top] - means[axle, k]
            whens[axle, k] = channel.start + top / channel.rate
    seen = np.isfinite(means).any(axis=1)
    mean, peak = np.full((2, axles), np.nan)
    mean[seen], peak[seen] = np.nanmean(means[seen], axis=1), np.nanmax(peaks[seen], axis=1)
    names = tuple(several[number].channel.sensor.name for number in numbers)
    strikes = _strikes(passage, mean, excess, whens, noise, names)
    return Side(side, mean, peak, means, names, strikes, clipped)


def _spans(passage: Passage, pulses: Pulses, number: int, axle: int) -> NDArray[np.int64]:
    """Return first and last sample of where a wheel's mean, its peak and its strikes are taken."""
    channel, speed = pulses.channel, abs(float(passage.speeds[axle]))
    own = passage.pulses[axle, number]
    length = channel.length
    if own >= 0:  # of a wheel that stands on the sensor, the speed says little
        middle, pace = pulses.times[own], pulses.durations[own] / length
        pace = pace if pace * speed > 1.5 else 1.0 / speed
    else:
        middle, pace = passage.times[axle] + channel.place / passage.speeds[axle], 1.0 / speed
    edge = min(EDGE, 0.25 * length)
    before = min(max(edge, BEFORE_GAUGE / pace), 0.4 * length)
    halves = pace * (0.5 * length - np.array([edge, before, 0.5 * edge]))
    ends = (middle + np.array([-1.0, 1.0]) * halves[:, None] - channel.start) * channel.rate
    return np.rint(ends).astype(np.int64)


def _noise_between(quick: FloatArray, pulses: Pulses) -> float:
    low = quick[quick < np.median(quick)]
    return float(1.4826 * np.median(np.median(quick) - low)) if len(low) else 0.0


def _strikes(
    passage: Passage, mean: FloatArray, excess: FloatArray, whens: FloatArray, noise: FloatArray, names: Sequence[str]
) -> tuple[tuple[Strike, ...], ...]:
    """Return the strikes of each wheel: forces far above its mean, and above what the other wheels show."""
    ratio = excess / mean[:, None]
    usual = float(np.nanmedian(ratio)) if np.isfinite(ratio).any() else 0.0
    scatter = 1.4826 * float(np.nanmedian(np.abs(ratio - usual))) if np.isfinite(ratio).any() else 0.0
    with np.errstate(invalid="ignore"):
        found = (ratio > STRIKE) & (ratio > usual + STANDS_OUT * scatter) & (excess > STANDS_OUT * noise)
    order = sorted(zip(*np.nonzero(found), strict=True), key=lambda at: -excess[at])
    kept: list[tuple[int, int]] = []
    for axle, k in order:
        if all(abs(whens[axle, k] - whens[other]) > AT_ONCE or other[0] == axle for other in kept):
            kept.append((int(axle), int(k)))
    out: list[list[Strike]] = [[] for _ in mean]
    for axle, k in kept:
        when = float(whens[axle, k])
        x = float(passage.speeds[axle] * (when - passage.times[axle]))
        out[axle].append(Strike(when, x, float(excess[axle, k]), names[k]))
    return tuple(tuple(sorted(each)) for each in out)


def turn_between(strikes: Sequence[Strike], radius: float | None) -> float | None:
    """Return the way, m, after which strikes repeat as a place on a wheel does, or None.

    With a stated radius it is the circumference. Without, it is a way that some wheel can have, and that the most
    distances of strikes are multiples of.
    """
    x = np.array([one.x for one in strikes])
    ways = np.abs(x[:, None] - x[None, :])[np.triu_indices(len(x), 1)]
    ways = ways[ways > 0.5]
    tried = [2.0 * pi * radius] if radius is not None else [w / n for w in ways for n in (1, 2, 3)]
    limits = (0.0, np.inf) if radius is not None else TURNS
    best: tuple[int, float] | None = None
    for turn in tried:
        if not limits[0] <= turn <= limits[1]:
            continue
        turns = np.rint(ways / turn)
        near = (turns > 0) & (np.abs(ways - turns * turn) <= SAME_PLACE * np.sqrt(np.maximum(turns, 1.0)))
        if near.any() and (best is None or int(near.sum()) > best[0]):
            best = int(near.sum()), float(np.sum(ways[near]) / np.sum(turns[near]))
    return None if best is None else best[1]


def imbalance(a: Any, b: Any) -> float | None:
    """Return (a - b)/(a + b) of two loads, or None."""
    return None if a is None or b is None or a + b <= 0.0 else float((a - b) / (a + b))
