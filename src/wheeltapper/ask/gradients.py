"""Exact derivatives of features with respect to fields of a scenario, through all impacts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.computed import ComputedCells
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.lower.many import EPSILON

if TYPE_CHECKING:
    from wheeltapper.ask.study import Study
    from wheeltapper.record.features import Feature
    from wheeltapper.record.trains.rates import Along

FloatArray = NDArray[np.float64]


def derivatives(features: tuple[Feature, ...], along: Along) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Return each feature and its derivative along one direction, NaN where it has none."""
    trains = along.tilted(0.0)
    other = along.tilted(1.0) if along.rates.has_gaps or trains.lacks_maxima.any() else None
    for feature in features:
        values = feature(trains)
        if not feature.differentiable:
            yield values.real, np.full(values.shape, np.nan)
            continue
        unknown = np.isnan(values)
        if other is not None:
            unknown |= feature(other).imag != values.imag
        yield values.real, np.where(unknown, np.nan, values.imag / EPSILON)


def unknown_notes(asked: Study, found: ComputedCells) -> Iterator[Shared]:
    """Return notes on features without derivatives."""
    for feature, values, slopes in zip(asked.features, found.values, found.gradient, strict=True):
        lost = np.isnan(slopes) & ~np.isnan(values)
        cells = lost.any(axis=tuple(range(lost.ndim - 1)))
        if not feature.differentiable or not cells.any():
            continue
        by = ", ".join(path for path, own in zip(asked.gradient, lost, strict=True) if own.any())
        text = (
            f"{feature.name} has no derivative by {by} (NaN): it depends on an event whose time has none, at a jump of "
            "the path or where a contact that is still indented loses or regains its force, or on the force at the "
            "start or the end of the run"
        )
        yield Shared(Note(text, f"no derivative of {feature.name}"), int(cells.sum()))
