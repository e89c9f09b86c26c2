"""The marcher: one wheel on a stiff rail or on a deck, from event to event.

phase CONTACT   step in s from (u, w, Y, Z); ends at the tolerance, at a breakpoint, or where u = 0 (loss)
phase FLIGHT    step in t from (y, v, Y, Z); ends at a breakpoint or at the first touch (impact)
phase RELEASED  still indented, but Hunt-Crossley's force would pull: a loss as any other, until it would push again
                (an impact); where the indentation ends before that, the flight goes on as FLIGHT
phase BONDED    bilateral contact: linear, no events

until the end:
series of the step -> its end and what ends it -> the force's extremes before that end -> row of the step
go to the end; at a loss or an impact change phase, at a breakpoint go to the next piece and carry
displacement and velocity over it (the indentation takes the path's jump, its rate the path's kink)
"""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march import telling
from wheeltapper.march.events import (
    GRAZE,
    cross_break,
    follow,
    follow_inside,
    follow_on,
    follow_to_break,
    force,
    forget,
    is_free,
    leave_grazing,
    log_event,
    log_step,
    next_piece,
    piece_end,
    place,
    take_contact,
)
from wheeltapper.march.flight import bonded_series, flight_series
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.layout import (
    CLEAR,
    COUNT,
    EVENTS,
    FLIGHT_ORDER,
    IDLE,
    MARK,
    OPENED,
    PEAKS,
    SCRATCH,
    SEEN,
    STATE,
    TREND,
    UNTIL_IMPACT,
    UNTIL_LOSS,
    N,
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
    ENOUGH,
    EVENT_COLUMNS,
    FLIGHT,
    FULL,
    IMPACT,
    LENGTH,
    LOSS,
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
    STRICT_ORDER,
    TIME,
    TOO_MANY_EVENTS,
    A,
    B,
    FloatArray,
    Program,
)
from wheeltapper.march.roots import evaluate
from wheeltapper.march.series import localise, path_at
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
    trend_series,
)


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
def _contact_step(numbers: FloatArray, strict: bool | None, until: float, steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray) -> int:  # fmt: skip
    """Step in contact until something ends a step other than its length; return what."""
    order = int(numbers[contract.ORDER])
    follow_on(force(numbers, 0.0, S[STATE + A], S[STATE + B], S), peaks, S)
    length, t, u, w, turns = contact_advance(numbers, strict, until, steps.shape[0] - 1, steps, S)
    length, what, after, u, w = contact_end(numbers, order, until - S[STATE + TIME], length, t, u, w, turns, S)
    trend, degree = trend_series(numbers, order, S)
    conclude(numbers, until, length, after, u, w, what, trend, degree, turns, steps, events, peaks, S)
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
def flight_step(numbers: FloatArray, until: float, landed: bool, steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray) -> int:  # fmt: skip
    """Make one step in flight, released or bonded; return what ended it. `landed`: this flight begins at δ = 0."""
    time = S[STATE + TIME]
    released = S[STATE + PHASE] == RELEASED
    on_deck = S[STATE + ON_DECK] != 0.0
    bonded = numbers[contract.BILATERAL] != 0.0
    y, v, deck_y, deck_v = S[STATE + A], S[STATE + B], S[STATE + DECK_Y], S[STATE + DECK_V]
    if bonded:
        bonded_series(numbers, FLIGHT_ORDER, y, v, deck_y, deck_v, on_deck, S)
    else:
        flight_series(numbers, FLIGHT_ORDER, y, v, deck_y, deck_v, on_deck, S)
    if landed:
        S[CLEAR] = 0.0
    length, what = flight_end(numbers, released, until - time, S)
    follow_on(S[N] if bonded else 0.0, peaks, S)
    if bonded:
        for k in range(FLIGHT_ORDER):
            S[TREND + k] = (k + 1) * S[N + k + 1]
        follow_inside(numbers, time, FLIGHT_ORDER, TREND, FLIGHT_ORDER - 1, length, True, peaks, S)
    if what == BREAK:
        follow_to_break(until, evaluate(S, N, FLIGHT_ORDER, length) if bonded else 0.0, peaks, S)
    log_step(length, steps, S)
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
def rest(numbers: FloatArray, S: FloatArray) -> None:
    """Go on from a contact without indentation and without rate."""
    height, velocity, _ = path_at(0.0, S)
    if S[STATE + ON_DECK] != 0.0:
        height += S[STATE + DECK_Y]
        velocity += S[STATE + DECK_V]
    leave_grazing(numbers, height, velocity - S[STATE + B], S)
    S[COUNT + OPENED] = 1.0 if S[STATE + PHASE] == FLIGHT else 0.0


