"""The path of a wheel's centre: evaluated wherever it is needed, never interpolated.

`place` is the row of a contact's state: the piece on which it is and how far its table has been shifted. Positions are
those of the contact's own table, m; a macro step goes from `x0` over `stride`.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Row

RADIANS = 2.0
"""Longest part of a wave that a step goes over."""


@uncounted_kernel
def heights(
    pieces: FloatArray, place: Row, x0: float, stride: float, lift: float, n: int, theta: FloatArray,
    height: FloatArray, factor: FloatArray,
) -> None:  # fmt: skip
    """Write the path's height, times `lift`, and the factor on the force at n parts θ of a macro step."""
    piece = int(place["piece"])
    degree = int(pieces[piece, contract.DEGREE])
    factor_degree = int(pieces[piece, contract.FACTOR_DEGREE])
    sine = lift * pieces[piece, contract.SINE]
    cosine = lift * pieces[piece, contract.COSINE]
    from_centre = x0 - place["shift"] - pieces[piece, contract.CENTRE]
    scale = 1.0 / pieces[piece, contract.SCALE]
    if degree == 0:
        level = lift * pieces[piece, contract.COEFFICIENT]
        for k in range(n):
            height[k] = level
    else:
        for k in range(n):
            xi = (from_centre + stride * theta[k]) * scale
            total = 0.0
            for j in range(degree, -1, -1):
                total = total * xi + pieces[piece, contract.COEFFICIENT + j]
            height[k] = lift * total
    if sine != 0.0 or cosine != 0.0:
        number = pieces[piece, contract.WAVENUMBER]
        for k in range(n):
            phase = number * (from_centre + stride * theta[k])
            height[k] += sine * sin(phase) + cosine * cos(phase)
    for k in range(n):
        factor[k] = 1.0
    if factor_degree >= 0:
        for k in range(n):
            xi = (from_centre + stride * theta[k]) * scale
            total = 0.0
            for j in range(factor_degree, -1, -1):
                total = total * xi + pieces[piece, contract.FACTOR + j]
            factor[k] = total


@uncounted_kernel
def height_and_slope(
    pieces: FloatArray, place: Row, x0: float, stride: float, lift: float, theta: float
) -> tuple[float, float]:
    """Return the path's height, times `lift`, and its derivative by θ."""
    piece = int(place["piece"])
    scale = 1.0 / pieces[piece, contract.SCALE]
    from_centre = x0 - place["shift"] - pieces[piece, contract.CENTRE] + stride * theta
    xi = from_centre * scale
    value = 0.0
    slope = 0.0
    for j in range(int(pieces[piece, contract.DEGREE]), -1, -1):
        slope = slope * xi + value
        value = value * xi + pieces[piece, contract.COEFFICIENT + j]
    slope *= scale
    number = pieces[piece, contract.WAVENUMBER]
    sine = pieces[piece, contract.SINE]
    cosine = pieces[piece, contract.COSINE]
    if sine != 0.0 or cosine != 0.0:
        s = sin(number * from_centre)
        c = cos(number * from_centre)
        value += sine * s + cosine * c
        slope += number * (sine * c - cosine * s)
    return lift * value, lift * slope * stride


@uncounted_kernel
def piece_stop(pieces: FloatArray, place: Row, x0: float, stride: float) -> float:
    """Return the part θ of the macro step at which the present piece ends."""
    stop = pieces[int(place["piece"]), contract.STOP]
    if np.isinf(stop) or stride == 0.0:
        return np.inf
    return (stop + place["shift"] - x0) / stride


@uncounted_kernel
def longest_reach(pieces: FloatArray, place: Row, stride: float) -> float:
    """Return how much of a macro step may be gone over at once, for the sake of the path's wave."""
    piece = int(place["piece"])
    if pieces[piece, contract.SINE] == 0.0 and pieces[piece, contract.COSINE] == 0.0:
        return np.inf
    return RADIANS / (abs(pieces[piece, contract.WAVENUMBER] * stride) + 1e-300)


@uncounted_kernel
def enter_next_piece(pieces: FloatArray, first: int, last: int, loop: int, loop_join: int, place: Row) -> int:
    """Go to the next piece of a table that is rows `first` to `last` - 1; return how it joins, or -1 at the end."""
    piece = int(place["piece"]) + 1
    if piece < last:
        place["piece"] = piece
        return int(pieces[piece, contract.JOIN])
    if first + loop >= last:
        return -1
    place["shift"] += pieces[piece - 1, contract.STOP] - pieces[first + loop, contract.START]
    place["piece"] = first + loop
    return loop_join


@uncounted_kernel
def _polynomial(row: FloatArray, degree: int, first: int, xi: float) -> float:
    """Return a polynomial of a piece whose coefficients begin at a column."""
    total = 0.0
    for j in range(degree, -1, -1):
        total = total * xi + row[first + j]
    return total


@uncounted_kernel
def surface_at(pieces: FloatArray, place: Row, x0: float, stride: float, lift: float, theta: float) -> tuple[float, float, float]:  # fmt: skip  # noqa: E501
    """Return what earlier wheels have left, and what the surface as it is bears elastically, both times `lift`.

    Then follows the factor on the force. A table without these columns is of contacts that do not yield.
    """
    row = pieces[int(place["piece"])]
    if len(row) <= contract.RESIDUAL_DEGREE:
        return 0.0, np.inf, 1.0
    xi = (x0 - place["shift"] - row[contract.CENTRE] + stride * theta) / row[contract.SCALE]
    factor = 1.0
    if row[contract.FACTOR_DEGREE] >= 0.0:
        factor = _polynomial(row, int(row[contract.FACTOR_DEGREE]), contract.FACTOR, xi)
    left = _polynomial(row, int(row[contract.RESIDUAL_DEGREE]), contract.RESIDUAL, xi)
    return lift * left, lift * _polynomial(row, int(row[contract.BEARS_DEGREE]), contract.BEARS, xi), factor


@uncounted_kernel
def surfaces(
    pieces: FloatArray, place: Row, x0: float, stride: float, lift: float, n: int, theta: FloatArray,
    left: FloatArray, factor: FloatArray,
) -> None:  # fmt: skip
    """Write what earlier wheels have left at n parts θ under a contact that yields, and no factor there."""
    if place["stretch"] == 0.0:
        for k in range(n):
            left[k] = 0.0
        return
    for k in range(n):
        left[k], _, _ = surface_at(pieces, place, x0, stride, lift, theta[k])
        factor[k] = 1.0
