"""Events within a step of a vehicle: contacts that may change, the first of them, and maxima of forces.

`kept` (KEPT, lanes) holds each contact's indentation, its rate, the normal force's rate and the force at the step's
start, and a mark; of contacts that may yield also how far they are from the borders of their stretch, with marks.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common.kernel import inlined_kernel, kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import BODY, LANES, MOTION_Z, PLACES, ROLL, TO_RATE
from wheeltapper.march.wagon.contact_laws import is_lossy, is_plastic
from wheeltapper.march.wagon.crossing import Span, at_place, find_fall, first_change, left_to_corner, may_cross
from wheeltapper.march.wagon.elements import deflection
from wheeltapper.march.wagon.passing import SAME, log_peak, may_part
from wheeltapper.march.wagon.sliders import slider_number
from wheeltapper.march.wagon.sliding import MARK_CHANGE, MARK_OPENS
from wheeltapper.march.wagon.wheel_rows import ARM, AWAKE, DELTA_RATE, NORMAL, NORMAL_RATE, ON, ROW_DELTA, SIDES

DELTAS, DELTA_RATES, GROWTHS, FORCES, MARKS, GRIPS, GRIP_RATES, TURNS = range(8)
UPPERS, UPPER_RATES, UPPER_MARKS, LOWERS, LOWER_RATES, LOWER_MARKS = range(8, 14)
KEPT = 14
BORDERS = ((UPPER_MARKS, wheel.TO_UPPER), (LOWER_MARKS, wheel.TO_LOWER))
"""Marks of both borders of a stretch, and the rows of the distances to them."""
ROUGHLY_THEN = 1.1
"""Factor on the time of a void's probable change, whose rate is known to some thousandth: the step ends behind it."""
AWAY = 1e-3
"""Place in a step by which an element that begins at a corner has left it."""
SEARCH_NOISE = 1e-11
"""Relative growth of a force in a step up to which it counts as none."""
QUIET_FORCE = 1e-7
"""Relative effect of a change of sign of a force's rate within a step, below which it is rounding and no maximum."""


@kernel
def keep_contacts(wheels: FloatArray, kept: FloatArray) -> None:
    """Keep the quantities of the contacts at a step's start; a force that begins to grow has the rate zero."""
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            lane = o * LANES + i
            kept[DELTAS, lane] = L[ROW_DELTA + i]
            kept[DELTA_RATES, lane] = L[DELTA_RATE + i]
            begins = L[ON + i] != 0.0 and L[NORMAL + i] == 0.0 and L[DELTA_RATE + i] > 0.0
            kept[GROWTHS, lane] = 1e-300 if begins else L[NORMAL_RATE + i]
            kept[FORCES, lane] = L[NORMAL + i]
            kept[MARKS, lane] = 0.0
            kept[GRIPS, lane] = L[wheel.GRIP + i]
            kept[GRIP_RATES, lane] = L[wheel.GRIP_RATE + i]
            kept[UPPERS, lane] = L[wheel.TO_UPPER + i]
            kept[UPPER_RATES, lane] = L[wheel.TO_UPPER_RATE + i]
            kept[UPPER_MARKS, lane] = 0.0
            kept[LOWERS, lane] = L[wheel.TO_LOWER + i]
            kept[LOWER_RATES, lane] = L[wheel.TO_LOWER_RATE + i]
            kept[LOWER_MARKS, lane] = 0.0


@inlined_kernel
def _time_to_zero(gap: float, rate: float, bend: float) -> float:
    """Return when a positive gap with a rate and an acceleration becomes zero; infinity where it does not."""
    inside = rate * rate - 2.0 * bend * gap
    if gap <= 0.0 or inside <= 0.0:
        return np.inf
    root = sqrt(inside)
    if rate < 0.0:
        return 2.0 * gap / (root - rate)
    return -(rate + root) / bend if bend < 0.0 else np.inf


