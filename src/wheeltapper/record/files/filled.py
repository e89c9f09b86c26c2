"""Reading filled stores from disk: which of their chunks exist, and whether they are undamaged."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from zlib import crc32

import numpy as np

from wheeltapper.ground.errors import InputError, brief
from wheeltapper.record.files.stored import check_format
from wheeltapper.record.labels import CHART_TITLE, DATASET_TITLE

if TYPE_CHECKING:
    import xarray as xr

MISSING = -1
"""Status of what has not been computed."""


class Filled(NamedTuple):
    """A kind of store.

    Attributes
    ----------
    title, format
        As its attributes say them.
    what, things
        What it is computed from, and what it holds: "study", "cells".
    command
        The command that fills it.
    """

    title: str
    format: int
    what: str
    things: str
    command: str


CHART = Filled(CHART_TITLE, 2, "study", "cells", "wheeltapper sweep")
"""Charts. Since version 2 every chunk has a file with a checksum, also where it has no values."""
DATASET = Filled(DATASET_TITLE, 1, "data set", "passages", "wheeltapper dataset")
KINDS = {kind.title: kind for kind in (CHART, DATASET)}
FILLED = "a store filled by " + " or ".join(kind.command for kind in KINDS.values())
"""What a store must be, for messages."""
WHOLE = "a whole store, as it was begun"
"""The same, of one that is damaged where resuming does not mend it."""
THERE, ABSENT, DAMAGED = range(3)
"""States of a chunk: its file is sound, there is none, or it is damaged."""
Place = tuple[int, ...]
METADATA, CHECKSUMS = "zarr.json", "status/checksums.json"
"""File with the metadata of a variable, or of the whole store, and that with checksums of all of them. It is below a
variable because Zarr warns of unknown files beside them, and no attribute because a copy of a chart has those, too. A
store without it is read without."""


def metadata_checksums(path: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the CRC-32 of the metadata of a store, by the name "", and of its variables; "" where there is none."""
    out = {}
    for name in ("", *sorted(names)):
        try:
            held = json.loads(path.joinpath(name, METADATA).read_bytes())
        except (OSError, ValueError, RecursionError):
            out[name] = ""
        else:
            out[name] = f"{crc32(json.dumps(held, sort_keys=True).encode()):08x}"
    return out


def write_checksums(path: Path, names: Iterable[str]) -> None:
    """Write the checksums of the metadata of a store that has all its variables."""
    (path / CHECKSUMS).write_text(json.dumps(metadata_checksums(path, names), indent=1), encoding="utf-8")


def check_metadata(path: Path) -> None:
    """Refuse a store with other metadata than it was begun with."""
    for file in path.glob(f"*/{Path(CHECKSUMS).name}"):
        try:
            expected = {str(name): str(held) for name, held in json.loads(file.read_bytes()).items()}
        except (OSError, ValueError, AttributeError, RecursionError):
            raise InputError(str(path), CHECKSUMS, "no readable checksums", WHOLE) from None
        found = metadata_checksums(path, expected.keys() - {""})
        for name in sorted(expected, reverse=True):  # the store's own last: it repeats those of its variables
            if found.get(name) != expected[name]:
                what = "other metadata than it was begun with" if found.get(name) else "no readable metadata"
                raise InputError(str(path), name or METADATA, what, WHOLE)


def chunk_places(array: Any) -> Iterator[Place]:
    """Return the places of an array's chunks."""
    both = zip(array.shape, array.chunks, strict=True)
    return itertools.product(*(range(-(-length // size)) for length, size in both))


def chunk_file(path: Path, name: str, place: Place) -> Path:
    """Return the file of a chunk of an array in a store."""
    return path.joinpath(name, "c", *map(str, place))


def state_of(path: Path, group: Any, name: str, place: Place) -> int:
    """Return whether a chunk is complete, absent, or damaged, by reading it."""
    if not chunk_file(path, name, place).exists():
        return ABSENT
    try:
        group[name].get_block_selection(place)
    except Exception:  # codecs raise various errors for damaged bytes
        return DAMAGED
    return THERE


def load_filled(path: Path) -> xr.Dataset:
    """Return the chart or data set in a store; what is not computed has the status -1, and a warning counts it.

    Raises
    ------
    InputError
        If it is neither, one of a newer format, or damaged.
    """
    import xarray as xr
    import zarr

    from wheeltapper.ground.warned import warn_caller

    try:
        group = zarr.open_group(path, mode="r", use_consolidated=False)
        held = dict(group.attrs)
    except Exception as error:  # a damaged store raises undocumented errors in zarr and xarray
        raise _unreadable_error(path, error) from error
    kind = KINDS.get(str(held.get("title")))
    if kind is None:
        raise InputError(str(path), "", "a store that wheeltapper did not write", FILLED)
    version = check_format(held.get("format", 0), kind.format)
    check_metadata(path)
    try:
        arrays: dict[str, Any] = dict(group.arrays())
    except Exception as error:
        raise _unreadable_error(path, error) from error
    if "status" not in arrays:
        raise InputError(str(path), "", "a store that wheeltapper did not write", FILLED)
    absent = list(_absent_blocks(path, group, arrays, version, kind))
    held_there: xr.Dataset = xr.open_zarr(path, consolidated=False)
    status = np.array(held_there.status.values)
    for block in absent:
        status[block] = MISSING
    missing = int((status == MISSING).sum())
    if missing:
        text = f"{missing} of {status.size} {kind.things} are not computed; {kind.command} --resume computes them"
        warn_caller(f"{path}: {text}")
    found: xr.Dataset = held_there.assign(status=held_there.status.copy(data=status))
    return found


def _absent_blocks(
    path: Path, group: Any, arrays: dict[str, Any], version: int, kind: Filled
) -> Iterator[tuple[slice, ...]]:
    """Return the blocks of things with an absent chunk; refuse a store with a damaged one.

    Format 1 of charts left out chunks with nothing but NaN, and axes with nothing but zeros. So does a copy by xarray,
    in which a status that is not there is zero.
    """
    is_copy = int(arrays["status"].fill_value) != MISSING
    along = arrays["status"].metadata.dimension_names
    axes = {*along, *str(group.attrs.get("coordinates", "")).split(), "parameter", "wheelset", "side"}
    for name, array in arrays.items():
        for place in chunk_places(array):
            state = state_of(path, group, name, place)
            if state == ABSENT and is_copy:
                continue
            if state == DAMAGED or (state == ABSENT and name in axes and version > 1):
                raise _damaged_error(path, name, place, state, kind)
            if state == ABSENT and name not in axes and (version > 1 or name == "status"):
                held = dict(zip(array.metadata.dimension_names, _chunk_values(array, place), strict=True))
                yield tuple(held[dimension] for dimension in along)


def _unreadable_error(path: Path, error: Exception) -> InputError:
    return InputError(str(path), "", f"no readable store ({brief(error)})", FILLED)


def _damaged_error(path: Path, name: str, place: Place, state: int, kind: Filled) -> InputError:
    what = "no" if state == ABSENT else "a damaged"
    return InputError(
        str(path), name, f"{what} chunk {'/'.join(map(str, place))}",
        f"a whole store; {kind.command} --resume computes again what is not",
    )  # fmt: skip


def _chunk_values(array: Any, place: Place) -> tuple[slice, ...]:
    """Return the values of an array in a chunk."""
    return tuple(slice(i * size, (i + 1) * size) for i, size in zip(place, array.chunks, strict=True))
