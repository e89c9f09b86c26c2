"""Cells in lockstep: eight that wait for the same kind of step take it together, lane by lane.

COAST   in contact: step after step, until one may hold an event; a lane that falls out is filled again at once
TURN    that step ends in contact: find the force maximum or minimum in it, and the breakpoint if it reaches one
OPEN    that step ends without contact: find the loss
CROSS   that step reaches a breakpoint and holds nothing else: find the place, and go over it
FLY     in flight: a step, or up to the impact or the breakpoint
APART   everything else, one cell after the other by single.py: bilateral contacts, forces that hysteresis takes away,
        and steps with more than one root

until no cell waits:  take the fullest queue; let its cells go on; each joins the queue of its next step

A cell's motion does not depend on its company: every lane does the same arithmetic, whatever the others hold, and the
kind of a cell's steps follows from its own numbers and its own piece of the path.

What all lanes do together is code that is written when it is first needed (steps/lanes.py); `made` says where it is.
"""

from __future__ import annotations

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import CONTACT, DONE, END, FLIGHT, IMPACT, LOSS, PHASE, TIME, FloatArray, IntArray
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps import variants
from wheeltapper.march.steps.calling import call_eight
from wheeltapper.march.steps.layout import IMPACTS, OPENED, UNTIL_IMPACT, UNTIL_LOSS
from wheeltapper.march.wheel import apart
from wheeltapper.march.wheel import pool as cells
from wheeltapper.march.wheel.apart import cross_softly, force_at, go_apart, queue_of_flight, rail_at_time
from wheeltapper.march.wheel.events import AT_BREAK, GRAZE

CALM_END, BREAK_END, LOSS_END, UNKNOWN_END = 0.0, 1.0, 2.0, 3.0
"""How a step ends: in contact, at a breakpoint, in a loss, or not as lanes can tell."""
GONE = -2
"""Stands for the cell of a lane that goes on elsewhere."""
CERTAIN = 1e-6
"""Part of the energy (scaled) that must be missing before a wheel is said to leave the rail nevermore."""


@inlined_uncounted_kernel
def _is_everywhere(row: int, L: FloatArray) -> bool:
    """Return True where a row of zeros and ones holds ones only."""
    total = 0.0
    for i in range(at.LANES):
        total += L[row + i]
    return total == at.LANES


@inlined_uncounted_kernel
def _find(seek: int, made: FloatArray, L: FloatArray) -> None:
    """Find the root in (0, 1) of a polynomial of each contact step that has just one there, and the motion at it."""
    call_eight(made[seek], L)
    call_eight(made[variants.SCAN], L)
    while not _is_everywhere(at.LANE_DONE, L):
        call_eight(made[variants.SHARPEN], L)
    call_eight(made[variants.AT_ROOT], L)


@inlined_uncounted_kernel
def _force(cell: int, kind: int, time: float, u: float, w: float, pool: cells.Pool) -> float:
    """Return a cell's contact force."""
    if kind <= variants.OVER_WAVE:
        row = pool.rows[cell, cells.LOCAL :]
        return u * u * (row[at.CELL_QUADRATIC] + row[at.CELL_CUBIC] * u)
    return force_at(cell, time, u, w, pool.pieces, pool.first, pool.rows)


@inlined_uncounted_kernel
def _shorten(i: int, L: FloatArray) -> None:
    """Let a lane's step end at the root that was found."""
    L[at.LANE_LENGTH + i] *= L[at.LANE_X + i]
    L[at.LANE_T_END + i] = L[at.LANE_T_ROOT + i]
    L[at.LANE_U_END + i] = L[at.LANE_U_ROOT + i]
    L[at.LANE_W_END + i] = L[at.LANE_W_ROOT + i]


@inlined_uncounted_kernel
def _reaches_breakpoint(i: int, L: FloatArray) -> bool:
    """Return True where a lane's step does not end before the breakpoint."""
    return not L[at.LANE_TIME + i] + L[at.LANE_T_END + i] < L[at.LANE_UNTIL + i]


@inlined_uncounted_kernel
def _commit(i: int, cell: int, time: float, kind: int, phase: float, length: float, pool: cells.Pool) -> None:
    """Log a lane's step, and let the next one begin at its end."""
    L = pool.L
    cells.log_lane(i, cell, kind, phase, at.LANE_TIME, at.LANE_DECK_Y, length, pool)
    L[at.LANE_TIME + i] = time
    L[at.LANE_U0 + i] = L[at.LANE_U_END + i]
    L[at.LANE_W0 + i] = L[at.LANE_W_END + i]
    if variants.has_deck(kind):
        L[at.LANE_DECK_Y + i] = L[at.LANE_DECK_Y_END + i]
        L[at.LANE_DECK_V + i] = L[at.LANE_DECK_V_END + i]
    if variants.has_bush(kind):
        L[at.LANE_BUSH_Y + i] = L[at.LANE_BUSH_Y_END + i]


