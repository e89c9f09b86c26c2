"""One step of each phase: its series, its length, and where on it the first event lies."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import LENGTH, ON_DECK, PIECE, FloatArray
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.calling import call_one
from wheeltapper.march.steps.held_end import damper_ends, hold_end
from wheeltapper.march.steps.layout import STATE, N, T, U, W
from wheeltapper.march.steps.variants import BEGINS_TO_YIELD, PUSHES, free_variant_of, variant_of
from wheeltapper.march.wheel.events import is_contact_phase
from wheeltapper.march.wheel.roots import NOISE, NONE, evaluate, evaluate_derivative, first_root

# What ends a step.
NOTHING, BREAK, OPENS, RELEASES, LANDS, GRIPS = 0, 1, 2, 3, 4, 5
# Indentation (scaled) of a wheel in flight that is no rounding: it is above the noise of the roots.
HAIR = 2.0 * NOISE
# Rate (scaled) at which a wheel that begins a flight at the rail is seen to leave it.
DEPARTS = 1e-3
# No state in scaled units comes near this number.
HUGE = 1e200


@uncounted_kernel
def fastest_rate(numbers: FloatArray, suspension: float, S: FloatArray) -> float:
    """Return the rate in s of the fastest part of the motion at a contact step's start; `suspension`: its part in t.

    The contact's own stiffness under the wheel does not count: what it does is never small in the series.
    """
    u = S[U]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    damped = numbers[contract.HYSTERESIS] * law
    mass = numbers[contract.DECK_MASS]
    if mass == 0.0:
        return u * (suspension + damped)
    stiff = numbers[contract.DECK_STIFFNESS]
    if S[STATE + ON_DECK] != 0.0:
        stiff += numbers[contract.QUADRATIC] + 1.5 * numbers[contract.CUBIC] * u
        damped += damped / mass
    return u * (suspension + damped + numbers[contract.DECK_DAMPING] / mass + np.sqrt(stiff / mass))


@uncounted_kernel
def contact_advance(
    pieces: FloatArray, numbers: FloatArray, until: float, limit: int, steps: FloatArray, S: FloatArray
) -> tuple[float, float, float, float, bool]:  # fmt: skip
    """Put the series of the next contact step that may hold an event in S, making the steps before it.

    Return its length, t, u and w at its end, and whether the force may have an extreme in it. Rows `limit` and on of
    `steps` stay free.
    """
    yields = bool(S[layout.HERE_LAW_TERMS] != 0.0)
    number = variant_of(numbers, pieces[int(S[STATE + PIECE])], yields)
    if S[layout.FUNCTIONS + number] == 0.0:
        return np.nan, np.nan, np.nan, np.nan, True  # nobody has written it
    return call_one(S[layout.FUNCTIONS + number], numbers, pieces, until, limit, steps, S)


@uncounted_kernel
def begin_to_yield(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> None:
    """Put in row TREND how far the contact step that is in S goes beyond what the surface bears."""
    call_one(S[layout.FUNCTIONS + BEGINS_TO_YIELD], numbers, pieces, np.inf, 0, pieces, S)


@uncounted_kernel
def push(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> None:
    """Put in row PUSH the force by s of the contact step that is in S."""
    if S[layout.FUNCTIONS + PUSHES] == 0.0:
        S[layout.PUSH] = np.nan  # nobody has written it
        return
    call_one(S[layout.FUNCTIONS + PUSHES], numbers, pieces, np.inf, 0, pieces, S)


@uncounted_kernel
def free_series(pieces: FloatArray, numbers: FloatArray, S: FloatArray) -> None:
    """Put the series of a step in time from the state in S there: U (y), W (v), CLEAR (y_k + Y - y), Y and Z of a deck.

    In a bilateral contact N = factor·(y_k + Y - y), tension included, too; BUSH of a damper's end.
    """
    number = free_variant_of(numbers)
    if S[layout.FUNCTIONS + number] == 0.0:
        S[U] = np.nan  # nobody has written it
        return
    call_one(S[layout.FUNCTIONS + number], numbers, pieces, np.inf, 0, pieces, S)


@uncounted_kernel
def repeat_step(pieces: FloatArray, numbers: FloatArray, state: FloatArray, S: FloatArray) -> None:
    """Put the series of one step from a state (or a row of steps) in S, whose piece stands there."""
    for k in range(state.shape[0]):
        if k != LENGTH:
            S[STATE + k] = state[k]
    if damper_ends(numbers):
        hold_end(numbers, state[contract.END_MODE], S)
    if is_contact_phase(state[contract.PHASE]):
        contact_advance(pieces, numbers, np.inf, 0, pieces, S)
    else:
        free_series(pieces, numbers, S)


@uncounted_kernel
def time_to(S: FloatArray, order: int, s_max: float, time: float) -> float:
    """Return s in (0, s_max] with t(s) = time; t rises from 0 to at least `time` there."""
    lo = 0.0
    hi = s_max
    x = s_max
    for _ in range(200):
        value = evaluate(S, T, order, x) - time
        if value == 0.0:
            return x
        if value > 0.0:
            hi = x
        else:
            lo = x
        slope = evaluate_derivative(S, T, order, x)
        new = x - value / slope if slope > 0.0 else lo - 1.0
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        if abs(new - x) <= 2.3e-16 * abs(new) or new == lo or new == hi:
            return new
        x = new
    return x


@uncounted_kernel
def contact_end(
    numbers: FloatArray, order: int, until: float, length: float, t: float, u: float, w: float, turns: bool,
    S: FloatArray,
) -> tuple[float, int, float, float, float]:  # fmt: skip
    """Cut the contact step in S at its first event; return its length in s, what ends it, and t, u, w there."""
    what = NOTHING
    if not u > 0.0 or turns:
        root, _ = first_root(S, U, order, 0.0, length, -1.0, 0.0)
        if root == NONE and not u > 0.0:
            root = 0.0  # it began at the root, within rounding
        if root != NONE:
            length = root
            what = OPENS
    eta = numbers[contract.HYSTERESIS]
    sway = 0.0  # a bound on how far w goes from where it begins
    if eta > 0.0:
        for k in range(order, 0, -1):
            sway = (sway + abs(S[W + k])) * length
    if eta * (S[W] - sway) <= -1.0:
        for k in range(order + 1):
            S[layout.TREND + k] = eta * S[W + k]
        S[layout.TREND] += 1.0
        root, _ = first_root(S, layout.TREND, order, 0.0, length, -1.0, 0.0)
        if S[layout.TREND] <= 0.0 and S[layout.TREND + 1] < 0.0:
            root = 0.0  # it began at the root, within rounding
        if root != NONE:
            length = root
            what = RELEASES
    if what != NOTHING:
        t = evaluate(S, T, order, length)
    if not t < until:
        length = time_to(S, order, length, until)
        what = BREAK
        t = until
    if what != NOTHING:
        u = evaluate(S, U, order, length)
        w = evaluate(S, W, order, length)
    return length, what, t, u, w


@uncounted_kernel
def trend_series(numbers: FloatArray, order: int, S: FloatArray) -> tuple[int, int]:
    """Return the row and degree of a polynomial with the sign of the contact force's rate."""
    changes = S[layout.HERE_RESIDUAL_DEGREE] if S[layout.HERE_LAW_TERMS] != 0.0 else S[layout.HERE_FACTOR_DEGREE]
    if numbers[contract.HYSTERESIS] == 0.0 and changes <= 0.0:
        return W, order
    for k in range(order - 1):
        S[layout.TREND + k] = (k + 1) * S[N + k + 1]
    return layout.TREND, order - 2


