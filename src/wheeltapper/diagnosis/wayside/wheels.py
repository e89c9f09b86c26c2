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
from wheeltapper.diagnosis.wayside.pulses import Pulses, noise_of

BESIDE = 0.1
"""How far, m, a wheel is beside a sensor where the sensor's pulse has ended."""
UNSTEADY = 1.3
"""A pulse that lasts longer than its axle's speed says, or less, by this factor, is of an axle that stopped."""
SHARES = np.linspace(-1.0, 1.0, 161)
"""Places of a wheel over a sensor's length, from its middle."""
EDGE = 0.1
"""What lies closer than this to a gauge, m, does not count, but at most a quarter of the length on either side."""
BEFORE_GAUGE = 1e-3
"""Peaks closer than this to a gauge in time, s, do not count."""
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
FARTHEST = 6
"""up to so many."""
USUAL_TURNS, ECHO = (2.6, 3.2), 0.8
"""Circumferences, m, where a wheel shows one strike only; the other must then be weaker by this factor."""


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


def sides_of(passage: Passage, several: Sequence[Pulses], radius: float | None = None) -> list[Side]:
    """Return what each rail shows of a train's wheels, of this radius, m, if it is known."""
    sides: dict[str | None, list[int]] = {}
    for number, pulses in enumerate(several):
        if np.isfinite(pulses.channel.length):
            sides.setdefault(pulses.channel.sensor.side, []).append(number)
    order = [side for side in ("left", "right", None) if side in sides]
    return [_side(side, passage, several, sides[side], radius) for side in order]


def _side(
    side: str | None, passage: Passage, several: Sequence[Pulses], numbers: list[int], radius: float | None
) -> Side:
    axles, names = len(passage.times), tuple(several[number].channel.sensor.name for number in numbers)
    means, peaks, excess, whens = np.full((4, axles, len(numbers)), np.nan)
    clipped = np.zeros(axles, dtype=bool)
    quick = [several[number].channel.smooth(STRIKES) - several[number].zero for number in numbers]
    noise = np.array([noise_of(q, several[n].channel.rate, STRIKES) for q, n in zip(quick, numbers, strict=True)])
    views = {}
    for k, number in enumerate(numbers):
        pulses = several[number]
        raw = pulses.channel.forces - pulses.zero
        total = np.concatenate(([0.0], np.cumsum(raw)))
        for axle in range(axles):
            view = _view(passage, pulses, number, axle)
            if view is None:
                continue
            if pulses.channel.missing[view.first : view.last].any():
                clipped[axle] = True
                continue
            means[axle, k] = view.mean(total)
            peaks[axle, k] = pulses.force[view.within(view.sure)].max(initial=means[axle, k])
            views[axle, k] = view
    shape = _usual_shape(views, quick, means)
    for (axle, k), view in views.items():
        beyond = quick[k][view.first : view.last] - means[axle, k] * np.interp(view.shares, SHARES, shape)
        top = int(np.argmax(beyond))
        excess[axle, k] = beyond[top]
        whens[axle, k] = several[numbers[k]].channel.start + (view.first + top) / several[numbers[k]].channel.rate
    seen = np.isfinite(means).any(axis=1)
    mean, peak = np.full((2, axles), np.nan)
    mean[seen], peak[seen] = np.nanmean(means[seen], axis=1), np.nanmax(peaks[seen], axis=1)
    strikes = _strikes(passage, mean, excess, whens, noise, names, radius)
    return Side(side, mean, peak, means, names, strikes, clipped)


@dataclass(frozen=True, eq=False)
class _View:
    """The samples of a channel in which a wheel is near its sensor.

    `middle` is when the wheel is in the middle, in samples, `count` how many samples it takes over the length, `sure`
    the half of the part in which peaks count, in samples.
    """

    first: int
    last: int
    middle: float
    count: float
    sure: float
    stands: bool

    @property
    def shares(self) -> FloatArray:
        """Place of the wheel at each sample, over the length, from the middle."""
        return np.asarray((np.arange(self.first, self.last) - self.middle) / self.count, dtype=np.float64)

    def within(self, half: float) -> slice:
        """Return the samples about the middle."""
        return slice(int(np.ceil(self.middle - half)), int(np.floor(self.middle + half)) + 1)

    def mean(self, total: FloatArray) -> float:
        """Return the mean force: the area of the pulse over its length; of a wheel that stands, in its middle half."""
        if self.stands:
            part = self.within(0.25 * self.count)
            return float((total[part.stop] - total[part.start]) / (part.stop - part.start))
        return float((total[self.last] - total[self.first]) / self.count)


