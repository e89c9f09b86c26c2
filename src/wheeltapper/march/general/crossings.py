"""Roots of a polynomial in Bernstein form on (0, 1): every crossing is found.

By Descartes' rule the number of sign changes of the coefficients bounds the number of roots, and is exact when it is 0
or 1. Halving by de Casteljau's scheme isolates each root; regula falsi sharpens it. Two roots closer than TOUCH are a
touch, not a crossing.
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general.layout import BEGIN

NO_CROSSING = -1.0
TOUCH = 1e-10
NOTHING_LEFT = 1e-15
"""Coefficients below this share of the largest one are zero."""
DEEPEST = 40


@uncounted_kernel
def bernstein_value(b: FloatArray, n: int, x: float, work: FloatArray) -> float:
    """Return the polynomial of degree n at x."""
    for k in range(n + 1):
        work[k] = b[k]
    for i in range(n, 0, -1):
        for k in range(i):
            work[k] += x * (work[k + 1] - work[k])
    return work[BEGIN]


@uncounted_kernel
def _halve(b: FloatArray, n: int, left: FloatArray, right: FloatArray) -> None:
    """Write the coefficients on both halves of the interval."""
    for k in range(n + 1):
        right[k] = b[k]
    for i in range(n + 1):
        left[i] = right[BEGIN]
        for k in range(n - i):
            right[k] = 0.5 * (right[k] + right[k + 1])


@uncounted_kernel
def _signs(b: FloatArray, n: int, zero: float) -> tuple[int, float, float]:
    """Return the number of sign changes, the first and the last sign."""
    changes = 0
    first = 0.0
    last = 0.0
    for k in range(n + 1):
        if abs(b[k]) > zero:
            now = 1.0 if b[k] > 0.0 else -1.0
            if last == 0.0:
                first = now
            elif now != last:
                changes += 1
            last = now
    return changes, first, last


@uncounted_kernel
def _sharpen(b: FloatArray, n: int, first: float, work: FloatArray) -> float:
    """Return the only root; `first` is the sign before it."""
    lo = 0.0
    hi = 1.0
    below = bernstein_value(b, n, lo, work) * first
    above = bernstein_value(b, n, hi, work) * first
    if below <= 0.0:
        return lo
    if above >= 0.0:
        return hi
    side = 0
    for _ in range(100):
        x = (lo * above - hi * below) / (above - below)
        value = bernstein_value(b, n, x, work) * first
        if value > 0.0:
            if x - lo < 1e-15:
                return x
            lo = x
            below = value
            if side == 1:
                above *= 0.5
            side = 1
        else:
            if hi - x < 1e-15:
                return x
            hi = x
            above = value
            if side == -1:
                below *= 0.5
            side = -1
        if hi - lo < 1e-14 or value == 0.0:
            return x
    return 0.5 * (lo + hi)


@uncounted_kernel
def first_crossing(b: FloatArray, n: int, direction: float, after: float, stack: FloatArray) -> float:
    """Return the first crossing behind `after`, or NO_CROSSING.

    direction 1: from - to + only; -1: from + to - only; 0: both. `stack` has at least DEEPEST + 2 rows of n + 1.
    """
    largest = 0.0
    for k in range(n + 1):
        largest = max(largest, abs(b[k]))
    zero = NOTHING_LEFT * largest
    changes, _, before = _signs(b, n, zero)
    if changes == 0:
        return NO_CROSSING
    work = stack[DEEPEST + 1]
    for k in range(n + 1):
        stack[BEGIN, k] = b[k]
    depth = 0  # rows 0 to depth hold intervals, the leftmost one on top
    level = 0
    left = 0.0
    width = 1.0
    before = 0.0
    while depth >= 0:
        row = stack[depth]
        changes, first, last = _signs(row, n, zero)
        if changes >= 2 and width > TOUCH and level < DEEPEST - 1:
            _halve(row, n, stack[depth + 1], stack[depth])
            depth += 1
            level += 1
            width *= 0.5
            continue
        if before * first < 0.0 and direction * first >= 0.0 and left > after:
            return left
        if changes == 1 and direction * last >= 0.0 and left + width > after:
            root = left + width * _sharpen(row, n, first, work)
            if root > after:
                return root
        if last != 0.0:
            before = last
        left += width
        depth -= 1
        if depth >= 0:  # the next interval is a right half, at least as wide: it ends where its parent does
            cells = left / width
            while cells % 2.0 == 0.0 and width < 1.0:
                width *= 2.0
                cells *= 0.5
                level -= 1
    return NO_CROSSING
