"""Axles of trains: pulses of all channels that belong together, in the order in which they pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import FloatArray
from wheeltapper.diagnosis.wayside.grouping import (
    ALIKE,
    CLOSEST,
    Grouping,
    Groups,
    Seen,
    all_pulses,
    clustered,
    grouped,
    median_of,
    running_median,
    score_of,
)
from wheeltapper.diagnosis.wayside.passage import Passage, channel_names, speed_notes
from wheeltapper.diagnosis.wayside.pulses import Pulses
from wheeltapper.diagnosis.wayside.stops import along_courses, is_uneven, passage_along, turning

SEAT_LENGTHS = tuple(np.geomspace(0.4, 1.6, 9).tolist())
"""Lengths of pulses at seats between half heights, m, that are tried: they depend on the track."""
APART = 45.0
"""Longest distance of two axles of one train, m."""
NEIGHBOURS = (2, 40)
"""Axles on either side with which an axle's speed is found, by a line over time: as many as it takes, at most,"""
STEADY = 3e-4
"""for this standard error of the speed, over the speed."""
FEW = 0.25
"""Pulses in no more than this share of the channels are of no axle."""
FEWEST = 0.1
"""What fewer than this share of all channels show is no axle either, even where others were not recorded."""
FAINT = 0.3
"""Pulses in no more than half of the channels are an axle's only if they have this share of the usual height."""
CHANGED = (0.02, 0.1)
"""Axles whose slowness differs from another's by so much say nothing of its speed: by more than five times the median,
and these shares."""


def passages_of(several: Sequence[Pulses]) -> list[Passage]:
    """Return the trains in the pulses of channels, in the order of time."""
    at_seats = any(np.isnan(p.channel.length) for p in several)
    if not any(len(p.times) for p in several):
        return []
    tried = []
    for length in SEAT_LENGTHS if at_seats else (1.0,):
        seen = all_pulses(several, length)
        for way in (1.0, -1.0):
            found = clustered(seen, way)
            tried.append(Grouping(score_of(seen, found[0]), way, seen, *found))
    best = max(tried, key=lambda one: one.score)
    either = {one.direction for one in tried if one.score == best.score} == {1.0, -1.0}
    usual = at_seats or not is_uneven(best, len(several))
    return [
        passage if turned is None else turning(passage, turned)
        for part, turned in ([(best, None)] if usual else along_courses(best))
        for passage in _trains_of(part, several, either)
    ]


def _trains_of(found: Grouping, several: Sequence[Pulses], either: bool) -> list[Passage]:
    """Return the passages of the trains in grouped pulses."""
    seen, known = found.seen, bool(np.ptp(found.seen.place) > 0.0)
    over = seen if found.course is None else seen.over(found.course)
    clusters = np.split(found.groups.pulses, found.groups.first[1:])
    out = []
    for members in _split(over, clusters, found.slowness):
        axles, others = _told_apart(found, over, members, several)
        if not axles:
            continue
        if found.course is None:
            passage = _passage(seen, axles, found.slowness, found.direction, several, known, either)
        else:
            passage = passage_along(seen, axles, found.direction, several, known, either)
        out.append(replace(passage, notes=(*passage.notes, *_other_notes(seen, others, several))))
    return out


def _told_apart(
    found: Grouping, over: Seen, clusters: list[NDArray[np.int64]], several: Sequence[Pulses]
) -> tuple[list[NDArray[np.int64]], list[NDArray[np.int64]]]:
    """Return the pulses that are of axles, and those that are of none: a few faint ones, in few channels.

    Channels that were not recorded when an axle passed them do not count against it.
    """
    groups = grouped(clusters)
    paces = groups.medians(found.slowness[groups.pulses])
    at = groups.medians(over.time[groups.pulses] - found.direction * over.place[groups.pulses] * paces[groups.numbers])
    possible = np.zeros(len(clusters), dtype=int)
    for pulses in several:
        middle = at + found.direction * pulses.channel.place * paces
        half = 0.5 * np.nan_to_num(pulses.channel.length) * paces
        ends = [one if found.course is None else found.course.time(one) for one in (middle - half, middle + half)]
        possible += pulses.channel.covers(*ends)
    there = groups.channels(over)
    shares = there / np.maximum(possible, there)
    heights = groups.medians(over.height[groups.pulses])
    other = (shares <= 0.5) & (heights < FAINT) | (shares <= FEW) | (there < FEWEST * len(several))
    axles = [members for members, one in zip(clusters, other, strict=True) if not one]
    return axles, [members for members, one in zip(clusters, other, strict=True) if one]


def _other_notes(seen: Seen, others: Sequence[NDArray[np.int64]], several: Sequence[Pulses]) -> list[str]:
    """Return what is said of pulses that are of no axle, in one sentence."""
    if not others:
        return []
    first, names = others[0], channel_names(several, seen.channel[np.concatenate(others)])
    what = f"at {seen.time[first].mean():.4g} s, {100 * median_of(seen.height[first]):.0f} % of the usual ones"
    if len(others) == 1:
        return [f"a pulse {what}, counts as no axle: only in {names}"]
    return [f"{len(others)} pulses, the first {what}, count as no axles: only in {names}"]


