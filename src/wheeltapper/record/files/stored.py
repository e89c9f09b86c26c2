"""Checks of the contents of a file before a kernel uses them: shapes, finite numbers, indices in their ranges."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.numbers import METHODS
from wheeltapper.march.common import program as contract
from wheeltapper.record.kinds import OUTCOMES

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
FORMAT = 2
"""Version of the layout of a record's file. A newer file is refused. Since version 2 a file names its contacts."""
UNDAMAGED = "a file as wheeltapper wrote it"
"""What a file must be, for messages."""


def check_format(version: Any, newest: int) -> int:
    """Return the version of a layout; refuse a newer one than this program knows."""
    try:
        number = int(version)
    except (TypeError, ValueError):
        raise InputError("", "format", repr(version)[:80], str(newest)) from None
    if number > newest:
        raise InputError("", "format", str(number), f"at most {newest}; wheeltapper {__version__} cannot read it")
    return number


def table(
    data: xr.Dataset, name: str, *shape: int | Iterable[int] | None, ends: bool = False, anything: bool = False
) -> FloatArray:
    """Return a variable as numbers.

    Parameters
    ----------
    data
        The file's contents.
    name
        Name of the variable.
    *shape
        The length of each of its axes, or the lengths that it may have; None: any.
    ends
        Whether it may hold infinities.
    anything
        Whether it may also hold NaN.
    """
    if name not in data.variables:
        raise InputError("", name, "nothing", UNDAMAGED)
    values = data[name].values
    allowed = [None if n is None else [n] if isinstance(n, int) else list(n) for n in shape]
    fits = len(values.shape) == len(allowed) and all(
        lengths is None or n in lengths for n, lengths in zip(values.shape, allowed, strict=True)
    )
    if not fits or values.dtype.kind not in "fiu":
        text = " x ".join("any" if n is None else " or ".join(map(str, n)) for n in allowed)
        raise InputError("", name, f"{values.dtype} of shape {values.shape}", f"numbers, {text}")
    numbers = np.ascontiguousarray(values, dtype=float)
    bad = np.isnan(numbers) if ends else ~np.isfinite(numbers)
    check(name, numbers, ~bad | anything, "no NaN" if ends else "finite numbers")
    return numbers


def check(name: str, values: NDArray[Any], good: NDArray[np.bool_] | bool, allowed: str) -> None:
    """Refuse values unless all are good, naming the first that is not."""
    good = np.broadcast_to(good, np.shape(values))
    if not good.all():
        place = np.argwhere(~good)[0].tolist()
        raise InputError("", name, f"{np.asarray(values)[tuple(place)]:.9g} at {place}", f"{allowed}; {UNDAMAGED}")


def check_whole(name: str, values: NDArray[Any], low: float, high: float) -> None:
    """Refuse values that are no whole numbers from low to high."""
    good = (np.rint(values) == values) & (values >= low) & (values <= high)
    check(name, np.asarray(values), good, f"whole numbers from {low:g} to {high:g}")


def rising(name: str, values: FloatArray, end: float) -> None:
    """Refuse times that fall, or lie outside a run."""
    within = (values >= 0.0) & (values <= end * (1.0 + 1e-9))
    check(name, values, within & (np.diff(values, prepend=0.0) >= 0.0), f"rising times from 0 to {end:.6g}")


def stored_attribute(data: xr.Dataset, name: str, kind: type) -> Any:
    """Return an attribute of a given type; a list is stored as JSON."""
    try:
        value = data.attrs[name]
        if kind is not list:
            return kind(value)
        found = json.loads(value)
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError):
        found = None
    if not isinstance(found, list):
        raise InputError("", name, repr(data.attrs.get(name, "nothing"))[:80], UNDAMAGED)
    return found


def notes(data: xr.Dataset) -> tuple[Note, ...]:
    """Return the notes."""
    return tuple(Note(str(note)) for note in stored_attribute(data, "notes", list))


def stored_choice(data: xr.Dataset, name: str, kind: type, allowed: Iterable[Any]) -> Any:
    """Return an attribute that is one of those allowed."""
    value = stored_attribute(data, name, kind)
    known = list(allowed)
    if value not in known:
        raise InputError("", name, repr(value)[:80], ", ".join(map(str, known)))
    return value


def method_of(data: xr.Dataset) -> str:
    """Return the method."""
    return str(stored_choice(data, "method", str, METHODS))


def version_of(data: xr.Dataset) -> int:
    """Return the version of the layout of a record's file."""
    return check_format(data.attrs.get("format"), FORMAT)


def status_of(data: xr.Dataset) -> int:
    """Return why the march ended."""
    return int(stored_choice(data, "status", int, OUTCOMES))


def steps_of(data: xr.Dataset, columns: int, begin: int, end: float) -> FloatArray:
    """Return the steps of a march, at least one; they begin at rising times."""
    steps = table(data, "march_steps", None, columns)
    if len(steps) == 0:
        raise InputError("", "march_steps", "no steps", UNDAMAGED)
    rising("march_steps", steps[:, begin], end)
    return steps


def check_pieces(name: str, pieces: FloatArray) -> None:
    """Refuse pieces of a path without a length, or whose degrees are beyond their columns."""
    degrees = {contract.DEGREE: 0, contract.FACTOR_DEGREE: -1}
    if pieces.shape[1] == contract.MARKED_COLUMNS:
        degrees |= {contract.RESIDUAL_DEGREE: -1, contract.BEARS_DEGREE: -1}
    for column, low in degrees.items():
        check_whole(name, pieces[:, column], low, contract.MAX_DEGREE)
    check_whole(name, pieces[:, contract.JOIN], contract.SOFT, contract.JUMP)
    check(name, pieces[:, contract.SCALE], pieces[:, contract.SCALE] > 0.0, "positive scales")
    check(name, pieces[:, contract.STOP], pieces[:, contract.STOP] > pieces[:, contract.START], "pieces with a length")
    others = np.delete(pieces, [contract.START, contract.STOP], axis=1)
    check(name, others, np.isfinite(others), "finite numbers")
