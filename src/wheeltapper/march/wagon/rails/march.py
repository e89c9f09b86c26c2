"""The march of a vehicle with many bodies on two rails that give way: macro steps of the rails, with events within.

Events never touch the rails' modes. Over a macro step the wheels know of the rails what `rail_motion` says; vehicle,
contacts and moments of the forces march as on a stiff track (`multibody`), with all events. Then

1. the modes take the moments;
2. they show each wheel its free motion over the next macro step;
3. the march begins anew. What a wheel sees jumps there by the error of the interpolation, some 1e-12 m: a contact that
   this opens or closes is opened or closed.

A macro step in which nothing happens is solved at once, if the method allows it (`whole_steps`). Between two such steps
only the modes have work to do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import telling
from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import DONE, EVENT_CONTACT, FULL, SOFT, FloatArray, IntArray
from wheeltapper.march.general.layout import IM, RE
from wheeltapper.march.general.modal import turn
from wheeltapper.march.general.structure import ComplexArray
from wheeltapper.march.general.tables import ModalTables, Units
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import maxima_followed, multibody, passing, searching, whole_steps
from wheeltapper.march.wagon.assembly import HALF, LANES, Assembly
from wheeltapper.march.wagon.contact_laws import is_lossy, is_plastic
from wheeltapper.march.wagon.growths import find_growths
from wheeltapper.march.wagon.multibody import MultibodyMarch, RailLog
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.rail_motion import begin_of_step, catch_up, enter_macro_step
from wheeltapper.march.wagon.rails import modes as rail_modes
from wheeltapper.march.wagon.rails.modes import AGAINST, ALIKE, RailTables, show_sleeper, show_wheel, take_wheel
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.remembering import Laying, WagonMemory, change_paths, log_first_yields
from wheeltapper.march.wagon.sliding import settle_rigid
from wheeltapper.march.wagon.stepping import FIRST_STAGE
from wheeltapper.march.wagon.wheel_rows import VOID_FLAG


class OnRails(NamedTuple):
    """A vehicle on two equal rails, on sleepers of their own or common ones.

    Attributes
    ----------
    assembly
        The vehicle; its `rails` hold the first macro step.
    track
        The rails.
    modes
        Amplitudes of each way to move at the start, as seen from the bay of the first wheelset: (modes,) complex.
    sinking
        Deflections at the start below each wheel, left and right, (2, wheelsets), m: from these on the wheels feel the
        rails.
    """

    assembly: Assembly
    track: rail_modes.Track
    modes: tuple[ComplexArray, ComplexArray]
    sinking: FloatArray


LEFT_RAIL, RIGHT_RAIL = range(2)
MADE, WAITS, PAUSE, FRESH = range(4)
"""Entries of `made`."""
LONGEST_PAUSE = 32
"""Most macro steps that are not tried at once after failures that follow each other."""
PEAKS_AT_ONCE = 8.0
"""Maxima of a force for which there is room in a macro step."""


class InBay(NamedTuple):
    """What the tracks' tables say of the places in a bay, as `RailTables` has it."""

    sets: IntArray
    phase: IntArray
    bay: IntArray
    local: FloatArray
    answers: FloatArray


class AtOnce(NamedTuple):
    """What macro steps that are solved at once need: answers at the Gauss nodes, the nodes, and forces followed."""

    solid: FloatArray
    gauss: FloatArray
    tracked: FloatArray


