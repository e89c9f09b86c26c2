"""Columns of times of day, with or without a date, as loggers write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np
from numpy.typing import NDArray

DAY = 86400
STAMP = re.compile(
    r'"?(?:(?P<date>\d{4}[-/]\d\d[-/]\d\d)(?:T|\s+))?(?P<hour>\d{1,2}):(?P<minute>\d\d):(?P<second>\d\d)(?P<part>[.,]\d+)?'
    r'\s*(?:Z|(?P<zone>[+-]\d\d):?(?P<beside>\d\d))?"?'
)
"""2026-11-27T14:18:01.001, 2026/11/27 14:18:01,001 or 14:18:01.001, perhaps with a zone."""
ALLOWED = "a time as in the first line, such as 14:18:01.001 with or without a date"


def _parts(cell: str) -> tuple[int, float] | None:
    """Return whole seconds, and the part of one; None for what is no time."""
    found = STAMP.fullmatch(cell.strip())
    if found is None:
        return None
    try:
        day = date.fromisoformat(found["date"].replace("/", "-")).toordinal() if found["date"] else 0
    except ValueError:
        return None
    minutes = 60 * int(found["hour"]) + int(found["minute"])
    if found["zone"]:
        minutes -= 60 * int(found["zone"]) + int(found["zone"][0] + found["beside"])
    part = float(f"0.{found['part'][1:]}") if found["part"] else 0.0
    return DAY * day + 60 * minutes + int(found["second"]), part


def seconds_of(cells: Sequence[str]) -> tuple[NDArray[np.float64], int | None] | None:
    """Return the times of a column from its first one on, s, and the first cell that is none.

    Times without a date go on over midnight. A missing one is NaN. None where the first cell holds no time.
    """
    first = next((cell for cell in cells if cell), "")
    begin = _parts(first)
    if begin is None:
        return None
    dated = STAMP.fullmatch(first.strip())["date"] is not None  # type: ignore[index]
    values, last, days = np.full(len(cells), np.nan), begin[0], 0
    for i, cell in enumerate(cells):
        if not cell:
            continue
        found = _parts(cell)
        if found is None:
            return values, i
        whole = found[0] + days
        if not dated and whole < last - DAY // 2:
            days, whole = days + DAY, whole + DAY
        last = whole
        values[i] = (whole - begin[0]) + (found[1] - begin[1])
    return values, None
