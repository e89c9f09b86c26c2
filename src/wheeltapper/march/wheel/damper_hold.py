"""A damper whose end can move: what holds the end, and where in a step the end meets or leaves a stop.

The damper's force acts on the wheel as far as something holds the damper's other end. There are two kinds of ends:

play   The end has a gap about the wheel, of half-width g. Free, it rests at its place z. Where y - z = g, it meets its
       upper stop. There it moves with the wheel as long as the wheel moves outwards, v > 0. The lower stop is the
       mirror image, y - z = -g and v < 0.
bush   A spring holds the end; its deflection is e. The end moves as the bush's force moves the damper, with e·B/G. A
       stop holds as long as the bush presses on it, e > 0.

So the end meets a stop where y - z = ±g while it is free, and leaves a stop where v = 0 (a rigid end) or e = 0 (a bush)
while it is held. For each step:
1. Compute the series of the step with what holds the end now.
2. If the end meets or leaves a stop at the step's very start, log that, and compute the series anew with what holds
   the end then.
3. Find the step's length. Cut the step where the end meets or leaves a stop inside it. All else is as in single.py.

An end meets or leaves a stop only at the start of a step; the state there, and where its series head, decide. So it
makes no difference whether this coincides with a loss of contact, an impact or a breakpoint, or is at the march's
start. To touch a stop without crossing it is no event. Nor is it one to cross a stop by less than the march is exact:
on a stiff rail a free wheel comes back in each period to the very place where it left a stop.

`stops` is the table of the stops that were met or left; without rows none are kept.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import ON_DECK, TIME, FloatArray
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.held_end import flight_reach_with_end, held_coefficients, hold_end
from wheeltapper.march.steps.layout import BUSH, COUNT, FLIGHT_ORDER, STATE, STOPS, TREND, WHEEL_V, WHEEL_Y, U, W, Y, Z
from wheeltapper.march.steps.series import path_at
from wheeltapper.march.steps.written import SAME_PLACE
from wheeltapper.march.wheel.roots import NONE, evaluate, evaluate_derivative, first_root
from wheeltapper.march.wheel.step import contact_advance, free_series

MOST_SWITCHES = 2
"""Changes of what holds the end at the start of one step: a gap within rounding has both stops at one place."""
HEADS = 1e-11
"""A term of a series that is smaller at the step's end does not say where the series heads."""
HARDLY_BEYOND = 1e-3
"""Times the tolerance: how far beyond a stop the wheel may turn without reaching it."""


@uncounted_kernel
def _series_direction(row: int, order: int, length: float, S: FloatArray) -> float:
    """Return where a series heads from its start, 1 or -1; 0 where it stays within rounding."""
    power = 1.0
    for k in range(1, order + 1):
        power *= length
        term = S[row + k] * power
        if abs(term) > HEADS:
            return 1.0 if term > 0.0 else -1.0
    return 0.0


@uncounted_kernel
def _turns_back_at_once(row: int, side: float, order: int, length: float, tolerance: float, S: FloatArray) -> bool:
    """Return True where a series that heads to that side turns back after next to nothing, and is back in the step."""
    rise, fall = side * S[row + 1], -side * S[row + 2]
    if rise * length < HEADS or fall <= 0.0 or rise >= fall * length:
        return False
    beyond = rise * rise / (4.0 * fall)
    return bool(
        beyond < HARDLY_BEYOND * tolerance and side * (evaluate(S, row, order, rise / fall) - S[row]) < 0.5 * beyond
    )


@uncounted_kernel
def _log_stop(kind: int, side: float, stops: FloatArray, S: FloatArray) -> None:
    if stops.shape[0] > 0:
        row = stops[int(S[COUNT + STOPS])]
        row[contract.STOP_TIME] = S[STATE + TIME]
        row[contract.STOP_KIND] = kind
        row[contract.STOP_SIDE] = side
    S[COUNT + STOPS] += 1.0


