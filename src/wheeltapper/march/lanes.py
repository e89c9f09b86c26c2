"""Cells in lockstep: eight that wait for the same kind of step take it together, lane by lane.

COAST   in contact: step after step, until one may hold an event; a lane that falls out is filled again at once
TURN    that step ends in contact: find the force maximum or minimum in it
OPEN    that step ends without contact: find the loss
BREAK   that step reaches a breakpoint: find the place, and go over it
FLY     in flight: a step, or up to the impact or the breakpoint
APART   everything else, one cell after the other by single.py: other contacts and other paths, and steps with more
        than one root

until no cell waits:  take the fullest queue; let its cells go on; each joins the queue of its next step

A cell's motion does not depend on its company: every lane does the same arithmetic, whatever the others hold.
"""

from __future__ import annotations

from wheeltapper.march import lane_rows as at
from wheeltapper.march import pool as cells
from wheeltapper.march import unrolled_lanes
from wheeltapper.march.apart import cross_breakpoint, go_apart
from wheeltapper.march.events import AT_BREAK, GRAZE
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import OPENED
from wheeltapper.march.program import CONTACT, FLIGHT, IMPACT, LOSS, PHASE, FloatArray


@kernel
def _step_lanes(kind: int, L: FloatArray) -> None:
    """Make one contact step in all lanes."""
    if kind == cells.FLAT:
        unrolled_lanes.lanes_flat_12(L)
    else:
        unrolled_lanes.lanes_wave_12(L)


@kernel
def _is_everywhere(row: int, L: FloatArray) -> bool:
    """Return True where a row of zeros and ones holds ones only."""
    total = 0.0
    for i in range(at.LANES):
        total += L[row + i]
    return total == at.LANES


@kernel
def _step_until_event(kind: int, drain: bool, pool: cells.Pool) -> None:
    """Let cells in contact step until a lane stays empty; with `drain`, until all are."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    busy = cells.fill_all(cells.COAST + kind, queue, rows, L, held)
    while busy > 0:
        _step_lanes(kind, L)
        if _is_everywhere(at.LANE_GO, L):
            continue
        before = busy
        for i in range(at.LANES):
            cell = held[i]
            if cell < 0 or L[at.LANE_GO + i] != 0.0:
                continue
            cells.keep_lane(i, cell, rows, L)
            if not L[at.LANE_U_END + i] > 0.0:
                cells.push(cell, cells.OPEN + kind, queue)
            elif L[at.LANE_CALM + i] == 0.0:
                cells.push(cell, cells.TURN + kind, queue)
            else:
                cells.push(cell, cells.CROSS + kind, queue)
            held[i] = cells.pop(cells.COAST + kind, queue)
            cells.fill_lane(i, held[i], rows, L)
            if held[i] < 0:
                busy -= 1
        if busy < before and not drain:
            for i in range(at.LANES):
                if held[i] >= 0:
                    cells.keep_lane(i, held[i], rows, L)
                    cells.push(held[i], cells.COAST + kind, queue)
            return


@kernel
def _find_12(L: FloatArray) -> None:
    """Find the root in (0, 1) of each polynomial of degree 12 that has just one there."""
    unrolled_lanes.scan_12(L)
    while not _is_everywhere(at.LANE_DONE, L):
        unrolled_lanes.sharpen_12(L)


@kernel
def _find_22(L: FloatArray) -> None:
    """Find the root in (0, 1) of each polynomial of degree 22 that has just one there."""
    unrolled_lanes.scan_22(L)
    while not _is_everywhere(at.LANE_DONE, L):
        unrolled_lanes.sharpen_22(L)


@kernel
def _step_with_extremum(kind: int, pool: cells.Pool) -> None:
    """Make one contact step with at most one zero of w in it."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = cells.fill_all(cells.TURN + kind, queue, rows, L, held)
    _step_lanes(kind, L)
    unrolled_lanes.seek_w_12(L)
    _find_12(L)
    unrolled_lanes.contact_root_12(L)
    for i in range(filled):
        cell = held[i]
        turns, falls = L[at.LANE_CHANGES + i], L[at.LANE_SIGN + i] > 0.0
        ends = L[at.LANE_TIME + i] + L[at.LANE_T_END + i]
        rests = turns == 1.0 and not falls and not L[at.LANE_U_ROOT + i] > 0.0
        if not ends < L[at.LANE_UNTIL + i] or turns > 1.0 or rests:
            cells.push(cell, cells.APART, queue)
            continue
        if turns == 1.0:
            u = L[at.LANE_U_ROOT + i]
            cells.track_force(cell, L[at.LANE_TIME + i] + L[at.LANE_T_ROOT + i], u * u * u, 0.0, pool)
        L[at.LANE_TIME + i] = ends
        L[at.LANE_U0 + i] = L[at.LANE_U_END + i]
        L[at.LANE_W0 + i] = L[at.LANE_W_END + i]
        cells.keep_lane(i, cell, rows, L)
        cells.push(cell, cells.COAST + kind, queue)


