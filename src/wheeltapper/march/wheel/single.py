"""The march of one wheel on a stiff rail or on a deck, from event to event.

The state says the phase of the motion, the time, two numbers A and B of the wheel's motion, the deck's motion, and the
piece of the path under the wheel. The phase tells what A and B are, in which variable a step is a series, and what may
end the step beside its length:

phase CONTACT       A = u, the root of the indentation, and B = w, its rate. Steps in s, a variable in which the motion
                    stays smooth where the indentation vanishes (series.py). Ends at a breakpoint of the path, or where
                    u = 0: a loss of contact.
phase YIELDING + k  The same, but the force is that of piece k of a plastic law (yielding.py).
phase FLIGHT        A = y, B = v: displacement and velocity. Steps in time. Ends at a breakpoint, or at the first touch:
                    an impact.
phase RELEASED      The wheel still indents the rail, but Hunt and Crossley's force would pull, so there is none. The
                    phase begins with a loss of contact, and ends with an impact where the force would push again. Where
                    the indentation ends first, the phase FLIGHT follows without an event.
phase BONDED        A bilateral contact: A = y, B = v. Steps in time. The motion is linear and has no events.

Until the end of the march:
1. Compute the series of the step, the step's length, and what ends it.
2. Log the maxima of the contact force that lie before that end, and the step.
3. Go to the end. At a loss or an impact change the phase. At a breakpoint go to the next piece of the path. Wheel and
   deck keep displacement and velocity: the indentation takes the jump of the path, its rate the kink.

Arrays of the kernels (columns in program.py): `pieces` holds the path, one piece a row; `numbers` all that is one number
for the whole march; `steps`, `events`, `peaks` and `stops` are tables that a march fills: a row for each step, each
loss or impact, each force maximum, each stop that the damper's end meets or leaves. `S` is scratch memory (layout.py):
the series of the present step, the state from STATE on, the counts of the tables from COUNT on.

`law` is None where the contact does not yield: Numba compiles both, and leaves out the branches of the other. Without
rows in `stops` none are kept.
"""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import DECK_V, DECK_Y, ON_DECK, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray
from wheeltapper.march.steps import layout, series
from wheeltapper.march.steps.held_end import damper_ends
from wheeltapper.march.steps.layout import COUNT, FLIGHT_ORDER, MARK, STATE, N, T, U, W, Y, Z
from wheeltapper.march.steps.series import NO_PIECE, enter_law, localise, localise_marks, path_at, rail_at
from wheeltapper.march.steps.steplength import BRIEFEST
from wheeltapper.march.steps.written import scratch_for
from wheeltapper.march.wheel import damper_hold, step
from wheeltapper.march.wheel import events as event
from wheeltapper.march.wheel.roots import evaluate
from wheeltapper.march.wheel.yielding import change_law, choose_law, yielding_reach


@uncounted_kernel
def finish_contact_step(numbers: FloatArray, until: float, length: float, after: float, u: float, w: float, what: int, whole: bool, turns: bool, steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray) -> None:  # fmt: skip
    """Log the contact step whose series are in S, and go to its end.

    `whole`: nothing cuts it; `turns`: the force may have extremes in it.
    """
    order = int(numbers[contract.ORDER])
    time = S[STATE + TIME]
    if turns:
        trend, degree = step.trend_series(numbers, order, S)
        event.follow_inside(numbers, time, order, trend, degree, length, False, peaks, S)
    event.log_step(length, steps, S)
    y = 0.0
    z = 0.0
    if numbers[contract.DECK_MASS] > 0.0:
        y = S[layout.NEXT_Y] if whole else evaluate(S, Y, order, length)
        z = S[layout.NEXT_Z] if whole else evaluate(S, Z, order, length)
    S[STATE + TIME] = until if what == step.BREAK else time + after
    S[STATE + DECK_Y] = y
    S[STATE + DECK_V] = z
    S[STATE + A] = u
    S[STATE + B] = w
    if what == step.BREAK:
        event.follow_to_break(until, event.force(numbers, after, u, w, S), peaks, S)
        S[STATE + A] = max(u, 0.0)
    elif what == step.OPENS or what == step.RELEASES:
        height, velocity, _ = path_at(after, S)
        if S[STATE + ON_DECK] != 0.0:
            height += y
            velocity += z
        if what == step.OPENS:
            u = 0.0
        event.follow_force(S[STATE + TIME], 0.0, 0.0, peaks, S[MARK:], S[COUNT:])
        event.log_event(S[STATE + TIME], contract.LOSS, w, 0.0, events, S[COUNT:])
        S[STATE + PHASE] = contract.FLIGHT if what == step.OPENS else contract.RELEASED
        S[STATE + A] = height - u * u
        S[STATE + B] = velocity - w


