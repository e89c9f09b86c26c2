"""Trains that brake, stop, start again or turn round: over their way they are trains that keep their speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import FloatArray
from wheeltapper.diagnosis.wayside.course import Course, by_axles, by_lengths
from wheeltapper.diagnosis.wayside.grouping import ALIKE, CLOSEST, Grouping, Groups, Seen, clustered, grouped, score_of
from wheeltapper.diagnosis.wayside.passage import Passage, axles_text, speed_notes
from wheeltapper.diagnosis.wayside.pulses import Pulses

UNEVEN = 1.5
"""Slownesses of a train that differ by more than this factor are of one that brakes or stops,"""
STANDS = 0.3
"""which stands where it is slower than this, m/s."""
CREEPING = 1.0
"""A wheel slower than this, m/s, does not strike."""
SLOW, DARK = 2.0, 0.5
"""A train slower than this, m/s, may stand for a while longer than this, s, in which no sensor feels an axle."""
SLOWER, LONG = 4.0, 2.5
"""A train slower than this, m/s, may have stopped unseen while no axle was at a sensor for longer than this, s."""
UNSEEN = 20.0
"""Longest way that such a train goes unseen, m."""
REVERSES = 0.3
"""A train may turn round where it is slower than this share of its usual speed."""


def is_uneven(found: Grouping, channels: int) -> bool:
    """Return whether pulses are not all in whole axles, or of axles with different speeds."""
    whole = found.score == len(found.groups.counts) * channels**2
    paces = found.groups.medians(found.seen.slowness[found.groups.pulses])
    return not whole or bool(paces.max() > UNEVEN * paces.min())


def along_courses(usual: Grouping) -> list[tuple[Grouping, float | None]]:
    """Return the axles of trains that may brake, stop and turn round: over their way, if more pulses make axles there.

    With the axles before and after a train turned round comes when it did, s.
    """
    seen = usual.seen
    course = by_lengths(*seen.ends, seen.length)
    turned, along = _turned(seen, course), _best_along(seen, course)
    assert along.course is not None
    course = along.course
    # A train that stands where no sensor feels it has a shorter way there.
    for begin, end in _dark(seen, course, SLOW, DARK):
        ways = np.arange(0.0, float(course.way(end) - course.way(begin)), 0.5 * CLOSEST).tolist()
        better = max([along, *(_best_along(seen, course.shortened(begin, end, way)) for way in ways)], key=_score)
        if better is not along:
            assert better.course is not None
            along, course = better, better.course
    if turned is not None and turned[0].score + turned[1].score > max(along.score, usual.score):
        when = float(turned[0].seen.ends[1].max())
        return [(part, when) for part in turned]
    if along.score < usual.score:
        return [(usual, None)]
    # Nobody knows how far a train went unseen; it is not taken to be two trains because of that.
    for begin, end in _dark(seen, course, SLOWER, LONG):
        if course.way(end) - course.way(begin) > UNSEEN:
            course = course.shortened(begin, end, UNSEEN)
    return [(along._replace(course=course), None)]


def _score(found: Grouping) -> int:
    return found.score


def turning(passage: Passage, when: float) -> Passage:
    """Return a passage of a train that turns round, which says so instead of what follows from it."""
    lost = (np.flatnonzero((passage.pulses < 0).any(axis=1)) + 1).tolist()
    which = f", and {axles_text(lost)} did not pass all sensors" if lost else ""
    told = f"the train turned round after {when:.1f} s: its axles pass twice{which}"
    return replace(passage, notes=(told,), turns=True)


def _dark(seen: Seen, course: Course, slower: float, longer: float) -> list[tuple[float, float]]:
    """Return from when until when no pulse lasts, for longer than this, s, where the train is slower than this, m/s."""
    begins, ends = seen.ends
    order = np.argsort(begins)
    until = np.maximum.accumulate(ends[order])[:-1]
    again = begins[order][1:]
    slow = np.maximum(course.speed(until), course.speed(again)) < slower
    return [(float(a), float(b)) for a, b in zip(until[slow], again[slow], strict=True) if b - a > longer]


def _best_along(seen: Seen, course: Course) -> Grouping:
    """Return the best way to make axles of pulses over the way of a train, whose course becomes that of the axles."""
    found = _along(seen, course)
    again = _along(seen, _fitted(seen, found.groups, found.direction)[0])
    return again if again.score >= found.score else found


def _along(seen: Seen, course: Course) -> Grouping:
    """Return the better direction to make axles of pulses over this way of a train."""
    over = seen.over(course)
    tried = []
    for way in (1.0, -1.0):
        groups, slowness = clustered(over, way)
        tried.append(Grouping(score_of(over, groups), way, seen, groups, slowness, course))
    return max(tried, key=_score)


def _fitted(seen: Seen, groups: Groups, direction: float) -> tuple[Course, FloatArray]:
    """Return the course of a train by where its axles' pulses begin and end, and how far behind each axle is, m."""
    part = seen.some(groups.pulses)
    along, half = direction * part.place, 0.5 * part.length
    return by_axles(*part.ends, along - half, along + half, groups.numbers)


