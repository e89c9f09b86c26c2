"""The march of one wheel on a stiff rail or on a deck, from event to event.

phase CONTACT       step in s from (u, w, Y, Z); ends at the tolerance, at a breakpoint, or where u = 0 (loss)
phase YIELDING + k  the same, but on piece k of a plastic law (yielding.py)
phase FLIGHT        step in t from (y, v, Y, Z); ends at a breakpoint or at the first touch (impact)
phase RELEASED      still indented, but Hunt-Crossley's force would pull: a loss as any other, until it would push again
                    (an impact); where the indentation ends before that, the flight goes on as FLIGHT
phase BONDED        bilateral contact: linear, no events

until the end:
series of the step -> its end and what ends it -> the force's extremes before that end -> row of the step
go to the end; at a loss or an impact change phase, at a breakpoint go to the next piece and carry
displacement and velocity over it (the indentation takes the path's jump, its rate the path's kink)

`law` is None where the contact does not yield, `damper` and `stops` are None where the wheel holds the damper's end,
`strict` is None for the default order. Numba compiles each combination that is used, without the branches of the others.
"""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march import telling
from wheeltapper.march.damper_hold import damper_pull, held_contact_reach, held_flight_reach, start_end, stretch
from wheeltapper.march.events import (
    AT_BREAK,
    GRAZE,
    LEAP,
    cross_break,
    follow,
    follow_inside,
    follow_on,
    follow_to_break,
    force,
    forget,
    free_acceleration,
    is_free,
    log_event,
    log_step,
    next_piece,
    piece_end,
    place,
    take_contact,
    touches,
)
from wheeltapper.march.flight import bonded_series, flight_series
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.layout import (
    CLEAR,
    COUNT,
    EVENTS,
    FLIGHT_ORDER,
    HERE_LAW_TERMS,
    IDLE,
    MARK,
    OPENED,
    PEAKS,
    PIECES,
    SCRATCH,
    SEEN,
    STATE,
    STEPS,
    STOPS,
    TREND,
    UNTIL_IMPACT,
    UNTIL_LOSS,
    N,
    T,
    U,
    W,
    Y,
    Z,
)
from wheeltapper.march.program import (
    CONTACT,
    DECK_V,
    DECK_Y,
    DONE,
    END_DEFLECTION,
    ENDED_COLUMNS,
    ENOUGH,
    EVENT_COLUMNS,
    FLIGHT,
    FULL,
    IMPACT,
    LENGTH,
    LOSS,
    NO_STOPS,
    NOT_FINITE,
    ON_DECK,
    PEAK_COLUMNS,
    PHASE,
    PIECE,
    RELEASED,
    RUNNING,
    SHIFT,
    STALLED,
    STEP_COLUMNS,
    STOP_COLUMNS,
    STRICT_ORDER,
    TIME,
    TOO_MANY_EVENTS,
    YIELDING,
    A,
    B,
    FloatArray,
    Program,
)
from wheeltapper.march.roots import evaluate
from wheeltapper.march.series import NO_PIECE, enter_law, localise, localise_marks, path_at
from wheeltapper.march.step import (
    BREAK,
    GRIPS,
    NOTHING,
    OPENS,
    RELEASES,
    contact_advance,
    contact_end,
    flight_end,
    is_bad,
    may_turn,
    trend_series,
)
from wheeltapper.march.yielding import change_law, choose_law, yielding_reach


