"""Rail heads of EN 13674 by name: arcs that touch, from the crown outwards, and straight sides.

Lateral position y from the rail's middle, z up from the crown, mm; the rail stands upright.

Source: EN 13674-1:2017 and EN 13674-4:2020 as transcribed in rohrbecka/EN13674 (7322660, 2022-12-30). The widths of the
heads that follow from radii and joints are round numbers within 0.01 mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import hypot, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.pieces import rows_of

FloatArray = NDArray[np.float64]
BELOW, LEANING = 10.0, 1e-3
"""How far the head's side goes on below its beginning, mm, and the least slope of sides: upright ones have heights."""


@cache
def rail_heads() -> dict[str, tuple[tuple[float, ...], tuple[float, ...], float]]:
    """Return radii of the arcs, lateral places of their joints, mm, and the slope of the sides, by the rail's name."""
    heading, *rows = rows_of(Path(__file__).with_suffix(".csv"))
    out = {}
    for row in rows:
        field = dict(zip(heading, row, strict=True))
        radii = tuple(float(field[f"r{k}"]) for k in range(1, 5) if field[f"r{k}"])
        joints = tuple(0.5 * float(field[f"width_{k}"]) for k in range(1, 4) if field[f"width_{k}"])
        out[field["name"]] = radii, joints, max(float(field["side"]), LEANING)
    return out


def arc_centres(radii: Sequence[float], joints: Sequence[float]) -> list[tuple[float, float]]:
    """Return the centres of arcs that touch, mm: each joint lies on the line through the centres of its two arcs."""
    centres = [(0.0, -radii[0])]
    for radius, following, joint in zip(radii[:-1], radii[1:], joints, strict=True):
        middle, z = centres[-1]
        height = z + sqrt(radius**2 - (joint - middle) ** 2)
        share = following / radius
        centres.append((joint - share * (joint - middle), height - share * (height - z)))
    return centres


def head_of(
    y: FloatArray, radii: Sequence[float], joints: Sequence[float], side: float, bottom: float | None = None
) -> FloatArray:
    """Return the height of a rail head, mm; NaN beside it, and below its bottom.

    The last arc ends where the side touches it.
    """
    across = np.abs(np.asarray(y, dtype=float))
    centres = arc_centres(radii, joints)
    last_y, last_z = centres[-1]
    long = hypot(1.0, side)
    begins = last_y + radii[-1] / long, last_z + radii[-1] * side / long
    borders = (0.0, *joints, begins[0])
    z_at = np.full(across.shape, np.nan)
    for begin, end, radius, (middle, z) in zip(borders[:-1], borders[1:], radii, centres, strict=True):
        here = (across >= begin) & (across <= end)
        z_at[here] = z + np.sqrt(radius**2 - (across[here] - middle) ** 2)
    beside = across > begins[0]
    z_at[beside] = begins[1] - (across[beside] - begins[0]) / side
    return np.where(z_at < (begins[1] - BELOW if bottom is None else bottom), np.nan, z_at)


def rail_en13674(name: str, y: FloatArray) -> FloatArray:
    """Return the height of a rail's head in mm, upwards, at lateral positions in mm."""
    radii, joints, side = rail_heads()[name]
    return head_of(y, radii, joints, side)
