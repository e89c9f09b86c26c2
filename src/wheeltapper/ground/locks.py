"""Locks of files between processes; a lock ends with its process."""

from __future__ import annotations

import os
import time
from typing import IO, Any

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
