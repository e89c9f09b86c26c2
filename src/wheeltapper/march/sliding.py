"""When dry friction begins to slide and sticks again: what a step may hold of it, the change, and several at once."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import assembly as asm
from wheeltapper.march import sliders
from wheeltapper.march.crossing import may_cross
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray, IntArray
from wheeltapper.march.rates import rates

NEARLY = 0.98
"""Share of its limit, at a stage of a step, from which on the force of a rigid slider is searched for the limit."""
TURNS_BACK = 1e-9
"""Share of what its own force accelerates by which a slider has to be drawn back in order to stick."""


@kernel
def mark_sliders(
    h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, begin: FloatArray, finish: FloatArray,
    pieces: FloatArray,
) -> bool:  # fmt: skip
    """Mark the sliders that may change in a step from w to y, whose rates are those; return True if there are any."""
    found = False
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        side = pieces[element] - asm.STICKS
        if side == 0.0 and element >= plan[asm.RIGID_FROM]:
            may = data[sliders.hold_row(sliders.USES, pieces, plan) + element - plan[asm.RIGID_FROM]] > NEARLY
        else:
            r0 = side * sliders.rate_between_ends(element, data, plan, begin)
            r1 = side * sliders.rate_between_ends(element, data, plan, finish)
            if side == 0.0:
                steep = sliders.slider_number(element, asm.SLIDER_STIFFNESS, data, plan)
                steep /= sliders.slider_number(element, asm.SLIDER_LIMIT, data, plan)
                r0 = (
                    -steep
                    * np.sign(sliders.deflection(element, data, plan, w))
                    * sliders.rate_between_ends(element, data, plan, w)
                )
                r1 = (
                    -steep
                    * np.sign(sliders.deflection(element, data, plan, y))
                    * sliders.rate_between_ends(element, data, plan, y)
                )
            g0, g1 = (
                sliders.slider_gap(element, data, plan, w, pieces),
                sliders.slider_gap(element, data, plan, y, pieces),
            )
            may = may_cross(h, g0, r0, g1, r1)
        data[plan[asm.AT_SLIDERS] + (element - plan[asm.LAWS]) * asm.SLIDER_COLUMNS + asm.SLIDER_MARK] = (
            1.0 if may else 0.0
        )
        found = found or may
    return found


@kernel
def change_sliders(
    element: int, h: float, data: FloatArray, plan: IntArray, y: FloatArray, rate: FloatArray, pieces: FloatArray
) -> float:
    """Let a slider begin to slide or stick, and others with springs that do it now; move the state to that time.

    Return the time by which it is moved. A rigid one that comes to rest is LOOSE until `settle_rigid`.
    """
    rest = 0.0
    if pieces[element] != asm.STICKS:
        rest = -sliders.rate_between_ends(element, data, plan, y) / sliders.rate_between_ends(element, data, plan, rate)
        if not abs(rest) < 0.01 * h:
            rest = 0.0
        for i in range(y.shape[0]):
            y[i] += rest * rate[i]
    for other in range(plan[asm.LAWS], pieces.shape[0]):
        within = plan[plan[asm.AT_INSIDE] + other]
        if other != element and (within < 0 or not _changes(other, data, plan, y, rate, pieces)):
            continue
        side = pieces[other] - asm.STICKS
        if side != 0.0:
            pieces[other] = asm.STICKS if within >= 0 else asm.LOOSE
        else:
            side = 1.0 if sliders.sticking_pull(other, data, plan, y, pieces) > 0.0 else -1.0
            pieces[other] = asm.STICKS + side
        if within >= 0:
            stretch = sliders.slider_number(other, asm.SLIDER_FORCE, data, plan)
            stretch /= sliders.slider_number(other, asm.SLIDER_STIFFNESS, data, plan)
            y[within] += sliders.deflection(other, data, plan, y) - side * stretch
    return rest


@kernel
def _changes(
    element: int, data: FloatArray, plan: IntArray, w: FloatArray, rate: FloatArray, pieces: FloatArray
) -> bool:
    """Return True for a slider with a spring that is at its change, too."""
    side, v = pieces[element] - asm.STICKS, sliders.rate_between_ends(element, data, plan, w)
    gap = sliders.slider_gap(element, data, plan, w, pieces)
    if side != 0.0:
        return gap < 2.0 * sliders.slow_rate(data) and side * sliders.rate_between_ends(element, data, plan, rate) < 0.0
    return gap < 2.0 * sliders.SLACK and v * sliders.deflection(element, data, plan, w) > 0.0


@kernel
def settle_rigid(
    t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray,
    out: FloatArray,
) -> None:  # fmt: skip
    """Decide which of the rigid sliders at rest stick, and how others begin to slide; `out` is scratch memory.

    One after the other whose force is beyond its limit is let go; of those let go, who is drawn back sticks again. The
    rates of those that stick are made zero in the state.
    """
    first = plan[asm.RIGID_FROM]
    count = pieces.shape[0] - first
    sides, limits, free = np.zeros(count), np.zeros(count), np.zeros(count)
    rests = np.zeros(count)
    for i in range(count):
        piece = pieces[first + i]
        is_held = piece == asm.STICKS or piece == asm.LOOSE
        if is_held or abs(sliders.rate_between_ends(first + i, data, plan, w)) <= sliders.slow_rate(data):
            rests[i] = 1.0
            sides[i] = 0.0 if is_held else piece - asm.STICKS
            column = asm.SLIDER_LIMIT if piece == asm.STICKS else asm.SLIDER_FORCE
            limits[i] = sliders.slider_number(first + i, column, data, plan)
            pieces[first + i] = asm.LOOSE
    if not np.any(rests != 0.0):
        return
    sliders.enter_holds(data, plan, pieces)
    rates(t, data, plan, w, wheels, pieces, Q, out, True)
    for i in range(count):
        free[i] = sliders.rate_between_ends(first + i, data, plan, out)
    Y = data[plan[asm.AT_YIELDS] : plan[asm.AT_YIELDS] + count * count].reshape(count, count)
    for _ in range(8 * count):
        need = free.copy()
        chosen = np.zeros(count)
        for i in range(count):
            chosen[i] = 1.0 if rests[i] != 0.0 and sides[i] == 0.0 else 0.0
            pull = sides[i] * sliders.slider_number(first + i, asm.SLIDER_FORCE, data, plan)
            for j in range(count):
                need[j] -= Y[j, i] * pull
        pulls = sliders.inverse_of_some(chosen, data, plan) @ (need * chosen)
        worst, which = 1.0 + sliders.SLACK, -1
        for i in range(count):
            if chosen[i] != 0.0 and abs(pulls[i]) > worst * limits[i]:
                worst, which = abs(pulls[i]) / limits[i], i
        if which >= 0:
            sides[which] = np.sign(pulls[which])
            continue
        worst = -TURNS_BACK
        for i in range(count):
            if sides[i] != 0.0:
                back = sides[i] * (need[i] - Y[i] @ pulls) / (Y[i, i] * limits[i])
                if back < worst:
                    worst, which = back, i
        if which < 0:
            break
        sides[which] = 0.0
    for i in range(count):
        if rests[i] != 0.0:
            pieces[first + i] = asm.STICKS + sides[i]
    sliders.enter_holds(data, plan, pieces)
    sliders.hold_rigid(data, plan, pieces, w)  # as accelerations, so rates: what is left of them is rounding
