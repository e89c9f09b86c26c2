"""The march of a vehicle with many bodies: steps of DOP853 in time, started anew at every event.

until the end:
    step to the next breakpoint at most; again with a shorter one while its error is too large
    an event in it?   a contact opens or closes, also twice within the step; an element reaches a corner of its curve
        make the step again, up to the event; go on from there to where the indentation is zero
    a maximum of a normal force in it?  log it
    at a breakpoint or an event: switch what changes, and start anew
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march import assembly as contract
from wheeltapper.march.assembly import DERAILED, LANES, Assembly, flattened
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.program import (
    DONE,
    FULL,
    IMPACT,
    JOIN,
    JUMP,
    LOSS,
    NOT_FINITE,
    PIECE_COLUMNS,
    SOFT,
    STALLED,
    START,
    STOP,
    TOO_MANY_EVENTS,
    FloatArray,
    IntArray,
)
from wheeltapper.march.rates import deflection, rates, touch
from wheeltapper.march.unrolled_dop853 import (
    DENSE_STAGES,
    POWERS,
    STAGES,
    C,
    between,
    combine,
    combine_dense,
    error,
    finish,
    powers,
)
from wheeltapper.march.wheels import (
    AWAKE,
    CELL,
    CURVE_CELL,
    DELTA,
    DELTA_RATE,
    NORMAL,
    NORMAL_RATE,
    ON,
    ON_DECK,
    PIECE,
    ROWS,
    SHIFT,
    SIDES,
    UNTIL,
    U,
    set_piece,
)

# Columns of a row of steps; the pieces of the elements follow.
STEP_TIME, STEP_LENGTH, STEP_CLOSED, STEP_ELEMENTS = range(4)
EVENT_TIME, EVENT_KIND, EVENT_CONTACT, EVENT_RATE = range(4)
PEAK_TIME, PEAK_CONTACT, PEAK_FORCE, PEAK_CORNER = range(4)
# What is carried from call to call.
TIME, NEXT_LENGTH, ANEW, STEPS, EVENTS, PEAKS, RATES_USED, IDLE = range(8)
CARRIED = 8

NODES = 8
"""A step in which a contact may change is looked at in so many places."""
NEAR = 0.02
"""A contact whose cubic comes nearer to its change than this share of its way is looked at closely."""
SAME = 1e-12
"""Contacts this near to their change, in static indentations, change together with another."""
FIRST_STEP = 0.1
"""First step after an event, in radians of phase."""
SAFETY, SHRINK, GROW, ORDER = 0.9, 0.2, 5.0, 8
QUIET = 1e-9
"""A force whose rate changes its sign with less than this relative effect in a step has no maximum, but noise."""
WAKE = 3e-4
"""A flange nearer to its rail than this, m, is computed."""


@kernel
def awaken(t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Compute those flanges only that are near their rails."""
    treads = int(data[contract.TREADS])
    for o in range(treads, wheels.shape[0]):
        wheels[o, AWAKE] = 1.0
    touch(t, data, plan, w, wheels)
    for o in range(treads, wheels.shape[0]):
        near = 0.0
        for i in range(LANES):
            if wheels[o, SIDES + i] != 0.0 and wheels[o, DELTA + i] > -WAKE:
                near = 1.0
        wheels[o, AWAKE] = near


@kernel
def _corner_at(element: int, corner: int, plan: IntArray) -> int:
    """Return where the deflection of a corner stands in the data."""
    return plan[contract.AT_CORNERS] + 2 * (plan[plan[contract.AT_ELEMENT_CORNERS] + element] + corner)


@kernel
def make_step(
    t: float, h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, wheels: FloatArray, pieces: FloatArray,
    Q: FloatArray, K: FloatArray, P: FloatArray,
) -> None:  # fmt: skip
    """Compute a step from w to y; K[0] are the rates at its start."""
    for stage in range(1, STAGES):
        combine(stage, h, P, K, w, y)
        rates(t + C[stage] * h, data, plan, y, wheels, pieces, Q, K[stage])
    finish(h, P, K, w, y)


