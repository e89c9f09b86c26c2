"""Computing the cells of a study: features, their derivatives if asked for, and the status of each cell."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.progress import counted_from, progress_counter
from wheeltapper.lower.fields import Fields
from wheeltapper.march import assembly, run
from wheeltapper.march import program as contract
from wheeltapper.march.general import layout
from wheeltapper.record import balanced
from wheeltapper.record.growth import Growth, growth_of
from wheeltapper.record.record_trains import end_forces_of
from wheeltapper.record.simulate import ModelWarning, simulate, warn_caller

if TYPE_CHECKING:
    from wheeltapper.lower.many import LoweredCells
    from wheeltapper.march.ensemble import Marched
    from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLAB, SLAB_OF_OBJECTS = 2**20, 2**15
"""Largest number of cells that are lowered together. Larger studies are computed slab by slab, which bounds the
memory. Cells that do not march in lanes are lowered to an object each."""

MOST_REFUSALS = 100
"""Largest number of reasons for refused cells that are kept; further ones are dropped."""

# Status of a cell, in the order of the numbers that a chart stores.
COMPLETE, EVENT_LIMIT, NOT_FINITE, STALLED, END_OF_PATH, REFUSED, CHATTERING, UNSOLVED, DERAILED, UNBALANCED, FULL = (
    range(11)
)
STATUS = (
    "complete", "event_limit", "not_finite", "stalled", "end_of_path", "refused", "chattering", "unsolved",
    "derailed", "unbalanced", "out_of_memory",
)  # fmt: skip
STATUS_OF_MARCH = np.zeros(128, dtype=np.int64)
"""Status of a cell by that of its march."""
STATUS_OF_MARCH[[contract.TOO_MANY_EVENTS, contract.NOT_FINITE, contract.STALLED, contract.END_OF_PATH]] = (
    EVENT_LIMIT, NOT_FINITE, STALLED, END_OF_PATH,
)  # fmt: skip
STATUS_OF_MARCH[[layout.CHATTERS, layout.UNSOLVED]] = CHATTERING, UNSOLVED
STATUS_OF_MARCH[[assembly.DERAILED, balanced.UNBALANCED, contract.FULL]] = DERAILED, UNBALANCED, FULL
# How far a gradient can be trusted.
EXACT, GRAZING, NEAR_CHAOTIC, NOT_DIFFERENTIABLE = range(4)
TRUST = ("exact", "grazing", "near_chaotic")
TRUST_BY_DIFFERENCES = ("by_differences", "grazing", "near_chaotic", "not_differentiable")
"""The same for cells whose derivatives are differences of runs; the first has its error beside."""


@dataclass(frozen=True)
class ComputedCells:
    """Results of some cells.

    Attributes
    ----------
    values
        (features, cells), SI units; NaN if a cell has too few impacts or could not be computed. Of several wheelsets
        (features, wheelsets, cells), of wagons (features, axles, sides, cells).
    status
        (cells,), places in `STATUS`.
    gradient
        (features, parameters, cells); without parameters if no gradient was asked for.
    trust
        (cells,), places in `TRUST`.
    amplification
        (cells,) growth of a small change of the start until the last feature is known; NaN without gradients.
    notes
        What the user should know, once for each cause.
    refusals
        Why cells were refused.
    error
        Probable errors of the gradient, of the same shape; None where it is exact.
    """

    values: FloatArray
    status: IntArray
    gradient: FloatArray
    trust: IntArray
    amplification: FloatArray
    notes: tuple[Shared, ...]
    refusals: tuple[InputError, ...] = ()
    error: FloatArray | None = None

    def check_refusals(self) -> None:
        """Raise an error if no cell could be computed; warn if some could not."""
        if not self.refusals:
            return
        refused = int((self.status == REFUSED).sum())
        if refused == len(self.status):
            raise self.refusals[0]
        what = f"{refused} of {len(self.status)} cells cannot be computed; the first: {self.refusals[0]}"
        warn_caller(what)

    @staticmethod
    def joined_parts(parts: list[ComputedCells]) -> ComputedCells:
        """Return several parts as one, in order."""
        notes = shared_notes(note for part in parts for note in part.notes)

        def joined_field(name: str) -> FloatArray:
            return np.concatenate([getattr(part, name) for part in parts], axis=-1)

        status, trust = joined_field("status").astype(np.int64), joined_field("trust").astype(np.int64)
        refusals = tuple(error for part in parts for error in part.refusals)[:MOST_REFUSALS]
        has_error = all(part.error is not None for part in parts)
        return ComputedCells(
            joined_field("values"),
            status,
            joined_field("gradient"),
            trust,
            joined_field("amplification"),
            notes,
            refusals,
            joined_field("error") if has_error else None,
        )

    @staticmethod
    def refused_cell(asked: Study, *why: InputError) -> ComputedCells:
        """Return one cell that cannot be computed."""
        features, parameters = len(asked.features), len(asked.gradient)
        unknown = np.full((features, parameters, *asked.wheel_shape, 1), np.nan)
        return ComputedCells(
            np.full((features, *asked.wheel_shape, 1), np.nan), np.array([REFUSED]), unknown, np.array([EXACT]),
            np.full(1, np.nan), tuple(Shared(Note(f"cannot be computed: {error}", "refused"), 1) for error in why), why,
            unknown if asked.by_differences else None,
        )  # fmt: skip


def compute_cells(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    from wheeltapper.lower.many import LoweredCells

    cells, on_rails = len(next(iter(changed.values()))), asked.marcher.is_general and not asked.by_differences

    def compute_range(*bounds: int) -> list[ComputedCells]:
        parts = []
        for a, b in pairwise(bounds):
            with counted_from(a, cells):
                parts.append(compute_cells(asked, {path: values[a:b] for path, values in changed.items()}, threads))
        return parts

    slab = SLAB if asked.marcher in run.IN_LANES else SLAB_OF_OBJECTS
    if cells > slab:
        return ComputedCells.joined_parts(compute_range(*range(0, cells, slab), cells))
    try:
        if asked.by_differences:
            from wheeltapper.ask.slopes_of_records import slopes_of_records

            return slopes_of_records(asked, changed, threads)
        if asked.by_records:
            from wheeltapper.ask.by_records import computed_by_records

            return computed_by_records(asked, changed, threads)
        if on_rails:
            from wheeltapper.ask.on_rails import computed_on_rails
            from wheeltapper.ask.sensitivity_on_rails import slopes_on_rails

            return (slopes_on_rails if asked.gradient else computed_on_rails)(asked, changed, threads)
        many = LoweredCells(asked.scenario, changed, asked.method)
        _set_end(asked, many.cells.numbers)
        return _computed_gradients(asked, many, threads) if asked.gradient else _computed_values(asked, many, threads)
    except InputError as error:
        if cells == 1:
            return ComputedCells.refused_cell(asked, error)
    return ComputedCells.joined_parts(
        compute_range(0, cells // 2, cells)
    )  # halving ends with single cells that are refused


def last_events(asked: Study) -> tuple[int, int]:
    """Return the impact, or the impact before a loss, at which the last feature is known; -1 where none tells."""
    if any(feature.until == "end" for feature in asked.features):
        return -1, -1
    impact, loss = (
        max((feature.impacts for feature in asked.features if feature.until == until), default=-1)
        for until in ("impact", "loss")
    )
    return (impact, -1) if impact > loss else (-1, loss)


def _set_end(asked: Study, numbers: FloatArray) -> None:
    """Let each march end as soon as the last feature is known."""
    numbers[:, contract.LAST_IMPACT], numbers[:, contract.LAST_LOSS] = last_events(asked)


def _computed_values(asked: Study, many: LoweredCells, threads: int) -> ComputedCells:
    from wheeltapper.record.trains import Trains, notes_of_cells

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
    run.march_cells(many.to_march, threads, read_block, asked.needs_tally)
    empty = np.empty((len(asked.features), 0, total))
    return ComputedCells(
        values, status, empty, np.zeros(total, dtype=np.int64), np.full(total, np.nan),
        shared_notes((*many.notes, *said)),
    )  # fmt: skip


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


def _computed_gradients(asked: Study, many: LoweredCells, threads: int) -> ComputedCells:
    from wheeltapper.ask.sensitivity import feature_slopes
    from wheeltapper.march.tangent import GRAZING as GENTLE

    found = feature_slopes(many, asked.gradient, asked.features, threads)
    trust = np.where(
        found.gentlest < GENTLE, GRAZING, np.where(found.amplification > asked.chaos_limit, NEAR_CHAOTIC, EXACT)
    )
    return ComputedCells(
        found.values, STATUS_OF_MARCH[found.status], found.gradient, trust, found.amplification,
        shared_notes((*many.notes, *found.notes)),
    )  # fmt: skip
