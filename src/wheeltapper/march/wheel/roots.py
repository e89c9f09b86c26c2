"""Roots of a step's polynomial: every crossing in the step is found.

On an interval the polynomial is written in the Bernstein basis; by Descartes' rule the number of sign changes in its
coefficients bounds the number of roots inside, and is exact when it is 0 or 1. Halving isolates each root:

    first_root(a, lo, hi):  a monotone polynomial needs only its values at both ends
                            else scale to x in (0, 1), take the leftmost interval
        0 sign changes: nothing here          1: one root; sharpen it by Newton's method kept inside the bracket
        2 or more: halve, left half first     (two roots closer than 1e-10 of the step are a touch, not a crossing)
"""

from __future__ import annotations

from math import comb

import numpy as np

from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.steps.layout import SCALED, SHIFTED, WORK

NONE = -1.0
NOISE = 1e-13
TOUCH = 1e-10
NEGLIGIBLE = 1e-18
ROOT_DEGREE = 23
_ORDERS = range(ROOT_DEGREE + 1)
INVERSE_BINOMIAL = np.array([[1.0 / comb(n, k) if k <= n else 0.0 for k in _ORDERS] for n in _ORDERS])


@uncounted_kernel
def evaluate(a: FloatArray, at: int, n: int, x: float) -> float:
    """Return Σ a[at + k]·x^k, k = 0 … n."""
    total = a[at + n]
    for k in range(n - 1, -1, -1):
        total = total * x + a[at + k]
    return total


@uncounted_kernel
def evaluate_derivative(a: FloatArray, at: int, n: int, x: float) -> float:
    """Return the derivative of Σ a[at + k]·x^k."""
    total = 0.0
    for k in range(n, 0, -1):
        total = total * x + k * a[at + k]
    return total


@uncounted_kernel
def _write_bernstein(S: FloatArray, n: int, left: float, width: float) -> None:
    """Put the Bernstein coefficients of the scaled polynomial on (left, left + width) in row WORK."""
    row = SCALED
    if left != 0.0:
        row = SHIFTED
        for k in range(n + 1):
            S[SHIFTED + k] = S[SCALED + k]
        for i in range(n):
            for k in range(n - 1, i - 1, -1):
                S[SHIFTED + k] += left * S[SHIFTED + k + 1]
    power = 1.0
    for k in range(n + 1):
        S[WORK + k] = S[row + k] * power * INVERSE_BINOMIAL[n, k]
        power *= width
    for i in range(1, n + 1):
        for k in range(n, i - 1, -1):
            S[WORK + k] += S[WORK + k - 1]


@uncounted_kernel
def _sign_changes(S: FloatArray, n: int, noise: float) -> tuple[int, float, float, float]:
    """Count the sign changes in row WORK; return also the first and last sign, and where in (0, 1) the first one is.

    The first coefficient counts as zero up to `noise`, all others up to NOISE.
    """
    changes = 0
    sign = 0.0
    first = 0.0
    place = 0.5
    before = 0
    for i in range(n + 1):
        c = S[WORK + i]
        if abs(c) > noise:
            now = 1.0 if c > 0.0 else -1.0
            if sign == 0.0:
                first = now
            elif now != sign:
                if changes == 0:
                    share = S[WORK + before] / (S[WORK + before] - c)
                    place = (before + (i - before) * share) / n
                changes += 1
            sign = now
            before = i
        noise = NOISE
    return changes, first, sign, place


@uncounted_kernel
def _only_root(S: FloatArray, at: int, n: int, lo: float, hi: float, x: float, sign: float) -> float:
    """Return the only root of the polynomial in (lo, hi), from a guess; `sign` is its sign just after lo."""
    for _ in range(200):
        value = S[at + n]
        slope = 0.0
        k = at + n
        while k > at:  # a range with a variable number of steps would cost twice the time in Numba
            k -= 1
            slope = slope * x + value
            value = value * x + S[k]
        if value * sign > 0.0:
            lo = x
        else:
            hi = x
        new = x - value / slope
        if abs(new - x) <= 1e-13 * new and lo <= new <= hi:  # the next correction would be far below rounding
            return new
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
            if new == lo or new == hi:
                return new
        x = new
    return x


@uncounted_kernel
def first_root(
    S: FloatArray, at: int, n: int, lo: float, hi: float, direction: float, floor: float
) -> tuple[float, bool]:
    """Return the first crossing of Σ S[at + k]·x^k in (lo, hi), or NONE, and whether more crossings may follow it.

    direction -1: only from + to -; +1: only from - to +. A value at lo no larger than `floor` counts as zero; any other
    one has its sign, however small, where lo is 0: it is known there without rounding.
    Overwrites WORK, SCALED, SHIFTED.
    """
    if not hi > lo:
        return NONE, False
    if lo == 0.0 and S[at] == 0.0:  # the phase begins at a root, which does not count
        at += 1
        n -= 1
    steepest = 0.0
    for k in range(n, 1, -1):
        steepest = (steepest + k * abs(S[at + k])) * hi
    if lo == 0.0 and abs(S[at]) > (steepest + abs(S[at + 1])) * hi:
        return NONE, False  # it does not come as far as zero
    if abs(S[at + 1]) > steepest and abs(S[at + 1]) * (hi - lo) > NOISE:
        start = evaluate(S, at, n, lo)
        end = evaluate(S, at, n, hi)
        if start * direction < -floor and end * direction > 0.0:
            return _only_root(S, at, n, lo, hi, lo + (hi - lo) * start / (start - end), -direction), False
        return NONE, False
    power = 1.0
    degree = 0
    for k in range(n + 1):
        c = S[at + k] * power
        S[SCALED + k] = c
        if abs(c) > NEGLIGIBLE:
            degree = k
        power *= hi
    start = lo / hi
    whole = 1.0 - start
    left = start
    width = whole
    before = 0.0
    while left < 1.0:
        _write_bernstein(S, degree, left, width)
        changes, first, last, place = _sign_changes(S, degree, floor if left == 0.0 else NOISE)
        if changes >= 2 and width > TOUCH * whole:
            width *= 0.5
            continue
        if before * first < 0.0 and first * direction > 0.0:
            return left * hi, True  # the root lies exactly where two intervals meet
        if changes % 2 == 1 and first * direction < 0.0:
            root = _only_root(S, SCALED, degree, left, left + width, left + place * width, first)
            return root * hi, width < whole
        # Nothing (or the other direction, or a touch) here: go right, with the widest dyadic interval that fits.
        before = last if last != 0.0 else before
        left += width
        if left >= 1.0 - 1e-15:
            break
        width = _next_width(left - start, width, whole)
    return NONE, False


@uncounted_kernel
def _next_width(done: float, width: float, whole: float) -> float:
    """Return the largest dyadic interval that may start after `done` of the whole."""
    cells = np.floor(done / width + 0.5)
    while width < whole and cells % 2.0 == 0.0:
        width *= 2.0
        cells *= 0.5
    return min(width, whole - done)
