"""Distance of a wheel from a further loss of contact: a margin that passes zero smoothly when the loss appears.

march each cell to the impact that ends the loss in question, or to the end; then go through its steps once more
the loss happened      the smallest indentation in its flight: minus the largest clearance
it did not             the smallest indentation since the impact before it
with material damping  there the force also ends where 1 + η·w does: the smaller of both counts
"""

from __future__ import annotations

from typing import Any

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.blocks import in_blocks
from wheeltapper.march.ensemble import Cells
from wheeltapper.march.events import is_free
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.layout import CLEAR, COUNT, EVENTS, FLIGHT_ORDER, TREND, U, W
from wheeltapper.march.program import LENGTH, PHASE, PIECE, SHIFT, TIME, FloatArray
from wheeltapper.march.roots import NONE, evaluate, first_root
from wheeltapper.march.series import localise
from wheeltapper.march.single import march_kernel, start_kernel
from wheeltapper.march.step import repeat_step
from wheeltapper.march.steps.written import scratch_of_cells

MARGIN_BLOCK = 64


@uncounted_kernel
def _smallest_value(row: int, order: int, length: float, S: FloatArray) -> float:
    """Return the smallest value of a series over a step."""
    lowest = min(S[row], evaluate(S, row, order, length))
    for k in range(order):
        S[TREND + k] = (k + 1) * S[row + k + 1]
    root, _ = first_root(S, TREND, order - 1, 0.0, length, 1.0, 0.0)
    return lowest if root == NONE else min(lowest, evaluate(S, row, order, root))


@uncounted_kernel
def _contact_margin(pieces: FloatArray, numbers: FloatArray, step: FloatArray, S: FloatArray) -> float:
    """Return the margin of a contact step."""
    order = int(numbers[contract.ORDER])
    localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
    repeat_step(pieces, numbers, None, step, S)
    u = max(_smallest_value(U, order, step[LENGTH], S), 0.0)
    eta = numbers[contract.HYSTERESIS]
    return u * u if eta == 0.0 else min(u * u, 1.0 + eta * _smallest_value(W, order, step[LENGTH], S))


@uncounted_kernel
def _flight_margin(pieces: FloatArray, numbers: FloatArray, step: FloatArray, S: FloatArray) -> float:
    """Return the margin of a step without contact force, a negative number."""
    order = int(FLIGHT_ORDER)
    localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
    repeat_step(pieces, numbers, None, step, S)
    lowest = _smallest_value(CLEAR, order, step[LENGTH], S)
    eta = numbers[contract.HYSTERESIS]
    if eta == 0.0:
        return lowest
    for k in range(order):
        S[CLEAR + k] = eta * (k + 1) * S[CLEAR + k + 1]
    return min(lowest, 1.0 + _smallest_value(CLEAR, order - 1, step[LENGTH], S))


@uncounted_kernel
def margin_kernel(
    cells: Cells, cell: int, losses: int, margins: FloatArray, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Write the margins of the cells from `cell` on; return the first that finds no room, or their number."""
    while cell < len(cells.first):
        table = cells.pieces[cells.first[cell] : cells.first[cell] + cells.many[cell]]
        numbers = cells.numbers[cell]
        start_kernel(table, numbers, events, S)
        why = march_kernel(table, numbers, None, None, steps, events, peaks, None, S)
        if why == contract.FULL:
            return cell
        rows = int(S[COUNT])
        since = 0.0
        lost = np.inf
        found = 0
        for i in range(int(S[COUNT + EVENTS])):
            if events[i, contract.EVENT_KIND] == contract.LOSS:
                found += 1
                if found == losses:
                    lost = events[i, contract.EVENT_TIME]
            elif found == losses - 1:
                since = events[i, contract.EVENT_TIME]
        margin = np.inf
        for i in range(rows):
            if found < losses and steps[i, PHASE] == contract.CONTACT and steps[i, TIME] > since:
                margin = min(margin, _contact_margin(table, numbers, steps[i], S))
            elif found >= losses and is_free(steps[i, PHASE]) and steps[i, TIME] >= lost:
                margin = min(margin, _flight_margin(table, numbers, steps[i], S))
        margins[cell] = margin if np.isfinite(margin) else np.nan
        cell += 1
    return cell


def _arguments(cells: Cells, cell: int, losses: int, margins: FloatArray, rows: int) -> tuple[Any, ...]:
    columns = (contract.STEP_COLUMNS, contract.EVENT_COLUMNS, contract.PEAK_COLUMNS)
    tables = (np.empty((rows, many)) for many in columns)
    return (cells, cell, losses, margins, *tables, scratch_of_cells(cells.numbers, cells.pieces))


def margins_of(cells: Cells, losses: int, threads: int) -> FloatArray:
    """Return the margin of each cell from its `losses`-th loss of contact, in scaled units; negative beyond it."""
    total = len(cells.first)
    margins = np.empty(total)

    def march_and_read(block: slice) -> None:
        part = cells.part(block)
        cell, rows = 0, 2048
        while cell < len(part.first):
            cell = margin_kernel(*_arguments(part, cell, losses, margins[block], rows))
            rows *= 2

    in_blocks(total, MARGIN_BLOCK, threads, march_and_read)
    return margins
