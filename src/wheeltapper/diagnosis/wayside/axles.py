"""Axles of trains: pulses of all channels that belong together, in the order in which they pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.pulses import FloatArray, Pulses

CLOSEST = 0.5
"""Pulses that lie closer than this, m, after the way between their channels, are of one axle."""
APART = 45.0
"""Longest distance of two axles of one train, m."""
AROUND = 15
"""Number of pulses of which the median gives the first slowness."""
NEIGHBOURS = 4
"""Axles on either side with which an axle's speed is found, by a straight line over time."""
ALIKE = 0.2
"""A pulse as far as this, m, from where the others have its axle, is not counted for the speed."""


@dataclass(frozen=True, eq=False)
class Passage:
    """The axles of a train.

    Attributes
    ----------
    times
        When each axle is at the site's x = 0 m, s, as if it went on with its speed.
    speeds
        m/s, positive towards growing x.
    places
        Distance behind the leading axle, m.
    pulses
        Number of the pulse of each axle in each channel, (axle, channel); -1 where it was lost.
    spread
        Standard deviation of the pulses' times about the axles', as a way, m.
    notes
        What was found.
    """

    times: FloatArray
    speeds: FloatArray
    places: FloatArray
    pulses: NDArray[np.int64]
    spread: float
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Seen:
    """All pulses of all channels: channel, number in it, time, place, slowness (s/m) by the pulse's own length."""

    channel: NDArray[np.int64]
    number: NDArray[np.int64]
    time: FloatArray
    place: FloatArray
    slowness: FloatArray


def passages_of(several: list[Pulses]) -> list[Passage]:
    """Return the trains in the pulses of channels, in the order of time."""
    seen = _all_pulses(several)
    if not len(seen.time):
        return []
    found = [_clustered(seen, direction) for direction in (1.0, -1.0)]
    told = [_score(seen, clusters) for clusters, _ in found]
    clusters, slowness = found[int(told[1] > told[0])]
    direction = 1.0 if told[0] >= told[1] else -1.0
    known = np.ptp(seen.place) > 0.0
    out = []
    for members in _split(seen, clusters, slowness):
        out.append(_passage(seen, members, slowness, direction, several, known, told[0] == told[1]))
    return out


def _all_pulses(several: list[Pulses]) -> _Seen:
    rows = [
        (np.full(len(p.times), k), np.arange(len(p.times)), p.times, np.full(len(p.times), p.channel.place),
         p.durations / p.channel.length)
        for k, p in enumerate(several)
    ]  # fmt: skip
    channel, number, time, place, slowness = (np.concatenate(part) for part in zip(*rows, strict=True))
    order = np.argsort(time, kind="stable")
    return _Seen(
        channel[order].astype(np.int64), number[order].astype(np.int64), time[order], place[order], slowness[order]
    )


def _clustered(seen: _Seen, direction: float) -> tuple[list[NDArray[np.int64]], FloatArray]:
    """Return the pulses of each axle if trains go this way, and the slowness at each pulse, s/m."""
    slowness = _running_median(seen.slowness, AROUND)
    middle = float(np.mean(seen.place))
    for _ in range(3):
        at_middle = seen.time - direction * (seen.place - middle) * slowness
        order = np.argsort(at_middle, kind="stable")
        gaps = np.diff(at_middle[order])
        wide = np.maximum(slowness[order][1:], slowness[order][:-1])
        clusters = np.split(order, np.flatnonzero(gaps > CLOSEST * wide) + 1)
        slowness = _refined(seen, clusters, slowness, direction)
    return clusters, slowness


def _running_median(values: FloatArray, count: int) -> FloatArray:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=min(count, len(values)), mode="nearest"))


def _refined(seen: _Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray, direction: float) -> FloatArray:
    """Return the slowness that follows from the times at several places; without those, the one before."""
    out = slowness.copy()
    for members in clusters:
        place, time = seen.place[members], seen.time[members]
        if np.ptp(place) > 0.0:
            found = direction * _robust_slope(place, time, ALIKE * float(np.median(slowness[members])))
            if 0.5 < found / float(np.median(slowness[members])) < 2.0:
                out[members] = found
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


def _score(seen: _Seen, clusters: list[NDArray[np.int64]]) -> float:
    """Return how many pairs of pulses in different channels belong to one axle: most, if the direction is right."""
    return float(sum(len(np.unique(seen.channel[members])) ** 2 for members in clusters))