def _turned(seen: Seen, course: Course) -> tuple[Grouping, Grouping] | None:
    """Return the axles before and after a train turns round, if it does."""
    speeds = course.speed(course.times)
    slow = speeds < REVERSES * float(np.median(course.speed(seen.time)))
    edges = np.flatnonzero(np.diff(slow, prepend=False, append=False)).reshape(-1, 2)
    whens = [float(course.times[a + int(speeds[a:b].argmin())]) for a, b in edges.tolist()]
    whens += [0.5 * (a + b) for a, b in _dark(seen, course, SLOWER, LONG)]
    best: tuple[Grouping, Grouping] | None = None
    begins, ends = seen.ends
    for when in whens:
        before, after = np.flatnonzero(ends < when), np.flatnonzero(begins > when)
        if min(len(before), len(after)) < 2:
            continue
        parts = [_best_along(one, by_lengths(*one.ends, one.length)) for one in (seen.some(before), seen.some(after))]
        found = parts[0], parts[1]
        if parts[0].direction != parts[1].direction and (best is None or _sum_of(found) > _sum_of(best)):
            best = found
    return best


def _sum_of(parts: tuple[Grouping, Grouping]) -> int:
    return parts[0].score + parts[1].score


def passage_along(
    seen: Seen,
    clusters: list[NDArray[np.int64]],
    direction: float,
    several: Sequence[Pulses],
    known: bool,
    either: bool,
) -> Passage:
    """Return a train that brakes, stops and starts, with its course."""
    groups = grouped(clusters)
    course, behind = _fitted(seen, groups, direction)
    each, own = groups.numbers, seen.some(groups.pulses)
    begins, ends = own.ends
    off = 0.5 * (course.way(begins) + course.way(ends)) - direction * own.place - behind[each]
    near = np.flatnonzero(np.abs(off) <= CLOSEST)
    near = near[np.argsort(-np.abs(off[near]), kind="stable")]  # of several in a channel the nearest is written last
    numbers = np.full((len(clusters), len(several)), -1)
    numbers[each[near], own.channel[near]] = own.number[near]
    order = np.argsort(behind, kind="stable")
    behind, numbers = behind[order], numbers[order]
    places = direction * np.array([p.channel.place for p in several])
    speeds = np.median(course.speed(course.time(behind[:, None] + places)), axis=1)
    at = course.times[(course.times >= begins.min()) & (course.times <= ends.max())]
    slow = course.speed(at) < STANDS
    edges = np.flatnonzero(np.diff(slow, prepend=False, append=False)).reshape(-1, 2)
    stands = tuple((float(at[a]), float(at[min(b, len(at) - 1)])) for a, b in edges.tolist())
    notes = speed_notes(speeds if not stands else speeds[:1], known, either)  # a stop says that the speed changes
    told = [_stop_note(course, behind, places, *one) for one in stands]
    for begin, end in _dark(seen.some(groups.pulses), course, SLOWER, LONG):
        if any(one < end and begin < other for one, other in stands):
            continue
        before = int(np.searchsorted(behind + places.mean(), course.way(0.5 * (begin + end))))
        unseen = float(course.way(end) - course.way(begin))
        if unseen > UNSEEN:
            course = course.shortened(begin, end, UNSEEN)
            behind[before:] -= unseen - UNSEEN
        told.append(
            f"no axle was at the sensors from {begin:.1f} to {end:.1f} s, while the train was slow: it may have stood, "
            f"and the distance of axles {before} and {before + 1} is uncertain"
        )
    return Passage(
        course.time(behind), direction * speeds, behind - behind[0], numbers, float(np.std(off[near])),
        (*told, *notes), known, course, stands,
    )  # fmt: skip


def _stop_note(course: Course, behind: FloatArray, places: FloatArray, begins: float, ends: float) -> str:
    """Return what is said of a stop, from and until these times, s; `places` are those of channels along the way."""
    way = float(course.way(0.5 * (begins + ends)))
    there = np.flatnonzero((way - behind > places.min() - ALIKE) & (way - behind < places.max() + ALIKE)) + 1
    which = f", with {axles_text(there.tolist())} among the sensors" if len(there) else ""
    return (
        f"the train stopped at {begins:.1f} s for about {ends - begins:.0f} s{which}; strikes are not looked for where "
        f"wheels were slower than {CREEPING:g} m/s"
    )
