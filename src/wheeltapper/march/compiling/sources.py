"""The sources of the kernels: what the machine code of a room depends on, as a digest.

Numba stamps a cached function with its own file only. After an edit of a callee in another file, the old machine code
would silently stay in use. So every kernel is stamped with all sources of its room, a folder of `march`, and what they
import. An edit of one march does not compile the others again.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import llvmlite
import numba

FOLDER = Path(__file__).resolve().parent.parent
STEPS = FOLDER / "steps"
"""The steps of a wheel, whose functions are written while the program runs."""

_IMPORTED = re.compile(r"^from wheeltapper\.march([\w.]*) import ([\w, ]*)", re.MULTILINE)
_KERNEL = re.compile(r"^@\w*kernel$|\buncounted_kernel\(", re.MULTILINE)
"""Kernels are decorated where they stand, but for the steps that are written while the program runs."""


def digest_of(files: Iterable[Path]) -> str:
    """Return a digest of sources, and of the versions of what compiles them."""
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    for file in sorted(files):
        digest.update(file.relative_to(FOLDER).as_posix().encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def with_imports(files: Iterable[Path]) -> set[Path]:
    """Return sources, with those of the marches that they import, and that these import."""
    wanted, found = list(files), set[Path]()
    while wanted:
        file = wanted.pop()
        if file in found or not file.exists():
            continue
        found.add(file)
        for module, names in _IMPORTED.findall(file.read_text(encoding="utf-8")):
            place = FOLDER.joinpath(*module.split("."))
            wanted.append(place.with_suffix(".py"))
            wanted += [place / f"{part.split()[0]}.py" for part in names.split(",") if part.strip()]
    return found


@cache
def stamp_of(room: str) -> str:
    """Return the digest of all sources that the kernels of a room depend on."""
    files = (FOLDER / room).rglob("*.py")
    return digest_of(with_imports(file for file in files if _KERNEL.search(file.read_text(encoding="utf-8"))))


def room_of(file: Path) -> str:
    """Return the room of a file of the marches."""
    return file.relative_to(FOLDER).parts[0]
