"""The sources of the kernels: what a march's machine code depends on, as a digest.

Numba stamps a cached function with its own file only. After an edit of a callee in another file, the old machine code
would silently stay in use. So every kernel is stamped with all sources of its march: those of the march's folder, or
for the general march those of its folders, and what they import. An edit of one march does not compile the other again.
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
GENERAL = FOLDER / "general"
"""The general march, with folders of its own in it."""
RAILS = FOLDER / "rails"
"""The wagon's march on rails, which takes kernels of both."""
STEPS = FOLDER / "steps"
"""The steps of a wheel, whose functions are written while the program runs."""

_IMPORTED = re.compile(r"^from wheeltapper\.march([\w.]*) import ([\w, ]*)", re.MULTILINE)
_KERNEL = re.compile(r"^@\w*kernel$", re.MULTILINE)


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
def stamp_of(march: str) -> str:
    """Return the digest of all sources that the kernels of a march depend on; `march` as `march_of` says."""
    if march == "rails":
        files = set(RAILS.glob("*.py"))
    elif march == "general":
        files = {file for file in GENERAL.rglob("*.py") if _KERNEL.search(file.read_text(encoding="utf-8"))}
    else:
        files = {*FOLDER.glob("*.py")} - {FOLDER / "run.py"}  # the door has no kernels
    return digest_of(with_imports(files))


def march_of(file: Path) -> str:
    """Return to whose sources a file of the marches belongs: "wheel", which is the wagon's, too; "general"; "rails"."""
    return "rails" if file.parent == RAILS else "wheel" if file.parent in (FOLDER, STEPS) else "general"
