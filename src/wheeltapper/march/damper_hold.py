"""A damper with an end of its own: what holds the end, and where on a step's series a stop is met or left.

play   the end z stays within the half-gap g of the wheel, |y - z| <= g; held at its upper stop, y - z = g, it moves
       with the wheel as long as this moves outwards, v > 0 (the lower stop is the mirror image); free, it rests
bush   e is its deflection: the end moves with e·B/G of the bush's force on the damper; a stop holds while e > 0

meets   y - z = ±g while the end is free                    leaves   v = 0 (a rigid end) or e = 0 (a bush) while held

for each step: the series of the mode that holds -> does the end meet or leave a stop right here? then of the other mode
               -> its length; cut where a stop is met or left -> all else as in single.py

An event is only ever taken at the start of the step behind it, from the state and where its series head: so it makes no
difference whether it coincides with a loss, an impact or a breakpoint, or begins a run. A touch without a crossing is
no event, nor is one that goes beyond the stop by less than the march is exact: on a stiff rail a wheel that is free
comes back, period after period, to the very place where it left a stop.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.damper_series import contact_with_end, flight_reach_with_end, flight_with_end, held
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import (
    BUSH,
    COUNT,
    FLIGHT_ORDER,
    STATE,
    STOPS,
    TREND,
    WHEEL_V,
    WHEEL_Y,
    T,
    U,
    W,
    Y,
    Z,
)
from wheeltapper.march.program import (
    DAMPER_BUSH,
    DAMPER_PLAY,
    DAMPER_START,
    END_DEFLECTION,
    END_MODE,
    END_PLACE,
    ENDED_COLUMNS,
    FREE,
    LEFT,
    LINKED,
    ON_DECK,
    REACHED,
    STOP_KIND,
    STOP_SIDE,
    STOP_TIME,
    TIME,
    FloatArray,
)
from wheeltapper.march.roots import NONE, evaluate, evaluate_derivative, first_root
from wheeltapper.march.series import path_at
from wheeltapper.march.step import contact_reach
from wheeltapper.march.steplength import steplength

MOST_SWITCHES = 2
"""Changes of what holds the end at the start of one step: a gap within rounding has both stops at one place."""
FORGIVEN = 2.0
"""Binary logarithm of how much larger than by a steady decay earlier terms may be before they shorten a step."""
SAME_PLACE = 1e-12
"""Displacements and velocities (scaled) that differ by less are the same."""
HEADS = 1e-11
"""A term of a series that is smaller at the step's end does not say where the series heads."""
HARDLY_BEYOND = 1e-3
"""Times the tolerance: how far beyond a stop the wheel may turn without reaching it."""


@kernel
def _heading(row: int, order: int, length: float, S: FloatArray) -> float:
    """Return where a series heads from its start, 1 or -1; 0 where it stays within rounding."""
    power = 1.0
    for k in range(1, order + 1):
        power *= length
        term = S[row + k] * power
        if abs(term) > HEADS:
            return 1.0 if term > 0.0 else -1.0
    return 0.0


@kernel
def _hardly(row: int, side: float, order: int, length: float, tolerance: float, S: FloatArray) -> bool:
    """Return True where a series that heads to that side turns back after next to nothing, and is back in the step."""
    rise, fall = side * S[row + 1], -side * S[row + 2]
    if rise * length < HEADS or fall <= 0.0 or rise >= fall * length:
        return False
    beyond = rise * rise / (4.0 * fall)
    return bool(
        beyond < HARDLY_BEYOND * tolerance and side * (evaluate(S, row, order, rise / fall) - S[row]) < 0.5 * beyond
    )


@kernel
def _log_stop(kind: int, side: float, stops: FloatArray, S: FloatArray) -> None:
    row = int(S[COUNT + STOPS])
    stops[row, STOP_TIME] = S[STATE + TIME]
    stops[row, STOP_KIND] = kind
    stops[row, STOP_SIDE] = side
    S[COUNT + STOPS] += 1.0


