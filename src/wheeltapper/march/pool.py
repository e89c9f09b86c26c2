"""Cells that march in lockstep: the state of each, the kind of step for which it waits, and its results."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march import lane_rows as at
from wheeltapper.march import program as contract
from wheeltapper.march.events import follow_force, log_event
from wheeltapper.march.kernel import inlined_kernel, kernel
from wheeltapper.march.layout import COUNT, EVENTS, MARK, PEAKS, SCRATCH, SEEN, STATE
from wheeltapper.march.program import TIME, A, B, FloatArray, IntArray

STEP_ROWS = 64
ROOM = 16
"""Number of rows for events and peaks that must be free before cells continue."""

# The queues in which cells wait: the first four have one for each kind of path.
FLAT, WAVE = 0, 1
COAST, TURN, OPEN, CROSS, FLY, APART = 0, 2, 4, 6, 8, 9
QUEUES = 10
WAITING = 0
"""Where a queue says how many wait in it; who they are follows."""
USED_EVENTS, USED_PEAKS, VISITS = range(3)
"""Rows of events and of peaks in use, and visits of cells to APART."""

# A cell's row: state and counts as in the scratch array from STATE on, the rows of `L` from K on, and how it ended.
LOCAL = int(SCRATCH - STATE)
LOCALS = (at.LANE_GOAL - at.LANE_K) // at.LANES + 1
CELL_STATUS, CELL_END, AIRBORNE = range(LOCAL + LOCALS, LOCAL + LOCALS + 3)
COLUMNS = AIRBORNE + 1
CELL_MARKS, COUNTS = int(MARK - STATE), int(COUNT - STATE)
# Tables of events and peaks have one more column: the cell.
EVENT_CELL, PEAK_CELL = contract.EVENT_COLUMNS, contract.PEAK_COLUMNS


class Pool(NamedTuple):
    """Cells, their numbers and tables, and the arrays to which the lane kernels write."""

    pieces: FloatArray  # (pieces, PIECE_COLUMNS)
    first: IntArray  # (cells,)
    many: IntArray  # (cells,)
    numbers: FloatArray  # (cells, NUMBERS)
    rows: FloatArray  # (cells, COLUMNS)
    queue: IntArray  # (QUEUES, 1 + cells): how many wait, and which
    events: FloatArray  # (rows, EVENT_COLUMNS + 1), in the order in which they were found
    peaks: FloatArray  # (rows, PEAK_COLUMNS + 1)
    used: IntArray  # (3,): USED_EVENTS, USED_PEAKS, VISITS
    steps: FloatArray  # (STEP_ROWS, STEP_COLUMNS)
    S: FloatArray  # (SCRATCH,)
    L: FloatArray  # (ENTRIES,)
    held: IntArray  # (LANES,): the cell in each lane; -1: none

    def larger(self) -> Pool:
        """Return the pool with room for twice the events and peaks."""
        return self._replace(events=np.concatenate([self.events] * 2), peaks=np.concatenate([self.peaks] * 2))


def pool_of(pieces: FloatArray, first: IntArray, many: IntArray, numbers: FloatArray) -> Pool:
    """Return a pool of cells that have not started, with room for some events of each."""
    cells = len(first)
    room = 8 * cells + 4 * ROOM
    return Pool(
        pieces, first, many, numbers, np.zeros((cells, COLUMNS)), np.zeros((QUEUES, 1 + cells), dtype=np.int64),
        np.empty((room, EVENT_CELL + 1)), np.empty((room, PEAK_CELL + 1)), np.zeros(VISITS + 1, dtype=np.int64),
        np.empty((STEP_ROWS, contract.STEP_COLUMNS)), np.zeros(SCRATCH), np.zeros(at.LANE_ENTRIES),
        np.full(at.LANES, -1, dtype=np.int64),
    )  # fmt: skip


@kernel
def push(cell: int, which: int, queue: IntArray) -> None:
    """Let a cell wait in a queue."""
    queue[which, WAITING] += 1
    queue[which, queue[which, WAITING]] = cell


@kernel
def pop(which: int, queue: IntArray) -> int:
    """Take a cell from a queue; return -1 if none waits."""
    if queue[which, WAITING] == 0:
        return -1
    queue[which, WAITING] -= 1
    return int(queue[which, queue[which, WAITING] + 1])


@kernel
def fill_lane(i: int, cell: int, rows: FloatArray, L: FloatArray) -> None:
    """Put a cell in a lane; an empty lane, -1, rests in equilibrium."""
    if cell >= 0:
        L[at.LANE_TIME + i] = rows[cell, TIME]
        L[at.LANE_U0 + i] = rows[cell, A]
        L[at.LANE_W0 + i] = rows[cell, B]
        for k in range(LOCALS):
            L[at.LANE_K + at.LANES * k + i] = rows[cell, LOCAL + k]
        return
    for k in range(3 + LOCALS):
        L[at.LANES * k + i] = 0.0
    L[at.LANE_U0 + i] = 1.0
    L[at.LANE_LOAD + i] = 1.0
    L[at.LANE_UNTIL + i] = np.inf
    L[at.LANE_GOAL + i] = -20.0


@kernel
def fill_all(which: int, queue: IntArray, rows: FloatArray, L: FloatArray, held: IntArray) -> int:
    """Put the next cells of a queue in the lanes; return how many there are."""
    filled = 0
    for i in range(at.LANES):
        held[i] = pop(which, queue)
        fill_lane(i, held[i], rows, L)
        if held[i] >= 0:
            filled += 1
    return filled


@kernel
def keep_lane(i: int, cell: int, rows: FloatArray, L: FloatArray) -> None:
    """Remember time and motion of a lane's cell."""
    rows[cell, TIME] = L[at.LANE_TIME + i]
    rows[cell, A] = L[at.LANE_U0 + i]
    rows[cell, B] = L[at.LANE_W0 + i]


