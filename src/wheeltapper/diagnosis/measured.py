"""Forces from the recording itself, for recordings that no model explains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.diagnosis.case import Case
from wheeltapper.diagnosis.force.reconstruction import Force, reconstructed
from wheeltapper.diagnosis.inference.timing import untimed
from wheeltapper.ground.errors import InputError


class Forces(NamedTuple):
    """Speed, m/s, static and largest force of the wheelset, N, and the number of impacts (None: unknown).

    `deviation` is the standard error of the largest force due to the sensor's noise, N; NaN if it is not known.
    """

    speed: float
    static: float
    largest: float
    impacts: int | None
    source: str  # "model" or "recording"
    deviation: float = np.nan
    notes: tuple[str, ...] = ()


def measured_forces(case: Case) -> Forces:
    """Return the forces in a recording: the static force from flights, the largest one from the reconstructed force.

    If nearly all samples are clipped, the force cannot be reconstructed. The largest force is then at least what the
    deck's inertia shows, N0 - M·a.
    """
    recording, passage = case.whole, case.passage_with_measured_load
    static, force, deviation = float(passage.vehicle.weight), _reconstructed_force(case), np.nan
    notes = []
    if force is not None:
        top = int(np.nanargmax(force.force))
        largest, deviation = float(force.force[top]), float(force.deviation[top])
        notes.append(f"no model explains the recording: its forces are reconstructed from it ({force.method})")
    else:
        largest = static - float(passage.track.mass) * float(np.nanmin(recording.samples))
        notes.append(
            "no model explains the recording: the largest force given is the least that the clipped samples allow"
        )
    if recording.clipped.any():
        notes.append("samples are clipped: the true largest force may lie beyond the one given")
    return Forces(float(case.passage.speed), static, max(largest, static), None, "recording", deviation, tuple(notes))


def forces_with_unexplained(case: Case, forces: Forces) -> Forces:
    """Return the forces of a model, with the largest one of the stretch that it does not explain."""
    assert case.omitted is not None
    measured = _reconstructed_force(case)
    if measured is None:
        return forces
    inside = (measured.times >= case.omitted.start) & (measured.times <= case.omitted.end)
    seen = np.where(inside, np.nan_to_num(measured.force), 0.0)
    top = int(np.argmax(seen))
    if seen[top] <= forces.largest:
        return forces
    note = "the largest force is reconstructed from the part of the recording that no model explains"
    return forces._replace(
        largest=float(seen[top]), source="recording", deviation=float(measured.deviation[top]),
        notes=(*forces.notes, note),
    )  # fmt: skip


def _reconstructed_force(case: Case) -> Force | None:
    """Return the force reconstructed from the whole recording; None if too many samples are clipped."""
    try:
        return reconstructed(
            case.whole, case.site.model_copy(update={"passage": untimed(case.passage_with_measured_load)})
        )
    except InputError:
        return None
