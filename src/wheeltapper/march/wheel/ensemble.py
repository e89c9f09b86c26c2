"""Many cells: each is one wheel with its own numbers; tables of the path are shared.

for each cell: start it, march it until all features are known or the run ends, note the rows of its events and peaks
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import in_blocks
from wheeltapper.march.common.kernel import inlined_kernel, kernel
from wheeltapper.march.common.program import PHASE, TIME, A, FloatArray, IntArray
from wheeltapper.march.steps.layout import COUNT, EVENTS, PEAKS, STATE
from wheeltapper.march.steps.written import scratch_for, scratch_of_cells
from wheeltapper.march.wheel import pool as pools
from wheeltapper.march.wheel.apart import motions_kernel, start_lanes
from wheeltapper.march.wheel.dense import ENDED_OUT_COLUMNS
from wheeltapper.march.wheel.events import is_free
from wheeltapper.march.wheel.lanes import lanes_kernel
from wheeltapper.march.wheel.single import March, march, march_kernel, start_kernel
from wheeltapper.march.wheel.tally import HIGHEST, TALLY, end_tally, tally_kernel

SMALLEST_BLOCK, LARGEST_BLOCK = 256, 2048
"""Cells that one thread marches at a time."""
ALONE_BLOCK = 16
"""The same of those that march by themselves."""
STEP_ROWS = 64


class Cells(NamedTuple):
    """Input of a march: the pieces of all tables, the pieces of each cell, and the numbers of each cell."""

    pieces: FloatArray  # (pieces, PIECE_COLUMNS)
    first: IntArray  # (cells,)
    many: IntArray  # (cells,)
    numbers: FloatArray  # (cells, NUMBERS)

    def part(self, block: slice) -> Cells:
        """Return some of the cells."""
        return Cells(self.pieces, self.first[block], self.many[block], self.numbers[block])


class Marched(NamedTuple):
    """Events and peaks of many cells, one cell after the other, in scaled units: what a march writes to, and leaves."""

    status: IntArray  # (cells,)
    end: FloatArray  # (cells,): time at which the march ended
    events: FloatArray  # (events, EVENT_COLUMNS)
    peaks: FloatArray  # (peaks, PEAK_COLUMNS)
    event_ends: IntArray  # (cells,): the row after a cell's last event
    peak_ends: IntArray  # (cells,)
    airborne: FloatArray  # (cells,): 1 where the march began without contact force
    # Where a tally was kept: the wheel's highest position (cells,), and in the n-th of a cell's rows of events the
    # impulse of the contact that its n-th impact begins; NaN where that outlasts the run.
    highest: FloatArray | None = None
    impulses: FloatArray | None = None

    def larger(self) -> Marched:
        """Return tables with room for twice the events."""
        return self._replace(**doubled_tables(self, ("events", "peaks", "impulses"), np.nan))

    def without_room(self, tally: bool) -> Marched:
        """Return the rows in use, and the tally only where one was kept."""
        events, peaks = (int(ends.max(initial=0)) for ends in (self.event_ends, self.peak_ends))
        used = (("events", events), ("peaks", peaks), ("impulses", events))
        found = self._replace(**{name: getattr(self, name)[:rows].copy() for name, rows in used})
        return found if tally else found._replace(highest=None, impulses=None)


def room_for(cells: int) -> Marched:
    """Return tables with room for some events of each cell."""
    rows = 16 * cells + 64
    return Marched(
        np.zeros(cells, dtype=np.int64), np.zeros(cells),
        np.empty((rows, contract.EVENT_COLUMNS)), np.empty((rows, contract.PEAK_COLUMNS)),
        np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=np.int64),
        np.zeros(cells), np.zeros(cells), np.full(rows, np.nan),
    )  # fmt: skip


def doubled_tables(tables: Any, names: tuple[str, ...], value: float) -> dict[str, Any]:
    """Return some of the tables, by name, each with as many rows of a value behind it."""
    held = {name: getattr(tables, name) for name in names}
    return {name: np.concatenate([table, np.full_like(table, value)]) for name, table in held.items()}


@inlined_kernel
def all_of(tables: Any) -> Any:
    """Return all tables, each of which is there."""
    return tables


@kernel
def ensemble_kernel(
    cells: Cells, cell: int, tables: Marched, steps: FloatArray, S: FloatArray, scratch: FloatArray, tallied: bool
) -> int:
    """March the cells from `cell` on; return the first that finds no room for its events and peaks, or their number."""
    pieces, first, many, numbers = cells
    status, end, events, peaks, event_ends, peak_ends, airborne, highest, impulses = all_of(tables)
    event = event_ends[cell - 1] if cell > 0 else 0
    peak = peak_ends[cell - 1] if cell > 0 else 0
    tally = np.zeros(TALLY)
    point = np.zeros(ENDED_OUT_COLUMNS)
    while cell < len(first):
        table = pieces[first[cell] : first[cell] + many[cell]]
        start_kernel(table, numbers[cell], events[event:], S)
        airborne[cell] = 1.0 if is_free(S[STATE + PHASE]) else 0.0
        tally[:] = 0.0
        tally[HIGHEST] = S[STATE + A] if is_free(S[STATE + PHASE]) else -np.inf
        why = contract.FULL
        while why == contract.FULL:
            why = march_kernel(table, numbers[cell], None, steps, events[event:], peaks[peak:], steps[:0], S)
            if tallied:
                made = int(S[COUNT])
                tally_kernel(table, numbers[cell], None, steps, made, tally, impulses[event:], scratch, point)
            if why == contract.FULL and S[COUNT] + 1 <= steps.shape[0]:
                return cell
            S[COUNT] = 0.0
        highest[cell] = tally[HIGHEST] if tallied else np.nan
        end_tally(why, tally, impulses[event:])
        status[cell] = why
        end[cell] = S[STATE + TIME]
        event += int(S[COUNT + EVENTS])
        peak += int(S[COUNT + PEAKS])
        event_ends[cell] = event
        peak_ends[cell] = peak
        cell += 1
    return cell


def _work_arrays(cells: Cells, tally: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return room for steps, and scratch memory of the march and of the tally."""
    S = scratch_of_cells(cells.numbers, cells.pieces, pushes=tally)
    return np.empty((STEP_ROWS, contract.ENDED_COLUMNS)), S, S.copy()


