"""Computing cells that share nothing: each is a run of its own, and what is asked of it is read of its record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.computed import REFUSED, STATUS_OF_MARCH, ComputedCells
from wheeltapper.ask.margin_of_wheels import margin_of, readings_of_wagon
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.progress import progress_counter
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.record.simulate import side_by_side, simulated_scenario

if TYPE_CHECKING:
    from wheeltapper.ask.study import Study
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]
ROUNDING = 1e-9
"""Margin, in static indentations, that is none. Where a path has a corner and a wheel just touches there, a march may
stall; it then has found where contact begins to be lost."""


def scenario_of_cell(asked: Study, changed: dict[str, FloatArray], cell: int) -> Scenario:
    """Return the scenario of a cell."""
    return asked.scenario.replaced({path: float(values[cell]) for path, values in changed.items()})


def computed_by_records(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    cells = len(next(iter(changed.values())))
    values = np.full((len(asked.features), *asked.wheel_shape, cells), np.nan)
    status, refusals = np.full(cells, REFUSED), dict[int, InputError]()
    notes: list[tuple[Note, ...]] = [()] * cells

    def read_cell(cell: int) -> None:
        try:
            record = simulated_scenario(scenario_of_cell(asked, changed, cell), asked.method, lambda notes: None)
        except InputError as error:
            refusals[cell] = error
            notes[cell] = (Note(f"cannot be computed: {error}", "refused"),)
            return
        said = list(record.notes)
        for row, feature in zip(values, asked.features, strict=True):
            found, more = feature._of_record(record)
            row[..., cell] = found.values
            said.extend(more)
        status[cell] = STATUS_OF_MARCH[record._march.status]
        notes[cell] = tuple(one.note for one in shared_notes(Shared(note, 1) for note in said))

    count = progress_counter("cells", cells)
    side_by_side(read_cell, range(cells), threads, lambda: count(1))
    return ComputedCells(
        values, status, np.empty((len(asked.features), 0, *asked.wheel_shape, cells)), np.zeros(cells, dtype=np.int64),
        np.full(cells, np.nan), shared_notes(Shared(note, 1) for each in notes for note in each),
        tuple(refusals[cell] for cell in sorted(refusals)),
    )  # fmt: skip


def margins_by_records(
    scenario: Scenario, changed: dict[str, FloatArray], method: str, losses: int, threads: int
) -> FloatArray:
    """Return how far each cell of a wagon is from the `losses`-th loss of any wheel, m; NaN where a march broke off."""
    cells = len(next(iter(changed.values())))
    out = np.full(cells, np.nan)

    def march_cell(cell: int) -> None:
        one = scenario.replaced({path: float(values[cell]) for path, values in changed.items()})
        lowered: Any = lowered_scenario(one, method)
        march = run.march(lowered.program)
        readings = readings_of_wagon(lowered, march)
        margin = margin_of(readings, losses)
        if march.status == contract.DONE or (
            march.status == contract.STALLED and abs(margin) < ROUNDING * readings.static
        ):
            out[cell] = margin

    side_by_side(march_cell, range(cells), threads, lambda: None)
    return out
