"""Tangents of contact steps in lanes: how the end of a step changes with its start and with parameters.

A step that is known from the march can be differentiated before the tangents at its start are. Its link is linear:

    tangents at its end = Σ link of (t, u, w, Y, Z at its start) · tangents at its start + link of the parameters

So eight steps of one cell take their links together, lane by lane, and the tangents of the march then go from link to
link. Tangents are those at fixed s (tangent.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import CONTACT, LENGTH, ON_DECK, PHASE, PIECE, SHIFT, FloatArray, IntArray
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps import variants
from wheeltapper.march.steps.calling import call_eight
from wheeltapper.march.steps.tangent_path import DA, DB, DSHIFT, DT, DY, DZ, LANES
from wheeltapper.march.steps.variants import ALONGS, BASES, OF_LOSSY, has_deck, is_bent, is_flat, is_lossy
from wheeltapper.march.steps.written import tangents_of_cells
from wheeltapper.march.wheel import pool as cells
from wheeltapper.march.wheel.apart import enter_cell

LINK_ROWS = 256
"""Steps of a cell that are linked at a time."""
STARTS = 5
"""Rows of a link, DT to DZ: of time, u, w and the deck's motion, at the step's start and at its end."""
LINKS = STARTS + LANES - 2


class Links(NamedTuple):
    """Links of some steps of a cell, and what making them takes."""

    pool: cells.Pool  # the cells, which have marched; their rows are scratch memory
    directions: IntArray  # the lanes of the tangents that parameters have
    link: FloatArray  # (LINK_ROWS, LINKS, STARTS): of the starts, then of the parameters
    end: FloatArray  # (LINK_ROWS, STARTS): time after the step's start, u, w and the deck's motion at the step's end
    known: IntArray  # (LINK_ROWS,): 1 where a step has a link
    L: FloatArray  # (TANGENT_ENTRIES,)
    which: IntArray  # (LANES,): the step in each lane
    shifts: FloatArray  # (LANES, LANES): derivatives of the table's shift at the step in each lane
    shift: FloatArray  # (LANES,): the same at the present step


def links_of(pool: cells.Pool, directions: IntArray, lossy: bool) -> Links:
    """Return room for links of the cells of a pool; `lossy`: they are differentiated by their hysteresis, too."""
    made = tangents_of_cells(pool.numbers, pool.pieces, lossy)
    pool = pool._replace(made=made)
    return Links(
        pool, directions, np.zeros((LINK_ROWS, LINKS, STARTS)), np.zeros((LINK_ROWS, STARTS)),
        np.zeros(LINK_ROWS, dtype=np.int64), np.zeros(at.TANGENT_ENTRIES), np.zeros(at.LANES, dtype=np.int64),
        np.zeros((at.LANES, LANES)), np.zeros(LANES),
    )  # fmt: skip


@inlined_uncounted_kernel
def _show_columns(i: int, row: FloatArray, kind: int, first: int, L: FloatArray) -> None:
    """Put what a kind of steps needs of a row of the table of pieces, or of its changes, in a lane of L."""
    for column in (contract.CENTRE, contract.COEFFICIENT, contract.SINE, contract.COSINE, contract.WAVENUMBER):
        L[first + at.LANES * column + i] = row[column]
    if is_bent(kind):
        for k in range(contract.TERMS):
            L[first + at.LANES * (contract.COEFFICIENT + k) + i] = row[contract.COEFFICIENT + k]
            L[first + at.LANES * (contract.FACTOR + k) + i] = row[contract.FACTOR + k]


@inlined_uncounted_kernel
def _show_piece(i: int, kind: int, piece: FloatArray, step: FloatArray, L: FloatArray) -> None:
    """Put a step's piece of the path in a lane of L, as its table has it."""
    L[at.LANE_SHIFT + i] = step[SHIFT]
    L[at.LANE_PIECE + at.LANES * contract.SCALE + i] = piece[contract.SCALE]
    _show_columns(i, piece, kind, at.LANE_PIECE, L)
    if piece[contract.FACTOR_DEGREE] < 0.0:
        L[at.LANE_PIECE + at.LANES * contract.FACTOR + i] = 1.0


@inlined_uncounted_kernel
def _show_changes(
    filled: int, kind: int, lane: int, base: int, steps: FloatArray, turns: FloatArray, bends: FloatArray,
    table: IntArray, links: Links,
) -> None:  # fmt: skip
    """Put in L how a cell's numbers and the pieces under its steps change with a parameter."""
    for k in range(contract.NUMBERS):
        links.L[at.LANE_OF_NUMBERS + k] = turns[k, lane]
    for i in range(filled):
        links.L[at.LANE_OF_SHIFT + i] = links.shifts[i, lane]
        if table[lane] >= 0:
            bend = bends[table[lane], base + int(steps[links.which[i], PIECE])]
            _show_columns(i, bend, kind, at.LANE_OF_PIECE, links.L)
    if table[lane] < 0:
        for k in range(at.LANE_OF_PIECE, at.LANE_NUMBERS):
            links.L[k] = 0.0


@inlined_uncounted_kernel
def _keep_link(filled: int, begin: int, parts: int, k: int, links: Links) -> None:
    """Keep what was found along one direction."""
    for i in range(filled):
        step = links.which[i] - begin
        for part in range(parts):
            links.link[step, k, part] = links.L[at.LANE_OF_T_END + at.LANES * part + i]


