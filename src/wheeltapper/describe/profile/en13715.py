"""Wheel profiles of EN 13715 beside S1002: the cone 1:40 and EPS, with flanges of any thickness of the standard.

Lateral position y from the tread datum (70 mm from the flange's back), positive to the field side; z away from the
axle, mm. The flange is 28 mm high, the outer tread slopes by 6.7 %.

Source: EN 13715:2020 as transcribed in rohrbecka/EN13715 (f1fd63c, 2022-11-02).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.pieces import Arc, Curve, Line, Piece, height_of, rows_of

FloatArray = NDArray[np.float64]
Tread = Literal["1:40", "EPS"]
THICKEST = 32.5
THICKNESSES = tuple(28.5 + 0.5 * k for k in range(9))
"""Thicknesses of the flange, mm."""
OUTER_SLOPE, CHAMFER, EDGE = 0.067, 5.0, 65.0
"""Slope of the outer tread, and the chamfer behind it, which ends at the wheel's edge, mm."""


def wheel_en13715(tread: Tread, thickness: float, y: FloatArray) -> FloatArray:
    """Return the height of a wheel's profile in mm, away from the axle, at lateral positions in mm."""
    return height_of(_pieces(tread, thickness), y)


@cache
def _pieces(tread: Tread, thickness: float) -> tuple[Piece, ...]:
    return (*_flange(thickness), *(_cone(thickness) if tread == "1:40" else _worn(thickness)))


def _flange(thickness: float) -> Iterator[Piece]:
    """Yield the flange, up to the root's end; a thinner one is nearer to its back."""
    d = THICKEST - thickness
    yield Arc((-70.0, -62.765), 20.5, (-49.5, 9.519), 1.0)
    yield Arc((-62.765, -55.0 - 0.5 * d), 12.0, (-55.0, 16.0), 1.0)
    yield Arc((-55.0 - 0.5 * d, -49.663 - d), 12.0, (-55.0 - d, 16.0), 1.0)
    yield Arc((-49.663 - d, -39.765 - d), 20.0, (-58.558 - d, 8.835), 1.0)
    yield Line((-39.765 - d, 15.675), (-38.427 - d, 12.0))
    yield Arc((-38.427 - d, -35.0 - d), 13.0, (-26.211 - d, 16.446), -1.0)


def _cone(thickness: float) -> Iterator[Piece]:
    """Yield the tread 1:40."""
    d = THICKEST - thickness
    yield Arc((-35.0 - d, -32.696 - d), 13.0, (-26.211 - d, 16.446), -1.0)
    yield Arc((-32.696 - d, -15.64 - d), 36.0, (-14.74 - d, 36.38), -1.0)
    yield Line((-15.64 - d, 0.391), (-0.5 - d, 0.0125))
    yield Line((-0.5 - d, 0.0125), (0.0, 0.0))
    yield Line((0.0, 0.0), (35.0, -0.875))
    yield from _outside(35.0, -0.875)


def _worn(thickness: float) -> Iterator[Piece]:
    """Yield the tread EPS."""
    rows = rows_of(Path(__file__).with_name("en13715_eps.csv"))[1:]
    begin, heights = next((float(row[1]), row[2].split()) for row in rows if float(row[0]) == thickness)
    points = [(begin + 0.5 * k, float(z)) for k, z in enumerate(heights)]
    root = (begin + 26.211 + THICKEST - thickness) / (16.446 - points[0][1])
    yield Curve(tuple(points), (root, (-26.0 + 6.5) / (100.871 - 2.79)))
    yield Arc((-26.0, -17.587), 100.0, (-6.5, 100.871), -1.0)
    yield Arc((-17.587, 19.0), 330.0, (19.0, 329.453), -1.0)
    yield Line((19.0, -0.547), (29.0, -0.547))
    yield from _outside(29.0, -0.547)


def _outside(begin: float, height: float) -> Iterator[Piece]:
    """Yield the outer tread and its chamfer."""
    last = EDGE - CHAMFER
    low = height - OUTER_SLOPE * (last - begin)
    yield Line((begin, height), (last, low))
    yield Line((last, low), (EDGE, low - CHAMFER))
