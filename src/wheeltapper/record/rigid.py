"""A note on the effect of a rigid track on the force, for runs in which it matters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.ground.needs import DECK, FLEXIBLE_TRACK, SEVERAL_BODIES
from wheeltapper.ground.notes import Note

if TYPE_CHECKING:
    from wheeltapper.describe.irregularity.course import Course
    from wheeltapper.record.record import Record

LARGE = 2.5
"""Ratio of the largest to the static force. Above it, at a kink of the path, the compliance of a real track would
change the force, and the note is given."""
KINK = 1e-4
"""Smallest change of slope that counts as a kink, and smallest jump over the height of the irregularity that counts as
a jump."""
NOTE = Note(
    "the track is rigid: at a flat, a step or a joint, forces on a rail that bends (wt.tracks) are others, much "
    "smaller at low speed, at high speed perhaps larger",
    "rigid track",
)
"""The note itself."""


def rigid_track(record: Record) -> tuple[Note, ...]:
    """Return a note if a kink on a rigid track causes a large force."""
    scenario = record.scenario
    if scenario.needs & {DECK, FLEXIBLE_TRACK} or (record._impacts_and_ratio()[1] or 0.0) <= LARGE:
        return ()
    vehicle: Any = scenario.vehicle
    radius = vehicle.axles[0].radius if SEVERAL_BODIES in scenario.needs else vehicle.plane.wheelsets[0].radius
    return (NOTE,) if any(has_kink(item.course(radius)) for item in scenario.irregularities) else ()


def has_kink(course: Course) -> bool:
    """Return whether a course's height or slope jumps."""
    for before, after in zip(course.stretches[:-1], course.stretches[1:], strict=True):
        here = np.array([before.end])
        if abs((after.slope(here) - before.slope(here)).item()) > KINK:
            return True
        if abs((after.value(here) - before.value(here)).item()) > KINK * course.height:
            return True
    return False
