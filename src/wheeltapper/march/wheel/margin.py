"""Distance of a wheel from a further loss of contact: a margin that passes zero smoothly when the loss appears.

march each cell to the impact that ends the loss in question, or to the end; then go through its steps once more
the loss happened      the smallest indentation in its flight: minus the largest clearance
it did not             the smallest indentation since the impact before it
with material damping  there the force also ends where 1 + η·w does: the smaller of both counts
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import in_blocks
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import LENGTH, PHASE, TIME, FloatArray
from wheeltapper.march.steps.layout import CLEAR, COUNT, EVENTS, FLIGHT_ORDER, TREND, U, W
from wheeltapper.march.steps.written import scratch_for, scratch_of_cells
from wheeltapper.march.wheel.dense import prepare_step
from wheeltapper.march.wheel.ensemble import Cells
from wheeltapper.march.wheel.events import is_contact_phase, is_free
from wheeltapper.march.wheel.roots import NONE, evaluate, first_root
from wheeltapper.march.wheel.single import march, march_kernel, start_kernel

MARGIN_BLOCK = 64
NO_MARGIN = 1e-9
"""Margin (scaled) that is none. Where a path has a corner and a wheel just touches there, a march may stall; it then
has found where contact begins to be lost."""


@uncounted_kernel
def _smallest_value(row: int, order: int, length: float, S: FloatArray) -> float:
    """Return the smallest value of a series over a step."""
    lowest = min(S[row], evaluate(S, row, order, length))
    for k in range(order):
        S[TREND + k] = (k + 1) * S[row + k + 1]
    root, _ = first_root(S, TREND, order - 1, 0.0, length, 1.0, 0.0)
    return lowest if root == NONE else min(lowest, evaluate(S, row, order, root))


@uncounted_kernel
def _contact_margin(numbers: FloatArray, step: FloatArray, S: FloatArray) -> float:
    """Return the margin of a contact step whose series are in S."""
    order = int(numbers[contract.ORDER])
    u = max(_smallest_value(U, order, step[LENGTH], S), 0.0)
    eta = numbers[contract.HYSTERESIS]
    return u * u if eta == 0.0 else min(u * u, 1.0 + eta * _smallest_value(W, order, step[LENGTH], S))


@uncounted_kernel
def _flight_margin(numbers: FloatArray, step: FloatArray, S: FloatArray) -> float:
    """Return the margin of a step without contact force whose series are in S, a negative number."""
    order = int(FLIGHT_ORDER)
    lowest = _smallest_value(CLEAR, order, step[LENGTH], S)
    eta = numbers[contract.HYSTERESIS]
    if eta == 0.0:
        return lowest
    for k in range(order):
        S[CLEAR + k] = eta * (k + 1) * S[CLEAR + k + 1]
    return min(lowest, 1.0 + _smallest_value(CLEAR, order - 1, step[LENGTH], S))


@uncounted_kernel
def margin_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, why: int,
    steps: FloatArray, events: FloatArray, losses: int, S: FloatArray,
) -> float:  # fmt: skip
    """Return the margin of a march that stopped for the reason `why`; NaN where it broke off.

    One static indentation where nothing is there to be lost: no impact has come before that loss.
    """
    since, lost, found = 0.0, np.inf, 0
    for i in range(len(events)):
        if events[i, contract.EVENT_KIND] == contract.LOSS:
            found += 1
            if found == losses:
                lost = events[i, contract.EVENT_TIME]
        elif events[i, contract.EVENT_KIND] == contract.IMPACT and found == losses - 1:
            since = events[i, contract.EVENT_TIME]
    margin = np.inf
    for i in range(len(steps)):
        step = steps[i]
        if found < losses and is_contact_phase(step[PHASE]) and step[TIME] > since:
            prepare_step(pieces, numbers, law, step, S)
            margin = min(margin, _contact_margin(numbers, step, S))
        elif found >= losses and is_free(step[PHASE]) and step[TIME] >= lost:
            prepare_step(pieces, numbers, law, step, S)
            margin = min(margin, _flight_margin(numbers, step, S))
    ended = why == contract.DONE or why == contract.ENOUGH
    if margin == np.inf and ended:
        return 1.0
    return margin if ended or abs(margin) < NO_MARGIN else np.nan


@uncounted_kernel
def margins_kernel(
    cells: Cells, cell: int, losses: int, margins: FloatArray, steps: FloatArray, events: FloatArray,
    peaks: FloatArray, S: FloatArray,
) -> int:  # fmt: skip
    """Write the margins of the cells from `cell` on; return the first that finds no room, or their number."""
    while cell < len(cells.first):
        table = cells.pieces[cells.first[cell] : cells.first[cell] + cells.many[cell]]
        numbers = cells.numbers[cell]
        start_kernel(table, numbers, events, S)
        why = march_kernel(table, numbers, None, steps, events, peaks, steps[:0], S)
        if why == contract.FULL:
            return cell
        made, met = steps[: int(S[COUNT])], events[: int(S[COUNT + EVENTS])]
        margins[cell] = margin_kernel(table, numbers, None, why, made, met, losses, S)
        cell += 1
    return cell


def _arguments(cells: Cells, cell: int, losses: int, margins: FloatArray, rows: int) -> tuple[Any, ...]:
    columns = (contract.ENDED_COLUMNS, contract.EVENT_COLUMNS, contract.PEAK_COLUMNS)
    tables = (np.empty((rows, many)) for many in columns)
    return (cells, cell, losses, margins, *tables, scratch_of_cells(cells.numbers, cells.pieces))


def _margin_of(program: contract.Program, losses: int) -> float:
    """Return the margin of a program."""
    found = march(program)
    made = found.pieces, program.numbers, program.law_or_none, found.status, found.steps, found.events
    return margin_kernel(*made, losses, scratch_for(program))


def margins_of(cells: Cells | Sequence[contract.Program], losses: int, threads: int) -> FloatArray:
    """Return how far each cell is from its `losses`-th loss of contact, in scaled units; negative beyond it.

    NaN where a march broke off.
    """
    total = len(cells.first) if isinstance(cells, Cells) else len(cells)
    margins = np.empty(total)

    def march_and_read(block: slice) -> None:
        if not isinstance(cells, Cells):
            margins[block] = [_margin_of(program, losses) for program in cells[block]]
            return
        part = cells.part(block)
        cell, rows = 0, 2048
        while cell < len(part.first):
            cell = margins_kernel(*_arguments(part, cell, losses, margins[block], rows))
            rows *= 2

    in_blocks(total, MARGIN_BLOCK, threads, march_and_read)
    return margins
