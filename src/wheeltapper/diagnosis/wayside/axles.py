"""Axles of trains: pulses of all channels that belong together, in the order in which they pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import Channel, FloatArray
from wheeltapper.diagnosis.wayside.course import Course, by_axles, by_lengths
from wheeltapper.diagnosis.wayside.pulses import Pulses, usual_height

CLOSEST = 0.5
"""Pulses that lie closer than this, m, after the way between their channels, are of one axle."""
SEAT_LENGTHS = tuple(np.geomspace(0.4, 1.6, 9).tolist())
"""Lengths of pulses at seats between half heights, m, that are tried: they depend on the track."""
APART = 45.0
"""Longest distance of two axles of one train, m."""
AROUND = 15
"""Number of pulses of which the median gives the first slowness."""
NEIGHBOURS = (2, 40)
"""Axles on either side with which an axle's speed is found, by a line over time: as many as it takes, at most,"""
STEADY = 3e-4
"""for this standard error of the speed, over the speed."""
FEW = 0.25
"""Pulses in no more than this share of the channels are of no axle."""
FAINT = 0.3
"""Pulses in no more than half of the channels are an axle's only if they have this share of the usual height."""
AS_KNOWN = 0.03
"""Largest deviation of a train's distances of axles from those of the known vehicle, over them."""
CHANGED = (0.02, 0.1)
"""Axles whose slowness differs from another's by so much say nothing of its speed: by more than five times the median,
and these shares."""
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
AROUND_SENSOR = 0.2
"""A wheel farther from a sensor than this, m, is not felt by it."""
REVERSES = 0.3
"""A train may turn round where it is slower than this share of its usual speed."""
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
    sure
        Whether speed and direction follow from channels at several places.
    course
        The way of a train that brakes or stops, over time; None: each axle keeps its speed.
    stands
        When and for how long it stands, s.
    turns
        Whether the train turned round while it passed.
    """

    times: FloatArray
    speeds: FloatArray
    places: FloatArray
    pulses: NDArray[np.int64]
    spread: float
    notes: tuple[str, ...]
    sure: bool = True
    course: Course | None = None
    stands: tuple[tuple[float, float], ...] = ()
    turns: bool = False

    def x_of(self, axles: NDArray[np.int64] | int, times: FloatArray | float) -> FloatArray:
        """Return where axles are at times, s, along the track, m."""
        if self.course is None:
            return np.asarray(self.speeds[axles] * (times - self.times[axles]))
        return np.asarray(np.sign(self.speeds[axles]) * (self.course.way(times) - self.behind[axles]))

    def when_at(self, axles: NDArray[np.int64] | int, x: FloatArray | float) -> FloatArray:
        """Return when axles are at places along the track, m, in s."""
        if self.course is None:
            return np.asarray(self.times[axles] + x / self.speeds[axles])
        return self.course.time(self.behind[axles] + np.sign(self.speeds[axles]) * x)

    @property
    def behind(self) -> FloatArray:
        """Way that a train with a course has gone when each axle is at x = 0 m, m."""
        assert self.course is not None
        return self.places + float(self.course.way(self.times[0]))


@dataclass(frozen=True, eq=False)
class _Seen:
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

    def some(self, chosen: NDArray[Any]) -> _Seen:
        """Return some of the pulses."""
        return _Seen(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def over(self, course: Course) -> _Seen:
        """Return the pulses over the way of a train."""
        begin, end = (course.way(at) for at in self.ends)
        return replace(self, time=0.5 * (begin + end), slowness=(end - begin) / self.length)


class _Groups(NamedTuple):
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

    def channels(self, seen: _Seen) -> NDArray[np.int64]:
        """Return the number of channels in each group."""
        every = int(seen.channel.max()) + 1
        return np.bincount(np.unique(self.numbers * every + seen.channel[self.pulses]) // every)


class _Grouping(NamedTuple):
    """A way to make axles of pulses: how well it does, the direction, all pulses, those of each axle, slowness, s/m.

    With a course slowness is over the way, in m/m.
    """

    score: int
    direction: float
    seen: _Seen
    groups: _Groups
    slowness: FloatArray
    course: Course | None = None


def passages_of(several: list[Pulses]) -> list[Passage]:
    """Return the trains in the pulses of channels, in the order of time."""
    at_seats = any(np.isnan(p.channel.length) for p in several)
    if not any(len(p.times) for p in several):
        return []
    tried = []
    for length in SEAT_LENGTHS if at_seats else (1.0,):
        all_pulses = _all_pulses(several, length)
        for way in (1.0, -1.0):
            found = _clustered(all_pulses, way)
            tried.append(_Grouping(_score(all_pulses, found[0]), way, all_pulses, *found))
    best = max(tried, key=lambda one: one.score)
    either = {one.direction for one in tried if one.score == best.score} == {1.0, -1.0}
    if at_seats or not _is_uneven(best, len(several)):
        return _trains_of(best, several, either)
    return _with_courses(best, several, either)


def occupied_by(passages: Sequence[Passage], channel: Channel) -> FloatArray:
    """Return from when until when the wheels of trains are near a sensor, s, (wheel, 2)."""
    half = 0.5 * channel.length + AROUND_SENSOR
    spans = [
        np.sort(np.array([one.when_at(np.arange(len(one.times)), channel.place + side * half) for side in (-1, 1)]).T)
        for one in passages
    ]
    return np.concatenate(spans)


def _is_uneven(best: _Grouping, channels: int) -> bool:
    """Return whether pulses are not all in whole axles, or of axles with different speeds."""
    whole = best.score == len(best.groups.counts) * channels**2
    paces = best.groups.medians(best.seen.slowness[best.groups.pulses])
    return not whole or bool(paces.max() > UNEVEN * paces.min())


def _with_courses(usual: _Grouping, several: list[Pulses], either: bool) -> list[Passage]:
    """Return the trains if they may brake, stop and turn round: over their way, if more pulses make axles there."""
    seen = usual.seen
    course = by_lengths(*seen.ends, seen.length)
    turned = _turned(seen, course)
    along = _best_along(seen, course)
    for begin, end in _dark(
        seen, course, SLOW, DARK
    ):  # a train that stands where no sensor feels it has a shorter way there
        tried = [_best_along(seen, course.shortened(begin, end, float(way)))
                 for way in np.arange(0.0, float(course.way(end) - course.way(begin)), 0.5 * CLOSEST)]  # fmt: skip
        better = max([along, *tried], key=lambda one: one.score)
        if better is not along:
            assert better.course is not None
            along, course = better, better.course
    if turned is not None and turned[0].score + turned[1].score > max(along.score, usual.score):
        when = float(turned[0].seen.ends[1].max())
        return [_turning(passage, when) for part in turned for passage in _trains_of(part, several, False)]
    return _trains_of(along if along.score >= usual.score else usual, several, either)


def _turning(passage: Passage, when: float) -> Passage:
    """Return a passage of a train that turns round, which says so instead of what follows from it."""
    lost = (np.flatnonzero((passage.pulses < 0).any(axis=1)) + 1).tolist()
    which = f", and of these axles {spans_text(lost)} did not pass all sensors" if lost else ""
    told = f"the train turned round after {when:.1f} s: its axles pass twice{which}"
    return replace(passage, notes=(told,), turns=True)


def _dark(seen: _Seen, course: Course, slower: float, longer: float) -> list[tuple[float, float]]:
    """Return from when until when no pulse lasts, for longer than this, s, where the train is slower than this, m/s."""
    begins, ends = seen.ends
    order = np.argsort(begins)
    until = np.maximum.accumulate(ends[order])[:-1]
    again = begins[order][1:]
    slow = np.maximum(course.speed(until), course.speed(again)) < slower
    return [(float(a), float(b)) for a, b in zip(until[slow], again[slow], strict=True) if b - a > longer]


def _best_along(seen: _Seen, course: Course) -> _Grouping:
    """Return the best way to make axles of pulses over the way of a train, whose course becomes that of the axles."""
    found = _along(seen, course)
    again = _along(seen, _fitted(seen, found.groups, found.direction)[0])
    return again if again.score >= found.score else found


def _along(seen: _Seen, course: Course) -> _Grouping:
    """Return the better direction to make axles of pulses over this way of a train."""
    over = seen.over(course)
    tried = []
    for way in (1.0, -1.0):
        groups, slowness = _clustered(over, way)
        tried.append(_Grouping(_score(over, groups), way, seen, groups, slowness, course))
    return max(tried, key=lambda one: one.score)


def _fitted(seen: _Seen, groups: _Groups, direction: float) -> tuple[Course, FloatArray]:
    """Return the course of a train by where its axles' pulses begin and end, and how far behind each axle is, m."""
    part = seen.some(groups.pulses)
    along, half = direction * part.place, 0.5 * part.length
    return by_axles(*part.ends, along - half, along + half, groups.numbers)