@kernel
def conclude(numbers: FloatArray, until: float, length: float, after: float, u: float, w: float, what: int, trend: int, degree: int, turns: bool, steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray) -> None:  # fmt: skip
    """Log the contact step whose series are in S, and go to its end; row `trend` has the sign of the force's rate."""
    order = int(numbers[contract.ORDER])
    time = S[STATE + TIME]
    if turns or trend != W:
        follow_inside(numbers, time, order, trend, degree, length, False, peaks, S)
    log_step(length, steps, S)
    y = 0.0
    z = 0.0
    if numbers[contract.DECK_MASS] > 0.0:
        y = evaluate(S, Y, order, length)
        z = evaluate(S, Z, order, length)
    S[STATE + TIME] = until if what == BREAK else time + after
    S[STATE + DECK_Y] = y
    S[STATE + DECK_V] = z
    S[STATE + A] = u
    S[STATE + B] = w
    if what == BREAK:
        follow_to_break(until, force(numbers, after, u, w, S), peaks, S)
        S[STATE + A] = max(u, 0.0)
    elif what == OPENS or what == RELEASES:
        height, velocity, _ = path_at(after, S)
        if S[STATE + ON_DECK] != 0.0:
            height += y
            velocity += z
        if what == OPENS:
            u = 0.0
        follow(S[STATE + TIME], 0.0, 0.0, peaks, S[MARK:], S[COUNT:])
        log_event(S[STATE + TIME], LOSS, w, 0.0, events, S[COUNT:])
        S[STATE + PHASE] = FLIGHT if what == OPENS else RELEASED
        S[STATE + A] = height - u * u
        S[STATE + B] = velocity - w


@kernel
def _contact_step(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, damper: FloatArray | None, until: float,
    steps: FloatArray, events: FloatArray, peaks: FloatArray, stops: FloatArray | None, S: FloatArray,
    strict: bool | None,
) -> int:  # fmt: skip
    """Step in contact until something ends a step other than its length; return what."""
    order = int(numbers[contract.ORDER])
    bounded = False
    ends, follows = NOTHING, NO_PIECE
    if law is not None:
        choose_law(numbers, law, events, S)
    follow_on(force(numbers, 0.0, S[STATE + A], S[STATE + B], S), peaks, S)
    if law is not None:
        length, ends, follows = yielding_reach(numbers, law, S)
    if damper is not None and stops is not None:
        length, bounded = held_contact_reach(numbers, damper, stops, S)
    if law is None and damper is None:
        length, t, u, w, turns = contact_advance(numbers, strict, until, steps.shape[0] - 1, steps, S)
    else:
        t, u, w = evaluate(S, T, order, length), evaluate(S, U, order, length), evaluate(S, W, order, length)
        turns = may_turn(order, length, w, S)
    if law is not None and numbers[contract.MEMORY] != 0.0 and S[HERE_LAW_TERMS] != 0.0:
        turns = False  # such a step ends where the rate is zero
    length, what, after, u, w = contact_end(numbers, order, until - S[STATE + TIME], length, t, u, w, turns, S)
    trend, degree = trend_series(numbers, order, S)
    conclude(numbers, until, length, after, u, w, what, trend, degree, turns, steps, events, peaks, S)
    if damper is not None:
        stretch(damper, order, length, S)
        if what == NOTHING and bounded and numbers[contract.HYSTERESIS] != 0.0:
            S[MARK + AT_BREAK] = 1.0  # the force's own rate may jump with the damper's force
    if law is not None and what == NOTHING and ends != NOTHING:
        change_law(pieces, numbers, law, ends, follows, length, after, events, peaks, S)
        return ends
    return what


@kernel
def arrive(numbers: FloatArray, what: int, length: float, events: FloatArray, S: FloatArray) -> None:
    """Enter the phase behind a step without contact force that ended in an event after `length`."""
    if what == OPENS:  # the loss was where the force ended, before the indentation
        S[STATE + PHASE] = FLIGHT
        return
    height, velocity, _ = path_at(length, S)
    if S[STATE + ON_DECK] != 0.0:
        height += S[STATE + DECK_Y]
        velocity += S[STATE + DECK_V]
    rate = velocity - S[STATE + B]
    if what == GRIPS:
        rate = -1.0 / numbers[contract.HYSTERESIS]
        S[STATE + PHASE] = CONTACT
        S[STATE + A] = sqrt(max(height - S[STATE + A], 0.0))
        S[STATE + B] = rate
    else:
        take_contact(numbers, 0.0, rate, S)
    log_event(S[STATE + TIME], IMPACT, rate, 0.0, events, S[COUNT:])


