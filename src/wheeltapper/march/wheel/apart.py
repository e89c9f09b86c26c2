"""Cells one at a time: start, breakpoints, all steps that lanes cannot do, and the return to the lanes."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import CONTACT, FLIGHT, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray, IntArray
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.held_end import held_coefficients
from wheeltapper.march.steps.layout import COUNT, MARK, STATE
from wheeltapper.march.steps.series import harmonic_at, localise
from wheeltapper.march.steps.steplength import SLOW
from wheeltapper.march.steps.variants import OVER_BENT, OVER_WAVE, in_flight_of, variant_of
from wheeltapper.march.wheel import pool as cells
from wheeltapper.march.wheel.events import AT_BREAK, GRAZE, cross_break, elastic_force, is_free, wheel_motion
from wheeltapper.march.wheel.single import advance_kernel, start_from, start_kernel


@inlined_uncounted_kernel
def polynomial_at(pieces: FloatArray, piece: int, source: int, degree: int, x: float) -> tuple[float, float]:
    """Return a polynomial of a piece at the place ξ = x, and its derivative; `source` is its first column."""
    value, slope = 0.0, 0.0
    k = int(pieces[piece, degree])
    while k >= 0:
        slope = slope * x + value
        value = value * x + pieces[piece, source + k]
        k -= 1
    return value, slope


@inlined_uncounted_kernel
def force_at(
    cell: int, time: float, u: float, w: float, pieces: FloatArray, first: IntArray, rows: FloatArray
) -> float:
    """Return the contact force of a cell at indentation u² and rate w."""
    piece, local = first[cell] + int(rows[cell, PIECE]), cells.LOCAL
    factor = 1.0
    if pieces[piece, contract.FACTOR_DEGREE] >= 0.0:
        x = rows[cell, local + at.CELL_PACE] * time - rows[cell, local + at.CELL_ORIGIN]
        factor, _ = polynomial_at(pieces, piece, contract.FACTOR, contract.FACTOR_DEGREE, x)
    quadratic, cubic = rows[cell, local + at.CELL_QUADRATIC], rows[cell, local + at.CELL_CUBIC]
    return elastic_force(factor, quadratic, cubic, rows[cell, local + at.CELL_ETA], u, w)


@uncounted_kernel
def rail_at_time(cell: int, time: float, deck_y: float, deck_v: float, pool: cells.Pool) -> tuple[float, float]:
    """Return height and velocity of the rail under a cell's wheel."""
    local = pool.rows[cell, cells.LOCAL :]
    lift, pace = pool.numbers[cell, contract.LIFT], local[at.CELL_PACE]
    piece = pool.first[cell] + int(pool.rows[cell, PIECE])
    height, slope = pool.pieces[piece, contract.COEFFICIENT], 0.0
    if pool.pieces[piece, contract.DEGREE] > 0.0:
        x = pace * time - local[at.CELL_ORIGIN]
        height, slope = polynomial_at(pool.pieces, piece, contract.COEFFICIENT, contract.DEGREE, x)
    on = local[at.CELL_ON]
    height, velocity = lift * height + on * deck_y, lift * pace * slope + on * deck_v
    if local[at.CELL_OMEGA] != 0.0:
        turns = local[at.CELL_RATE] * time - local[at.CELL_OFFSET]
        phase = 2.0 * np.pi * (turns - np.rint(turns))
        h, g = harmonic_at(local[at.CELL_AMP_SIN], local[at.CELL_AMP_COS], local[at.CELL_OMEGA], phase)
        height, velocity = height + h, velocity + g
    return height, velocity


@inlined_uncounted_kernel
def path_to_row(numbers: FloatArray, piece: FloatArray, shift: float, row: FloatArray) -> None:
    """Write what lanes need of a piece of the path in a row of CELL_NUMBERS; its polynomials are not among it."""
    lift, pace = numbers[contract.LIFT], numbers[contract.PACE]
    turns = piece[contract.WAVENUMBER] / (2.0 * np.pi)
    omega = piece[contract.WAVENUMBER] * pace
    a, b = lift * piece[contract.SINE], lift * piece[contract.COSINE]
    origin = shift + piece[contract.CENTRE]
    row[at.CELL_LEVEL] = lift * piece[contract.COEFFICIENT]
    row[at.CELL_LOAD] = 1.0 + numbers[contract.STIFFNESS] * row[at.CELL_LEVEL]
    row[at.CELL_AMP_SIN] = a
    row[at.CELL_AMP_COS] = b
    row[at.CELL_OMEGA] = omega
    row[at.CELL_RATE] = turns * pace
    row[at.CELL_OFFSET] = turns * origin
    row[at.CELL_PACE] = pace / piece[contract.SCALE]
    row[at.CELL_ORIGIN] = origin / piece[contract.SCALE]


