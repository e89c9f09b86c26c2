"""The modes of both rails between two macro steps: what forces did to them, and what they show the wheels next.

Two equal rails on the same sleepers move in two ways that know nothing of each other: together, by s = (l + r)/2, as
half of the sum of the forces makes them, and against one another, by a = (l - r)/2, as half of the difference makes
them. Each way is a ring of its own: sleepers bounce in the first and roll in the second.
"""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import NamedTuple

import numpy as np

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.general import tables
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.contract import Bodies, Contact, Law, Method, Port, System
from wheeltapper.march.general.layout import BEGIN, IM, RE
from wheeltapper.march.general.modal import add_turned_back, read_modes, turn, turned, write_modes
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import KEPT_BYTES, TrackTables, Units, longest_step, track_tables, without_bodies
from wheeltapper.march.wagon.assembly import HALF
from wheeltapper.march.wagon.whole_steps import answers_at_nodes, packed_nodes

ALIKE, AGAINST = range(2)
"""The ways in which two rails move."""


class Track(NamedTuple):
    """Two rails, as the wheels of a vehicle meet them.

    Attributes
    ----------
    rings
        Modes of the rails moving together, and against one another; the same ring where sleepers do not roll.
    method
        How macro steps are made.
    places
        Of the wheelsets at time zero, m from the beginning of a bay.
    speed
        m/s.
    units
        Of the tables: m and N near a static indentation and force.
    sleepers
        Of each way, those over voids, as forces press them up.
    """

    rings: tuple[Ring, Ring]
    method: Method
    places: FloatArray
    speed: float
    units: Units
    sleepers: tuple[tuple[Port, ...], tuple[Port, ...]] = ((), ())

    @property
    def rolls(self) -> bool:
        """Whether the two ways differ."""
        return self.rings[ALIKE] is not self.rings[AGAINST]

    @property
    def over_voids(self) -> int:
        """Number of sleepers over voids."""
        return len(self.sleepers[ALIKE])

    @property
    def fours(self) -> int:
        """Number of fours of wheelsets and of sleepers over voids."""
        return fours_of(len(self.places)) + fours_of(self.over_voids)

    @property
    def entries(self) -> IntArray:
        """Which entries of the fours are wheelsets, and then sleepers."""
        behind = fours_of(len(self.places)) * HALF
        return np.concatenate([np.arange(len(self.places)), behind + np.arange(self.over_voids)])


class RailTables(NamedTuple):
    """What a track is to the kernels, as entries of `general.records.Tables`; r and B in SI units, flat.

    Attributes
    ----------
    grid
        The macro steps.
    ways
        Of each way to move; once where both are the same.
    sets, phase, bay
        As there.
    local
        Under a wheel's own force, of all places in a bay: (places, fours·nodes·HALF). It is the mean of both ways;
        half of their difference, which a force does to the other rail, is left out.
    answers, solid
        To the moments of forces, and at the Gauss nodes to forces at the nodes, of all places: (places, ways·square of
        that), force first.
    """

    grid: tables.Grid
    ways: tuple[tables.ModalTables, ...]
    sets: IntArray
    phase: IntArray
    bay: IntArray
    local: FloatArray
    answers: FloatArray
    solid: FloatArray


MOST_KEPT = 4
"""Tracks whose tables are kept."""
_kept: OrderedDict[tuple[int, ...], tuple[list[TrackTables], RailTables]] = OrderedDict()
_kept_lock = Lock()


def tables_of(track: Track, duration: float) -> RailTables:
    """Return the tables of a track for a duration, s. Those that were made last are kept."""
    made = [tables_for(track, way, duration) for way in ((ALIKE, AGAINST) if track.rolls else (ALIKE,))]
    key = tuple(id(one) for one in made)
    with _kept_lock:
        if key in _kept:
            _kept.move_to_end(key)
            return _kept[key][1]
    tables = _made_tables(track, made)
    if sum(part.nbytes for one in made for part in one.modal) > KEPT_BYTES:
        return tables
    with _kept_lock:
        _kept[key] = made, tables  # with what they were made of, so that nothing else gets its identity
        while len(_kept) > MOST_KEPT:
            _kept.popitem(last=False)
    return tables


def _made_tables(track: Track, made: list[TrackTables]) -> RailTables:
    """Return the tables of a track from those of its ways."""
    transform, compliance = gauss_nodes(track.method.nodes).transform, track.units.length / track.units.force
    held = [without_bodies(one, track.method) for one in made]
    cross = [compliance * (transform @ one.cross @ transform.T) for one in held]  # (place, other, places, m, l)
    residual = compliance * np.mean([one.residual for one in held], axis=0)
    answers = np.hstack([_in_fours(one.transpose(2, 1, 4, 0, 3), track, 3, 1) for one in cross])
    solid = np.empty_like(answers)
    answers_at_nodes(packed_nodes(track.method.nodes), track.fours, answers, solid)
    return RailTables(
        made[ALIKE].grid, tuple(one.modal for one in made), held[ALIKE].sets, held[ALIKE].phase, held[ALIKE].bay,
        _in_fours(residual.transpose(1, 0, 2), track, 1),
        answers, solid,
    )  # fmt: skip


