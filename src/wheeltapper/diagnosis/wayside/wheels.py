"""Forces of each wheel while it is on the sensors of its rail, without a model: mean, peak, and strikes."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.alarms import PEAKS, STRIKES
from wheeltapper.diagnosis.wayside.channels import FloatArray
from wheeltapper.diagnosis.wayside.passage import Passage
from wheeltapper.diagnosis.wayside.pulses import Pulses, noise_of
from wheeltapper.diagnosis.wayside.seen import edge_of, seen_share
from wheeltapper.diagnosis.wayside.stops import CREEPING

IntArray = NDArray[np.int64]
BESIDE = 0.1
"""How far, m, a wheel is beside a sensor where the sensor's pulse has ended."""
UNSTEADY = 1.3
"""A pulse that lasts longer than its axle's speed says, or less, by this factor, is of an axle that stopped."""
CREPT = 0.1
"""A mean force of a wheel that crept over a sensor counts only if it is within this share of those of the others."""
SHARES = np.linspace(-1.0, 1.0, 161)
"""Places of a wheel over a sensor's length, from its middle."""
ALONE = 0.8
"""A strike that does not repeat is one only if it exceeds the mean by this share of it."""
STRIKE = 0.4
"""A strike is a force that exceeds the mean by this share of it,"""
STANDS_OUT = 6.0
"""and by this many standard deviations of what the wheels of the train show, and of the noise."""
NOISE = 4.0
"""Standard deviations of the noise that the largest of a wheel's samples may be."""
TURNS = (2.2, 3.6)
"""Circumferences of wheels, m, where no radius is stated."""
SAME_PLACE = 0.08
"""Largest deviation of two strikes' distance from a number of circumferences, m."""
AT_ONCE = 2e-3
"""Strikes that are less apart in time, s, are one: that of the wheel in which it is the largest. So are those that come
whole turns of that wheel before or after,"""
WAVES = 2000.0
"""Speed with which strikes come through the rail to another wheel's sensor, m/s: that of bending waves near 1 kHz."""
FARTHEST = 6
"""up to so many."""
USUAL_TURNS, ECHO = (2.6, 3.2), 0.8
"""Circumferences, m, where a wheel shows one strike only, or a single distance; another wheel's strike is an echo of a
single one only if it is weaker by this factor."""


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
    mean
        Force of each wheel, N: mean over the sensors.
    of_channels
        Mean of each wheel in each channel, N, (axle, channel).
    names
        Names of the channels.
    counted
        Names of those that count for forces.
    strikes
        Those of each wheel, in the order of time.
    clipped
        Which wheels have clipped or missing samples in a channel, which then does not count.
    below
        Largest force of each wheel below some frequencies, N, and the share of its turn on which it counts (NaN if the
        radius is unknown), by the frequency, Hz: that of peaks, and others.
    """

    side: str | None
    mean: FloatArray
    of_channels: FloatArray
    names: tuple[str, ...]
    counted: tuple[str, ...]
    strikes: tuple[tuple[Strike, ...], ...]
    clipped: NDArray[np.bool_]
    below: dict[float, tuple[FloatArray, FloatArray]]


def sides_of(
    passage: Passage, several: Sequence[Pulses], radius: float | None = None, uncounted: Collection[int] = (),
    cutoffs: Collection[float] = (),
) -> list[Side]:  # fmt: skip
    """Return what each rail shows of a train's wheels, of this radius, m, if it is known.

    Of the channels with the numbers `uncounted` only the means of channels are given. `cutoffs` are frequencies, Hz,
    below which the largest forces are asked for.
    """
    sides: dict[str | None, list[int]] = {}
    for number, pulses in enumerate(several):
        own = sides.setdefault(pulses.channel.sensor.side, [])
        if np.isfinite(pulses.channel.length):
            own.append(number)
    order = [side for side in ("left", "right", None) if side in sides]
    return [_side(side, passage, several, sides[side], radius, uncounted, cutoffs) for side in order]


class Trace(NamedTuple):
    """What a sensor reads of a wheel: places of the wheel, m, and forces below 500 Hz, N."""

    channel: str
    x: FloatArray
    force: FloatArray


def traces_of(passage: Passage, several: Sequence[Pulses], axle: int, side: str | None) -> tuple[Trace, ...]:
    """Return what each sensor of a rail reads of an axle's wheel while it is near; axles are numbered from 0."""
    out = []
    for number, pulses in enumerate(several):
        channel = pulses.channel
        if channel.sensor.side != side or not np.isfinite(channel.length):
            continue
        views = _views(passage, pulses, number)
        if views.there[axle]:
            at = np.arange(views.first[axle], views.last[axle])
            if passage.course is None:
                share = np.sign(passage.speeds[axle]) * (at - views.middle[axle]) / views.count[axle]
                x = channel.place + channel.length * share
            else:
                x = passage.x_of(axle, channel.start + at / channel.rate)
            out.append(Trace(channel.sensor.name, x, pulses.force[at]))
    return tuple(out)


