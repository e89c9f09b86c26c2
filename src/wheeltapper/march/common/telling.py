"""Progress of a march: its kernel returns after some steps or where a table is full, reports, and continues."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wheeltapper.march.common.program import FloatArray

CHUNK = 20_000
"""Steps of a wheelset's march after which its kernel returns, so that progress is reported; this takes far less than
0.1 s."""
WAGON_CHUNK = 4_000
"""The same for a wagon's march, whose steps take longer."""
GENERAL_CHUNK = 4_096
"""Macro steps of the general march for which it makes room at once, and after which it reports; a second or so of
motion."""
Tell = Callable[[float], bool]
"""Called with the time (of the program) that a march has reached. If it returns True, the march ends as FULL."""


def report_nothing(reached: float) -> bool:
    """Report nothing, and continue."""
    return False


def grown_table(table: FloatArray, used: float, room: float = 0.0) -> FloatArray:
    """Return a table, twice as long if three quarters of its rows are used or fewer than `room` are free."""
    if used < 0.75 * len(table) and used + room <= len(table):
        return table
    return np.concatenate([table, np.empty_like(table)])
