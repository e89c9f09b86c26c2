"""The marcher: one wheel on a stiff rail or on a deck, from event to event.

    phase CONTACT   step in s from (u, w, Y, Z); ends at the tolerance, at a breakpoint, or where u = 0 (loss)
    phase FLIGHT    step in t from (y, v, Y, Z); ends at a breakpoint or at the first touch (impact)
    phase RELEASED  still indented, but Hunt-Crossley's force would pull: no force until δ = 0 or it would push again
    phase BONDED    bilateral contact: linear, no events

    until the end:
        series of the step -> its end and what ends it -> force maxima before that end -> row of the step
        go to the end; at a loss or an impact change phase, at a breakpoint go to the next piece and carry
        displacement and velocity over it (the indentation takes the path's jump, its rate the path's kink)
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from wheeltapper.march import program as contract
from wheeltapper.march.program import (
    BONDED,
    CONTACT,
    DECK_V,
    DECK_Y,
    DONE,
    END_OF_PATH,
    EVENT_COLUMNS,
    FLIGHT,
    FULL,
    IMPACT,
    JUMP,
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
    SOFT,
    STALLED,
    STEP_COLUMNS,
    TIME,
    TOO_MANY_EVENTS,
    A,
    B,
    FloatArray,
    Program,
)
from wheeltapper.march.roots import NONE, evaluate, first_root
from wheeltapper.march.series import (
    CLEAR,
    FLIGHT_ORDER,
    LOCAL,
    ROWS,
    TREND,
    WIDTH,
    WORK,
    N,
    T,
    U,
    W,
    Z,
    contact_series,
    factor_at,
    flight_series,
    localise,
    path_at,
)
from wheeltapper.march.step import (
    BREAK,
    GRIPS,
    LANDS,
    NOTHING,
    OPENS,
    RELEASES,
    contact_end,
    flight_end,
    is_bad,
    series_end,
    trend_series,
)

GRAZE = 1e-9
LIFT = 1e-6
QUIET = 1e-13

# A corner of the force waiting for the other side of a breakpoint: flag, time, force, whether it was rising.
CORNER_SET, CORNER_TIME, CORNER_FORCE, CORNER_RISING = range(4)


@njit(cache=True, error_model="numpy")
def _force(program: Program, local: FloatArray, after: float, u: float, w: float) -> float:
    """Return the contact force at indentation u² and rate w."""
    factor, _ = factor_at(local, after)
    return max(factor * u * u * (program.quadratic + program.cubic * u) * (1.0 + program.hysteresis * w), 0.0)


@njit(cache=True, error_model="numpy")
def _log_event(time: float, kind: int, rate: float, cause: float, events: FloatArray, counts: FloatArray) -> None:
    row = int(counts[1])
    events[row, contract.EVENT_TIME] = time
    events[row, contract.EVENT_KIND] = kind
    events[row, contract.EVENT_RATE] = rate
    events[row, contract.EVENT_CAUSE] = cause
    counts[1] += 1


@njit(cache=True, error_model="numpy")
def _log_peak(time: float, force: float, corner: float, peaks: FloatArray, counts: FloatArray) -> None:
    row = int(counts[2])
    peaks[row, contract.PEAK_TIME] = time
    peaks[row, contract.PEAK_FORCE] = force
    peaks[row, contract.PEAK_CORNER] = corner
    counts[2] += 1


@njit(cache=True, error_model="numpy")
def _settle_corner(force: float, trend: float, corner: FloatArray, peaks: FloatArray, counts: FloatArray) -> None:
    """Decide, with the force and its trend behind a breakpoint, whether the force had a maximum there."""
    if corner[CORNER_SET] == 0.0:
        return
    corner[CORNER_SET] = 0.0
    before = corner[CORNER_FORCE]
    rising = corner[CORNER_RISING] > QUIET
    drop = before - force > 1e-12 * (1.0 + before)
    rise = force - before > 1e-12 * (1.0 + before)
    if (rising and (drop or (not rise and trend < -QUIET))) or (rise and trend < -QUIET):
        _log_peak(corner[CORNER_TIME], max(before, force), 1.0, peaks, counts)


@njit(cache=True, error_model="numpy")
def _log_maxima(
    program: Program, local: FloatArray, time: float, order: int, degree: int, length: float,
    S: FloatArray, peaks: FloatArray, counts: FloatArray,
) -> None:  # fmt: skip
    """Record every force maximum inside a contact step; TREND holds the sign of the force's rate."""
    start = 0.0
    while True:
        root = first_root(S[TREND], degree, start, length, -1.0, S[WORK])
        if root == NONE or counts[2] >= peaks.shape[0]:
            return
        after = evaluate(S[T], order, root)
        u = evaluate(S[U], order, root)
        w = evaluate(S[W], order, root)
        _log_peak(time + after, _force(program, local, after, u, w), 0.0, peaks, counts)
        start = root