def _split(seen: Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray) -> list[list[NDArray[np.int64]]]:
    """Return the axles of each train: no axle is between the channels for as long as a long way takes."""
    groups = grouped(clusters)
    time, paces = seen.time[groups.pulses], groups.medians(slowness[groups.pulses])
    first, last = np.minimum.reduceat(time, groups.first), np.maximum.reduceat(time, groups.first)
    gaps = (first[1:] - last[:-1]) / np.maximum(paces[1:], paces[:-1])
    ends = [0, *(np.flatnonzero(gaps > APART) + 1).tolist(), len(clusters)]
    return [clusters[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)]


def _passage(
    seen: Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray, direction: float, several: Sequence[Pulses],
    known: bool, either: bool,
) -> Passage:  # fmt: skip
    """Return a train: times and speeds of its axles by lines through their pulses and their neighbours'."""
    groups = grouped(clusters)
    each = groups.numbers
    place, time = seen.place[groups.pulses], seen.time[groups.pulses]
    paces = groups.medians(slowness[groups.pulses])
    middle = _place_of_slope(np.array([p.channel.place for p in several]))
    at_middle = groups.medians(time - direction * (place - middle) * paces[each])
    off = place - (np.add.reduceat(place, groups.first) / groups.counts)[each]
    weights = np.maximum(np.add.reduceat(off**2, groups.first), 1e-6)
    paces = _smooth_paces(at_middle, paces, weights, _pace_error(at_middle, paces))
    pace = paces[each]
    at = time - direction * (place - middle) * pace
    at_middle, spread = _middles(groups, at, pace)
    # Of several pulses in a channel the highest counts, if it is where the others are: the last that is written.
    own = np.flatnonzero(np.abs(at - at_middle[each]) <= CLOSEST * pace)
    own = own[np.argsort(seen.height[groups.pulses[own]], kind="stable")]
    pulses = groups.pulses[own]
    numbers = np.full((len(clusters), len(several)), -1)
    numbers[each[own], seen.channel[pulses]] = seen.number[pulses]
    speeds = 1.0 / paces
    places = np.concatenate(([0.0], np.cumsum(np.diff(at_middle) * 0.5 * (speeds[1:] + speeds[:-1]))))
    notes = speed_notes(speeds, known, either)
    return Passage(at_middle - direction * middle * paces, direction * speeds, places, numbers, spread, notes, known)


def _place_of_slope(places: FloatArray) -> float:
    """Return where a train that brakes or accelerates has the slowness of the line through its times at the places."""
    x = places - places.mean()
    spread = float(x @ x)
    return float(places.mean()) + (float(x @ x**2) / (2.0 * spread) if spread > 0.0 else 0.0)


def _pace_error(times: FloatArray, paces: FloatArray) -> float:
    """Return the standard error of one slowness, over it: how far each is from the line through its neighbours."""
    if len(paces) < 3:
        return 0.0
    share = np.diff(times)[:-1] / np.maximum(times[2:] - times[:-2], 1e-9)
    off = paces[1:-1] - (1.0 - share) * paces[:-2] - share * paces[2:]
    return float(1.4826 * np.median(np.abs(off) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2) / paces[1:-1]))


def _smooth_paces(times: FloatArray, paces: FloatArray, weights: FloatArray, error: float) -> FloatArray:
    """Return each slowness by a line over time through its neighbours', as many as the error of one asks for.

    Neighbours that are far from the median of the nearest do not count: there the speed has changed, or is wrong.
    """
    axles = np.arange(len(paces))
    count = min(int(np.clip((error / STEADY) ** 2 / 2.0, *NEIGHBOURS)), len(paces))
    near = axles[:, None] + np.arange(-count, count + 1)
    there, near = (near >= 0) & (near < len(paces)), np.clip(near, 0, len(paces) - 1)
    local = running_median(paces, 5)
    t, s = times[near] - times[:, None], paces[near]
    off = np.where(there, np.abs(s / local[:, None] - 1.0), np.inf)
    ordered, many = np.sort(off, axis=1), there.sum(axis=1)
    usual = 0.5 * (ordered[axles, (many - 1) // 2] + ordered[axles, many // 2])
    w = weights[near] * (off <= np.clip(5.0 * usual, *CHANGED)[:, None])
    total = w.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_t, mean_s = (w * t).sum(axis=1) / total, (w * s).sum(axis=1) / total
        t, s = t - mean_t[:, None], s - mean_s[:, None]
        spread = (w * t**2).sum(axis=1)
        slope = np.where((np.count_nonzero(w, axis=1) > 2) & (spread > 0.0), (w * t * s).sum(axis=1) / spread, 0.0)
        unsure = ((w * t * (s - slope[:, None] * t)) ** 2).sum(axis=1) / spread**2  # the variance of the slope
        shrunk = np.where(slope != 0.0, slope * np.maximum(1.0 - unsure / slope**2, 0.0), 0.0)
        return np.where(total > 0.0, mean_s - shrunk * mean_t, local)


def _middles(groups: Groups, at: FloatArray, pace: FloatArray) -> tuple[FloatArray, float]:
    """Return when each axle is in the middle of the site, s, and how far its pulses scatter about that, m.

    `at` is when each pulse says so, s, `pace` its axle's slowness, s/m.
    """
    usual, each = groups.medians(at), groups.numbers
    near = np.abs(at - usual[each]) <= ALIKE * pace
    many = np.add.reduceat(near, groups.first, dtype=np.int64)
    out = np.where(many > 0, np.add.reduceat(at * near, groups.first) / np.maximum(many, 1), usual)
    return out, float(np.std(((at - out[each]) / pace)[near]))
