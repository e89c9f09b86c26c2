"""One step of each phase: its series, its length, and where on it the first event lies."""

from __future__ import annotations

import numpy as np
from numba import njit

from wheeltapper.march.program import FloatArray, Program
from wheeltapper.march.roots import NONE, evaluate, evaluate_derivative, first_root
from wheeltapper.march.series import (
    CLEAR,
    FACTOR_DEGREE,
    FLIGHT_ORDER,
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

# What ends a step.
NOTHING, BREAK, OPENS, RELEASES, LANDS, GRIPS = 0, 1, 2, 3, 4, 5
LONGEST = 2.0
SAFETY = 0.6


@njit(cache=True, error_model="numpy")
def contact_length(order: int, tolerance: float, deck: bool, S: FloatArray) -> float:
    """Return the step in s at which the last two terms of the series reach the tolerance."""
    last = max(abs(S[U, order]), abs(S[W, order]))
    before = max(abs(S[U, order - 1]), abs(S[W, order - 1]))
    if deck:
        last = max(last, abs(S[Y, order]), abs(S[Z, order]))
        before = max(before, abs(S[Y, order - 1]), abs(S[Z, order - 1]))
    root = tolerance ** (1.0 / (order - 1))
    first = (tolerance / max(before, 1e-250)) ** (1.0 / (order - 1))
    second = root * max(last, 1e-250) ** (-1.0 / order)
    return min(LONGEST, SAFETY * min(first, second))


@njit(cache=True, error_model="numpy")
def time_to(S: FloatArray, order: int, s_max: float, time: float) -> float:
    """Return s in (0, s_max] with t(s) = time; t rises from 0 to at least `time` there."""
    lo = 0.0
    hi = s_max
    x = s_max
    for _ in range(200):
        value = evaluate(S[T], order, x) - time
        if value == 0.0:
            return x
        if value > 0.0:
            hi = x
        else:
            lo = x
        slope = evaluate_derivative(S[T], order, x)
        new = x - value / slope if slope > 0.0 else lo - 1.0
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        if abs(new - x) <= 2.3e-16 * abs(new) or new == lo or new == hi:
            return new
        x = new
    return x


@njit(cache=True, error_model="numpy")
def contact_end(
    program: Program, order: int, tolerance: float, until: float, local: FloatArray, S: FloatArray
) -> tuple[float, int]:
    """Return the length in s of a contact step whose series stand in S, and what ends it."""
    length = contact_length(order, tolerance, program.deck_mass > 0.0, S)
    what = NOTHING
    root = first_root(S[U], order, 0.0, length, -1.0, S[WORK])
    if root != NONE:
        length = root
        what = OPENS
    eta = program.hysteresis
    if eta > 0.0:
        for k in range(order + 1):
            S[TREND, k] = eta * S[W, k]
        S[TREND, 0] += 1.0
        root = first_root(S[TREND], order, 0.0, length, -1.0, S[WORK])
        if root != NONE:
            length = root
            what = RELEASES
    reached = evaluate(S[T], order, length)
    if reached >= until:
        return time_to(S, order, length, until), BREAK
    return length, what


@njit(cache=True, error_model="numpy")
def trend_series(program: Program, order: int, local: FloatArray, S: FloatArray) -> int:
    """Put in TREND a polynomial with the sign of the contact force's rate; return its degree."""
    if program.hysteresis == 0.0 and local[FACTOR_DEGREE] < 0.0:
        for k in range(order + 1):
            S[TREND, k] = S[W, k]
        return order
    for k in range(order - 1):
        S[TREND, k] = (k + 1) * S[N, k + 1]
    return order - 2


@njit(cache=True, error_model="numpy")
def flight_end(
    program: Program, released: bool, until: float, local: FloatArray, S: FloatArray
) -> tuple[float, int]:
    """Return the length in time of a step without contact force whose series stand in S, and what ends it."""
    length = flight_reach(program, local)
    what = NOTHING
    if length >= until:
        length = until
        what = BREAK
    if program.bonded:
        return length, what
    degree = FLIGHT_ORDER
    while degree > 1 and abs(S[CLEAR, degree]) * length**degree < 1e-18:
        degree -= 1
    if released:
        root = first_root(S[CLEAR], degree, 0.0, length, -1.0, S[WORK])
        if root != NONE:
            length = root
            what = OPENS
        for k in range(degree):
            S[TREND, k] = (k + 1) * S[CLEAR, k + 1]
        S[TREND, 0] += 1.0 / program.hysteresis
        root = first_root(S[TREND], degree - 1, 0.0, length, 1.0, S[WORK])
        if root != NONE:
            length = root
            what = GRIPS
    else:
        root = first_root(S[CLEAR], degree, 0.0, length, 1.0, S[WORK])
        if root != NONE:
            length = root
            what = LANDS
    return length, what


@njit(cache=True, error_model="numpy")
def series_end(S: FloatArray, order: int, x: float) -> tuple[float, float, float, float]:
    """Return the four state series (U, W, Y, Z) at x."""
    return evaluate(S[U], order, x), evaluate(S[W], order, x), evaluate(S[Y], order, x), evaluate(S[Z], order, x)


@njit(cache=True, error_model="numpy")
def is_bad(x: float) -> bool:
    """Return True for NaN and infinities."""
    return not np.isfinite(x)