@kernel
def advance_kernel(pieces: FloatArray, numbers: FloatArray, steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray, strict: bool | None) -> int:  # fmt: skip
    """Make the next step (in plain contacts all up to the next event), over a breakpoint at its end.

    Return RUNNING, or why the march stops. `strict`: True for a march of order STRICT_ORDER, None for one of
    DEFAULT_ORDER; each is compiled when first used.
    """
    if (
        S[COUNT] + 1 > steps.shape[0]
        or S[COUNT + EVENTS] + 4 > events.shape[0]
        or S[COUNT + PEAKS] + 8 > peaks.shape[0]
    ):
        return FULL
    if S[COUNT + SEEN] != 0.0:
        if is_free(S[STATE + PHASE]):
            follow_on(0.0, peaks, S)
        return ENOUGH
    if S[COUNT + EVENTS] >= numbers[contract.EVENT_LIMIT]:
        return TOO_MANY_EVENTS
    time = S[STATE + TIME]
    until = next_break(pieces, numbers, S)
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    if S[STATE + PHASE] == CONTACT and S[STATE + A] == 0.0 and abs(S[STATE + B]) < GRAZE:
        rest(numbers, S)
        return RUNNING
    if S[STATE + PHASE] == CONTACT:
        what = _contact_step(numbers, strict, until, steps, events, peaks, S)
    else:
        what = flight_step(numbers, until, S[COUNT + OPENED] != 0.0, steps, events, peaks, S)
    S[COUNT + OPENED] = 1.0 if what == OPENS else 0.0
    if is_bad(S[STATE + TIME] + S[STATE + A] + S[STATE + B] + S[STATE + DECK_Y] + S[STATE + DECK_V]):
        return NOT_FINITE
    S[COUNT + IDLE] = S[COUNT + IDLE] + 1.0 if S[STATE + TIME] <= time else 0.0
    if S[COUNT + IDLE] > 1000:
        return STALLED
    if what == BREAK:
        if S[STATE + TIME] >= numbers[contract.END]:
            return DONE
        localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
        return cross_break(pieces, numbers, events, S)
    return RUNNING


@kernel
def march_kernel(pieces: FloatArray, numbers: FloatArray, steps: FloatArray, events: FloatArray, peaks: FloatArray, S: FloatArray, strict: bool | None) -> int:  # fmt: skip
    """March from `state` until the end, or until a table is full; return why it stopped. May be called again."""
    status = RUNNING
    while status == RUNNING:
        status = advance_kernel(pieces, numbers, steps, events, peaks, S, strict)
    return status


@kernel
def start_kernel(pieces: FloatArray, numbers: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Set the state at time zero from the start's displacement and velocity."""
    forget(S)
    S[STATE : STATE + LENGTH] = 0.0
    S[STATE + SHIFT] = numbers[contract.START_SHIFT]
    S[COUNT : COUNT + IDLE + 1] = 0.0
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
    """What a march leaves: its status, tables of steps, events and peaks in scaled units, and the last state."""

    status: int
    steps: FloatArray  # (steps, STEP_COLUMNS), where the damper has an end of its own (steps, ENDED_COLUMNS)
    events: FloatArray  # (events, EVENT_COLUMNS)
    peaks: FloatArray  # (peaks, PEAK_COLUMNS)
    state: FloatArray  # the last one, as a row of steps without a length


def grown(table: FloatArray, used: float) -> FloatArray:
    """Return the table, twice as long where it is three quarters full."""
    if used < 0.75 * len(table) and used + 16 < len(table):
        return table
    larger = np.empty((2 * len(table), table.shape[1]))
    larger[: len(table)] = table
    return larger


def tables() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return room for a first few thousand steps, their events and peaks, and the scratch array."""
    return (
        np.empty((8192, STEP_COLUMNS)), np.empty((256, EVENT_COLUMNS)), np.empty((256, PEAK_COLUMNS)),
        np.zeros(SCRATCH),
    )  # fmt: skip


def tabled(status: int, steps: FloatArray, events: FloatArray, peaks: FloatArray, work: FloatArray) -> March:
    """Return what a march has written."""
    used = work[COUNT : COUNT + 3].astype(int)
    state = work[STATE : STATE + steps.shape[1]].copy()
    return March(status, steps[: used[0]], events[: used[1]], peaks[: used[2]], state)


def _arguments(program: Program) -> tuple[Any, ...]:
    """Return the arguments of the kernel at the start of a march."""
    strict = True if program.numbers[contract.ORDER] == STRICT_ORDER else None
    return program.pieces, program.numbers, *tables(), strict


def is_ready(program: Program) -> bool:
    """Return False where marching this program begins with compiling its kernel."""
    return is_compiled(march_kernel, _arguments(program))


def march(program: Program, tell: telling.Tell = telling.untold) -> March:
    """March a program whose contact is elastic from its start to its end."""
    pieces, numbers, steps, events, peaks, work, strict = _arguments(program)
    start_kernel(pieces, numbers, events, work)
    while True:
        room = steps[: int(work[COUNT]) + telling.CHUNK]
        status = march_kernel(pieces, numbers, room, events, peaks, work, strict)
        if status != FULL or tell(work[STATE + TIME]):
            return tabled(status, steps, events, peaks, work)
        used = work[COUNT : COUNT + 3].astype(int)
        steps, events, peaks = grown(steps, used[0]), grown(events, used[1]), grown(peaks, used[2])
