"""The march of a vehicle with many bodies: steps of DOP853 in time, started anew at every event.

until the end:
    step to the next breakpoint at most; again with a shorter one while its error is too large
    an event in it?   a contact opens or closes, also twice within the step; an element reaches a corner of its curve
        make the step again, up to the event; go on from there to where the indentation is zero
    a maximum of a normal force in it?  log it
    at a breakpoint or an event: switch what changes, and start anew
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.common.kernel import kernel, shared_kernel
from wheeltapper.march.common.program import FULL, NOT_FINITE, SOFT, STALLED, TOO_MANY_EVENTS, FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import passing, searching, sliders, sliding
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.contact_laws import is_lossy, is_plastic
from wheeltapper.march.wagon.crossing import Span
from wheeltapper.march.wagon.growths import find_growths
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.rail_motion import catch_up
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.remembering import Laying, WagonMemory, change_paths, log_first_yields
from wheeltapper.march.wagon.stepping import FIRST_STAGE, dense_step, make_step
from wheeltapper.march.wagon.unrolled_dop853 import DENSE_STAGES, POWERS, STAGES, error
from wheeltapper.march.wagon.wheel_rows import DELTA_RATE, GRIP, GRIP_RATE, OCTET_ROWS, ROW_DELTA, ROW_U, STRETCH

BEYOND = 1.02
"""Ratio of the length of a shortened step to the time of a contact's change. A step that would go far beyond the change
ends just behind it, because the force has a kink there."""
SHORTEST_TO_EVENT = 4e-16
"""Shortest step to an event, over the time: it ends later than it begins."""
SAFETY, SHRINK, GROW, DOP853_ORDER = 0.9, 0.2, 5.0, 8


class Work(NamedTuple):
    """Arrays to which the march of one vehicle writes."""

    w: FloatArray  # (states,): the state
    wheels: FloatArray  # (octets, ROWS): the contacts
    pieces: FloatArray  # (elements,): the present pieces of the nonlinear elements
    steps: FloatArray  # (rows, STEP_ELEMENTS + elements)
    states: FloatArray  # (rows, states): those at the steps' starts
    events: FloatArray  # (rows, 4)
    peaks: FloatArray  # (rows, 4)
    K: FloatArray  # (DENSE_STAGES, states): the stages' rates
    F: FloatArray  # (POWERS, states): the dense solution
    Q: FloatArray  # (bodies·LANES,): forces on the bodies
    kept: FloatArray  # (KEPT, lanes): the contacts at a step's start
    S: FloatArray  # (CARRIED,)


@kernel
def _is_off(data: FloatArray, wheels: FloatArray) -> bool:
    """Return True if a wheel is off its rail."""
    for o in range(int(data[asm.TREADS])):
        for i in range(LANES):
            if abs(wheels[o, ROW_U + i]) > data[asm.LARGEST_SHIFT]:
                return True
    return False


@kernel
def _is_finite(w: FloatArray) -> bool:
    """Return False where a state is lost."""
    return bool(np.all(np.abs(w) < 1e12))


@shared_kernel
def march_kernel(
    data: FloatArray, plan: IntArray, scales: FloatArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray,
    steps: FloatArray, states: FloatArray, events: FloatArray, peaks: FloatArray, K: FloatArray, F: FloatArray,
    Q: FloatArray, kept: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """March until the end, or until a table is full; return why it stopped. May be called again.

    The arguments after `scales` are the fields of `Work`.
    """
    n = w.shape[0]
    y, spare, P = np.empty(n), np.empty(n), np.ones(DENSE_STAGES)
    tolerance, end = data[asm.STEP_TOLERANCE], data[asm.RUN_END]
    lanes = kept.shape[1]
    lossy, plastic = is_lossy(data), is_plastic(data)
    elements, treads = pieces.shape[0], int(data[asm.TREADS])
    while True:
        t = S[passing.RUN_TIME]
        if t >= end:
            return contract.DONE
        missing = max(
            S[passing.RUN_EVENTS] + 2.0 * lanes - len(events), S[passing.RUN_PEAKS] + 2.0 * lanes - len(peaks)
        )  # fmt: skip
        if max(missing, S[passing.RUN_STEPS] + 2.0 - len(steps)) > 0.0:
            return FULL
        if S[passing.RUN_EVENTS] >= data[asm.MOST_EVENTS]:
            return TOO_MANY_EVENTS
        if passing.enable_flanges(data, wheels):
            S[passing.ANEW] = 1.0
        if S[passing.ANEW] != 0.0:
            if plan[asm.RIGID_FROM] < pieces.shape[0]:
                sliding.settle_rigid(t, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE])
            rates(t, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE], True)
            S[passing.RATES_USED] += 1.0
            S[passing.ANEW] = 0.0
            if lossy:
                find_growths(t, data, plan, w, K[FIRST_STAGE], wheels)
        searching.keep_contacts(wheels, kept)
        # -- a step whose error is small enough
        until = passing.next_break(data, t, wheels)
        h = min(S[passing.NEXT_LENGTH], data[asm.LONGEST_STEP])
        h = min(h, BEYOND * searching.time_to_change(BEYOND * h, data, wheels, K[FIRST_STAGE]))
        if lossy:
            h = min(h, BEYOND * searching.time_to_release(BEYOND * h, wheels))
        if plastic:
            h = min(h, BEYOND * searching.time_to_border(BEYOND * h, data, wheels, K[FIRST_STAGE]))
        growth = GROW
        while True:
            stops = t + 1.01 * h >= until
            if stops:
                h = until - t
            sliders.forget_uses(data, plan, pieces)
            make_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P)
            S[passing.RATES_USED] += STAGES - 1.0
            wrong = error(h, P, K, scales) / tolerance
            if wrong <= 1.0:
                break
            h *= max(SAFETY * wrong ** (-1.0 / DOP853_ORDER), SHRINK) if wrong < np.inf else SHRINK
            growth = 1.0
            if h < 1e-14 * max(t, 1e-3):
                return STALLED if _is_finite(w) else NOT_FINITE
        if not stops or growth == 1.0:
            S[passing.NEXT_LENGTH] = h * min(max(SAFETY * max(wrong, 1e-12) ** (-1.0 / DOP853_ORDER), SHRINK), growth)
        rates(t + h, data, plan, y, wheels, pieces, Q, K[STAGES], True)
        S[passing.RATES_USED] += 1.0
        if lossy:
            find_growths(t + h, data, plan, y, K[STAGES], wheels)
        # -- the first event in it
        contact, element, passed, row_of_event = -1, -1, -1, ROW_DELTA
        is_dense = searching.mark_changes(h, data, plan, y, wheels, pieces, kept)
        if searching.mark_corners(h, data, plan, w, y, K[FIRST_STAGE], K[STAGES], pieces):
            is_dense = True
        if sliding.mark_sliders(h, data, plan, w, y, K[FIRST_STAGE], K[STAGES], pieces):
            is_dense = True
        if is_dense:
            dense_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P, F, spare)
            S[passing.RATES_USED] += DENSE_STAGES - STAGES - 1.0
            span = Span(t, h, data, plan, w, F, spare, wheels, pieces, Q, K[DENSE_STAGES - 1])
            at, contact, element, passed, row_of_event = searching.first_event(y, pieces, kept, span)
            if at <= 1.0:
                stops = False
                h = max(h * at, SHORTEST_TO_EVENT * t)
                make_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P)
                rates(t + h, data, plan, y, wheels, pieces, Q, K[STAGES], True)
                S[passing.RATES_USED] += STAGES
                if lossy:
                    find_growths(t + h, data, plan, y, K[STAGES], wheels)
                is_dense = False
            else:
                contact_forces(t + h, data, plan, y, wheels)
        # -- the maxima of normal forces in it
        if searching.mark_maxima(h, contact if row_of_event == ROW_DELTA else -1, lossy, wheels, kept):
            if not is_dense:
                dense_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P, F, spare)
                S[passing.RATES_USED] += DENSE_STAGES - STAGES - 1.0
            searching.log_maxima(
                kept, Span(t, h, data, plan, w, F, spare, wheels, pieces, Q, K[DENSE_STAGES - 1]), peaks, S
            )
            contact_forces(t + h, data, plan, y, wheels)
        # -- keep it
        row = int(S[passing.RUN_STEPS])
        S[passing.RUN_STEPS] += 1.0
        steps[row, asm.STEP_TIME] = t
        steps[row, asm.STEP_CLOSED] = passing.closed_contacts(wheels)
        steps[row, asm.STEP_ELEMENTS : asm.STEP_ELEMENTS + elements] = pieces
        if plastic:
            for o in range(treads):
                for i in range(LANES):
                    steps[row, asm.STEP_ELEMENTS + elements + o * LANES + i] = wheels[o, STRETCH + i]
        states[row] = w
        now = until if stops else t + h
        if contact >= 0:  # the rest of the way to δ = 0, along the tangent, or to where the force would pull
            place = contact % LANES
            value, pace = row_of_event + place, DELTA_RATE + place
            if row_of_event != ROW_DELTA:
                pace = place + (wheel.TO_UPPER_RATE if row_of_event == wheel.TO_UPPER else wheel.TO_LOWER_RATE)
            near = wheels[contact // LANES, value]
            if lossy and data[asm.STATIC_INDENTATION] * wheels[contact // LANES, GRIP + place] < near:
                value, pace = GRIP + place, GRIP_RATE + place
            rest = -wheels[contact // LANES, value] / wheels[contact // LANES, pace]
            if abs(rest) < 0.01 * h:
                now += rest
                for i in range(n):
                    y[i] += rest * K[STAGES, i]
                contact_forces(now, data, plan, y, wheels)
            wheels[contact // LANES, value] = 0.0
        if element >= plan[asm.LAWS]:
            opens = passed == sliding.MARK_OPENS
            now += sliding.change_sliders(element, opens, h, data, plan, y, K[STAGES], pieces)
        steps[row, asm.STEP_LENGTH] = now - t
        S[passing.RUN_IDLE] = S[passing.RUN_IDLE] + 1.0 if now - t <= 2.0 * SHORTEST_TO_EVENT * t else 0.0
        if S[passing.RUN_IDLE] > 100.0:
            return STALLED
        S[passing.RUN_TIME] = now
        w[:] = y
        K[FIRST_STAGE] = K[STAGES]
        # -- go on
        if contact >= 0:
            if lossy:
                catch_up(data, plan, w, wheels)
            passing.switch_contacts(now, data, wheels, events, S)
            if plastic:
                passing.switch_stretches(now, data, wheels, events, S)
            S[passing.ANEW] = 1.0
        if element >= 0:
            if element < plan[asm.LAWS]:
                pieces[element] = passed - 1.0 if passed == pieces[element] else passed
            S[passing.ANEW] = 1.0
        if stops and now < end:
            searching.keep_contacts(wheels, kept)
            hardest = passing.pass_breaks(now, data, plan, wheels)
            contact_forces(now, data, plan, w, wheels)
            if hardest != SOFT:
                if lossy:
                    catch_up(data, plan, w, wheels)
                passing.switch_contacts(now, data, wheels, events, S)
                contact_forces(now, data, plan, w, wheels)  # a contact that a jump has closed presses at once
                if plastic and passing.switch_stretches(now, data, wheels, events, S):
                    contact_forces(now, data, plan, w, wheels)
                S[passing.ANEW] = 1.0
            if lossy:  # the rate of the force jumps even where the path has no kink
                rates(now, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE], True)
                find_growths(now, data, plan, w, K[FIRST_STAGE], wheels)
            if hardest != SOFT or lossy:
                searching.log_corners(now, data[asm.PULSE], 1.0, wheels, kept, peaks, S)
        if S[passing.ANEW] != 0.0:
            S[passing.NEXT_LENGTH] = passing.FIRST_STEP * data[asm.PULSE]
        if _is_off(data, wheels):
            return asm.DERAILED


@kernel
def probe_kernel(
    data: FloatArray, plan: IntArray, start: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray,
    states: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Write the rates of states at time zero, (many, states), with all contacts that overlap closed."""
    w = np.empty_like(start)
    S = np.empty(passing.RUN_CARRIED)
    passing.start_kernel(data, plan, start, w, wheels, pieces, S)
    for row in range(states.shape[0]):
        passing.press_at_rest(0.0, data, plan, states[row], wheels)
        rates(0.0, data, plan, states[row], wheels, pieces, Q, out[row], True)