@inlined_uncounted_kernel
def enter_path(cell: int, pool: cells.Pool) -> None:
    """Write what lanes need of the present piece of a cell's path, and until when, in its row."""
    numbers = pool.numbers[cell]
    piece = pool.pieces[pool.first[cell] + int(pool.rows[cell, PIECE])]
    row, pace = pool.rows[cell, cells.LOCAL :], numbers[contract.PACE]
    path_to_row(numbers, piece, pool.rows[cell, SHIFT], row)
    until, time = numbers[contract.END], pool.rows[cell, TIME]
    if pace > 0.0:
        until = min(until, (piece[contract.STOP] + pool.rows[cell, SHIFT]) / pace)
    if numbers[contract.DECK_MASS] > 0.0:
        border = numbers[contract.DECK_FROM] if time < numbers[contract.DECK_FROM] else numbers[contract.DECK_TO]
        until = min(until, border) if time < border else until
    row[at.CELL_UNTIL] = until
    kind = variant_of(numbers, piece, False)
    if kind <= OVER_WAVE and numbers[contract.STIFFNESS] + numbers[contract.DAMPING] > SLOW:
        kind = OVER_BENT  # the other two do not look at how fast the suspension is
    pool.rows[cell, cells.CELL_KIND] = kind
    pool.used[cells.USED_KINDS] = max(pool.used[cells.USED_KINDS], kind + 1, 2)


@uncounted_kernel
def numbers_to_row(numbers: FloatArray, on: float, mode: float, row: FloatArray) -> None:
    """Write suspension, contact and deck, on which the wheel is (1) or not (0), in a row of CELL_NUMBERS.

    `mode` is what holds the end of a damper that has one of its own; else FREE.
    """
    mass = numbers[contract.DECK_MASS]
    per_mass = 1.0 / mass if mass > 0.0 else 0.0
    row[at.CELL_K] = numbers[contract.STIFFNESS]
    damping, bush, rate = held_coefficients(mode, numbers)
    row[at.CELL_G] = numbers[contract.DAMPING] + damping
    row[at.CELL_GOAL] = np.log2(numbers[contract.TOLERANCE])
    row[at.CELL_CUBIC] = numbers[contract.CUBIC]
    row[at.CELL_QUADRATIC] = numbers[contract.QUADRATIC]
    row[at.CELL_ETA] = numbers[contract.HYSTERESIS]
    row[at.CELL_ON] = on
    row[at.CELL_PRESTRESS] = on * numbers[contract.PRESTRESS] * per_mass
    row[at.CELL_DECK_STIFF] = numbers[contract.DECK_STIFFNESS] * per_mass
    row[at.CELL_DECK_DRAG] = numbers[contract.DECK_DAMPING] * per_mass
    row[at.CELL_SHARE] = on * per_mass
    row[at.CELL_BUSH] = bush
    row[at.CELL_BUSH_RATE] = rate
    row[at.CELL_GIVES] = 1.0 if bush > 0.0 else 0.0


@uncounted_kernel
def enter_cell(cell: int, pool: cells.Pool) -> None:
    """Write what lanes need of a cell in its row."""
    row = pool.rows[cell]
    numbers_to_row(pool.numbers[cell], row[contract.ON_DECK], row[contract.END_MODE], row[cells.LOCAL :])
    enter_path(cell, pool)


@uncounted_kernel
def queue_of_flight(kind: int) -> int:
    """Return the queue in which a cell in flight waits."""
    return cells.FLY + in_flight_of(kind)


@uncounted_kernel
def join_queue(cell: int, pool: cells.Pool) -> bool:
    """Put the cell in S in the queue of its next step, if lanes can take it; else return False."""
    S, numbers = pool.S, pool.numbers[cell]
    ended = S[COUNT + layout.SEEN] != 0.0 or S[COUNT + layout.EVENTS] >= numbers[contract.EVENT_LIMIT]
    if ended or numbers[contract.BILATERAL] != 0.0 or numbers[contract.DAMPER_PLAY] > 0.0:
        return False
    flying = S[STATE + PHASE] == FLIGHT
    u, w = S[STATE + A], S[STATE + B]
    if not flying and not (S[STATE + PHASE] == CONTACT and (u > 0.0 or w >= GRAZE)):
        return False
    corner = S[MARK + AT_BREAK]
    S[MARK + AT_BREAK] = 0.0
    cells.put_back(cell, pool.rows, S)
    enter_cell(cell, pool)
    kind = int(pool.rows[cell, cells.CELL_KIND])
    force = 0.0
    if not flying:
        force = force_at(cell, S[STATE + TIME], u, w, pool.pieces, pool.first, pool.rows)
    cells.track_force(cell, S[STATE + TIME], force, corner, pool)
    cells.push(cell, queue_of_flight(kind) if flying else cells.COAST + kind, pool.queue)
    return True


