"""Zarr stores that are filled chunk by chunk and record which chunks are complete.

A chunk's values are written first and its status last, each file atomically and with a checksum; computing a chunk
twice writes the same bytes twice. Reading finds chunks that were lost or damaged later.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from functools import cached_property
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ground.errors import InputError, brief
from wheeltapper.ground.notes import Shared
from wheeltapper.record.files.filled import (
    MISSING,
    THERE,
    Filled,
    Place,
    check_metadata,
    chunk_places,
    state_of,
    write_checksums,
)
from wheeltapper.record.files.stored import check_format

if TYPE_CHECKING:
    import xarray as xr

EVERY_CHUNK = {"array.write_empty_chunks": True}
"""Zarr setting that writes chunks with nothing but NaN, too. In a store a chunk without a file is one that has not been
computed."""
MOST_CHUNKS = 1_000_000
"""Largest number of chunks of a store. Each chunk has one file for every variable."""
Block = tuple[slice, ...]


class FilledStore(ABC):
    """A store of things that are computed one by one, and of which each has a status.

    Parameters
    ----------
    path
        Its folder.
    spec
        What is computed, as a table for JSON.
    shape, sizes
        Numbers of things along the dimensions of the status, and those in a chunk.
    """

    kind: ClassVar[Filled]
    """What the things are, and which command fills the store."""

    def __init__(self, path: Path, spec: dict[str, Any], shape: tuple[int, ...], sizes: tuple[int, ...]) -> None:
        self.path, self.spec, self.shape, self.sizes = path, spec, shape, sizes
        chunks = prod(-(-n // size) for n, size in zip(shape, sizes, strict=True))
        if chunks > MOST_CHUNKS:
            raise InputError(
                "", "chunk", f"{prod(sizes)} {self.kind.things}, which makes {chunks} chunks",
                f"at most {MOST_CHUNKS} chunks: more {self.kind.things} in each, or fewer in all",
            )  # fmt: skip

    @abstractmethod
    def variables(self) -> xr.Dataset:
        """Return one thing with all its variables, of which the first is not yet computed."""

    @abstractmethod
    def axes(self) -> dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]]:
        """Return what is known before anything is computed: dimensions, values and attributes by name."""

    @abstractmethod
    def attributes(self) -> dict[str, Any]:
        """Return the attributes of the whole store, which JSON takes."""

    @abstractmethod
    def computed(self, block: Block, threads: int) -> tuple[xr.Dataset, tuple[Shared, ...]]:
        """Compute the things of a block, with their status; return them, and notes."""

    @abstractmethod
    def compile_first(self) -> None:
        """Compute one thing, so that kernels are compiled, and told of, before all workers ask for them."""

    @abstractmethod
    def described(self, place: Place) -> str:
        """Return which things are in a chunk, for messages."""

    @cached_property
    def _template(self) -> xr.Dataset:
        return self.variables()

    def _place_in(self, name: str, place: Place) -> Place:
        """Return the place of a variable's chunk that holds what is in a chunk of the status."""
        own = dict(zip(self._template["status"].dims, place, strict=True))
        return tuple(own.get(dimension, 0) for dimension in self._template[name].dims)

    @property
    def count(self) -> int:
        """The number of all things."""
        return prod(self.shape)

    def block(self, place: Place) -> Block:
        """Return which things are in a chunk."""
        both = zip(place, self.sizes, self.shape, strict=True)
        return tuple(slice(i * size, min((i + 1) * size, length)) for i, size, length in both)

    def count_in(self, place: Place) -> int:
        """Return how many things are in a chunk."""
        return prod(part.stop - part.start for part in self.block(place))

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
        template = self._template
        along = dict(zip(map(str, template["status"].dims), zip(self.shape, self.sizes, strict=True), strict=True))
        named = {"study": json.dumps(self.spec, sort_keys=True)}
        group = zarr.create_group(path, attributes=self.attributes() | named)
        for name, variable in template.data_vars.items():
            dimensions = [str(dimension) for dimension in variable.dims]
            sizes = [along.get(dimension, 2 * (template.sizes[dimension],)) for dimension in dimensions]
            group.create_array(
                str(name),
                shape=tuple(whole for whole, _ in sizes),
                chunks=tuple(part for _, part in sizes),
                dtype=variable.dtype,
                fill_value=np.nan if variable.dtype.kind == "f" else MISSING,
                dimension_names=dimensions,
                attributes=_plain_value(variable.attrs),
                compressors=codecs,
            )
        for name, (over, values, attrs) in self.axes().items():
            group.create_array(name, data=values, dimension_names=over, attributes=attrs, compressors=codecs)
        zarr.consolidate_metadata(path)
        write_checksums(path, (name for name, _ in group.arrays()))

    def check(self) -> None:
        """Refuse a store that is foreign, damaged, of a newer format, or of another study."""
        import zarr

        try:
            group = zarr.open_group(self.path, mode="r", use_consolidated=False)
            held = dict(group.attrs)
        except Exception as error:  # a damaged store raises undocumented errors in zarr
            raise self._not_whole(f"{type(error).__name__}: {brief(error)}") from error
        if held.get("title") != self.kind.title:
            raise InputError(str(self.path), "--output", "a store that wheeltapper did not write", "a new name")
        try:
            check_format(held.get("format", 0), self.kind.format)
        except InputError as error:
            raise error.at(str(self.path)) from None
        check_metadata(self.path)
        try:
            names = [name for name, _ in group.arrays()]
        except Exception as error:
            raise self._not_whole(f"{type(error).__name__}: {brief(error)}") from error
        lost = [name for name in ("status", *map(str, self._template.data_vars), *self.axes()) if name not in names]
        if lost:
            raise self._not_whole(f"without {lost[0]}")
        if held.get("study") != json.dumps(self.spec, sort_keys=True):
            what = self.kind.what
            raise InputError(
                str(self.path), "--resume", f"the store of another {what}", f"the {what} that the store began with"
            )
        if held.get("wheeltapper") != __version__:
            raise InputError(
                str(self.path),
                "--resume",
                f"a store begun by wheeltapper {held.get('wheeltapper')}",
                f"version {__version__}",
            )

    def _not_whole(self, why: str) -> InputError:
        allowed = f"a store that {self.kind.command} began, or a new name"
        return InputError(str(self.path), "--output", f"no whole store ({why})", allowed)

    def mend(self) -> None:
        """Remove the remains of an interrupted write, and write again what is known before anything is computed."""
        import zarr

        for left in self.path.rglob("*.partial"):
            left.unlink(missing_ok=True)
        with zarr.config.set(EVERY_CHUNK):
            group = zarr.open_group(self.path, mode="r+", use_consolidated=False)
            for name, (_, values, _) in self.axes().items():
                array: Any = group[name]
                array[:] = values

    def missing_chunks(self) -> list[Place]:
        """Return the places of the chunks that are not complete."""
        import zarr

        group = zarr.open_group(self.path, mode="r", use_consolidated=False)
        names = [*map(str, self._template.data_vars)]
        return [
            place
            for place in chunk_places(group["status"])
            if any(state_of(self.path, group, name, self._place_in(name, place)) != THERE for name in names)
        ]

    def write(self, place: Place, threads: int) -> tuple[Shared, ...]:
        """Compute a chunk and write it, status last; return notes."""
        import zarr

        part, notes = self.computed(self.block(place), threads)
        names = [str(name) for name in part.data_vars if name != "status"]
        with zarr.config.set(EVERY_CHUNK):
            group = zarr.open_group(self.path, mode="r+")
            for name in [*names, "status"]:
                array: Any = group[name]
                array.set_block_selection(self._place_in(name, place), part[name].values)
        return notes


def _plain_value(attrs: dict[str, Any]) -> dict[str, Any]:
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in attrs.items()}
