"""Cells one at a time: start, breakpoints, all steps that lanes cannot do, and the return to the lanes."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.events import AT_BREAK, GRAZE, cross_break, is_free, piece_end
from wheeltapper.march.kernel import kernel
from wheeltapper.march.lane_rows import (
    CELL_AMP_COS,
    CELL_AMP_SIN,
    CELL_G,
    CELL_GAIN_COS,
    CELL_GAIN_SIN,
    CELL_GOAL,
    CELL_K,
    CELL_LEVEL,
    CELL_LOAD,
    CELL_OFFSET,
    CELL_OMEGA,
    CELL_RATE,
    CELL_UNTIL,
)
from wheeltapper.march.layout import (
    COUNT,
    EVENTS,
    HERE_AMP_COS,
    HERE_AMP_SIN,
    HERE_OMEGA,
    HERE_POLY,
    MARK,
    PEAKS,
    SEEN,
    STATE,
)
from wheeltapper.march.pool import (
    AIRBORNE,
    APART,
    COAST,
    FLAT,
    FLY,
    LOCAL,
    USED_EVENTS,
    USED_PEAKS,
    VISITS,
    WAVE,
    Pool,
    finish,
    own,
    pop,
    push,
    put_back,
    take,
    track,
)
from wheeltapper.march.program import CONTACT, DONE, FLIGHT, FULL, PHASE, PIECE, RUNNING, SHIFT, TIME, A, B
from wheeltapper.march.series import harmonic_forcing, localise
from wheeltapper.march.single import advance_kernel, start_kernel
from wheeltapper.march.step import is_written_out


@kernel
def join(cell: int, pool: Pool) -> bool:
    """Put the cell in S in the queue of its next step, if lanes can take it; else return False."""
    S, numbers = pool.S, pool.numbers[cell]
    if (
        not is_written_out(numbers, S)
        or numbers[contract.BILATERAL] != 0.0
        or S[COUNT + SEEN] != 0.0
        or S[COUNT + EVENTS] >= numbers[contract.EVENT_LIMIT]
    ):
        return False
    flying = S[STATE + PHASE] == FLIGHT
    u, w = S[STATE + A], S[STATE + B]
    if not flying and not (S[STATE + PHASE] == CONTACT and (u > 0.0 or w >= GRAZE)):
        return False
    corner = S[MARK + AT_BREAK]
    S[MARK + AT_BREAK] = 0.0
    put_back(cell, pool.rows, S)
    track(cell, S[STATE + TIME], 0.0 if flying else u * u * u, corner, pool)
    row = pool.rows[cell, LOCAL:]
    table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
    piece = table[int(S[STATE + PIECE])]
    turns = piece[contract.WAVENUMBER] / (2.0 * np.pi)
    gain_sin, gain_cos = harmonic_forcing(numbers, S)
    row[CELL_K] = numbers[contract.STIFFNESS]
    row[CELL_G] = numbers[contract.DAMPING]
    row[CELL_LOAD] = 1.0 + numbers[contract.STIFFNESS] * S[HERE_POLY]
    row[CELL_LEVEL] = S[HERE_POLY]
    row[CELL_GAIN_SIN] = gain_sin
    row[CELL_GAIN_COS] = gain_cos
    row[CELL_AMP_SIN] = S[HERE_AMP_SIN]
    row[CELL_AMP_COS] = S[HERE_AMP_COS]
    row[CELL_OMEGA] = S[HERE_OMEGA]
    row[CELL_RATE] = turns * numbers[contract.PACE]
    row[CELL_OFFSET] = turns * (S[STATE + SHIFT] + piece[contract.CENTRE])
    row[CELL_UNTIL] = min(piece_end(table, numbers, S), numbers[contract.END])
    row[CELL_GOAL] = np.log2(numbers[contract.TOLERANCE])
    kind = FLAT if S[HERE_OMEGA] == 0.0 else WAVE
    push(cell, FLY if flying else COAST + kind, pool.queue)
    return True


@kernel
def cross(cell: int, pool: Pool) -> None:
    """Take a cell across the breakpoint that it has reached, or end its march there."""
    S, numbers = pool.S, pool.numbers[cell]
    take(cell, pool.rows, S)
    why = DONE
    if S[STATE + TIME] < numbers[contract.END]:
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        localise(table, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
        event = int(S[COUNT + EVENTS])
        why = cross_break(table, numbers, pool.events[pool.used[USED_EVENTS] - event :], S)
        own(cell, int(S[COUNT + EVENTS]) - event, 0, pool)
    if why != RUNNING:
        finish(cell, why, S[STATE + TIME], pool.rows)
    elif not join(cell, pool):
        put_back(cell, pool.rows, S)
        push(cell, APART, pool.queue)


@kernel
def go_apart(pool: Pool) -> bool:
    """March one cell alone until lanes can take it, or to its end; return False if its events need more room."""
    rows, queue = pool.rows, pool.queue
    cell = pop(APART, queue)
    pool.used[VISITS] += 1
    table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
    numbers = pool.numbers[cell]
    S = pool.S
    take(cell, rows, S)
    while True:
        S[COUNT] = 0.0
        event, peak = int(S[COUNT + EVENTS]), int(S[COUNT + PEAKS])
        events = pool.events[pool.used[USED_EVENTS] - event :]
        peaks = pool.peaks[pool.used[USED_PEAKS] - peak : len(pool.peaks) - 1]  # a corner may need one row more
        why = advance_kernel(table, numbers, None, None, pool.steps, events, peaks, None, S, None)
        own(cell, int(S[COUNT + EVENTS]) - event, int(S[COUNT + PEAKS]) - peak, pool)
        if why == FULL:
            put_back(cell, rows, S)
            push(cell, APART, queue)
            return False
        if why != RUNNING:
            finish(cell, why, S[STATE + TIME], rows)
            return True
        if join(cell, pool):
            return True


@kernel
def start_lanes(pool: Pool) -> None:
    """Set every cell's state at time zero."""
    for cell in range(len(pool.first)):
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        start_kernel(table, pool.numbers[cell], pool.events, pool.S)
        pool.rows[cell, AIRBORNE] = 1.0 if is_free(pool.S[STATE + PHASE]) else 0.0
        put_back(cell, pool.rows, pool.S)
        if not join(cell, pool):
            push(cell, APART, pool.queue)
