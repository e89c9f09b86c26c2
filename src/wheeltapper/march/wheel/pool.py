"""Cells that march in lockstep: the state of each, the kind of step for which it waits, and its results."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import DECK_V, DECK_Y, PIECE, TIME, A, B, FloatArray, IntArray
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps.layout import COUNT, EVENTS, MARK, PEAKS, SCRATCH, SEEN, STATE, int64_positions
from wheeltapper.march.steps.variants import OF_YIELDING, OVER_WAVE, has_bush, has_deck, is_bent, is_lossy
from wheeltapper.march.steps.written import functions_of_cells, scratch_of_cells
from wheeltapper.march.wheel.events import follow_force, log_event

STEP_ROWS = 64
ROOM = 16
"""Number of rows for events and peaks that must be free before cells continue."""

# The kinds of contact steps are those of elastic contacts (steps/variants.py).
(KINDS,) = int64_positions([OF_YIELDING])
# The queues in which cells wait: the first stages have one for each kind, flight has one beside a deck, one over it,
# and the same with a bush. They are NumPy integers, because Numba compiles a kernel anew for every plain constant.
COAST, TURN, OPEN, CROSS, FLY = int64_positions(range(0, 5 * int(KINDS), int(KINDS)))
(APART,) = int64_positions([FLY + 4])
QUEUES = int(APART) + 1
EMPTY = -1
"""Stands for the cell of an empty lane."""
WAITING, NEWEST, BEFORE = range(3)
"""Rows of the table of queues: how many wait in each, which cell came last, and of each cell which came before it."""
USED_EVENTS, USED_PEAKS, VISITS, USED_STEPS, USED_KINDS, TO_THE_END = range(6)
"""Rows of events and of peaks in use, visits of cells to APART, rows of the log of steps in use, kinds of steps in use
(at least two); and 1 where cells march to their ends even if what they wait for can never come."""

# A cell's row: state and counts as in the scratch array from STATE on, the rows of `L` from K on, the kind of its
# contact steps, and how it ended.
LOCAL = int(SCRATCH - STATE)
CELL_KIND, CELL_STATUS, CELL_END, AIRBORNE = range(LOCAL + at.CELL_NUMBERS, LOCAL + at.CELL_NUMBERS + 4)
COLUMNS = AIRBORNE + 1
CELL_MARKS, COUNTS = int(MARK - STATE), int(COUNT - STATE)
# Columns of motions, in which a march may begin and with which it ends.
CELL_HEIGHT, CELL_VELOCITY, CELL_DECK_HEIGHT, CELL_DECK_VELOCITY = range(4)
CELL_MOTIONS = 4
# Tables of events, peaks and steps have one more column: the cell.
EVENT_CELL, PEAK_CELL, STEP_CELL = contract.EVENT_COLUMNS, contract.PEAK_COLUMNS, contract.STEP_COLUMNS
STEP_ROOM = STEP_ROWS + at.LANES
"""Number of rows that must be free in the log of steps before cells continue."""


class Pool(NamedTuple):
    """Cells, their numbers and tables, and the arrays to which the lane kernels write."""

    pieces: FloatArray  # (pieces, PIECE_COLUMNS)
    first: IntArray  # (cells,)
    many: IntArray  # (cells,)
    numbers: FloatArray  # (cells, NUMBERS)
    rows: FloatArray  # (cells, COLUMNS)
    queue: IntArray  # (3, cells or QUEUES): who waits
    events: FloatArray  # (rows, EVENT_COLUMNS + 1), in the order in which they were found
    peaks: FloatArray  # (rows, PEAK_COLUMNS + 1)
    log: FloatArray  # (rows, STEP_COLUMNS + 1): all steps, in the order in which they were made; no rows: not kept
    used: IntArray  # (6,): from USED_EVENTS to TO_THE_END
    steps: FloatArray  # (STEP_ROWS, ENDED_COLUMNS)
    S: FloatArray  # (SCRATCH,)
    L: FloatArray  # (ENTRIES,)
    held: IntArray  # (LANES,): the cell in each lane, or EMPTY
    made: FloatArray  # (IN_LANES,): where the code of the lanes' functions is (steps/written.py)

    def larger(self) -> Pool:
        """Return the pool, the tables twice as long that are nearly full."""
        needed = {"events": (USED_EVENTS, ROOM), "peaks": (USED_PEAKS, ROOM), "log": (USED_STEPS, STEP_ROOM)}
        held = {name: getattr(self, name) for name in needed}
        full = [name for name, (used, room) in needed.items() if self.used[used] + room > len(held[name]) > 0]
        longer: Any = {name: _doubled_table(held[name]) for name in full}
        return self._replace(**longer)


def _doubled_table(table: FloatArray) -> FloatArray:
    """Return a table with twice as many rows; those behind are not touched, so that they take no memory yet."""
    out = np.empty((2 * len(table), *table.shape[1:]))
    out[: len(table)] = table
    return out


def pool_of(pieces: FloatArray, first: IntArray, many: IntArray, numbers: FloatArray, steps: int = 0) -> Pool:
    """Return a pool of cells that have not started, with room for some events of each.

    `steps` is the number of steps for which there is room at first; zero: they are not kept.
    """
    cells = len(first)
    room = 8 * cells + 4 * ROOM
    return Pool(
        pieces, first, many, numbers, np.zeros((cells, COLUMNS)),
        np.zeros((BEFORE + 1, max(cells, QUEUES)), dtype=np.int64),
        np.empty((room, EVENT_CELL + 1)), np.empty((room, PEAK_CELL + 1)),
        np.empty((steps, STEP_CELL + 1)), np.zeros(TO_THE_END + 1, dtype=np.int64),
        np.empty((STEP_ROWS, contract.ENDED_COLUMNS)), scratch_of_cells(numbers, pieces), np.zeros(at.LANE_ENTRIES),
        np.full(at.LANES, EMPTY, dtype=np.int64), functions_of_cells(numbers, pieces),
    )  # fmt: skip


@inlined_uncounted_kernel
def push(cell: int, which: int, queue: IntArray) -> None:
    """Let a cell wait in a queue."""
    queue[BEFORE, cell] = queue[NEWEST, which]
    queue[NEWEST, which] = cell
    queue[WAITING, which] += 1


@inlined_uncounted_kernel
def pop(which: int, queue: IntArray) -> int:
    """Take a cell from a queue; return EMPTY if none waits."""
    if queue[WAITING, which] == 0:
        return EMPTY
    queue[WAITING, which] -= 1
    cell = int(queue[NEWEST, which])
    queue[NEWEST, which] = queue[BEFORE, cell]
    return cell


@inlined_uncounted_kernel
def _fill_plain(i: int, cell: int, rows: FloatArray, L: FloatArray) -> None:
    """Put the motion and the plain numbers of a cell in a lane; an EMPTY lane rests in equilibrium."""
    if cell >= 0:
        L[at.LANE_TIME + i] = rows[cell, TIME]
        L[at.LANE_U0 + i] = rows[cell, A]
        L[at.LANE_W0 + i] = rows[cell, B]
        for k in range(at.PLAIN_NUMBERS):
            L[at.LANE_K + at.LANES * k + i] = rows[cell, LOCAL + k]
        return
    for k in range(3 + at.PLAIN_NUMBERS):
        L[at.LANES * k + i] = 0.0
    L[at.LANE_U0 + i] = 1.0
    L[at.LANE_LOAD + i] = 1.0
    L[at.LANE_CUBIC + i] = 1.0
    L[at.LANE_UNTIL + i] = np.inf
    L[at.LANE_GOAL + i] = -20.0


@uncounted_kernel
def _fill_numbers(i: int, cell: int, rows: FloatArray, L: FloatArray) -> None:
    """Put what only other kinds have in a lane: their numbers and the deck's motion."""
    for k in range(at.FIXED_NUMBERS - at.PLAIN_NUMBERS):
        L[at.LANE_ETA + at.LANES * k + i] = rows[cell, LOCAL + at.PLAIN_NUMBERS + k] if cell >= 0 else 0.0
    L[at.LANE_DECK_Y + i] = rows[cell, DECK_Y] if cell >= 0 else 0.0
    L[at.LANE_DECK_V + i] = rows[cell, DECK_V] if cell >= 0 else 0.0


