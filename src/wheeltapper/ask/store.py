"""Studies on disk."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.cells import compute_cells
from wheeltapper.ask.chart import chart_attributes, chart_dataset
from wheeltapper.ask.computed import ComputedCells
from wheeltapper.ask.filled import Block, FilledStore
from wheeltapper.ask.spec import described_study
from wheeltapper.ask.study import Study
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.notes import Shared
from wheeltapper.record.files.filled import CHART, Place

if TYPE_CHECKING:
    import xarray as xr

CHUNK_OF_DIFFERENCES = 16
"""Approximate number of cells in a chunk where derivatives are differences, unless the study says otherwise."""


def chunk_shape(shape: tuple[int, ...], cells: int, dear: tuple[int, ...] = ()) -> tuple[int, ...]:
    """Return the shape of a chunk: whole rows of the last axes as long as they fit, of `dear` axes after all others."""
    left, out = cells, [1] * len(shape)
    for axis in sorted(range(len(shape)), key=lambda axis: (axis in dear, -axis)):
        out[axis] = max(1, min(shape[axis], left))
        left //= out[axis]
    return tuple(out)


def _usual_chunk(study: Study) -> int:
    """Return how many cells a chunk has where none is said: some seconds of work."""
    return CHUNK_OF_DIFFERENCES if study.by_differences else study.cells.chunk


class Store(FilledStore):
    """The store of a study, a chart.

    Parameters
    ----------
    path
        Its folder.
    spec
        The specification of the study.
    """

    kind = CHART

    def __init__(self, path: Path, spec: dict[str, Any]) -> None:
        self.study: Study = described_study(spec)
        sizes = chunk_shape(self.study.shape, int(spec.get("chunk", _usual_chunk(self.study))), self.study.dear_axes)
        together = prod(sizes)
        check_room(
            "chunk", f"{together:.4g} cells", 8.0 * self.study.numbers_in_memory(together), "fewer cells in a chunk"
        )
        super().__init__(path, spec, self.study.shape, sizes)

    def variables(self) -> xr.Dataset:
        """Return one cell with all its variables."""
        one = tuple(slice(0, 1) for _ in self.shape)
        return chart_dataset(self._block_study(one), ComputedCells.refused_cell(self.study))

    def axes(self) -> dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]]:
        """Return the values of the varied fields, and the names of what comes before the cells."""
        study = self.study
        known: dict[str, Any] = {
            axis.path: ((axis.path if study.grid else "cell",), axis.values, {"units": axis.unit})
            for axis in study.axes
        }
        if study.gradient:
            known["parameter"] = (("parameter",), np.array(study.gradient), {})
        return known | {name: ((name,), np.array(each), {}) for name, each in study.wheel_axes.items()}

    def attributes(self) -> dict[str, Any]:
        """Return the attributes of a chart."""
        held = chart_attributes(self.study, ())
        held.pop("notes")
        beside = [] if self.study.grid else [axis.path for axis in self.study.axes]
        return held | {"coordinates": " ".join(beside)}

    def computed(self, block: Block, threads: int) -> tuple[xr.Dataset, tuple[Shared, ...]]:
        """Compute the cells of a block."""
        found = compute_cells(self.study, self.study.changed_values(block), threads)
        return chart_dataset(self._block_study(block), found), found.notes

    def compile_first(self) -> None:
        """Compute the cell in the corner."""
        corner = self.study.changed_values(tuple(slice(0, 1) for _ in self.shape))
        with suppress(Exception):  # it is said with the chunk
            compute_cells(self.study, {path: values[:1] for path, values in corner.items()}, 1)

    def described(self, place: Place) -> str:
        """Return the ranges of the varied fields in a chunk."""
        changed = self.study.changed_values(self.block(place))
        return ", ".join(
            f"{axis.path} {changed[axis.path].min():g} to {changed[axis.path].max():g}" for axis in self.study.axes
        )

    def _block_study(self, block: Block) -> Study:
        """Return the study of one block of the cells."""
        cut = block if self.study.grid else block * len(self.study.axes)
        axes = tuple(replace(axis, values=axis.values[part]) for axis, part in zip(self.study.axes, cut, strict=True))
        return replace(self.study, axes=axes)