class RailLog(NamedTuple):
    """What a march on rails that give way needs to be repeated, by macro steps, flat as in `rail_motion`.

    Attributes
    ----------
    ends
        Of the macro steps while a bay is passed, from 0 on, s.
    free
        d of each macro step, (steps, …).
    local, answers
        r and B, (places in a bay, ...).
    """

    ends: FloatArray
    free: FloatArray
    local: FloatArray
    answers: FloatArray


RIGID: RailLog = RailLog(np.zeros(2), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0)))
"""That of a march on a stiff track."""


class MultibodyMarch(NamedTuple):
    """Results of a march: steps with the states at their starts, events, peaks, the end, and the status."""

    assembly: asm.Assembly
    """What was marched; where wheels leave marks for others, on the paths as they were in the end."""
    status: int
    steps: FloatArray  # (steps, 3 + elements)
    states: FloatArray  # (steps, states)
    events: FloatArray  # (events, 4)
    peaks: FloatArray  # (peaks, 4)
    end: float
    state: FloatArray  # (states,)
    evaluations: int
    """Number of computations of the rates."""
    rails: RailLog = RIGID
    seat_events: FloatArray = np.zeros((0, 4))
    """Events of voids: a loss where one opens."""


def work_for(A: asm.Assembly, rows: int = 1024) -> Work:
    """Return room for the first steps."""
    n, octets, elements = len(A.start), len(A.kinds), len(A.element_inside)
    columns = asm.STEP_ELEMENTS + elements + A.stretch_columns
    return Work(
        np.zeros(n), np.zeros((octets, OCTET_ROWS)), np.zeros(elements), np.zeros((rows, columns)),
        np.empty((rows, n)), np.empty((rows, 4)), np.empty((rows, 4)), np.zeros((DENSE_STAGES, n)),
        np.zeros((POWERS, n)), np.zeros(len(A.loads)), np.zeros((searching.KEPT, octets * LANES)),
        np.zeros(passing.RUN_CARRIED),
    )  # fmt: skip


