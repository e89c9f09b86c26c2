"""Profiles that need no file, by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.en15302 import rail_en15302, wheel_en15302
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002

FloatArray = NDArray[np.float64]
Kind = Literal["wheel", "rail"]
Shape = Callable[[FloatArray], FloatArray]
"""A profile: from lateral positions to heights, both in mm; NaN beyond its ends."""
NAMED: dict[Kind, dict[str, Shape]] = {
    "wheel": {"S1002": s1002, **{f"EN 15302 {letter}": partial(wheel_en15302, letter) for letter in "ABCHI"}},
    "rail": {"60E1": rail_60e1, "EN 15302 A": partial(rail_en15302, "A")},
}
NAMES = frozenset(name for profiles in NAMED.values() for name in profiles)
