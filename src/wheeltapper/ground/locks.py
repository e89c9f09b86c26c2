"""Locks of files between processes; a lock ends with its process."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from wheeltapper.ground.errors import InputError

AGAIN = 0.2
"""How long to wait before a lock is tried again where the system cannot wait for it, s."""


def lock(file: IO[Any], wait: bool = False) -> bool:
    """Lock an open file for this process; False if another one holds it. It is unlocked when it is closed.

    Parameters
    ----------
    file
        Open for writing.
    wait
        Until the other one gives it back.

    Raises
    ------
    OSError
        If its file system has no locks.
    """
    if os.name == "nt":
        return _lock_on_windows(file, wait)
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True


def _lock_on_windows(file: IO[Any], wait: bool) -> bool:
    msvcrt: Any = __import__("msvcrt")
    while True:
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            if not wait:
                return False
            time.sleep(AGAIN)
        else:
            return True


@contextmanager
def locked(path: Path, field: str = "--output") -> Iterator[None]:
    """Lock a store or a file for one process; a second one is refused. The lock ends with the process."""
    place = path.with_name(path.name + ".lock")
    with place.open("a+") as file:
        if not _held_lock(file, place):
            raise InputError(str(path), field, "a file that another process is filling", "one process at a time")
        try:
            yield
        finally:
            place.unlink(missing_ok=True)


def _held_lock(file: Any, place: Path) -> bool:
    try:  # a driver that has just ended may have removed the file that was opened
        return lock(file) and os.path.samestat(os.fstat(file.fileno()), place.stat())
    except OSError:
        return False
