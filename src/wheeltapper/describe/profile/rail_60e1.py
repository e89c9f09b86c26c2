"""The rail head 60E1 (UIC60): arcs of 300, 80 and 13 mm that touch, and straight sides 20:1.

Lateral position y from the rail's middle, z up from the crown, mm; the rail stands upright.

Source: EN 13674-1. Two readings of its joints are in use: the public one, which fits the point sets of the Manchester
benchmark to 1e-4 mm, and that of the standard's drawing as recalled; they differ by up to 0.040 mm in height.
"""

from __future__ import annotations

from math import hypot
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Variant = Literal["public", "drawing"]

RADII = (300.0, 80.0, 13.0)
"""Radii of the arcs from the crown outwards, mm."""
JOINTS: dict[Variant, tuple[float, float]] = {"public": (10.5, 25.988), "drawing": (10.228, 26.0265)}
"""Lateral positions of the joints between the arcs, mm."""
SIDE = 0.05
"""Slope of the sides: horizontal per vertical distance (1:20)."""
BOTTOM = -40.0
"""Height of the lower end of the head, mm."""


def _arc_centres(variant: Variant) -> list[tuple[float, float]]:
    """Return the centres of the three arcs; each joint lies on the line through two of them."""
    centres = [(0.0, -RADII[0])]
    for (radius, following), joint in zip(zip(RADII[:-1], RADII[1:], strict=True), JOINTS[variant], strict=True):
        y, z = centres[-1]
        across = joint - y
        height = z + np.sqrt(radius**2 - across**2)
        share = following / radius
        centres.append((joint - share * across, float(height - share * (height - z))))
    return centres


def rail_60e1(y: FloatArray, variant: Variant = "public") -> FloatArray:
    """Return z in mm at lateral positions in mm; NaN beside the head."""
    across = np.abs(np.asarray(y, dtype=float))
    centres = _arc_centres(variant)
    slope = 1.0 / SIDE
    last_y, last_z = centres[-1]
    side = last_y + RADII[-1] * slope / hypot(1.0, slope), last_z + RADII[-1] / hypot(1.0, slope)
    borders = (0.0, *JOINTS[variant], side[0])
    z = np.full(across.shape, np.nan)
    for begin, end, radius, (centre_y, centre_z) in zip(borders[:-1], borders[1:], RADII, centres, strict=True):
        here = (across >= begin) & (across <= end)
        z[here] = centre_z + np.sqrt(radius**2 - (across[here] - centre_y) ** 2)
    beside = across > side[0]
    z[beside] = side[1] - slope * (across[beside] - side[0])
    return np.where(z < BOTTOM, np.nan, z)
