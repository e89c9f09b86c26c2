"""Elastic-plastic laws of a rolling wheel: Hertz's law below yield, then a curve over the virgin surface's indentation.

The general march and the wagon's take them from here.

stretch 0       N = C·δ^(3/2), times the path's factor, up to the indentation that the surface has borne before
stretch k > 0   N = N_Y·f((δ + left)/δ_Y), N_Y = C·δ_Y^(3/2), between two borders of the law, where f has a kink

`left` is the indentation that earlier wheels have left. A rolling wheel presses each place once, so that a contact goes
back along the same curve (docs/theory/elastic_plastic.rst). Within a stretch f is smooth: pieces of polynomials, rows
of `common.program` with lengths over δ_Y and forces over N_Y, and the stretch of each behind them. Beyond
its stretch, and beyond its last piece, f goes on straight, so that a march can look for a border from its inner side.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common import law_columns
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.law_columns import PLASTIC_CONSTANT, PLASTIC_FIRST, PLASTIC_ONSET, PLASTIC_PIECES
from wheeltapper.march.common.program import FloatArray


@inlined_uncounted_kernel
def _first_piece(stretch: float, numbers: FloatArray, table: FloatArray) -> int:
    """Return the first piece of a stretch, or the row behind the law's last one."""
    row, end = int(numbers[PLASTIC_FIRST]), int(numbers[PLASTIC_FIRST] + numbers[PLASTIC_PIECES])
    while row < end and table[row, law_columns.PIECE_STRETCH] < stretch:
        row += 1
    return row


@uncounted_kernel
def border_of(stretch: float, numbers: FloatArray, table: FloatArray) -> float:
    """Return the virgin surface's indentation at which a stretch k > 0 begins; infinity behind the last one."""
    row = _first_piece(stretch, numbers, table)
    if row == int(numbers[PLASTIC_FIRST] + numbers[PLASTIC_PIECES]):
        return np.inf
    return table[row, contract.LAW_START] * numbers[PLASTIC_ONSET]


@uncounted_kernel
def stretch_of(delta: float, left: float, borne: float, numbers: FloatArray, table: FloatArray) -> float:
    """Return the stretch of an indentation of a surface that has borne another one."""
    stretch = 0.0
    if delta > borne:
        stretch = 1.0
        while delta + left >= border_of(stretch + 1.0, numbers, table):
            stretch += 1.0
    return stretch


@uncounted_kernel
def plastic_force(
    delta: float, left: float, stretch: float, numbers: FloatArray, table: FloatArray
) -> tuple[float, float]:
    """Return the force of an indentation in a stretch, and its derivative."""
    if stretch == 0.0:
        slope = numbers[PLASTIC_CONSTANT] * sqrt(max(delta, 0.0))
        return slope * max(delta, 0.0), 1.5 * slope
    onset = numbers[PLASTIC_ONSET]
    row = _first_piece(stretch, numbers, table)
    last = int(numbers[PLASTIC_FIRST] + numbers[PLASTIC_PIECES]) - 1
    depth = (delta + left) / onset
    inside = max(depth, table[row, contract.LAW_START])
    while (
        row < last
        and table[row + 1, law_columns.PIECE_STRETCH] == stretch
        and table[row + 1, contract.LAW_START] <= inside
    ):
        row += 1
    scale = table[row, contract.LAW_SCALE]
    inside = min(inside, table[row, contract.LAW_CENTRE] + scale)
    eta = (inside - table[row, contract.LAW_CENTRE]) / scale
    value, slope = 0.0, 0.0
    for k in range(contract.TERMS - 1, -1, -1):
        slope = slope * eta + value
        value = value * eta + table[row, contract.LAW_FORCE + k]
    slope /= scale
    unit = numbers[PLASTIC_CONSTANT] * sqrt(onset)
    return unit * onset * (value + slope * (depth - inside)), unit * slope


@uncounted_kernel
def virgin_force(depth: float, column: int, numbers: FloatArray, table: FloatArray) -> tuple[float, float]:
    """Return the force of a virgin surface's indentation beyond yield, and the work of loading it, over N_Y and δ_Y.

    The work up to the start of a piece is in a column of the table.
    """
    row = int(numbers[PLASTIC_FIRST])
    last = row + int(numbers[PLASTIC_PIECES]) - 1
    while row < last and table[row + 1, contract.LAW_START] <= depth:
        row += 1
    scale, centre = table[row, contract.LAW_SCALE], table[row, contract.LAW_CENTRE]
    inside = min(depth, centre + scale)
    eta, begin = (inside - centre) / scale, (table[row, contract.LAW_START] - centre) / scale
    force, slope, done, before = 0.0, 0.0, 0.0, 0.0
    for k in range(contract.TERMS - 1, -1, -1):
        term = table[row, contract.LAW_FORCE + k]
        slope = slope * eta + force
        force = force * eta + term
        done = done * eta + term / (k + 1.0)
        before = before * begin + term / (k + 1.0)
    work = table[row, column] + scale * (done * eta - before * begin)
    beyond = depth - inside
    slope /= scale
    return force + slope * beyond, work + beyond * (force + 0.5 * slope * beyond)
