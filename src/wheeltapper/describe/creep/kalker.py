"""Kalker's linear theory: no slip anywhere in the contact, and no limit by friction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.describe.creep.base import CreepLaw


class KalkerLinear(CreepLaw):
    """T = F, however large: valid while F is small against μ·N.

    Source: J. J. Kalker, On the rolling contact of two elastic bodies in the presence of dry friction (1967).

    Parameters
    ----------
    friction, wheel_spin
        As for all creep laws; μ is used only to note where the theory ends.
    """

    def saturation(self, utilisation: ArrayLike) -> NDArray[np.float64]:
        """Return T/F as a function of F/(μ·N), the share of the friction limit that the linear force would use."""
        return np.ones_like(np.asarray(utilisation, dtype=float))
