"""Pulses of all channels in groups, each of an axle: those that fall together after the way between the channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import FloatArray
from wheeltapper.diagnosis.wayside.course import Course
from wheeltapper.diagnosis.wayside.pulses import Pulses, usual_height

CLOSEST = 0.5
"""Pulses that lie closer than this, m, after the way between their channels, are of one axle."""
AROUND = 15
"""Number of pulses of which the median gives the first slowness."""
ALIKE = 0.2
"""A pulse as far as this, m, from where the others have its axle, is not counted for the speed."""


@dataclass(frozen=True, eq=False)
class Seen:
    """All pulses of all channels: channel, number in it, time, place, slowness (s/m) by the pulse's own length.

    `length` is that of the sensor, m. Over the way of a train instead of the time, `time` and `slowness` are a way, m,
    and a length over that of the sensor.
    """

    channel: NDArray[np.int64]
    number: NDArray[np.int64]
    time: FloatArray
    place: FloatArray
    slowness: FloatArray
    height: FloatArray
    length: FloatArray

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """When each pulse begins and ends, s."""
        half = 0.5 * self.slowness * self.length
        return self.time - half, self.time + half

    def some(self, chosen: NDArray[Any]) -> Seen:
        """Return some of the pulses."""
        return Seen(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def over(self, course: Course) -> Seen:
        """Return the pulses over the way of a train."""
        begin, end = (course.way(at) for at in self.ends)
        return replace(self, time=0.5 * (begin + end), slowness=(end - begin) / self.length)


class Groups(NamedTuple):
    """Pulses in groups, one group after the other: their numbers, where each group begins, and how many it has."""

    pulses: NDArray[np.int64]
    first: NDArray[np.int64]
    counts: NDArray[np.int64]

    @property
    def numbers(self) -> NDArray[np.int64]:
        """Number of the group of each pulse."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    def medians(self, values: FloatArray) -> FloatArray:
        """Return the median of each group of values, one for each pulse."""
        ordered = values[np.lexsort((values, self.numbers))]
        return np.asarray(0.5 * (ordered[self.first + (self.counts - 1) // 2] + ordered[self.first + self.counts // 2]))

    def channels(self, seen: Seen) -> NDArray[np.int64]:
        """Return the number of channels in each group."""
        every = int(seen.channel.max()) + 1
        return np.bincount(np.unique(self.numbers * every + seen.channel[self.pulses]) // every)


class Grouping(NamedTuple):
    """A way to make axles of pulses: how well it does, the direction, all pulses, those of each axle, slowness, s/m.

    With a course slowness is over the way, in m/m.
    """

    score: int
    direction: float
    seen: Seen
    groups: Groups
    slowness: FloatArray
    course: Course | None = None


def all_pulses(several: Sequence[Pulses], at_seats: float) -> Seen:
    """Return the pulses of all channels; those at seats last as if the sensors there had this length, m."""
    rows = [
        (np.full(len(p.times), k), np.arange(len(p.times)), p.times, np.full(len(p.times), p.channel.place),
         p.durations / length, p.heights / usual_height(p.heights), np.full(len(p.times), length))
        for k, p in enumerate(several)
        if len(p.times)
        for length in [float(np.nan_to_num(p.channel.length, nan=at_seats))]
    ]  # fmt: skip
    seen = Seen(*(np.concatenate(part) for part in zip(*rows, strict=True)))
    return seen.some(np.argsort(seen.time, kind="stable"))


def grouped(clusters: list[NDArray[np.int64]]) -> Groups:
    """Return groups of the numbers of each group's pulses."""
    counts = np.array([len(members) for members in clusters])
    return Groups(np.concatenate(clusters), np.cumsum(counts) - counts, counts)


def clustered(seen: Seen, direction: float) -> tuple[Groups, FloatArray]:
    """Return the pulses of each axle if trains go this way, and the slowness at each pulse, s/m."""
    slowness = running_median(seen.slowness, AROUND)
    middle = float(np.mean(seen.place))
    for _ in range(3):
        at_middle = seen.time - direction * (seen.place - middle) * slowness
        order = np.argsort(at_middle, kind="stable")
        gaps = np.diff(at_middle[order])
        wide = np.maximum(slowness[order][1:], slowness[order][:-1])
        first = np.concatenate(([0], np.flatnonzero(gaps > CLOSEST * wide) + 1))
        groups = Groups(order, first, np.diff(first, append=len(order)))
        before, slowness = slowness, _refined(seen, groups, slowness, direction)
        if (slowness == before).all():
            break
    return groups, slowness


def median_of(values: FloatArray) -> float:
    """Return the median of a few values, quicker than numpy does."""
    ordered, half = sorted(values.tolist()), len(values) // 2
    return float(ordered[half] if len(values) % 2 else 0.5 * (ordered[half - 1] + ordered[half]))


def running_median(values: FloatArray, count: int) -> FloatArray:
    """Return the median of so many values around each."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=min(count, len(values)), mode="nearest"))


def _refined(seen: Seen, groups: Groups, slowness: FloatArray, direction: float) -> FloatArray:
    """Return the slowness that follows from the times at several places; without those, the one before."""
    out = slowness.copy()
    pairs = groups.first[groups.counts == 2]
    a, b = groups.pulses[pairs], groups.pulses[pairs + 1]
    way = seen.place[b] - seen.place[a]
    found = direction * (seen.time[b] - seen.time[a]) / np.where(way == 0.0, np.inf, way)
    change = found / (0.5 * (slowness[a] + slowness[b]))
    sure = (change > 0.5) & (change < 2.0)
    out[a[sure]] = out[b[sure]] = found[sure]
    for group in np.flatnonzero(groups.counts > 2):
        members = groups.pulses[groups.first[group] :][: groups.counts[group]]
        place, time, usual = seen.place[members], seen.time[members], median_of(slowness[members])
        if place.min() < place.max():
            slope = direction * _robust_slope(place, time, ALIKE * usual)
            if 0.5 < slope / usual < 2.0:
                out[members] = slope
    return out


def _robust_slope(x: FloatArray, t: FloatArray, far: float) -> float:
    """Return the slope of a line; points far from it do not count."""
    keep = np.ones(len(x), dtype=bool)
    slope = 0.0
    for _ in range(3):
        if np.ptp(x[keep]) == 0.0:
            break
        a, b = x[keep] - x[keep].mean(), t[keep] - t[keep].mean()
        slope = float(a @ b / (a @ a))
        off = np.abs(t - t[keep].mean() - slope * (x - x[keep].mean()))
        near = off <= max(far, 3.0 * float(np.median(off)))
        if (near == keep).all():
            break
        keep = near
    return slope


def score_of(seen: Seen, groups: Groups) -> int:
    """Return how well pulses of different channels make axles: best, if slowness and direction are right."""
    channels = groups.channels(seen)
    return int(np.sum(channels**2 - 4 * (groups.counts - channels)))