def _turned(seen: _Seen, course: Course) -> tuple[_Grouping, _Grouping] | None:
    """Return the axles before and after a train turns round, if it does."""
    speeds = course.speed(course.times)
    slow = speeds < REVERSES * float(np.median(course.speed(seen.time)))
    edges = np.flatnonzero(np.diff(slow, prepend=False, append=False)).reshape(-1, 2)
    whens = [float(course.times[a + int(speeds[a:b].argmin())]) for a, b in edges.tolist()]
    whens += [0.5 * (a + b) for a, b in _dark(seen, course, SLOWER, LONG)]
    best: tuple[_Grouping, _Grouping] | None = None
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


def _sum_of(parts: tuple[_Grouping, _Grouping]) -> int:
    return parts[0].score + parts[1].score


def _trains_of(found: _Grouping, several: list[Pulses], either: bool) -> list[Passage]:
    """Return the passages of the trains in grouped pulses."""
    seen, known = found.seen, bool(np.ptp(found.seen.place) > 0.0)
    over = seen if found.course is None else seen.over(found.course)
    clusters = np.split(found.groups.pulses, found.groups.first[1:])
    out = []
    for members in _split(over, clusters, found.slowness):
        axles, others = _told_apart(seen, members, len(several))
        if not axles:
            continue
        if found.course is None:
            passage = _passage(seen, axles, found.slowness, found.direction, several, known, either)
        else:
            passage = _passage_along(seen, axles, found.direction, several, known, either)
        out.append(replace(passage, notes=(*passage.notes, *(_other_note(seen, one, several) for one in others))))
    return out