@inlined_uncounted_kernel
def _reach_breakpoint(i: int, cell: int, kind: int, pool: cells.Pool) -> None:
    """Let a lane's step end at the breakpoint."""
    L, until = pool.L, pool.L[at.LANE_UNTIL + i]
    _commit(i, cell, until, kind, CONTACT, L[at.LANE_LENGTH + i], pool)
    cells.keep_lane(i, cell, kind, pool.rows, L)
    force = _force(cell, kind, until, L[at.LANE_U0 + i], L[at.LANE_W0 + i], pool)
    cells.track_force(cell, until, force, 1.0, pool)


@inlined_uncounted_kernel
def _leave_breakpoint(cell: int, kind: int, pool: cells.Pool) -> None:
    """Take the force behind a breakpoint: the factor on it may jump."""
    rows = pool.rows
    force = _force(cell, kind, rows[cell, TIME], rows[cell, contract.A], rows[cell, contract.B], pool)
    cells.track_force(cell, rows[cell, TIME], force, 1.0, pool)


@uncounted_kernel
def _cross_hard(cell: int, pool: cells.Pool) -> None:
    """Take a cell that has reached a breakpoint over it, whatever is there."""
    pool.rows[cell, cells.CELL_MARKS + AT_BREAK] = 1.0
    apart.cross_breakpoint(cell, pool)


@uncounted_kernel
def _meets_breakpoints(held: IntArray, L: FloatArray) -> bool:
    """Mark the lanes whose steps hold nothing but a breakpoint; return whether there are any."""
    found = False
    for i in range(at.LANES):
        L[at.LANE_ENDS + i] = UNKNOWN_END
        still = held[i] >= 0 and L[at.LANE_GO + i] == 0.0
        calm = L[at.LANE_CALM + i] != 0.0 and L[at.LANE_U_END + i] > 0.0
        if still and calm and _reaches_breakpoint(i, L):
            L[at.LANE_ENDS + i] = BREAK_END
            found = True
    return found


@uncounted_kernel
def _pass_breakpoints(kind: int, pool: cells.Pool) -> None:
    """Take the marked lanes to and over their breakpoints; a lane whose cell goes on elsewhere is GONE."""
    L, rows, held = pool.L, pool.rows, pool.held
    _end_at_breakpoints(kind, pool.made, L)
    for i in range(at.LANES):
        cell = held[i]
        if L[at.LANE_ENDS + i] != BREAK_END:
            continue
        _reach_breakpoint(i, cell, kind, pool)
        if not cross_softly(cell, pool):
            _cross_hard(cell, pool)
            held[i] = GONE
            continue
        next_kind = int(rows[cell, cells.CELL_KIND])
        _leave_breakpoint(cell, next_kind, pool)
        if next_kind != kind:
            cells.push(cell, cells.COAST + next_kind, pool.queue)
            held[i] = GONE
        else:
            cells.fill_lane(i, cell, kind, pool.pieces, pool.first, pool.numbers, rows, L)
            L[at.LANE_GO + i] = 1.0


@inlined_uncounted_kernel
def _next_queue(i: int, kind: int, L: FloatArray) -> int:
    """Return the queue for a cell whose step in contact may hold an event."""
    if variants.is_lossy(kind) and L[at.LANE_HOLDS + i] == 0.0:
        return cells.APART
    if not L[at.LANE_U_END + i] > 0.0:
        return cells.OPEN + kind
    return cells.TURN + kind if L[at.LANE_CALM + i] == 0.0 else cells.CROSS + kind


@inlined_uncounted_kernel
def _leave_lanes(kind: int, pool: cells.Pool) -> None:
    """Let the cells in the lanes wait for their next step in contact."""
    for i in range(at.LANES):
        if pool.held[i] >= 0:
            cells.keep_lane(i, pool.held[i], kind, pool.rows, pool.L)
            cells.push(pool.held[i], cells.COAST + kind, pool.queue)


