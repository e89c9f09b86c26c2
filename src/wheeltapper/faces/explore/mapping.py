"""The map of a feature over two fields, filled in tile by tile, then the arrows of its gradient."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.cells import compute_cells
from wheeltapper.ask.computed import EXACT, STATUS, ComputedCells
from wheeltapper.ask.study import Study, study_of
from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.explore.frames import Frame
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.march.common.blocks import core_count
from wheeltapper.record.features import Feature

FloatArray = NDArray[np.float64]
LARGEST = 256
"""Most cells along an axis of a map."""
FIRST_TILE, PATIENCE = 64, 0.05
"""Cells of the first tile; the next ones are larger as long as they take less than so many seconds."""
ARROWS = 14
"""Arrows along each axis, about."""


@dataclass
class Asked:
    """A map that a page asks for.

    Attributes
    ----------
    number
        By which the page knows its tiles.
    scene
        What all cells share.
    x, y
        Path, lowest and highest value of the two fields, in SI units.
    """

    number: int
    scene: Scenario
    feature: str
    x: tuple[str, float, float]
    y: tuple[str, float, float]
    size: int

    @classmethod
    def of(cls, message: dict[str, Any], scene: Scenario) -> Asked:
        """Return what a message asks.

        Raises
        ------
        InputError
            If it is no map of two fields.
        """
        size = message.get("size")
        if not isinstance(size, int) or not 2 <= size <= LARGEST:
            raise InputError("", "map", f"{value_text(size)} cells along an axis", f"2 to {LARGEST}")
        x, y = (_axis(message.get(name), name) for name in ("x", "y"))
        if x[0] == y[0]:
            raise InputError("", "map", f"{x[0]} along both axes", "two fields")
        return cls(int(message.get("number", 0)), scene, str(message.get("feature")), x, y, size)

    def values(self, of: tuple[str, float, float], count: int) -> FloatArray:
        """Return the middles of the cells along an axis."""
        _, low, high = of
        return low + (high - low) * (np.arange(count) + 0.5) / count


def _axis(given: Any, name: str) -> tuple[str, float, float]:
    try:
        path, low, high = str(given["path"]), float(given["low"]), float(given["high"])
    except (KeyError, TypeError, ValueError):
        raise InputError("", f"map.{name}", value_text(given), "a field, its lowest and its highest value") from None
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise InputError("", path, f"{low:g} to {high:g}", "two numbers, the lower one first")
    return path, low, high


@dataclass
class Map:
    """A map that is filled, tile by tile.

    Attributes
    ----------
    study, found
        What is computed and what of it is known, as `wheeltapper.sweep` has them.
    """

    asked: Asked
    study: Study = field(init=False)
    found: list[ComputedCells] = field(default_factory=list)

    def __post_init__(self) -> None:
        asked = self.asked
        over = {of[0]: asked.values(of, asked.size) for of in (asked.y, asked.x)}
        self.study = study_of(asked.scene, over, asked.feature)

    def frames(self, is_stale: Callable[[], bool]) -> Iterator[Frame]:
        """Yield the beginning, the tiles and the arrows of the map; nothing more once something newer is asked."""
        asked, feature = self.asked, self.study.features[0]
        frame = Frame(
            "map", number=asked.number, size=asked.size, feature=feature.name, unit=feature.unit,
            definition=feature.definition, x=list(asked.x), y=list(asked.y),
        )  # fmt: skip
        yield frame
        tile, done = FIRST_TILE, 0
        while done < asked.size**2:
            if is_stale():
                return
            begin = time.perf_counter()
            rows, columns = self._tile(done, tile)
            found = compute_cells(self.study, self.study.changed_values((rows, columns)), core_count())
            self.found.append(found)
            done += len(found.status)
            out = Frame("map tile", number=asked.number, rows=[rows.start, rows.stop], done=done)
            out.head |= {
                "columns": [columns.start, columns.stop], "values": out.array(_largest(found.values)[0]),
                "wrong": sorted({STATUS[s].replace("_", " ") for s in found.status.tolist() if s}),
                "refusal": str(found.refusals[0]) if found.refusals else "",
            }  # fmt: skip
            yield out
            tile = 2 * tile if time.perf_counter() - begin < PATIENCE else tile
        yield from self._arrows(feature, is_stale)

    def _tile(self, done: int, wished: int) -> tuple[slice, slice]:
        """Return the next cells: whole rows, or a part of one."""
        size = self.asked.size
        row, column = divmod(done, size)
        if column or wished < size:
            return slice(row, row + 1), slice(column, min(size, column + max(1, wished)))
        return slice(row, min(size, row + wished // size)), slice(0, size)

    def _arrows(self, feature: Feature, is_stale: Callable[[], bool]) -> Iterator[Frame]:
        """Yield the gradient at some cells, per whole width of each axis, or a line that says why there is none."""
        asked = self.asked
        if not feature.differentiable:
            yield Frame("map arrows", number=asked.number, line="no arrows: what is counted has no gradient")
            return
        step = -(-asked.size // ARROWS)
        middle = slice(step // 2, None, step)
        over = {of[0]: asked.values(of, asked.size)[middle] for of in (asked.y, asked.x)}
        try:
            study = study_of(asked.scene, over, feature, gradient=True)
            if study.by_differences or is_stale():
                return
            found = compute_cells(study, study.changed_values(), core_count())
        except InputError as error:
            yield Frame("map arrows", number=asked.number, line=f"no arrows: {error}")
            return
        slopes = _largest(found.values, found.gradient)[1] * np.array(
            [[of[2] - of[1]] for of in (asked.y, asked.x)]
        )  # (parameters, cells), by the axes' widths
        trusted = (found.trust == EXACT) & np.isfinite(slopes).all(axis=0)
        up, across = (place.ravel() for place in np.meshgrid(*over.values(), indexing="ij"))
        frame = Frame("map arrows", number=asked.number, left=int((~trusted).sum()), line="")
        frame.head |= {
            "x": frame.array(across[trusted]), "y": frame.array(up[trusted]),
            "by_x": frame.array(slopes[1][trusted]), "by_y": frame.array(slopes[0][trusted]),
        }  # fmt: skip
        yield frame

    def chart(self) -> Any:
        """Return the whole map as `wheeltapper.sweep` returns it.

        Raises
        ------
        InputError
            If it is not filled.
        """
        from wheeltapper.ask.chart import chart_dataset

        if sum(len(part.status) for part in self.found) < self.study.cell_count or len(self.found) == 0:
            raise InputError("", "map", "a map that is not filled", "a filled map")
        return chart_dataset(self.study, ComputedCells.joined_parts(self.found))


def _largest(values: FloatArray, slopes: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Return a feature over the cells, of several wheels that of the one where it is largest, and its slopes."""
    each = values[0].reshape(-1, values.shape[-1])
    known = np.where(np.isnan(each), -np.inf, each)
    chosen, cells = known.argmax(axis=0), np.arange(each.shape[1])
    found = each[chosen, cells]
    if slopes is None:
        return found, found[None]
    by = slopes[0].reshape(slopes.shape[1], -1, slopes.shape[-1])
    return found, by[:, chosen, cells]