@uncounted_kernel
def _changes_hold(
    numbers: FloatArray, y: int, order: int, length: float, tolerance: float, stops: FloatArray, S: FloatArray
) -> bool:
    """Let the end meet or leave a stop where the step begins at one; return whether it did. Row y: the wheel's."""
    mode = S[STATE + contract.END_MODE]
    if mode == contract.LINKED:
        return False
    if mode == contract.FREE:
        for side in (1.0, -1.0):
            beyond = side * (S[y] - S[STATE + contract.END_PLACE]) - numbers[contract.DAMPER_PLAY]
            meets = beyond > -SAME_PLACE and side * _series_direction(y, order, length, S) > 0.0
            if meets and not _turns_back_at_once(y, side, order, length, tolerance, S):
                S[STATE + contract.END_MODE] = side
                S[STATE + contract.END_DEFLECTION] = 0.0
                _log_stop(contract.REACHED, side, stops, S)
                return True
        return False
    if mode * S[STATE + contract.END_DEFLECTION] > SAME_PLACE or mode * _series_direction(y, order, length, S) >= 0.0:
        return False
    S[STATE + contract.END_PLACE] = S[y] - mode * numbers[contract.DAMPER_PLAY]
    S[STATE + contract.END_MODE] = contract.FREE
    S[STATE + contract.END_DEFLECTION] = 0.0
    _log_stop(contract.LEFT, mode, stops, S)
    return True


@uncounted_kernel
def _first_directed_root(
    row: int, gain: float, offset: float, direction: float, order: int, length: float, S: FloatArray
) -> float:
    """Return the first root of gain·row - offset in the step in that direction; one at its start does not count."""
    for k in range(order + 1):
        S[TREND + k] = gain * S[row + k]
    S[TREND] -= offset
    if abs(S[TREND]) < SAME_PLACE:
        S[TREND] = 0.0
    root, _ = first_root(S, TREND, order, 0.0, length, direction, 0.0)
    return root


@uncounted_kernel
def _changes_at(numbers: FloatArray, y: int, v: int, order: int, length: float, S: FloatArray) -> float:
    """Return where in the step the end meets or leaves a stop; NONE where it does not."""
    mode = S[STATE + contract.END_MODE]
    if mode == contract.LINKED:
        return NONE
    if mode != contract.FREE:
        return _first_directed_root(
            BUSH if numbers[contract.DAMPER_BUSH] > 0.0 else v, mode, 0.0, -1.0, order, length, S
        )
    swing = 0.0
    for k in range(order, 0, -1):
        swing = (swing + abs(S[y + k])) * length
    if abs(S[y] - S[STATE + contract.END_PLACE]) + swing < numbers[contract.DAMPER_PLAY]:
        return NONE
    found = NONE
    for side in (1.0, -1.0):
        gap = side * S[STATE + contract.END_PLACE] + numbers[contract.DAMPER_PLAY]
        root = _first_directed_root(y, side, gap, 1.0, order, length, S)
        if root != NONE:
            found = length = root
    return found


@uncounted_kernel
def _wheel_motion(order: int, s: float, S: FloatArray) -> tuple[float, float]:
    """Return the wheel's displacement and velocity in a contact step as the state at its end will have them."""
    y, v, _ = path_at(evaluate(S, layout.T, order, s), S)
    u = evaluate(S, U, order, s)
    y -= u * u
    v -= evaluate(S, W, order, s)
    if S[STATE + ON_DECK] != 0.0:
        y += evaluate(S, Y, order, s)
        v += evaluate(S, Z, order, s)
    return y, v


@uncounted_kernel
def _refined_root(numbers: FloatArray, order: int, root: float, length: float, S: FloatArray) -> float:
    """Return the root of a contact step by the state instead of the truncated rows of y and v."""
    mode = S[STATE + contract.END_MODE]
    if mode != contract.FREE and numbers[contract.DAMPER_BUSH] > 0.0:
        return root
    for _ in range(2):
        y, v = _wheel_motion(order, root, S)
        if mode == contract.FREE:
            off = y - S[STATE + contract.END_PLACE]
            missing = off - numbers[contract.DAMPER_PLAY] * (1.0 if off > 0.0 else -1.0)
            slope = evaluate_derivative(S, WHEEL_Y, order, root)
        else:
            missing = v
            slope = evaluate_derivative(S, WHEEL_V, order, root)
        if abs(missing) < 1e-3 * length * abs(slope):
            root = min(max(root - missing / slope, 0.0), length)
    return root


@uncounted_kernel
def carry_end(numbers: FloatArray, order: int, length: float, whole: bool, S: FloatArray) -> None:
    """Carry the bush's deflection to the step's end; `whole`: it is a contact step that nothing cuts."""
    if numbers[contract.DAMPER_BUSH] > 0.0 and S[STATE + contract.END_MODE] != contract.FREE:
        S[STATE + contract.END_DEFLECTION] = S[layout.NEXT_BUSH] if whole else evaluate(S, BUSH, order, length)


