"""Kogut's and Etsion's law, power functions fitted to finite elements of a sphere."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from wheeltapper.describe.contact.elastic_plastic import PLASTIC_CONSTRAINT, ElasticPlastic, FloatArray


class KogutEtsion(ElasticPlastic):
    """1.03·D^1.425 from D = 1 to 6, 1.40·D^1.263 to 110.

    D counts from the pressure (0.454 + 0.41·ν)·H, H the hardness, 2.8·Y. The residual is
    D·(1 - D^-0.28)·(1 - D^-0.69). The force jumps by 3 % at D = 1 and by 1.7 % at D = 6, as published. Unloading is
    elastic with the exponent 1.5 (the authors fit 1.5·D^-0.033).

    Source: L. Kogut and I. Etsion, Elastic-plastic contact analysis of a sphere and a rigid flat, Journal of Applied
    Mechanics 69 (2002); I. Etsion, Y. Kligerman and Y. Kadin (2005) for the residual; the project's physics reference,
    section 7.
    """

    borders: ClassVar[tuple[float, ...]] = (6.0,)
    limit: ClassVar[float] = 110.0

    def pressure(self) -> float:
        """Return (0.454 + 0.41·ν)·H."""
        return (0.454 + 0.41 * self.poisson) * PLASTIC_CONSTRAINT * self._strength()

    def loading(self, indentation: ArrayLike) -> FloatArray:
        """Return N/N_Y at D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return np.where(d <= 6.0, 1.03 * d**1.425, 1.40 * d**1.263)

    def residual(self, indentation: ArrayLike) -> FloatArray:
        """Return δ_r/δ_Y after unloading from D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return np.asarray(d * (1.0 - d**-0.28) * (1.0 - d**-0.69))
