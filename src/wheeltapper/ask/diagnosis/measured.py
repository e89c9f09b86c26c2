"""Forces where no model explains a recording: those that the recording itself shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.ask.diagnosis.case import Case
from wheeltapper.ask.diagnosis.force import reconstructed
from wheeltapper.ground.errors import InputError


class Forces(NamedTuple):
    """Speed, m/s, static and largest force of the wheelset, N, and how often it struck (None: not known)."""

    speed: float
    static: float
    largest: float
    impacts: int | None
    source: str  # "model" or "recording"
    notes: tuple[str, ...] = ()


def measured(case: Case) -> Forces:
    """Return the forces that a recording shows: the static one in flights, and the largest of the reconstructed ones.

    Where nearly all samples are clipped, nothing can be reconstructed: the largest force is then at least what the
    deck's inertia shows, N0 - M·a.
    """
    recording, passage = case.recording, case.loaded
    static = float(passage.vehicle.weight)
    notes = []
    try:
        force = reconstructed(recording, case.site.model_copy(update={"passage": passage}))
        largest = float(np.nanmax(force.force))
        notes.append(f"no model explains the recording: its forces are reconstructed from it ({force.method})")
    except InputError:
        largest = static - float(passage.track.mass) * float(np.nanmin(recording.samples))
        notes.append("no model explains the recording: its largest force is what the clipped samples show, or more")
    if recording.clipped.any():
        notes.append("samples are clipped: the true largest force may lie beyond the one given")
    return Forces(float(case.passage.speed), static, max(largest, static), None, "recording", tuple(notes))