@uncounted_kernel
def _bound_end(numbers: FloatArray, S: FloatArray) -> None:
    """Say between what contact steps go on without a look at the damper's end."""
    mode, place, play = S[STATE + contract.END_MODE], S[STATE + contract.END_PLACE], numbers[contract.DAMPER_PLAY]
    free, held = mode == contract.FREE, mode == contract.UPPER or mode == contract.LOWER
    S[layout.PLACE_FLOOR] = place - play + SAME_PLACE if free else -np.inf
    S[layout.PLACE_CEILING] = place + play - SAME_PLACE if free else np.inf
    S[layout.HEADING] = mode if held else 0.0


@uncounted_kernel
def held_contact_reach(
    pieces: FloatArray, numbers: FloatArray, until: float, steps: FloatArray, stops: FloatArray,
    S: FloatArray,
) -> tuple[float, float, float, float, float, bool, bool]:  # fmt: skip
    """Put the series of a contact step in S; the steps before it hold nothing.

    Return its length, that up to where a stop is met or left, t, u and w at its end, whether the force may have an
    extreme within it, and whether a stop is met or left.
    """
    order, tolerance = int(numbers[contract.ORDER]), numbers[contract.TOLERANCE]
    reach, t, u, w, turns = 0.0, 0.0, 0.0, 0.0, False
    for switched in range(MOST_SWITCHES + 1):
        hold_end(numbers, S[STATE + contract.END_MODE], S)
        _bound_end(numbers, S)
        reach, t, u, w, turns = contact_advance(pieces, numbers, until, steps.shape[0] - 1, steps, S)
        if switched == MOST_SWITCHES or not _changes_hold(numbers, WHEEL_Y, order, reach, tolerance, stops, S):
            break
    root = _changes_at(numbers, WHEEL_Y, WHEEL_V, order, reach, S)
    length = reach if root == NONE else _refined_root(numbers, order, root, reach, S)
    return reach, length, t, u, w, turns, root != NONE


@uncounted_kernel
def held_flight_reach(
    pieces: FloatArray, numbers: FloatArray, until: float, stops: FloatArray, S: FloatArray
) -> float:  # fmt: skip
    """Put the series of a step without contact force in S; return its length in time, at most `until`."""
    reach, tolerance = 0.0, numbers[contract.TOLERANCE]
    for switched in range(MOST_SWITCHES + 1):
        hold_end(numbers, S[STATE + contract.END_MODE], S)
        free_series(pieces, numbers, S)
        reach = min(until, flight_reach_with_end(numbers, S[STATE : STATE + contract.ENDED_COLUMNS]))
        if switched == MOST_SWITCHES or not _changes_hold(numbers, U, FLIGHT_ORDER, reach, tolerance, stops, S):
            break
    root = _changes_at(numbers, U, W, FLIGHT_ORDER, reach, S)
    return reach if root == NONE else root


@uncounted_kernel
def damper_pull(numbers: FloatArray, v: float, S: FloatArray) -> float:
    """Return the force with which damper and end hold back a wheel that moves at v (scaled)."""
    G, soft, _ = held_coefficients(S[STATE + contract.END_MODE], numbers)
    return float(G * v + soft * S[STATE + contract.END_DEFLECTION])


@uncounted_kernel
def bush_rate(numbers: FloatArray, v: float, S: FloatArray) -> float:
    """Return the rate of the deflection of a bush that is held, at a wheel that moves at v (scaled)."""
    _, soft, rate = held_coefficients(S[STATE + contract.END_MODE], numbers)
    return float(v - rate * S[STATE + contract.END_DEFLECTION]) if soft > 0.0 else 0.0


@uncounted_kernel
def start_end(numbers: FloatArray, y: float, S: FloatArray) -> None:
    """Put the damper's end where in the gap it is said to be, about a wheel that starts at y (scaled)."""
    play, share = numbers[contract.DAMPER_PLAY], numbers[contract.DAMPER_START]
    S[STATE + contract.END_MODE] = contract.FREE if play > 0.0 else contract.LINKED
    S[STATE + contract.END_PLACE] = y + share * play
    S[STATE + contract.END_DEFLECTION] = 0.0