def _side(
    side: str | None, passage: Passage, several: Sequence[Pulses], numbers: list[int], radius: float | None,
    uncounted: Collection[int], cutoffs: Collection[float],
) -> Side:  # fmt: skip
    axles, names = len(passage.times), tuple(several[number].channel.sensor.name for number in numbers)
    means, excess, whens = np.full((3, axles, len(numbers)), np.nan)
    clipped = np.zeros(axles, dtype=bool)
    quick = [several[number].channel.smooth(STRIKES) - several[number].zero for number in numbers]
    noise = np.array([noise_of(q, several[n].channel.rate, STRIKES) for q, n in zip(quick, numbers, strict=True)])
    views = [_views(passage, several[number], number) for number in numbers]
    for k, number in enumerate(numbers):
        pulses, view = several[number], views[k]
        lost = view.holding(np.flatnonzero(pulses.channel.missing))
        clipped |= lost
        view.there[lost] = False
        means[:, k] = view.means(pulses.channel.forces - pulses.zero)
    means[_doubtful(means, np.array([view.creeps for view in views], dtype=bool).reshape(len(numbers), axles).T)] = (
        np.nan
    )
    counted = [k for k, number in enumerate(numbers) if number not in uncounted]
    shape = _usual_shape([(views[k], quick[k], means[:, k]) for k in counted])
    for k in counted:
        channel = several[numbers[k]].channel
        excess[:, k], tops = views[k].excesses(quick[k], means[:, k], shape)
        whens[:, k] = channel.start + tops / channel.rate
    seen = np.isfinite(means[:, counted]).any(axis=1)
    mean = np.full(axles, np.nan)
    if seen.any():
        mean[seen] = np.nanmean(means[seen][:, counted], axis=1)
    strikes = _strikes(passage, mean, excess, whens, noise, names, radius)
    of_rail = [(several[numbers[k]], views[k], means[:, k]) for k in counted]
    turn = None if radius is None else 2.0 * pi * radius
    below = {cutoff: _largest_below(cutoff, of_rail, axles, turn) for cutoff in {PEAKS, *cutoffs}}
    return Side(side, mean, means, names, tuple(names[k] for k in counted), strikes, clipped, below)


