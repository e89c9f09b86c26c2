"""One step of each phase: its series, its length, and where on it the first event lies."""

from __future__ import annotations

from math import exp, log

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray
from wheeltapper.march.roots import NONE, evaluate, evaluate_derivative, first_root
from wheeltapper.march.series import (
    CLEAR,
    FACTOR_DEGREE,
    FLIGHT_ORDER,
    HERE,
    TREND,
    WORK,
    N,
    T,
    U,
    W,
    Y,
    Z,
    flight_reach,
)
from wheeltapper.march.unrolled import survey_12, survey_20

# What ends a step.
NOTHING, BREAK, OPENS, RELEASES, LANDS, GRIPS = 0, 1, 2, 3, 4, 5
LONGEST = 2.0
SAFETY = 0.6


@kernel
def contact_length(order: int, tolerance: float, deck: bool, S: FloatArray) -> float:
    """Return the step in s at which the last two terms of the series reach the tolerance."""
    last = max(abs(S[U + order]), abs(S[W + order]))
    before = max(abs(S[U + order - 1]), abs(S[W + order - 1]))
    if deck:
        last = max(last, abs(S[Y + order]), abs(S[Z + order]))
        before = max(before, abs(S[Y + order - 1]), abs(S[Z + order - 1]))
    goal = log(tolerance)
    first = (goal - log(max(before, 1e-250))) / (order - 1)
    second = goal / (order - 1) - log(max(last, 1e-250)) / order
    return min(LONGEST, SAFETY * exp(min(first, second)))


@kernel
def survey(order: int, length: float, S: FloatArray) -> tuple[float, float, float, float, float]:
    """Return t, u, w at a step's end, and bounds of the change of u and of w up to there."""
    if order == 12:
        return survey_12(S, T, U, W, length)
    if order == 20:
        return survey_20(S, T, U, W, length)
    u_change = 0.0
    w_change = 0.0
    for k in range(order, 0, -1):
        u_change = (u_change + abs(S[U + k])) * length
        w_change = (w_change + abs(S[W + k])) * length
    t = evaluate(S, T, order, length)
    return t, evaluate(S, U, order, length), evaluate(S, W, order, length), u_change, w_change


@kernel
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


@kernel
def contact_end(
    numbers: FloatArray, order: int, until: float, S: FloatArray
) -> tuple[float, int, float, float, float, bool]:
    """Return the length in s of the contact step in S, what ends it, t, u, w there, and whether w may pass zero."""
    length = contact_length(order, numbers[contract.TOLERANCE], numbers[contract.DECK_MASS] > 0.0, S)
    t, u, w, u_change, w_change = survey(order, length, S)
    what = NOTHING
    turns = not abs(S[W]) > w_change
    if not S[U] > u_change:
        root = first_root(S, U, order, 0.0, length, -1.0, WORK)
        if root != NONE:
            length = root
            what = OPENS
    eta = numbers[contract.HYSTERESIS]
    if eta > 0.0:
        for k in range(order + 1):
            S[TREND + k] = eta * S[W + k]
        S[TREND] += 1.0
        root = first_root(S, TREND, order, 0.0, length, -1.0, WORK)
        if root != NONE:
            length = root
            what = RELEASES
    if what != NOTHING:
        t, u, w, u_change, w_change = survey(order, length, S)
    if t >= until:
        length = time_to(S, order, length, until)
        what = BREAK
        t, u, w, u_change, w_change = survey(order, length, S)
    return length, what, t, u, w, turns


@kernel
def trend_series(numbers: FloatArray, order: int, S: FloatArray) -> tuple[int, int]:
    """Return the row and degree of a polynomial with the sign of the contact force's rate."""
    if numbers[contract.HYSTERESIS] == 0.0 and S[HERE + FACTOR_DEGREE] < 0.0:
        return W, order
    for k in range(order - 1):
        S[TREND + k] = (k + 1) * S[N + k + 1]
    return TREND, order - 2


@kernel
def flight_end(numbers: FloatArray, released: bool, until: float, S: FloatArray) -> tuple[float, int]:
    """Return the length in time of a step without contact force whose series stand in S, and what ends it."""
    length = flight_reach(numbers, S)
    what = NOTHING
    if length >= until:
        length = until
        what = BREAK
    if numbers[contract.BILATERAL] != 0.0:
        return length, what
    degree = FLIGHT_ORDER
    while degree > 1 and abs(S[CLEAR + degree]) * length**degree < 1e-18:
        degree -= 1
    if released:
        root = first_root(S, CLEAR, degree, 0.0, length, -1.0, WORK)
        if root != NONE:
            length = root
            what = OPENS
        for k in range(degree):
            S[TREND + k] = (k + 1) * S[CLEAR + k + 1]
        S[TREND] += 1.0 / numbers[contract.HYSTERESIS]
        root = first_root(S, TREND, degree - 1, 0.0, length, 1.0, WORK)
        if root != NONE:
            length = root
            what = GRIPS
    else:
        root = first_root(S, CLEAR, degree, 0.0, length, 1.0, WORK)
        if root != NONE:
            length = root
            what = LANDS
    return length, what


@kernel
def is_bad(x: float) -> bool:
    """Return True for NaN and infinities."""
    return not np.isfinite(x)