def march_one_by_one(cells: Cells, tally: bool = False) -> Marched:
    """March some cells in this thread, one after the other."""
    total = len(cells.first)
    tables, work, cell = room_for(total), _work_arrays(cells, tally), 0
    while cell < total:
        cell = ensemble_kernel(cells, cell, tables, *work, tally)
        if cell < total:
            tables = tables.larger()
    return tables.without_room(tally)


AT_THEIR_STARTS = np.empty((0, pools.CELL_MOTIONS))
"""Stands for the motions in which marches begin: each cell's own start."""


def _marched_pool(cells: Cells, motions: FloatArray) -> pools.Pool:
    """Return a pool of some cells that have marched to their ends."""
    pool = pools.pool_of(*cells)
    start_lanes(motions, pool)
    while not lanes_kernel(pool):
        pool = pool.larger()
    return pool


def _tables_of(pool: pools.Pool) -> Marched:
    """Return the events and peaks of cells that have marched to their ends."""
    total = len(pool.first)
    event_ends, peak_ends = np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64)
    events = np.empty((int(pool.used[pools.USED_EVENTS]), contract.EVENT_COLUMNS))
    peaks = np.empty((int(pool.used[pools.USED_PEAKS]), contract.PEAK_COLUMNS))
    pools.gather_kernel(pool.events, len(events), event_ends, events)
    pools.gather_kernel(pool.peaks, len(peaks), peak_ends, peaks)
    status, end, airborne = (
        pool.rows[:, column].copy() for column in (pools.CELL_STATUS, pools.CELL_END, pools.AIRBORNE)
    )
    return Marched(status.astype(np.int64), end, events, peaks, event_ends, peak_ends, airborne)


def march_in_lanes(cells: Cells) -> Marched:
    """March some cells in this thread, eight at a time wherever they wait for the same kind of step.

    A cell that can never reach the impact or loss at which it is to end, because it lacks the energy, ends without the
    force maxima that would follow, each lower than the one before.
    """
    return _tables_of(_marched_pool(cells, AT_THEIR_STARTS))


class Steps(NamedTuple):
    """All steps of many cells, one cell after the other."""

    rows: FloatArray  # (steps, STEP_COLUMNS)
    ends: IntArray  # (cells,): the row after a cell's last step
    last: FloatArray  # (cells, LENGTH): the state at each cell's end


class KeptSteps(NamedTuple):
    """Cells that have marched, with all that they leave."""

    marched: Marched
    steps: Steps
    pool: pools.Pool