def _doubtful(means: FloatArray, creeps: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which means, of each axle in each channel, are of a wheel that crept there and that others contradict."""
    out = np.zeros_like(creeps)
    for axle in np.flatnonzero(creeps.any(axis=1)):
        passing = np.isfinite(means[axle]) & ~creeps[axle]
        sure = means[axle][passing if passing.any() else np.isfinite(means[axle])]
        if len(sure):
            out[axle] = creeps[axle] & (np.abs(means[axle] / np.median(sure) - 1.0) > CREPT)
    return out


def _largest_below(
    cutoff: float, channels: Sequence[tuple[Pulses, _Views, FloatArray]], axles: int, turn: float | None
) -> tuple[FloatArray, FloatArray]:
    """Return the largest force of each axle's wheel below a frequency, N, and the share of its turn, m, that counts."""
    out, share = np.full((2, axles), np.nan)
    windows: list[list[tuple[float, float]]] = [[] for _ in range(axles)]
    for pulses, view, means in channels:
        channel = pulses.channel
        if cutoff != PEAKS and 2.5 * cutoff >= channel.rate:
            continue
        force = pulses.force if cutoff == PEAKS else channel.smooth(cutoff) - pulses.zero
        out = np.fmax(out, view.peaks(force, means, cutoff))
        halves = channel.length * view.half(cutoff) / view.count
        for axle in np.flatnonzero(view.there & (halves > 0.0)):
            windows[axle].append((channel.place - halves[axle], channel.place + halves[axle]))
    if turn is not None:
        share = np.array([seen_share(one, turn) for one in windows])
    return out, share


@dataclass(frozen=True, eq=False)
class _Views:
    """The samples of a channel in which each wheel is near its sensor, from `first` to before `last`.

    `middle` is when the wheel is in the middle, in samples, `count` how many samples it takes over the length, `sure`
    the half of the part in which peaks count, in samples. Not all of them are there. Those that stand on it are
    measured in its middle half, `inner`; no strike is looked for of those that `creep`.
    """

    first: IntArray
    last: IntArray
    middle: FloatArray
    count: FloatArray
    sure: FloatArray
    stands: NDArray[np.bool_]
    there: NDArray[np.bool_]
    rate: float
    inner: FloatArray
    creeps: NDArray[np.bool_]

    def holding(self, samples: IntArray) -> NDArray[np.bool_]:
        """Return which of them are there and hold one of these samples."""
        return self.there & (np.searchsorted(samples, self.last) > np.searchsorted(samples, self.first))

    def within(self, half: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the first samples, and those behind the last ones, about the middle of those that are there."""
        begin, end = np.where(self.creeps, self.inner, [self.middle - half, self.middle + half])
        first, last = np.ceil(begin), np.floor(end) + 1
        return first[self.there].astype(int), last[self.there].astype(int)

    def means(self, force: FloatArray) -> FloatArray:
        """Return mean forces over the length; of a wheel that stands, in its middle half.

        The area of a pulse over the length is the mean force, whatever the shape of the pulse, but some of its samples
        are of noise alone, beside the length. Those on the length have less noise. They are scaled, for all wheels
        alike, so that the median wheel has its area: the theory's section 8.3 has the bound that is nearly reached.
        """
        there, stands = self.there, self.stands[self.there]
        count, middle = self.count[there], self.middle[there] + 0.5
        total = np.zeros(len(force) + 1)
        np.cumsum(force, out=total[1:])
        edges = np.where(stands, self.inner[:, there] + 0.5, middle + 0.5 * np.array([[-1.0], [1.0]]) * count)
        before = edges.astype(int)
        low, high = total[before] + (edges - before) * force[before]
        inner = (high - low) / (edges[1] - edges[0])
        areas = (total[self.last[there]] - total[self.first[there]]) / count
        left = np.median((areas / inner)[~stands]) if not stands.all() else 1.0
        out = np.full(len(there), np.nan)
        out[there] = np.where(stands, inner, left * inner)
        return out

    def half(self, cutoff: float) -> FloatArray:
        """Return half of the part in which peaks below a frequency, Hz, count, in samples; below 0: there is none.

        A filter needs half a period of it on either side.
        """
        return np.minimum(self.sure, 0.5 * (self.count - self.rate / cutoff)) if cutoff < PEAKS else self.sure

    def peaks(self, force: FloatArray, least: FloatArray, cutoff: float) -> FloatArray:
        """Return the largest forces, below a frequency, Hz, where they count, at least these."""
        out, half = np.full(len(least), np.nan), self.half(cutoff)
        first, last = self.within(half)
        most = [force[a:b].max(initial=-np.inf) for a, b in zip(first.tolist(), last.tolist(), strict=True)]
        out[self.there] = np.where(half[self.there] > 0.0, np.maximum(most, least[self.there]), np.nan)
        return out

    def shape(self, force: FloatArray, mean: FloatArray) -> FloatArray:
        """Return what the sensor reads of wheels with a mean above zero, over it, at `SHARES`: (wheel, share)."""
        own = np.flatnonzero(self.there & ~self.creeps & (mean > 0.0))
        at = self.middle[own, None] + SHARES * self.count[own, None]
        inside = (at >= self.first[own, None]) & (at <= self.last[own, None] - 1)
        before = np.clip(at.astype(int), self.first[own, None], self.last[own, None] - 2)
        read = force[before] + (at - before) * (force[before + 1] - force[before])
        return np.asarray(np.where(inside, read / mean[own, None], 0.0))

    def excesses(self, force: FloatArray, mean: FloatArray, shape: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return by how much each force exceeds its mean with the usual shape at most, and in which sample."""
        excess, tops = np.full((2, len(mean)), np.nan)
        own = np.flatnonzero(self.there & ~self.creeps)
        lengths = self.last[own] - self.first[own]
        ends = np.cumsum(lengths)
        wheel = np.repeat(own, lengths)
        at = np.arange(len(wheel)) + np.repeat(self.first[own] - ends + lengths, lengths)
        share = (at - self.middle[wheel]) / self.count[wheel]
        beyond = force[at] - mean[wheel] * np.interp(share, SHARES, shape)
        for axle, a, b in zip(own.tolist(), (ends - lengths).tolist(), ends.tolist(), strict=True):
            top = a + int(beyond[a:b].argmax())
            excess[axle], tops[axle] = beyond[top], at[top]
        return excess, tops


def _views(passage: Passage, pulses: Pulses, number: int) -> _Views:
    """Return where wheels are near a sensor, the channel with this number, which shows those that are there whole."""
    channel, own = pulses.channel, passage.pulses[:, number]
    length, pace = channel.length, 1.0 / np.abs(passage.speeds)
    creeps = np.zeros(len(own), dtype=bool)
    if passage.course is not None:
        axles, way = np.arange(len(own)), np.sign(passage.speeds)
        begin, middle, end = (
            passage.when_at(axles, channel.place + way * share * length) for share in (-0.5, 0.0, 0.5)
        )
        pace = (end - begin) / length
        creeps = (pace > 1.0 / CREEPING) | (np.abs(np.log((end - middle) / (middle - begin))) >= np.log(UNSTEADY))
    times, durations = (np.append(values, 0.0)[own] for values in (pulses.times, pulses.durations))  # -1: the appended
    lasted = np.where(own >= 0, durations / length, pace)
    stands = np.abs(np.log(lasted / pace)) >= np.log(UNSTEADY)
    pace = np.where(stands, lasted, pace)
    count = length * pace * channel.rate
    at = (times - channel.start) * channel.rate
    beside = min(BESIDE / length, 0.5)
    reach = (0.5 + beside) * count
    inner, around = at + 0.25 * np.array([[-1.0], [1.0]]) * count, at + np.array([[-1.0], [1.0]]) * reach
    if creeps.any():
        places = channel.place + way * length * np.array([[-0.25], [0.25], [-0.5 - beside], [0.5 + beside]])
        when = (passage.when_at(axles, places) - channel.start) * channel.rate
        inner, around = np.where(creeps, when[:2], inner), np.where(creeps, when[2:], around)
    first, last = np.rint(around[0]).astype(int), np.rint(around[1]).astype(int) + 1
    edge = np.array([edge_of(length, one) for one in pace.tolist()])
    there = (own >= 0) & (first >= 0) & (last < len(channel.forces))
    return _Views(
        first, last, at, count, (0.5 - edge / length) * count, stands | creeps, there, channel.rate, inner, creeps
    )


def _usual_shape(channels: Sequence[tuple[_Views, FloatArray, FloatArray]]) -> FloatArray:
    """Return what a sensor reads of a wheel as it passes, over its mean force, at `SHARES`: the median of all.

    Each channel has its wheels, their forces and their means.
    """
    rows = np.concatenate([np.zeros((0, len(SHARES))), *(view.shape(force, mean) for view, force, mean in channels)])
    return np.median(rows, axis=0) if len(rows) else np.zeros(len(SHARES))


def _strikes(
    passage: Passage,
    mean: FloatArray,
    excess: FloatArray,
    whens: FloatArray,
    noise: FloatArray,
    names: Sequence[str],
    radius: float | None,
) -> tuple[tuple[Strike, ...], ...]:
    """Return the strikes of each wheel: forces far above its mean, and above what the other wheels show."""
    sure = np.maximum(excess - NOISE * noise, 0.0)  # of roughness, which adds the same to light and heavy wheels
    usual = float(np.nanmedian(sure)) if np.isfinite(sure).any() else 0.0
    scatter = 1.4826 * float(np.nanmedian(np.abs(sure - usual))) if np.isfinite(sure).any() else 0.0
    with np.errstate(invalid="ignore"):
        found = (
            (excess > STRIKE * mean[:, None]) & (excess > STANDS_OUT * noise) & (sure > usual + STANDS_OUT * scatter)
        )
    out: list[list[Strike]] = [[] for _ in mean]
    for axle, k in zip(*np.nonzero(found), strict=True):
        when = float(whens[axle, k])
        x = float(passage.x_of(axle, when))
        out[axle].append(Strike(when, x, float(excess[axle, k]), names[k]))
    return _own_strikes([sorted(each) for each in out], mean, passage, radius)


def _own_strikes(
    found: list[list[Strike]], mean: FloatArray, passage: Passage, radius: float | None
) -> tuple[tuple[Strike, ...], ...]:
    """Return each wheel's own strikes, and not the echoes of another wheel's in the sensor on which it is.

    One strike that does not repeat may be of the rail, and counts only if it is strong.

    Those come with the other wheel's strikes, or whole turns of that wheel before or after one, where it has left the
    sensors, and are weaker.
    """
    strongest = np.array([max((one.excess for one in each), default=0.0) for each in found])
    out: list[tuple[Strike, ...]] = [()] * len(found)
    echoing: list[_Echo] = []
    for axle in np.argsort(-strongest, kind="stable"):
        speed = abs(float(passage.speeds[axle]))
        place = passage.places[axle]
        kept = [one for one in found[axle] if not any(other.may_cause(one, speed, place) for other in echoing)]
        if not kept:
            continue
        if turn_between(kept, radius) is not None or max(one.excess for one in kept) >= ALONE * mean[axle]:
            out[axle] = tuple(kept)
        times = np.array([one.time for one in kept])
        echoing.append(_Echo(place, float(strongest[axle]), turn_between(kept, None), times))
    return tuple(out)


class _Echo(NamedTuple):
    """A wheel whose strikes others may echo: its place in the train, m, largest excess, N, turn, m, and their times."""

    place: float
    most: float
    turn: float | None
    times: FloatArray

    def may_cause(self, one: Strike, speed: float, place: float) -> bool:
        """Return whether a strike at another wheel's sensor may come from this wheel, at once or turns away."""
        late = AT_ONCE + abs(place - self.place) / WAVES
        ways, near = speed * np.abs(one.time - self.times), speed * late
        turns = np.arange(1, FARTHEST + 1)
        shortest, longest = (self.turn, self.turn) if self.turn is not None else USUAL_TURNS
        inside = (ways[:, None] >= turns * shortest - near) & (ways[:, None] <= turns * longest + near)
        weaker = one.excess < self.most * (1.0 if self.turn is not None else ECHO)
        return bool(weaker and (inside.any() or (ways <= near).any()))


def turn_between(strikes: Sequence[Strike], radius: float | None) -> float | None:
    """Return the way, m, after which strikes repeat as a place on a wheel does, or None.

    With a stated radius it is the circumference. Without, it is a way that some wheel can have, and that the most
    distances of strikes are multiples of; a single distance must be a usual one.
    """
    if len(strikes) < 2:
        return None
    x = np.array([one.x for one in strikes])
    ways = np.abs(x[:, None] - x[None, :])[np.triu_indices(len(x), 1)]
    ways = ways[ways > 0.5]
    stated = [] if radius is None else [2.0 * pi * radius]
    best: tuple[int, float] | None = None
    for turn in stated or ways[(ways >= TURNS[0]) & (ways <= TURNS[1])].tolist():
        turns = np.rint(ways / turn)
        near = (turns > 0) & (np.abs(ways - turns * turn) <= SAME_PLACE * np.sqrt(np.maximum(turns, 1.0)))
        if near.any() and (best is None or int(near.sum()) > best[0]):
            best = int(near.sum()), float(np.sum(ways[near]) / np.sum(turns[near]))
    if best is None or (best[0] == 1 and not stated and not USUAL_TURNS[0] <= best[1] <= USUAL_TURNS[1]):
        return None
    return best[1]


def seats_of(
    passage: Passage, several: Sequence[Pulses], side: str | None
) -> tuple[list[dict[str, float]], FloatArray]:
    """Return what the seats of a rail show of each axle's wheel.

    Returns
    -------
    list of dict, array
        For each axle the largest force of each seat, N, by the names of the sensors; and the wheel's load over that of
        the train's median wheel: the mean over the seats of the ratios of their forces. A seat bears a share of the
        wheel that depends on the track and not on the wheel, so that it cancels; NaN where no seat shows the wheel.
    """
    found: list[dict[str, float]] = [{} for _ in passage.times]
    ratios = []
    for number, pulses in enumerate(several):
        if np.isfinite(pulses.channel.length) or pulses.channel.sensor.side != side:
            continue
        own = passage.pulses[:, number]
        if (own < 0).all():
            continue
        forces = np.where(own >= 0, pulses.heights[np.maximum(own, 0)], np.nan)
        for axle in np.flatnonzero(own >= 0):
            found[axle][pulses.channel.sensor.name] = float(forces[axle])
        ratios.append(forces / np.nanmedian(forces))
    several_seats = np.array(ratios).reshape(-1, len(found))
    seen = np.isfinite(several_seats).any(axis=0)
    loads = np.full(len(found), np.nan)
    loads[seen] = np.nanmean(several_seats[:, seen], axis=0)
    return found, loads


def imbalance(a: Any, b: Any) -> float | None:
    """Return (a - b)/(a + b) of two loads, or None."""
    return None if a is None or b is None or a + b <= 0.0 else float((a - b) / (a + b))