@kernel
def rails_kernel(
    end: float, ends: FloatArray, which: IntArray, same: ModalTables, modes: FloatArray,
    other: ModalTables, modes_2: FloatArray, places: InBay, sinking: FloatArray, units: Units,
    free: FloatArray, made: IntArray, flat: asm.FlatAssembly, scales: FloatArray, work: multibody.Work, whole: AtOnce,
) -> int:  # fmt: skip
    """March until `end`, or until a table is full; return why it stopped. May be called again.

    `free` is the log (macro steps, 2, fours, nodes, HALF). `made` counts its rows, the present one included; then come
    how many macro steps are not tried at once, how many after the next failure, and whether the contacts are those of
    the present state. `sinking` and the middle axis of `free` are of the rails together, and against one another, as
    the tables and modes.
    """
    reads, writes, first, decay, bays, fixed_reads, fixed_writes = same
    reads_2, writes_2, first_2, decay_2, bays_2, fixed_reads_2, fixed_writes_2 = other
    sets, phase, bay, local, answers = places
    length, force = units.length, units.force
    data, plan = flat
    w, wheels, pieces, steps, states, events, peaks, K, F, Q, kept, S = work
    solid, gauss, tracked = whole
    begin = int(data[plan[asm.AT_RAILS] + asm.RAIL_STATES])
    lanes = kept.shape[1]
    moments, spare, spare_2 = np.empty(free.shape[1:]), np.empty_like(modes), np.empty_like(modes_2)
    nodal = whole_steps.nodal_for(gauss, len(w), data, plan, wheels, pieces)
    may_be_whole = whole_steps.is_possible(data, plan)
    at, end_of_state = plan[asm.AT_RAILS], np.empty_like(w)
    fours = int(data[asm.TREADS])
    if made[FRESH] == 0 and S[passing.RUN_TIME] == data[at + asm.RAIL_BEGAN]:
        _meet_rails(S[passing.RUN_TIME], data, plan, w, wheels, events, S)
        made[FRESH] = 1
    while True:
        now, until = S[passing.RUN_TIME], begin_of_step(made[MADE], ends)
        row, at_once = int(S[passing.RUN_STEPS]), False
        data[asm.RUN_END] = min(end, until)
        if may_be_whole and now == data[at + asm.RAIL_BEGAN] and until <= end:
            if row + 2 > len(steps) or S[passing.RUN_PEAKS] + PEAKS_AT_ONCE * lanes > len(peaks):
                return FULL
            if made[WAITS] > 0:
                made[WAITS] -= 1
            else:
                passing.enable_flanges(data, wheels)
                if S[passing.ANEW] != 0.0 and plan[asm.RIGID_FROM] < len(pieces):
                    settle_rigid(now, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE])
                    made[FRESH] = 1
                if made[FRESH] != 0:
                    rates(now, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE], False)
                    S[passing.RATES_USED] += 1.0
                else:
                    K[FIRST_STAGE] = nodal.rates[-1]
                answer = solid[(made[MADE] - 1) % len(local)]
                turns = whole_steps.solve_whole(
                    now, answer, data, plan, scales, w, end_of_state, wheels, pieces, Q, K[FIRST_STAGE], nodal
                )
                at_once = turns > 0
                S[passing.RATES_USED] += max(turns - 1, 0) * len(nodal.places)
                if at_once:
                    made[PAUSE] = 1
                else:
                    made[WAITS] = made[PAUSE]
                    made[PAUSE] = min(2 * made[PAUSE], LONGEST_PAUSE)
        if at_once:
            steps[row, asm.STEP_TIME], steps[row, asm.STEP_LENGTH] = now, until - now
            steps[row, asm.STEP_CLOSED] = passing.closed_contacts(wheels) + 2.0**lanes
            steps[row, asm.STEP_ELEMENTS : asm.STEP_ELEMENTS + len(pieces)] = pieces
            states[row] = w
            maxima_followed.follow_forces(now, until - now, wheels, data, plan, tracked, peaks, S, nodal)
            w[:] = end_of_state
            S[passing.RUN_STEPS] += 1.0
            S[passing.RUN_TIME] = until
            made[FRESH] = 0
            if until >= end:
                contact_forces(until, data, plan, w, wheels)
                maxima_followed.end_following(until, wheels, tracked, peaks, S)
                return DONE
        else:
            if made[FRESH] == 0 and now < until:
                _meet_rails(now, data, plan, w, wheels, events, S)
                made[FRESH] = 1
            maxima_followed.end_following(now, wheels, tracked, peaks, S)
            status = multibody.march_kernel(
                data, plan, scales, w, wheels, pieces, steps, states, events, peaks, K, F, Q, kept, S
            )  # fmt: skip
            if status != DONE or S[passing.RUN_TIME] >= end:
                return status
            if now < until:
                made[FRESH] = 1
        missing = max(S[passing.RUN_EVENTS] + 2.0 * lanes - len(events), S[passing.RUN_PEAKS] + lanes - len(peaks))
        if missing > 0.0 or made[MADE] == len(free):
            return FULL
        now, step = S[passing.RUN_TIME], made[MADE]
        data[asm.RUN_END] = end
        goes_on = False
        if at_once:
            hardest = passing.pass_breaks(np.nextafter(now, 0.0), data, plan, wheels)
            goes_on = hardest == SOFT and passing.next_break(data, now, wheels) > now
        if made[FRESH] == 0 and not goes_on:
            contact_forces(now, data, plan, w, wheels)
        # -- the rails
        of_rails = w[begin : begin + moments.size].reshape(moments.shape)
        moments[ALIKE] = (of_rails[LEFT_RAIL] + of_rails[RIGHT_RAIL]) * (0.5 / force)
        moments[AGAINST] = (of_rails[LEFT_RAIL] - of_rails[RIGHT_RAIL]) * (0.5 / force)
        of_rails[:] = 0.0
        before = step - 1
        length_of = which[before % len(which)]
        turn(decay[length_of], modes[RE], modes[IM])
        turn(decay_2[length_of], modes_2[RE], modes_2[IM])
        for i in range(len(sets)):
            take_wheel(i, before, writes, first, bays, sets, phase, bay, moments[ALIKE], modes, spare)
            take_wheel(i, before, writes_2, first_2, bays_2, sets, phase, bay, moments[AGAINST], modes_2, spare_2)
        for i in range(len(fixed_writes)):
            rail_modes.take_sleeper(i, length_of, fours, fixed_writes, first, moments[ALIKE], modes)
            rail_modes.take_sleeper(i, length_of, fours, fixed_writes_2, first_2, moments[AGAINST], modes_2)
        rail_modes.pass_bay(before, writes.shape[1], bays, phase, modes)
        rail_modes.pass_bay(before, writes_2.shape[1], bays_2, phase, modes_2)
        shown, shown_2 = free[step, ALIKE], free[step, AGAINST]
        for i in range(len(sets)):
            show_wheel(
                i, step, reads, first, bays, sets, phase, bay, modes, spare, length, sinking[ALIKE], shown
            )  # fmt: skip
            show_wheel(
                i, step, reads_2, first_2, bays_2, sets, phase, bay, modes_2, spare_2, length, sinking[AGAINST], shown_2
            )  # fmt: skip
        length_of = which[step % len(which)]
        for i in range(len(fixed_reads)):
            show_sleeper(i, length_of, fours, fixed_reads, first, modes, length, shown)
            show_sleeper(i, length_of, fours, fixed_reads_2, first_2, modes_2, length, shown_2)
        place = step % len(local)
        enter_macro_step(step, ends, free[step].reshape(-1), local[place], answers[place], data, plan)
        made[MADE] += 1
        # -- go on
        if goes_on:
            continue
        maxima_followed.end_following(now, wheels, tracked, peaks, S)
        searching.keep_contacts(wheels, kept)
        hardest = passing.pass_breaks(now, data, plan, wheels)
        _meet_rails(now, data, plan, w, wheels, events, S)
        made[FRESH] = 1
        if is_lossy(data):
            rates(now, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE], True)
            find_growths(now, data, plan, w, K[FIRST_STAGE], wheels)
        corner = 1.0 if hardest != SOFT else 0.0
        searching.log_corners(now, data[asm.PULSE], corner, wheels, kept, peaks, S)
        if hardest != SOFT:
            S[passing.NEXT_LENGTH] = passing.FIRST_STEP * data[asm.PULSE]


