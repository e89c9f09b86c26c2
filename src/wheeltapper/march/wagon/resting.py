"""Which rigid sliders at rest stick, and how the others begin to slide: all of them are decided together.

The accelerations of sliders whose rates are zero are a = b - Y·f, b those without their forces f, -B₋ ≤ f ≤ B₊. What is
accelerated resists with its bound, f = B₊ where a > 0 and f = -B₋ where a < 0; elsewhere a = 0. So f solves

    ½·f·Y·f - b·f = min,  -B₋ ≤ f ≤ B₊,

which is convex: a is unique, f up to forces that move nothing, Y·f = 0, of which it has the least. It is found by the
method of active sets (Nocedal and Wright, Numerical Optimization, section 16.5):

    all forces are inside of their bounds, and zero
    until nothing changes:
        go towards the least forces by which those inside have a = 0; who comes to a bound on the way stays at it
        there?  those at a bound whose acceleration is on the other side are inside again, and of those that would not
                move the ones with which all forces would be less
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray

REDUNDANT = 1e-10
"""Share of the largest singular value of Y below which others are zero."""
REGULAR = 1e-7
"""One over the condition up to which Y is regular."""
TIE = 1e-9
"""Share of its bound below it to which the force of a slider that sticks may come; those that are nearer slide."""
AT_BOUND = 1e-11
"""Share of its bound within which a force is at it: rounding."""
BACKWARD, FORTHWARD = range(2)
"""Columns of bounds."""
MOST_RETURNS = 20
"""Most returns of one slider from its bound; only rounding would have it return without an end."""


@kernel
def _inverted(A: FloatArray, out: FloatArray) -> bool:
    """Write the inverse of a symmetric matrix, by Cholesky's factors; return False where it is, or is nearly, singular.

    That is far quicker than singular values, which tell what is redundant.
    """
    count = len(A)
    L, largest = np.zeros_like(A), 0.0
    for j in range(count):
        largest = max(largest, A[j, j])
        for i in range(j, count):
            rest = A[i, j]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = rest / L[j, j]
            elif rest > REGULAR * A[j, j]:
                L[j, j] = np.sqrt(rest)
            else:
                return False
    for j in range(count):  # columns of the inverse of L, in place of it
        L[j, j] = 1.0 / L[j, j]
        for i in range(j + 1, count):
            total = 0.0
            for k in range(j, i):
                total -= L[i, k] * L[k, j]
            L[i, j] = total / L[i, i]
    largest_inverse = 0.0
    for i in range(count):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, count):
                total += L[k, i] * L[k, j]
            out[i, j] = out[j, i] = total
        largest_inverse = max(largest_inverse, out[i, i])
    return count * count * largest * largest_inverse * REGULAR < 1.0


@kernel
def inverse_of_some(chosen: FloatArray, Y: FloatArray) -> FloatArray:
    """Return Y⁺ of the sliders for which `chosen` is one; zero for others."""
    which = np.flatnonzero(chosen)
    count = len(which)
    among, inverse = np.empty((count, count)), np.empty((count, count))
    for i in range(count):
        for j in range(count):
            among[i, j] = Y[which[i], which[j]]
    if not _inverted(among, inverse):
        inverse = np.ascontiguousarray(np.linalg.pinv(among, REDUNDANT))
    out = np.zeros_like(Y)
    for i in range(count):
        for j in range(count):
            out[which[i], which[j]] = inverse[i, j]
    return out


@kernel
def bound_to(side: float, i: int, bounds: FloatArray) -> float:
    """Return the bound of a slider to a side, -1 or 1."""
    return bounds[i, FORTHWARD] if side > 0.0 else bounds[i, BACKWARD]


@kernel
def _yields_alone(i: int, Y: FloatArray, inverse: FloatArray) -> float:
    """Return how a slider yields to its own force while those inside of their bounds do not; 0 where they hold it."""
    own = Y[i, i] - Y[i] @ (inverse @ Y[i])
    return own if own > REDUNDANT * Y[i, i] else 0.0


@kernel
def _go_towards(goal: FloatArray, bounds: FloatArray, f: FloatArray, ends: FloatArray) -> bool:
    """Move the forces inside to a goal; return True if any came to its bound before, where all of them stop."""
    part = 1.0
    for i in range(f.shape[0]):
        bound = bound_to(goal[i], i, bounds)
        if ends[i] == 0.0 and abs(goal[i]) > (1.0 + AT_BOUND) * bound:
            part = min(part, max((np.sign(goal[i]) * bound - f[i]) / (goal[i] - f[i]), 0.0))
    stopped = False
    for i in range(f.shape[0]):
        if ends[i] != 0.0:
            continue
        f[i] += part * (goal[i] - f[i])
        side, bound = np.sign(goal[i]), bound_to(goal[i], i, bounds)
        if abs(goal[i]) > (1.0 + AT_BOUND) * bound and side * f[i] >= (1.0 - AT_BOUND) * bound:
            f[i], ends[i], stopped = side * bound, side, True
    return stopped


@kernel
def confine(Y: FloatArray, free: FloatArray, bounds: FloatArray, f: FloatArray, ends: FloatArray) -> FloatArray:
    """Write the forces f of the problem above, and at which bound each is, -1 or 1, or 0; return Y⁺ of the latter.

    `free` are b, (sliders,), and `bounds` B₋ and B₊, (sliders, 2).
    """
    count = free.shape[0]
    f[:] = 0.0
    ends[:] = 0.0
    returns, returned = np.zeros(count), True
    while returned:
        inside = 1.0 - np.abs(ends)
        inverse = inverse_of_some(inside, Y)
        if _go_towards(inverse @ (inside * (free - Y @ (f - inside * f))), bounds, f, ends):
            continue
        a = free - Y @ f
        lean = f - Y @ (inverse @ (inside * f))  # how the sum of f² grows with each force that is held
        returned = False
        for i in range(count):
            own = _yields_alone(i, Y, inverse)
            more = a[i] / own if own > 0.0 else -lean[i]  # by which its force were right
            if ends[i] * more < -AT_BOUND * bound_to(ends[i], i, bounds) and returns[i] < MOST_RETURNS:
                returns[i] += 1.0
                ends[i], returned = 0.0, True
    return inverse


@kernel
def decide_rest(
    Y: FloatArray, free: FloatArray, stuck: FloatArray, limits: FloatArray, forces: FloatArray, f: FloatArray,
    ends: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return to which side each slider slides, -1 or 1, or 0: it sticks; write its force, and which bound it is at.

    Those that were `stuck` (1, otherwise 0) hold up to their `limits`, those that came to rest up to the `forces` with
    which they slide, both (sliders, 2): back and forth.

    Who moves has only the latter, which may move more of them; none has its limit again in the same instant. One at
    its bound that those inside of theirs hold at rest sticks there; any other slides.
    """
    count = free.shape[0]
    most, least = (1.0 - TIE) * limits, (1.0 - TIE) * forces
    bounds = np.where(stuck.reshape(count, 1) != 0.0, most, least)
    sides, changed = np.zeros(count), True
    while changed:
        inverse = confine(Y, free, bounds, f, ends)
        changed = False
        for i in range(count):
            sides[i] = ends[i] if _yields_alone(i, Y, inverse) > 0.0 else 0.0
            if sides[i] != 0.0 and (bounds[i] > least[i]).any():
                bounds[i], changed = least[i], True
    for i in range(count):
        if sides[i] == 0.0 and (bounds[i] < most[i]).any():
            bounds[i], changed = most[i], True
    if changed:  # who has come to rest holds more
        inverse = confine(Y, free, bounds, f, ends)
        for i in range(count):
            if sides[i] == 0.0 and _yields_alone(i, Y, inverse) > 0.0:
                ends[i] = 0.0
    return sides
