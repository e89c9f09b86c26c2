"""Checks of what a file has kept of a march: no index of it reaches a kernel unchecked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wheeltapper.ground.contents import UNDAMAGED, check, check_whole, rising, table
from wheeltapper.ground.errors import InputError
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray

Held = Mapping[Any, Any]
"""What a file has kept, by name."""


def steps_of(held: Held, columns: int, begin: int, end: float) -> FloatArray:
    """Return the steps of a march, at least one; they begin at rising times."""
    steps = table(held, "march_steps", None, columns)
    if len(steps) == 0:
        raise InputError("", "march_steps", "no steps", UNDAMAGED)
    rising("march_steps", steps[:, begin], end)
    return steps


def rows_of(
    held: Held, name: str, end: float, *, contacts: IntArray | None = None, latest: int | None = None
) -> FloatArray:
    """Return rows of events or maxima: at rising times, for each of the `contacts` if there are several.

    Events are of kinds up to `latest`.
    """
    rows = table(held, name, None, contract.EVENT_COLUMNS)
    if contacts is None:
        rising(name, rows[:, contract.EVENT_TIME], end)
    else:
        which = rows[:, contract.EVENT_CONTACT]
        check(name, which, np.isin(which, contacts), "contacts of this march")
        for contact in contacts:  # within a step, maxima may be sorted by contact
            rising(name, rows[which == contact, contract.EVENT_TIME], end)
    if latest is not None:
        check_whole(name, rows[:, contract.EVENT_KIND], contract.LOSS, latest)
    return rows


def check_pieces(name: str, pieces: FloatArray) -> None:
    """Refuse pieces of a path without a length, or whose degrees are beyond their columns."""
    degrees = {contract.DEGREE: 0, contract.FACTOR_DEGREE: -1}
    if pieces.shape[1] == contract.MARKED_COLUMNS:
        degrees |= {contract.RESIDUAL_DEGREE: -1, contract.BEARS_DEGREE: -1}
    for column, low in degrees.items():
        check_whole(name, pieces[:, column], low, contract.MAX_DEGREE)
    check_whole(name, pieces[:, contract.JOIN], contract.SOFT, contract.JUMP)
    check(name, pieces[:, contract.SCALE], pieces[:, contract.SCALE] > 0.0, "positive scales")
    check(name, pieces[:, contract.STOP], pieces[:, contract.STOP] > pieces[:, contract.START], "pieces with a length")
    others = np.delete(pieces, [contract.START, contract.STOP], axis=1)
    check(name, others, np.isfinite(others), "finite numbers")
