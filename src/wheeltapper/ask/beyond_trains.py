"""What features ask of the cells of a wheel beyond their trains: another march of one cell alone answers it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.warned import ModelWarning
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.lowered import balanced
from wheeltapper.record.simulate import simulate
from wheeltapper.record.trains.growth import Growth, growth_of
from wheeltapper.record.trains.of_record import end_forces_of

if TYPE_CHECKING:
    from wheeltapper.lower.many import LoweredCells
    from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Others(NamedTuple):
    """What features ask of cells beyond their trains; the fields are those at the end of `Trains`."""

    missing_energy: Callable[[], FloatArray]
    growth: Callable[[int], Growth]
    meets: Callable[[float], FloatArray]
    force_histories: Callable[[float], Iterable[FloatArray]]
    at_rest: bool
    end_forces: Callable[[IntArray], FloatArray]


def others_of(many: LoweredCells, block: slice) -> Others:
    """Return what features ask of some cells beyond their trains, each computed when it is asked for.

    The work and energy of a cell, its force over time and its deviations are those of another march of this cell alone.
    """
    changed = {path: values[block] for path, values in many.changed.items()}
    cells = range(block.start, block.stop)

    def meets(place: float) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):  # of a wheel that does not roll
            return np.broadcast_to(place / Fields(many.scenario, changed)("speed"), len(cells))

    def record_of(cell: int) -> Record:
        one = many.scenario.replaced({path: float(values[cell]) for path, values in changed.items()})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)  # the cells have said theirs
            return simulate(one, many.method, progress=False)  # type: ignore[call-overload, no-any-return]

    def force_histories(rate: float) -> Iterable[FloatArray]:
        return (record_of(cell).history(rate).normal_force.values for cell in range(len(cells)))

    def end_forces(which: IntArray) -> FloatArray:
        return np.array([float(end_forces_of(record_of(cell))[0]) for cell in which.tolist()])

    return Others(
        cache(lambda: balanced.missing_parts(many.program(cell) for cell in cells)),
        cache(lambda waves: growth_of(many.scenario, changed, many.method, waves)), meets, force_histories,
        isinstance(many.scenario.start, str),
        end_forces,
    )  # fmt: skip
