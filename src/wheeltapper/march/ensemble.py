"""Many cells: each is one wheel with numbers of its own; tables of the path are shared.

for each cell:  start it, march it until enough is seen or the run ends, note where its events and peaks lie
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.layout import COUNT, MARK, SCRATCH, STATE
from wheeltapper.march.program import (
    EVENT_COLUMNS,
    FULL,
    PEAK_COLUMNS,
    STEP_COLUMNS,
    STRICT_ORDER,
    TIME,
    FloatArray,
    IntArray,
)
from wheeltapper.march.single import march_kernel, start_kernel

BLOCK = 512
"""Cells that one thread marches at a time."""
STEP_ROWS = 64


class Cells(NamedTuple):
    """What is to be marched: the pieces of all tables, which of them belong to each cell, and each cell's numbers."""

    pieces: FloatArray  # (pieces, PIECE_COLUMNS)
    first: IntArray  # (cells,)
    many: IntArray  # (cells,)
    numbers: FloatArray  # (cells, NUMBERS)


class Marched(NamedTuple):
    """Events and peaks of many cells, one cell after the other, in scaled units."""

    status: IntArray  # (cells,)
    end: FloatArray  # (cells,): time at which the march ended
    events: FloatArray  # (events, EVENT_COLUMNS)
    peaks: FloatArray  # (peaks, PEAK_COLUMNS)
    event_ends: IntArray  # (cells,): the row after a cell's last event
    peak_ends: IntArray  # (cells,)


@kernel
def ensemble_kernel(
    pieces: FloatArray, first: IntArray, many: IntArray, numbers: FloatArray, cell: int,
    status: IntArray, end: FloatArray, events: FloatArray, peaks: FloatArray, event_ends: IntArray, peak_ends: IntArray,
    steps: FloatArray, S: FloatArray, strict: bool | None,
) -> int:  # fmt: skip
    """March the cells from `cell` on; return the first that finds no room for its events and peaks, or their number."""
    event = event_ends[cell - 1] if cell > 0 else 0
    peak = peak_ends[cell - 1] if cell > 0 else 0
    while cell < len(first):
        table = pieces[first[cell] : first[cell] + many[cell]]
        S[MARK] = 0.0
        start_kernel(table, numbers[cell], events[event:], S)
        why = FULL
        while why == FULL:
            why = march_kernel(table, numbers[cell], steps, events[event:], peaks[peak:], S, strict)
            if why == FULL and S[COUNT] + 1 <= steps.shape[0]:
                return cell
            S[COUNT] = 0.0
        status[cell] = why
        end[cell] = S[STATE + TIME]
        event += int(S[COUNT + 1])
        peak += int(S[COUNT + 2])
        event_ends[cell] = event
        peak_ends[cell] = peak
        cell += 1
    return cell


def _strict(cells: Cells) -> bool | None:
    return True if len(cells.numbers) and cells.numbers[0, contract.ORDER] == STRICT_ORDER else None


def _room(cells: int) -> tuple[FloatArray, FloatArray]:
    return np.empty((16 * cells + 64, EVENT_COLUMNS)), np.empty((16 * cells + 64, PEAK_COLUMNS))


def march_block(cells: Cells) -> Marched:
    """March some cells in this thread."""
    total = len(cells.first)
    status, event_ends, peak_ends = (np.zeros(total, dtype=np.int64) for _ in range(3))
    end = np.zeros(total)
    events, peaks = _room(total)
    steps, work = np.empty((STEP_ROWS, STEP_COLUMNS)), np.zeros(SCRATCH)
    cell = 0
    while True:
        cell = ensemble_kernel(
            *cells, cell, status, end, events, peaks, event_ends, peak_ends, steps, work, _strict(cells)
        )
        used = (event_ends[cell - 1], peak_ends[cell - 1]) if cell else (0, 0)
        if cell == total:
            return Marched(status, end, events[: used[0]].copy(), peaks[: used[1]].copy(), event_ends, peak_ends)
        events, peaks = (np.concatenate([table, np.empty_like(table)]) for table in (events, peaks))


def is_ready(cells: Cells) -> bool:
    """Return False where marching these cells begins with compiling."""
    whole = np.zeros(0, dtype=np.int64)
    events, peaks = _room(0)
    work = (np.empty((STEP_ROWS, STEP_COLUMNS)), np.zeros(SCRATCH), _strict(cells))
    return is_compiled(ensemble_kernel, (*cells, 0, whole, np.zeros(0), events, peaks, whole, whole, *work))


def march_all(cells: Cells, threads: int) -> Iterator[tuple[slice, Marched]]:
    """March all cells, block by block; the blocks come in order, whatever the number of threads."""
    total = len(cells.first)
    blocks = [slice(i, min(i + BLOCK, total)) for i in range(0, total, BLOCK)]

    def one(block: slice) -> Marched:
        return march_block(Cells(cells.pieces, cells.first[block], cells.many[block], cells.numbers[block]))

    if threads == 1 or len(blocks) == 1:
        yield from ((block, one(block)) for block in blocks)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from zip(blocks, pool.map(one, blocks), strict=True)