@kernel
def _flight_step(
    numbers: FloatArray, damper: FloatArray | None, until: float, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, stops: FloatArray | None, S: FloatArray,
) -> int:  # fmt: skip
    """Make one step in flight, released or bonded; return what ended it."""
    time = S[STATE + TIME]
    reach = until - time
    released = S[STATE + PHASE] == RELEASED
    on_deck = S[STATE + ON_DECK] != 0.0
    bonded = numbers[contract.BILATERAL] != 0.0
    y, v, deck_y, deck_v = S[STATE + A], S[STATE + B], S[STATE + DECK_Y], S[STATE + DECK_V]
    if damper is not None and stops is not None:
        reach = held_flight_reach(numbers, damper, reach, stops, S)
    elif bonded:
        bonded_series(numbers, FLIGHT_ORDER, y, v, deck_y, deck_v, on_deck, S)
    else:
        flight_series(numbers, FLIGHT_ORDER, y, v, deck_y, deck_v, on_deck, S)
    if S[COUNT + OPENED] != 0.0:  # this flight begins where the indentation is zero
        S[CLEAR] = 0.0
    length, what = flight_end(numbers, released, reach, S)
    if damper is not None and what == BREAK and reach < until - time:
        what = NOTHING
    follow_on(S[N] if bonded else 0.0, peaks, S)
    if bonded:
        for k in range(FLIGHT_ORDER):
            S[TREND + k] = (k + 1) * S[N + k + 1]
        follow_inside(numbers, time, FLIGHT_ORDER, TREND, FLIGHT_ORDER - 1, length, True, peaks, S)
    if what == BREAK:
        follow_to_break(until, evaluate(S, N, FLIGHT_ORDER, length) if bonded else 0.0, peaks, S)
    log_step(length, steps, S)
    if damper is not None:
        stretch(damper, FLIGHT_ORDER, length, S)
    y = evaluate(S, U, FLIGHT_ORDER, length)
    v = evaluate(S, W, FLIGHT_ORDER, length)
    if numbers[contract.DECK_MASS] > 0.0:
        deck_y = evaluate(S, Y, FLIGHT_ORDER, length)
        deck_v = evaluate(S, Z, FLIGHT_ORDER, length)
    S[STATE + TIME] = until if what == BREAK else time + length
    S[STATE + DECK_Y] = deck_y
    S[STATE + DECK_V] = deck_v
    S[STATE + A] = y
    S[STATE + B] = v
    if what != NOTHING and what != BREAK:
        arrive(numbers, what, length, events, S)
    return what


