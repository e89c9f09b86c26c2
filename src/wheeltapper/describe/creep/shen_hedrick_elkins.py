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

    Spin counts as lateral slip more, which it is while small. Where its linear force by itself is 0.2 of μ·N, forces
    are within 0.12 of μ·N of FASTSIM's on ellipses that are at least as long as wide, and within 0.15 on those half as
    long; at 1 they may be wrong by 0.4 and 0.55, on flanges by 0.8 of μ·N, where FASTSIM is within some 0.12 of an
    exact program. A record's `notes` tell a wagon that went beyond 0.2, or touched with a flange.

    Parameters
    ----------
    friction, wheel_spin
        As for all creep laws.
    """

    spin_range: ClassVar[float | None] = 0.2

    def saturation(self, utilisation: ArrayLike) -> NDArray[np.float64]:
        """Return T/F at F/(μ·N), the utilisation of friction by the linear force."""
        q = np.asarray(utilisation, dtype=float)
        return np.asarray(np.where(q <= 3.0, 1.0 - q / 3.0 + q * q / 27.0, 1.0 / np.maximum(q, 3.0)))
