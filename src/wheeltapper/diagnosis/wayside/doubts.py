"""What channels give reason to doubt: signs, gains, clocks and places that do not fit each other. All of it is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import Channel, FloatArray
from wheeltapper.diagnosis.wayside.passage import Passage, axles_text, channel_names
from wheeltapper.diagnosis.wayside.pulses import Pulses, usual_height
from wheeltapper.diagnosis.wayside.wheels import Side
from wheeltapper.ground.errors import InputError

WRAPPED, OFTEN = 0.8, 20
"""A channel that jumps so often by this share of its range has lost the signs of its numbers."""
FEWEST = 10
"""Of fewer channels it is not known which one is wrong."""
ENOUGH = 1000.0
"""Samples per second that show whether axles press upwards or downwards, Hz."""
DOWNWARDS = 3.0
"""A channel reaches so many times farther down than up from its median: its sign is wrong."""
ENDS = 0.2
"""Channels end together if the ends differ by less than this, s."""
GAINS = 2.0
"""Channels whose usual pulses differ from the median channel's by more than this factor do not count for forces."""
HEAVIEST = 200e3
"""No wheel of a railway stands on the rail with more than this, N,"""
LIGHTEST = 2e3
"""or with less."""
LENGTHS = 0.08
"""Largest deviation of the pulses' lengths from what speeds and sensors say, over them,"""
DRIFT = 0.015
"""and by how much it may change along a train,"""
STANDS_OUT = 5.0
"""or so many standard errors of that change."""
FEWEST_AXLES = 4
"""By fewer axles channels are not compared."""
ODD_GAIN, FEWEST_OF_RAIL = 1.25, 4
"""A channel's gain is wrong if it differs from that of so many others of its rail by more than this factor."""
EXCHANGED = (0.05, 3.0)
"""A channel whose forces differ from those of its rail by more than this share, and so many times more than from those
of the other rail, is of the other rail."""
GAP = 0.04
"""Samples that most channels lack for longer than this are told, s."""
APART = 0.5
"""A pulse that begins or ends closer than this to a gap in the recording, m, is not lost."""
SAME = 0.1
"""Places that differ by less than this are the same, m."""
MATCHED = (0.7, 1.2)
"""A channel is displaced if so large a share of its axles are at another place, so many times more than at its own."""
AT_ODDS, ODD = 0.05, 1 / 3
"""Where more than this share of all channels show axles so far beside their places, m, there is no such train."""
LOST = 0.2
"""Where so large a share of the axles' pulses is lost there is no such train either."""
EXPLAINED, LONGEST = 0.6, 0.5
"""A train explains at least this share of all pulses; pulses last at most this share of the time between them."""
TROLLEYS = (500.0, 400e3)
"""Wheels of forces outside of these, N, are none of a railway."""
BESIDE = 0.02
"""Largest distance of an axle from the place of a channel when the channel shows it, m."""


def sound_channels(channels: Sequence[Channel]) -> tuple[list[Channel], list[str]]:
    """Return the channels whose numbers can be forces, upwards, and what was found in them."""
    sound, notes = [], []
    for channel in channels:
        name = f"channel {channel.sensor.name!r}"
        span = float(np.ptp(channel.forces))
        steps = np.diff(channel.forces)
        jumps = int(np.count_nonzero(np.abs(steps, out=steps) > WRAPPED * span)) if span else 0
        if jumps > OFTEN:
            notes.append(
                f"{name}: {jumps} jumps by almost all of its range, {1e-3 * span:.4g} kN, as of negative numbers that "
                "were kept without their sign; it does not count"
            )
            continue
        few = channel.forces[:: max(int(channel.rate / ENOUGH), 1)]
        low, middle, high = np.quantile(few, (0.001, 0.5, 0.999))
        if middle - low > DOWNWARDS * (high - middle) and middle - low > STANDS_OUT * _scatter(few):
            notes.append(f"{name}: axles press downwards in it; its sign is turned here")
            channel = replace(channel, forces=-channel.forces)
        sound.append(channel)
    if not sound:
        raise InputError("", "recordings", notes[0], "forces with their signs")
    ends = np.array([channel.start + len(channel.forces) / channel.rate for channel in sound])
    short = np.flatnonzero(ends < ends.max() - ENDS).tolist()
    if len(short) > 2:
        told = f"{len(short)} of {len(sound)} channels end before the others, from {ends.min():.2f} s on"
        notes.append(f"{told}, the longest at {ends.max():.2f} s")
    else:
        notes += [
            f"channel {sound[k].sensor.name!r} ends at {ends[k]:.2f} s, the longest at {ends.max():.2f} s"
            for k in short
        ]
    return sound, notes