@kernel
def next_break(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> float:
    """Return when the present piece, the wheel's way to or over the deck, or the march ends."""
    until = min(piece_end(pieces, numbers, S), numbers[contract.END])
    if numbers[contract.DECK_MASS] > 0.0:
        if S[STATE + TIME] < numbers[contract.DECK_FROM]:
            until = min(until, numbers[contract.DECK_FROM])
        elif S[STATE + TIME] < numbers[contract.DECK_TO]:
            until = min(until, numbers[contract.DECK_TO])
    return until


@kernel
def _rest(numbers: FloatArray, damper: FloatArray | None, S: FloatArray) -> None:
    """Leave the rest point u = w = 0 of the regularised system along the motion that it starts, if it starts one."""
    y, v, _ = path_at(0.0, S)
    if S[STATE + ON_DECK] != 0.0:
        y += S[STATE + DECK_Y]
        v += S[STATE + DECK_V]
    v -= S[STATE + B]
    a = free_acceleration(numbers, y, v, S)
    if damper is not None:
        a += damper_pull(damper, v, S)
    if a > 0.0:
        S[STATE + A] = LEAP
        S[STATE + B] = LEAP * sqrt(2.0 * a)
        S[STATE + TIME] += LEAP * sqrt(2.0 / a)
        S[COUNT + OPENED] = 0.0
    else:
        S[STATE + PHASE] = FLIGHT
        S[STATE + A] = y
        S[STATE + B] = v
        S[COUNT + OPENED] = 1.0


@kernel
def _cross_break(pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, events: FloatArray, S: FloatArray) -> int:  # fmt: skip
    """Go over the breakpoint(s) at the present time; a contact that yields goes on with its piece of the law."""
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
    if law is None:
        return cross_break(pieces, numbers, events, S)
    phase = S[STATE + PHASE]
    if phase >= YIELDING:
        S[STATE + PHASE] = CONTACT
    status = cross_break(pieces, numbers, events, S)
    if phase >= YIELDING and S[STATE + PHASE] == CONTACT:
        S[STATE + PHASE] = phase
    return status


@kernel
def advance_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, damper: FloatArray | None, steps: FloatArray,
    events: FloatArray, peaks: FloatArray, stops: FloatArray | None, S: FloatArray, strict: bool | None,
) -> int:  # fmt: skip
    """Make the next step (in plain contacts all up to the next event), over a breakpoint at its end.

    Return RUNNING, or why the march stops.
    """
    if (
        S[COUNT] + 1 > steps.shape[0]
        or S[COUNT + EVENTS] + 4 > events.shape[0]
        or S[COUNT + PEAKS] + 8 > peaks.shape[0]
    ):
        return FULL
    if law is not None and S[COUNT + PIECES] + 1 > pieces.shape[0]:
        return FULL
    if stops is not None and S[COUNT + STOPS] + 4 > stops.shape[0]:
        return FULL
    if S[COUNT + SEEN] != 0.0:
        if is_free(S[STATE + PHASE]):
            follow_on(0.0, peaks, S)
        return ENOUGH
    if S[COUNT + EVENTS] + S[COUNT + STOPS] >= numbers[contract.EVENT_LIMIT]:
        return TOO_MANY_EVENTS
    time = S[STATE + TIME]
    until = next_break(pieces, numbers, S)
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    if law is not None:
        localise_marks(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
        enter_law(NO_PIECE, law, S)
    in_contact = touches(S[STATE + PHASE])
    if in_contact and S[STATE + A] == 0.0 and abs(S[STATE + B]) < GRAZE:
        _rest(numbers, damper, S)
        return RUNNING
    if in_contact:
        what = _contact_step(pieces, numbers, law, damper, until, steps, events, peaks, stops, S, strict)
    else:
        what = _flight_step(numbers, damper, until, steps, events, peaks, stops, S)
    S[COUNT + OPENED] = 1.0 if what == OPENS else 0.0
    state = S[STATE + TIME] + S[STATE + A] + S[STATE + B] + S[STATE + DECK_Y] + S[STATE + DECK_V]
    if is_bad(state + S[STATE + END_DEFLECTION]):
        return NOT_FINITE
    S[COUNT + IDLE] = S[COUNT + IDLE] + 1.0 if S[STATE + TIME] <= time else 0.0
    if S[COUNT + IDLE] > 1000:
        return STALLED
    if what != BREAK:
        return RUNNING
    if S[STATE + TIME] >= numbers[contract.END]:
        return DONE
    return _cross_break(pieces, numbers, law, events, S)


@kernel
def march_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, damper: FloatArray | None, steps: FloatArray,
    events: FloatArray, peaks: FloatArray, stops: FloatArray | None, S: FloatArray, strict: bool | None,
) -> int:  # fmt: skip
    """March from the state in S until the end, or until a table is full; return why it stopped. May be called again."""
    status = RUNNING
    while status == RUNNING:
        status = advance_kernel(pieces, numbers, law, damper, steps, events, peaks, stops, S, strict)
    return status


@kernel
def start_kernel(pieces: FloatArray, numbers: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Set the state at time zero from the start's displacement and velocity."""
    forget(S)
    S[STATE : STATE + LENGTH] = 0.0
    S[STATE + SHIFT] = numbers[contract.START_SHIFT]
    S[COUNT : COUNT + STOPS + 1] = 0.0
    S[COUNT + UNTIL_IMPACT] = numbers[contract.LAST_IMPACT]
    S[COUNT + UNTIL_LOSS] = numbers[contract.LAST_LOSS]
    while piece_end(pieces, numbers, S) <= 0.0:
        if next_piece(pieces, numbers, S) < 0:
            break
    S[STATE + ON_DECK] = (
        1.0
        if numbers[contract.DECK_MASS] > 0.0 and numbers[contract.DECK_FROM] <= 0.0 < numbers[contract.DECK_TO]
        else 0.0
    )
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], 0.0, S)
    place(numbers, numbers[contract.START_HEIGHT], numbers[contract.START_VELOCITY], -1, 0.0, events, S)


