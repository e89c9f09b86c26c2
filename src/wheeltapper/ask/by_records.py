"""Computing the cells of a study of wagons: each is a run of its own, and what is asked of it is read of its record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.cells import REFUSED, STATUS_OF_MARCH, ComputedCells
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.progress import progress_counter
from wheeltapper.march import run
from wheeltapper.record.kinds import kind_of
from wheeltapper.record.simulate import side_by_side, simulated_scenario

if TYPE_CHECKING:
    from wheeltapper.ask.study import Study
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]


def _scenario_of(asked: Study, changed: dict[str, FloatArray], cell: int) -> Scenario:
    return asked.scenario.replaced({path: float(values[cell]) for path, values in changed.items()})


def is_ready(asked: Study, changed: dict[str, FloatArray]) -> bool:
    """Return False if computing these cells begins with compiling."""
    first = _scenario_of(asked, changed, 0)
    return run.is_ready(kind_of(first).lower(first, asked.method).program)


def computed_by_records(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    cells = len(next(iter(changed.values())))
    values = np.full((len(asked.features), *asked.wheel_shape, cells), np.nan)
    status, refusals = np.full(cells, REFUSED), dict[int, InputError]()
    notes: list[tuple[Note, ...]] = [()] * cells

    def read_cell(cell: int) -> None:
        try:
            record = simulated_scenario(_scenario_of(asked, changed, cell), asked.method, lambda notes: None)
        except InputError as error:
            refusals[cell] = error
            notes[cell] = (Note(f"cannot be computed: {error}", "refused"),)
            return
        for row, feature in zip(values, asked.features, strict=True):
            row[..., cell] = feature(record).values
        status[cell], notes[cell] = STATUS_OF_MARCH[record._march.status], record.notes

    count = progress_counter("cells", cells)
    side_by_side(read_cell, range(cells), threads, lambda: count(1))
    return ComputedCells(
        values, status, np.empty((len(asked.features), 0, *asked.wheel_shape, cells)), np.zeros(cells, dtype=np.int64),
        np.full(cells, np.nan), shared_notes(Shared(note, 1) for each in notes for note in each),
        tuple(refusals[cell] for cell in sorted(refusals)),
    )  # fmt: skip