@inlined_uncounted_kernel
def cross_softly(cell: int, pool: cells.Pool) -> bool:
    """Take a cell over a breakpoint where the path stays smooth; return False, and do nothing, where there is more."""
    rows, numbers = pool.rows, pool.numbers[cell]
    first, many = pool.first[cell], pool.many[cell]
    time, shift, piece = rows[cell, TIME], rows[cell, SHIFT], int(rows[cell, PIECE])
    end = (pool.pieces[first + piece, contract.STOP] + shift) / numbers[contract.PACE]
    after, join = piece + 1, contract.SOFT
    if after < many:
        join = int(pool.pieces[first + after, contract.JOIN])
    else:
        after, join = int(numbers[contract.LOOP]), int(numbers[contract.LOOP_JOIN])
        if after >= many:
            return False
        shift += pool.pieces[first + piece, contract.STOP] - pool.pieces[first + after, contract.START]
    here = time * (1.0 + 4e-16)
    ends_too = (pool.pieces[first + after, contract.STOP] + shift) / numbers[contract.PACE] <= here
    if time >= numbers[contract.END] or join != contract.SOFT or not end <= here or ends_too:
        return False
    if time == numbers[contract.DECK_FROM] or time == numbers[contract.DECK_TO]:
        return False
    rows[cell, PIECE] = after
    rows[cell, SHIFT] = shift
    enter_path(cell, pool)
    return True


@uncounted_kernel
def cross_breakpoint(cell: int, pool: cells.Pool) -> None:
    """Take a cell across the breakpoint that it has reached, or end its march there."""
    S, numbers = pool.S, pool.numbers[cell]
    cells.load_cell(cell, pool.rows, S)
    why = contract.DONE
    if S[STATE + TIME] < numbers[contract.END]:
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        localise(table, numbers, int(S[STATE + PIECE]), S[STATE + SHIFT], S[STATE + TIME], S)
        event = int(S[COUNT + layout.EVENTS])
        why = cross_break(table, numbers, pool.events[pool.used[cells.USED_EVENTS] - event :], S)
        cells.claim_rows(cell, int(S[COUNT + layout.EVENTS]) - event, 0, pool)
    if why != contract.RUNNING:
        cells.finish_cell(cell, why, S[STATE + TIME], pool.rows)
    elif not join_queue(cell, pool):
        cells.put_back(cell, pool.rows, S)
        cells.push(cell, cells.APART, pool.queue)


@uncounted_kernel
def go_apart(pool: cells.Pool) -> bool:
    """March one cell alone until lanes can take it, or to its end; return False if a table needs more room."""
    rows, queue = pool.rows, pool.queue
    cell = cells.pop(cells.APART, queue)
    pool.used[cells.VISITS] += 1
    table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
    numbers = pool.numbers[cell]
    S = pool.S
    cells.load_cell(cell, rows, S)
    while True:
        if not cells.may_log(pool):
            cells.put_back(cell, rows, S)
            cells.push(cell, cells.APART, queue)
            return False
        S[COUNT] = 0.0
        event, peak = int(S[COUNT + layout.EVENTS]), int(S[COUNT + layout.PEAKS])
        events = pool.events[pool.used[cells.USED_EVENTS] - event :]
        peaks = pool.peaks[pool.used[cells.USED_PEAKS] - peak : len(pool.peaks) - 1]  # a corner may need one row more
        why = advance_kernel(table, numbers, None, pool.steps, events, peaks, pool.steps[:0], S)
        cells.claim_rows(cell, int(S[COUNT + layout.EVENTS]) - event, int(S[COUNT + layout.PEAKS]) - peak, pool)
        cells.log_rows(cell, int(S[COUNT]), pool)
        if why == contract.RUNNING and join_queue(cell, pool):
            return True
        if why != contract.RUNNING:
            cells.put_back(cell, rows, S)
            if why == contract.FULL:
                cells.push(cell, cells.APART, queue)
                return False
            cells.finish_cell(cell, why, S[STATE + TIME], rows)
            return True


@uncounted_kernel
def start_lanes(motions: FloatArray, pool: cells.Pool) -> None:
    """Set every cell's state at time zero: rows of `motions`, or where there are none what its numbers say."""
    S = pool.S
    for cell in range(len(pool.first)):
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        if len(motions) == 0:
            start_kernel(table, pool.numbers[cell], pool.events, S)
        else:
            y, v, deck_y, deck_v = motions[cell]
            start_from(table, pool.numbers[cell], y, v, deck_y, deck_v, pool.events, S)
        pool.rows[cell, cells.AIRBORNE] = 1.0 if is_free(S[STATE + PHASE]) else 0.0
        cells.put_back(cell, pool.rows, S)
        if not join_queue(cell, pool):
            cells.push(cell, cells.APART, pool.queue)


@uncounted_kernel
def motions_kernel(pool: cells.Pool, out: FloatArray) -> None:
    """Write displacement and velocity of every cell's wheel, and of its deck, into `out` (cells, CELL_MOTIONS)."""
    S = pool.S
    for cell in range(len(pool.first)):
        table = pool.pieces[pool.first[cell] : pool.first[cell] + pool.many[cell]]
        cells.load_cell(cell, pool.rows, S)
        y, v = wheel_motion(table, pool.numbers[cell], S[STATE:], S)
        out[cell, cells.CELL_HEIGHT], out[cell, cells.CELL_VELOCITY] = y, v
        out[cell, cells.CELL_DECK_HEIGHT] = S[STATE + contract.DECK_Y]
        out[cell, cells.CELL_DECK_VELOCITY] = S[STATE + contract.DECK_V]
