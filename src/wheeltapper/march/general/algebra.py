"""Small dense linear systems, and copies."""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray

LANES = 8
"""Columns that are solved side by side: a number that the compiler knows, so that it makes vectors of them."""


@uncounted_kernel
def factorise(J: FloatArray, n: int) -> None:
    """Replace a matrix by its factors L and U, without exchanging rows: it is one plus a small matrix, or near that.

    The diagonal of U is kept as its inverse.
    """
    for k in range(n):
        inverse = 1.0 / J[k, k]
        J[k, k] = inverse
        for i in range(k + 1, n):
            share = J[i, k] * inverse
            J[i, k] = share
            for j in range(k + 1, n):
                J[i, j] -= share * J[k, j]


@uncounted_kernel
def solve_factorised(J: FloatArray, n: int, x: FloatArray) -> None:
    """Replace x by the solution of L·U·solution = x."""
    for i in range(1, n):
        total = x[i]
        for j in range(i):
            total -= J[i, j] * x[j]
        x[i] = total
    for i in range(n - 1, -1, -1):
        total = x[i]
        for j in range(i + 1, n):
            total -= J[i, j] * x[j]
        x[i] = total * J[i, i]


@uncounted_kernel
def solve_lanes(J: FloatArray, n: int, x: FloatArray) -> None:
    """Do as `solve_factorised` for several columns at a time, (n, LANES)."""
    for j in range(n):
        for i in range(j + 1, n):
            share = J[i, j]
            for lane in range(LANES):
                x[i, lane] -= share * x[j, lane]
    for j in range(n - 1, -1, -1):
        inverse = J[j, j]
        for lane in range(LANES):
            x[j, lane] *= inverse
        for i in range(j):
            share = J[i, j]
            for lane in range(LANES):
                x[i, lane] -= share * x[j, lane]


@inlined_uncounted_kernel
def copy(values: FloatArray, out: FloatArray) -> None:
    """Write values to a table of the same shape; both lie in one piece, and apart from each other."""
    for k in range(values.size):
        out.flat[k] = values.flat[k]
