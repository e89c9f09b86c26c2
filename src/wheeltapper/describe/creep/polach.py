"""Polach's saturation: adhesion and slip areas with a tangential stress that falls linearly to the leading edge."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from wheeltapper.describe.creep.base import CreepLaw


class Polach(CreepLaw):
    """T = (2·μ·N/π)·[kA·e/(1 + (kA·e)²) + atan(kS·e)], e = π·F/(4·μ·N); analytic at F = 0.

    Source: O. Polach, A fast wheel-rail forces calculation computer code (1999); kA, kS: Creep forces in simulations of
    traction vehicles running on adhesion limit (2005).

    Spin is treated as additional lateral slip, which holds while it is small. If the linear force of spin alone is 0.2
    of μ·N, the forces differ from those of FASTSIM by at most 0.12 of μ·N on ellipses that are at least as long as
    wide, and by 0.15 on those half as long. If it is 1 of μ·N, the errors reach 0.4 and 0.55, and 0.8 on flanges, where
    FASTSIM is within some 0.12 of an exact program. A record's `notes` say if a wagon exceeded 0.2 or touched with a
    flange.

    Parameters
    ----------
    friction, wheel_spin
        As for all creep laws.
    adhesion_reduction, slip_reduction
        kA and kS: how far contamination lowers the initial slope and the approach to the limit; 1 on clean rails. With
        both at 1 the slope at F = 0 is that of the linear theory.
    """

    spin_range: ClassVar[float | None] = 0.2
    adhesion_reduction: float = Field(default=1.0, gt=0, le=1)
    slip_reduction: float = Field(default=1.0, gt=0, le=1)

    def saturation(self, utilisation: ArrayLike) -> NDArray[np.float64]:
        """Return T/F as a function of F/(μ·N), the share of the friction limit that the linear force would use."""
        e = 0.25 * np.pi * np.asarray(utilisation, dtype=float)
        near, far = self.adhesion_reduction * e, self.slip_reduction * e
        slope = np.where(far > 1e-4, np.arctan(far) / np.maximum(e, 1e-300), self.slip_reduction * (1.0 - far**2 / 3.0))
        return np.asarray(0.5 * (self.adhesion_reduction / (1.0 + near**2) + slope))