def tables_for(track: Track, way: int, duration: float) -> TrackTables:
    """Return what the general march makes of one way of a track to move, for a duration, s.

    Both ways have the same macro steps, those of the faster one.
    """
    method = track.method._replace(step=min(longest_step(ring, track.method) for ring in track.rings))
    return track_tables(system_of(track, way), method, track.units, duration)


def fours_of(wheelsets: int) -> int:
    """Return how many fours of wheelsets there are."""
    return -(-wheelsets // HALF)


def _in_fours(table: FloatArray, track: Track, *axes: int) -> FloatArray:
    """Return a table in fours, from (places, …, wheelsets and sleepers, nodes, …) at each axis; then flat."""
    for axis in axes:
        shape = (*table.shape[:axis], track.fours * HALF, *table.shape[axis + 1 :])
        padded = np.zeros(shape)
        np.moveaxis(padded, axis, 0)[track.entries] = np.moveaxis(table, axis, 0)
        split = padded.reshape(*padded.shape[:axis], -1, HALF, *padded.shape[axis + 1 :])
        table = np.moveaxis(split, axis + 1, axis + 2)
    return np.ascontiguousarray(table).reshape(len(table), -1)


def system_of(track: Track, way: int) -> System:
    """Return the track, moving in one way, below weightless contacts: the general march makes tables for it."""
    none = np.zeros((0, 0))
    law = Law(0, np.zeros(0))
    contacts = tuple(Contact(none, law, float(place)) for place in track.places)
    contacts += tuple(Contact(none, law, port=port) for port in track.sleepers[way])
    weightless = Bodies(none, none, none, np.zeros((0, len(contacts))), np.zeros(0))
    return System(weightless, contacts, track.speed, track.rings[way])


@inlined_uncounted_kernel
def _bays_ahead(step: int, i: int, phases: int, bays: int, phase: IntArray, bay: IntArray) -> int:
    """Return how many bays a wheelset is ahead of the first one."""
    own = bay[i] + (phase[i] + step) // phases
    first = bay[BEGIN] + (phase[BEGIN] + step) // phases
    return (own - first) % bays


@uncounted_kernel
def show_wheel(i: int, step: int, reads: FloatArray, first: IntArray, turns: FloatArray, sets: IntArray, phase: IntArray, bay: IntArray, modes: FloatArray, spare: FloatArray, unit: float, sinking: FloatArray, free: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Write what one way of the rails to move shows a wheelset in a macro step: its entries of free, m downwards.

    That is (fours, nodes, HALF). `modes` is (2, modes), real and imaginary parts. What the wheels feel counts from
    `sinking`, (wheelsets,). Ways that are alike have the same rows: wheel by wheel these stay in the cache.
    """
    phases, own = reads.shape[1], free[i // HALF, :, i % HALF]
    for m in range(len(own)):
        own[m] = 0.0
    rows = reads[sets[i], (phase[i] + step) % phases]
    if i == 0:
        read_modes(rows, first, modes[RE], modes[IM], own)
    else:
        ahead = _bays_ahead(step, i, phases, len(turns), phase, bay)
        turned(turns[ahead], modes[RE], modes[IM], spare[RE], spare[IM])
        read_modes(rows, first, spare[RE], spare[IM], own)
    for m in range(len(own)):
        own[m] *= -unit
    own[BEGIN] -= sinking[i]


@uncounted_kernel
def take_wheel(i: int, step: int, writes: FloatArray, first: IntArray, turns: FloatArray, sets: IntArray, phase: IntArray, bay: IntArray, moments: FloatArray, modes: FloatArray, spare: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Add to the modes of one way what a wheelset did in a macro step: moments, as `free`, in units of the tables."""
    phases, own = writes.shape[1], moments[i // HALF, :, i % HALF]
    rows = writes[sets[i], (phase[i] + step) % phases]
    if i == 0:
        write_modes(rows, first, own, modes[RE], modes[IM])
        return
    ahead = _bays_ahead(step, i, phases, len(turns), phase, bay)
    for part in range(2):
        for n in range(spare.shape[1]):
            spare[part, n] = 0.0
    write_modes(rows, first, own, spare[RE], spare[IM])
    add_turned_back(turns[ahead], spare[RE], spare[IM], modes[RE], modes[IM])


@uncounted_kernel
def show_sleeper(i: int, length_of: int, first_four: int, reads: FloatArray, first: IntArray, modes: FloatArray, unit: float, free: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Do as `show_wheel` for a sleeper over a void, in a macro step of one of the lengths; seen from where it is."""
    own = free[first_four + i // HALF, :, i % HALF]
    for m in range(len(own)):
        own[m] = 0.0
    read_modes(reads[i, length_of], first, modes[RE], modes[IM], own)
    for m in range(len(own)):
        own[m] *= -unit


@uncounted_kernel
def take_sleeper(i: int, length_of: int, first_four: int, writes: FloatArray, first: IntArray, moments: FloatArray, modes: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Do as `take_wheel` for a sleeper over a void."""
    own = moments[first_four + i // HALF, :, i % HALF]
    write_modes(writes[i, length_of], first, own, modes[RE], modes[IM])


@uncounted_kernel
def pass_bay(step: int, phases: int, turns: FloatArray, phase: IntArray, modes: FloatArray) -> None:
    """Turn the modes of one way where the first wheelset comes to the next bay at a macro step's end."""
    if (phase[BEGIN] + step + 1) % phases == 0:
        turn(turns[1 % len(turns)], modes[RE], modes[IM])
