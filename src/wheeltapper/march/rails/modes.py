"""The modes of both rails between two macro steps: what forces did to them, and what they show the wheels next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.assembly import HALF
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.contract import Bodies, Contact, Law, Method, System
from wheeltapper.march.general.layout import BEGIN, IM, RE
from wheeltapper.march.general.modal import add_turned_back, read_modes, turn, turned, write_modes
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import TrackTables, Units, track_tables, without_bodies
from wheeltapper.march.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.program import FloatArray, IntArray


class Track(NamedTuple):
    """One rail, as the wheels of a vehicle meet it.

    Attributes
    ----------
    ring
        Its modes.
    method
        How macro steps are made.
    places
        Of the wheelsets at time zero, m from the beginning of a bay.
    speed
        m/s.
    units
        Of the tables: m and N near a static indentation and force.
    """

    ring: Ring
    method: Method
    places: FloatArray
    speed: float
    units: Units


class RailTables(NamedTuple):
    """What a track is to the kernels, as entries of `general.records.Tables`; r and B in SI units, flat.

    Attributes
    ----------
    seconds
        Length of a macro step.
    reads, writes, first, decay, turns, sets, phase, bay
        As there.
    local, answers
        Of all places in a bay: (places, fours·nodes·HALF) and the square of that, force first.
    """

    seconds: float
    reads: FloatArray
    writes: FloatArray
    first: IntArray
    decay: FloatArray
    turns: FloatArray
    sets: IntArray
    phase: IntArray
    bay: IntArray
    local: FloatArray
    answers: FloatArray


def tables_of(track: Track, duration: float) -> RailTables:
    """Return the tables of a track for a duration, s."""
    made = tables_for(track, duration)
    held = without_bodies(made, track.method)
    transform, compliance = gauss_nodes(track.method.nodes).transform, track.units.length / track.units.force
    answers = compliance * (transform @ held.cross @ transform.T)  # (wheel, other, places, m, l)
    return RailTables(
        made.grid.seconds, held.reads, held.writes, held.first, held.decay, held.turns, held.sets, held.phase,
        held.bay, _in_fours(compliance * held.residual.transpose(1, 0, 2), 1),
        _in_fours(answers.transpose(2, 1, 4, 0, 3), 3, 1),
    )  # fmt: skip


def tables_for(track: Track, duration: float) -> TrackTables:
    """Return what the general march makes of a track for a duration, s."""
    return track_tables(system_of(track), track.method, track.units, duration)


def fours_of(wheelsets: int) -> int:
    """Return how many fours of wheelsets there are."""
    return -(-wheelsets // HALF)


def _in_fours(table: FloatArray, *axes: int) -> FloatArray:
    """Return a table with wheelsets in fours, from (places, …, wheelsets, nodes, …) at each axis; then flat."""
    for axis in axes:
        missing = -table.shape[axis] % HALF
        padded = np.pad(table, [(0, missing if i == axis else 0) for i in range(table.ndim)])
        split = padded.reshape(*padded.shape[:axis], -1, HALF, *padded.shape[axis + 1 :])
        table = np.moveaxis(split, axis + 1, axis + 2)
    return np.ascontiguousarray(table).reshape(len(table), -1)


def system_of(track: Track) -> System:
    """Return the track below weightless contacts, for which the general march makes tables."""
    none = np.zeros((0, 0))
    law = Law(0, np.zeros(0))
    contacts = tuple(Contact(none, law, float(place)) for place in track.places)
    weightless = Bodies(none, none, none, np.zeros((0, len(contacts))), np.zeros(0))
    return System(weightless, contacts, track.speed, track.ring)


@inlined_uncounted_kernel
def _bays_ahead(step: int, i: int, phases: int, bays: int, phase: IntArray, bay: IntArray) -> int:
    """Return how many bays a wheelset is ahead of the first one."""
    own = bay[i] + (phase[i] + step) // phases
    first = bay[BEGIN] + (phase[BEGIN] + step) // phases
    return (own - first) % bays


@uncounted_kernel
def read_rails(step: int, reads: FloatArray, first: IntArray, turns: FloatArray, sets: IntArray, phase: IntArray, bay: IntArray, modes: FloatArray, spare: FloatArray, unit: float, sinking: FloatArray, free: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Write what the rails show the wheels in a macro step: free is (2, fours, nodes, HALF), m downwards.

    `modes` is (2, 2, modes): of the left and the right rail, real and imaginary parts. What the wheels feel counts from
    `sinking`.
    """
    phases = reads.shape[1]
    free[:] = 0.0
    for i in range(len(sets)):
        rows = reads[sets[i], (phase[i] + step) % phases]
        ahead = _bays_ahead(step, i, phases, len(turns), phase, bay)
        for rail in range(2):
            if i == 0:
                read_modes(rows, first, modes[rail, RE], modes[rail, IM], free[rail, i // HALF, :, i % HALF])
            else:
                turned(turns[ahead], modes[rail, RE], modes[rail, IM], spare[RE], spare[IM])
                read_modes(rows, first, spare[RE], spare[IM], free[rail, i // HALF, :, i % HALF])
    for i in range(len(sets)):
        for rail in range(2):
            for m in range(free.shape[2]):
                free[rail, i // HALF, m, i % HALF] *= -unit
            free[rail, i // HALF, BEGIN, i % HALF] -= sinking[rail, i]


@uncounted_kernel
def write_rails(step: int, writes: FloatArray, first: IntArray, decay: FloatArray, turns: FloatArray, sets: IntArray, phase: IntArray, bay: IntArray, moments: FloatArray, modes: FloatArray, spare: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Move the modes over a macro step; moments are as `free`, in units of the tables."""
    phases = writes.shape[1]
    for rail in range(2):
        turn(decay, modes[rail, RE], modes[rail, IM])
    for i in range(len(sets)):
        rows = writes[sets[i], (phase[i] + step) % phases]
        ahead = _bays_ahead(step, i, phases, len(turns), phase, bay)
        for rail in range(2):
            if i == 0:
                write_modes(rows, first, moments[rail, i // HALF, :, i % HALF], modes[rail, RE], modes[rail, IM])
            else:
                spare[:] = 0.0
                write_modes(rows, first, moments[rail, i // HALF, :, i % HALF], spare[RE], spare[IM])
                add_turned_back(turns[ahead], spare[RE], spare[IM], modes[rail, RE], modes[rail, IM])
    if (phase[BEGIN] + step + 1) % phases == 0:
        for rail in range(2):
            turn(turns[1 % len(turns)], modes[rail, RE], modes[rail, IM])
