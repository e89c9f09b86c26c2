"""What every file says of itself: its format, its method, its notes, why the march ended."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from wheeltapper._version import __version__
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.numbers import METHODS
from wheeltapper.march.common.kept import UNDAMAGED
from wheeltapper.record.outcomes import OUTCOMES

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 3
"""Version of the layout of a record's file; a newer file is refused. Since version 2 a file names its contacts, since
version 3 it holds what a march was made of and its log, and no program."""


def check_format(version: Any, newest: int) -> int:
    """Return the version of a layout; refuse a newer one than this program knows."""
    try:
        number = int(version)
    except (TypeError, ValueError):
        raise InputError("", "format", repr(version)[:80], str(newest)) from None
    if number > newest:
        raise InputError("", "format", str(number), f"at most {newest}; wheeltapper {__version__} cannot read it")
    return number


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