@inlined_uncounted_kernel
def _step_and_log(kind: int, pool: cells.Pool) -> None:
    """Make one contact step in all lanes, and log those that move a lane's start."""
    L = pool.L
    if len(pool.log) == 0:
        call_eight(pool.made[kind], L)
        return
    for k in range(3 * at.LANES):
        L[at.LANE_WAS + k] = L[at.LANE_TIME + k]
    if variants.has_deck(kind):
        for k in range(2 * at.LANES):
            L[at.LANE_DECK_WAS + k] = L[at.LANE_DECK_Y + k]
    call_eight(pool.made[kind], L)
    for i in range(at.LANES):
        if pool.held[i] >= 0 and L[at.LANE_GO + i] != 0.0:
            length = L[at.LANE_LENGTH + i]
            cells.log_lane(i, pool.held[i], kind, CONTACT, at.LANE_WAS, at.LANE_DECK_WAS, length, pool)


@inlined_uncounted_kernel
def _step_until_event(kind: int, drain: bool, pool: cells.Pool) -> None:
    """Let cells in contact step until a lane stays empty; with `drain`, until all are."""
    L, rows, queue, held = pool.L, pool.rows, pool.queue, pool.held
    pieces, first, numbers = pool.pieces, pool.first, pool.numbers
    busy = cells.fill_all(cells.COAST + kind, kind, pool)
    while busy > 0:
        if not cells.may_log(pool):
            _leave_lanes(kind, pool)
            return
        _step_and_log(kind, pool)
        if _is_everywhere(at.LANE_GO, L):
            continue
        if kind > variants.OVER_WAVE and _meets_breakpoints(held, L):
            _pass_breakpoints(kind, pool)
        before = busy
        for i in range(at.LANES):
            cell = held[i]
            if cell == cells.EMPTY or L[at.LANE_GO + i] != 0.0:
                continue
            if cell >= 0:
                cells.keep_lane(i, cell, kind, rows, L)
                cells.push(cell, _next_queue(i, kind, L), queue)
            held[i] = cells.pop(cells.COAST + kind, queue)
            cells.fill_lane(i, held[i], kind, pieces, first, numbers, rows, L)
            if held[i] < 0:
                busy -= 1
        if busy < before and not drain:
            _leave_lanes(kind, pool)
            return


@uncounted_kernel
def _end_at_breakpoints(kind: int, made: FloatArray, L: FloatArray) -> None:
    """Shorten the steps that end at breakpoints; where a place is not found, the end is unknown."""
    _find(variants.SEEK_TIME, made, L)
    for i in range(at.LANES):
        if L[at.LANE_ENDS + i] == BREAK_END:
            if L[at.LANE_CHANGES + i] == 1.0:
                _shorten(i, L)
            else:
                L[at.LANE_ENDS + i] = UNKNOWN_END
    _find_other_ends(kind, made, L)


@uncounted_kernel
def _find_other_ends(kind: int, made: FloatArray, L: FloatArray) -> None:
    """Evaluate the motion of deck and bush at the ends of shortened steps."""
    if variants.has_deck(kind):
        call_eight(made[variants.DECK_AT_END], L)
    if variants.has_bush(kind):
        call_eight(made[variants.BUSH_AT_END], L)


@inlined_uncounted_kernel
def _choose_ends(filled: int, stage: int, kind: int, made: FloatArray, L: FloatArray) -> None:
    """Shorten the steps of TURN, OPEN and CROSS to their losses or breakpoints; write how each ends."""
    shorter = stage != cells.TURN
    for i in range(at.LANES):
        L[at.LANE_ENDS + i] = CALM_END
        if stage == cells.OPEN:
            L[at.LANE_ENDS + i] = LOSS_END
        elif i < filled and _reaches_breakpoint(i, L):
            L[at.LANE_ENDS + i] = BREAK_END
            shorter = True
    if not shorter:
        return
    if stage != cells.OPEN:
        _end_at_breakpoints(kind, made, L)
        return
    _find(variants.SEEK_LOSS, made, L)
    for i in range(at.LANES):
        alone = L[at.LANE_CHANGES + i] == 1.0 and L[at.LANE_SIGN + i] > 0.0
        in_time = L[at.LANE_TIME + i] + L[at.LANE_T_ROOT + i] < L[at.LANE_UNTIL + i]
        if alone and in_time:
            _shorten(i, L)
        else:
            L[at.LANE_ENDS + i] = UNKNOWN_END
    _find_other_ends(kind, made, L)