@kernel
def time_to_border(longest: float, data: FloatArray, wheels: FloatArray, rates: FloatArray) -> float:
    """Return the probable time at which the next contact comes to a border of its law; at most `longest`.

    It is then so far beyond the border that the state tells it from one that is not there yet.
    """
    soonest, near = longest, SAME * data[asm.STATIC_INDENTATION]
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        for i in range(LANES):
            if L[ON + i] == 0.0:
                continue
            at = int(L[BODY * LANES + i]) * PLACES + TO_RATE
            bend = rates[at + MOTION_Z] + L[SIDES + i] * L[ARM + i] * rates[at + ROLL]
            if L[wheel.TO_UPPER + i] < np.inf:
                soonest = min(soonest, _time_to_zero(near + L[wheel.TO_UPPER + i], L[wheel.TO_UPPER_RATE + i], bend))
            if L[wheel.TO_LOWER + i] < np.inf:
                soonest = min(soonest, _time_to_zero(near + L[wheel.TO_LOWER + i], L[wheel.TO_LOWER_RATE + i], -bend))
    return soonest


@kernel
def time_to_change(longest: float, data: FloatArray, wheels: FloatArray, rates: FloatArray) -> float:
    """Return the probable time of the next change of a contact, from its rate and acceleration; at most `longest`."""
    soonest = longest
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if not may_part(data, L):
            continue
        for i in range(LANES):
            sign = 2.0 * L[ON + i] - 1.0
            if L[wheel.VOID_FLAG] != 0.0:
                when = _time_to_zero(sign * L[ROW_DELTA + i], sign * L[DELTA_RATE + i], 0.0)
                soonest = min(soonest, ROUGHLY_THEN * when)
            if L[SIDES + i] == 0.0:
                continue
            at = int(L[BODY * LANES + i]) * PLACES + TO_RATE
            bend = -sign * (rates[at + MOTION_Z] + L[SIDES + i] * L[ARM + i] * rates[at + ROLL])
            when = _time_to_zero(sign * L[ROW_DELTA + i], sign * L[DELTA_RATE + i], bend)
            if when > 0.0:
                soonest = min(soonest, when)
    return soonest


@kernel
def time_to_release(longest: float, wheels: FloatArray) -> float:
    """Return the probable time at which the next grip of an indented contact changes its sign; at most `longest`."""
    soonest = longest
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            if L[AWAKE] == 0.0 or L[SIDES + i] == 0.0 or L[ROW_DELTA + i] <= 0.0:
                continue
            sign = 2.0 * L[ON + i] - 1.0
            if sign * L[wheel.GRIP + i] > 0.0 and sign * L[wheel.GRIP_RATE + i] < 0.0:
                soonest = min(soonest, -L[wheel.GRIP + i] / L[wheel.GRIP_RATE + i])
    return soonest


@kernel
def _may_change(h: float, i: int, lane: int, indents: bool, near: float, L: FloatArray, kept: FloatArray) -> bool:
    """Return True where a lossy contact may change in a step; `indents`: where its indentation may change its sign.

    A closed one opens where indentation or grip ends, an open one closes where there are both. An indentation below
    `near` is one that has just ended, or rounding.
    """
    sign = 2.0 * L[ON + i] - 1.0
    before, after = sign * kept[GRIPS, lane], sign * L[wheel.GRIP + i]
    grips = may_cross(h, before, sign * kept[GRIP_RATES, lane], after, sign * L[wheel.GRIP_RATE + i])
    if sign > 0.0:
        return indents or grips
    indents = indents or max(kept[DELTAS, lane], L[ROW_DELTA + i]) > near
    return indents and (grips or min(before, after) < 0.0)


@kernel
def _mark_borders(h: float, treads: int, wheels: FloatArray, kept: FloatArray) -> bool:
    """Mark the contacts that may come to a border of their stretch within a step; return True if there are any."""
    found = False
    for o in range(treads):
        L = wheels[o]
        for i in range(LANES):
            lane = o * LANES + i
            if kept[UPPERS, lane] < np.inf and may_cross(
                h, kept[UPPERS, lane], kept[UPPER_RATES, lane], L[wheel.TO_UPPER + i], L[wheel.TO_UPPER_RATE + i]
            ):
                kept[UPPER_MARKS, lane] = 1.0
                found = True
            if kept[LOWERS, lane] < np.inf and may_cross(
                h, kept[LOWERS, lane], kept[LOWER_RATES, lane], L[wheel.TO_LOWER + i], L[wheel.TO_LOWER_RATE + i]
            ):
                kept[LOWER_MARKS, lane] = 1.0
                found = True
    return found


