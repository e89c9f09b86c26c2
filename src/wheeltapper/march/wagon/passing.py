"""Changes between the steps of a vehicle: contacts open and close, paths proceed to their next pieces."""

from __future__ import annotations

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import kernel, shared_kernel
from wheeltapper.march.common.plastic_law import stretch_of
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import LANES
from wheeltapper.march.wagon.contact_laws import is_lossy, is_plastic, pulls, yield_law
from wheeltapper.march.wagon.elements import corner_at, deflection, last_piece
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.sliders import enter_holds, is_pressed, pressing_force
from wheeltapper.march.wagon.wheel_paths import set_piece

# Variables that are kept between calls.
RUN_TIME, NEXT_LENGTH, ANEW, RUN_STEPS, RUN_EVENTS, RUN_PEAKS, RATES_USED, RUN_IDLE = range(8)
RUN_CARRIED = 8
SAME = 1e-12
"""Distance to their change, in static indentations, below which contacts change together with another one."""
MOST_STRETCHES = 8
"""Attempts at most to find the stretches in which contacts stand."""
FIRST_STEP = 0.03
"""Length of the first step after an event, in radians of phase."""


@kernel
def enable_flanges(data: FloatArray, wheels: FloatArray) -> bool:
    """Enable the flanges that may touch, by the shift of their treads; return True if any are newly enabled."""
    begins = False
    treads = int(data[asm.TREADS])
    for o in range(treads, wheels.shape[0]):
        if wheels[o, wheel.VOID_FLAG] != 0.0:
            break
        near = 0.0
        for i in range(LANES):
            tread = wheels[o - treads]
            if tread[wheel.SIDES + i] != 0.0 and tread[wheel.ROW_U + i] > data[asm.FLANGE_FROM]:
                near = 1.0
        if near != 0.0 and wheels[o, wheel.AWAKE] == 0.0:
            begins = True
        wheels[o, wheel.AWAKE] = near
    return begins


@kernel
def _side(value: float, near: float, rate: float) -> float:
    """Return 1 for what is positive or becomes it, -1 for what is negative or becomes it, and 0 for neither."""
    if value > near or (value >= -near and rate > 0.0):
        return 1.0
    return -1.0 if value < -near or rate < 0.0 else 0.0


@kernel
def may_part(data: FloatArray, L: FloatArray) -> bool:
    """Return True for an octet of voids, and of contacts that are awake and do not pull."""
    return bool(L[wheel.VOID_FLAG] != 0.0 or (L[wheel.AWAKE] != 0.0 and not pulls(data, L)))


@kernel
def switch_contacts(t: float, data: FloatArray, wheels: FloatArray, events: FloatArray, S: FloatArray) -> None:
    """Open and close all contacts and voids that are at their change, by the sign of the indentation's rate.

    Where the force of wheels depends on that rate, there has to be a grip, too.
    """
    lossy = is_lossy(data)
    near = SAME * data[asm.STATIC_INDENTATION]
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if not may_part(data, L):
            continue
        is_void = L[wheel.VOID_FLAG] != 0.0
        for i in range(LANES):
            if L[wheel.SIDES + i] == 0.0 and not is_void:
                continue
            delta = L[wheel.ROW_DELTA + i]
            rate = L[wheel.DELTA_RATE + i]
            told = L[wheel.DEPTH_RATE + i] if is_void else rate
            closed = L[wheel.ON + i] != 0.0
            if lossy and not is_void:
                grips = _side(L[wheel.GRIP + i], SAME, L[wheel.GRIP_RATE + i])
                indents = _side(delta, near, rate)
                opens = closed and (delta < -near or (delta <= near and rate < 0.0) or grips < 0.0)
                closes = not closed and indents > 0.0 and grips > 0.0
            else:
                opens = closed and (delta < -near or (delta <= near and rate < 0.0))
                closes = not closed and (delta > near or (delta >= -near and rate > 0.0))
            if opens:
                L[wheel.ON + i] = 0.0
                _log_event(t, contract.LOSS, o * LANES + i, told, events, S)
            elif closes:
                L[wheel.ON + i] = 1.0
                _log_event(t, contract.IMPACT, o * LANES + i, told, events, S)


