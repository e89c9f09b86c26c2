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

from wheeltapper.march.apart import cross, go_apart
from wheeltapper.march.events import AT_BREAK, GRAZE
from wheeltapper.march.kernel import kernel
from wheeltapper.march.lane_rows import (
    LANE_CALM,
    LANE_CHANGES,
    LANE_DONE,
    LANE_FRESH,
    LANE_GO,
    LANE_LENGTH,
    LANE_OMEGA,
    LANE_SIGN,
    LANE_T_END,
    LANE_T_ROOT,
    LANE_TIME,
    LANE_U0,
    LANE_U_END,
    LANE_U_ROOT,
    LANE_UNTIL,
    LANE_W0,
    LANE_W_END,
    LANE_W_ROOT,
    LANE_X,
    LANES,
)
from wheeltapper.march.layout import OPENED
from wheeltapper.march.pool import (
    APART,
    CELL_MARKS,
    COAST,
    COUNTS,
    CROSS,
    FLAT,
    FLY,
    OPEN,
    ROOM,
    TURN,
    USED_EVENTS,
    USED_PEAKS,
    WAITING,
    WAVE,
    Pool,
    fill,
    fill_all,
    keep,
    note,
    pop,
    push,
    track,
)
from wheeltapper.march.program import CONTACT, FLIGHT, IMPACT, LOSS, PHASE, FloatArray
from wheeltapper.march.unrolled_lanes import (
    contact_root_12,
    flight_22,
    flight_end_22,
    lanes_flat_12,
    lanes_wave_12,
    leave,
    scan_12,
    scan_22,
    seek_time_12,
    seek_u_12,
    seek_w_12,
    sharpen_12,
    sharpen_22,
)


@kernel
def _step(kind: int, L: FloatArray) -> None:
    """Make one contact step in all lanes."""
    if kind == FLAT:
        lanes_flat_12(L)
    else:
        lanes_wave_12(L)


@kernel
def _is_everywhere(row: int, L: FloatArray) -> bool:
    """Return True where a row of zeros and ones holds ones only."""
    total = 0.0
    for i in range(LANES):
        total += L[row + i]
    return total == LANES


@kernel
def _coast(kind: int, drain: bool, pool: Pool) -> None:
    """Let cells in contact step until a lane stays empty; with `drain`, until all are."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    busy = fill_all(COAST + kind, queue, rows, L, held)
    while busy > 0:
        _step(kind, L)
        if _is_everywhere(LANE_GO, L):
            continue
        before = busy
        for i in range(LANES):
            cell = held[i]
            if cell < 0 or L[LANE_GO + i] != 0.0:
                continue
            keep(i, cell, rows, L)
            if not L[LANE_U_END + i] > 0.0:
                push(cell, OPEN + kind, queue)
            elif L[LANE_CALM + i] == 0.0:
                push(cell, TURN + kind, queue)
            else:
                push(cell, CROSS + kind, queue)
            held[i] = pop(COAST + kind, queue)
            fill(i, held[i], rows, L)
            if held[i] < 0:
                busy -= 1
        if busy < before and not drain:
            for i in range(LANES):
                if held[i] >= 0:
                    keep(i, held[i], rows, L)
                    push(held[i], COAST + kind, queue)
            return


@kernel
def _find_12(L: FloatArray) -> None:
    """Find the root in (0, 1) of each polynomial of degree 12 that has just one there."""
    scan_12(L)
    while not _is_everywhere(LANE_DONE, L):
        sharpen_12(L)


@kernel
def _find_22(L: FloatArray) -> None:
    """Find the root in (0, 1) of each polynomial of degree 22 that has just one there."""
    scan_22(L)
    while not _is_everywhere(LANE_DONE, L):
        sharpen_22(L)


@kernel
def _turn(kind: int, pool: Pool) -> None:
    """Make one contact step with at most one zero of w in it."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = fill_all(TURN + kind, queue, rows, L, held)
    _step(kind, L)
    seek_w_12(L)
    _find_12(L)
    contact_root_12(L)
    for i in range(filled):
        cell = held[i]
        turns, falls = L[LANE_CHANGES + i], L[LANE_SIGN + i] > 0.0
        ends = L[LANE_TIME + i] + L[LANE_T_END + i]
        if not ends < L[LANE_UNTIL + i] or turns > 1.0 or (turns == 1.0 and not falls and not L[LANE_U_ROOT + i] > 0.0):
            push(cell, APART, queue)
            continue
        if turns == 1.0:
            u = L[LANE_U_ROOT + i]
            track(cell, L[LANE_TIME + i] + L[LANE_T_ROOT + i], u * u * u, 0.0, pool)
        L[LANE_TIME + i] = ends
        L[LANE_U0 + i] = L[LANE_U_END + i]
        L[LANE_W0 + i] = L[LANE_W_END + i]
        keep(i, cell, rows, L)
        push(cell, COAST + kind, queue)


