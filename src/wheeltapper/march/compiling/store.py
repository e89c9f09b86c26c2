"""Compiled kernels on disk: one file each, in a folder for each digest of sources, shared by all processes and clones.

The folder is that of WHEELTAPPER_CACHE, else one in that of NUMBA_CACHE_DIR, else one in the user's cache directory.
A file is a pickle behind its own digest. It is written beside its place and then moved there: who is killed meanwhile
leaves the old one or none. A pickle can run any code. So nothing is read from a folder that another user can write.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from pathlib import Path
from uuid import uuid4

from numba.misc.appdirs import AppDirs

from wheeltapper.ground.locks import lock
from wheeltapper.march.compiling.sources import stamp_of
from wheeltapper.march.compiling.telling import say_once

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
KEPT = 3
"""How many digests of a room's sources are kept: those that were used last."""
UNUSED = 30.0 * 86400.0
"""Time after which kernels that nobody has used are removed, s."""
NOT_KEPT = "a compiled kernel could not be kept"
STAMP_DIGITS, HEX = 20, "[0-9a-f]"
DIGEST = hashlib.sha256().digest_size


def root() -> Path:
    """Return the folder of all compiled kernels."""
    if asked := os.environ.get("WHEELTAPPER_CACHE"):
        return Path(asked).absolute()
    if numba_s := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(numba_s).absolute() / "wheeltapper"
    return Path(AppDirs("wheeltapper", appauthor=False).user_cache_dir) / "kernels"


def fault_of(folder: Path) -> str:
    """Return what forbids to read pickles from a folder, "" if nothing does."""
    if os.name == "nt":
        return ""  # a user's folders there are the user's
    held = folder.stat()
    if held.st_uid not in (os.geteuid(), 0):
        return "belongs to another user"
    return "can be written by other users" if held.st_mode & OTHERS_WRITE else ""


def content_of(file: Path) -> bytes | None:
    """Return what was kept in a file, or None; what is damaged was not kept."""
    try:
        data = file.read_bytes()
    except OSError:
        return None
    digest, data = data[:DIGEST], data[DIGEST:]
    return data if hashlib.sha256(data).digest() == digest else None


class Store:
    """The compiled kernels of one room, as its sources are now.

    Attributes
    ----------
    folder
        Where they lie.
    """

    def __init__(self, room: str) -> None:
        self._room = room
        self.folder = root() / f"{room}-{stamp_of(room)[:STAMP_DIGITS]}-{sys.implementation.cache_tag}"

    @cached_property
    def is_sound(self) -> bool:
        """Whether files may be read from the folder and written there; made where it is missing. If not, say why."""
        fault = ""
        try:
            if not self.folder.exists():
                self._make()
            fault = fault_of(self.folder.parent) or fault_of(self.folder)
            with suppress(OSError):
                os.utime(self.folder)
        except OSError as error:
            fault = f"cannot be used ({error.strerror or error})"
        if fault:
            say_once(f"{self.folder.parent} {fault}: compiled kernels are not kept, each process compiles its own")
        return not fault

    def _make(self) -> None:
        self.folder.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        self.folder.mkdir(exist_ok=True, mode=0o700)
        clean(self._room)

    def _file(self, name: str) -> Path:
        return self.folder / name

    def read(self, name: str) -> bytes | None:
        """Return what was kept by a name, or None; what is damaged was not kept."""
        return content_of(self._file(name)) if self.is_sound else None

    def write(self, name: str, data: bytes) -> None:
        """Keep something by a name; say so once if that is impossible."""
        if not self.is_sound:
            return
        beside = self._file(f".{uuid4().hex}")
        try:
            self.folder.mkdir(exist_ok=True, mode=0o700)  # another process may have cleaned
            try:
                beside.write_bytes(hashlib.sha256(data).digest() + data)
                beside.replace(self._file(name))
            finally:
                beside.unlink(missing_ok=True)
        except OSError as error:
            say_once(f"{self.folder.parent}: {NOT_KEPT} ({error.strerror or error})")

    @contextmanager
    def locked(self, name: str, tell_waiting: Callable[[], None]) -> Iterator[None]:
        """Let one process at a time compile what has a name, where files can be locked."""
        if not self.is_sound:
            yield
            return
        try:
            file = self._file(f".{name}.lock").open("a")
        except OSError:
            yield
            return
        with file:
            with suppress(OSError):
                if not lock(file):
                    tell_waiting()
                    lock(file, wait=True)
            yield


@cache
def store_of(room: str) -> Store:
    """Return the kernels of a room."""
    return Store(room)


def folders_of(room: str) -> list[Path]:
    """Return the folders of a room's kernels, that used last first; folders of other names are not ours."""
    found = []
    for path in root().glob(f"{room}-{HEX * STAMP_DIGITS}-*"):
        with suppress(OSError):  # another process has removed it
            found.append((path.stat().st_mtime, path))
    return [path for _, path in sorted(found, reverse=True)]


def clean(room: str) -> None:
    """Remove what was compiled from older sources of a room, and what killed processes left of a removal."""
    now = time.time()
    for number, path in enumerate(folders_of(room)):
        with suppress(OSError):
            if number >= KEPT or now - path.stat().st_mtime > UNUSED:
                remove(path)
    for path in root().glob(f".removed-{HEX * 32}"):
        shutil.rmtree(path, ignore_errors=True)


def remove(folder: Path) -> None:
    """Remove a folder of kernels; at no moment is one left with only some of what belongs together."""
    away = folder.with_name(f".removed-{uuid4().hex}")
    with suppress(OSError):
        folder.replace(away)
        shutil.rmtree(away, ignore_errors=True)