@kernel
def switch_stretches(t: float, data: FloatArray, wheels: FloatArray, events: FloatArray, S: FloatArray) -> bool:
    """Go over to the next stretches of the laws of all contacts that are at a border; return True if there are any.

    Upwards from the first stretch is the event of yield.
    """
    changed = False
    numbers, table = yield_law(data)
    near = SAME * data[asm.STATIC_INDENTATION]
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        for i in range(LANES):
            before, delta = L[wheel.STRETCH + i], L[wheel.ROW_DELTA + i]
            left, bears = L[wheel.ROW_LEFT + i], L[wheel.ROW_BEARS + i]
            after = before
            if L[wheel.ON + i] == 0.0:
                after = 0.0
            elif _side(L[wheel.TO_UPPER + i], near, L[wheel.TO_UPPER_RATE + i]) < 0.0:
                after = max(stretch_of(delta + 2.0 * near, left, bears, numbers, table), before + 1.0)
            elif _side(L[wheel.TO_LOWER + i], near, L[wheel.TO_LOWER_RATE + i]) < 0.0:
                after = min(stretch_of(delta - 2.0 * near, left, bears, numbers, table), before - 1.0)
            if after != before:
                changed = True
                L[wheel.STRETCH + i] = after
                if before == 0.0:
                    _log_event(t, contract.YIELD, o * LANES + i, L[wheel.DELTA_RATE + i], events, S)
    return changed


@kernel
def find_stretches(data: FloatArray, wheels: FloatArray) -> bool:
    """Find the stretches of the laws of all contacts from their indentations; return True if any changes."""
    changed = False
    numbers, table = yield_law(data)
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        for i in range(LANES):
            stretch = 0.0
            if L[wheel.ON + i] != 0.0:
                stretch = stretch_of(
                    L[wheel.ROW_DELTA + i], L[wheel.ROW_LEFT + i], L[wheel.ROW_BEARS + i], numbers, table
                )
            if stretch != L[wheel.STRETCH + i]:
                changed = True
            L[wheel.STRETCH + i] = stretch
    return changed


