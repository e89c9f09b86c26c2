"""Many cells with their derivatives: they march in lanes, and then the steps of each are repeated with tangents."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import in_blocks
from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import TIME, FloatArray, IntArray, Program
from wheeltapper.march.steps.layout import TURNED_ROWS
from wheeltapper.march.steps.tangent_path import LANES, OF_HEIGHT, OF_VELOCITY
from wheeltapper.march.steps.written import scratch_of_cells
from wheeltapper.march.wheel.dense import OUT_COLUMNS
from wheeltapper.march.wheel.ensemble import Cells, KeptSteps, Marched, Steps, all_of, march_keeping_steps
from wheeltapper.march.wheel.single import March, march
from wheeltapper.march.wheel.tally import HIGHEST, HIGHEST_TIME, TALLY, end_tally, tally_kernel
from wheeltapper.march.wheel.tangent import Changes, Made, Rates, repeat_kernel, tangent_kernel
from wheeltapper.march.wheel.tangent_lanes import Links, links_of
from wheeltapper.march.wheel.tangent_samples import QUANTITIES, SAMPLED

PARAMETERS = LANES - 2
"""Number of parameters that are carried at a time. The last two lanes carry displacement and velocity at the start."""
BY_HEIGHT, BY_VELOCITY = PARAMETERS, PARAMETERS + 1
GRADIENT_BLOCK = 128
"""Cells that one thread marches at a time; their steps are kept."""
MOST_STEPS = 2**19
"""Number of steps beyond which a block is halved: they need some 90 MB."""


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


@kernel
def gradient_kernel(
    cells: Cells, turns: CellTangents, kept: Steps, marched: Marched, tangents: Tangents, S: FloatArray, D: FloatArray,
    tallied: bool | None, links: Links | None,
) -> None:  # fmt: skip
    """Repeat the steps of all cells with tangents."""
    pieces, first, many, numbers = cells
    steps, step_ends, last = kept
    status, _, events, peaks, event_ends, peak_ends, _, highest, impulses = all_of(marched)
    of_events, of_peaks, gentlest, amplification, of_highest, of_impulses = all_of(tangents)
    start = np.zeros((2, LANES))
    start[OF_HEIGHT, BY_HEIGHT] = 1.0
    start[OF_VELOCITY, BY_VELOCITY] = 1.0
    of_end = np.zeros((4, LANES))
    tally = np.zeros(TALLY)
    point = np.zeros(OUT_COLUMNS)
    no_times = np.zeros(0)
    no_samples = np.zeros((0, QUANTITIES, SAMPLED))
    row = 0
    event = 0
    peak = 0
    for cell in range(len(first)):
        own = pieces[first[cell] : first[cell] + many[cell]]
        log = steps[row : step_ends[cell]]
        if tallied is not None:
            tally[:] = 0.0
            tally[HIGHEST] = -np.inf
            tally_kernel(own, numbers[cell], None, log, len(log), tally, impulses[event:], S, point)
            end_tally(status[cell], tally, impulses[event:])
            highest[cell] = tally[HIGHEST]
        met, tops = slice(event, event_ends[cell]), slice(peak, peak_ends[cell])
        made = Made(own, numbers[cell], log, last[cell], events[met], peaks[tops])
        along = Changes(turns.numbers[cell], start, turns.bends, first[cell], turns.table)
        rates = Rates(of_events[met], of_peaks[tops], of_end, of_highest[cell], of_impulses[event:])
        time = tally[HIGHEST_TIME]
        gentlest[cell] = repeat_kernel(made, along, rates, time, no_times, no_samples, S, D, tallied, cell, links)
        a, b = of_end[OF_HEIGHT, BY_HEIGHT], of_end[OF_HEIGHT, BY_VELOCITY]
        c, d = of_end[OF_VELOCITY, BY_HEIGHT], of_end[OF_VELOCITY, BY_VELOCITY]
        half = 0.5 * (a * a + b * b + c * c + d * d)
        gap = max(half * half - (a * d - b * c) ** 2, 0.0)
        amplification[cell] = np.sqrt(half + np.sqrt(gap))
        row = step_ends[cell]
        event = event_ends[cell]
        peak = peak_ends[cell]


def _room_for(cells: int, events: int, peaks: int, tally: bool) -> Tangents:
    """Return tables beside those of the march."""
    return Tangents(
        np.zeros((events, 2, LANES)), np.zeros((peaks, 2, LANES)), np.zeros(cells), np.zeros(cells),
        np.zeros((cells, LANES)), np.full((events if tally else 0, LANES), np.nan),
    )  # fmt: skip


def _work(cells: Cells, turns: CellTangents, kept: KeptSteps, tally: bool) -> tuple[Any, ...]:
    """Return scratch memory, whether a tally is kept, and room for links where none is."""
    lossy = _by_hysteresis(turns.numbers)
    S, D = scratch_of_cells(cells.numbers, cells.pieces, True, lossy, tally), np.zeros((TURNED_ROWS, LANES))
    return S, D, True if tally else None, None if tally else links_of(kept.pool, _directions(turns), lossy)


def _by_hysteresis(turns: FloatArray) -> bool:
    """Return whether tangents (…, NUMBERS, LANES) of a program's numbers change its hysteresis."""
    return bool(np.any(turns[..., contract.HYSTERESIS, :] != 0.0))


def _directions(turns: CellTangents) -> IntArray:
    """Return the lanes in which anything changes."""
    turned = np.any(turns.numbers != 0.0, axis=(0, 1)) | (turns.table >= 0)
    return np.flatnonzero(turned)


def _with_tally(marched: Marched) -> Marched:
    """Return tables with room for what a tally finds."""
    return marched._replace(
        highest=np.zeros(len(marched.status)), impulses=np.full(len(marched.events), np.nan)
    )  # fmt: skip


def march_block(cells: Cells, turns: CellTangents, tally: bool = False) -> tuple[Marched, Tangents] | None:
    """March some cells in this thread, with tangents; with `tally`, find impulses and highest positions too.

    Return None if there are several cells whose steps need too much memory.
    """
    kept = march_keeping_steps(cells, MOST_STEPS, tally)
    if kept is None:
        return None
    marched = _with_tally(kept.marched)
    tangents = _room_for(len(cells.first), len(marched.events), len(marched.peaks), tally)
    gradient_kernel(cells, turns, kept.steps, marched, tangents, *_work(cells, turns, kept, tally))
    if tally:
        return marched, tangents
    return marched._replace(highest=None, impulses=None), tangents._replace(highest=None, impulses=None)


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
    S = scratch_of_cells(program.numbers[None], program.pieces, True, _by_hysteresis(turns))
    made = Made(program.pieces, program.numbers, found.steps, found.state, found.events, found.peaks)
    along = Changes(turns, np.zeros((2, LANES)), bends, 0, table)
    of_rows = np.empty((events, 2, LANES)), np.empty((peaks, 2, LANES))
    rates = Rates(*of_rows, np.zeros((4, LANES)), np.zeros(LANES), np.zeros((0, LANES)))
    tangent_kernel(made, along, rates, 0.0, within, samples, S, np.zeros((TURNED_ROWS, LANES)), None)
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
        some = CellTangents(turns.numbers[block], turns.bends, turns.table)
        found = march_block(cells.part(block), some, tally)
        if found is not None:
            read(block, *found)
            return
        middle = (block.start + block.stop) // 2
        march_and_read(slice(block.start, middle))
        march_and_read(slice(middle, block.stop))

    in_blocks(len(cells.first), GRADIENT_BLOCK, threads, march_and_read)
