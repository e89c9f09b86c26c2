"""Forces from the recording itself, for recordings that no model explains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.diagnosis.case import Case
from wheeltapper.diagnosis.force.reconstruction import reconstructed
from wheeltapper.diagnosis.inference.timing import untimed
from wheeltapper.ground.errors import InputError


class Forces(NamedTuple):
    """Speed, m/s, static and largest force of the wheelset, N, and the number of impacts (None: unknown)."""

    speed: float
    static: float
    largest: float
    impacts: int | None
    source: str  # "model" or "recording"
    notes: tuple[str, ...] = ()


def measured_forces(case: Case) -> Forces:
    """Return the forces in a recording: the static force from flights, the largest one from the reconstructed force.

    If nearly all samples are clipped, the force cannot be reconstructed. The largest force is then at least what the
    deck's inertia shows, N0 - M·a.
    """
    recording, passage = case.whole, case.passage_with_measured_load
    static = float(passage.vehicle.weight)
    notes = []
    try:
        force = reconstructed(recording, case.site.model_copy(update={"passage": untimed(passage)}))
        largest = float(np.nanmax(force.force))
        notes.append(f"no model explains the recording: its forces are reconstructed from it ({force.method})")
    except InputError:
        largest = static - float(passage.track.mass) * float(np.nanmin(recording.samples))
        notes.append("no model explains the recording: its largest force is what the clipped samples show, or more")
    if recording.clipped.any():
        notes.append("samples are clipped: the true largest force may lie beyond the one given")
    return Forces(float(case.passage.speed), static, max(largest, static), None, "recording", tuple(notes))