@inlined_uncounted_kernel
def _stays_for_ever(i: int, cell: int, pool: cells.Pool) -> bool:
    """Return True at the last force minimum that matters to a cell: what it waits for can never come.

    On level rail up to the end of the march the energy cannot grow. If it does not suffice to leave the rail, there is
    no further loss, and all further force maxima are lower than the one before.
    """
    L, counts, numbers = pool.L, pool.rows[cell, cells.COUNTS : cells.LOCAL], pool.numbers[cell]
    if pool.used[cells.TO_THE_END] != 0:
        return False
    awaited = counts[IMPACTS] < max(counts[UNTIL_IMPACT], counts[UNTIL_LOSS])
    if not awaited or L[at.LANE_UNTIL + i] != numbers[END]:
        return False
    K, level, q = L[at.LANE_K + i], L[at.LANE_LEVEL + i], L[at.LANE_U_ROOT + i] ** 2
    stored = q * q * (0.4 * L[at.LANE_CUBIC + i] * L[at.LANE_U_ROOT + i] + 0.5 * L[at.LANE_QUADRATIC + i])
    missing = q * (1.0 + K * (level - 0.5 * q)) - stored
    return missing > CERTAIN


@inlined_uncounted_kernel
def _act(i: int, cell: int, kind: int, pool: cells.Pool) -> None:
    """Take a cell to the end of its step, which holds at most one extreme of the force, and to its next queue."""
    L, rows, queue = pool.L, pool.rows, pool.queue
    ends, turns = L[at.LANE_ENDS + i], L[at.LANE_CHANGES + i]
    falls = L[at.LANE_SIGN + i] > 0.0
    leaves = turns == 1.0 and not falls and not L[at.LANE_U_ROOT + i] > 0.0
    lets_go = variants.is_lossy(kind) and L[at.LANE_HOLDS + i] == 0.0
    sinks = ends != LOSS_END and not L[at.LANE_U_END + i] > 0.0
    if ends == UNKNOWN_END or turns > 1.0 or leaves or lets_go or sinks:
        cells.push(cell, cells.APART, queue)
        return
    if turns == 1.0:
        time = L[at.LANE_TIME + i] + L[at.LANE_T_ROOT + i]
        force = _force(cell, kind, time, L[at.LANE_U_ROOT + i], L[at.LANE_W_ROOT + i], pool)
        cells.track_force(cell, time, force, 0.0, pool)
        if not falls and kind == 0 and _stays_for_ever(i, cell, pool):
            cells.finish_cell(cell, DONE, pool.numbers[cell, END], rows)
            return
    if ends == BREAK_END:
        _reach_breakpoint(i, cell, kind, pool)
        if cross_softly(cell, pool):
            next_kind = int(rows[cell, cells.CELL_KIND])
            _leave_breakpoint(cell, next_kind, pool)
            cells.push(cell, cells.COAST + next_kind, queue)
        else:
            _cross_hard(cell, pool)
    elif ends == CALM_END:
        time = L[at.LANE_TIME + i] + L[at.LANE_T_END + i]
        _commit(i, cell, time, kind, CONTACT, L[at.LANE_LENGTH + i], pool)
        cells.keep_lane(i, cell, kind, rows, L)
        cells.push(cell, cells.COAST + kind, queue)
    else:
        _lose_contact(i, cell, kind, pool)


@inlined_uncounted_kernel
def _lose_contact(i: int, cell: int, kind: int, pool: cells.Pool) -> None:
    """Let a flight begin where a lane's step ends."""
    L, rows = pool.L, pool.rows
    rate = L[at.LANE_W_END + i]
    time = L[at.LANE_TIME + i] + L[at.LANE_T_END + i]
    _commit(i, cell, time, kind, CONTACT, L[at.LANE_LENGTH + i], pool)
    if kind == 0:
        L[at.LANE_U0 + i], L[at.LANE_W0 + i] = L[at.LANE_LEVEL + i], -rate
    else:
        deck_y, deck_v = (L[at.LANE_DECK_Y + i], L[at.LANE_DECK_V + i]) if variants.has_deck(kind) else (0.0, 0.0)
        height, velocity = rail_at_time(cell, time, deck_y, deck_v, pool)
        L[at.LANE_U0 + i], L[at.LANE_W0 + i] = height, velocity - rate
    cells.keep_lane(i, cell, kind, rows, L)
    rows[cell, PHASE] = FLIGHT
    rows[cell, cells.COUNTS + OPENED] = 1.0
    cells.track_force(cell, time, 0.0, 0.0, pool)
    if cells.note_event(cell, time, LOSS, rate, pool):
        cells.push(cell, queue_of_flight(kind), pool.queue)


@inlined_uncounted_kernel
def _step_with_event(stage: int, kind: int, pool: cells.Pool) -> None:
    """Make one contact step that may hold an extreme of the force, and may end at a breakpoint or in a loss."""
    L, held = pool.L, pool.held
    filled = cells.fill_all(stage + kind, kind, pool)
    call_eight(pool.made[kind], L)
    _choose_ends(filled, stage, kind, pool.made, L)
    if stage == cells.TURN or not _is_everywhere(at.LANE_CALM, L):
        varies = variants.is_bent(kind) or variants.is_lossy(kind)
        _find(variants.SEEK_EXTREME if varies else variants.SEEK_TURN, pool.made, L)
    else:
        for i in range(at.LANES):
            L[at.LANE_CHANGES + i] = 0.0
    for i in range(filled):
        _act(i, held[i], kind, pool)