@njit(cache=True, error_model="numpy")
def _next_piece(program: Program, state: FloatArray) -> int:
    """Enter the next piece of the table; return how it joins, or -1 at the table's end."""
    path = program.path
    piece = int(state[PIECE]) + 1
    if piece < len(path.centre):
        state[PIECE] = piece
        return int(path.join[piece])
    if path.loop >= len(path.centre):
        return -1
    state[SHIFT] += path.breaks[piece] - path.breaks[path.loop]
    state[PIECE] = path.loop
    return int(path.loop_join)


@njit(cache=True, error_model="numpy")
def _piece_end(program: Program, state: FloatArray) -> float:
    """Return the time at which the present piece ends."""
    end = program.path.breaks[int(state[PIECE]) + 1]
    if np.isinf(end) or program.pace == 0.0:
        return np.inf
    return (end + state[SHIFT]) / program.pace


@njit(cache=True, error_model="numpy")
def _take_contact(program: Program, state: FloatArray, delta: float, rate: float) -> None:
    """Enter contact with an indentation and its rate."""
    state[PHASE] = CONTACT
    state[A] = sqrt(max(delta, 0.0))
    state[B] = rate
    if program.hysteresis * rate < -1.0 and delta > 0.0:
        state[PHASE] = RELEASED


@njit(cache=True, error_model="numpy")
def _free_acceleration(program: Program, local: FloatArray, state: FloatArray, y: float, v: float) -> float:
    """Return δ'' without contact force."""
    _, _, a = path_at(local, 0.0)
    a += 1.0 + program.stiffness * y + program.damping * v
    if state[ON_DECK] != 0.0:
        a += (program.prestress - program.deck_stiffness * state[DECK_Y] - program.deck_damping * state[DECK_V]) / (
            program.deck_mass
        )
    return a


@njit(cache=True, error_model="numpy")
def _place(
    program: Program, local: FloatArray, state: FloatArray, y: float, v: float,
    was: int, cause: float, events: FloatArray, counts: FloatArray,
) -> None:  # fmt: skip
    """Choose the phase from displacement and velocity at a start or a breakpoint, and record a change of it."""
    height, velocity, _ = path_at(local, 0.0)
    if state[ON_DECK] != 0.0:
        height += state[DECK_Y]
        velocity += state[DECK_V]
    delta = height - y
    rate = velocity - v
    if program.bonded:
        state[PHASE] = BONDED
        state[A] = y
        state[B] = v
        return
    touching = delta > 0.0
    if delta == 0.0:
        touching = rate > 0.0 or (rate == 0.0 and _free_acceleration(program, local, state, y, v) > 0.0)
    if touching:
        _take_contact(program, state, delta, rate)
        if was == FLIGHT:
            _log_event(state[TIME], IMPACT, rate, cause, events, counts)
        if state[PHASE] == RELEASED:
            state[A] = y
            state[B] = v
    else:
        state[PHASE] = FLIGHT
        state[A] = y
        state[B] = v
        if was == CONTACT or was == RELEASED:
            _log_event(state[TIME], LOSS, rate, cause, events, counts)