@kernel
def dense_step(
    t: float, h: float, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray, wheels: FloatArray, pieces: FloatArray,
    Q: FloatArray, K: FloatArray, P: FloatArray, F: FloatArray, spare: FloatArray,
) -> None:  # fmt: skip
    """Compute the dense solution of a step; K[STAGES] are the rates at its end."""
    for stage in range(STAGES + 1, DENSE_STAGES):
        combine_dense(stage, h, P, K, w, spare)
        rates(t + C[stage] * h, data, plan, spare, wheels, pieces, Q, K[stage])
    powers(h, P, K, w, y, F)


@kernel
def _keep(wheels: FloatArray, row: int, kept: FloatArray) -> None:
    """Copy a row of all octets."""
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            kept[o * LANES + i] = wheels[o, row + i]


@kernel
def _keep_growth(wheels: FloatArray, kept: FloatArray) -> None:
    """Copy the normal forces' rates; a force that begins to grow from zero has a rate of zero, and grows."""
    _keep(wheels, NORMAL_RATE, kept)
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            if wheels[o, ON + i] != 0.0 and wheels[o, NORMAL + i] == 0.0 and wheels[o, DELTA_RATE + i] > 0.0:
                kept[o * LANES + i] = 1e-300


@kernel
def _suspicious(h: float, d0: float, r0: float, d1: float, r1: float) -> float:
    """Return the least value of the cubic through both ends of a step, or a negative one where it comes near zero."""
    if d1 < 0.0:
        return d1
    if r0 >= 0.0 or r1 <= 0.0:
        return d1
    rise = d1 - d0
    c2 = 3.0 * rise - h * (2.0 * r0 + r1)
    c3 = h * (r0 + r1) - 2.0 * rise
    root = np.sqrt(max(c2 * c2 - 3.0 * c3 * h * r0, 0.0))
    x = -h * r0 / (c2 + root) if c2 + root > 0.0 else 0.5
    x = min(max(x, 0.0), 1.0)
    low = d0 + x * (h * r0 + x * (c2 + x * c3))
    return -1.0 if low < NEAR * h * (r1 - r0) else low


