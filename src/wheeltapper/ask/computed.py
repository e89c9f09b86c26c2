"""What is computed of cells: features, their derivatives, and the status and trust of each cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.warned import warn_caller
from wheeltapper.record.outcomes import OUTCOMES

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST_REFUSALS = 100
"""Largest number of reasons for refused cells that are kept; further ones are dropped."""

STATUS = (
    "complete", "event_limit", "not_finite", "stalled", "end_of_path", "refused", "chattering", "unsolved",
    "derailed", "unbalanced", "out_of_memory",
)  # fmt: skip
"""Status of a cell, in the order of the numbers that a chart stores: outcomes of records, or "refused"."""
COMPLETE, REFUSED = 0, STATUS.index("refused")
STATUS_OF_MARCH = np.full(128, COMPLETE)
"""Status of a cell by that of its march."""
for _status, _outcome in OUTCOMES.items():
    STATUS_OF_MARCH[_status] = COMPLETE if _outcome is Outcome.COMPLETED else STATUS.index(_outcome.name.lower())
# How far a gradient can be trusted.
EXACT, GRAZING, NEAR_CHAOTIC, NOT_DIFFERENTIABLE = range(4)
GENTLE = 1e-3
"""Scaled rate of indentation at a loss or an impact, or distance of the motion from u = w = 0, below which a derivative
means nothing; where Hunt and Crossley's force ends or begins while indented, the rate at which that rate passes its
limit. The unit is the static indentation over the time in which a wheelset on its contacts turns by one radian."""
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
    def unknown(asked: Study, cells: int) -> ComputedCells:
        """Return cells that have not been computed yet: all NaN."""
        shape = *asked.wheel_shape, cells
        return ComputedCells(
            np.full((len(asked.features), *shape), np.nan), np.zeros(cells, dtype=np.int64),
            np.full((len(asked.features), len(asked.gradient), *shape), np.nan), np.zeros(cells, dtype=np.int64),
            np.full(cells, np.nan), (),
        )  # fmt: skip

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
        one = ComputedCells.unknown(asked, 1)
        one.status[:] = REFUSED
        notes = (Shared(Note(f"cannot be computed: {error}", "refused"), 1) for error in why)
        return replace(one, notes=tuple(notes), refusals=why, error=one.gradient if asked.by_differences else None)


def trust_of(gentlest: Any, amplification: Any, chaos_limit: float) -> IntArray:
    """Return how far gradients can be trusted, by their gentlest events and the growth of small changes."""
    return np.where(gentlest < GENTLE, GRAZING, np.where(amplification > chaos_limit, NEAR_CHAOTIC, EXACT))
