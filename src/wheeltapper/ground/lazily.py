"""Names of a package that are imported when they are first used, so that importing the package itself is quick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazily(
    package: str, homes: Mapping[str, str], rooms: Mapping[str, str] | None = None
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package.

    Parameters
    ----------
    package
        Its `__name__`.
    homes
        Public names, and the module under `wheeltapper` that holds each.
    rooms
        Public names that are modules themselves. `dir` of one lists what it offers, and not what it needs itself.
    """
    rooms = rooms or {}

    def get(name: str) -> Any:
        """Import a public name when it is first used."""
        if name in rooms:
            room: Any = import_module(f"wheeltapper.{rooms[name]}")
            room.__dir__ = lambda: sorted(room.__all__)
            return room
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"wheeltapper.{homes[name]}"), name)

    def listed() -> list[str]:
        """Return the public names."""
        return sorted([*homes, *rooms])

    return get, listed