@kernel
def _step_to_loss(kind: int, pool: cells.Pool) -> None:
    """Make one contact step up to the loss in it."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = cells.fill_all(cells.OPEN + kind, queue, rows, L, held)
    _step_lanes(kind, L)
    unrolled_lanes.seek_u_12(L)
    _find_12(L)
    unrolled_lanes.contact_root_12(L)
    for i in range(at.LANES):
        alone = L[at.LANE_CHANGES + i] == 1.0 and L[at.LANE_CALM + i] != 0.0
        opens = alone and L[at.LANE_W0 + i] < 0.0 < L[at.LANE_U0 + i]
        in_time = L[at.LANE_TIME + i] + L[at.LANE_T_ROOT + i] < L[at.LANE_UNTIL + i]
        L[at.LANE_GO + i] = 1.0 if opens and in_time else 0.0
    unrolled_lanes.leave(L)
    for i in range(filled):
        cell = held[i]
        if L[at.LANE_GO + i] == 0.0:
            cells.push(cell, cells.APART, queue)
            continue
        cells.keep_lane(i, cell, rows, L)
        rows[cell, PHASE] = FLIGHT
        rows[cell, cells.COUNTS + OPENED] = 1.0
        cells.track_force(cell, L[at.LANE_TIME + i], 0.0, 0.0, pool)
        if cells.note_event(cell, L[at.LANE_TIME + i], LOSS, L[at.LANE_W_ROOT + i], pool):
            cells.push(cell, cells.FLY, queue)


@kernel
def _step_to_breakpoint(kind: int, pool: cells.Pool) -> None:
    """Make one contact step, without an event, up to the breakpoint in it, and go over that."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = cells.fill_all(cells.CROSS + kind, queue, rows, L, held)
    _step_lanes(kind, L)
    unrolled_lanes.seek_time_12(L)
    _find_12(L)
    unrolled_lanes.contact_root_12(L)
    for i in range(filled):
        cell = held[i]
        if L[at.LANE_CHANGES + i] != 1.0:
            cells.push(cell, cells.APART, queue)
            continue
        u, w = L[at.LANE_U_ROOT + i], L[at.LANE_W_ROOT + i]
        L[at.LANE_TIME + i] = L[at.LANE_UNTIL + i]
        L[at.LANE_U0 + i] = u
        L[at.LANE_W0 + i] = w
        cells.keep_lane(i, cell, rows, L)
        cells.track_force(cell, L[at.LANE_UNTIL + i], u * u * u, 1.0, pool)
        rows[cell, cells.CELL_MARKS + AT_BREAK] = 1.0
        cross_breakpoint(cell, pool)


@kernel
def _step_in_flight(pool: cells.Pool) -> None:
    """Make one step in flight, up to the impact or the breakpoint in it."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = cells.fill_all(cells.FLY, queue, rows, L, held)
    for i in range(at.LANES):
        L[at.LANE_FRESH + i] = 1.0 if i >= filled else rows[held[i], cells.COUNTS + OPENED]
    unrolled_lanes.flight_22(L)
    _find_22(L)
    for i in range(at.LANES):
        L[at.LANE_T_ROOT + i] = L[at.LANE_LENGTH + i]
        if L[at.LANE_CHANGES + i] == 1.0:
            L[at.LANE_T_ROOT + i] *= L[at.LANE_X + i]
    unrolled_lanes.flight_end_22(L)
    for i in range(filled):
        cell = held[i]
        lands = L[at.LANE_CHANGES + i] == 1.0
        time = L[at.LANE_TIME + i] + L[at.LANE_T_ROOT + i]
        at_break = not time < L[at.LANE_UNTIL + i]
        plain = L[at.LANE_LENGTH + i] > 0.0 and L[at.LANE_SIGN + i] < 0.0 and L[at.LANE_CHANGES + i] <= 1.0
        if not plain or (lands and at_break):
            cells.push(cell, cells.APART, queue)
            continue
        L[at.LANE_TIME + i] = L[at.LANE_UNTIL + i] if at_break else time
        L[at.LANE_U0 + i] = 0.0 if lands else L[at.LANE_U_END + i]
        L[at.LANE_W0 + i] = L[at.LANE_W_ROOT + i] if lands else L[at.LANE_W_END + i]
        cells.keep_lane(i, cell, rows, L)
        rows[cell, cells.COUNTS + OPENED] = 0.0
        if at_break:
            rows[cell, cells.CELL_MARKS + AT_BREAK] = 1.0
            cross_breakpoint(cell, pool)
        elif not lands:
            cells.push(cell, cells.FLY, queue)
        else:
            rows[cell, PHASE] = CONTACT
            rate = L[at.LANE_W_ROOT + i]
            if cells.note_event(cell, time, IMPACT, rate, pool):
                kind = cells.FLAT if L[at.LANE_OMEGA + i] == 0.0 else cells.WAVE
                cells.push(cell, cells.COAST + kind if rate >= GRAZE else cells.APART, queue)


@kernel
def lanes_kernel(pool: cells.Pool) -> bool:
    """March all cells of order DEFAULT_ORDER to their ends; return False when their events need more room."""
    queue, used = pool.queue, pool.used
    while True:
        if max(used[cells.USED_EVENTS] - len(pool.events), used[cells.USED_PEAKS] - len(pool.peaks)) + cells.ROOM > 0:
            return False
        if queue[cells.APART, cells.WAITING] > 0:
            if not go_apart(pool):
                return False
            continue
        fullest = 0
        for which in range(1, cells.APART):
            if queue[which, cells.WAITING] > queue[fullest, cells.WAITING]:
                fullest = which
        if queue[fullest, cells.WAITING] == 0:
            return True
        drain = queue[fullest, cells.WAITING] < at.LANES
        kind = fullest & 1
        if fullest == cells.FLY:
            _step_in_flight(pool)
        elif fullest >= cells.CROSS:
            _step_to_breakpoint(kind, pool)
        elif fullest >= cells.OPEN:
            _step_to_loss(kind, pool)
        elif fullest >= cells.TURN:
            _step_with_extremum(kind, pool)
        else:
            _step_until_event(kind, drain, pool)
