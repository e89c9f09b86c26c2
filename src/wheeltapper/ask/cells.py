"""Computing the cells of a study: features, their derivatives if asked for, and the status of each cell."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.computed import REFUSED, STATUS_OF_MARCH, ComputedCells, trust_of
from wheeltapper.ask.gradients import derivatives, unknown_notes
from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.progress import counted_from, progress_counter
from wheeltapper.record.cells.base import Asked, Block, Cells
from wheeltapper.record.trains.trains import notes_of_cells

FloatArray = NDArray[np.float64]


def compute_cells(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    cells = len(next(iter(changed.values())))

    def compute_range(*bounds: int) -> list[ComputedCells]:
        parts = []
        for a, b in pairwise(bounds):
            with counted_from(a, cells):
                parts.append(compute_cells(asked, {path: values[a:b] for path, values in changed.items()}, threads))
        return parts

    if cells > asked.cells.most:
        return ComputedCells.joined_parts(compute_range(*range(0, cells, asked.cells.most), cells))
    try:
        if asked.by_differences:
            from wheeltapper.ask.gradient_by_differences import gradient_by_differences

            plain = compute_cells(replace(asked, gradient=(), by_differences=False), changed, threads)
            return gradient_by_differences(asked, changed, plain, threads)
        together = asked.cells(asked.scenario, changed, asked.method)
        return _computed(asked, together, threads)
    except InputError as error:
        if cells == 1:
            return ComputedCells.refused_cell(asked, error)
    return ComputedCells.joined_parts(
        compute_range(0, cells // 2, cells)
    )  # halving ends with single cells that are refused


def _computed(asked: Study, cells: Cells, threads: int) -> ComputedCells:
    """Compute features of cells, and their derivatives if asked for."""
    out, gentlest = ComputedCells.unknown(asked, cells.count), np.full(cells.count, np.nan)
    said, refusals = dict[int, tuple[Shared, ...]](), dict[int, InputError]()

    def read(block: Block) -> None:
        own, first, trains = block.cells, int(block.cells[0]), block.trains
        if block.refusal is not None:
            out.status[own], refusals[first] = REFUSED, block.refusal
            said[first] = (Shared(Note(f"cannot be computed: {block.refusal}", "refused"), 1),)
            return
        out.status[own] = STATUS_OF_MARCH[block.status]
        gentlest[own], out.amplification[own] = block.gentlest, block.amplification
        for number, along in enumerate(block.along, block.first):
            for row, (values, slope) in enumerate(derivatives(asked.features, along)):
                out.values[row][..., own] = asked.by_cell(values)
                out.gradient[row, number][..., own] = asked.by_cell(slope)
        if trains is not None and not block.along:
            for row, feature in zip(out.values, asked.features, strict=True):
                row[..., own] = asked.by_cell(feature(trains))
        told = [
            *(Shared(note, 1) for note in block.notes),
            *notes_of_cells(() if trains is None else trains.notes, asked.wheel_count),
        ]
        said[first] = tuple(Shared(one.note, min(one.cells, len(own))) for one in shared_notes(told))

    def read_and_count(block: Block) -> None:
        read(block)
        count(0 if block.first else len(block.cells))

    count = progress_counter("cells", cells.count)
    cells.march(Asked.by(asked.features), threads, read_and_count, asked.gradient)
    out.trust[:] = trust_of(gentlest, out.amplification, asked.chaos_limit)
    on_cells = (note for _, notes in sorted(said.items()) for note in notes)
    return replace(
        out, notes=shared_notes((*cells.notes, *unknown_notes(asked, out), *on_cells)),
        refusals=tuple(refusals[cell] for cell in sorted(refusals)),
    )  # fmt: skip