@kernel
def _meet_rails(
    now: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, events: FloatArray,
    S: FloatArray,
) -> None:  # fmt: skip
    """Compute what presses on the rails that a macro step begins with, and open and close what that changes."""
    contact_forces(now, data, plan, w, wheels)
    if is_lossy(data):
        catch_up(data, plan, w, wheels)
    passing.switch_contacts(now, data, wheels, events, S)
    contact_forces(now, data, plan, w, wheels)
    if is_plastic(data) and passing.switch_stretches(now, data, wheels, events, S):
        contact_forces(now, data, plan, w, wheels)
    S[passing.ANEW] = 1.0


MACRO_STEPS = 4096
"""Macro steps for which there is room at first."""


def march(
    task: OnRails, tell: telling.Tell = telling.report_nothing, memory: WagonMemory | None = None
) -> MultibodyMarch:  # fmt: skip
    """March a vehicle on rails from its start to its end; with a memory wheels meet the marks of those before them."""
    A = task.assembly
    end = float(A.numbers[asm.RUN_END])
    tables = rail_modes.tables_of(task.track, end)
    flat, work = asm.flattened_assembly(A), multibody.work_for(A)
    made = np.array([1, 0, 1, 1])
    modes, free = first_macro_step(task, tables)
    grid = tables.grid
    enter_macro_step(0, grid.ends, free[0].ravel(), tables.local[0], tables.answers[0], *flat)
    scales = _with_moments(A, tables)
    passing.start_kernel(*flat, A.start, work.w, work.wheels, work.pieces, work.S)
    log_first_yields(work)
    one, other = tables.ways[ALIKE], tables.ways[-1]
    in_bay = InBay(tables.sets, tables.phase, tables.bay, tables.local, tables.answers)
    laying = Laying(memory, A, grid)
    tracked = np.zeros((maxima_followed.TRACKED, work.kept.shape[1]))
    whole = AtOnce(tables.solid, whole_steps.packed_nodes(task.track.method.nodes), tracked)
    while True:
        room = work.steps[: int(work.S[passing.RUN_STEPS]) + telling.WAGON_CHUNK]
        status = rails_kernel(
            laying.until, grid.ends, grid.which, one, modes[ALIKE], other, modes[AGAINST], in_bay,
            ways_of(task.sinking), task.track.units, free, made, flat, scales, work._replace(steps=room), whole,
        )  # fmt: skip
        if laying.goes_on(status):
            flat = laying.lay(_found_so_far(status, work, laying.assembly, tables, free[: made[MADE]]), flat)
            change_paths(*flat, work.w, work.wheels, work.events, work.peaks, work.kept, work.S)
        elif status != FULL or tell(float(work.S[passing.RUN_TIME])):
            return _found_so_far(status, work, laying.assembly, tables, free[: made[MADE]])
        work = multibody.grown_work(work)
        free = telling.grown_table(free, float(made[MADE]), 1.0)


