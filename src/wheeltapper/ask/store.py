"""Studies on disk: a Zarr store that is filled chunk by chunk and records which chunks are complete.

A chunk's features are written first and its status last, each file atomically and with a checksum; computing a chunk
twice writes the same bytes twice. Reading finds chunks that were lost or damaged later.
"""

from __future__ import annotations

import json
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper._version import __version__
from wheeltapper.ask.cells import compute_cells
from wheeltapper.ask.chart import chart_attributes, chart_dataset
from wheeltapper.ask.computed import ComputedCells
from wheeltapper.ask.spec import described_study
from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError, brief
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.notes import Shared
from wheeltapper.record.files.chart_store import (
    FORMAT,
    MISSING,
    THERE,
    check_metadata,
    chunk_places,
    state_of,
    write_checksums,
)
from wheeltapper.record.files.stored import check_format
from wheeltapper.record.labels import CHART_TITLE

EVERY_CHUNK = {"array.write_empty_chunks": True}
"""Zarr setting that writes chunks with nothing but NaN, too. In a store a chunk without a file is one that has not been
computed."""
MOST_CHUNKS = 1_000_000
"""Largest number of chunks of a store. Each chunk has one file for every variable."""
CHUNK_OF_DIFFERENCES = 16
"""Approximate number of cells in a chunk where derivatives are differences, unless the study says otherwise."""

LEADING = ("parameter", "wheelset", "side")
"""Dimensions that come before those of the cells."""
Block = tuple[slice, ...]


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