@njit(cache=True, error_model="numpy")
def _leave_grazing(program: Program, local: FloatArray, state: FloatArray, y: float, v: float) -> None:
    """Leave the rest point u = w = 0 of the regularised system along the motion that it starts, if it starts one."""
    a = _free_acceleration(program, local, state, y, v)
    if state[A] == 0.0 and abs(state[B]) < GRAZE:
        if a > 0.0:
            state[A] = LIFT
            state[B] = LIFT * sqrt(2.0 * a)
            state[TIME] += LIFT * sqrt(2.0 / a)
        else:
            state[PHASE] = FLIGHT
            state[A] = y
            state[B] = v


@njit(cache=True, error_model="numpy")
def _cross_break(
    program: Program, local: FloatArray, state: FloatArray, events: FloatArray, counts: FloatArray
) -> int:
    """Go over the breakpoint(s) at the present time; `local` belongs to the piece behind, time zero is now."""
    time = state[TIME]
    phase = int(state[PHASE])
    height, velocity, _ = path_at(local, 0.0)
    if state[ON_DECK] != 0.0:
        height += state[DECK_Y]
        velocity += state[DECK_V]
    y = state[A]
    v = state[B]
    if phase == CONTACT:
        y = height - state[A] * state[A]
        v = velocity - state[B]
    hard = False
    jumped = False
    while _piece_end(program, state) <= time * (1.0 + 4e-16):
        join = _next_piece(program, state)
        if join < 0:
            return END_OF_PATH
        hard = hard or join != SOFT
        jumped = jumped or join == JUMP
    on_deck = program.deck_from <= time < program.deck_to
    if program.deck_mass > 0.0 and on_deck != (state[ON_DECK] != 0.0):
        state[ON_DECK] = 1.0 if on_deck else 0.0
        hard = True
        jumped = True
    localise(program, int(state[PIECE]), state[SHIFT], time, local)
    if not hard:
        return RUNNING
    if phase == CONTACT and not jumped:  # a kink: the indentation itself is kept to the last digit
        _, after, _ = path_at(local, 0.0)
        if state[ON_DECK] != 0.0:
            after += state[DECK_V]
        state[B] = after - v
        if program.hysteresis * state[B] < -1.0 and state[A] > 0.0:
            state[PHASE] = RELEASED
            state[A] = y
            state[B] = v
        return RUNNING
    _place(program, local, state, y, v, phase, 1.0, events, counts)
    return RUNNING


