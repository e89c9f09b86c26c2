"""Cells of one wheel that are lowered together: eight at a time march in the lanes of the processor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.notes import Shared
from wheeltapper.ground.progress import progress_shown
from wheeltapper.lower.lowered import balanced
from wheeltapper.lower.many import Direction, LoweredCells
from wheeltapper.march.common import program as contract
from wheeltapper.record.cells.base import Asked, Block, Cells
from wheeltapper.record.simulate import simulated_quietly
from wheeltapper.record.trains.of_record import trains_of
from wheeltapper.record.trains.rates import Along, Rates
from wheeltapper.record.trains.trains import Trains

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.march.wheel.ensemble import Marched
    from wheeltapper.march.wheel.gradients import Tangents
    from wheeltapper.record.features import Feature

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
T = TypeVar("T")


class CellsAsObjects(Cells):
    """Cells of one wheel, each of which marches by itself."""

    @cached_property
    def _many(self) -> LoweredCells:
        return LoweredCells(self.scenario, self.changed, self.method)

    @property
    def notes(self) -> tuple[Shared, ...]:
        """What the user should know of all cells, one note for each cause."""
        return self._many.notes

    def _trains(self, cells: slice, marched: Marched) -> tuple[IntArray, Trains]:
        numbers = np.arange(cells.start, cells.stop)
        return numbers, Trains(marched, self._many.units.part(cells), **self.beyond(numbers, 1))

    def _end_at(self, impact: int, loss: int) -> None:
        numbers = self._many.cells.numbers
        numbers[:, contract.LAST_IMPACT], numbers[:, contract.LAST_LOSS] = impact, loss

    def march(self, asked: Asked, threads: int, read: Callable[[Block], None], along: Sequence[str] = ()) -> None:
        """March all cells, and hand each block to `read`; the threads do both."""
        from wheeltapper.march.wheel.ensemble import march_all

        def read_block(block: slice, marched: Marched) -> None:
            cells, trains = self._trains(block, marched)
            read(Block(cells, marched.status, trains))

        self._end_at(asked.impact, asked.loss)
        march_all(self._many.to_march, threads, read_block, asked.tally)

    def margins(self, losses: int, threads: int) -> FloatArray:
        """Return how far each cell is from its `losses`-th loss, m; NaN where a march broke off."""
        from wheeltapper.march.wheel.margin import margins_of

        self._end_at(losses, -1)
        return np.asarray(margins_of(self._many.to_march, losses, threads) * self._many.units.length)

    def each(self, cells: IntArray, read: Callable[[Trains], T]) -> Iterable[T]:
        """Return what is read of the trains of some cells, which are marched once more, each alone."""

        def read_cell(cell: int) -> T:
            with progress_shown(False):
                return read(trains_of(simulated_quietly(self.scenario_of(cell), self.method), False))

        return map(read_cell, cells.tolist())

    def missing_energy(self, cells: IntArray, wheels: int) -> FloatArray:
        """Return the missing share of the exchanged energy of some cells."""
        return balanced.missing_parts(self._many.program(cell) for cell in cells.tolist())


class CellsInLanes(CellsAsObjects):
    """Cells of one wheel, eight of which march in step."""

    most: ClassVar[int] = 2**20
    chunk: ClassVar[int] = 32_768

    @staticmethod
    def has_tangents(scenario: Scenario, paths: Sequence[str], features: Sequence[Feature]) -> bool:
        """Return whether marches with tangents know the derivatives of some features by some fields: of all."""
        return True

    def march(self, asked: Asked, threads: int, read: Callable[[Block], None], along: Sequence[str] = ()) -> None:
        """March all cells, with tangents along some fields, and hand each block to `read`; the threads do both."""
        from wheeltapper.march.wheel.gradients import PARAMETERS, march_all

        if not along:
            super().march(asked, threads, read)
            return
        self._end_at(asked.impact, asked.loss)
        for first in range(0, len(along), PARAMETERS):
            directions = [self._many.direction_along(path) for path in along[first : first + PARAMETERS]]

            def read_block(
                block: slice, marched: Marched, tangents: Tangents,
                first: int = first, directions: list[Direction] = directions,
            ) -> None:  # fmt: skip
                cells, trains = self._trains(block, marched)
                turned = [_along(trains, tangents, lane, one, block) for lane, one in enumerate(directions)]
                measures = tangents.gentlest, tangents.amplification
                read(Block(cells, marched.status, trains, (), None, turned, first, *measures))

            march_all(*self._many.turned(directions), threads, read_block, asked.tally)


def _along(trains: Trains, tangents: Tangents, lane: int, direction: Direction, block: slice) -> Along:
    """Return how the trains of a block change along one direction."""
    none = np.empty((0, lane + 1))
    highest = none if tangents.highest is None else tangents.highest
    impulses = none if tangents.impulses is None else tangents.impulses
    rates = Rates(tangents.events[:, :, lane], tangents.peaks[:, :, lane], highest[:, lane], impulses[:, lane])
    ended = trains.marched.status == contract.DONE
    of_end = np.where(ended, direction.numbers[block, contract.END], 0.0)
    return Along(trains, rates, of_end, direction.units.part(block))