@kernel
def _indentation(x: float, t: float, h: float, lane: int, sign: float, data: FloatArray, plan: IntArray, w: FloatArray, F: FloatArray, spare: FloatArray, wheels: FloatArray, row: int) -> float:  # fmt: skip
    """Return a quantity of one contact at a place of the step."""
    between(x, w, F, spare)
    touch(t + x * h, data, plan, spare, wheels)
    return sign * wheels[lane // LANES, row + lane % LANES]


@kernel
def _corner_gap(x: float, element: int, corner: int, data: FloatArray, plan: IntArray, w: FloatArray, F: FloatArray, spare: FloatArray) -> float:
    """Return how far an element is beyond a corner at a place of the step."""
    between(x, w, F, spare)
    return deflection(element, data, plan, spare) - data[_corner_at(element, corner, plan)]


@kernel
def _find(low: float, high: float, f_low: float, f_high: float, t: float, h: float, lane: int, sign: float, data: FloatArray, plan: IntArray, w: FloatArray, F: FloatArray, spare: FloatArray, wheels: FloatArray, row: int) -> float:  # fmt: skip
    """Return where a quantity of one contact falls through zero: positive at low, negative at high."""
    for _ in range(60):
        x = low + (high - low) * min(max(f_low / (f_low - f_high), 0.01), 0.99)
        f = _indentation(x, t, h, lane, sign, data, plan, w, F, spare, wheels, row)
        if f > 0.0:
            low, f_low, f_high = x, f, 0.5 * f_high
        else:
            high, f_high, f_low = x, f, 0.5 * f_low
        if high - low < 1e-13 or f == 0.0:
            break
    return high


@kernel
def _first_change(t: float, h: float, lane: int, sign: float, data: FloatArray, plan: IntArray, w: FloatArray, F: FloatArray, spare: FloatArray, wheels: FloatArray) -> float:  # fmt: skip
    """Return the first place at which a contact changes (sign·δ falls through zero), 2 where it does not."""
    before = 0.0
    f_before = np.inf
    best = 2.0
    f_best = np.inf
    for node in range(1, NODES + 1):
        x = node / NODES
        f = _indentation(x, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
        if f < 0.0:
            low = before
            f_low = f_before if node > 1 else sign * 0.0
            if node == 1:  # the contact may have changed at the step's start: seek a place where it has moved away
                low = x
                for _ in range(40):
                    low *= 0.25
                    f_low = _indentation(low, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
                    if f_low > 0.0:
                        break
                if f_low <= 0.0:
                    return x
            return _find(low, x, f_low, f, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
        if f < f_best:
            best, f_best = x, f
        before, f_before = x, f
    left, right = max(best - 1.0 / NODES, 0.0), min(best + 1.0 / NODES, 1.0)
    for _ in range(40):  # the lowest place between the nodes, by golden sections
        one, other = left + 0.381966 * (right - left), left + 0.618034 * (right - left)
        f_one = _indentation(one, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
        f_other = _indentation(other, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
        low, f = (one, f_one) if f_one < f_other else (other, f_other)
        if f < 0.0:
            f_best = _indentation(left, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
            if f_best <= 0.0:
                return low
            return _find(left, low, f_best, f, t, h, lane, sign, data, plan, w, F, spare, wheels, DELTA)
        if f_one < f_other:
            right = other
        else:
            left = one
    return 2.0


@kernel
def _corner_ahead(element: int, end: float, data: FloatArray, plan: IntArray, pieces: FloatArray) -> int:
    """Return the corner that an element's deflection has passed at the end of a step, -1 where none."""
    piece = int(pieces[element])
    if end < data[_corner_at(element, piece, plan)]:
        return piece
    if end > data[_corner_at(element, piece + 1, plan)]:
        return piece + 1
    return -1


@kernel
def _find_corner(element: int, corner: int, data: FloatArray, plan: IntArray, w: FloatArray, F: FloatArray, spare: FloatArray) -> float:
    """Return the place of the step at which an element passes a corner."""
    low, high = 0.0, 1.0
    below = _corner_gap(1.0, element, corner, data, plan, w, F, spare) > 0.0
    for _ in range(60):
        x = 0.5 * (low + high)
        if (_corner_gap(x, element, corner, data, plan, w, F, spare) > 0.0) == below:
            high = x
        else:
            low = x
    return high


@kernel
def _log_event(t: float, kind: int, lane: int, rate: float, events: FloatArray, S: FloatArray) -> None:
    row = int(S[EVENTS])
    events[row, EVENT_TIME] = t
    events[row, EVENT_KIND] = kind
    events[row, EVENT_CONTACT] = lane
    events[row, EVENT_RATE] = rate
    S[EVENTS] += 1.0


@kernel
def _log_peak(t: float, lane: int, force: float, corner: float, peaks: FloatArray, S: FloatArray) -> None:
    row = int(S[PEAKS])
    peaks[row, PEAK_TIME] = t
    peaks[row, PEAK_CONTACT] = lane
    peaks[row, PEAK_FORCE] = force
    peaks[row, PEAK_CORNER] = corner
    S[PEAKS] += 1.0


@kernel
def _switch(t: float, near: float, wheels: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Open and close all contacts that are at their change, by the sign of the indentation's rate."""
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] == 0.0:
            continue
        for i in range(LANES):
            if L[SIDES + i] == 0.0:
                continue
            delta = L[DELTA + i]
            rate = L[DELTA_RATE + i]
            if L[ON + i] != 0.0 and (delta < -near or (delta <= near and rate < 0.0)):
                L[ON + i] = 0.0
                _log_event(t, LOSS, o * LANES + i, rate, events, S)
            elif L[ON + i] == 0.0 and (delta > near or (delta >= -near and rate > 0.0)):
                L[ON + i] = 1.0
                _log_event(t, IMPACT, o * LANES + i, rate, events, S)


@kernel
def _next_break(data: FloatArray, t: float, wheels: FloatArray) -> float:
    """Return when the next breakpoint of any path comes, or the next wheel enters or leaves the deck."""
    until = data[contract.END]
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            if wheels[o, SIDES + i] == 0.0:
                continue
            until = min(until, wheels[o, UNTIL + i])
            for column in (contract.DECK_FROM, contract.DECK_TO):
                when = wheels[o, column * LANES + i]
                if when > t:
                    until = min(until, when)
    return until


@kernel
def pass_breaks(t: float, data: FloatArray, plan: IntArray, wheels: FloatArray) -> float:
    """Go over to the next pieces of the paths that end here, and on and off the deck; return the hardest join."""
    hardest = 0.0
    pieces = plan[contract.AT_PIECES]
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            if L[SIDES + i] == 0.0:
                continue
            while L[UNTIL + i] <= t:
                piece = int(L[PIECE + i])
                if piece < L[contract.LAST * LANES + i]:
                    L[PIECE + i] = piece + 1
                    hardest = max(hardest, data[pieces + (piece + 1) * PIECE_COLUMNS + JOIN])
                else:
                    back = int(L[contract.LOOP * LANES + i])
                    ended = data[pieces + piece * PIECE_COLUMNS + STOP]
                    L[SHIFT + i] += ended - data[pieces + back * PIECE_COLUMNS + START]
                    L[PIECE + i] = back
                    hardest = max(hardest, L[contract.LOOP_JOIN * LANES + i])
                set_piece(i, data, plan, L)
            inside = L[contract.DECK_FROM * LANES + i] <= t < L[contract.DECK_TO * LANES + i]
            if inside != (L[ON_DECK + i] != 0.0):
                hardest = JUMP
            L[ON_DECK + i] = 1.0 if inside else 0.0
    return hardest


@kernel
def start_kernel(data: FloatArray, plan: IntArray, start: FloatArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray, S: FloatArray) -> None:
    """Set everything at time zero."""
    S[:] = 0.0
    S[NEXT_LENGTH] = FIRST_STEP * data[contract.PULSE]
    w[:] = start
    wheels[:] = 0.0
    for o in range(wheels.shape[0]):
        wheels[o, AWAKE] = 1.0
        for column in range(contract.LANE_COLUMNS):
            for i in range(LANES):
                at = plan[contract.AT_LANES] + (o * contract.LANE_COLUMNS + column) * LANES + i
                wheels[o, column * LANES + i] = data[at]
        for i in range(LANES):
            wheels[o, PIECE + i] = wheels[o, contract.FIRST * LANES + i]
            wheels[o, CELL + i] = -1.0
            wheels[o, CURVE_CELL + i] = -1.0
            set_piece(i, data, plan, wheels[o])
    pass_breaks(0.0, data, plan, wheels)
    touch(0.0, data, plan, w, wheels)
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            wheels[o, ON + i] = 1.0 if wheels[o, SIDES + i] != 0.0 and wheels[o, DELTA + i] > 0.0 else 0.0
    for element in range(pieces.shape[0]):
        firsts = plan[contract.AT_ELEMENT_CORNERS] + element
        last = plan[firsts + 1] - plan[firsts] - 2
        here = deflection(element, data, plan, w)
        pieces[element] = 0.0
        while pieces[element] < last and data[_corner_at(element, int(pieces[element]) + 1, plan)] <= here:
            pieces[element] += 1.0
    S[ANEW] = 1.0


@kernel
def _closed(wheels: FloatArray) -> float:
    """Return the closed contacts as a number, one bit each."""
    total = 0.0
    bit = 1.0
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            total += bit * wheels[o, ON + i]
            bit *= 2.0
    return total


@kernel
def march_kernel(
    data: FloatArray, plan: IntArray, scales: FloatArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray, steps: FloatArray, states: FloatArray,
    events: FloatArray, peaks: FloatArray, K: FloatArray, F: FloatArray, Q: FloatArray, kept: FloatArray,
    S: FloatArray,
) -> int:  # fmt: skip
    """March until the end, or until a table is full; return why it stopped. May be called again.

    `kept` (4, lanes) holds indentations, their rates and the normal forces' rates at the start of a step.
    """
    contacts = wheels.shape[0] * LANES
    elements = pieces.shape[0]
    n = w.shape[0]
    y = np.empty(n)
    spare = np.empty(n)
    P = np.ones(DENSE_STAGES)
    tolerance = data[contract.TOLERANCE]
    end = data[contract.END]
    near = SAME * data[contract.LENGTH]
    while True:
        t = S[TIME]
        if t >= end:
            return DONE
        if S[STEPS] + 2 > steps.shape[0] or S[EVENTS] + contacts > events.shape[0] or S[PEAKS] + 2 * contacts > peaks.shape[0]:
            return FULL
        if S[EVENTS] >= data[contract.EVENT_LIMIT]:
            return TOO_MANY_EVENTS
        if S[ANEW] != 0.0:
            awaken(t, data, plan, w, wheels)
            rates(t, data, plan, w, wheels, pieces, Q, K[0])
            S[RATES_USED] += 1.0
            S[ANEW] = 0.0
        elif wheels.shape[0] > data[contract.TREADS]:
            awaken(t, data, plan, w, wheels)
        _keep(wheels, DELTA, kept[0])
        _keep(wheels, DELTA_RATE, kept[1])
        _keep_growth(wheels, kept[2])
        until = _next_break(data, t, wheels)
        h = min(S[NEXT_LENGTH], data[contract.LONGEST])
        # -- a step whose error is small enough
        grown = GROW
        while True:
            stops = t + 1.01 * h >= until
            if stops:
                h = until - t
            make_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P)
            S[RATES_USED] += STAGES - 1.0
            wrong = error(h, P, K, scales) / tolerance
            if wrong <= 1.0:
                break
            if not wrong < np.inf:
                wrong = 1e6
            h *= max(SAFETY * wrong ** (-1.0 / ORDER), SHRINK)
            grown = 1.0
            if h < 1e-14 * max(t, 1e-3):
                for i in range(n):
                    if not abs(w[i]) < 1e12:
                        return NOT_FINITE
                return STALLED
        if not stops or grown == 1.0:
            S[NEXT_LENGTH] = h * min(max(SAFETY * max(wrong, 1e-12) ** (-1.0 / ORDER), SHRINK), grown)
        rates(t + h, data, plan, y, wheels, pieces, Q, K[STAGES])
        S[RATES_USED] += 1.0
        # -- the first event in it
        is_dense = False
        at = 2.0
        cause = -1
        for lane in range(contacts):
            L = wheels[lane // LANES]
            i = lane % LANES
            if L[SIDES + i] == 0.0 or L[AWAKE] == 0.0:
                continue
            sign = 2.0 * L[ON + i] - 1.0
            low = _suspicious(h, sign * kept[0, lane], sign * kept[1, lane], sign * L[DELTA + i], sign * L[DELTA_RATE + i])
            if low >= 0.0:
                continue
            kept[3, lane] = -1.0
            cause = 0
        guard = -1
        passed = -1
        for element in range(elements):
            if _corner_ahead(element, deflection(element, data, plan, y), data, plan, pieces) >= 0:
                cause = 0
        if cause == 0:
            cause = -1
            dense_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P, F, spare)
            S[RATES_USED] += 3.0
            is_dense = True
            for lane in range(contacts):
                if kept[3, lane] < 0.0:
                    kept[3, lane] = 0.0
                    sign = 2.0 * wheels[lane // LANES, ON + lane % LANES] - 1.0
                    place = _first_change(t, h, lane, sign, data, plan, w, F, spare, wheels)
                    if place < at:
                        at, cause = place, lane
            for element in range(elements):
                corner = _corner_ahead(element, deflection(element, data, plan, y), data, plan, pieces)
                if corner >= 0:
                    place = _find_corner(element, corner, data, plan, w, F, spare)
                    if place < at:
                        at, cause, guard, passed = place, -1, element, corner
            touch(t + h, data, plan, y, wheels)
        if at <= 1.0:
            stops = False
            h *= at
            make_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P)
            rates(t + h, data, plan, y, wheels, pieces, Q, K[STAGES])
            S[RATES_USED] += STAGES
            is_dense = False
        # -- the maxima of normal forces in it
        for lane in range(contacts):
            L = wheels[lane // LANES]
            i = lane % LANES
            if L[AWAKE] == 0.0 or L[ON + i] == 0.0:
                continue
            if kept[2, lane] <= 0.0 or L[NORMAL_RATE + i] > 0.0:
                continue
            if (kept[2, lane] - L[NORMAL_RATE + i]) * h > QUIET * L[NORMAL + i] or lane == cause:
                kept[3, lane] = 1.0
        for lane in range(contacts):
            if kept[3, lane] > 0.0:
                kept[3, lane] = 0.0
                if not is_dense:
                    dense_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P, F, spare)
                    S[RATES_USED] += 3.0
                    is_dense = True
                x = _find(0.0, 1.0, kept[2, lane], -1e-9 * kept[2, lane], t, h, lane, 1.0, data, plan, w, F, spare, wheels, NORMAL_RATE)
                force = _indentation(x, t, h, lane, 1.0, data, plan, w, F, spare, wheels, NORMAL)
                _log_peak(t + x * h, lane, force, 0.0, peaks, S)
        if is_dense:
            touch(t + h, data, plan, y, wheels)
        # -- keep it, and go on
        row = int(S[STEPS])
        steps[row, STEP_TIME] = t
        steps[row, STEP_CLOSED] = _closed(wheels)
        for element in range(elements):
            steps[row, STEP_ELEMENTS + element] = pieces[element]
        for i in range(n):
            states[row, i] = w[i]
        S[STEPS] += 1.0
        now = until if stops else t + h
        if cause >= 0:
            L = wheels[cause // LANES]
            i = cause % LANES
            rest = -L[DELTA + i] / L[DELTA_RATE + i]
            if abs(rest) < 0.01 * h:
                now += rest
                for k in range(n):
                    y[k] += rest * K[STAGES, k]
                touch(now, data, plan, y, wheels)
        steps[row, STEP_LENGTH] = now - t
        if now <= t:
            S[IDLE] += 1.0
            if S[IDLE] > 100.0:
                return STALLED
        else:
            S[IDLE] = 0.0
        S[TIME] = now
        for i in range(n):
            w[i] = y[i]
            K[0, i] = K[STAGES, i]
        if cause >= 0:
            L = wheels[cause // LANES]
            i = cause % LANES
            L[DELTA + i] = 0.0
            before = S[EVENTS]
            _switch(now, near, wheels, events, S)
            if S[EVENTS] == before:  # it only grazes
                S[IDLE] += 1.0
            S[ANEW] = 1.0
        if guard >= 0:
            pieces[guard] = passed - 1.0 if passed == pieces[guard] else passed
            S[ANEW] = 1.0
        if stops and now < end:
            _keep(wheels, NORMAL_RATE, kept[2])
            hardest = pass_breaks(now, data, plan, wheels)
            touch(now, data, plan, w, wheels)
            if hardest == SOFT:
                continue
            for lane in range(contacts):
                L = wheels[lane // LANES]
                if L[ON + lane % LANES] != 0.0 and kept[2, lane] > 0.0 and L[NORMAL_RATE + lane % LANES] < 0.0:
                    _log_peak(now, lane, L[NORMAL + lane % LANES], 1.0, peaks, S)
            _switch(now, near, wheels, events, S)
            S[ANEW] = 1.0
        if S[ANEW] != 0.0:
            S[NEXT_LENGTH] = min(S[NEXT_LENGTH], FIRST_STEP * data[contract.PULSE])
        for o in range(int(data[contract.TREADS])):
            for i in range(LANES):
                if abs(wheels[o, U + i]) > data[contract.LARGEST_SHIFT]:
                    return DERAILED


@kernel
def probe_kernel(
    data: FloatArray, plan: IntArray, start: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray,
    states: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Write the rates of states at time zero, (many, states), with all contacts that overlap closed."""
    w = np.empty_like(start)
    S = np.empty(CARRIED)
    start_kernel(data, plan, start, w, wheels, pieces, S)
    for row in range(states.shape[0]):
        touch(0.0, data, plan, states[row], wheels)
        for o in range(wheels.shape[0]):
            for i in range(LANES):
                wheels[o, ON + i] = 1.0 if wheels[o, SIDES + i] != 0.0 and wheels[o, DELTA + i] > 0.0 else 0.0
        rates(0.0, data, plan, states[row], wheels, pieces, Q, out[row])


class MultibodyMarch(NamedTuple):
    """What a march leaves: steps with the states at their starts, events, peaks, the end, and the status."""

    status: int
    steps: FloatArray  # (steps, 3 + elements)
    states: FloatArray  # (steps, states)
    events: FloatArray  # (events, 4)
    peaks: FloatArray  # (peaks, 4)
    end: float
    state: FloatArray  # (states,)
    evaluations: int
    """How often the rates were computed."""


class Work(NamedTuple):
    """What marching one vehicle writes to."""

    w: FloatArray
    wheels: FloatArray
    pieces: FloatArray
    steps: FloatArray
    states: FloatArray
    events: FloatArray
    peaks: FloatArray
    K: FloatArray
    F: FloatArray
    Q: FloatArray
    kept: FloatArray
    S: FloatArray


def work_for(A: Assembly, rows: int = 1024) -> Work:
    """Return room for the first steps."""
    n, octets, elements = len(A.start), len(A.kinds), len(A.element_inside)
    return Work(
        np.zeros(n), np.zeros((octets, ROWS)), np.zeros(elements), np.zeros((rows, STEP_ELEMENTS + elements)),
        np.empty((rows, n)), np.empty((rows, 4)), np.empty((rows, 4)), np.zeros((DENSE_STAGES, n)),
        np.zeros((POWERS, n)), np.zeros(len(A.loads)), np.zeros((4, octets * LANES)), np.zeros(CARRIED),
    )  # fmt: skip


def kernels_are_ready() -> bool:
    """Return False where marching begins with compiling."""
    floats, plan, table = np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 1))
    return is_compiled(march_kernel, (floats, plan, floats, floats, table, floats, *(table,) * 6, floats, table, floats))


def probe(A: Assembly, states: FloatArray) -> FloatArray:
    """Return the rates of states at time zero, (many, states), with all contacts that overlap closed."""
    work, out = work_for(A, 1), np.empty_like(states)
    probe_kernel(*flattened(A), A.start, work.wheels, work.pieces, work.Q, np.ascontiguousarray(states), out)
    return out


def _grown(table: FloatArray, used: float) -> FloatArray:
    """Return the table, twice as long where it is half full."""
    if used < 0.5 * len(table):
        return table
    larger = np.zeros((2 * len(table), table.shape[1]))
    larger[: len(table)] = table
    return larger


def march(A: Assembly) -> MultibodyMarch:
    """March a vehicle from its start to its end."""
    flat, work = flattened(A), work_for(A)
    start_kernel(*flat, A.start, work.w, work.wheels, work.pieces, work.S)
    while True:
        status = march_kernel(*flat, A.scales, *work)
        steps, events, peaks = work.S[[STEPS, EVENTS, PEAKS]].astype(int)
        if status != FULL:
            return MultibodyMarch(
                status, work.steps[:steps], work.states[:steps], work.events[:events], work.peaks[:peaks],
                float(work.S[TIME]), work.w, int(work.S[RATES_USED]),
            )  # fmt: skip
        work = work._replace(
            steps=_grown(work.steps, steps), states=_grown(work.states, steps), events=_grown(work.events, events),
            peaks=_grown(work.peaks, peaks),
        )  # fmt: skip
