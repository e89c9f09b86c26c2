"""Many cells with their derivatives: each is marched, and then its steps are repeated with tangents."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.blocks import in_blocks
from wheeltapper.march.dense import OUT_COLUMNS
from wheeltapper.march.ensemble import Cells, Marched, doubled_tables, room_for
from wheeltapper.march.events import is_free
from wheeltapper.march.kernel import is_compiled, kernel
from wheeltapper.march.layout import COUNT, EVENTS, PEAKS, SCRATCH, STATE
from wheeltapper.march.program import LENGTH, PHASE, TIME, FloatArray, IntArray, Program
from wheeltapper.march.single import March, march, march_kernel, start_kernel
from wheeltapper.march.tally import CONTACTS, HIGHEST, HIGHEST_TIME, STILL_OPEN, TALLY, tally_kernel
from wheeltapper.march.tangent import tangent_kernel
from wheeltapper.march.tangent_path import LANES, OF_HEIGHT, OF_VELOCITY
from wheeltapper.march.tangent_samples import QUANTITIES, SAMPLED

PARAMETERS = LANES - 2
"""Number of parameters that are carried at a time. The last two lanes carry displacement and velocity at the start."""
BY_HEIGHT, BY_VELOCITY = PARAMETERS, PARAMETERS + 1
GRADIENT_BLOCK = 1024


class CellTangents(NamedTuple):
    """Derivatives of cells with respect to up to PARAMETERS parameters."""

    numbers: FloatArray  # (cells, NUMBERS, LANES)
    bends: FloatArray  # (tables that bend, pieces, PIECE_COLUMNS)
    table: IntArray  # (LANES,): which of them each lane has, -1 for none


class Tangents(NamedTuple):
    """Derivatives of events and peaks, and measures of their reliability."""

    events: FloatArray  # (events, 2, LANES): of time and rate, scaled
    peaks: FloatArray  # (peaks, 2, LANES): of time and force
    gentlest: FloatArray  # (cells,): the smallest indentation rate at an event
    amplification: FloatArray  # (cells,): growth of a small change of the start until the end of the march
    # Where a tally was kept, (cells, LANES) of the highest position, (events, LANES) of the impulses.
    highest: FloatArray | None = None
    impulses: FloatArray | None = None

    def larger(self) -> Tangents:
        """Return tables with room for twice the events."""
        return self._replace(**doubled_tables(self, ("events", "peaks", "impulses"), 0.0))

    def without_room(self, events: int, peaks: int, tally: bool) -> Tangents:
        """Return the rows in use, and the tally only where one was kept."""
        used = (("events", events), ("peaks", peaks), ("impulses", events))
        found = self._replace(**{name: getattr(self, name)[:rows] for name, rows in used})
        return found if tally else found._replace(highest=None, impulses=None)


@kernel
def gradient_kernel(
    pieces: FloatArray, first: IntArray, many: IntArray, numbers: FloatArray, turns: FloatArray, bends: FloatArray,
    table: IntArray, cell: int, status: IntArray, end: FloatArray, events: FloatArray, peaks: FloatArray,
    event_ends: IntArray, peak_ends: IntArray, airborne: FloatArray, highest: FloatArray, impulses: FloatArray,
    of_events: FloatArray, of_peaks: FloatArray, gentlest: FloatArray, amplification: FloatArray,
    of_highest: FloatArray, of_impulses: FloatArray, steps: FloatArray, S: FloatArray, D: FloatArray,
    strict: bool | None, tallied: bool | None,
) -> int:  # fmt: skip
    """March the cells from `cell` on, with tangents; return the first that finds no room, or their number."""
    event = event_ends[cell - 1] if cell > 0 else 0
    peak = peak_ends[cell - 1] if cell > 0 else 0
    start = np.zeros((2, LANES))
    start[OF_HEIGHT, BY_HEIGHT] = 1.0
    start[OF_VELOCITY, BY_VELOCITY] = 1.0
    of_end = np.zeros((4, LANES))
    tally = np.zeros(TALLY)
    point = np.zeros(OUT_COLUMNS)
    no_times = np.zeros(0)
    no_samples = np.zeros((0, QUANTITIES, SAMPLED))
    while cell < len(first):
        own = pieces[first[cell] : first[cell] + many[cell]]
        start_kernel(own, numbers[cell], events[event:], S)
        airborne[cell] = 1.0 if is_free(S[STATE + PHASE]) else 0.0
        why = march_kernel(own, numbers[cell], None, None, steps, events[event:], peaks[peak:], None, S, strict)
        if why == contract.FULL:
            return cell
        status[cell] = why
        end[cell] = S[STATE + TIME]
        rows = int(S[COUNT])
        new_events = int(S[COUNT + EVENTS])
        new_peaks = int(S[COUNT + PEAKS])
        last = S[STATE : STATE + LENGTH].copy()
        if tallied is not None:
            tally[:] = 0.0
            tally[HIGHEST] = -np.inf
            of_impulses[event : event + new_events] = np.nan
            tally_kernel(own, numbers[cell], steps, rows, tally, impulses[event:], S, point)
            if why != contract.ENOUGH and tally[STILL_OPEN] != 0.0:
                impulses[event + int(tally[CONTACTS]) - 1] = np.nan
            highest[cell] = tally[HIGHEST]
        gentlest[cell] = tangent_kernel(
            own, bends, first[cell], table, numbers[cell], turns[cell], start, steps[:rows], last,
            events[event : event + new_events], peaks[peak : peak + new_peaks],
            of_events[event : event + new_events], of_peaks[peak : peak + new_peaks], of_end, tally[HIGHEST_TIME],
            of_highest[cell], of_impulses[event:], no_times, no_samples, S, D, tallied,
        )  # fmt: skip
        a, b = of_end[OF_HEIGHT, BY_HEIGHT], of_end[OF_HEIGHT, BY_VELOCITY]
        c, d = of_end[OF_VELOCITY, BY_HEIGHT], of_end[OF_VELOCITY, BY_VELOCITY]
        half = 0.5 * (a * a + b * b + c * c + d * d)
        gap = max(half * half - (a * d - b * c) ** 2, 0.0)
        amplification[cell] = np.sqrt(half + np.sqrt(gap))
        event += new_events
        peak += new_peaks
        event_ends[cell] = event
        peak_ends[cell] = peak
        cell += 1
    return cell


def _room_for(cells: int) -> Tangents:
    """Return tables beside those of the march."""
    rows = 16 * cells + 64
    return Tangents(
        np.zeros((rows, 2, LANES)), np.zeros((rows, 2, LANES)), np.zeros(cells), np.zeros(cells),
        np.zeros((cells, LANES)), np.zeros((rows, LANES)),
    )  # fmt: skip


def _arguments(
    cells: Cells, turns: CellTangents, cell: int, tables: Marched, tangents: Tangents, steps: FloatArray, tally: bool
) -> tuple[Any, ...]:
    work = (steps, np.zeros(SCRATCH), np.zeros((SCRATCH, LANES)), cells.strict, True if tally else None)
    return (*cells, *turns, cell, *tables, *tangents, *work)


def _empty_steps(rows: int) -> FloatArray:
    return np.empty((rows, contract.STEP_COLUMNS))


def is_ready(cells: Cells, turns: CellTangents, tally: bool) -> bool:
    """Return False if marching these cells with tangents begins with compiling."""
    return is_compiled(gradient_kernel, _arguments(cells, turns, 0, room_for(0), _room_for(0), _empty_steps(0), tally))


def march_block(cells: Cells, turns: CellTangents, tally: bool = False) -> tuple[Marched, Tangents]:
    """March some cells in this thread, with tangents; with `tally`, find impulses and highest positions too."""
    total = len(cells.first)
    tables, tangents, rows, cell = room_for(total), _room_for(total), 1024, 0
    while cell < total:
        cell = gradient_kernel(*_arguments(cells, turns, cell, tables, tangents, _empty_steps(rows), tally))
        if cell < total:
            tables, tangents, rows = tables.larger(), tangents.larger(), 2 * rows
    marched = tables.without_room(tally)
    return marched, tangents.without_room(len(marched.events), len(marched.peaks), tally)


def sampled_tangents(
    program: Program, turns: FloatArray, bends: FloatArray, table: IntArray, times: FloatArray
) -> tuple[March, FloatArray]:
    """March a program; return also its motion and derivatives at rising times (scaled), (times, QUANTITIES, SAMPLED).

    `turns` (NUMBERS, LANES), `bends` and `table` are those of one cell of `CellTangents`.
    """
    found = march(program)
    within = times[times <= found.state[TIME]]
    samples = np.full((len(times), QUANTITIES, SAMPLED), np.nan)
    events, peaks = len(found.events), len(found.peaks)
    tangent_kernel(
        program.pieces, bends, 0, table, program.numbers, turns, np.zeros((2, LANES)), found.steps, found.state,
        found.events, found.peaks, np.empty((events, 2, LANES)), np.empty((peaks, 2, LANES)), np.zeros((4, LANES)),
        0.0, np.zeros(LANES), np.zeros((0, LANES)), within, samples, np.zeros(SCRATCH), np.zeros((SCRATCH, LANES)),
        None,
    )  # fmt: skip
    return found, samples


def march_all(
    cells: Cells,
    turns: CellTangents,
    threads: int,
    read: Callable[[slice, Marched, Tangents], None],
    tally: bool = False,
) -> None:
    """March all cells with tangents, block by block, and pass each block to `read`; the threads do both."""

    def march_and_read(block: slice) -> None:
        read(
            block, *march_block(cells.part(block), CellTangents(turns.numbers[block], turns.bends, turns.table), tally)
        )

    in_blocks(len(cells.first), GRADIENT_BLOCK, threads, march_and_read)
