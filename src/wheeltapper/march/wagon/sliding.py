"""When dry friction begins to slide and sticks again, or opens: what a step may hold of it, and the changes."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import elements, sliders
from wheeltapper.march.wagon.crossing import may_cross
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.resting import decide_rest

NEARLY = 0.98
"""Share of its limit, at a stage of a step, from which on the force of a rigid slider is searched for the limit."""


MARK_CHANGE, MARK_OPENS = 1, 2
"""Bits of a slider's mark: its own change may be in a step, and the end of what presses it."""


@kernel
def mark_sliders(
    h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, begin: FloatArray, finish: FloatArray,
    pieces: FloatArray,
) -> bool:  # fmt: skip
    """Mark the sliders that may change in a step from w to y, whose rates are those; return True if there are any."""
    found = False
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        piece = pieces[element]
        side = sliders.side_of(piece)
        mark = 0
        if piece != asm.STICKS and side == 0.0 and piece != asm.PARTED:  # at its limit, until all are decided again
            pass
        elif piece == asm.STICKS and element >= plan[asm.RIGID_FROM]:
            if data[sliders.hold_row(sliders.USES, pieces, plan) + element - plan[asm.RIGID_FROM]] > NEARLY:
                mark = MARK_CHANGE
        else:
            g0, g1 = (
                sliders.slider_gap(element, data, plan, w, pieces),
                sliders.slider_gap(element, data, plan, y, pieces),
            )
            if side != 0.0:
                r0 = sliders.slip_rate(element, side, data, plan, begin, pieces)
                r1 = sliders.slip_rate(element, side, data, plan, finish, pieces)
            elif piece == asm.PARTED:
                r0, r1 = -_share_rate(element, data, plan, w, pieces), -_share_rate(element, data, plan, y, pieces)
            else:
                limit = sliders.slider_number(element, asm.SLIDER_LIMIT, data, plan)
                r0 = sliders.left_to_limit_rate(element, data, plan, w, pieces) / limit
                r1 = sliders.left_to_limit_rate(element, data, plan, y, pieces) / limit
            if may_cross(h, g0, r0, g1, r1):
                mark = MARK_CHANGE
        if piece != asm.PARTED and sliders.is_pressed(element, data, plan):
            g0, g1 = sliders.load_gap(element, data, plan, w, pieces), sliders.load_gap(element, data, plan, y, pieces)
            if may_cross(
                h, g0, _share_rate(element, data, plan, w, pieces), g1, _share_rate(element, data, plan, y, pieces)
            ):
                mark += MARK_OPENS
        data[plan[asm.AT_SLIDERS] + (element - plan[asm.LAWS]) * asm.SLIDER_COLUMNS + asm.SLIDER_MARK] = mark
        found = found or mark > 0
    return found


@kernel
def _share_rate(element: int, data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray) -> float:
    """Return how fast the share of a slider's load grows."""
    force = sliders.pressing_force(element, data, plan, w, pieces)
    share = sliders.pressed_share(element, data, plan, w, pieces)
    if force == 0.0:
        return 0.0
    return share / force * sliders.pressing_rate(element, data, plan, w, pieces)


@kernel
def change_sliders(
    element: int, opens: bool, h: float, data: FloatArray, plan: IntArray, y: FloatArray, rate: FloatArray,
    pieces: FloatArray,
) -> float:  # fmt: skip
    """Let a slider begin to slide or stick, and others with springs that do it now; move the state to that time.

    Or let what presses it end (`opens`), or begin. Return the time by which the state is moved. Rigid ones are decided
    by `settle_rigid`; one that comes to rest is LOOSE.
    """
    rest, near = 0.0, 2.0 * sliders.SLACK
    if opens:
        _part(element, data, plan, y, pieces)
        return rest
    if pieces[element] == asm.PARTED:
        _touch(element, data, plan, y, pieces)
        return rest
    side = sliders.side_of(pieces[element])
    if side == 0.0:
        near += max(sliders.slider_gap(element, data, plan, y, pieces), 0.0)
    else:
        slows = sliders.slip_rate(element, side, data, plan, rate, pieces)
        rest = -sliders.slip_rate(element, side, data, plan, y, pieces) / slows
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
            stretch = max(sliders.bound_of(other, side, False, data, plan, y, pieces), 0.0)
            stretch /= sliders.slider_number(other, asm.SLIDER_STIFFNESS, data, plan)
            y[within] += elements.deflection(other, data, plan, y) - side * stretch
    return rest


