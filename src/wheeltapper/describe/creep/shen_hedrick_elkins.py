"""The cubic saturation of Vermeulen and Johnson, with spin by Shen, Hedrick and Elkins."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.describe.creep.base import CreepLaw


class ShenHedrickElkins(CreepLaw):
    """T = μ·N·(q - q²/3 + q³/27) with q = F/(μ·N) up to 3, then μ·N.

    Valid for small spin. Source: Z. Y. Shen, J. K. Hedrick, J. A. Elkins, A comparison of alternative creep force
    models for rail vehicle dynamic analysis (1983).

    Parameters
    ----------
    friction, wheel_spin
        As for all creep laws.
    """

    def saturation(self, utilisation: ArrayLike) -> NDArray[np.float64]:
        """Return T/F at F/(μ·N), the utilisation of friction by the linear force."""
        q = np.asarray(utilisation, dtype=float)
        return np.asarray(np.where(q <= 3.0, 1.0 - q / 3.0 + q * q / 27.0, 1.0 / np.maximum(q, 3.0)))
