"""What a file keeps of a march, and its checks: shapes, numbers, indices; none reaches a kernel unchecked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray

Held = Mapping[Any, Any]
"""What a file has kept, by name."""
UNDAMAGED = "a file as wheeltapper wrote it"
"""What a file must be, for messages."""


def table(
    data: Held, name: str, *shape: int | Iterable[int] | None, ends: bool = False, anything: bool = False
) -> FloatArray:
    """Return a variable as numbers.

    Parameters
    ----------
    data
        The file's contents.
    name
        Name of the variable.
    *shape
        The length of each of its axes, or the lengths that it may have; None: any.
    ends
        Whether it may hold infinities.
    anything
        Whether it may also hold NaN.
    """
    if name not in data:
        refuse(name, "nothing")
    values = np.asarray(data[name])
    allowed = [None if n is None else [n] if isinstance(n, int) else list(n) for n in shape]
    fits = len(values.shape) == len(allowed) and all(
        lengths is None or n in lengths for n, lengths in zip(values.shape, allowed, strict=True)
    )
    if not fits or values.dtype.kind not in "fiu":
        text = " x ".join("any" if n is None else " or ".join(map(str, n)) for n in allowed)
        raise InputError("", name, f"{values.dtype} of shape {values.shape}", f"numbers, {text}")
    numbers = np.ascontiguousarray(values, dtype=float)
    bad = np.isnan(numbers) if ends else ~np.isfinite(numbers)
    check(name, numbers, ~bad | anything, "no NaN" if ends else "finite numbers")
    return numbers


def refuse(name: str, found: str) -> NoReturn:
    """Refuse what no file has."""
    raise InputError("", name, found, UNDAMAGED)


def check(name: str, values: NDArray[Any], good: NDArray[np.bool_] | bool, allowed: str) -> None:
    """Refuse values unless all are good, naming the first that is not."""
    good = np.broadcast_to(good, np.shape(values))
    if not good.all():
        place = np.argwhere(~good)[0].tolist()
        raise InputError("", name, f"{np.asarray(values)[tuple(place)]:.9g} at {place}", f"{allowed}; {UNDAMAGED}")


def check_whole(name: str, values: NDArray[Any], low: float, high: float) -> None:
    """Refuse values that are no whole numbers from low to high."""
    good = (np.rint(values) == values) & (values >= low) & (values <= high)
    check(name, np.asarray(values), good, f"whole numbers from {low:g} to {high:g}")


def rising(name: str, values: FloatArray, end: float) -> None:
    """Refuse times that fall, or lie outside a run."""
    within = (values >= 0.0) & (values <= end * (1.0 + 1e-9))
    check(name, values, within & (np.diff(values, prepend=0.0) >= 0.0), f"rising times from 0 to {end:.6g}")


def steps_of(held: Held, columns: int, begin: int, end: float) -> FloatArray:
    """Return the steps of a march, at least one; they begin at rising times."""
    steps = table(held, "march_steps", None, columns)
    if len(steps) == 0:
        refuse("march_steps", "no steps")
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