@njit(cache=True, error_model="numpy")
def _contact_step(
    program: Program, until: float, local: FloatArray, state: FloatArray, row: FloatArray,
    events: FloatArray, peaks: FloatArray, counts: FloatArray, corner: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make one step in contact; return what ended it."""
    order = program.order
    time = state[TIME]
    contact_series(program, order, local, state[A], state[B], state[DECK_Y], state[DECK_V], state[ON_DECK] != 0.0, S)
    length, what = contact_end(program, order, program.tolerance, until - time, local, S)
    degree = trend_series(program, order, local, S)
    _settle_corner(max(S[N, 0], 0.0), S[TREND, 0], corner, peaks, counts)
    _log_maxima(program, local, time, order, degree, length, S, peaks, counts)
    row[:LENGTH] = state[:LENGTH]
    row[LENGTH] = length
    rising = evaluate(S[TREND], degree, length)
    u, w, y, z = series_end(S, order, length)
    after = evaluate(S[T], order, length)
    state[TIME] = until if what == BREAK else time + after
    state[DECK_Y] = y
    state[DECK_V] = z
    state[A] = u
    state[B] = w
    if what == BREAK:
        corner[CORNER_SET] = 1.0
        corner[CORNER_TIME] = until
        corner[CORNER_FORCE] = _force(program, local, after, u, w)
        corner[CORNER_RISING] = rising
        state[A] = max(u, 0.0)
    elif what == OPENS or what == RELEASES:
        height, velocity, _ = path_at(local, after)
        if state[ON_DECK] != 0.0:
            height += y
            velocity += z
        if what == OPENS:
            _log_event(state[TIME], LOSS, w, 0.0, events, counts)
            u = 0.0
        state[PHASE] = FLIGHT if what == OPENS else RELEASED
        state[A] = height - u * u
        state[B] = velocity - w
    return what


@njit(cache=True, error_model="numpy")
def _bonded_maxima(
    program: Program, time: float, length: float, S: FloatArray, peaks: FloatArray, counts: FloatArray
) -> None:
    """Record the force maxima of a step in a bilateral contact."""
    for k in range(FLIGHT_ORDER):
        S[TREND, k] = (k + 1) * S[N, k + 1]
    start = 0.0
    while counts[2] < peaks.shape[0]:
        root = first_root(S[TREND], FLIGHT_ORDER - 1, start, length, -1.0, S[WORK])
        if root == NONE:
            return
        _log_peak(time + root, evaluate(S[N], FLIGHT_ORDER, root), 0.0, peaks, counts)
        start = root


@njit(cache=True, error_model="numpy")
def _flight_step(
    program: Program, until: float, landed: bool, local: FloatArray, state: FloatArray, row: FloatArray,
    events: FloatArray, peaks: FloatArray, counts: FloatArray, corner: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Make one step in flight, released or bonded; return what ended it. `landed`: this flight begins at δ = 0."""
    time = state[TIME]
    released = state[PHASE] == RELEASED
    on_deck = state[ON_DECK] != 0.0
    flight_series(program, FLIGHT_ORDER, local, state[A], state[B], state[DECK_Y], state[DECK_V], on_deck, S)
    if landed:
        S[CLEAR, 0] = 0.0
    length, what = flight_end(program, released, until - time, local, S)
    if program.bonded:
        _settle_corner(S[N, 0], S[N, 1], corner, peaks, counts)
        _bonded_maxima(program, time, length, S, peaks, counts)
        if what == BREAK:
            corner[CORNER_SET] = 1.0
            corner[CORNER_TIME] = until
            corner[CORNER_FORCE] = evaluate(S[N], FLIGHT_ORDER, length)
            corner[CORNER_RISING] = (evaluate(S[N], FLIGHT_ORDER, length) - evaluate(S[N], FLIGHT_ORDER, 0.999 * length))
    else:
        _settle_corner(0.0, 0.0, corner, peaks, counts)
    row[:LENGTH] = state[:LENGTH]
    row[LENGTH] = length
    y, v, deck_y, deck_v = series_end(S, FLIGHT_ORDER, length)
    state[TIME] = until if what == BREAK else time + length
    state[DECK_Y] = deck_y
    state[DECK_V] = deck_v
    state[A] = y
    state[B] = v
    if what == NOTHING or what == BREAK:
        return what
    height, velocity, _ = path_at(local, length)
    if on_deck:
        height += deck_y
        velocity += deck_v
    rate = velocity - v
    if what == OPENS:
        state[PHASE] = FLIGHT
        _log_event(state[TIME], LOSS, rate, 0.0, events, counts)
    elif what == GRIPS:
        _take_contact(program, state, height - y, -1.0 / program.hysteresis)
    else:
        _take_contact(program, state, 0.0, rate)
        _log_event(state[TIME], IMPACT, rate, 0.0, events, counts)
    return what


@njit(cache=True, error_model="numpy")
def march_kernel(
    program: Program, state: FloatArray, steps: FloatArray, events: FloatArray, peaks: FloatArray,
    counts: FloatArray, corner: FloatArray, local: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """March from `state` until the end, or until a table is full; return why it stopped. May be called again."""
    time = state[TIME]
    localise(program, int(state[PIECE]), state[SHIFT], time, local)
    opened = counts[3] != 0.0
    idle = 0
    while True:
        if counts[0] + 1 > steps.shape[0] or counts[1] + 4 > events.shape[0] or counts[2] + 8 > peaks.shape[0]:
            counts[3] = 1.0 if opened else 0.0
            return FULL
        if counts[1] >= program.event_limit:
            return TOO_MANY_EVENTS
        time = state[TIME]
        until = min(_piece_end(program, state), program.end)
        if program.deck_mass > 0.0:
            if time < program.deck_from:
                until = min(until, program.deck_from)
            elif time < program.deck_to:
                until = min(until, program.deck_to)
        localise(program, int(state[PIECE]), state[SHIFT], time, local)
        row = steps[int(counts[0])]
        if state[PHASE] == CONTACT and state[A] == 0.0 and abs(state[B]) < GRAZE:
            height, velocity, _ = path_at(local, 0.0)
            if state[ON_DECK] != 0.0:
                height += state[DECK_Y]
                velocity += state[DECK_V]
            _leave_grazing(program, local, state, height, velocity - state[B])
            opened = state[PHASE] == FLIGHT
            continue
        if state[PHASE] == CONTACT:
            what = _contact_step(program, until, local, state, row, events, peaks, counts, corner, S)
        else:
            what = _flight_step(program, until, opened, local, state, row, events, peaks, counts, corner, S)
        counts[0] += 1
        opened = what == OPENS
        if is_bad(state[TIME] + state[A] + state[B] + state[DECK_Y] + state[DECK_V]):
            return NOT_FINITE
        idle = idle + 1 if state[TIME] <= time else 0
        if idle > 1000:
            return STALLED
        if what == BREAK:
            if state[TIME] >= program.end:
                return DONE
            localise(program, int(state[PIECE]), state[SHIFT], state[TIME], local)
            status = _cross_break(program, local, state, events, counts)
            if status != RUNNING:
                return status


@njit(cache=True, error_model="numpy")
def start_kernel(
    program: Program, state: FloatArray, events: FloatArray, counts: FloatArray, local: FloatArray
) -> None:
    """Set the state at time zero from the start's displacement and velocity."""
    state[:] = 0.0
    while _piece_end(program, state) <= 0.0:
        if _next_piece(program, state) < 0:
            break
    state[ON_DECK] = 1.0 if program.deck_mass > 0.0 and program.deck_from <= 0.0 < program.deck_to else 0.0
    localise(program, int(state[PIECE]), state[SHIFT], 0.0, local)
    _place(program, local, state, program.start_height, program.start_velocity, -1, 0.0, events, counts)


class March(NamedTuple):
    """What a march leaves: tables of steps, events and peaks in scaled units, the last state, and the status."""

    status: int
    steps: FloatArray  # (steps, STEP_COLUMNS)
    events: FloatArray  # (events, EVENT_COLUMNS)
    peaks: FloatArray  # (peaks, PEAK_COLUMNS)
    state: FloatArray  # (LENGTH,)


def _grown(table: FloatArray, used: float) -> FloatArray:
    """Return the table, twice as long where it is three quarters full."""
    if used < 0.75 * len(table) and used + 16 < len(table):
        return table
    larger = np.empty((2 * len(table), table.shape[1]))
    larger[: len(table)] = table
    return larger


def march(program: Program) -> March:
    """March a program from its start to its end."""
    state = np.zeros(LENGTH)
    counts = np.zeros(4)
    corner = np.zeros(4)
    local = np.zeros(LOCAL)
    scratch = np.zeros((ROWS, WIDTH))
    steps = np.empty((2048, STEP_COLUMNS))
    events = np.empty((256, EVENT_COLUMNS))
    peaks = np.empty((256, PEAK_COLUMNS))
    start_kernel(program, state, events, counts, local)
    while True:
        status = march_kernel(program, state, steps, events, peaks, counts, corner, local, scratch)
        if status != FULL:
            used = counts.astype(int)
            return March(status, steps[: used[0]], events[: used[1]], peaks[: used[2]], state)
        steps = _grown(steps, counts[0])
        events = _grown(events, counts[1])
        peaks = _grown(peaks, counts[2])
