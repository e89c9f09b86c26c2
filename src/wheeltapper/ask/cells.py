"""Computing the cells of a study: features, their derivatives if asked for, and the status of each cell."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.beyond_trains import others_of
from wheeltapper.ask.computed import STATUS_OF_MARCH, ComputedCells, last_events, trust_of
from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Shared, shared_notes
from wheeltapper.ground.progress import counted_from, progress_counter
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

if TYPE_CHECKING:
    from wheeltapper.lower.many import LoweredCells
    from wheeltapper.march.wheel.ensemble import Marched

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLAB, SLAB_OF_OBJECTS = 2**20, 2**15
"""Largest number of cells that are lowered together. Larger studies are computed slab by slab, which bounds the
memory. Cells that do not march in lanes are lowered to an object each."""


def compute_cells(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    from wheeltapper.lower.many import LoweredCells

    cells = len(next(iter(changed.values())))

    def compute_range(*bounds: int) -> list[ComputedCells]:
        parts = []
        for a, b in pairwise(bounds):
            with counted_from(a, cells):
                parts.append(compute_cells(asked, {path: values[a:b] for path, values in changed.items()}, threads))
        return parts

    slab = SLAB if asked.marcher.cells == run.LOCKSTEP else SLAB_OF_OBJECTS
    if cells > slab:
        return ComputedCells.joined_parts(compute_range(*range(0, cells, slab), cells))
    try:
        if asked.by_differences:
            from wheeltapper.ask.slopes_of_records import slopes_of_records

            plain = compute_cells(replace(asked, gradient=(), by_differences=False), changed, threads)
            return slopes_of_records(asked, changed, plain, threads)
        if asked.by_records:
            from wheeltapper.ask.by_records import computed_by_records

            return computed_by_records(asked, changed, threads)
        if asked.marcher.cells == run.SHARING_TABLES:
            from wheeltapper.ask.shared_tables import computed_with_tables
            from wheeltapper.ask.slopes_of_trains import slopes_of_trains

            return (slopes_of_trains if asked.gradient else computed_with_tables)(asked, changed, threads)
        many = LoweredCells(asked.scenario, changed, asked.method)
        _set_end(asked, many.cells.numbers)
        return _computed_gradients(asked, many, threads) if asked.gradient else _computed_values(asked, many, threads)
    except InputError as error:
        if cells == 1:
            return ComputedCells.refused_cell(asked, error)
    return ComputedCells.joined_parts(
        compute_range(0, cells // 2, cells)
    )  # halving ends with single cells that are refused


def _set_end(asked: Study, numbers: FloatArray) -> None:
    """Let each march end as soon as the last feature is known."""
    numbers[:, contract.LAST_IMPACT], numbers[:, contract.LAST_LOSS] = last_events(asked)


def _computed_values(asked: Study, many: LoweredCells, threads: int) -> ComputedCells:
    from wheeltapper.march.wheel.ensemble import march_all
    from wheeltapper.record.trains.trains import Trains, notes_of_cells

    total = len(many.cells.first)
    values, status = np.empty((len(asked.features), total)), np.empty(total, dtype=np.int64)
    said: list[Shared] = []

    def read_block(block: slice, marched: Marched) -> None:
        trains = Trains(marched, many.units.part(block), *others_of(many, block))
        for row, feature in zip(values, asked.features, strict=True):
            row[block] = feature(trains)
        said.extend(notes_of_cells(trains.notes))
        status[block] = STATUS_OF_MARCH[marched.status]
        count(block.stop - block.start)

    count = progress_counter("cells", total)
    march_all(many.to_march, threads, read_block, asked.needs_tally)
    empty = np.empty((len(asked.features), 0, total))
    return ComputedCells(
        values, status, empty, np.zeros(total, dtype=np.int64), np.full(total, np.nan),
        shared_notes((*many.notes, *said)),
    )  # fmt: skip


def _computed_gradients(asked: Study, many: LoweredCells, threads: int) -> ComputedCells:
    from wheeltapper.ask.sensitivity import feature_slopes

    found = feature_slopes(many, asked.gradient, asked.features, threads)
    trust = trust_of(found.gentlest, found.amplification, asked.chaos_limit)
    return ComputedCells(
        found.values, STATUS_OF_MARCH[found.status], found.gradient, trust, found.amplification,
        shared_notes((*many.notes, *found.notes)),
    )  # fmt: skip
