"""Profiles that need no file, by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.apta import NUMBERS, wheel_apta
from wheeltapper.describe.profile.en13674 import rail_en13674, rail_heads
from wheeltapper.describe.profile.en13715 import THICKEST, THICKNESSES, Tread, wheel_en13715
from wheeltapper.describe.profile.en15302 import rail_en15302, wheel_en15302
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002

FloatArray = NDArray[np.float64]
Kind = Literal["wheel", "rail"]
Shape = Callable[[FloatArray], FloatArray]
"""A profile: from lateral positions to heights, both in mm; NaN beyond its ends."""


def _flanges(tread: Tread) -> dict[str, Shape]:
    """Return the wheels of EN 13715 with a tread by name, which tells the flange's thickness unless that is 32.5 mm."""
    names = {e: f"EN 13715 {tread}" + ("" if e == THICKEST else f" e{e:g}") for e in reversed(THICKNESSES)}
    return {name: partial(wheel_en13715, tread, e) for e, name in names.items()}


NAMED: dict[Kind, dict[str, Shape]] = {
    "wheel": {
        "S1002": s1002, **{f"EN 15302 {letter}": partial(wheel_en15302, letter) for letter in "ABCHI"},
        **_flanges("1:40"), **_flanges("EPS"), **{f"APTA {number}": partial(wheel_apta, number) for number in NUMBERS},
    },
    "rail": {
        "60E1": rail_60e1, "EN 15302 A": partial(rail_en15302, "A"),
        **{("EN 13674 60E1" if name == "60E1" else name): partial(rail_en13674, name) for name in rail_heads()},
    },
}  # fmt: skip
NAMES = frozenset(name for profiles in NAMED.values() for name in profiles)