def _scatter(samples: FloatArray) -> float:
    """Return the standard deviation of what lies near the median."""
    return float(1.4826 * np.median(np.abs(samples - np.median(samples))))


def doubtful_gains(several: Sequence[Pulses]) -> tuple[frozenset[int], list[str]]:
    """Return the numbers of channels that do not count for forces, and why.

    Only if most channels agree it is known which are wrong; with several on each rail `odd_gains` knows it better.
    """
    numbers = [n for n, one in enumerate(several) if np.isfinite(one.channel.length) and len(one.heights)]
    if not numbers:
        return frozenset(), []
    usual = np.array([usual_height(several[n].heights) for n in numbers])
    middle = float(np.median(usual))
    apart = np.abs(np.log(usual / middle)) > np.log(GAINS)
    notes = []
    if apart.any() and np.count_nonzero(~apart) > 0.5 * len(numbers):
        for n, value in zip(np.array(numbers)[apart], usual[apart], strict=True):
            name = several[n].channel.sensor.name
            notes.append(
                f"channel {name!r} reads {value / middle:.3g} times what the others do: its gain or unit is wrong, and "
                "it does not count for forces"
            )
        return frozenset(np.array(numbers)[apart].tolist()), notes
    if usual.max() > GAINS * usual.min() and len(numbers) < 2 * FEWEST_OF_RAIL:
        names = [several[numbers[i]].channel.sensor.name for i in (int(np.argmax(usual)), int(np.argmin(usual)))]
        notes.append(
            f"channel {names[0]!r} reads {usual.max() / usual.min():.3g} times what {names[1]!r} does; which is wrong "
            "is not known, and forces are uncertain"
        )
    if not LIGHTEST < middle < HEAVIEST:
        notes.append(f"wheels of {1e-3 * middle:.3g} kN: no railway has such; the gain or the unit is wrong")
    return frozenset(), notes


def odd_gains(sides: Sequence[Side]) -> tuple[frozenset[str], list[str]]:
    """Return the names of channels that read wheels otherwise than the others of their rail, and what is said."""
    names, notes = [], []
    for side in sides:
        shown = side.of_channels[:, [k for k, name in enumerate(side.names) if name in side.counted]]
        if shown.shape[1] <= FEWEST_OF_RAIL or len(shown) < FEWEST_AXLES:
            continue
        factors = _known_median(shown / _known_median(shown, 1)[:, None], 0)
        for name, factor in zip(side.counted, factors.tolist(), strict=True):
            if factor > 0.0 and abs(np.log(factor)) > np.log(ODD_GAIN):
                names.append(name)
                notes.append(
                    f"channel {name!r} reads {factor:.3g} times what the others of its rail do: its gain or unit is "
                    "wrong, and it does not count for forces"
                )
    return frozenset(names), notes


