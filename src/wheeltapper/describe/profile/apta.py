"""American wheel profiles by number: 120, 140, 140M, 220, 240, 320 and 340.

Source: APTA PR-M-S-015-06 as transcribed in rohrbecka/APTA_PR_M_S_015_06 (f9657cf), inches converted. The arcs meet
their corners within 0.02 mm. Here the flange's back is 70 mm from the datum, at which the height is zero.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.pieces import Arc, Line, Piece, height_of, rows_of
from wheeltapper.describe.profile.s1002 import FLANGE_BACK

FloatArray = NDArray[np.float64]
NUMBERS = ("120", "140", "140M", "220", "240", "320", "340")


@cache
def _pieces(number: str) -> tuple[tuple[Piece, ...], float, float]:
    """Return the pieces in the axes of the standard, and the place and height of the datum there."""
    own = {row[1]: row[2:] for row in rows_of(Path(__file__).with_suffix(".csv")) if row[0] == number}
    corners = {name: (float(row[0]), float(row[1])) for name, row in own.items() if len(name) == 1}
    pieces: list[Piece] = []
    for one, other in pairwise(corners):
        if corners[one][0] >= corners[other][0]:
            continue  # upright
        if f"r{one}{other}" in own:
            y, z = map(float, own[f"center{one}{other}"])
            side = 1.0 if corners[one][1] + corners[other][1] > 2.0 * z else -1.0
            ends = corners[one][0], corners[other][0]
            pieces.append(Arc(ends, float(own[f"r{one}{other}"][0]), (y, z), side))
        else:
            pieces.append(Line(corners[one], corners[other]))
    datum = corners["A"][0] + FLANGE_BACK
    return tuple(pieces), datum, float(height_of(pieces, np.array([datum]))[0])


def wheel_apta(number: str, y: FloatArray) -> FloatArray:
    """Return the height of a wheel's profile in mm, away from the axle, at lateral positions in mm."""
    pieces, datum, height = _pieces(number)
    return height_of(pieces, np.asarray(y, dtype=float) + datum) - height
