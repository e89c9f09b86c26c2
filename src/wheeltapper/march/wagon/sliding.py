"""When dry friction begins to slide and sticks again: what a step may hold of it, the change, and several at once."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import sliders
from wheeltapper.march.wagon.crossing import may_cross
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.resting import decide_rest

NEARLY = 0.98
"""Share of its limit, at a stage of a step, from which on the force of a rigid slider is searched for the limit."""


@kernel
def mark_sliders(
    h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, begin: FloatArray, finish: FloatArray,
    pieces: FloatArray,
) -> bool:  # fmt: skip
    """Mark the sliders that may change in a step from w to y, whose rates are those; return True if there are any."""
    found = False
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        side = sliders.side_of(pieces[element])
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

    Return the time by which it is moved. Rigid ones are decided by `settle_rigid`; one that comes to rest is LOOSE.
    """
    rest, near = 0.0, 2.0 * sliders.SLACK
    if pieces[element] == asm.STICKS:
        near += max(sliders.slider_gap(element, data, plan, y, pieces), 0.0)
    else:
        rest = -sliders.rate_between_ends(element, data, plan, y) / sliders.rate_between_ends(element, data, plan, rate)
        if not abs(rest) < 0.01 * h:
            rest = 0.0
        for i in range(y.shape[0]):
            y[i] += rest * rate[i]
    for other in range(plan[asm.LAWS], pieces.shape[0]):
        within = plan[plan[asm.AT_INSIDE] + other]
        if other != element and (within < 0 or not _changes(other, near, data, plan, y, rate, pieces)):
            continue
        side = sliders.side_of(pieces[other])
        if within < 0:
            pieces[other] = asm.STICKS if side == 0.0 else asm.LOOSE
        else:
            if side != 0.0:
                pieces[other] = asm.STICKS
            else:
                side = 1.0 if sliders.sticking_pull(other, data, plan, y, pieces) > 0.0 else -1.0
                pieces[other] = asm.STICKS + side
            stretch = sliders.slider_number(other, asm.SLIDER_FORCE, data, plan)
            stretch /= sliders.slider_number(other, asm.SLIDER_STIFFNESS, data, plan)
            y[within] += sliders.deflection(other, data, plan, y) - side * stretch
    return rest


@kernel
def _changes(
    element: int, near: float, data: FloatArray, plan: IntArray, w: FloatArray, rate: FloatArray, pieces: FloatArray
) -> bool:
    """Return True for a slider with a spring that is at its change, too; `near` its limit is at it."""
    side, v = sliders.side_of(pieces[element]), sliders.rate_between_ends(element, data, plan, w)
    gap = sliders.slider_gap(element, data, plan, w, pieces)
    if side != 0.0:
        return gap < 2.0 * sliders.slow_rate(data) and side * sliders.rate_between_ends(element, data, plan, rate) < 0.0
    return gap < near and v * sliders.deflection(element, data, plan, w) > 0.0


@kernel
def settle_rigid(
    t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray,
    out: FloatArray,
) -> None:  # fmt: skip
    """Decide which of the rigid sliders at rest stick, and how others begin to slide; `out` is scratch memory.

    The rates of those that stick are made zero in the state.
    """
    first = plan[asm.RIGID_FROM]
    count = pieces.shape[0] - first
    stuck, rests = np.zeros(count), np.zeros(count, dtype=np.bool_)
    for i in range(count):
        piece = pieces[first + i]
        stuck[i] = 1.0 if sliders.side_of(piece) == 0.0 and piece != asm.LOOSE else 0.0
        slow = abs(sliders.rate_between_ends(first + i, data, plan, w)) <= sliders.slow_rate(data)
        rests[i] = slow or stuck[i] != 0.0 or piece == asm.LOOSE
    which = np.flatnonzero(rests)
    if len(which) == 0:
        return
    for k in range(len(which)):
        pieces[first + which[k]] = asm.LOOSE
    rates(t, data, plan, w, wheels, pieces, Q, out, True)
    free, limits, forces = np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(count):
        free[i] = sliders.rate_between_ends(first + i, data, plan, out)
        limits[i] = sliders.slider_number(first + i, asm.SLIDER_LIMIT, data, plan)
        forces[i] = sliders.slider_number(first + i, asm.SLIDER_FORCE, data, plan)
    Y = np.ascontiguousarray(sliders.yields_between(count, data, plan)[which][:, which])
    pulls, ends = np.zeros(len(which)), np.zeros(len(which))
    sides = decide_rest(Y, free[which], stuck[which], limits[which], forces[which], pulls, ends)
    for k in range(len(which)):
        full = asm.FULL_FORTH if ends[k] > 0.0 else asm.FULL_BACK
        sticks = full if ends[k] != 0.0 else asm.STICKS
        pieces[first + which[k]] = asm.STICKS + sides[k] if sides[k] != 0.0 else sticks
    sliders.enter_holds(data, plan, pieces)
    sliders.hold_rigid(data, plan, pieces, w)  # as accelerations, so rates: what is left of them is rounding
