"""Derivatives of features by differences of runs finer than strict ones, where a march has no tangents.

A run with its own step control is a smooth function of each field, down to rounding, as long as the same happens in it
in the same order. Where it does not, there is no derivative, and a note says so (docs/decisions/0034 and 0039).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask import computed as status_of
from wheeltapper.ask.computed import ComputedCells
from wheeltapper.ask.differences import Slope, slope_at
from wheeltapper.ask.finer import FinerRun, finer_run, gentlest_and_growth
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.progress import progress_counter
from wheeltapper.lower.fields import Fields
from wheeltapper.record.simulate import side_by_side

if TYPE_CHECKING:
    from wheeltapper.ask.study import Study
    from wheeltapper.record.features import Feature
    from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
OTHER_ORDER = (
    "even for a tiny change other events happen in the run, or in another order (losses, impacts, onsets of yield, "
    "stops and corners of elements, friction that slips or sticks, voids that close)"
)
CORNER = "the slopes below and above this value differ"
"""Why there is no derivative."""


def gradient_by_differences(
    asked: Study, changed: dict[str, FloatArray], plain: ComputedCells, threads: int
) -> ComputedCells:  # fmt: skip
    """Return some cells of a study with derivatives; `plain` is what was computed of them without."""
    wheels, cells = asked.wheel_shape, len(plain.status)
    gradient = np.full((len(asked.features), len(asked.gradient), *wheels, cells), np.nan)
    error, trust, growth = gradient.copy(), plain.trust.copy(), plain.amplification.copy()
    whole = [int(cell) for cell in np.flatnonzero(plain.status == status_of.COMPLETE)]
    scenarios = {
        cell: asked.scenario.replaced({path: float(values[cell]) for path, values in changed.items()}) for cell in whole
    }
    smooth = tuple(feature for feature in asked.features if feature.differentiable)
    rows = [row for row, feature in enumerate(asked.features) if feature.differentiable]

    def read(record: Record) -> FloatArray:
        return np.array([feature(record).values for feature in smooth])

    bases, missing = dict[int, FinerRun](), list[tuple[int, int, str, int]]()

    def begin(cell: int) -> None:
        bases[cell] = finer_run(scenarios[cell], read)
        gentlest, growth[cell] = gentlest_and_growth(bases[cell])
        trust[cell] = status_of.trust_of(gentlest, growth[cell], asked.chaos_limit)

    def differentiate(task: tuple[int, int]) -> None:
        cell, number = task
        base, path = bases[cell], asked.gradient[number]

        def beside(value: float) -> FloatArray | None:
            found = finer_run(scenarios[cell].replaced({path: value}), read)
            return found.values if found.happened == base.happened else None

        slope = slope_at(beside, base.values, float(Fields(scenarios[cell])(path)))
        gradient[rows, number, ..., cell], error[rows, number, ..., cell] = slope.value, slope.error
        lost = np.isnan(slope.value) & ~np.isnan(base.values)
        if lost.any():
            trust[cell] = status_of.NOT_DIFFERENTIABLE
            missing.extend((cell, *which, number) for which in _reasons(lost, slope))

    if smooth:
        count = progress_counter("derivatives", len(whole) * (1 + len(asked.gradient)))
        side_by_side(begin, whole, threads, lambda: count(1))
        tasks = [(cell, number) for cell in whole for number in range(len(asked.gradient))]
        side_by_side(differentiate, tasks, threads, lambda: count(1))
    shared = shared_notes((*plain.notes, *(Shared(note, 1) for note in _missing_notes(asked, smooth, missing))))
    return replace(plain, gradient=gradient, error=error, trust=trust, amplification=growth, notes=shared)


def _reasons(lost: NDArray[np.bool_], slope: Slope) -> list[tuple[int, str]]:
    """Return the features without a derivative, by number, with the reason."""
    rows = [row for row in range(len(lost)) if lost[row].any()]
    other = f"it cannot be changed: {slope.refusal}" if slope.refusal else OTHER_ORDER
    return [(row, CORNER if slope.at_corner[row][lost[row]].any() else other) for row in rows]


def _missing_notes(asked: Study, features: tuple[Feature, ...], missing: list[tuple[int, int, str, int]]) -> list[Note]:
    """Return notes on what has no derivative, from (cell, feature, reason, field): one for each of the first three."""
    out = []
    for (_, row, why), group in groupby(sorted(missing), key=lambda one: one[:3]):
        name, paths = features[row].name, ", ".join(asked.gradient[one[3]] for one in group)
        out.append(Note(f"{name} has no derivative by {paths} (NaN): {why}", f"no derivative of {name}"))
    return out