@kernel
def _open(kind: int, pool: Pool) -> None:
    """Make one contact step up to the loss in it."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = fill_all(OPEN + kind, queue, rows, L, held)
    _step(kind, L)
    seek_u_12(L)
    _find_12(L)
    contact_root_12(L)
    for i in range(LANES):
        alone = L[LANE_CHANGES + i] == 1.0 and L[LANE_CALM + i] != 0.0 and L[LANE_W0 + i] < 0.0 < L[LANE_U0 + i]
        L[LANE_GO + i] = 1.0 if alone and L[LANE_TIME + i] + L[LANE_T_ROOT + i] < L[LANE_UNTIL + i] else 0.0
    leave(L)
    for i in range(filled):
        cell = held[i]
        if L[LANE_GO + i] == 0.0:
            push(cell, APART, queue)
            continue
        keep(i, cell, rows, L)
        rows[cell, PHASE] = FLIGHT
        rows[cell, COUNTS + OPENED] = 1.0
        track(cell, L[LANE_TIME + i], 0.0, 0.0, pool)
        if note(cell, L[LANE_TIME + i], LOSS, L[LANE_W_ROOT + i], pool):
            push(cell, FLY, queue)


@kernel
def _break(kind: int, pool: Pool) -> None:
    """Make one contact step, without an event, up to the breakpoint in it, and go over that."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = fill_all(CROSS + kind, queue, rows, L, held)
    _step(kind, L)
    seek_time_12(L)
    _find_12(L)
    contact_root_12(L)
    for i in range(filled):
        cell = held[i]
        if L[LANE_CHANGES + i] != 1.0:
            push(cell, APART, queue)
            continue
        u, w = L[LANE_U_ROOT + i], L[LANE_W_ROOT + i]
        L[LANE_TIME + i] = L[LANE_UNTIL + i]
        L[LANE_U0 + i] = u
        L[LANE_W0 + i] = w
        keep(i, cell, rows, L)
        track(cell, L[LANE_UNTIL + i], u * u * u, 1.0, pool)
        rows[cell, CELL_MARKS + AT_BREAK] = 1.0
        cross(cell, pool)


@kernel
def _fly(pool: Pool) -> None:
    """Make one step in flight, up to the impact or the breakpoint in it."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    filled = fill_all(FLY, queue, rows, L, held)
    for i in range(LANES):
        L[LANE_FRESH + i] = 1.0 if i >= filled else rows[held[i], COUNTS + OPENED]
    flight_22(L)
    _find_22(L)
    for i in range(LANES):
        L[LANE_T_ROOT + i] = L[LANE_LENGTH + i]
        if L[LANE_CHANGES + i] == 1.0:
            L[LANE_T_ROOT + i] *= L[LANE_X + i]
    flight_end_22(L)
    for i in range(filled):
        cell = held[i]
        lands = L[LANE_CHANGES + i] == 1.0
        time = L[LANE_TIME + i] + L[LANE_T_ROOT + i]
        at_break = not time < L[LANE_UNTIL + i]
        plain = L[LANE_LENGTH + i] > 0.0 and L[LANE_SIGN + i] < 0.0 and L[LANE_CHANGES + i] <= 1.0
        if not plain or (lands and at_break):
            push(cell, APART, queue)
            continue
        L[LANE_TIME + i] = L[LANE_UNTIL + i] if at_break else time
        L[LANE_U0 + i] = 0.0 if lands else L[LANE_U_END + i]
        L[LANE_W0 + i] = L[LANE_W_ROOT + i] if lands else L[LANE_W_END + i]
        keep(i, cell, rows, L)
        rows[cell, COUNTS + OPENED] = 0.0
        if at_break:
            rows[cell, CELL_MARKS + AT_BREAK] = 1.0
            cross(cell, pool)
        elif not lands:
            push(cell, FLY, queue)
        else:
            rows[cell, PHASE] = CONTACT
            rate = L[LANE_W_ROOT + i]
            if note(cell, time, IMPACT, rate, pool):
                kind = FLAT if L[LANE_OMEGA + i] == 0.0 else WAVE
                push(cell, COAST + kind if rate >= GRAZE else APART, queue)


@kernel
def lanes_kernel(pool: Pool) -> bool:
    """March all cells of order DEFAULT_ORDER to their ends; return False when their events need more room."""
    queue = pool.queue
    while True:
        if pool.used[USED_EVENTS] + ROOM > len(pool.events) or pool.used[USED_PEAKS] + ROOM > len(pool.peaks):
            return False
        if queue[APART, WAITING] > 0:
            if not go_apart(pool):
                return False
            continue
        fullest = 0
        for which in range(1, APART):
            if queue[which, WAITING] > queue[fullest, WAITING]:
                fullest = which
        if queue[fullest, WAITING] == 0:
            return True
        drain = queue[fullest, WAITING] < LANES
        kind = fullest & 1
        if fullest == FLY:
            _fly(pool)
        elif fullest >= CROSS:
            _break(kind, pool)
        elif fullest >= OPEN:
            _open(kind, pool)
        elif fullest >= TURN:
            _turn(kind, pool)
        else:
            _coast(kind, drain, pool)
