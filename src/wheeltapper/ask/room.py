"""Memory: what this process may take, and what a study would."""

from __future__ import annotations

import os
from pathlib import Path

from wheeltapper.ground.errors import InputError

NUMBER = 8
"""Bytes of a number."""
GROUP_LIMIT = Path("/sys/fs/cgroup/memory.max")
"""Where Linux says what a container may take in all."""


def available() -> float:
    """Return how many bytes of memory this process may still take, about; infinite where the system does not say."""
    limits = [float("inf")]
    try:
        held = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        limits.append(1024.0 * float(held["MemAvailable"].split()[0]))
        limits.append(float(GROUP_LIMIT.read_text()))
    except (OSError, KeyError, ValueError):  # another system, or no limit ("max")
        pass
    if len(limits) == 1 and hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        limits.append(float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE"))
    return min(limits)


def check_room(field: str, what: str, numbers: float, remedy: str) -> None:
    """Refuse what takes more numbers than there is memory for.

    Parameters
    ----------
    field
        Where it was asked for.
    what
        What was asked for.
    numbers
        How many numbers that takes at a time.
    remedy
        What may be asked for instead.
    """
    needed, free = NUMBER * numbers, available()
    if needed > free:
        raise InputError(
            "", field, f"{what}, which takes {needed / 1e9:.3g} GB of memory", f"{free / 1e9:.3g} GB here; {remedy}"
        )