@kernel
def _changes_hold(
    damper: FloatArray, y: int, order: int, length: float, tolerance: float, stops: FloatArray, S: FloatArray
) -> bool:
    """Let the end meet or leave a stop where the step begins at one; return whether it did. Row y: the wheel's."""
    mode = S[STATE + END_MODE]
    if mode == LINKED:
        return False
    if mode == FREE:
        for side in (1.0, -1.0):
            beyond = side * (S[y] - S[STATE + END_PLACE]) - damper[DAMPER_PLAY]
            meets = beyond > -SAME_PLACE and side * _heading(y, order, length, S) > 0.0
            if meets and not _hardly(y, side, order, length, tolerance, S):
                S[STATE + END_MODE] = side
                S[STATE + END_DEFLECTION] = 0.0
                _log_stop(REACHED, side, stops, S)
                return True
        return False
    if mode * S[STATE + END_DEFLECTION] > SAME_PLACE or mode * _heading(y, order, length, S) >= 0.0:
        return False
    S[STATE + END_PLACE] = S[y] - mode * damper[DAMPER_PLAY]
    S[STATE + END_MODE] = FREE
    S[STATE + END_DEFLECTION] = 0.0
    _log_stop(LEFT, mode, stops, S)
    return True


@kernel
def _root(row: int, gain: float, offset: float, direction: float, order: int, length: float, S: FloatArray) -> float:
    """Return the first root of gain·row - offset in the step in that direction; one at its start does not count."""
    for k in range(order + 1):
        S[TREND + k] = gain * S[row + k]
    S[TREND] -= offset
    if abs(S[TREND]) < SAME_PLACE:
        S[TREND] = 0.0
    root, _ = first_root(S, TREND, order, 0.0, length, direction, 0.0)
    return root


@kernel
def _changes_at(damper: FloatArray, y: int, v: int, order: int, length: float, S: FloatArray) -> float:
    """Return where in the step the end meets or leaves a stop; NONE where it does not."""
    mode = S[STATE + END_MODE]
    if mode == LINKED:
        return NONE
    if mode != FREE:
        return _root(BUSH if damper[DAMPER_BUSH] > 0.0 else v, mode, 0.0, -1.0, order, length, S)
    swing = 0.0
    for k in range(order, 0, -1):
        swing = (swing + abs(S[y + k])) * length
    if abs(S[y] - S[STATE + END_PLACE]) + swing < damper[DAMPER_PLAY]:
        return NONE
    found = NONE
    for side in (1.0, -1.0):
        root = _root(y, side, side * S[STATE + END_PLACE] + damper[DAMPER_PLAY], 1.0, order, length, S)
        if root != NONE:
            found = length = root
    return found


@kernel
def _moves(order: int, s: float, S: FloatArray) -> tuple[float, float]:
    """Return the wheel's displacement and velocity in a contact step as the state at its end will have them."""
    y, v, _ = path_at(evaluate(S, T, order, s), S)
    u = evaluate(S, U, order, s)
    y -= u * u
    v -= evaluate(S, W, order, s)
    if S[STATE + ON_DECK] != 0.0:
        y += evaluate(S, Y, order, s)
        v += evaluate(S, Z, order, s)
    return y, v


@kernel
def _sharpened(damper: FloatArray, order: int, root: float, length: float, S: FloatArray) -> float:
    """Return the root of a contact step by the state instead of the truncated rows of y and v."""
    mode = S[STATE + END_MODE]
    if mode != FREE and damper[DAMPER_BUSH] > 0.0:
        return root
    for _ in range(2):
        y, v = _moves(order, root, S)
        if mode == FREE:
            off = y - S[STATE + END_PLACE]
            missing = off - damper[DAMPER_PLAY] * (1.0 if off > 0.0 else -1.0)
            slope = evaluate_derivative(S, WHEEL_Y, order, root)
        else:
            missing = v
            slope = evaluate_derivative(S, WHEEL_V, order, root)
        if abs(missing) < 1e-3 * length * abs(slope):
            root = min(max(root - missing / slope, 0.0), length)
    return root


