"""Available memory, so that computations that cannot fit are refused before they start."""

from __future__ import annotations

import os
from collections.abc import Callable
from math import inf
from pathlib import Path
from time import monotonic

from wheeltapper.ground.errors import InputError

GROUPS = (
    (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory.current")),
    (Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"), Path("/sys/fs/cgroup/memory/memory.usage_in_bytes")),
)
"""Files in which Linux states the limit of a container's memory, and its present use."""


FRESH = 0.1
"""Time for which what is available is not read again, s: short runs ask several times a millisecond."""
_read = [-inf, inf]
"""When it was read, s, and what."""


def available_bytes() -> float:
    """Return the available bytes, as read `FRESH` ago at most; infinite if the system does not state them."""
    if monotonic() - _read[0] > FRESH:
        _read[:] = monotonic(), _stated_bytes()
    return _read[1]


def _stated_bytes() -> float:
    left = _of_machine()
    for limit, use in GROUPS:
        try:
            left = min(left, float(limit.read_text()) - float(use.read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    return max(left, 0.0)


def _of_machine() -> float:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * float(os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return inf


def size_text(count: float) -> str:
    """Return a number of bytes with a unit, such as "3.2 GB"."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if count < 1000.0:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} PB"


def check_room(field: str, found: str, needed: float, fits: str | Callable[[float], str]) -> None:
    """Refuse a request that takes more memory than is available.

    Parameters
    ----------
    field
        Field of the request.
    found
        The request, for the message.
    needed
        Bytes that the request takes.
    fits
        What is possible instead, or a function that returns it for the share of the request that fits.
    """
    there = available_bytes()
    if needed > there:
        allowed = fits if isinstance(fits, str) else fits(there / needed)
        raise InputError(
            "", field, f"{found}, {size_text(needed)}", f"{allowed} here, where {size_text(there)} of memory are free"
        )
