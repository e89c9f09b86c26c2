"""What can be asked of cells, whatever they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.lower.fields import Fields
from wheeltapper.record.trains.growth import Growth, growth_of
from wheeltapper.record.trains.rates import Along
from wheeltapper.record.trains.trains import Trains

if TYPE_CHECKING:
    from wheeltapper.record.features import Feature

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
T = TypeVar("T")


class Asked(NamedTuple):
    """What features ask of every march.

    Attributes
    ----------
    tally
        Whether one needs impulses or the highest position.
    impact, loss
        The impact, or the number of impacts before the loss, at which the last of them is known; -1 where none tells.
    """

    tally: bool = False
    impact: int = -1
    loss: int = -1

    @staticmethod
    def by(features: Sequence[Feature]) -> Asked:
        """Return what some features ask."""
        tally = any(feature.tally for feature in features)
        if any(feature.until == "end" for feature in features):
            return Asked(tally)
        impact, loss = (
            max((feature.impacts for feature in features if feature.until == until), default=-1)
            for until in ("impact", "loss")
        )
        return Asked(tally, impact) if impact > loss else Asked(tally, -1, loss)


class Block(NamedTuple):
    """Some cells that have been marched.

    Attributes
    ----------
    cells
        Their numbers.
    status
        Why their marches ended, one for each.
    trains
        Those of all their wheels, cell after cell; None where the march of an only cell broke off.
    notes
        On these cells alone.
    refusal
        Why an only cell cannot be computed.
    along
        With tangents: how the trains change along each direction, the first of which is the field number `first`.
    gentlest
        With tangents: the smallest rate of indentation at an event of each cell, scaled.
    amplification
        With tangents: how much a small change of each cell's start grows.
    """

    cells: IntArray
    status: IntArray
    trains: Trains | None
    notes: tuple[Note, ...] = ()
    refusal: InputError | None = None
    along: Sequence[Along] = ()
    first: int = 0
    gentlest: FloatArray | float = np.nan
    amplification: FloatArray | float = np.nan


class Cells(ABC):
    """Cells of a scenario in which some fields vary.

    Parameters
    ----------
    scenario
        The scenario that all share.
    changed
        By path, one number per cell in SI units.
    method
        "default" or "strict".
    """

    most: ClassVar[int] = 2**15
    """Largest number of cells that are lowered together, which bounds the memory."""
    chunk: ClassVar[int] = 512
    """Approximate number of cells in a chunk of a store: a second or so of work."""

    def __init__(self, scenario: Scenario, changed: dict[str, FloatArray], method: str) -> None:
        self.scenario, self.changed, self.method = scenario, changed, method
        self.count = len(next(iter(changed.values())))

    @staticmethod
    def has_tangents(scenario: Scenario, paths: Sequence[str], features: Sequence[Feature]) -> bool:
        """Return whether marches with tangents know the derivatives of some features by some fields."""
        return False

    @staticmethod
    def is_dear(path: str) -> bool:
        """Return whether cells that differ in a field share less: they should be computed apart."""
        return False

    @property
    def notes(self) -> tuple[Shared, ...]:
        """What the user should know of all cells, one note for each cause."""
        return ()

    @abstractmethod
    def march(self, asked: Asked, threads: int, read: Callable[[Block], None], along: Sequence[str] = ()) -> None:
        """March all cells, with tangents along some fields, and hand each block to `read`; the threads do both.

        Fields are given only where there are tangents.
        """

    @abstractmethod
    def margins(self, losses: int, threads: int) -> FloatArray:
        """Return how far each cell is from the `losses`-th loss of any wheel, m; NaN where a march broke off."""

    @abstractmethod
    def each(self, cells: IntArray, read: Callable[[Trains], T]) -> Iterable[T]:
        """Return what is read of the trains of some cells, which are marched once more, each alone."""

    def scenario_of(self, cell: int) -> Scenario:
        """Return the scenario of one cell."""
        return self.scenario.replaced({path: float(values[cell]) for path, values in self.changed.items()})

    def beyond(self, cells: IntArray, wheels: int, positions: FloatArray | float = 0.0) -> dict[str, Any]:
        """Return what features ask of some cells beyond their trains, each computed when it is asked for.

        These are fields of `Trains`; the positions are those of all wheels of these cells, m.
        """
        changed = {path: values[cells] for path, values in self.changed.items()}

        def meets(place: float) -> FloatArray:
            speeds = np.broadcast_to(Fields(self.scenario, changed)("speed"), len(cells))
            with np.errstate(divide="ignore", invalid="ignore"):  # of a wheel that does not roll
                return np.asarray((place - positions) / np.repeat(speeds, wheels), dtype=float)

        def growth(waves: int) -> Growth:
            found = growth_of(self.scenario, changed, self.method, waves)
            return Growth(*(np.repeat(values, wheels) for values in found))

        def end_forces(trains: IntArray) -> FloatArray:
            owners = np.unique(trains // wheels)
            found = self.each(cells[owners], lambda one: one.end_forces(np.arange(wheels)))
            forces = np.concatenate(list(found))
            return np.asarray(forces[np.searchsorted(owners, trains // wheels) * wheels + trains % wheels])

        return {
            "missing_energy": cache(lambda: self.missing_energy(cells, wheels)), "growth": cache(growth),
            "meets": meets, "at_rest": isinstance(self.scenario.start, str),
            "force_histories": lambda rate: (
                force for forces in self.each(cells, lambda one: one.force_histories(rate)) for force in forces
            ),
            "end_forces": end_forces,
        }  # fmt: skip

    def missing_energy(self, cells: IntArray, wheels: int) -> FloatArray:
        """Return the missing share of the exchanged energy of some cells, for each wheel."""
        return np.concatenate(list(self.each(cells, lambda one: one.missing_energy())))