class March(NamedTuple):
    """What a march leaves, in scaled units: tables, the last state, and the status."""

    status: int
    steps: FloatArray  # (steps, STEP_COLUMNS), where the damper has an end of its own (steps, ENDED_COLUMNS)
    events: FloatArray  # (events, EVENT_COLUMNS)
    peaks: FloatArray  # (peaks, PEAK_COLUMNS)
    state: FloatArray  # the last one, as a row of steps without a length
    stops: FloatArray  # (events of the damper's end, STOP_COLUMNS)
    pieces: FloatArray  # those of the program, and behind them what yielding contacts have left on a spot


class _Tables(NamedTuple):
    """What a march writes to."""

    steps: FloatArray
    events: FloatArray
    peaks: FloatArray
    stops: FloatArray | None
    pieces: FloatArray

    @staticmethod
    def of(program: Program) -> _Tables:
        """Return room for a first few thousand steps and their events; a spot that remembers adds pieces."""
        ended = len(program.damper) > 0
        pieces = program.pieces
        if program.numbers[contract.MEMORY] != 0.0:
            pieces = np.vstack([pieces, np.zeros((64, pieces.shape[1]))])
        return _Tables(
            np.empty((8192, ENDED_COLUMNS if ended else STEP_COLUMNS)), np.empty((256, EVENT_COLUMNS)),
            np.empty((256, PEAK_COLUMNS)), np.empty((256, STOP_COLUMNS)) if ended else None,
            pieces,
        )  # fmt: skip

    def larger(self, work: FloatArray) -> _Tables:
        """Return the tables, those twice as long that are three quarters full."""
        steps, events, peaks = (int(work[COUNT + count]) for count in (STEPS, EVENTS, PEAKS))
        stops = None if self.stops is None else _grown(self.stops, work[COUNT + STOPS])
        remembered = work[COUNT + PIECES]  # 0 without a spot that remembers: its path ends or loops at its last piece
        pieces = _grown(self.pieces, remembered) if remembered else self.pieces
        return _Tables(
            _grown(self.steps, steps), _grown(self.events, events), _grown(self.peaks, peaks), stops, pieces
        )  # fmt: skip


def _grown(table: FloatArray, used: float) -> FloatArray:
    if used < 0.75 * len(table) and used + 16 < len(table):
        return table
    larger = np.empty((2 * len(table), table.shape[1]))
    larger[: len(table)] = table
    return larger


def _arguments(program: Program, tables: _Tables, room: FloatArray, work: FloatArray) -> tuple[Any, ...]:
    strict = True if program.numbers[contract.ORDER] == STRICT_ORDER else None
    tables = tables._replace(steps=room)
    return tables.pieces, program.numbers, *program.law_and_damper, *tables[:-1], work, strict


def is_ready(program: Program) -> bool:
    """Return False where marching this program begins with compiling its kernel."""
    tables = _Tables.of(program)
    return is_compiled(march_kernel, _arguments(program, tables, tables.steps, np.zeros(SCRATCH)))


def march(program: Program, tell: telling.Tell = telling.untold) -> March:
    """March a program from its start to its end."""
    tables, work = _Tables.of(program), np.zeros(SCRATCH)
    start_kernel(program.pieces, program.numbers, tables.events, work)
    if program.numbers[contract.MEMORY] != 0.0:
        work[COUNT + PIECES] = len(program.pieces)
    if len(program.damper):
        start_end(program.numbers, program.damper, work)
    while True:
        room = tables.steps[: int(work[COUNT + STEPS]) + telling.CHUNK]
        status = march_kernel(*_arguments(program, tables, room, work))
        if status != FULL or tell(work[STATE + TIME]):
            break
        tables = tables.larger(work)
    steps, events, peaks, stops, pieces = (int(work[COUNT + count]) for count in (STEPS, EVENTS, PEAKS, STOPS, PIECES))
    state = work[STATE : STATE + tables.steps.shape[1]].copy()
    return March(
        status, tables.steps[:steps], tables.events[:events], tables.peaks[:peaks], state,
        NO_STOPS if tables.stops is None else tables.stops[:stops], tables.pieces[: max(pieces, len(program.pieces))],
    )  # fmt: skip