@kernel
def stretch(damper: FloatArray, order: int, length: float, S: FloatArray) -> None:
    """Carry the bush's deflection to the step's end."""
    if damper[DAMPER_BUSH] > 0.0 and S[STATE + END_MODE] != FREE:
        S[STATE + END_DEFLECTION] = evaluate(S, BUSH, order, length)


@kernel
def _reach(numbers: FloatArray, damper: FloatArray, S: FloatArray) -> float:
    """Return the step in s at which the last terms of the series, of the bush's too, reach the tolerance.

    A step that leaves a stop begins where the wheel turns. On a stiff rail all is then symmetric in s, the last two
    terms of u and w are one number, and where that passes zero it says nothing; so two more have a say.
    """
    order = int(numbers[contract.ORDER])
    goal = np.log2(numbers[contract.TOLERANCE])
    G, soft, rate = held(S[STATE + END_MODE], damper)
    length = contact_reach(numbers, numbers[contract.STIFFNESS] + G + soft + rate, S)
    u, w = U + order - 2, W + order - 2
    earlier = goal * (order - 3) / (order - 1) + FORGIVEN
    length = min(length, steplength(order - 2, abs(S[u - 1]), abs(S[w - 1]), abs(S[u]), abs(S[w]), earlier))
    if soft == 0.0:
        return length
    gain = max(1.0, soft)
    before, last = gain * abs(S[BUSH + order - 1]), gain * abs(S[BUSH + order])
    return min(length, steplength(order, before, 0.0, last, 0.0, goal))


@kernel
def held_contact_reach(
    numbers: FloatArray, damper: FloatArray, stops: FloatArray, S: FloatArray
) -> tuple[float, bool]:  # fmt: skip
    """Put the series of a contact step in S; return its length, and whether a stop is met or left at its end."""
    order = int(numbers[contract.ORDER])
    length = 0.0
    for switched in range(MOST_SWITCHES + 1):
        contact_with_end(numbers, order, damper, S[STATE : STATE + ENDED_COLUMNS], S)
        length = _reach(numbers, damper, S)
        tolerance = numbers[contract.TOLERANCE]
        if switched == MOST_SWITCHES or not _changes_hold(damper, WHEEL_Y, order, length, tolerance, stops, S):
            break
    root = _changes_at(damper, WHEEL_Y, WHEEL_V, order, length, S)
    return (length, False) if root == NONE else (_sharpened(damper, order, root, length, S), True)


@kernel
def held_flight_reach(
    numbers: FloatArray, damper: FloatArray, until: float, stops: FloatArray, S: FloatArray
) -> float:  # fmt: skip
    """Put the series of a step without contact force in S; return its length in time, at most `until`."""
    reach = 0.0
    for switched in range(MOST_SWITCHES + 1):
        flight_with_end(numbers, damper, S[STATE : STATE + ENDED_COLUMNS], S)
        reach = min(until, flight_reach_with_end(numbers, damper, S[STATE : STATE + ENDED_COLUMNS]))
        tolerance = numbers[contract.TOLERANCE]
        if switched == MOST_SWITCHES or not _changes_hold(damper, U, FLIGHT_ORDER, reach, tolerance, stops, S):
            break
    root = _changes_at(damper, U, W, FLIGHT_ORDER, reach, S)
    return reach if root == NONE else root


@kernel
def damper_pull(damper: FloatArray, v: float, S: FloatArray) -> float:
    """Return the force with which damper and end hold back a wheel that moves at v (scaled)."""
    G, soft, _ = held(S[STATE + END_MODE], damper)
    return float(G * v + soft * S[STATE + END_DEFLECTION])


def start_end(numbers: FloatArray, damper: FloatArray, S: FloatArray) -> None:
    """Put the damper's end where in the gap it is said to be, about the wheel at the start."""
    play, share = damper[DAMPER_PLAY], damper[DAMPER_START]
    S[STATE + END_MODE] = FREE if play > 0.0 else LINKED
    S[STATE + END_PLACE] = numbers[contract.START_HEIGHT] + share * play