def _found_so_far(
    status: int, work: multibody.Work, A: Assembly, tables: RailTables, free: FloatArray
) -> MultibodyMarch:
    """Return what a march has found so far, with the log of its macro steps."""
    log = RailLog(tables.grid.ends, free.reshape(len(free), -1), tables.local, tables.answers)
    found = multibody.found_so_far(status, work, A)
    wheel_lanes = LANES * int((work.wheels[:, VOID_FLAG] == 0.0).sum())
    of_wheels = found.events[:, EVENT_CONTACT] < wheel_lanes
    return found._replace(events=found.events[of_wheels], seat_events=found.events[~of_wheels], rails=log)


def _with_moments(A: Assembly, tables: RailTables) -> FloatArray:
    """Return the reciprocal error scales of all states; a moment's is that of the deflection that it makes.

    That of an indentation's rate, where it is a state, is that of the force that it makes.
    """
    begin = int(A.rails[asm.RAIL_STATES])
    one = int(A.rails[asm.RAIL_FOURS] * A.rails[asm.RAIL_NODES]) * HALF
    late = len(A.scales) - begin - 2 * one
    largest = np.abs(tables.answers).max(axis=0).reshape(-1, one, one).max(axis=(0, 2))
    most = largest / A.numbers[asm.STATIC_INDENTATION]
    return np.concatenate([A.scales[:begin], most, most, np.full(late, A.numbers[asm.MATERIAL_LOSS])])


def ways_of(rails: FloatArray) -> FloatArray:
    """Return how both rails move together, and against one another, from the left and the right one: (2, …)."""
    return np.stack([rails[LEFT_RAIL] + rails[RIGHT_RAIL], rails[LEFT_RAIL] - rails[RIGHT_RAIL]]) * 0.5


def first_macro_step(task: OnRails, tables: RailTables) -> tuple[list[FloatArray], FloatArray]:
    """Return the modes of each way at the start, (2, modes), and the log of what they show, with its first row."""
    free = np.zeros((MACRO_STEPS, 2, task.track.fours, len(tables.ways[ALIKE].first), HALF))
    sinking, out = ways_of(task.sinking), []
    for way, (ring, amplitudes) in enumerate(zip(task.track.rings, task.modes, strict=True)):
        held = amplitudes[np.argsort(np.abs(ring.rates), kind="stable")]
        modes, its = np.stack([held.real, held.imag]), tables.ways[way % len(tables.ways)]
        for i in range(len(tables.sets)):
            show_wheel(
                i, 0, its.reads, its.first, its.turns, tables.sets, tables.phase, tables.bay, modes,
                np.empty_like(modes), task.track.units.length, sinking[way], free[0, way],
            )  # fmt: skip
        for i in range(task.track.over_voids):
            show_sleeper(
                i, tables.grid.which[0], rail_modes.fours_of(len(tables.sets)), its.fixed_reads, its.first, modes,
                task.track.units.length, free[0, way],
            )  # fmt: skip
        out.append(modes)
    return out, free
