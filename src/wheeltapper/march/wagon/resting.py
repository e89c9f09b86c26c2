"""Which rigid sliders at rest stick, and how the others begin to slide: all of them are decided together.

The accelerations of sliders whose rates are zero are a = b - Y·f, b those without their forces f, |f| ≤ B. What is
accelerated resists with its bound, f = B where a > 0 and f = -B where a < 0; elsewhere a = 0. So f solves

    ½·f·Y·f - b·f = min,  |f| ≤ B,

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
TIE = 1e-9
"""Share of its bound below it to which the force of a slider that sticks may come; those that are nearer slide."""
AT_BOUND = 1e-11
"""Share of its bound within which a force is at it: rounding."""
MOST_RETURNS = 20
"""Most returns of one slider from its bound; only rounding would have it return without an end."""


@kernel
def inverse_of_some(chosen: FloatArray, Y: FloatArray) -> FloatArray:
    """Return Y⁺ of the sliders for which `chosen` is one; zero for others."""
    count = chosen.shape[0]
    among = np.zeros((count, count))
    for i in range(count):
        for j in range(count):
            among[i, j] = Y[i, j] * chosen[i] * chosen[j]
    return np.ascontiguousarray(np.linalg.pinv(among, REDUNDANT))


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
        if ends[i] == 0.0 and abs(goal[i]) > (1.0 + AT_BOUND) * bounds[i]:
            part = min(part, max((np.sign(goal[i]) * bounds[i] - f[i]) / (goal[i] - f[i]), 0.0))
    stopped = False
    for i in range(f.shape[0]):
        if ends[i] != 0.0:
            continue
        f[i] += part * (goal[i] - f[i])
        side = np.sign(goal[i])
        if abs(goal[i]) > (1.0 + AT_BOUND) * bounds[i] and side * f[i] >= (1.0 - AT_BOUND) * bounds[i]:
            f[i], ends[i], stopped = side * bounds[i], side, True
    return stopped


@kernel
def confine(Y: FloatArray, free: FloatArray, bounds: FloatArray, f: FloatArray, ends: FloatArray) -> FloatArray:
    """Write the forces f of the problem above, and at which bound each is, -1 or 1, or 0; return Y⁺ of the latter.

    `free` are b, (sliders,), and `bounds` B.
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
            if ends[i] * more < -AT_BOUND * bounds[i] and returns[i] < MOST_RETURNS:
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
    which they slide. Who moves has only the latter, which may move more of them; none has its limit again in the same
    instant. One at its bound that those inside of theirs hold at rest sticks there; any other slides.
    """
    count = free.shape[0]
    most, least = (1.0 - TIE) * limits, (1.0 - TIE) * forces
    bounds = np.where(stuck != 0.0, most, least)
    sides, changed = np.zeros(count), True
    while changed:
        inverse = confine(Y, free, bounds, f, ends)
        changed = False
        for i in range(count):
            sides[i] = ends[i] if _yields_alone(i, Y, inverse) > 0.0 else 0.0
            if sides[i] != 0.0 and bounds[i] > least[i]:
                bounds[i], changed = least[i], True
    for i in range(count):
        if sides[i] == 0.0 and bounds[i] < most[i]:
            bounds[i], changed = most[i], True
    if changed:  # who has come to rest holds more
        inverse = confine(Y, free, bounds, f, ends)
        for i in range(count):
            if sides[i] == 0.0 and _yields_alone(i, Y, inverse) > 0.0:
                ends[i] = 0.0
    return sides
