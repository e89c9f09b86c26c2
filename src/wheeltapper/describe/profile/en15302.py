"""The reference profiles by which EN 15302 has programs for equivalent conicity tested: wheels A, B, C, H, I, rail A.

They are lines and arcs, in one frame for wheel and rail: with rails that are not inclined further, flanges' backs 1.360
m apart and a gauge of 1.435164 m, a wheelset in the middle has both frames 1.5 m apart.

Source: EN 15302:2021, annex I, as transcribed in rohrbecka/EN15302 (1f91228, 2023-01-14). The pieces meet within 0.0009
mm. Differences of rolling radii made from them agree with the tables transcribed there to 0.0003 mm in the median.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.pieces import Arc, Line, Piece, height_of, rows_of

FloatArray = NDArray[np.float64]
GAUGE = 1.435164
"""With rail A, m: it has the wheels where the standard has them."""


@cache
def _pieces(profile: str) -> tuple[Piece, ...]:
    """Return the pieces of a profile."""
    own = [row[1:] for row in rows_of(Path(__file__).with_suffix(".csv")) if row[0] == profile]
    out: list[Piece] = []
    for begin, end, kind, *rest in own:
        ends = float(begin), float(end)
        a, b, c = (float(number or 0.0) for number in rest)
        if kind == "line":
            low, high = ((y, a * y + b) for y in ends)
            out.append(Line(low, high))
        else:
            out.append(Arc(ends, a, (c, b), -1.0 if kind == "sag" else 1.0))
    return tuple(out)


def wheel_en15302(letter: str, y: FloatArray) -> FloatArray:
    """Return the height of a wheel's profile in mm, away from the axle, at lateral positions in mm."""
    return height_of(_pieces(f"wheel {letter}"), y)


def rail_en15302(letter: str, y: FloatArray) -> FloatArray:
    """Return the height of a rail's profile in mm, upwards, at lateral positions in mm."""
    return -height_of(_pieces(f"rail {letter}"), y)