def _told_apart(
    seen: _Seen, clusters: list[NDArray[np.int64]], channels: int
) -> tuple[list[NDArray[np.int64]], list[NDArray[np.int64]]]:
    """Return the pulses that are of axles, and those that are of none: a few faint ones, in few channels."""
    groups = _grouped(clusters)
    shares = groups.channels(seen) / channels
    faint = (shares <= 0.5) & (groups.medians(seen.height[groups.pulses]) < FAINT) | (shares <= FEW)
    axles = [members for members, other in zip(clusters, faint, strict=True) if not other]
    return axles, [members for members, other in zip(clusters, faint, strict=True) if other]


def _grouped(clusters: list[NDArray[np.int64]]) -> _Groups:
    counts = np.array([len(members) for members in clusters])
    return _Groups(np.concatenate(clusters), np.cumsum(counts) - counts, counts)


def _other_note(seen: _Seen, members: NDArray[np.int64], several: list[Pulses]) -> str:
    share, names = median_of(seen.height[members]), channel_names(several, seen.channel[members])
    what = f"a pulse at {seen.time[members].mean():.4g} s, {100 * share:.0f} % of the usual ones"
    return f"{what}, counts as no axle: only in {names}"


def channel_names(several: Sequence[Pulses], numbers: NDArray[np.int64]) -> str:
    """Return the names of channels, of which many are counted."""
    names = [several[k].channel.sensor.name for k in np.unique(numbers)]
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def spans_text(numbers: Sequence[int]) -> str:
    """Return rising numbers as text: 1 to 3, 7."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in spans)


def _all_pulses(several: list[Pulses], at_seats: float) -> _Seen:
    """Return the pulses of all channels; those at seats last as if the sensors there had this length, m."""
    rows = [
        (np.full(len(p.times), k), np.arange(len(p.times)), p.times, np.full(len(p.times), p.channel.place),
         p.durations / length, p.heights / usual_height(p.heights), np.full(len(p.times), length))
        for k, p in enumerate(several)
        if len(p.times)
        for length in [float(np.nan_to_num(p.channel.length, nan=at_seats))]
    ]  # fmt: skip
    seen = _Seen(*(np.concatenate(part) for part in zip(*rows, strict=True)))
    return seen.some(np.argsort(seen.time, kind="stable"))


def _clustered(seen: _Seen, direction: float) -> tuple[_Groups, FloatArray]:
    """Return the pulses of each axle if trains go this way, and the slowness at each pulse, s/m."""
    slowness = _running_median(seen.slowness, AROUND)
    middle = float(np.mean(seen.place))
    for _ in range(3):
        at_middle = seen.time - direction * (seen.place - middle) * slowness
        order = np.argsort(at_middle, kind="stable")
        gaps = np.diff(at_middle[order])
        wide = np.maximum(slowness[order][1:], slowness[order][:-1])
        first = np.concatenate(([0], np.flatnonzero(gaps > CLOSEST * wide) + 1))
        groups = _Groups(order, first, np.diff(first, append=len(order)))
        before, slowness = slowness, _refined(seen, groups, slowness, direction)
        if (slowness == before).all():
            break
    return groups, slowness


def median_of(values: FloatArray) -> float:
    """Return the median of a few values, quicker than numpy does."""
    ordered, half = sorted(values.tolist()), len(values) // 2
    return float(ordered[half] if len(values) % 2 else 0.5 * (ordered[half - 1] + ordered[half]))


def _running_median(values: FloatArray, count: int) -> FloatArray:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=min(count, len(values)), mode="nearest"))


def _refined(seen: _Seen, groups: _Groups, slowness: FloatArray, direction: float) -> FloatArray:
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


def _score(seen: _Seen, groups: _Groups) -> int:
    """Return how well pulses of different channels make axles: best, if slowness and direction are right."""
    channels = groups.channels(seen)
    return int(np.sum(channels**2 - 4 * (groups.counts - channels)))


def _split(seen: _Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray) -> list[list[NDArray[np.int64]]]:
    """Return the axles of each train: no axle is between the channels for as long as a long way takes."""
    groups = _grouped(clusters)
    time, paces = seen.time[groups.pulses], groups.medians(slowness[groups.pulses])
    first, last = np.minimum.reduceat(time, groups.first), np.maximum.reduceat(time, groups.first)
    gaps = (first[1:] - last[:-1]) / np.maximum(paces[1:], paces[:-1])
    ends = [0, *(np.flatnonzero(gaps > APART) + 1).tolist(), len(clusters)]
    return [clusters[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)]


def _passage(
    seen: _Seen, clusters: list[NDArray[np.int64]], slowness: FloatArray, direction: float, several: list[Pulses],
    known: bool, either: bool,
) -> Passage:  # fmt: skip
    """Return a train: times and speeds of its axles by lines through their pulses and their neighbours'."""
    groups = _grouped(clusters)
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
    notes = _notes(speeds, known, either)
    return Passage(at_middle - direction * middle * paces, direction * speeds, places, numbers, spread, notes, known)