def exchanged_sides(sides: Sequence[Side]) -> tuple[frozenset[str], list[str]]:
    """Return the names of channels that show the wheels of the other rail, and what is said of them.

    Wheels are known by their forces in the other channels of both rails, of which there must be two or more.
    """
    if len(sides) != 2 or min(len(side.names) for side in sides) < 3:
        return frozenset(), []
    names, notes = [], []
    if len(sides[0].mean) < FEWEST_AXLES:
        return frozenset(), []
    for side, other in (sides, sides[::-1]):
        own, theirs = (one.of_channels / _known_median(one.of_channels, 0) for one in (side, other))
        for k, name in enumerate(side.names):
            rest = _known_median(np.delete(own, k, axis=1), 1)
            ratios = np.array([own[:, k] / rest, own[:, k] / _known_median(theirs, 1)])
            off, crossed = _known_median(np.abs(ratios / _known_median(ratios, 1)[:, None] - 1.0), 1)
            if off > EXCHANGED[0] and off > EXCHANGED[1] * crossed:
                names.append(name)
                notes.append(
                    f"channel {name!r} shows the wheels of the {other.side} rail: its side or its name is wrong, and "
                    "it does not count for forces"
                )
    return frozenset(names), notes


def _known_median(values: FloatArray, axis: int) -> FloatArray:
    """Return medians of what is known; NaN where nothing is."""
    there = np.isfinite(values).any(axis=axis)
    found = np.nanmedian(np.where(np.expand_dims(there, axis), values, 0.0), axis=axis)
    return np.where(there, found, np.nan)


def displaced(passages: Sequence[Passage], several: Sequence[Pulses]) -> tuple[dict[int, float], list[str]]:
    """Return how far beside their places channels show the axles, m, in the train's direction, and what is said of it.

    Only a few of many channels can be told to be wrong.
    """
    if len(several) < FEWEST or not passages or any(one.turns or not one.sure for one in passages):
        return {}, []
    passage = max(passages, key=lambda one: len(one.times))
    way, axles = float(np.sign(passage.speeds[0])), np.arange(len(passage.times))
    found: dict[int, float] = {}
    for number, pulses in enumerate(several):
        if not len(pulses.times) or np.isnan(pulses.channel.length):
            continue
        off = way * (passage.x_of(axles[:, None], pulses.times) - pulses.channel.place).ravel()
        off = np.sort(off)
        counts = np.searchsorted(off, off + SAME, side="right") - np.arange(len(off))
        best = np.flatnonzero(counts == counts.max())
        shifts = np.array([np.median(off[i : i + counts[i]]) for i in best])
        shift = float(shifts[np.argmin(np.abs(shifts))])
        own = np.count_nonzero(np.abs(off) < SAME)
        if abs(shift) > SAME and counts.max() >= max(MATCHED[0] * len(axles), MATCHED[1] * own):
            found[number] = shift
    if not found or len(found) > len(several) / 3:
        return {}, []
    return found, _displaced_notes(found, several, way)


def _displaced_notes(found: dict[int, float], several: Sequence[Pulses], way: float) -> list[str]:
    notes, told = [], set[int]()
    places = {k: several[k].channel.place for k in found}
    for k, shift in found.items():
        if k in told:
            continue
        name = several[k].channel.sensor.name
        other = next(
            (
                j for j in found if j != k and abs(places[k] + way * shift - places[j]) < 2 * SAME
                and abs(places[j] + way * found[j] - places[k]) < 2 * SAME
            ), None,
        )  # fmt: skip
        if other is not None:
            told |= {k, other}
            names = f"{name!r} and {several[other].channel.sensor.name!r}"
            notes.append(f"channels {names} are exchanged: each shows axles at the other's place; they do not count")
        else:
            notes.append(
                f"channel {name!r} shows axles {abs(shift):.2f} m {'behind' if shift > 0 else 'before'} its place: its "
                "name, its place or its clock is wrong, and it does not count"
            )
    return notes