@kernel
def _part(element: int, data: FloatArray, plan: IntArray, y: FloatArray, pieces: FloatArray) -> None:
    """Let what presses a slider end: it has no force."""
    pieces[element] = asm.PARTED
    within = plan[plan[asm.AT_INSIDE] + element]
    if within >= 0:
        y[within] += elements.deflection(element, data, plan, y)


@kernel
def _touch(element: int, data: FloatArray, plan: IntArray, y: FloatArray, pieces: FloatArray) -> None:
    """Let what presses a slider begin, without a force: it slides if its ends move, and its bounds grow too slowly."""
    v = elements.rate_between_ends(element, data, plan, y)
    if plan[plan[asm.AT_INSIDE] + element] < 0:
        pieces[element] = asm.LOOSE if abs(v) <= sliders.slow_rate(data) else asm.STICKS + np.sign(v)
        return
    grows = sliders.bound_rate(element, v, True, data, plan, y, pieces)
    slides = sliders.slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * abs(v) > grows
    pieces[element] = asm.STICKS + np.sign(v) if slides else asm.STICKS


@kernel
def _changes(
    element: int, near: float, data: FloatArray, plan: IntArray, w: FloatArray, rate: FloatArray, pieces: FloatArray
) -> bool:
    """Return True for a slider with a spring that is at its change, too; `near` its limit is at it."""
    if pieces[element] == asm.PARTED:
        return False
    side = sliders.side_of(pieces[element])
    gap = sliders.slider_gap(element, data, plan, w, pieces)
    if side != 0.0:
        slows = sliders.slip_rate(element, side, data, plan, rate, pieces) < 0.0
        return gap < 2.0 * sliders.slow_rate(data) and slows
    return gap < near and sliders.left_to_limit_rate(element, data, plan, w, pieces) < 0.0


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
        if piece == asm.PARTED:
            continue
        stuck[i] = 1.0 if sliders.side_of(piece) == 0.0 and piece != asm.LOOSE else 0.0
        slow = abs(elements.rate_between_ends(first + i, data, plan, w)) <= sliders.slow_rate(data)
        rests[i] = slow or stuck[i] != 0.0 or piece == asm.LOOSE
    which = np.flatnonzero(rests)
    if len(which) == 0:
        return
    for k in range(len(which)):
        pieces[first + which[k]] = asm.LOOSE
    rates(t, data, plan, w, wheels, pieces, Q, out, True)
    free, limits, forces = np.zeros(count), np.zeros((count, 2)), np.zeros((count, 2))
    for i in range(count):
        free[i] = elements.rate_between_ends(first + i, data, plan, out)
        for k, side in enumerate((-1.0, 1.0)):
            limits[i, k] = max(sliders.bound_of(first + i, side, True, data, plan, w, pieces), 0.0)
            forces[i, k] = max(sliders.bound_of(first + i, side, False, data, plan, w, pieces), 0.0)
    Y = np.ascontiguousarray(sliders.yields_between(count, data, plan)[which][:, which])
    pulls, ends = np.zeros(len(which)), np.zeros(len(which))
    sides = decide_rest(Y, free[which], stuck[which], limits[which], forces[which], pulls, ends)
    for k in range(len(which)):
        full = asm.FULL_FORTH if ends[k] > 0.0 else asm.FULL_BACK
        sticks = full if ends[k] != 0.0 else asm.STICKS
        pieces[first + which[k]] = asm.STICKS + sides[k] if sides[k] != 0.0 else sticks
    sliders.enter_holds(data, plan, pieces)
    sliders.hold_rigid(data, plan, pieces, w)  # as accelerations, so rates: what is left of them is rounding