def march_keeping_steps(cells: Cells, most: int, to_the_end: bool) -> KeptSteps | None:
    """March some cells in lanes; return their steps too, or None if there are more than `most`.

    A single cell may have any number of steps. With `to_the_end` cells do not end before, though they lack the energy
    for the impact or loss for which they wait.
    """
    total = len(cells.first)
    pool = pools.pool_of(*cells, 64 * total + pools.STEP_ROOM)
    pool.used[pools.TO_THE_END] = 1 if to_the_end else 0
    start_lanes(AT_THEIR_STARTS, pool)
    while not lanes_kernel(pool):
        if pool.used[pools.USED_STEPS] > most and total > 1:
            return None
        pool = pool.larger()
    ends = np.empty(total, dtype=np.int64)
    rows = np.empty((int(pool.used[pools.USED_STEPS]), contract.STEP_COLUMNS))
    pools.gather_kernel(pool.log, len(rows), ends, rows)
    return KeptSteps(_tables_of(pool), Steps(rows, ends, pool.rows[:, : contract.LENGTH].copy()), pool)


def end_motions(cells: Cells, threads: int, motions: FloatArray = AT_THEIR_STARTS) -> tuple[FloatArray, IntArray]:
    """March all cells from given motions to their ends, and return the motions there.

    A cell whose table repeats begins and ends at the same place of a period if its END is a whole number of periods,
    and may go on from its last motion: sections of the motion at one phase. START_SHIFT chooses the phase.

    Parameters
    ----------
    cells
        The cells; each marches from time zero to its END, without a last impact or loss.
    threads
        Number of threads; the result does not depend on it.
    motions
        (cells, pools.CELL_MOTIONS) scaled displacement and velocity of the wheel, then of the deck, at time zero.

    Returns
    -------
    motions
        (cells, pools.CELL_MOTIONS) at the ends.
    status
        (cells,) DONE, or why a march stopped before its end.
    """
    total = len(cells.first)
    out, status = np.empty((total, pools.CELL_MOTIONS)), np.empty(total, dtype=np.int64)

    def march_block(block: slice) -> None:
        pool = _marched_pool(cells.part(block), motions[block])
        motions_kernel(pool, out[block])
        status[block] = pool.rows[:, pools.CELL_STATUS]

    in_blocks(total, _block_size(total, threads), threads, march_block)
    return out, status


def _block_size(total: int, threads: int) -> int:
    return min(max(total // (4 * threads), SMALLEST_BLOCK), LARGEST_BLOCK)


def _tallied(program: contract.Program, found: March) -> tuple[float, FloatArray]:
    """Return the wheel's highest position in a march, and the impulses of its contacts as `Marched` has them."""
    tally, point, impulses = np.zeros(TALLY), np.zeros(ENDED_OUT_COLUMNS), np.full(len(found.events), np.nan)
    tally[HIGHEST] = -np.inf
    given = found.pieces, program.numbers, program.law_or_none, found.steps, len(found.steps)
    tally_kernel(*given, tally, impulses, scratch_for(program, pushes=True), point)
    end_tally(found.status, tally, impulses)
    return tally[HIGHEST], impulses


def march_alone(programs: Sequence[contract.Program], tally: bool = False) -> Marched:
    """March some programs in this thread, one after the other, whatever their contacts."""
    found = [march(program) for program in programs]
    ends = np.cumsum([(len(one.events), len(one.peaks)) for one in found], axis=0)
    begun = [one.steps[0, PHASE] if len(one.steps) else one.state[PHASE] for one in found]
    marched = Marched(
        np.array([one.status for one in found]), np.array([one.state[TIME] for one in found]),
        np.concatenate([one.events for one in found]), np.concatenate([one.peaks for one in found]),
        ends[:, 0], ends[:, 1],
        np.isin(begun, [contract.FLIGHT, contract.RELEASED]).astype(float),
    )  # fmt: skip
    if not tally:
        return marched
    highest, impulses = zip(*map(_tallied, programs, found), strict=True)
    return marched._replace(highest=np.array(highest), impulses=np.concatenate(impulses))


def march_all(
    cells: Cells | Sequence[contract.Program], threads: int, read: Callable[[slice, Marched], None],
    tally: bool = False,
) -> None:  # fmt: skip
    """March all cells, block by block, and pass each block to `read`; the threads do both."""
    if isinstance(cells, Cells):
        total, size = len(cells.first), _block_size(len(cells.first), threads)
    else:
        total, size = len(cells), ALONE_BLOCK

    def march_and_read(block: slice) -> None:
        if not isinstance(cells, Cells):
            read(block, march_alone(cells[block], tally))
        elif tally:
            read(block, march_one_by_one(cells.part(block), tally))
        else:
            read(block, march_in_lanes(cells.part(block)))

    in_blocks(total, size, threads, march_and_read)