@kernel
def mark_changes(
    h: float, data: FloatArray, plan: IntArray, y: FloatArray, wheels: FloatArray, pieces: FloatArray, kept: FloatArray
) -> bool:
    """Mark the contacts that may change within a step; return True if there are any, or an element passes a corner."""
    found = False
    lossy, near = is_lossy(data), SAME * data[asm.STATIC_INDENTATION]
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if not may_part(data, L):
            continue
        is_void = L[wheel.VOID_FLAG] != 0.0
        for i in range(LANES):
            if L[SIDES + i] == 0.0 and not is_void:
                continue
            lane = o * LANES + i
            sign = 2.0 * L[ON + i] - 1.0
            before, after = sign * kept[DELTAS, lane], sign * L[ROW_DELTA + i]
            may = may_cross(h, before, sign * kept[DELTA_RATES, lane], after, sign * L[DELTA_RATE + i])
            if lossy and not is_void:
                may = _may_change(h, i, lane, may, near, L, kept)
            if may:
                kept[MARKS, lane] = 1.0
                found = True
    if is_plastic(data) and _mark_borders(h, int(data[asm.TREADS]), wheels, kept):
        found = True
    return found


@kernel
def mark_corners(
    h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, begin: FloatArray, finish: FloatArray,
    pieces: FloatArray,
) -> bool:  # fmt: skip
    """Mark the elements that may pass corners in a step from w to y, whose rates are those; return True if any may."""
    found = False
    for element in range(plan[asm.LAWS]):
        d0, d1 = deflection(element, data, plan, w), deflection(element, data, plan, y)
        r0, r1 = deflection(element, data, plan, begin), deflection(element, data, plan, finish)
        mark = 0
        for upper, bit in ((False, MARK_CHANGE), (True, MARK_OPENS)):
            sign = -1.0 if upper else 1.0
            g0 = left_to_corner(element, upper, d0, data, plan, pieces)
            g1 = left_to_corner(element, upper, d1, data, plan, pieces)
            if may_cross(h, g0, sign * r0, g1, sign * r1):
                mark += bit
        data[plan[asm.AT_MARKS] + element] = mark
        found = found or mark > 0
    return found