@uncounted_kernel
def flight_reach(numbers: FloatArray, S: FloatArray) -> float:
    """Return the time over which the flight series of order FLIGHT_ORDER is exact to rounding."""
    rate = np.sqrt(numbers[contract.STIFFNESS]) + numbers[contract.DAMPING] + abs(S[layout.HERE_OMEGA])
    if numbers[contract.DECK_MASS] > 0.0:
        deck = np.sqrt(numbers[contract.DECK_STIFFNESS] / numbers[contract.DECK_MASS])
        rate += deck + numbers[contract.DECK_DAMPING] / numbers[contract.DECK_MASS]
    if numbers[contract.BILATERAL] != 0.0:
        rate += 1.0
        if numbers[contract.DECK_MASS] > 0.0:
            rate += np.sqrt(1.0 / numbers[contract.DECK_MASS])
    return min(16.0, 2.0 / max(rate, 1e-3))


@uncounted_kernel
def flight_end(numbers: FloatArray, released: bool, until: float, S: FloatArray) -> tuple[float, int]:
    """Return the length in time of a step without contact force whose series stand in S, and what ends it."""
    length = flight_reach(numbers, S)
    what = NOTHING
    if length >= until:
        length = until
        what = BREAK
    if numbers[contract.BILATERAL] != 0.0:
        return length, what
    if released:
        root, _ = first_root(S, layout.CLEAR, layout.FLIGHT_ORDER, 0.0, length, -1.0, 0.0)
        if not S[layout.CLEAR] > 0.0:
            root = 0.0
        if root != NONE:
            length = root
            what = OPENS
        for k in range(layout.FLIGHT_ORDER):
            S[layout.TREND + k] = (k + 1) * S[layout.CLEAR + k + 1]
        S[layout.TREND] += 1.0 / numbers[contract.HYSTERESIS]
        root, _ = first_root(S, layout.TREND, layout.FLIGHT_ORDER - 1, 0.0, length, 1.0, 0.0)
        if S[layout.TREND] >= 0.0 and S[layout.TREND + 1] > 0.0:
            root = 0.0
        if root != NONE:
            length = root
            what = GRIPS
    else:
        root, _ = first_root(S, layout.CLEAR, layout.FLIGHT_ORDER, 0.0, length, 1.0, 0.0)
        if S[layout.CLEAR] > -HAIR and S[layout.CLEAR + 1] > -DEPARTS:
            S[layout.CLEAR] = -HAIR  # it may go into the rail from where rounding hides its side: no crossing is seen
            deep, _ = first_root(S, layout.CLEAR, layout.FLIGHT_ORDER, 0.0, length if root == NONE else root, 1.0, 0.0)
            root = root if deep == NONE else deep
        if root != NONE:
            length = root
            what = LANDS
    return length, what


@uncounted_kernel
def is_bad(x: float) -> bool:
    """Return True for NaN and for numbers that no state can have.

    By a comparison: np.isfinite is arithmetic (x - x), which reassociation may cancel where this is inlined.
    """
    return not abs(x) <= HUGE