def _view(passage: Passage, pulses: Pulses, number: int, axle: int) -> _View | None:
    """Return where a wheel is near a sensor; None if not all of it is recorded."""
    channel, own = pulses.channel, passage.pulses[axle, number]
    length, pace = channel.length, 1.0 / abs(float(passage.speeds[axle]))
    middle = passage.times[axle] + channel.place / passage.speeds[axle]
    stands = False
    if own >= 0:
        middle, lasted = pulses.times[own], pulses.durations[own] / length
        stands = not 1.0 / UNSTEADY < lasted / pace < UNSTEADY
        pace = lasted if stands else pace
    count = length * pace * channel.rate
    at = (middle - channel.start) * channel.rate
    reach = (0.5 + min(BESIDE / length, 0.5)) * count
    first, last = round(at - reach), round(at + reach) + 1
    if first < 0 or last >= len(channel.forces):
        return None
    edge = min(max(min(EDGE, 0.25 * length), BEFORE_GAUGE / pace), 0.4 * length)
    return _View(first, last, at, count, (0.5 - edge / length) * count, stands)


def _usual_shape(views: dict[tuple[int, int], _View], quick: Sequence[FloatArray], means: FloatArray) -> FloatArray:
    """Return what a sensor reads of a wheel as it passes, over its mean force, at `SHARES`: the median of all."""
    rows = [
        np.interp(SHARES, view.shares, quick[k][view.first : view.last] / means[axle, k], left=0.0, right=0.0)
        for (axle, k), view in views.items()
        if means[axle, k] > 0.0
    ]
    usual: FloatArray = np.median(np.array(rows), axis=0) if rows else np.zeros(len(SHARES))
    return usual


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
        x = float(passage.speeds[axle] * (when - passage.times[axle]))
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
    echoing: list[tuple[float, float | None, FloatArray]] = []
    for axle in np.argsort(-strongest, kind="stable"):
        speed = abs(float(passage.speeds[axle]))
        kept = [one for one in found[axle] if not any(_is_echo(one, speed, *other) for other in echoing)]
        if not kept:
            continue
        if turn_between(kept, radius) is not None or max(one.excess for one in kept) >= ALONE * mean[axle]:
            out[axle] = tuple(kept)
        echoing.append((float(strongest[axle]), turn_between(kept, None), np.array([one.time for one in kept])))
    return tuple(out)


def _is_echo(one: Strike, speed: float, most: float, turn: float | None, times: FloatArray) -> bool:
    """Return whether a strike is an echo of those at other times of a wheel with this circumference, m, or any."""
    ways, near = speed * np.abs(one.time - times), speed * AT_ONCE
    turns = np.arange(1, FARTHEST + 1)
    shortest, longest = (turn, turn) if turn is not None else USUAL_TURNS
    inside = (ways[:, None] >= turns * shortest - near) & (ways[:, None] <= turns * longest + near)
    return bool(one.excess < most * (1.0 if turn is not None else ECHO) and (inside.any() or (ways <= near).any()))


def turn_between(strikes: Sequence[Strike], radius: float | None) -> float | None:
    """Return the way, m, after which strikes repeat as a place on a wheel does, or None.

    With a stated radius it is the circumference. Without, it is a way that some wheel can have, and that the most
    distances of strikes are multiples of.
    """
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
    return None if best is None else best[1]


def imbalance(a: Any, b: Any) -> float | None:
    """Return (a - b)/(a + b) of two loads, or None."""
    return None if a is None or b is None or a + b <= 0.0 else float((a - b) / (a + b))
