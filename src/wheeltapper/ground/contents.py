"""Checks of arrays from a file before anybody uses them: shapes, finite numbers, indices in their ranges."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
UNDAMAGED = "a file as wheeltapper wrote it"
"""What a file must be, for messages."""


def table(
    data: Mapping[Any, Any], name: str, *shape: int | Iterable[int] | None, ends: bool = False, anything: bool = False
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
        raise InputError("", name, "nothing", UNDAMAGED)
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
