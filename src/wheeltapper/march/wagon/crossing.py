"""Places within a step at which a contact changes, a force has an extremum, or an element reaches a corner.

Between the ends of a step the motion is DOP853's dense solution: `w` at the start, `F` its coefficients.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.contact_laws import is_lossy
from wheeltapper.march.wagon.elements import corner_at, deflection, depends_on_rate
from wheeltapper.march.wagon.growths import time_aside
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.sliders import load_gap, slider_gap, slow_rate
from wheeltapper.march.wagon.unrolled_dop853 import between
from wheeltapper.march.wagon.wheel_rows import GRIP, NORMAL, NORMAL_RATE, ROW_DELTA, ROW_HOLD

CROSSING_NODES = 8
"""Number of places at which a step is examined if a contact may change in it."""
CROSSING_NEAR = 0.02
"""A contact is examined in a step if its cubic interpolant comes nearer to zero than this share of its range."""

QUIET_GRIP = 1e-9
"""Ratio of a force to its elastic part that counts as none."""
MOST_ASIDE = 0.01
"""Share of a step over which a force is differenced, at most."""


FLAT = 10.0
"""A quantity that is so many times what two places beside its least value differ by, twice in turn, is never zero."""


class Span(NamedTuple):
    """A step with its dense solution, and scratch memory to evaluate it."""

    t: float
    h: float
    data: FloatArray
    plan: IntArray
    w: FloatArray
    F: FloatArray
    spare: FloatArray
    wheels: FloatArray
    pieces: FloatArray
    Q: FloatArray
    out: FloatArray


@kernel
def may_cross(h: float, d0: float, r0: float, d1: float, r1: float) -> bool:
    """Return True if the cubic through both ends of a step is negative, or comes near zero."""
    if d1 < 0.0 or r0 >= 0.0 or r1 <= 0.0:
        return d1 < 0.0
    rise = d1 - d0
    c2 = 3.0 * rise - h * (2.0 * r0 + r1)
    c3 = h * (r0 + r1) - 2.0 * rise
    root = np.sqrt(max(c2 * c2 - 3.0 * c3 * h * r0, 0.0))
    x = -h * r0 / (c2 + root) if c2 + root > 0.0 else 0.5
    x = min(max(x, 0.0), 1.0)
    low = d0 + x * (h * r0 + x * (c2 + x * c3))
    return low < CROSSING_NEAR * h * (r1 - r0)


@kernel
def at_place(x: float, lane: int, row: int, span: Span) -> float:
    """Return a quantity (a row of `wheels`) of one contact at a place of the step, 0 to 1.

    Behind the lanes of all contacts are the nonlinear elements; the quantity is then the distance from the lower corner
    of a piece, or the gap of a slider. Behind these they are once more: the upper corner, and what is left of a load.
    """
    between(x, span.w, span.F, span.spare)
    element = lane - LANES * span.wheels.shape[0]
    if element >= 0:
        t, data, plan, pieces = span.t + x * span.h, span.data, span.plan, span.pieces
        again = element >= pieces.shape[0]
        if again:
            element -= pieces.shape[0]
        if element < plan[asm.LAWS]:
            here = deflection(element, data, plan, span.spare)
            return left_to_corner(element, again, here, data, plan, pieces)
        if again:
            return load_gap(element, data, plan, span.spare, pieces)
        if pieces[element] == asm.STICKS and element >= plan[asm.RIGID_FROM]:
            rates(t, data, plan, span.spare, span.wheels, pieces, span.Q, span.out, False)
        return slider_gap(element, data, plan, span.spare, pieces)
    contact_forces(span.t + x * span.h, span.data, span.plan, span.spare, span.wheels)
    if row == NORMAL_RATE and is_lossy(span.data):
        return _growth_at(x, lane, span)
    return span.wheels[lane // LANES, row + lane % LANES]


@kernel
def _growth_at(x: float, lane: int, span: Span) -> float:
    """Return the rate of a force that depends on the indentation's rate, by a difference along the dense solution."""
    away = min(time_aside(span.data) / span.h, MOST_ASIDE)
    between(x + away, span.w, span.F, span.spare)
    contact_forces(span.t + (x + away) * span.h, span.data, span.plan, span.spare, span.wheels)
    more = span.wheels[lane // LANES, NORMAL + lane % LANES]
    between(x - away, span.w, span.F, span.spare)
    contact_forces(span.t + (x - away) * span.h, span.data, span.plan, span.spare, span.wheels)
    return (more - span.wheels[lane // LANES, NORMAL + lane % LANES]) / (2.0 * away * span.h)


@kernel
def find_fall(
    low: float, high: float, f_low: float, f_high: float, lane: int, row: int, sign: float, span: Span
) -> float:
    """Return where sign·(a quantity of one contact) falls through zero: positive at low, negative at high."""
    x, side = high, 0
    for _ in range(60):
        before = x
        x = low + (high - low) * min(max(f_low / (f_low - f_high), 0.001), 0.999)
        f = sign * at_place(x, lane, row, span)
        if f > 0.0:
            low, f_low = x, f
            if side == 1:  # the Illinois method: the value at an end that stays is halved
                f_high *= 0.5
            side = 1
        else:
            high, f_high = x, f
            if side == -1:
                f_low *= 0.5
            side = -1
        if abs(x - before) < 1e-13 or f == 0.0:
            break
    return x


@kernel
def _place_away(x: float, lane: int, row: int, sign: float, span: Span) -> float:
    """Return a place before x at which the contact has moved away from its last change; x itself if none is found."""
    place = x
    for _ in range(40):
        place *= 0.25
        if sign * at_place(place, lane, row, span) > 0.0:
            return place
    return x


@kernel
def _negative_place(middle: float, lane: int, row: int, sign: float, span: Span) -> float:
    """Return a place about `middle` at which sign·(a quantity) is negative, by golden sections; 2 where it is not."""
    left, right = max(middle - 1.0 / CROSSING_NODES, 0.0), min(middle + 1.0 / CROSSING_NODES, 1.0)
    was_flat = False
    for _ in range(40):
        one, other = left + 0.381966 * (right - left), left + 0.618034 * (right - left)
        f_one, f_other = sign * at_place(one, lane, row, span), sign * at_place(other, lane, row, span)
        if min(f_one, f_other) < 0.0:
            return one if f_one < f_other else other
        is_flat = min(f_one, f_other) > FLAT * abs(f_one - f_other)
        if is_flat and was_flat:
            return 2.0
        was_flat = is_flat
        if f_one < f_other:
            right = other
        else:
            left = one
    return 2.0


@kernel
def _both_at(x: float, lane: int, span: Span) -> tuple[float, float]:
    """Return indentation and grip of a contact whose force depends on its rate."""
    depth = at_place(x, lane, ROW_DELTA, span)
    return depth, span.wheels[lane // LANES, GRIP + lane % LANES]


@kernel
def _brief_touch(before: float, x: float, depth: float, grip: float, lane: int, span: Span) -> float:
    """Return where an open contact closes whose grip begins before its indentation ends; 2 where it does not close.

    This is between two places; `depth` and `grip` are those at the first of them.
    """
    _, grip_after = _both_at(x, lane, span)
    if grip_after <= 0.0 or depth <= 0.0 or grip > QUIET_GRIP:
        return 2.0
    if grip > -QUIET_GRIP:  # it was lost at the first place
        before = _place_away(x, lane, GRIP, -1.0, span)
        if before == x:
            return 2.0
        grip = at_place(before, lane, GRIP, span)
    at = find_fall(before, x, -grip, -grip_after, lane, GRIP, -1.0, span)
    return at if at_place(at, lane, ROW_DELTA, span) > 0.0 else 2.0


@kernel
def first_change(lane: int, row: int, sign: float, span: Span) -> float:
    """Return the first place at which a contact changes: sign·(a row) falls through zero; 2 where it does not.

    The row is that of δ, or of the distance to a border of the law. Where the force depends on the rate of δ, what has
    its sign stands for δ.
    """
    lossy = is_lossy(span.data)
    if lossy:
        row = ROW_HOLD
    before, f_before = 0.0, 0.0
    depth, grip = _both_at(0.0, lane, span) if lossy and sign < 0.0 else (0.0, 0.0)
    best, f_best = 1.0, np.inf
    for node in range(1, CROSSING_NODES + 1):
        x = node / CROSSING_NODES
        f = sign * at_place(x, lane, row, span)
        if lossy and sign < 0.0:
            touch = _brief_touch(before, x, depth, grip, lane, span)
            if touch <= 1.0:
                return touch
            depth, grip = _both_at(x, lane, span)
        if f < f_best:
            best, f_best = x, f
        if f < 0.0:
            break
        before, f_before = x, f
    if f_best >= 0.0:
        best = _negative_place(best, lane, row, sign, span)
        if best > 1.0:
            return 2.0
        before = min(before, max(best - 1.0 / CROSSING_NODES, 0.0))
        f_best = sign * at_place(best, lane, row, span)
        f_before = sign * at_place(before, lane, row, span)
    if f_before <= 0.0:  # it changed at the start of the step, or has just begun to move away
        before = _place_away(best, lane, row, sign, span)
        if before == best:
            return best
        f_before = sign * at_place(before, lane, row, span)
    return find_fall(before, best, f_before, f_best, lane, row, sign, span)


@kernel
def left_to_corner(
    element: int, upper: bool, here: float, data: FloatArray, plan: IntArray, pieces: FloatArray
) -> float:  # fmt: skip
    """Return how far a deflection is from the lower or upper corner of an element's piece; negative beyond it.

    At rest a rate is rounding, of either sign.
    """
    piece = int(pieces[element])
    slack = slow_rate(data) if depends_on_rate(element, plan) else 0.0
    if upper:
        return slack + data[corner_at(element, piece + 1, plan)] - here
    return slack + here - data[corner_at(element, piece, plan)]


@kernel
def corner_ahead(element: int, end: float, data: FloatArray, plan: IntArray, pieces: FloatArray) -> int:
    """Return the corner that an element's deflection has passed at the end of a step, -1 where none."""
    if left_to_corner(element, False, end, data, plan, pieces) < 0.0:
        return int(pieces[element])
    return int(pieces[element]) + 1 if left_to_corner(element, True, end, data, plan, pieces) < 0.0 else -1