class Store:
    """A study's store.

    Parameters
    ----------
    path
        Its folder.
    spec
        The specification of the study.
    """

    def __init__(self, path: Path, spec: dict[str, Any]) -> None:
        self.path, self.spec = path, spec
        self.study: Study = described_study(spec)
        self._sizes = chunk_shape(
            self.study.shape, int(spec.get("chunk", _usual_chunk(self.study))), self.study.dear_axes
        )
        together = prod(self._sizes)
        check_room(
            "chunk", f"{together:.4g} cells", 8.0 * self.study.numbers_in_memory(together), "fewer cells in a chunk"
        )
        chunks = prod(-(-n // size) for n, size in zip(self.study.shape, self._sizes, strict=True))
        if chunks > MOST_CHUNKS:
            raise InputError(
                "", "chunk", f"{together} cells, which makes {chunks} chunks",
                f"at most {MOST_CHUNKS} chunks: more cells in each, or fewer in all",
            )  # fmt: skip

    def chunk_cells(self, place: tuple[int, ...]) -> Block:
        """Return the cells of a chunk."""
        both = zip(place, self._sizes, self.study.shape, strict=True)
        return tuple(slice(i * size, min((i + 1) * size, length)) for i, size, length in both)

    def create(self) -> None:
        """Create the store with all its variables, empty. It appears under its path only when complete."""
        import shutil
        import warnings

        import zarr

        begun = self.path.with_name(self.path.name + ".new")
        shutil.rmtree(begun, ignore_errors=True)
        with warnings.catch_warnings(), zarr.config.set(EVERY_CHUNK):
            warnings.simplefilter("ignore")  # texts and consolidated metadata extend Zarr 3; xarray reads them
            self._create(begun)
        begun.rename(self.path)

    def _create(self, path: Path) -> None:
        import zarr
        from zarr.codecs import Crc32cCodec, ZstdCodec

        codecs = (ZstdCodec(), Crc32cCodec())
        one = tuple(slice(0, 1) for _ in self.study.shape)
        template = chart_dataset(self._block_study(one), ComputedCells.refused_cell(self.study))
        shape, sizes = self.study.shape, self._sizes
        leading = {name: len(values) for name, values in template.coords.items() if name in LEADING}
        group = zarr.create_group(path, attributes=self._store_attributes())
        for name, variable in template.variables.items():
            whole = template[str(name)].dims
            if str(name) in template.coords:
                continue
            first = tuple(leading[name] for name in whole if name in leading)
            group.create_array(
                str(name),
                shape=(*first, *shape),
                chunks=(*first, *sizes),
                dtype=variable.dtype,
                fill_value=MISSING if variable.dtype == np.int8 else np.nan,
                dimension_names=[str(dimension) for dimension in whole],
                attributes=_plain_value(variable.attrs),
                compressors=codecs,
            )
        for axis in self.study.axes:
            along_it = axis.path if self.study.grid else "cell"
            group.create_array(
                axis.path,
                data=axis.values,
                dimension_names=(along_it,),
                attributes={"units": axis.unit},
                compressors=codecs,
            )
        for name in leading:
            group.create_array(
                name, data=template[name].values, dimension_names=(name,), compressors=codecs
            )  # fmt: skip
        zarr.consolidate_metadata(path)
        write_checksums(path, (name for name, _ in group.arrays()))

    def _block_study(self, block: Block) -> Study:
        """Return the study of one block of the cells."""
        cut = block if self.study.grid else block * len(self.study.axes)
        axes = tuple(replace(axis, values=axis.values[part]) for axis, part in zip(self.study.axes, cut, strict=True))
        return replace(self.study, axes=axes)

    def _store_attributes(self) -> dict[str, Any]:
        held = chart_attributes(self.study, ())
        held.pop("notes")
        beside = [] if self.study.grid else [axis.path for axis in self.study.axes]
        return held | {"study": json.dumps(self.spec, sort_keys=True), "coordinates": " ".join(beside)}

    def check(self) -> None:
        """Refuse a store that is foreign, damaged, of a newer format, or of another study."""
        import zarr

        try:
            group = zarr.open_group(self.path, mode="r", use_consolidated=False)
            held = dict(group.attrs)
        except Exception as error:  # a damaged store raises undocumented errors in zarr
            raise self._not_whole(f"{type(error).__name__}: {brief(error)}") from error
        if held.get("title") != CHART_TITLE:
            raise InputError(str(self.path), "--output", "a store that wheeltapper did not write", "a new name")
        try:
            check_format(held.get("format", 0), FORMAT)
        except InputError as error:
            raise error.at(str(self.path)) from None
        check_metadata(self.path)
        try:
            names = [name for name, _ in group.arrays()]
        except Exception as error:
            raise self._not_whole(f"{type(error).__name__}: {brief(error)}") from error
        lost = [name for name in self._expected_attributes() if name not in names]
        if lost:
            raise self._not_whole(f"without {lost[0]}")
        if held.get("study") != json.dumps(self.spec, sort_keys=True):
            raise InputError(
                str(self.path), "--resume", "the store of another study", "the study that the store began with"
            )
        if held.get("wheeltapper") != __version__:
            raise InputError(
                str(self.path),
                "--resume",
                f"a store begun by wheeltapper {held.get('wheeltapper')}",
                f"version {__version__}",
            )

    def _not_whole(self, why: str) -> InputError:
        return InputError(
            str(self.path), "--output", f"no whole store ({why})", "a store that wheeltapper sweep began, or a new name"
        )

    def _expected_attributes(self) -> list[str]:
        return ["status", *(feature.name for feature in self.study.features), *(axis.path for axis in self.study.axes)]

    def mend(self) -> None:
        """Remove the remains of an interrupted write, and write again what follows from the study."""
        import zarr

        for left in self.path.rglob("*.partial"):
            left.unlink(missing_ok=True)
        with zarr.config.set(EVERY_CHUNK):
            group = zarr.open_group(self.path, mode="r+", use_consolidated=False)
            known: dict[str, Any] = {axis.path: axis.values for axis in self.study.axes}
            if self.study.gradient:
                known["parameter"] = np.array(self.study.gradient)
            known |= {name: np.array(each) for name, each in self.study.wheel_axes.items()}
            for name, values in known.items():
                array: Any = group[name]
                array[:] = values

    def missing_chunks(self) -> list[tuple[int, ...]]:
        """Return the places of the chunks that are not complete."""
        import zarr

        group = zarr.open_group(self.path, mode="r", use_consolidated=False)
        known = {*LEADING, *(axis.path for axis in self.study.axes)}
        along = {str(name): self._parameter_place(array) for name, array in group.arrays() if name not in known}
        return [
            place
            for place in chunk_places(group["status"])
            if any(state_of(self.path, group, name, (*first, *place)) != THERE for name, first in along.items())
        ]

    def _parameter_place(self, array: Any) -> tuple[int, ...]:
        """Return the first part of the place of a chunk: the place over the parameters, if there are any."""
        return (0,) * (len(array.shape) - len(self.study.shape))

    def write(self, place: tuple[int, ...], threads: int) -> tuple[int, tuple[Shared, ...]]:
        """Compute a chunk and write it, status last; return its number of cells, and notes."""
        import zarr

        block = self.chunk_cells(place)
        found = compute_cells(self.study, self.study.changed_values(block), threads)
        part = chart_dataset(self._block_study(block), found)
        names = [str(name) for name in part.data_vars if name != "status"]
        with zarr.config.set(EVERY_CHUNK):
            group = zarr.open_group(self.path, mode="r+")
            for name in [*names, "status"]:
                array: Any = group[name]
                before = (slice(None),) * (part[name].ndim - len(block))
                array[(*before, *block)] = part[name].values
        return len(found.status), found.notes

    def chunk_ranges(self, place: tuple[int, ...]) -> str:
        """Return the ranges of the varied fields in a chunk."""
        changed = self.study.changed_values(self.chunk_cells(place))
        return ", ".join(
            f"{axis.path} {changed[axis.path].min():g} to {changed[axis.path].max():g}" for axis in self.study.axes
        )


def _plain_value(attrs: dict[str, Any]) -> dict[str, Any]:
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in attrs.items()}