def _passage_along(
    seen: _Seen, clusters: list[NDArray[np.int64]], direction: float, several: list[Pulses], known: bool, either: bool
) -> Passage:
    """Return a train that brakes, stops and starts, with its course."""
    groups = _grouped(clusters)
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
    notes = _notes(speeds, known, either) if not stands else _notes(speeds[:1], known, either)
    told = [_stop_note(course, behind, places, *one) for one in stands]
    for begin, end in _dark(seen.some(groups.pulses), course, SLOWER, LONG):
        before = int(np.searchsorted(behind + places.max(), course.way(begin) + ALIKE))
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
    which = f", with axles {spans_text(there.tolist())} among the sensors" if len(there) else ""
    return (
        f"the train stopped at {begins:.1f} s for about {ends - begins:.0f} s{which}; strikes are not looked for where "
        f"wheels were slower than {CREEPING:g} m/s"
    )


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
    local = _running_median(paces, 5)
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


def _middles(groups: _Groups, at: FloatArray, pace: FloatArray) -> tuple[FloatArray, float]:
    """Return when each axle is in the middle of the site, s, and how far its pulses scatter about that, m.

    `at` is when each pulse says so, s, `pace` its axle's slowness, s/m.
    """
    usual, each = groups.medians(at), groups.numbers
    near = np.abs(at - usual[each]) <= ALIKE * pace
    many = np.add.reduceat(near, groups.first, dtype=np.int64)
    out = np.where(many > 0, np.add.reduceat(at * near, groups.first) / np.maximum(many, 1), usual)
    return out, float(np.std(((at - out[each]) / pace)[near]))


def _notes(speeds: FloatArray, known: bool, either: bool) -> tuple[str, ...]:
    notes = []
    if not known:
        notes.append(
            "all channels are at one place: speeds are from the lengths of pulses, and the direction is unknown"
        )
    elif either:
        notes.append("the pulses fit both directions; that of growing x is taken")
    if len(speeds) > 1 and speeds.min() < 0.8 * speeds.max():
        notes.append(
            f"the speed changes from {3.6 * speeds[0]:.1f} to {3.6 * speeds[-1]:.1f} km/h, "
            f"with {3.6 * speeds.min():.1f} km/h as the lowest"
        )
    return tuple(notes)


def with_known_distances(passage: Passage, distances: Sequence[float]) -> Passage:
    """Return a passage whose speeds follow from known distances of neighbouring axles, m, somewhere in the train.

    Where channels at several places give the speed, it is kept, and a note says by how much the other one differs.
    """
    gaps, known = np.abs(np.diff(passage.times)), np.array(distances)
    best = (np.inf, 0, 1.0)
    for first in range(len(gaps) - len(known) + 1):
        part = gaps[first : first + len(known)]
        speed = float(known @ known / (known @ part))
        off = float(np.max(np.abs(part * speed / known - 1.0)))
        best = min(best, (off, first, speed))
    off, first, speed = best
    if off > AS_KNOWN:
        note = "the known distances of axles are nowhere in this train"
        return replace(passage, notes=(*passage.notes, note))
    own = float(np.mean(np.abs(passage.speeds[first : first + len(known) + 1])))
    told = f"the known vehicle begins at axle {first + 1}; by its distances the speed is {3.6 * speed:.2f} km/h"
    if passage.sure:
        return replace(passage, notes=(*passage.notes, f"{told}, by the channels {3.6 * own:.2f} km/h"))
    factor = speed / own
    return replace(
        passage, speeds=passage.speeds * factor, places=passage.places * factor, notes=(*passage.notes, told)
    )