@uncounted_kernel
def _fill_bush(i: int, cell: int, rows: FloatArray, L: FloatArray) -> None:
    """Put the bush of a damper's end, and its deflection, in a lane."""
    for k in range(at.CELL_NUMBERS - at.FIXED_NUMBERS):
        L[at.LANE_BUSH + at.LANES * k + i] = rows[cell, LOCAL + at.FIXED_NUMBERS + k] if cell >= 0 else 0.0
    L[at.LANE_BUSH_Y + i] = rows[cell, contract.END_DEFLECTION] if cell >= 0 else 0.0


@uncounted_kernel
def fill_path(
    i: int, cell: int, pieces: FloatArray, first: IntArray, numbers: FloatArray, rows: FloatArray, L: FloatArray
) -> None:
    """Put the polynomial of the present piece of a cell's path in a lane."""
    degree, row, lift = -1.0, 0, 0.0
    if cell >= 0:
        row, lift = first[cell] + int(rows[cell, PIECE]), numbers[cell, contract.LIFT]
        degree = pieces[row, contract.DEGREE]
    for k in range(contract.TERMS):
        L[at.LANE_PATH + at.LANES * k + i] = lift * pieces[row, contract.COEFFICIENT + k] if k <= degree else 0.0


@uncounted_kernel
def fill_factor(
    i: int, cell: int, kind: int, pieces: FloatArray, first: IntArray, rows: FloatArray, L: FloatArray
) -> None:  # fmt: skip
    """Put the factor on the contact's force over the present piece of a cell's path in a lane."""
    degree, row = -1.0, 0
    if cell >= 0:
        row = first[cell] + int(rows[cell, PIECE])
        degree = pieces[row, contract.FACTOR_DEGREE]
    for k in range(contract.TERMS):
        L[at.LANE_FACTOR + at.LANES * k + i] = pieces[row, contract.FACTOR + k] if k <= degree else 0.0
    if degree < 0.0:
        L[at.LANE_FACTOR + i] = 1.0
    L[at.LANE_STEADY + i] = 0.0 if cell >= 0 and (degree > 0.0 or is_lossy(kind)) else 1.0