@uncounted_kernel
def _contact_step(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, until: float,
    steps: FloatArray, events: FloatArray, peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Step in contact until something ends a step other than its length; return what."""
    order = int(numbers[contract.ORDER])
    bounded = False
    ends, follows = step.NOTHING, NO_PIECE
    if law is not None:
        choose_law(numbers, law, events, S)
    event.follow_on(event.force(numbers, 0.0, S[STATE + A], S[STATE + B], S), peaks, S)
    if damper_ends(numbers):
        reach, length, t, u, w, turns, bounded = damper_hold.held_contact_reach(pieces, numbers, until, steps, stops, S)
    elif law is not None:
        reach, length, t, u, w, turns, ends, follows = yielding_reach(pieces, numbers, law, until, steps, S)
    else:
        length, t, u, w, turns = step.contact_advance(pieces, numbers, until, steps.shape[0] - 1, steps, S)
        reach = length
    if length < reach:
        t, u, w = evaluate(S, T, order, length), evaluate(S, U, order, length), evaluate(S, W, order, length)
    if law is not None and numbers[contract.MEMORY] != 0.0 and S[layout.HERE_LAW_TERMS] != 0.0:
        turns = False  # such a step ends where the rate is zero
    length, what, after, u, w = step.contact_end(numbers, order, until - S[STATE + TIME], length, t, u, w, turns, S)
    whole = length == reach
    finish_contact_step(numbers, until, length, after, u, w, what, whole, turns, steps, events, peaks, S)
    damper_hold.carry_end(numbers, order, length, whole, S)
    if what == step.NOTHING and bounded and numbers[contract.HYSTERESIS] != 0.0:
        S[MARK + event.AT_BREAK] = 1.0  # the force's own rate may jump with the damper's force
    if law is not None and what == step.NOTHING and ends != step.NOTHING:
        change_law(pieces, numbers, law, ends, follows, length, after, events, peaks, S)
        return ends
    return what


@uncounted_kernel
def enter_phase(numbers: FloatArray, what: int, length: float, events: FloatArray, S: FloatArray) -> None:
    """Enter the phase behind a step without contact force that ended in an event after `length`."""
    if what == step.OPENS:  # the loss was where the force ended, before the indentation
        S[STATE + PHASE] = contract.FLIGHT
        return
    height, velocity = rail_at(length, S[STATE:], S)
    rate = velocity - S[STATE + B]
    if what == step.GRIPS:
        rate = -1.0 / numbers[contract.HYSTERESIS]
        S[STATE + PHASE] = contract.CONTACT
        S[STATE + A] = sqrt(max(height - S[STATE + A], 0.0))
        S[STATE + B] = rate
    else:
        event.take_contact(numbers, 0.0, rate, S)
    event.log_event(S[STATE + TIME], contract.IMPACT, rate, 0.0, events, S[COUNT:])


@uncounted_kernel
def _flight_step(
    pieces: FloatArray, numbers: FloatArray, until: float, steps: FloatArray,
    events: FloatArray, peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make one step in flight, released or bonded; return what ended it."""
    time = S[STATE + TIME]
    reach = until - time
    released = S[STATE + PHASE] == contract.RELEASED
    bonded = numbers[contract.BILATERAL] != 0.0
    deck_y, deck_v = S[STATE + DECK_Y], S[STATE + DECK_V]
    if damper_ends(numbers):
        reach = damper_hold.held_flight_reach(pieces, numbers, reach, stops, S)
    else:
        step.free_series(pieces, numbers, S)
    if S[COUNT + layout.OPENED] != 0.0:  # this flight begins where the indentation is zero
        S[layout.CLEAR] = 0.0
    length, what = step.flight_end(numbers, released, reach, S)
    if damper_ends(numbers) and what == step.BREAK and reach < until - time:
        what = step.NOTHING
    event.follow_on(S[N] if bonded else 0.0, peaks, S)
    if bonded:
        for k in range(FLIGHT_ORDER):
            S[layout.TREND + k] = (k + 1) * S[N + k + 1]
        event.follow_inside(numbers, time, FLIGHT_ORDER, layout.TREND, FLIGHT_ORDER - 1, length, True, peaks, S)
    if what == step.BREAK:
        event.follow_to_break(until, evaluate(S, N, FLIGHT_ORDER, length) if bonded else 0.0, peaks, S)
    event.log_step(length, steps, S)
    damper_hold.carry_end(numbers, FLIGHT_ORDER, length, False, S)
    y = evaluate(S, U, FLIGHT_ORDER, length)
    v = evaluate(S, W, FLIGHT_ORDER, length)
    if numbers[contract.DECK_MASS] > 0.0:
        deck_y = evaluate(S, Y, FLIGHT_ORDER, length)
        deck_v = evaluate(S, Z, FLIGHT_ORDER, length)
    S[STATE + TIME] = until if what == step.BREAK else time + length
    S[STATE + DECK_Y] = deck_y
    S[STATE + DECK_V] = deck_v
    S[STATE + A] = y
    S[STATE + B] = v
    if what != step.NOTHING and what != step.BREAK:
        enter_phase(numbers, what, length, events, S)
    return what


@uncounted_kernel
def next_break(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> float:
    """Return when the present piece, the wheel's way to or over the deck, or the march ends."""
    until = min(event.piece_end(pieces, numbers, S), numbers[contract.END])
    if numbers[contract.DECK_MASS] > 0.0:
        if S[STATE + TIME] < numbers[contract.DECK_FROM]:
            until = min(until, numbers[contract.DECK_FROM])
        elif S[STATE + TIME] < numbers[contract.DECK_TO]:
            until = min(until, numbers[contract.DECK_TO])
    return until


@uncounted_kernel
def _leave_rest(numbers: FloatArray, S: FloatArray) -> None:
    """Leave the rest point u = w = 0 of the regularised system along the motion that it starts, if it starts one."""
    y, v = rail_at(0.0, S[STATE:], S)
    v -= S[STATE + B]
    a = event.free_acceleration(numbers, y, v, S) + damper_hold.damper_pull(numbers, v, S)
    if a > 0.0:
        after = event.LEAP * min(sqrt(2.0 / a), event.BRIEF)
        rise = series.deck_acceleration(numbers, S[STATE + DECK_Y], S[STATE + DECK_V], S[STATE + ON_DECK] != 0.0, 0.0)
        S[STATE + A] = sqrt(0.5 * a) * after
        S[STATE + B] = a * after
        S[STATE + DECK_Y] += (S[STATE + DECK_V] + 0.5 * rise * after) * after
        S[STATE + DECK_V] += rise * after
        S[STATE + contract.END_DEFLECTION] += damper_hold.bush_rate(numbers, v, S) * after
        S[STATE + TIME] += after
        S[COUNT + layout.OPENED] = 0.0
    else:
        S[STATE + PHASE] = contract.FLIGHT
        S[STATE + A] = y
        S[STATE + B] = v
        S[COUNT + layout.OPENED] = 1.0


@uncounted_kernel
def _cross_break(pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, events: FloatArray, S: FloatArray) -> int:  # fmt: skip
    """Go over the breakpoint(s) at the present time; a contact that yields goes on with its piece of the law."""
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
    if law is None:
        return event.cross_break(pieces, numbers, events, S)
    phase = S[STATE + PHASE]
    if phase >= contract.YIELDING:
        S[STATE + PHASE] = contract.CONTACT
    status = event.cross_break(pieces, numbers, events, S)
    if phase >= contract.YIELDING and S[STATE + PHASE] == contract.CONTACT:
        S[STATE + PHASE] = phase
    return status


@uncounted_kernel
def advance_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, steps: FloatArray,
    events: FloatArray, peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make the next step (in contact all up to one that may hold an event), over a breakpoint at its end.

    Return RUNNING, or why the march stops.
    """
    if (
        S[COUNT] + 1 > steps.shape[0]
        or S[COUNT + layout.EVENTS] + 4 > events.shape[0]
        or S[COUNT + layout.PEAKS] + 8 > peaks.shape[0]
    ):
        return contract.FULL
    if law is not None and S[COUNT + layout.PIECES] + 1 > pieces.shape[0]:
        return contract.FULL
    if 0 < stops.shape[0] < S[COUNT + layout.STOPS] + 4:
        return contract.FULL
    if S[COUNT + layout.SEEN] != 0.0:
        if event.is_free(S[STATE + PHASE]):
            event.follow_on(0.0, peaks, S)
        return contract.ENOUGH
    if S[COUNT + layout.EVENTS] + S[COUNT + layout.STOPS] >= numbers[contract.EVENT_LIMIT]:
        return contract.TOO_MANY_EVENTS
    time = S[STATE + TIME]
    until = next_break(pieces, numbers, S)
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    if law is not None:
        localise_marks(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
        enter_law(NO_PIECE, law, S)
    in_contact = event.is_contact_phase(S[STATE + PHASE])
    if in_contact and S[STATE + A] == 0.0 and abs(S[STATE + B]) < event.GRAZE:
        _leave_rest(numbers, S)
        return contract.RUNNING
    if in_contact:
        what = _contact_step(pieces, numbers, law, until, steps, events, peaks, stops, S)
    else:
        what = _flight_step(pieces, numbers, until, steps, events, peaks, stops, S)
    S[COUNT + layout.OPENED] = 1.0 if what == step.OPENS else 0.0
    state = S[STATE + TIME] + S[STATE + A] + S[STATE + B] + S[STATE + DECK_Y] + S[STATE + DECK_V]
    if step.is_bad(state + S[STATE + contract.END_DEFLECTION]):
        return contract.NOT_FINITE
    moved = S[STATE + TIME] - time > BRIEFEST * (1.0 + time)
    S[COUNT + layout.IDLE] = 0.0 if moved else S[COUNT + layout.IDLE] + 1.0
    if S[COUNT + layout.IDLE] > 1000:
        return contract.STALLED
    if what != step.BREAK:
        return contract.RUNNING
    if S[STATE + TIME] >= numbers[contract.END]:
        return contract.DONE
    return _cross_break(pieces, numbers, law, events, S)


@uncounted_kernel
def march_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, steps: FloatArray,
    events: FloatArray, peaks: FloatArray, stops: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """March from the state in S until the end, or until a table is full; return why it stopped. May be called again."""
    status = contract.RUNNING
    while status == contract.RUNNING:
        status = advance_kernel(pieces, numbers, law, steps, events, peaks, stops, S)
    return status


@uncounted_kernel
def start_from(pieces: FloatArray, numbers: FloatArray, y: float, v: float, deck_y: float, deck_v: float, events: FloatArray, S: FloatArray) -> None:  # fmt: skip
    """Set the state at time zero from displacement and velocity of the wheel and of the deck."""
    event.reset_force_trend(S)
    S[STATE : STATE + contract.ENDED_COLUMNS] = 0.0
    if damper_ends(numbers):
        damper_hold.start_end(numbers, y, S)
    S[STATE + SHIFT] = numbers[contract.START_SHIFT]
    S[STATE + DECK_Y] = deck_y
    S[STATE + DECK_V] = deck_v
    S[COUNT : COUNT + layout.STOPS + 1] = 0.0
    S[COUNT + layout.UNTIL_IMPACT] = numbers[contract.LAST_IMPACT]
    S[COUNT + layout.UNTIL_LOSS] = numbers[contract.LAST_LOSS]
    while event.piece_end(pieces, numbers, S) <= 0.0:
        if event.next_piece(pieces, numbers, S) < 0:
            break
    S[STATE + ON_DECK] = (
        1.0
        if numbers[contract.DECK_MASS] > 0.0 and numbers[contract.DECK_FROM] <= 0.0 < numbers[contract.DECK_TO]
        else 0.0
    )
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], 0.0, S)
    event.choose_phase(numbers, y, v, -1, 0.0, events, S)


@uncounted_kernel
def start_kernel(pieces: FloatArray, numbers: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Set the state at time zero from the start's displacement and velocity, on a deck at rest."""
    y, v = numbers[contract.START_HEIGHT], numbers[contract.START_VELOCITY]
    start_from(pieces, numbers, y, v, 0.0, 0.0, events, S)


class March(NamedTuple):
    """What a march leaves, in scaled units: tables, the last state, and the status."""

    status: int
    steps: FloatArray  # (steps, STEP_COLUMNS), where the damper has an end of its own (steps, ENDED_COLUMNS)
    events: FloatArray  # (events, EVENT_COLUMNS)
    peaks: FloatArray  # (peaks, PEAK_COLUMNS)
    state: FloatArray  # the last one, as a row of steps without a length
    stops: FloatArray  # (events of the damper's end, STOP_COLUMNS)
    pieces: FloatArray  # those of the program, and behind them what yielding contacts have left on a spot
    program: contract.Program


class _Tables(NamedTuple):
    """What a march writes to; USED are the counts of their rows, in the same order."""

    steps: FloatArray
    events: FloatArray
    peaks: FloatArray
    stops: FloatArray
    pieces: FloatArray

    @staticmethod
    def empty_tables(program: contract.Program) -> _Tables:
        """Return room for a first few thousand steps and their events; a spot that remembers adds pieces."""
        columns, stops, pieces = contract.STEP_COLUMNS, contract.NO_STOPS, program.pieces
        if program.damper_ends:
            columns, stops = contract.ENDED_COLUMNS, np.empty((256, contract.STOP_COLUMNS))
        if program.numbers[contract.MEMORY] != 0.0:
            pieces = np.vstack([pieces, np.zeros((64, pieces.shape[1]))])
        events, peaks = np.empty((256, contract.EVENT_COLUMNS)), np.empty((256, contract.PEAK_COLUMNS))
        return _Tables(np.empty((8192, columns)), events, peaks, stops, pieces)

    def larger(self, work: FloatArray) -> _Tables:
        """Return the tables, those twice as long that are three quarters full."""
        longer: Any = (
            telling.grown_table(table, rows) for table, rows in zip(self, work[COUNT + USED], strict=True)
        )  # fmt: skip
        return _Tables(*longer)


USED = np.array([layout.STEPS, layout.EVENTS, layout.PEAKS, layout.STOPS, layout.PIECES])
"""The last is zero without a spot that remembers: then the path ends, or loops, at its last piece."""


def _arguments(program: contract.Program, tables: _Tables, room: FloatArray, work: FloatArray) -> tuple[Any, ...]:
    tables = tables._replace(steps=room)
    return tables.pieces, program.numbers, program.law_or_none, *tables[:-1], work


def march(
    program: contract.Program, tell: telling.Tell = telling.report_nothing, motion: FloatArray | None = None
) -> March:
    """March a program to its end from its start, or from displacement and velocity of the wheel and of the deck."""
    tables, work = _Tables.empty_tables(program), scratch_for(program)
    if motion is None:
        start_kernel(program.pieces, program.numbers, tables.events, work)
    else:
        start_from(program.pieces, program.numbers, *motion, tables.events, work)
    if program.numbers[contract.MEMORY] != 0.0:
        work[COUNT + layout.PIECES] = len(program.pieces)
    while True:
        room = tables.steps[: int(work[COUNT + layout.STEPS]) + telling.CHUNK]
        status = march_kernel(*_arguments(program, tables, room, work))
        if status != contract.FULL or tell(work[STATE + TIME]):
            break
        tables = tables.larger(work)
    used = work[COUNT + USED].astype(int)
    steps, events, peaks, stops, pieces = (table[:rows] for table, rows in zip(tables, used, strict=True))
    state = work[STATE : STATE + tables.steps.shape[1]].copy()
    pieces = pieces if len(pieces) > len(program.pieces) else program.pieces
    return March(status, steps, events, peaks, state, stops, pieces, program)