def check_train(passages: Sequence[Passage], several: Sequence[Pulses]) -> None:
    """Refuse recordings whose pulses make no train, or whose forces are none of a railway."""
    shares = [
        float(np.median(one.durations) / np.median(np.diff(one.times))) for one in several
        if len(one.times) > 3 and np.isfinite(one.channel.length)
    ]  # fmt: skip
    allowed = "forces of sensors at the places that the site states, on one clock"
    share = float(np.median(shares)) if shares else 0.0
    if share > LONGEST:
        found = f"pulses that last {100 * share:.0f} % of the time between them, as on no sensor of a rail"
        raise InputError("", "recordings", found, allowed)
    total = sum(len(one.times) for one in several)
    explained = sum(int((one.pulses >= 0).sum()) for one in passages)
    if passages and explained < EXPLAINED * total:
        found = f"{total} pulses, of which {100 * explained / total:.0f} % are of axles that other channels show, too"
        raise InputError("", "recordings", found, allowed)
    for passage in passages:
        off = [beside_of(passage, number, one) for number, one in enumerate(several)]
        wrong = int(np.count_nonzero(np.abs(off) > AT_ODDS))
        if passage.sure and len(several) > 2 and wrong > ODD * len(several):
            found = f"{wrong} of {len(several)} channels that show axles beside their places"
            raise InputError("", "recordings", found, allowed)
        early, late, _ = ends_within(passage, several)
        if (early | late).all() and (early & late).any():
            found = "pulses that are of no axle, or of axles that take longer over the sensors than the recording lasts"
            raise InputError("", "recordings", found, allowed)
        lost, recorded = _lost(passage, several)
        sound = np.argsort(lost.mean(axis=0))[: len(several) - len(several) // 3]  # some may be dead
        share = float(lost[:, sound].sum() / max(recorded[:, sound].sum(), 1))
        if share > LOST and not passage.turns:
            found = f"{len(passage.times)} axles, of whose pulses {100 * share:.0f} % are missing"
            raise InputError("", "recordings", found, allowed)
    usual = [usual_height(one.heights) for one in several if np.isfinite(one.channel.length) and len(one.heights)]
    if usual and passages and not TROLLEYS[0] < float(np.median(usual)) < TROLLEYS[1]:
        found = f"wheels of {1e-3 * float(np.median(usual)):.3g} kN"
        raise InputError("", "recordings", found, "forces of a railway's wheels, 2 to 200 kN: state unit or gain")


def beside_of(passage: Passage, number: int, pulses: Pulses) -> float:
    """Return how far behind its place the channel with this number shows the axles, m, in the train's direction."""
    axles = np.flatnonzero(passage.pulses[:, number] >= 0)
    if not len(axles):
        return 0.0
    x = passage.x_of(axles, pulses.times[passage.pulses[axles, number]])
    return float(np.median(np.sign(passage.speeds[axles]) * (x - pulses.channel.place)))


def misfits(passage: Passage, several: Sequence[Pulses]) -> list[str]:
    """Return what in the times of a train does not fit: lengths of pulses and speeds, axles and places of channels."""
    notes, times, ratios = [], [], []
    for number, pulses in enumerate(several):
        axles = np.flatnonzero(passage.pulses[:, number] >= 0)
        own = passage.pulses[axles, number]
        if not len(axles):
            continue
        pace, beside = np.abs(passage.speeds[axles]), beside_of(passage, number, pulses)
        if abs(beside) > BESIDE and passage.sure:
            notes.append(
                f"channel {pulses.channel.sensor.name!r} shows axles {abs(beside):.2f} m "
                f"{'behind' if beside > 0 else 'before'} its place: its name, its place or its clock is wrong, and "
                "speeds are uncertain"
            )
        if np.isfinite(pulses.channel.length) and passage.course is None:
            times.append(passage.times[axles])
            ratios.append(pulses.durations[own] * pace / pulses.channel.length)
    if times and passage.sure:
        notes += _lengths_of_pulses(np.concatenate(times), np.concatenate(ratios))
    return notes


def _lengths_of_pulses(times: FloatArray, ratios: FloatArray) -> list[str]:
    middle = float(np.median(ratios))
    if abs(middle - 1.0) > LENGTHS:
        return [
            f"the pulses last {middle:.3g} times as long as speeds and lengths of sensors say: clocks or places of the "
            "channels do not fit, and speeds are uncertain"
        ]
    keep = np.abs(ratios - middle) <= np.maximum(STANDS_OUT * _scatter(ratios), 1e-3)
    t = times[keep] - times[keep].mean()
    spread = float(t @ t)
    if np.count_nonzero(keep) < 8 or not spread:
        return []
    slope = float(t @ ratios[keep]) / spread
    error = float(np.std(ratios[keep] - slope * t)) / spread**0.5
    change = slope * float(np.ptp(t))
    if abs(change) <= max(DRIFT, STANDS_OUT * error * float(np.ptp(t))):
        return []
    return [
        f"along the train the speed by the times between channels changes by {100 * change:+.1f} % against that by the "
        "lengths of pulses: the channels' clocks run apart, and speeds are uncertain"
    ]


def gaps_in(channels: Sequence[Channel]) -> list[str]:
    """Return when most channels have no samples: what passed then is not seen."""
    begin, end = max(one.start for one in channels), min(one.end for one in channels)
    times = np.arange(begin, end, GAP / 4.0)
    covers = np.array([one.covers(times, times) for one in channels])
    lost = np.diff(covers.mean(axis=0) < 0.5, prepend=False, append=False)
    spans = begin + 0.25 * GAP * np.flatnonzero(lost).reshape(-1, 2)
    return [
        f"from {a:.2f} to {b:.2f} s most channels have no samples: axles that passed then are not seen"
        for a, b in spans.tolist()
        if b - a > GAP
    ]


def ends_within(passage: Passage, several: Sequence[Pulses]) -> tuple[NDArray[np.bool_], NDArray[np.bool_], list[str]]:
    """Return which axles passed sensors before the recording begins, and after it ends, and what is said of it."""
    early, late = np.zeros((2, len(passage.times)), dtype=bool)
    for number, pulses in enumerate(several):
        first, last = _near(passage, pulses.channel)
        lost = passage.pulses[:, number] < 0
        early |= lost & (first < pulses.channel.start)
        late |= lost & (last > pulses.channel.end)
    notes = []
    for axles, what, more in ((early, "begins", "be missing before them"), (late, "ends", "follow")):
        if axles.any():
            which = axles_text((np.flatnonzero(axles) + 1).tolist())
            notes.append(
                f"the recording {what} while the train passes: of {which} some sensors show nothing, and more "
                f"axles may {more}"
            )
    return early, late, notes


def _near(passage: Passage, channel: Channel, beside: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return from when until when axles are on a sensor, or so far beside it, m, in s."""
    half, axles = 0.5 * float(np.nan_to_num(channel.length)) + beside, np.arange(len(passage.times))
    ends = np.array([passage.when_at(axles, channel.place + side * half) for side in (-1.0, 1.0)])
    return ends.min(axis=0), ends.max(axis=0)


def _lost(passage: Passage, several: Sequence[Pulses]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which axles channels were recorded for and do not show, and which they were recorded for."""
    recorded = np.array([one.channel.covers(*_near(passage, one.channel, APART)) for one in several]).T
    return recorded & (passage.pulses < 0), recorded


def lost_axles(passage: Passage, several: Sequence[Pulses]) -> list[str]:
    """Return notes on the axles that channels do not show although they were recorded then.

    Axles that are lost in the same channels are told together.
    """
    missed = _lost(passage, several)[0]
    dead = np.flatnonzero(missed.all(axis=0)).tolist()
    notes = []
    if len(dead):
        names = ", ".join(repr(several[k].channel.sensor.name) for k in dead)
        notes.append(f"channel {names} shows no axle" if len(dead) == 1 else f"channels {names} show no axle")
        missed[:, dead] = False
    groups: dict[tuple[int, ...], list[int]] = {}
    for axle, lost in enumerate(missed, 1):
        if lost.any():
            groups.setdefault(tuple(np.flatnonzero(lost).tolist()), []).append(axle)
    return notes + [
        f"{axles_text(axles)}: lost in {len(lost)} of {missed.shape[1]} channels: "
        f"{channel_names(several, np.array(lost))}"
        for lost, axles in groups.items()
    ]