@inlined_uncounted_kernel
def fill_flight(
    i: int, cell: int, over: int, pieces: FloatArray, first: IntArray, numbers: FloatArray, rows: FloatArray,
    L: FloatArray,
) -> None:  # fmt: skip
    """Put a cell in flight in a lane; `over` says beside what (variants.py)."""
    _fill_plain(i, cell, rows, L)
    if over >= 2:
        _fill_bush(i, cell, rows, L)
    if over % 2 == 0:
        L[at.LANE_PACE + i] = rows[cell, LOCAL + at.CELL_PACE] if cell >= 0 else 0.0
        L[at.LANE_ORIGIN + i] = rows[cell, LOCAL + at.CELL_ORIGIN] if cell >= 0 else 0.0
    else:
        _fill_numbers(i, cell, rows, L)
    fill_path(i, cell, pieces, first, numbers, rows, L)


@inlined_uncounted_kernel
def fill_lane(
    i: int, cell: int, kind: int, pieces: FloatArray, first: IntArray, numbers: FloatArray, rows: FloatArray,
    L: FloatArray,
) -> None:  # fmt: skip
    """Put a cell in contact in a lane, with what this kind of steps needs; an EMPTY lane rests in equilibrium."""
    _fill_plain(i, cell, rows, L)
    if kind > OVER_WAVE:
        _fill_numbers(i, cell, rows, L)
        if has_bush(kind):
            _fill_bush(i, cell, rows, L)
        if is_bent(kind):
            fill_path(i, cell, pieces, first, numbers, rows, L)
            fill_factor(i, cell, kind, pieces, first, rows, L)
        elif is_lossy(kind):
            L[at.LANE_STEADY + i] = 0.0


@inlined_uncounted_kernel
def fill_all(which: int, kind: int, pool: Pool) -> int:
    """Put the next cells of a queue in the lanes; return how many there are."""
    queue, held, rows, L = pool.queue, pool.held, pool.rows, pool.L
    pieces, first, numbers = pool.pieces, pool.first, pool.numbers
    filled = 0
    for i in range(at.LANES):
        held[i] = pop(which, queue)
        if which >= FLY:
            fill_flight(i, held[i], which - FLY, pieces, first, numbers, rows, L)
        else:
            fill_lane(i, held[i], kind, pieces, first, numbers, rows, L)
        if held[i] >= 0:
            filled += 1
    return filled


@inlined_uncounted_kernel
def keep_lane(i: int, cell: int, kind: int, rows: FloatArray, L: FloatArray) -> None:
    """Remember time and motion of a lane's cell."""
    rows[cell, TIME] = L[at.LANE_TIME + i]
    rows[cell, A] = L[at.LANE_U0 + i]
    rows[cell, B] = L[at.LANE_W0 + i]
    if has_deck(kind):
        rows[cell, DECK_Y] = L[at.LANE_DECK_Y + i]
        rows[cell, DECK_V] = L[at.LANE_DECK_V + i]
    if has_bush(kind):
        rows[cell, contract.END_DEFLECTION] = L[at.LANE_BUSH_Y + i]