@kernel
def load_cell(cell: int, rows: FloatArray, S: FloatArray) -> None:
    """Put a cell's state and counts in the scratch array."""
    for k in range(LOCAL):
        S[STATE + k] = rows[cell, k]


@kernel
def put_back(cell: int, rows: FloatArray, S: FloatArray) -> None:
    """Remember the state and the counts in the scratch array as a cell's."""
    for k in range(LOCAL):
        rows[cell, k] = S[STATE + k]


@inlined_kernel
def claim_rows(cell: int, events: int, peaks: int, pool: Pool) -> None:
    """Claim the newest events and peaks for a cell."""
    for _ in range(events):
        pool.events[pool.used[USED_EVENTS], EVENT_CELL] = cell
        pool.used[USED_EVENTS] += 1
    for _ in range(peaks):
        pool.peaks[pool.used[USED_PEAKS], PEAK_CELL] = cell
        pool.used[USED_PEAKS] += 1


@kernel
def finish_cell(cell: int, why: int, time: float, rows: FloatArray) -> None:
    """Note the status and the end of a cell's march."""
    rows[cell, CELL_STATUS] = why
    rows[cell, CELL_END] = time


@kernel
def note_event(cell: int, time: float, which: int, rate: float, pool: Pool) -> bool:
    """Record an event; return whether the cell goes on."""
    counts = pool.rows[cell, COUNTS:LOCAL]
    log_event(time, which, rate, 0.0, pool.events[pool.used[USED_EVENTS] - int(counts[EVENTS]) :], counts)
    claim_rows(cell, 1, 0, pool)
    if counts[SEEN] == 0.0 and counts[EVENTS] < pool.numbers[cell, contract.EVENT_LIMIT]:
        return True
    finish_cell(cell, contract.ENOUGH if counts[SEEN] != 0.0 else contract.TOO_MANY_EVENTS, time, pool.rows)
    return False


@inlined_kernel
def track_force(cell: int, time: float, force: float, corner: float, pool: Pool) -> None:
    """Take the next value of a cell's contact force."""
    counts = pool.rows[cell, COUNTS:LOCAL]
    known = int(counts[PEAKS])
    follow_force(
        time, force, corner, pool.peaks[pool.used[USED_PEAKS] - known :], pool.rows[cell, CELL_MARKS:COUNTS], counts
    )
    claim_rows(cell, 0, int(counts[PEAKS]) - known, pool)


@kernel
def gather_kernel(table: FloatArray, used: int, ends: IntArray, out: FloatArray) -> None:
    """Copy rows so that those of a cell stand together, in their order; `ends` becomes the row after each cell's last.

    The last column of `table` is the cell of a row.
    """
    columns = table.shape[1] - 1
    ends[:] = 0
    for row in range(used):
        ends[int(table[row, columns])] += 1
    total = 0
    for cell in range(len(ends)):
        total += ends[cell]
        ends[cell] = total - ends[cell]
    for row in range(used):
        cell = int(table[row, columns])
        for k in range(columns):
            out[ends[cell], k] = table[row, k]
        ends[cell] += 1