@kernel
def press_at_rest(t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Compute what presses in a state with all contacts that overlap closed, each on the stretch of its law."""
    contact_forces(t, data, plan, w, wheels)
    close_contacts(data, wheels)
    if is_plastic(data):
        for _ in range(MOST_STRETCHES):  # on rails that give way the indentation depends on the stretch
            contact_forces(t, data, plan, w, wheels)
            if not find_stretches(data, wheels):
                break


@kernel
def next_break(data: FloatArray, t: float, wheels: FloatArray) -> float:
    """Return the time of the next breakpoint of any path, or at which the next wheel enters or leaves the deck."""
    until = data[asm.RUN_END]
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            if wheels[o, wheel.SIDES + i] == 0.0:
                continue
            until = min(until, wheels[o, wheel.ROW_UNTIL + i])
            for column in (asm.WHEEL_DECK_FROM, asm.WHEEL_DECK_TO):
                when = wheels[o, column * LANES + i]
                if when > t:
                    until = min(until, when)
    return until


@kernel
def pass_breaks(t: float, data: FloatArray, plan: IntArray, wheels: FloatArray) -> float:
    """Go over to the next pieces of the paths that end here, and on and off the deck; return the hardest join."""
    hardest = 0.0
    pieces, width = plan[asm.AT_PIECES], plan[asm.PIECE_WIDTH]
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            if L[wheel.SIDES + i] == 0.0:
                continue
            while L[wheel.ROW_UNTIL + i] <= t:
                piece = int(L[wheel.ROW_PIECE + i])
                if piece < L[asm.LAST_PIECE * LANES + i]:
                    L[wheel.ROW_PIECE + i] = piece + 1
                    hardest = max(hardest, data[pieces + (piece + 1) * width + contract.JOIN])
                else:
                    back = int(L[asm.PATH_LOOP * LANES + i])
                    ended = data[pieces + piece * width + contract.STOP]
                    L[wheel.ROW_SHIFT + i] += ended - data[pieces + back * width + contract.START]
                    L[wheel.ROW_PIECE + i] = back
                    hardest = max(hardest, L[asm.PATH_LOOP_JOIN * LANES + i])
                set_piece(i, data, plan, L)
            inside = L[asm.WHEEL_DECK_FROM * LANES + i] <= t < L[asm.WHEEL_DECK_TO * LANES + i]
            if inside != (L[wheel.ROW_ON_DECK + i] != 0.0):
                hardest = contract.JUMP
            L[wheel.ROW_ON_DECK + i] = 1.0 if inside else 0.0
    return hardest


@shared_kernel
def start_kernel(
    data: FloatArray, plan: IntArray, start: FloatArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray,
    S: FloatArray,
) -> None:  # fmt: skip
    """Set everything at time zero."""
    S[:] = 0.0
    S[NEXT_LENGTH] = FIRST_STEP * data[asm.PULSE]
    w[:] = start
    wheels[:] = 0.0
    for o in range(wheels.shape[0]):
        kind = plan[plan[asm.AT_KINDS] + o]
        wheels[o, wheel.AWAKE] = 0.0 if kind == asm.BELOW_SLEEPERS else 1.0
        wheels[o, wheel.VOID_FLAG] = 1.0 - wheels[o, wheel.AWAKE]
        wheels[o, wheel.INCLINED_FLAG] = 1.0 if kind == asm.FLANGE else 0.0
        for column in range(asm.LANE_COLUMNS):
            for i in range(LANES):
                at = plan[asm.AT_LANES] + (o * asm.LANE_COLUMNS + column) * LANES + i
                wheels[o, column * LANES + i] = data[at]
        for i in range(LANES):
            wheels[o, wheel.ROW_PIECE + i] = wheels[o, asm.FIRST_PIECE * LANES + i]
            wheels[o, wheel.CELL + i] = -1.0
            wheels[o, wheel.CURVE_CELL + i] = -1.0
            set_piece(i, data, plan, wheels[o])
    pass_breaks(0.0, data, plan, wheels)
    press_at_rest(0.0, data, plan, w, wheels)
    pieces[:] = asm.STICKS
    for element in range(plan[asm.LAWS]):
        last = last_piece(element, plan)
        here = deflection(element, data, plan, w)
        pieces[element] = 0.0
        while pieces[element] < last and data[corner_at(element, int(pieces[element]) + 1, plan)] <= here:
            pieces[element] += 1.0
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        if is_pressed(element, data, plan) and pressing_force(element, data, plan, w, pieces) < 0.0:
            pieces[element] = asm.PARTED
    enter_holds(data, plan, pieces)
    S[ANEW] = 1.0


@kernel
def close_contacts(data: FloatArray, wheels: FloatArray) -> None:
    """Close all contacts and voids that overlap, and whose force would not pull, or may; open all others.

    A contact that just touches, and does not part, closes too: a step that begins with it open begins in the rail.
    """
    lossy = is_lossy(data)
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            if L[wheel.VOID_FLAG] != 0.0:
                L[wheel.ON + i] = 1.0 if L[wheel.ROW_DELTA + i] > 0.0 else 0.0
                continue
            delta = L[wheel.ROW_DELTA + i]
            touches = delta == 0.0 and L[wheel.AWAKE] != 0.0 and L[wheel.DELTA_RATE + i] >= 0.0
            overlaps = L[wheel.SIDES + i] != 0.0 and (delta > 0.0 or touches or pulls(data, L))
            L[wheel.ON + i] = 1.0 if overlaps and (not lossy or L[wheel.GRIP + i] > 0.0) else 0.0


@kernel
def closed_contacts(wheels: FloatArray) -> float:
    """Return the closed contacts as a number, one bit each."""
    total = 0.0
    bit = 1.0
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            total += bit * wheels[o, wheel.ON + i]
            bit *= 2.0
    return total


@kernel
def _log_event(t: float, kind: int, lane: int, rate: float, events: FloatArray, S: FloatArray) -> None:
    """Log a loss of contact, an impact, or a yield."""
    row = int(S[RUN_EVENTS])
    events[row, contract.EVENT_TIME] = t
    events[row, contract.EVENT_KIND] = kind
    events[row, contract.EVENT_CONTACT] = lane
    events[row, contract.EVENT_RATE] = rate
    S[RUN_EVENTS] += 1.0


@kernel
def log_peak(t: float, lane: int, force: float, corner: float, peaks: FloatArray, S: FloatArray) -> None:
    """Log a maximum of a normal force."""
    row = int(S[RUN_PEAKS])
    peaks[row, contract.PEAK_TIME] = t
    peaks[row, contract.PEAK_CONTACT] = lane
    peaks[row, contract.PEAK_FORCE] = force
    peaks[row, contract.PEAK_CORNER] = corner
    S[RUN_PEAKS] += 1.0
