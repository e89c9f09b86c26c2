"""Cells that share nothing: each is a run of its own, and what is asked of it is read of its record."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.record.cells.base import Asked, Block, Cells
from wheeltapper.record.simulate import side_by_side, simulated_quietly
from wheeltapper.record.trains.of_record import trains_of
from wheeltapper.record.trains.trains import Trains

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
T = TypeVar("T")
ROUNDING = 1e-9
"""Margin, in static indentations, that is none. Where a path has a corner and a wheel just touches there, a march may
stall; it then has found where contact begins to be lost."""


class CellsAlone(Cells):
    """Cells that are simulated one by one."""

    chunk: ClassVar[int] = 16

    def march(self, asked: Asked, threads: int, read: Callable[[Block], None], along: Sequence[str] = ()) -> None:
        """Simulate all cells, and hand each to `read`; the threads do both."""

        def read_cell(cell: int) -> None:
            try:
                record = simulated_quietly(self.scenario_of(cell), self.method)
            except InputError as error:
                read(Block(np.array([cell]), np.zeros(1, np.int64), None, refusal=error))
                return
            trains = trains_of(record, asked.tally) if record.outcome is Outcome.COMPLETED else None
            read(Block(np.array([cell]), np.array([record._march.status]), trains, record.notes))

        side_by_side(read_cell, range(self.count), threads, lambda: None)

    def margins(self, losses: int, threads: int) -> FloatArray:
        """Return how far each cell is from the `losses`-th loss of any wheel, m; NaN where a march broke off."""
        out = np.full(self.count, np.nan)

        def march_cell(cell: int) -> None:
            lowered: Any = lowered_scenario(self.scenario_of(cell), self.method)
            march = run.march(lowered.program)
            margin, static = lowered.margin(march, losses)
            if march.status == contract.DONE or (
                march.status == contract.STALLED and abs(margin) < ROUNDING * static
            ):  # fmt: skip
                out[cell] = margin

        side_by_side(march_cell, range(self.count), threads, lambda: None)
        return out

    def each(self, cells: IntArray, read: Callable[[Trains], T]) -> Iterable[T]:
        """Return what is read of the trains of some cells, which are simulated once more."""
        return (
            read(trains_of(simulated_quietly(self.scenario_of(cell), self.method), False)) for cell in cells.tolist()
        )
