"""The reference profiles by which EN 15302 has programs for equivalent conicity tested: wheels A, B, C, H, I, rail A.

They are lines and arcs, in one frame for wheel and rail: with rails that are not inclined further, flanges' backs 1.360
m apart and a gauge of 1.435164 m, a wheelset in the middle has both frames 1.5 m apart.

Source: EN 15302:2021, annex I, as transcribed in rohrbecka/EN15302 (1f91228, 2023-01-14). The pieces meet within 0.0009
mm. Differences of rolling radii made from them agree with the tables transcribed there to 0.0003 mm in the median.
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
FILE = Path(__file__).with_suffix(".csv")
GAUGE = 1.435164
"""With rail A, m: it has the wheels where the standard has them."""


@cache
def _pieces(profile: str) -> tuple[tuple[float, float, str, float, float, float], ...]:
    """Return the pieces of a profile: from and to, mm, kind, and the numbers a, b and c of its formula."""
    with FILE.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    own = [row[1:] for row in rows if row[0] == profile]
    return tuple((float(y0), float(y1), kind, float(a), float(b), float(c or 0.0)) for y0, y1, kind, a, b, c in own)


def _height(profile: str, y: FloatArray) -> FloatArray:
    """Return z in mm, downwards, at lateral positions in mm; NaN beyond the profile's ends."""
    y = np.asarray(y, dtype=float)
    z = np.full(y.shape, np.nan)
    for begin, end, kind, a, b, c in _pieces(profile):
        here = (y >= begin) & (y <= end)
        if kind == "line":
            z[here] = a * y[here] + b
        else:
            z[here] = b + (-1.0 if kind == "sag" else 1.0) * np.sqrt(a**2 - (y[here] - c) ** 2)
    return z


def wheel_en15302(letter: str, y: FloatArray) -> FloatArray:
    """Return the height of a wheel's profile in mm, away from the axle, at lateral positions in mm."""
    return _height(f"wheel {letter}", y)


def rail_en15302(letter: str, y: FloatArray) -> FloatArray:
    """Return the height of a rail's profile in mm, upwards, at lateral positions in mm."""
    return -_height(f"rail {letter}", y)
