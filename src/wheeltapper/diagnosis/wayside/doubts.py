"""What channels give reason to doubt: signs, gains, clocks and places that do not fit each other. All of it is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wheeltapper.diagnosis.wayside.axles import Passage, channel_names, spans_text
from wheeltapper.diagnosis.wayside.channels import Channel, FloatArray
from wheeltapper.diagnosis.wayside.pulses import Pulses, usual_height
from wheeltapper.diagnosis.wayside.wheels import Side
from wheeltapper.ground.errors import InputError

WRAPPED, OFTEN = 0.8, 20
"""A channel that jumps so often by this share of its range has lost the signs of its numbers."""
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
EXCHANGED = (0.05, 3.0)
"""A channel whose forces differ from those of its rail by more than this share, and so many times more than from those
of the other rail, is of the other rail."""
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
    for channel, end in zip(sound, ends, strict=True):
        if end < ends.max() - ENDS:
            notes.append(f"channel {channel.sensor.name!r} ends at {end:.2f} s, the longest at {ends.max():.2f} s")
    return sound, notes


def _scatter(samples: FloatArray) -> float:
    """Return the standard deviation of what lies near the median."""
    return float(1.4826 * np.median(np.abs(samples - np.median(samples))))


def doubtful_gains(several: Sequence[Pulses]) -> tuple[frozenset[int], list[str]]:
    """Return the numbers of channels that do not count for forces, and why.

    Only if most channels agree it is known which are wrong.
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
    if usual.max() > GAINS * usual.min():
        names = [several[numbers[i]].channel.sensor.name for i in (int(np.argmax(usual)), int(np.argmin(usual)))]
        notes.append(
            f"channel {names[0]!r} reads {usual.max() / usual.min():.3g} times what {names[1]!r} does; which is wrong "
            "is not known, and forces are uncertain"
        )
    if not LIGHTEST < middle < HEAVIEST:
        notes.append(f"wheels of {1e-3 * middle:.3g} kN: no railway has such; the gain or the unit is wrong")
    return frozenset(), notes


def exchanged_sides(sides: Sequence[Side]) -> tuple[frozenset[str], list[str]]:
    """Return the names of channels that show the wheels of the other rail, and what is said of them.

    Wheels are known by their forces in the other channels of both rails, of which there must be two or more.
    """
    if len(sides) != 2 or min(len(side.names) for side in sides) < 3:
        return frozenset(), []
    names, notes = [], []
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


def misfits(passage: Passage, several: Sequence[Pulses]) -> list[str]:
    """Return what in the times of a train does not fit: lengths of pulses and speeds, axles and places of channels."""
    notes, times, ratios = [], [], []
    for number, pulses in enumerate(several):
        axles = np.flatnonzero(passage.pulses[:, number] >= 0)
        own = passage.pulses[axles, number]
        if not len(axles):
            continue
        pace, way = np.abs(passage.speeds[axles]), np.sign(passage.speeds[axles])
        beside = float(np.median(way * (passage.x_of(axles, pulses.times[own]) - pulses.channel.place)))
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


def lost_axles(numbers: np.ndarray, several: Sequence[Pulses]) -> list[str]:
    """Return notes on the axles that channels do not show, (axle, channel); axles lost in the same ones together."""
    groups: dict[tuple[int, ...], list[int]] = {}
    for axle, lost in enumerate(numbers < 0, 1):
        if lost.any():
            groups.setdefault(tuple(np.flatnonzero(lost).tolist()), []).append(axle)
    return [
        f"axle{'s' if len(axles) > 1 else ''} {spans_text(axles)}: lost in {len(lost)} of {numbers.shape[1]} channels: "
        f"{channel_names(several, np.array(lost))}"
        for lost, axles in groups.items()
    ]
