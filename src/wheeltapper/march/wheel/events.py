"""Losses of contact, impacts, force maxima and breakpoints: logging them, and entering the phase that follows.

A kernel here that takes `S` finds the state in it from STATE on. `mark` are the entries of S from MARK on: how the
contact force has gone since its last maximum. `counts` are the entries from COUNT on: how many rows of each table are
in use, and how many impacts there have been.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import DECK_V, LENGTH, ON_DECK, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.layout import COUNT, MARK, STATE, N, T, U, W
from wheeltapper.march.steps.series import factor_at, law_at, localise, path_at, rail_at, residual_at
from wheeltapper.march.wheel.roots import NONE, evaluate, first_root

GRAZE = 1e-9
"""Indentation rate (scaled) below which a wheel without indentation rests: u = w = 0 is a rest point in s."""
LEAP = 1e-6
"""Value of u (scaled) to which such a wheel is moved, along its acceleration, where that presses it on the rail."""
BRIEF = 2.0
"""Times LEAP: the longest time (scaled) that such a move takes; u stays smaller where the acceleration is small."""
EXTREMES_APART = 1e-9
"""Two extremes of the force closer than this part of a step are one that was found again by rounding."""
QUIET = 1e-13
"""Rate of the force (scaled) that is rounding."""
STANDS_OUT = 1e-9
"""Smallest height of a force maximum above its surroundings on both sides (scaled), over one plus the force. The steps
of the default method are exact to some 1e-10: a lower maximum may be rounding."""

# Entries of `mark`. AT_BREAK: the present state is at a breakpoint. WAITS: a maximum was found and is logged as soon as
# the force falls; TOP_TIME, TOP_FORCE: its time and force; TOP_CORNER: it is at a breakpoint; TOP_IMPACTS: impacts
# before it. LOWEST: where no maximum waits, the lowest force since the last one.
AT_BREAK, WAITS, TOP_TIME, TOP_FORCE, TOP_CORNER, TOP_IMPACTS, LOWEST = range(7)


@uncounted_kernel
def is_free(phase: float) -> bool:
    """Return True for the phases without contact force."""
    return bool(phase == contract.FLIGHT or phase == contract.RELEASED)


@uncounted_kernel
def is_contact_phase(phase: float) -> bool:
    """Return True for the phases in which a step runs in s, the variable of the regularised contact."""
    return bool(phase == contract.CONTACT or phase >= contract.YIELDING)


@uncounted_kernel
def wheel_motion(pieces: FloatArray, numbers: FloatArray, state: FloatArray, S: FloatArray) -> tuple[float, float]:
    """Return displacement and velocity of the wheel in a state; in contact its piece of the path is put in S."""
    if not is_contact_phase(state[PHASE]):
        return state[A], state[B]
    localise(pieces, numbers, int(state[PIECE]), state[SHIFT], state[TIME], S)
    height, velocity = rail_at(0.0, state, S)
    return height - state[A] * state[A], velocity - state[B]


@inlined_uncounted_kernel
def elastic_force(factor: float, quadratic: float, cubic: float, eta: float, u: float, w: float) -> float:
    """Return the force of an elastic contact at indentation u² and rate w; it never pulls."""
    return max(factor * u * u * (quadratic + cubic * u) * (1.0 + eta * w), 0.0)


@uncounted_kernel
def force(numbers: FloatArray, after: float, u: float, w: float, S: FloatArray) -> float:
    """Return the contact force at indentation u² and rate w, by the law that holds."""
    if S[layout.HERE_LAW_TERMS] != 0.0:
        return max(law_at(u * u + residual_at(after, S), S), 0.0)
    factor, _ = factor_at(after, S)
    quadratic, cubic, eta = numbers[contract.QUADRATIC], numbers[contract.CUBIC], numbers[contract.HYSTERESIS]
    return elastic_force(factor, quadratic, cubic, eta, u, w)


@uncounted_kernel
def log_step(length: float, steps: FloatArray, S: FloatArray) -> None:
    """Write the row of a step from the present state."""
    row = int(S[COUNT])
    for k in range(steps.shape[1]):
        steps[row, k] = S[STATE + k]
    steps[row, LENGTH] = length
    S[COUNT] += 1


@uncounted_kernel
def log_event(time: float, kind: int, rate: float, cause: float, events: FloatArray, counts: FloatArray) -> None:
    """Write an event in its row; `counts` are the entries of the scratch array from COUNT on."""
    row = int(counts[layout.EVENTS])
    events[row, contract.EVENT_TIME] = time
    events[row, contract.EVENT_KIND] = kind
    events[row, contract.EVENT_RATE] = rate
    events[row, contract.EVENT_CAUSE] = cause
    counts[layout.EVENTS] += 1
    if kind == contract.IMPACT:
        counts[layout.IMPACTS] += 1
        if counts[layout.IMPACTS] == counts[layout.UNTIL_IMPACT]:
            counts[layout.SEEN] = 1.0
    elif kind == contract.LOSS and counts[layout.IMPACTS] == counts[layout.UNTIL_LOSS]:
        counts[layout.SEEN] = 1.0


@uncounted_kernel
def reset_force_trend(S: FloatArray) -> None:
    """Begin to follow the force of another march."""
    S[MARK + AT_BREAK] = 0.0
    S[MARK + WAITS] = 0.0
    S[MARK + LOWEST] = np.inf


@inlined_uncounted_kernel
def follow_force(
    time: float, force: float, corner: float, peaks: FloatArray, mark: FloatArray, counts: FloatArray
) -> None:
    """Take the force's next value; log the maximum before it as soon as the force has fallen from it.

    Between two values given here the force is monotone: they are its extremes, and those at breakpoints and ends.
    `mark` and `counts` are the entries of the scratch array from MARK and from COUNT on.
    """
    least = STANDS_OUT * (1.0 + abs(force))
    if mark[WAITS] == 0.0 and not force > mark[LOWEST] + least:
        mark[LOWEST] = min(mark[LOWEST], force)
    elif mark[WAITS] == 0.0 or force > mark[TOP_FORCE]:
        mark[WAITS] = 1.0
        mark[TOP_TIME] = time
        mark[TOP_FORCE] = force
        mark[TOP_CORNER] = corner
        mark[TOP_IMPACTS] = counts[layout.IMPACTS]
    elif force < mark[TOP_FORCE] - least and counts[layout.PEAKS] < peaks.shape[0]:
        row = int(counts[layout.PEAKS])
        peaks[row, contract.PEAK_TIME] = mark[TOP_TIME]
        peaks[row, contract.PEAK_FORCE] = mark[TOP_FORCE]
        peaks[row, contract.PEAK_CORNER] = mark[TOP_CORNER]
        peaks[row, contract.PEAK_IMPACT] = mark[TOP_IMPACTS]
        counts[layout.PEAKS] += 1
        mark[WAITS] = 0.0
        mark[LOWEST] = force


@inlined_uncounted_kernel
def follow_on(force: float, peaks: FloatArray, S: FloatArray) -> None:
    """Take the force at the present state, where a step begins."""
    follow_force(S[STATE + TIME], force, S[MARK + AT_BREAK], peaks, S[MARK:], S[COUNT:])
    S[MARK + AT_BREAK] = 0.0


@inlined_uncounted_kernel
def follow_to_break(until: float, force: float, peaks: FloatArray, S: FloatArray) -> None:
    """Take the force just before a breakpoint."""
    follow_force(until, force, 1.0, peaks, S[MARK:], S[COUNT:])
    S[MARK + AT_BREAK] = 1.0


@uncounted_kernel
def follow_inside(numbers: FloatArray, time: float, order: int, trend: int, degree: int, length: float, bonded: bool, peaks: FloatArray, S: FloatArray) -> None:  # fmt: skip
    """Take the force's extremes inside a step; row `trend` holds the sign of its rate."""
    rate = S[trend]
    if abs(rate) <= QUIET:
        rate = evaluate(S, trend, degree, 0.01 * length)
    direction = -1.0 if rate > 0.0 else 1.0
    start = 0.0
    more = True
    while more:
        root, more = first_root(S, trend, degree, start, length, direction, QUIET)
        if root == NONE:
            return
        after = root
        if bonded:
            size = evaluate(S, N, order, root)
        else:
            after = evaluate(S, T, order, root)
            size = force(numbers, after, evaluate(S, U, order, root), evaluate(S, W, order, root), S)
        follow_force(time + after, size, 0.0, peaks, S[MARK:], S[COUNT:])
        start = root + EXTREMES_APART * length
        direction = -direction


