"""A train's passage: its axles' times, speeds and places, and which pulse of each channel is of which axle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import Channel, FloatArray
from wheeltapper.diagnosis.wayside.course import Course
from wheeltapper.diagnosis.wayside.pulses import Pulses

AS_KNOWN = 0.03
"""Largest deviation of a train's distances of axles from those of the known vehicle, over them."""
AROUND_SENSOR = 0.2
"""A wheel farther from a sensor than this, m, is not felt by it."""


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
    cut
        Whether the recording begins, and ends, while it passes.
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
    cut: tuple[bool, bool] = (False, False)

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


def occupied_by(passages: Sequence[Passage], channel: Channel) -> FloatArray:
    """Return from when until when the wheels of trains are near a sensor, s, (wheel, 2)."""
    half = 0.5 * channel.length + AROUND_SENSOR
    spans = [
        np.sort(np.array([one.when_at(np.arange(len(one.times)), channel.place + side * half) for side in (-1, 1)]).T)
        for one in passages
    ]
    return np.concatenate(spans)


def with_known_distances(passage: Passage, distances: Sequence[float]) -> Passage:
    """Return a passage whose speeds follow from known distances of neighbouring axles, m, somewhere in the train.

    Where channels at several places give the speed, it is kept, and a note says by how much the other one differs.
    """
    # Of a train with a course ways are compared instead of times: "speed" is then a factor.
    course = passage.course
    gaps = np.abs(np.diff(passage.times)) if course is None else np.diff(passage.places)
    known = np.array(distances)
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
    speed *= 1.0 if course is None else own
    told = f"the known vehicle begins at axle {first + 1}; by its distances the speed is {3.6 * speed:.2f} km/h"
    if passage.sure:
        return replace(passage, notes=(*passage.notes, f"{told}, by the channels {3.6 * own:.2f} km/h"))
    factor = speed / own
    return replace(
        passage, speeds=passage.speeds * factor, places=passage.places * factor, notes=(*passage.notes, told),
        course=None if course is None else Course(course.times, course.ways * factor),
    )  # fmt: skip


def channel_names(several: Sequence[Pulses], numbers: NDArray[np.int64]) -> str:
    """Return the names of channels, of which many are counted."""
    names = [several[k].channel.sensor.name for k in np.unique(numbers)]
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def axles_text(numbers: Sequence[int]) -> str:
    """Return rising numbers of axles as text: axle 3; axles 1 to 3, 7."""
    return f"axle{'s' if len(numbers) > 1 else ''} {_spans_text(numbers)}"


def _spans_text(numbers: Sequence[int]) -> str:
    """Return rising numbers as text: 1 to 3, 7."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in spans)


def speed_notes(speeds: FloatArray, known: bool, either: bool) -> tuple[str, ...]:
    """Return what is said of the speeds of a train's axles, m/s."""
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
