"""The rail head 60E1 (UIC60): arcs of 300, 80 and 13 mm that touch, and straight sides 20:1.

Lateral position y from the rail's middle, z up from the crown, mm; the rail stands upright.

Source: EN 13674-1. Two readings of its joints are in use: the public one, which fits the point sets of the Manchester
benchmark to 1e-4 mm, and that of the standard's drawing as recalled; they differ by up to 0.040 mm in height.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.en13674 import head_of

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


def rail_60e1(y: FloatArray, variant: Variant = "public") -> FloatArray:
    """Return z in mm at lateral positions in mm; NaN beside the head."""
    return head_of(y, RADII, JOINTS[variant], SIDE, BOTTOM)