def start_rates(A: asm.Assembly, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rates of states at time zero, (many, states), with all contacts that overlap closed.

    Also the contacts (octets, ROWS) in the last state.
    """
    work, out = work_for(A, 1), np.empty_like(states)
    probe_kernel(
        *asm.flattened_assembly(A), A.start, work.wheels, work.pieces, work.Q, np.ascontiguousarray(states), out
    )
    return out, work.wheels


def march(
    A: asm.Assembly, tell: telling.Tell = telling.report_nothing, memory: WagonMemory | None = None
) -> MultibodyMarch:  # fmt: skip
    """March a vehicle from its start to its end; with a memory wheels meet the marks of those before them."""
    flat, work, laying = asm.flattened_assembly(A), work_for(A), Laying(memory, A)
    passing.start_kernel(*flat, A.start, work.w, work.wheels, work.pieces, work.S)
    log_first_yields(work)
    while True:
        flat.data[asm.RUN_END] = laying.until
        room = work.steps[: int(work.S[passing.RUN_STEPS]) + telling.WAGON_CHUNK]
        status = march_kernel(*flat, A.scales, *work._replace(steps=room))
        if laying.goes_on(status):
            flat = laying.lay(found_so_far(status, work, laying.assembly), flat)
            change_paths(*flat, work.w, work.wheels, work.events, work.peaks, work.kept, work.S)
        elif status != FULL or tell(float(work.S[passing.RUN_TIME])):
            return found_so_far(status, work, laying.assembly)
        work = grown_work(work)


def found_so_far(status: int, work: Work, A: asm.Assembly) -> MultibodyMarch:
    """Return what a march has found so far."""
    steps, events, peaks = work.S[[passing.RUN_STEPS, passing.RUN_EVENTS, passing.RUN_PEAKS]].astype(int)
    return MultibodyMarch(
        A, status, work.steps[:steps], work.states[:steps], work.events[:events], work.peaks[:peaks],
        float(work.S[passing.RUN_TIME]), work.w, int(work.S[passing.RATES_USED]),
    )  # fmt: skip


def grown_work(work: Work) -> Work:
    """Return room for more, where it runs short."""
    steps, events, peaks = work.S[[passing.RUN_STEPS, passing.RUN_EVENTS, passing.RUN_PEAKS]].astype(int)
    lanes = work.kept.shape[1]
    return work._replace(
        steps=telling.grown_table(work.steps, steps), states=telling.grown_table(work.states, steps),
        events=telling.grown_table(work.events, events, 3 * lanes),
        peaks=telling.grown_table(work.peaks, peaks, 3 * lanes),
    )  # fmt: skip
