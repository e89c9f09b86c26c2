"""Rows of numbers with names: what kernels keep of states, steps and events, as structured arrays."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import DTypeLike, NDArray

from wheeltapper.march.common.program import FloatArray

Rows = NDArray[np.void]
Row = np.void


def named(names: str, kind: DTypeLike = np.float64) -> np.dtype[Any]:
    """Return the type of a row of numbers with these names."""
    return np.dtype([(name, kind) for name in names.split()])


def width(kind: np.dtype[Any]) -> int:
    """Return how many numbers a row of a type has."""
    return kind.itemsize // 8


def plain(rows: Rows) -> FloatArray:
    """Return the same numbers, unnamed, along one more axis."""
    return rows.view(np.float64).reshape(*rows.shape, width(rows.dtype))


def row_of(kind: np.dtype[Any]) -> Row:
    """Return one row of zeros."""
    return cast("Row", np.zeros((), kind)[()])


def rows_from(numbers: FloatArray, kind: np.dtype[Any]) -> Rows:
    """Return the rows whose plain numbers these are."""
    return np.ascontiguousarray(numbers).view(kind)[..., 0]
