"""The cubic saturation of Vermeulen and Johnson, with spin by Shen, Hedrick and Elkins."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.describe.creep.base import CreepLaw


class ShenHedrickElkins(CreepLaw):
    """T = μ·N·(q - q²/3 + q³/27) with q = F/(μ·N) up to 3, then μ·N.

    Source: Z. Y. Shen, J. K. Hedrick, J. A. Elkins, A comparison of alternative creep force
    models for rail vehicle dynamic analysis (1983).

    Spin is treated as additional lateral slip, which holds while it is small. If the linear force of spin alone is 0.2
    of μ·N, the forces differ from those of FASTSIM by at most 0.12 of μ·N on ellipses that are at least as long as
    wide, and by 0.15 on those half as long. If it is 1 of μ·N, the errors reach 0.4 and 0.55, and 0.8 on flanges, where
    FASTSIM is within some 0.12 of an exact program. A record's `notes` say if a wagon exceeded 0.2 or touched with a
    flange.

    Parameters
    ----------
    friction, wheel_spin
        As for all creep laws.
    """

    spin_range: ClassVar[float | None] = 0.2

    def saturation(self, utilisation: ArrayLike) -> NDArray[np.float64]:
        """Return T/F as a function of F/(μ·N), the share of the friction limit that the linear force would use."""
        q = np.asarray(utilisation, dtype=float)
        return np.asarray(np.where(q <= 3.0, 1.0 - q / 3.0 + q * q / 27.0, 1.0 / np.maximum(q, 3.0)))
