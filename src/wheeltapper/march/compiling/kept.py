"""What is kept of compiled kernels, for those who look after it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from wheeltapper.march.compiling.store import folders_of, remove, store_of

ROOMS = {
    "common": "what all marches share", "steps": "steps of a wheel", "wheel": "one wheel", "wagon": "wagons",
    "general": "other vehicles and tracks",
}  # fmt: skip
"""The rooms that have kernels, and whose these are."""


class Kept(NamedTuple):
    """What was compiled from one state of a room's sources.

    Attributes
    ----------
    folder
        Where it lies.
    room
        Whose kernels they are.
    is_current
        Whether the sources are those of this package.
    kernels, size
        How many, and how much, bytes.
    """

    folder: Path
    room: str
    is_current: bool
    kernels: int
    size: int


def kept() -> list[Kept]:
    """Return what is kept, by room, with that of the present sources first."""
    found = []
    for room in ROOMS:
        current = store_of(room).folder
        for folder in sorted(folders_of(room), key=lambda one: one != current):
            files = [path for path in folder.iterdir() if path.is_file()]
            size = sum(path.stat().st_size for path in files)
            found.append(Kept(folder, room, folder == current, sum(path.suffix == ".code" for path in files), size))
    return found


def empty() -> list[Kept]:
    """Remove all that is kept, and return what it was."""
    found = kept()
    for one in found:
        remove(one.folder)
    return found
