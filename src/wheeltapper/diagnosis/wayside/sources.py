"""What a folder holds of passages: files with all channels, or folders of files; and when they were."""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from wheeltapper.ground.errors import InputError, printable
from wheeltapper.record.recordings.files import reader_of

TIME = re.compile(r"(?<!\d)(\d{4})-?(\d\d)-?(\d\d)[T_ -]?(\d\d)[:h.-]?(\d\d)(?:[:m.-]?(\d\d))?(?!\d)")
"""A time in the name of a file: 2026-11-23T08-12-05, 20261123_0812."""
LONGEST = 180
"""Longest name of a recording that its pages take, bytes: file systems take 255, of which endings need some."""
TAKEN = re.compile(r"index|.*\.\d+", re.IGNORECASE | re.DOTALL)
"""Names whose pages would be those of the index, or of a second train of another recording."""


class Source(NamedTuple):
    """The recording of a passage: one file, or the files of a folder.

    `name` can be printed, whatever the file system has. `state` is size and time of change of each file, by its name:
    what tells whether something was written since.
    """

    name: str
    files: tuple[Path, ...]
    state: tuple[tuple[str, int, int], ...]

    def stem(self, number: int) -> str:
        """Return what the pages of its trains are named by: its name, if that is possible and theirs alone."""
        stem = self.name
        if len(stem.encode()) > LONGEST or TAKEN.fullmatch(stem):
            cut = stem.encode()[:LONGEST].decode(errors="ignore")
            stem = f"{cut}~{hashlib.sha256(stem.encode()).hexdigest()[:8]}"
        return stem if number == 1 else f"{stem}.{number}"

    @property
    def when(self) -> tuple[str, bool]:
        """Time of the passage, and whether its name states it; else it is when the last file was written, UTC."""
        stated = time_in(self.name)
        if stated is not None:
            return stated.isoformat(), True
        last = max(changed for _, _, changed in self.state) // 10**9
        return datetime.fromtimestamp(last, UTC).replace(tzinfo=None).isoformat(), False


def time_in(name: str) -> datetime | None:
    """Return the time that a name states."""
    found = TIME.search(name)
    if found is not None:
        with suppress(ValueError):
            return datetime(*(int(part or 0) for part in found.groups()))  # type: ignore[arg-type]
    return None


def sources_in(folder: Path, beside: Iterable[Path] = ()) -> tuple[list[Source], list[str]]:
    """Return what a folder holds of passages, by name, and the names of what is none.

    Files and folders `beside` are not looked at. A folder inside holds the files of one passage; it has no folders.
    """
    passed_over = {os.path.realpath(one) for one in beside}
    sources, others = [], []
    try:
        inside = sorted(folder.iterdir())
    except OSError as error:
        raise InputError(str(folder), "folder", f"no readable folder ({error.strerror})", "a folder") from None
    for entry in inside:
        if entry.name.startswith(".") or os.path.realpath(entry) in passed_over:
            continue
        name = printable(entry.name)
        found = _source(name, [file for file in _files_of(entry) if _is_recording(file)])
        if found is None:
            others.append(name)
        else:
            sources.append(found)
    return sources, others


def _files_of(entry: Path) -> list[Path]:
    """Return the files of a folder, none if it cannot be read; or the file that it is."""
    try:
        return sorted(entry.iterdir()) if entry.is_dir() else [entry]
    except OSError:
        return []


def _is_recording(file: Path) -> bool:
    """Return whether it is a file, no pipe or link to nothing, of a kind that can be read."""
    try:
        reader_of(file)
        return not file.name.startswith(".") and stat.S_ISREG(os.stat(file).st_mode)
    except (InputError, OSError):
        return False


def _source(name: str, files: list[Path]) -> Source | None:
    """Return the passage in files; None if there are none, or one has just gone."""
    try:
        seen = [(file, os.stat(file)) for file in files]
    except OSError:
        return None
    state = tuple((file.name, one.st_size, one.st_mtime_ns) for file, one in seen)
    return Source(name, tuple(files), state) if files else None