def _split(seen: _Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray) -> list[list[NDArray[np.int64]]]:
    """Return the axles of each train."""
    times = np.array([seen.time[members].mean() for members in clusters])
    paces = np.array([np.median(slowness[members]) for members in clusters])
    gaps = np.diff(times) / np.maximum(paces[1:], paces[:-1])
    cuts = np.flatnonzero(gaps > APART) + 1
    ends = [0, *cuts.tolist(), len(clusters)]
    return [clusters[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)]


def _passage(
    seen: _Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray, direction: float, several: list[Pulses],
    known: bool, either: bool,
) -> Passage:  # fmt: skip
    """Return a train: times and speeds of its axles by lines through their pulses and their neighbours'."""
    numbers = np.full((len(clusters), len(several)), -1)
    for axle, members in enumerate(clusters):
        numbers[axle, seen.channel[members]] = seen.number[members]
    paces = np.array([float(np.median(slowness[members])) for members in clusters])
    middle = float(np.mean([p.channel.place for p in several]))
    at_middle = np.array(
        [np.median(seen.time[m] - direction * (seen.place[m] - middle) * paces[i]) for i, m in enumerate(clusters)]
    )
    weights = np.array([max(float(np.sum((seen.place[m] - seen.place[m].mean()) ** 2)), 1e-6) for m in clusters])
    paces = _smooth_paces(at_middle, paces, weights)
    at_middle, spread = _middles(seen, clusters, paces, direction, middle)
    speeds = 1.0 / paces
    places = np.concatenate(([0.0], np.cumsum(np.diff(at_middle) * 0.5 * (speeds[1:] + speeds[:-1]))))
    notes = _notes(numbers, several, speeds, known, either)
    return Passage(at_middle - direction * middle * paces, direction * speeds, places, numbers, spread, notes)


def _smooth_paces(times: FloatArray, paces: FloatArray, weights: FloatArray) -> FloatArray:
    """Return each slowness by a line over time through its neighbours', weighted; outliers do not count."""
    out = np.empty(len(paces))
    for i in range(len(paces)):
        near = slice(max(i - NEIGHBOURS, 0), i + NEIGHBOURS + 1)
        t, s, w = times[near] - times[i], paces[near], weights[near].copy()
        w[np.abs(s / np.median(s) - 1.0) > max(0.02, 5.0 * float(np.median(np.abs(s / np.median(s) - 1.0))))] = 0.0
        mean_t, mean_s = np.average(t, weights=w), np.average(s, weights=w)
        spread = float(w @ (t - mean_t) ** 2)
        slope = float(w @ ((t - mean_t) * (s - mean_s))) / spread if np.count_nonzero(w) > 3 and spread > 0.0 else 0.0
        out[i] = mean_s - slope * mean_t
    return out


def _middles(
    seen: _Seen, clusters: list[NDArray[np.int64]], paces: FloatArray, direction: float, middle: float
) -> tuple[FloatArray, float]:
    """Return when each axle is in the middle of the site, s, and how far its pulses scatter about that, m."""
    out, off = np.empty(len(clusters)), []
    for i, members in enumerate(clusters):
        at = seen.time[members] - direction * (seen.place[members] - middle) * paces[i]
        near = np.abs(at - np.median(at)) <= ALIKE * paces[i]
        out[i] = at[near].mean() if near.any() else np.median(at)
        off.append((at - out[i])[near] / paces[i])
    return out, float(np.std(np.concatenate(off)))


def _notes(
    numbers: NDArray[np.int64], several: list[Pulses], speeds: FloatArray, known: bool, either: bool
) -> tuple[str, ...]:
    notes = []
    if not known:
        notes.append(
            "all channels are at one place: speeds are from the lengths of pulses, and the direction is unknown"
        )
    elif either:
        notes.append("the pulses fit both directions; that of growing x is taken")
    for axle, lost in enumerate(numbers < 0, 1):
        if lost.any():
            names = ", ".join(p.channel.sensor.name for p, gone in zip(several, lost, strict=True) if gone)
            word = "perhaps no axle: " if lost.sum() > 0.5 * len(lost) else ""
            notes.append(
                f"axle {axle}: {word}no pulse stands out in {int(lost.sum())} of {len(lost)} channels: {names}"[:160]
            )
    if len(speeds) > 1 and speeds.min() < 0.8 * speeds.max():
        notes.append(
            f"the speed changes from {3.6 * speeds[0]:.1f} to {3.6 * speeds[-1]:.1f} km/h, with {3.6 * speeds.min():.1f} as the lowest"
        )
    return tuple(notes)