@kernel
def first_event(y: FloatArray, pieces: FloatArray, kept: FloatArray, span: Span) -> tuple[float, int, int, int, int]:
    """Return the place of the first event in a step (2 if there is none) and its contact, or its element and corner.

    Last comes the row of the contact that falls through zero: of δ, or of the distance to a border of its law.
    """
    at = 2.0
    contact = -1
    row = ROW_DELTA
    element = -1
    passed = -1
    for lane in range(kept.shape[1]):
        if kept[MARKS, lane] != 0.0:
            kept[MARKS, lane] = 0.0
            sign = 2.0 * span.wheels[lane // LANES, ON + lane % LANES] - 1.0
            place = first_change(lane, ROW_DELTA, sign, span)
            if place < at:
                at, contact = place, lane
    if is_plastic(span.data):
        for lane in range(LANES * int(span.data[asm.TREADS])):
            for mark, gap in BORDERS:
                if kept[mark, lane] != 0.0:
                    kept[mark, lane] = 0.0
                    place = first_change(lane, gap, 1.0, span)
                    if place < at:
                        at, contact, row = place, lane, gap
    laws = span.plan[asm.LAWS]
    for number in range(pieces.shape[0]):
        if number < laws:
            mark = int(span.data[span.plan[asm.AT_MARKS] + number])
        else:
            mark = int(slider_number(number, asm.SLIDER_MARK, span.data, span.plan))
        for k, which in enumerate((MARK_CHANGE, MARK_OPENS)):
            if mark & which == 0:
                continue
            lane = kept.shape[1] + number + k * pieces.shape[0]
            gap = at_place(0.0, lane, ROW_DELTA, span)
            place = 0.0  # where another event has just come before
            if gap > 0.0 or (number < laws and at_place(AWAY, lane, ROW_DELTA, span) > gap):
                place = first_change(lane, ROW_DELTA, 1.0, span)
            if place < at:
                at, contact, element = place, -1, number
                passed = int(pieces[number]) + k if number < laws else which
    return at, contact, element, passed, row


@kernel
def _turn_between(h: float, growth: float, before: float, after_growth: float, after: float) -> float:
    """Return where, within a step, a force that rises at both ends falls most, or the other way round; 0 where not.

    By the cubic through both ends.
    """
    begins, ends, rise = growth * h, after_growth * h, after - before
    bend, twist = 3.0 * rise - 2.0 * begins - ends, begins + ends - 2.0 * rise
    if twist == 0.0:
        return 0.0
    x = -bend / (3.0 * twist)
    steepest = begins + bend * x
    turns = 0.0 < x < 1.0 and begins * steepest < 0.0 and abs(steepest) > QUIET_FORCE * max(before, after)
    return x if turns else 0.0


@kernel
def mark_maxima(h: float, changed: int, lossy: bool, wheels: FloatArray, kept: FloatArray) -> bool:
    """Mark the contacts whose force has a maximum within a step; return True if there are any."""
    found = False
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] == 0.0:
            continue
        for i in range(LANES):
            lane = o * LANES + i
            growth, after = kept[GROWTHS, lane], L[NORMAL_RATE + i]
            if lossy and L[ON + i] != 0.0 and growth * after > 0.0:
                kept[TURNS, lane] = _turn_between(h, growth, kept[FORCES, lane], after, L[NORMAL + i])
                if kept[TURNS, lane] > 0.0:
                    kept[MARKS, lane] = after
                    found = True
                continue
            if L[ON + i] == 0.0 or growth * h <= SEARCH_NOISE * abs(kept[FORCES, lane]) or after > 0.0:
                continue
            if (growth - after) * h > QUIET_FORCE * abs(L[NORMAL + i]) or lane == changed:
                kept[MARKS, lane] = min(after, -1e-300)
                found = True
    return found


@kernel
def log_maxima(kept: FloatArray, span: Span, peaks: FloatArray, S: FloatArray) -> None:
    """Find and log the marked maxima."""
    for lane in range(kept.shape[1]):
        if kept[MARKS, lane] != 0.0:
            growth, after = kept[GROWTHS, lane], kept[MARKS, lane]
            low, high = 0.0, 1.0
            kept[MARKS, lane] = 0.0
            if growth * after > 0.0:
                turn = kept[TURNS, lane]
                between = at_place(turn, lane, NORMAL_RATE, span)
                if between * growth >= 0.0:
                    continue
                if growth > 0.0:
                    high, after = turn, between
                else:
                    low, growth = turn, between
            x = find_fall(low, high, growth, after, lane, NORMAL_RATE, 1.0, span)
            log_peak(span.t + x * span.h, lane, at_place(x, lane, NORMAL, span), 0.0, peaks, S)


@kernel
def log_corners(
    t: float, pulse: float, corner: float, wheels: FloatArray, kept: FloatArray, peaks: FloatArray, S: FloatArray
) -> None:  # fmt: skip
    """Log the forces with a maximum at a kink or jump of the input, or where two steps meet; `kept` is from before it.

    `corner` is 1 for the former, and 0 for the latter: there a force does not jump but for the steps' errors.
    """
    for lane in range(kept.shape[1]):
        L = wheels[lane // LANES]
        i = lane % LANES
        if L[AWAKE] == 0.0 or (L[ON + i] == 0.0 and kept[FORCES, lane] == 0.0):
            continue
        before, after = kept[FORCES, lane], L[NORMAL + i]
        least = QUIET_FORCE * max(abs(before), abs(after))
        growth, after_growth = kept[GROWTHS, lane] * pulse, L[NORMAL_RATE + i] * pulse
        if corner == 0.0:
            if growth > 0.0 and after_growth < 0.0 and growth - after_growth > least:
                log_peak(t, lane, max(before, after), corner, peaks, S)
            continue
        rose, falls = growth > least, after_growth < least
        if (
            (rose and before > after + least)
            or (falls and after > before + least)
            or (rose and abs(after - before) <= least and after_growth < -least)
        ):
            log_peak(t, lane, max(before, after), corner, peaks, S)