@inlined_uncounted_kernel
def _step_in_flight(which: int, pool: cells.Pool) -> None:
    """Make one step in flight, up to the impact or the breakpoint in it."""
    L, rows, held = pool.L, pool.rows, pool.held
    over = which - cells.FLY
    kind = variants.touching_of(over)
    filled = cells.fill_all(which, kind, pool)
    for i in range(at.LANES):
        L[at.LANE_FRESH + i] = 1.0 if i >= filled else rows[held[i], cells.COUNTS + OPENED]
    call_eight(pool.made[variants.FLIGHTS + over], L)
    call_eight(pool.made[variants.SCAN_FLIGHT], L)
    while not _is_everywhere(at.LANE_DONE, L):
        call_eight(pool.made[variants.SHARPEN_FLIGHT], L)
    for i in range(at.LANES):
        L[at.LANE_T_ROOT + i] = L[at.LANE_LENGTH + i]
        if L[at.LANE_CHANGES + i] == 1.0:
            L[at.LANE_T_ROOT + i] *= L[at.LANE_X + i]
    call_eight(pool.made[variants.FLIGHT_ENDS + over], L)
    for i in range(filled):
        _fly_on(i, held[i], kind, pool)


@inlined_uncounted_kernel
def _fly_on(i: int, cell: int, kind: int, pool: cells.Pool) -> None:
    """Take a cell to the end of its step in flight, and to its next queue."""
    L, rows = pool.L, pool.rows
    lands = L[at.LANE_CHANGES + i] == 1.0
    time = L[at.LANE_TIME + i] + L[at.LANE_T_ROOT + i]
    at_break = not time < L[at.LANE_UNTIL + i]
    plain = L[at.LANE_LENGTH + i] > 0.0 and L[at.LANE_SIGN + i] < 0.0 and L[at.LANE_CHANGES + i] <= 1.0
    if not plain or (lands and at_break):
        cells.push(cell, cells.APART, pool.queue)
        return
    end = L[at.LANE_UNTIL + i] if at_break else time
    _commit(i, cell, end, kind, FLIGHT, L[at.LANE_T_ROOT + i], pool)
    if lands:
        L[at.LANE_U0 + i] = 0.0
        L[at.LANE_W0 + i] = L[at.LANE_W_ROOT + i]
    cells.keep_lane(i, cell, kind, rows, L)
    rows[cell, cells.COUNTS + OPENED] = 0.0
    if lands:
        rows[cell, PHASE] = CONTACT
        rate = L[at.LANE_W_ROOT + i]
        if cells.note_event(cell, time, IMPACT, rate, pool):
            next_kind = int(rows[cell, cells.CELL_KIND])
            cells.push(cell, cells.COAST + next_kind if rate >= GRAZE else cells.APART, pool.queue)
    elif not at_break:
        cells.push(cell, queue_of_flight(kind), pool.queue)
    elif cross_softly(cell, pool):
        cells.push(cell, queue_of_flight(int(rows[cell, cells.CELL_KIND])), pool.queue)
    else:
        _cross_hard(cell, pool)


@uncounted_kernel
def lanes_kernel(pool: cells.Pool) -> bool:
    """March all cells to their ends; return False when a table needs more room."""
    queue, used = pool.queue, pool.used
    while True:
        if max(used[cells.USED_EVENTS] - len(pool.events), used[cells.USED_PEAKS] - len(pool.peaks)) + cells.ROOM > 0:
            return False
        if not cells.may_log(pool):
            return False
        if queue[cells.WAITING, cells.APART] > 0:
            if not go_apart(pool):
                return False
            continue
        fullest = 0
        for stage in range(0, cells.APART, cells.KINDS):
            for which in range(stage, min(stage + used[cells.USED_KINDS], cells.APART)):
                if queue[cells.WAITING, which] > queue[cells.WAITING, fullest]:
                    fullest = which
        if queue[cells.WAITING, fullest] == 0:
            return True
        drain = queue[cells.WAITING, fullest] < at.LANES
        if fullest >= cells.FLY:
            _step_in_flight(fullest, pool)
        elif fullest >= cells.TURN:
            kind = fullest % cells.KINDS
            _step_with_event(fullest - kind, kind, pool)
        else:
            _step_until_event(fullest, drain, pool)
