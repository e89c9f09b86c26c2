"""Cells one at a time: start, breakpoints, all steps that lanes cannot do, and the return to the lanes."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import lane_rows as at
from wheeltapper.march import layout
from wheeltapper.march import pool as cells
from wheeltapper.march import program as contract
from wheeltapper.march.events import AT_BREAK, GRAZE, cross_break, is_free, piece_end
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import COUNT, MARK, STATE
from wheeltapper.march.program import CONTACT, DONE, FLIGHT, FULL, PHASE, PIECE, RUNNING, SHIFT, TIME, A, B
from wheeltapper.march.series import harmonic_forcing, localise
from wheeltapper.march.single import advance_kernel, start_kernel
from wheeltapper.march.step import is_written_out


@kernel
def join_queue(cell: int, pool: cells.Pool) -> bool:
    """Put the cell in S in the queue of its next step, if lanes can take it; else return False."""
    S, numbers = pool.S, pool.numbers[cell]
    if (
        not is_written_out(numbers, S)
        or numbers[contract.BILATERAL] != 0.0
        or S[COUNT + layout.SEEN] != 0.0
        or S[COUNT + layout.EVENTS] >= numbers[contract.EVENT_LIMIT]
    ):
        return False
    flying = S[STATE + PHASE] == FLIGHT
    u, w = S[STATE + A], S[STATE + B]
    if not flying and not (S[STATE + PHASE] == CONTACT and (u > 0.0 or w >= GRAZE)):
        return False
    corner = S[MARK + AT_BREAK]
    S[MARK + AT_BREAK] = 0.0
    cells.put_back(cell, pool.rows, S)
    cells.track_force(cell, S[STATE + TIME], 0.0 if flying else u * u * u, corner, pool)
    row = pool.rows[cell, cells.LOCAL :]
    table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
    piece = table[int(S[STATE + PIECE])]
    turns = piece[contract.WAVENUMBER] / (2.0 * np.pi)
    gain_sin, gain_cos = harmonic_forcing(numbers, S)
    row[at.CELL_K] = numbers[contract.STIFFNESS]
    row[at.CELL_G] = numbers[contract.DAMPING]
    row[at.CELL_LOAD] = 1.0 + numbers[contract.STIFFNESS] * S[layout.HERE_POLY]
    row[at.CELL_LEVEL] = S[layout.HERE_POLY]
    row[at.CELL_GAIN_SIN] = gain_sin
    row[at.CELL_GAIN_COS] = gain_cos
    row[at.CELL_AMP_SIN] = S[layout.HERE_AMP_SIN]
    row[at.CELL_AMP_COS] = S[layout.HERE_AMP_COS]
    row[at.CELL_OMEGA] = S[layout.HERE_OMEGA]
    row[at.CELL_RATE] = turns * numbers[contract.PACE]
    row[at.CELL_OFFSET] = turns * (S[STATE + SHIFT] + piece[contract.CENTRE])
    row[at.CELL_UNTIL] = min(piece_end(table, numbers, S), numbers[contract.END])
    row[at.CELL_GOAL] = np.log2(numbers[contract.TOLERANCE])
    kind = cells.FLAT if S[layout.HERE_OMEGA] == 0.0 else cells.WAVE
    cells.push(cell, cells.FLY if flying else cells.COAST + kind, pool.queue)
    return True


@kernel
def cross_breakpoint(cell: int, pool: cells.Pool) -> None:
    """Take a cell across the breakpoint that it has reached, or end its march there."""
    S, numbers = pool.S, pool.numbers[cell]
    cells.load_cell(cell, pool.rows, S)
    why = DONE
    if S[STATE + TIME] < numbers[contract.END]:
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        localise(table, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
        event = int(S[COUNT + layout.EVENTS])
        why = cross_break(table, numbers, pool.events[pool.used[cells.USED_EVENTS] - event :], S)
        cells.claim_rows(cell, int(S[COUNT + layout.EVENTS]) - event, 0, pool)
    if why != RUNNING:
        cells.finish_cell(cell, why, S[STATE + TIME], pool.rows)
    elif not join_queue(cell, pool):
        cells.put_back(cell, pool.rows, S)
        cells.push(cell, cells.APART, pool.queue)


@kernel
def go_apart(pool: cells.Pool) -> bool:
    """March one cell alone until lanes can take it, or to its end; return False if its events need more room."""
    rows, queue = pool.rows, pool.queue
    cell = cells.pop(cells.APART, queue)
    pool.used[cells.VISITS] += 1
    table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
    numbers = pool.numbers[cell]
    S = pool.S
    cells.load_cell(cell, rows, S)
    while True:
        S[COUNT] = 0.0
        event, peak = int(S[COUNT + layout.EVENTS]), int(S[COUNT + layout.PEAKS])
        events = pool.events[pool.used[cells.USED_EVENTS] - event :]
        peaks = pool.peaks[pool.used[cells.USED_PEAKS] - peak : len(pool.peaks) - 1]  # a corner may need one row more
        why = advance_kernel(table, numbers, None, None, pool.steps, events, peaks, None, S, None)
        cells.claim_rows(cell, int(S[COUNT + layout.EVENTS]) - event, int(S[COUNT + layout.PEAKS]) - peak, pool)
        if why == FULL:
            cells.put_back(cell, rows, S)
            cells.push(cell, cells.APART, queue)
            return False
        if why != RUNNING:
            cells.finish_cell(cell, why, S[STATE + TIME], rows)
            return True
        if join_queue(cell, pool):
            return True


@kernel
def start_lanes(pool: cells.Pool) -> None:
    """Set every cell's state at time zero."""
    for cell in range(len(pool.first)):
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        start_kernel(table, pool.numbers[cell], pool.events, pool.S)
        pool.rows[cell, cells.AIRBORNE] = 1.0 if is_free(pool.S[STATE + PHASE]) else 0.0
        cells.put_back(cell, pool.rows, pool.S)
        if not join_queue(cell, pool):
            cells.push(cell, cells.APART, pool.queue)
