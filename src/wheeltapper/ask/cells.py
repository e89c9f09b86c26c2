"""Computing the cells of a study: features, their derivatives if asked for, and the status of each cell."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared, shared
from wheeltapper.ground.progress import counting, part, report
from wheeltapper.march import program as contract
from wheeltapper.march import run
from wheeltapper.record.simulate import say_that_it_compiles, warn

if TYPE_CHECKING:
    from wheeltapper.lower.many import Many
    from wheeltapper.march.ensemble import Marched

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLAB = 2**20
"""Largest number of cells that are lowered together. Larger studies are computed slab by slab, which bounds the
memory."""

MOST_REFUSALS = 100
"""Largest number of reasons for refused cells that are kept; further ones are dropped."""

# Status of a cell, in the order of the numbers that a chart stores.
COMPLETE, EVENT_LIMIT, NOT_FINITE, STALLED, END_OF_PATH, REFUSED, UNBALANCED = range(7)
STATUS = ("complete", "event_limit", "not_finite", "stalled", "end_of_path", "refused", "unbalanced")
_OF_MARCH = np.zeros(8, dtype=np.int64)
_OF_MARCH[[contract.TOO_MANY_EVENTS, contract.NOT_FINITE, contract.STALLED, contract.END_OF_PATH]] = (
    EVENT_LIMIT, NOT_FINITE, STALLED, END_OF_PATH,
)  # fmt: skip
# How far a gradient can be trusted.
EXACT, GRAZING, NEAR_CHAOTIC = range(3)
TRUST = ("exact", "grazing", "near_chaotic")


@dataclass(frozen=True)
class Computed:
    """Results of some cells.

    Attributes
    ----------
    values
        (features, cells), SI units; NaN if a cell has too few impacts or could not be computed.
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
    """

    values: FloatArray
    status: IntArray
    gradient: FloatArray
    trust: IntArray
    amplification: FloatArray
    notes: tuple[Shared, ...]
    refusals: tuple[InputError, ...] = ()

    def check(self) -> None:
        """Raise an error if no cell could be computed; warn if some could not."""
        if not self.refusals:
            return
        refused = int((self.status == REFUSED).sum())
        if refused == len(self.status):
            raise self.refusals[0]
        what = f"{refused} of {len(self.status)} cells cannot be computed; the first: {self.refusals[0]}"
        warn(what)

    @staticmethod
    def joined(parts: list[Computed]) -> Computed:
        """Return several parts as one, in order."""
        notes = shared(note for part in parts for note in part.notes)

        def whole(name: str) -> FloatArray:
            return np.concatenate([getattr(part, name) for part in parts], axis=-1)

        status, trust = whole("status").astype(np.int64), whole("trust").astype(np.int64)
        refusals = tuple(error for part in parts for error in part.refusals)[:MOST_REFUSALS]
        return Computed(whole("values"), status, whole("gradient"), trust, whole("amplification"), notes, refusals)

    @staticmethod
    def refused(asked: Study, *why: InputError) -> Computed:
        """Return one cell that cannot be computed."""
        features, parameters = len(asked.features), len(asked.gradient)
        return Computed(
            np.full((features, 1), np.nan), np.array([REFUSED]), np.full((features, parameters, 1), np.nan),
            np.array([EXACT]), np.full(1, np.nan),
            tuple(Shared(Note(f"cannot be computed: {error}", "refused"), 1) for error in why), why,
        )  # fmt: skip


def compute(asked: Study, changed: dict[str, FloatArray], threads: int) -> Computed:
    """Compute some cells of a study: those in which the varied fields have the given values."""
    from wheeltapper.lower.many import Many

    cells = len(next(iter(changed.values())))

    def some(*bounds: int) -> list[Computed]:
        parts = []
        for a, b in pairwise(bounds):
            with part(a, cells):
                parts.append(compute(asked, {path: values[a:b] for path, values in changed.items()}, threads))
        return parts

    if cells > SLAB:
        return Computed.joined(some(*range(0, cells, SLAB), cells))
    try:
        many = Many(asked.scenario, changed, asked.method)
        _set_end(asked, many.cells.numbers)
        found = _sloped(asked, many, threads) if asked.gradient else _marched(asked, many, threads)
        if asked.check:
            _check_energy(many, found.status)
        return found
    except InputError as error:
        if cells == 1:
            return Computed.refused(asked, error)
    return Computed.joined(some(0, cells // 2, cells))  # halving ends with single cells that are refused


def is_ready(asked: Study) -> bool:
    """Return False if computing this study begins with compiling."""
    from wheeltapper.ask import sensitivity
    from wheeltapper.lower.many import Many

    first = asked.changed(tuple(slice(0, 1) for _ in asked.shape))
    try:
        many = Many(asked.scenario, first, asked.method)
    except InputError:
        return True  # not known yet; the first chunk will compile
    if asked.gradient:
        return sensitivity.is_ready(many, asked.gradient, asked.tally)
    return run.cells_are_ready(many.cells, asked.tally)


def _set_end(asked: Study, numbers: FloatArray) -> None:
    """Let each march end as soon as the last feature is known."""
    if any(feature.until == "end" for feature in asked.features):
        return
    impact, loss = (
        max((feature.impacts for feature in asked.features if feature.until == until), default=-1)
        for until in ("impact", "loss")
    )
    if impact > loss:
        numbers[:, contract.LAST_IMPACT] = impact
    else:
        numbers[:, contract.LAST_LOSS] = loss


def _marched(asked: Study, many: Many, threads: int) -> Computed:
    from wheeltapper.record.trains import Trains

    if not run.cells_are_ready(many.cells, asked.tally):
        say_that_it_compiles()
    total = len(many.cells.first)
    values, status = np.empty((len(asked.features), total)), np.empty(total, dtype=np.int64)

    def read(block: slice, marched: Marched) -> None:
        trains = Trains(marched, many.units.part(block))
        for row, feature in zip(values, asked.features, strict=True):
            row[block] = feature(trains)
        status[block] = _OF_MARCH[marched.status]
        count(block.stop - block.start)

    count = counting("cells", total)
    run.march_cells(many.cells, threads, read, asked.tally)
    empty = np.empty((len(asked.features), 0, total))
    return Computed(values, status, empty, np.zeros(total, dtype=np.int64), np.full(total, np.nan), many.notes)


def _check_energy(many: Many, status: IntArray) -> None:
    """Mark the complete cells whose work and energy do not balance."""
    from wheeltapper.record import balanced

    cells = np.flatnonzero(status == COMPLETE).tolist()
    for done, cell in enumerate(cells):
        report("checking the energy", done, len(cells))
        program = many.program(cell)
        if not balanced.missing_part(program, run.march(program)) <= balanced.LIMIT:
            status[cell] = UNBALANCED


def _sloped(asked: Study, many: Many, threads: int) -> Computed:
    from wheeltapper.ask.sensitivity import slopes
    from wheeltapper.march.tangent import GRAZING as GENTLE

    found = slopes(many, asked.gradient, asked.features, threads)
    trust = np.where(
        found.gentlest < GENTLE, GRAZING, np.where(found.amplification > asked.chaos_limit, NEAR_CHAOTIC, EXACT)
    )
    return Computed(found.values, _OF_MARCH[found.status], found.gradient, trust, found.amplification, many.notes)