@uncounted_kernel
def next_piece(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> int:
    """Enter the next piece of the table; return how it joins, or -1 at the table's end."""
    piece = int(S[STATE + PIECE]) + 1
    if piece < len(pieces):
        S[STATE + PIECE] = piece
        return int(pieces[piece, contract.JOIN])
    loop = int(numbers[contract.LOOP])
    if loop >= len(pieces):
        return -1
    S[STATE + SHIFT] += pieces[piece - 1, contract.STOP] - pieces[loop, contract.START]
    S[STATE + PIECE] = loop
    return int(numbers[contract.LOOP_JOIN])


@uncounted_kernel
def piece_end(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> float:
    """Return the time at which the present piece ends."""
    end = pieces[int(S[STATE + PIECE]), contract.STOP]
    if np.isinf(end) or numbers[contract.PACE] == 0.0:
        return np.inf
    return (end + S[STATE + SHIFT]) / numbers[contract.PACE]


@uncounted_kernel
def take_contact(numbers: FloatArray, delta: float, rate: float, S: FloatArray) -> None:
    """Enter contact with an indentation and its rate."""
    S[STATE + PHASE] = contract.CONTACT
    S[STATE + A] = sqrt(max(delta, 0.0))
    S[STATE + B] = rate
    if numbers[contract.HYSTERESIS] * rate < -1.0 and delta > 0.0:
        S[STATE + PHASE] = contract.RELEASED


@uncounted_kernel
def free_acceleration(numbers: FloatArray, y: float, v: float, S: FloatArray) -> float:
    """Return δ'' without contact force."""
    _, _, a = path_at(0.0, S)
    a += 1.0 + numbers[contract.STIFFNESS] * y + numbers[contract.DAMPING] * v
    if S[STATE + ON_DECK] != 0.0:
        pull = numbers[contract.PRESTRESS] - numbers[contract.DECK_STIFFNESS] * S[STATE + contract.DECK_Y]
        a += (pull - numbers[contract.DECK_DAMPING] * S[STATE + DECK_V]) / numbers[contract.DECK_MASS]
    return a


@uncounted_kernel
def choose_phase(numbers: FloatArray, y: float, v: float, was: int, cause: float, events: FloatArray, S: FloatArray) -> None:  # fmt: skip
    """Choose the phase from displacement and velocity at a start or a breakpoint, and record a change of it."""
    height, velocity = rail_at(0.0, S[STATE:], S)
    delta = height - y
    rate = velocity - v
    if numbers[contract.BILATERAL] != 0.0:
        S[STATE + PHASE] = contract.BONDED
        S[STATE + A] = y
        S[STATE + B] = v
        return
    touching = delta > 0.0
    if delta == 0.0:
        touching = rate > 0.0 or (rate == 0.0 and free_acceleration(numbers, y, v, S) > 0.0)
    S[STATE + PHASE] = contract.FLIGHT
    if touching:
        take_contact(numbers, delta, rate, S)
    if is_free(S[STATE + PHASE]):
        S[STATE + A] = y
        S[STATE + B] = v
        if was == contract.CONTACT:
            log_event(S[STATE + TIME], contract.LOSS, rate, cause, events, S[COUNT:])
    elif is_free(was):
        log_event(S[STATE + TIME], contract.IMPACT, rate, cause, events, S[COUNT:])


@uncounted_kernel
def cross_break(pieces: FloatArray, numbers: FloatArray, events: FloatArray, S: FloatArray) -> int:
    """Go over the breakpoint(s) at the present time; `local` belongs to the piece behind, time zero is now."""
    time = S[STATE + TIME]
    phase = int(S[STATE + PHASE])
    height, velocity = rail_at(0.0, S[STATE:], S)
    y = S[STATE + A]
    v = S[STATE + B]
    if phase == contract.CONTACT:
        y = height - S[STATE + A] * S[STATE + A]
        v = velocity - S[STATE + B]
    hard = False
    jumped = False
    while piece_end(pieces, numbers, S) <= time * (1.0 + 4e-16):
        join = next_piece(pieces, numbers, S)
        if join < 0:
            return contract.END_OF_PATH
        hard = hard or join != contract.SOFT
        jumped = jumped or join == contract.JUMP
    on_deck = numbers[contract.DECK_FROM] <= time < numbers[contract.DECK_TO]
    if numbers[contract.DECK_MASS] > 0.0 and on_deck != (S[STATE + ON_DECK] != 0.0):
        S[STATE + ON_DECK] = 1.0 if on_deck else 0.0
        hard = True
        jumped = True
    localise(pieces, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], time, S)
    if not hard:
        return contract.RUNNING
    if phase == contract.CONTACT and not jumped:  # a kink: the indentation itself is kept to the last digit
        _, after, _ = path_at(0.0, S)
        if S[STATE + ON_DECK] != 0.0:
            after += S[STATE + DECK_V]
        S[STATE + B] = after - v
        if numbers[contract.HYSTERESIS] * S[STATE + B] < -1.0 and S[STATE + A] > 0.0:
            log_event(time, contract.LOSS, S[STATE + B], 1.0, events, S[COUNT:])
            S[STATE + PHASE] = contract.RELEASED
            S[STATE + A] = y
            S[STATE + B] = v
        return contract.RUNNING
    choose_phase(numbers, y, v, phase, 1.0, events, S)
    return contract.RUNNING