@uncounted_kernel
def _link_lanes(
    filled: int, begin: int, kind: int, base: int, steps: FloatArray, turns: FloatArray, bends: FloatArray,
    table: IntArray, links: Links,
) -> None:  # fmt: skip
    """Link the steps in the lanes, all of one kind."""
    L, pool = links.L, links.pool
    if filled == 0:
        return
    for i in range(filled, at.LANES):
        cells.fill_lane(i, cells.EMPTY, kind, pool.pieces, pool.first, pool.numbers, pool.rows, L)
        L[at.LANE_LENGTH + i] = 0.0
        L[at.LANE_PIECE + at.LANES * contract.SCALE + i] = 1.0
    call_eight(pool.made[BASES + kind], L)
    for i in range(filled):
        row = links.end[links.which[i] - begin]
        row[DT] = L[at.LANE_T_END + i]
        row[DA] = L[at.LANE_U_END + i]
        row[DB] = L[at.LANE_W_END + i]
        row[DY] = L[at.LANE_DECK_Y_END + i] if has_deck(kind) else 0.0
        row[DZ] = L[at.LANE_DECK_V_END + i] if has_deck(kind) else 0.0
        links.known[links.which[i] - begin] = 1
    for k in range(at.LANE_OF_TIME, at.LANE_SHIFT):
        L[k] = 0.0
    for k in range(at.LANE_OF_FORCING, at.LANE_BASE):
        L[k] = 0.0
    parts = STARTS if has_deck(kind) else 3
    level = is_flat(kind)
    for start in range(parts):
        if start == DT and level:  # nothing depends on time
            for i in range(filled):
                links.link[links.which[i] - begin, DT] = 0.0
                links.link[links.which[i] - begin, DT, DT] = 1.0
            continue
        for i in range(at.LANES):
            L[at.LANE_OF_TIME + at.LANES * start + i] = 1.0
        call_eight(pool.made[ALONGS + kind], L)
        for i in range(at.LANES):
            L[at.LANE_OF_TIME + at.LANES * start + i] = 0.0
        _keep_link(filled, begin, parts, start, links)
    for k in range(len(links.directions)):
        lane = links.directions[k]
        _show_changes(filled, kind, lane, base, steps, turns, bends, table, links)
        call_eight(pool.made[variants.TURN_BENT if is_bent(kind) else variants.TURN_LEVEL], L)
        call_eight(pool.made[ALONGS + kind], L)
        _keep_link(filled, begin, parts, STARTS + k, links)


@uncounted_kernel
def link_steps(
    cell: int, begin: int, steps: FloatArray, turns: FloatArray, bends: FloatArray, table: IntArray,
    carried: FloatArray, links: Links,
) -> None:  # fmt: skip
    """Link the steps of a cell from `begin` on, as many as there is room for; others in contact than elastic have none.

    `carried` are the tangents at the step `begin`.
    """
    pool, L = links.pool, links.L
    row, numbers, base = pool.rows[cell], pool.numbers[cell], pool.first[cell]
    links.known[:] = 0
    filled, kind, entered, lossy = 0, -1, False, False
    for k in range(contract.NUMBERS):
        L[at.LANE_NUMBERS + k] = numbers[k]
    if numbers[contract.DECK_MASS] == 0.0:
        L[at.LANE_NUMBERS + contract.DECK_MASS] = np.inf
    for lane in range(LANES):
        links.shift[lane] = carried[DSHIFT, lane]
        lossy = lossy or turns[contract.HYSTERESIS, lane] != 0.0
    for j in range(begin, min(begin + LINK_ROWS, len(steps))):
        step = steps[j]
        if j > begin and step[SHIFT] != steps[j - 1, SHIFT]:
            for lane in range(LANES):
                if table[lane] >= 0:
                    left, entry = base + int(steps[j - 1, PIECE]), base + int(step[PIECE])
                    links.shift[lane] += (
                        bends[table[lane], left, contract.STOP] - bends[table[lane], entry, contract.START]
                    )
        if step[PHASE] != CONTACT:
            continue
        same = row[PIECE] == step[PIECE] and row[SHIFT] == step[SHIFT] and row[ON_DECK] == step[ON_DECK]
        for column in range(LENGTH):
            row[column] = step[column]
        if not (entered and same):
            enter_cell(cell, pool)
            entered = True
        wanted = int(row[cells.CELL_KIND])
        if lossy and not is_lossy(wanted):  # what is differentiated counts as there
            wanted += OF_LOSSY
        if filled == at.LANES or wanted != kind:
            _link_lanes(filled, begin, kind, base, steps, turns, bends, table, links)
            filled, kind = 0, wanted
        cells.fill_lane(filled, cell, kind, pool.pieces, pool.first, pool.numbers, pool.rows, L)
        _show_piece(filled, kind, pool.pieces[base + int(step[PIECE])], step, L)
        L[at.LANE_LENGTH + filled] = step[LENGTH]
        links.which[filled] = j
        for k in range(len(links.directions)):
            links.shifts[filled, links.directions[k]] = links.shift[links.directions[k]]
        filled += 1
    _link_lanes(filled, begin, kind, base, steps, turns, bends, table, links)


@inlined_uncounted_kernel
def follow_link(step: int, on_deck: bool, carried: FloatArray, end: FloatArray, links: Links) -> None:
    """Carry the tangents over a step that has a link, at fixed s; write the motion at its end."""
    link, rows = links.link[step], STARTS if on_deck else 3
    for part in range(STARTS):
        end[part] = links.end[step, part]
    for lane in range(LANES):
        t, u, w = carried[DT, lane], carried[DA, lane], carried[DB, lane]
        y, z = (carried[DY, lane], carried[DZ, lane]) if on_deck else (0.0, 0.0)
        for part in range(rows):
            found = link[DT, part] * t + link[DA, part] * u + link[DB, part] * w
            if on_deck:
                found += link[DY, part] * y + link[DZ, part] * z
            carried[part, lane] = found
    for k in range(len(links.directions)):
        for part in range(rows):
            carried[part, links.directions[k]] += link[STARTS + k, part]
