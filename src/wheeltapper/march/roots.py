"""Roots of a step's polynomial: every crossing in the step is found, none is stepped over.

On an interval the polynomial is written in the Bernstein basis; by Descartes' rule the number of sign changes in its
coefficients bounds the number of roots inside, and is exact when it is 0 or 1. Halving isolates each root:

    first_root(a, lo, hi):  take the leftmost interval
        0 sign changes: nothing here          1: one root; sharpen it by Newton's method kept inside the bracket
        2 or more: halve, left half first     (two roots closer than 1e-10 of the step are a touch, not a crossing)
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray

MAX_TERMS = 24
NONE = -1.0
NOISE = 1e-13
TOUCH = 1e-10


@kernel
def evaluate(a: FloatArray, at: int, n: int, x: float) -> float:
    """Return Σ a[at + k]·x^k, k = 0 … n."""
    total = a[at + n]
    for k in range(n - 1, -1, -1):
        total = total * x + a[at + k]
    return total


@kernel
def evaluate_derivative(a: FloatArray, at: int, n: int, x: float) -> float:
    """Return the derivative of Σ a[at + k]·x^k."""
    total = 0.0
    for k in range(n, 0, -1):
        total = total * x + k * a[at + k]
    return total


@kernel
def _may_cross(a: FloatArray, at: int, n: int, hi: float) -> bool:
    """Return False where the constant term outweighs all others up to hi: no root can be there."""
    total = 0.0
    for k in range(n, 0, -1):
        total = (total + abs(a[at + k])) * hi
    return not abs(a[at]) > total


@kernel
def _sign_changes(a: FloatArray, at: int, n: int, lo: float, width: float, b: int) -> tuple[int, float, float]:
    """Count sign changes of the Bernstein coefficients on (lo, lo + width); return also the first and last sign."""
    for k in range(n + 1):
        a[b + k] = a[at + k]
    if lo != 0.0:
        for i in range(n):
            for k in range(n - 1, i - 1, -1):
                a[b + k] += lo * a[b + k + 1]
    power = 1.0
    for k in range(n + 1):
        a[b + k] *= power
        power *= width
    # Reversed polynomial shifted by one: its coefficients are the Bernstein ones times binomials, right end first.
    for k in range((n + 1) // 2):
        a[b + k], a[b + n - k] = a[b + n - k], a[b + k]
    for i in range(n):
        for k in range(n - 1, i - 1, -1):
            a[b + k] += a[b + k + 1]
    changes = 0
    sign = 0.0
    first = 0.0
    binomial = 1.0
    for i in range(n + 1):  # from the left end of the interval to the right
        c = a[b + n - i]
        if abs(c) > NOISE * binomial:
            now = 1.0 if c > 0.0 else -1.0
            if sign == 0.0:
                first = now
            elif now != sign:
                changes += 1
            sign = now
        binomial = binomial * (n - i) / (i + 1)
    return changes, first, sign


@kernel
def _sharpen(a: FloatArray, at: int, n: int, lo: float, hi: float, sign: float) -> float:
    """Return the only root in (lo, hi); `sign` is that of the polynomial just after lo."""
    x = 0.5 * (lo + hi)
    for _ in range(200):
        value = a[at + n]
        slope = 0.0
        for k in range(n - 1, -1, -1):
            slope = slope * x + value
            value = value * x + a[at + k]
        if value == 0.0:
            return x
        if (value > 0.0) == (sign > 0.0):
            lo = x
        else:
            hi = x
        step = value / slope if slope != 0.0 else 2.0 * (hi - lo)
        new = x - step
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        if abs(new - x) <= 2.3e-16 * abs(new) or new == lo or new == hi:
            return new
        x = new
    return x


@kernel
def first_root(a: FloatArray, at: int, n: int, lo: float, hi: float, direction: float, b: int) -> float:
    """Return the first crossing of Σ a[at + k]·x^k in (lo, hi), or NONE.

    direction -1: only from + to -; +1: only from - to +. From a[b] on there is scratch for n + 1 numbers.
    """
    if lo == 0.0 and not _may_cross(a, at, n, hi):
        return NONE
    smallest = TOUCH * (hi - lo)
    left = lo
    width = hi - lo
    before = 0.0
    while left < hi:
        changes, first, last = _sign_changes(a, at, n, left, width, b)
        if changes >= 2 and width > smallest:
            width *= 0.5
            continue
        if before * first < 0.0 and first * direction > 0.0:
            return left  # the root lies exactly where two intervals meet
        if changes % 2 == 1 and first * direction < 0.0:
            return _sharpen(a, at, n, left, left + width, first)
        # Nothing (or the other direction, or a touch) here: go right, with the widest dyadic interval that fits.
        before = last if last != 0.0 else before
        left += width
        if left >= hi * (1.0 - 1e-15):
            break
        width = _next_width(left - lo, width, hi - lo)
    return NONE


@kernel
def _next_width(done: float, width: float, whole: float) -> float:
    """Return the largest dyadic interval that may start after `done` of the whole."""
    cells = np.round(done / width)
    while width < whole and cells % 2.0 == 0.0:
        width *= 2.0
        cells *= 0.5
    return min(width, whole - done)