@inlined_uncounted_kernel
def may_log(pool: Pool) -> bool:
    """Return True where the log of steps has room, or is not kept."""
    return len(pool.log) == 0 or pool.used[USED_STEPS] + STEP_ROOM <= len(pool.log)


@inlined_uncounted_kernel
def log_lane(
    i: int, cell: int, kind: int, phase: float, start: int, deck: int, length: float, pool: Pool
) -> None:  # fmt: skip
    """Log a lane's step; `start` is the row of L from which time and motion at its start stand, `deck` the deck's."""
    if len(pool.log) == 0:
        return
    L, cell_row, row = pool.L, pool.rows[cell], pool.log[pool.used[USED_STEPS]]
    row[contract.PHASE] = phase
    row[TIME] = L[start + i]
    row[A] = L[start + at.LANES + i]
    row[B] = L[start + 2 * at.LANES + i]
    row[DECK_Y] = L[deck + i] if has_deck(kind) else 0.0
    row[DECK_V] = L[deck + at.LANES + i] if has_deck(kind) else 0.0
    row[PIECE] = cell_row[PIECE]
    row[contract.SHIFT] = cell_row[contract.SHIFT]
    row[contract.ON_DECK] = cell_row[contract.ON_DECK]
    row[contract.LENGTH] = length
    row[STEP_CELL] = cell
    pool.used[USED_STEPS] += 1


@uncounted_kernel
def log_rows(cell: int, count: int, pool: Pool) -> None:
    """Log the first steps in `pool.steps` as a cell's."""
    if len(pool.log) == 0:
        return
    for k in range(count):
        row = pool.log[pool.used[USED_STEPS]]
        for column in range(contract.STEP_COLUMNS):
            row[column] = pool.steps[k, column]
        row[STEP_CELL] = cell
        pool.used[USED_STEPS] += 1


@uncounted_kernel
def load_cell(cell: int, rows: FloatArray, S: FloatArray) -> None:
    """Put a cell's state and counts in the scratch array."""
    for k in range(LOCAL):
        S[STATE + k] = rows[cell, k]


@uncounted_kernel
def put_back(cell: int, rows: FloatArray, S: FloatArray) -> None:
    """Remember the state and the counts in the scratch array as a cell's."""
    for k in range(LOCAL):
        rows[cell, k] = S[STATE + k]


@inlined_uncounted_kernel
def claim_rows(cell: int, events: int, peaks: int, pool: Pool) -> None:
    """Claim the newest events and peaks for a cell."""
    for _ in range(events):
        pool.events[pool.used[USED_EVENTS], EVENT_CELL] = cell
        pool.used[USED_EVENTS] += 1
    for _ in range(peaks):
        pool.peaks[pool.used[USED_PEAKS], PEAK_CELL] = cell
        pool.used[USED_PEAKS] += 1


@uncounted_kernel
def finish_cell(cell: int, why: int, time: float, rows: FloatArray) -> None:
    """Note the status and the end of a cell's march."""
    rows[cell, CELL_STATUS] = why
    rows[cell, CELL_END] = time


@inlined_uncounted_kernel
def note_event(cell: int, time: float, which: int, rate: float, pool: Pool) -> bool:
    """Record an event; return whether the cell goes on."""
    counts = pool.rows[cell, COUNTS:LOCAL]
    log_event(time, which, rate, 0.0, pool.events[pool.used[USED_EVENTS] - int(counts[EVENTS]) :], counts)
    claim_rows(cell, 1, 0, pool)
    if counts[SEEN] == 0.0 and counts[EVENTS] < pool.numbers[cell, contract.EVENT_LIMIT]:
        return True
    finish_cell(cell, contract.ENOUGH if counts[SEEN] != 0.0 else contract.TOO_MANY_EVENTS, time, pool.rows)
    return False


@inlined_uncounted_kernel
def track_force(cell: int, time: float, force: float, corner: float, pool: Pool) -> None:
    """Take the next value of a cell's contact force."""
    counts = pool.rows[cell, COUNTS:LOCAL]
    known = int(counts[PEAKS])
    follow_force(
        time, force, corner, pool.peaks[pool.used[USED_PEAKS] - known :], pool.rows[cell, CELL_MARKS:COUNTS], counts
    )
    claim_rows(cell, 0, int(counts[PEAKS]) - known, pool)


@uncounted_kernel
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
