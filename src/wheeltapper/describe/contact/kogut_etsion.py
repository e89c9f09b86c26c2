"""Kogut's and Etsion's law, power functions fitted to finite elements of a sphere."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from wheeltapper.describe.contact.elastic_plastic import PLASTIC_CONSTRAINT, ElasticPlastic, FloatArray, blended


class KogutEtsion(ElasticPlastic):
    """N/N_Y = 1.03·D^1.425 from D = 1.1 to 6, and 1.40·D^1.263 from 6.3 to 110.

    Yield, D = 1, begins at the pressure (0.454 + 0.41·ν)·H, H = 2.8·Y. The residual is D·(1 - D^-0.28)·(1 - D^-0.69).
    The published force jumps by 3 % at D = 1 and by 1.7 % at D = 6; here there are smooth transitions, to 1.1 and 6.3.
    Just above yield it is stiffer than Hertz's: impacts whose largest force is below some 1.4 N_Y return up to 2 % more
    energy than they received. Unloading is elastic with the exponent 1.5 (the authors fit 1.5·D^-0.033).

    Source: L. Kogut and I. Etsion, Elastic-plastic contact analysis of a sphere and a rigid flat, Journal of Applied
    Mechanics 69 (2002); I. Etsion, Y. Kligerman and Y. Kadin (2005) for the residual; docs/theory/elastic_plastic.rst,
    section 4.2.
    """

    borders: ClassVar[tuple[float, ...]] = (1.1, 6.0, 6.3)
    limit: ClassVar[float] = 110.0
    warning: ClassVar[str] = (
        "Kogut's and Etsion's law gives up to 2 % more energy back than it took in impacts whose largest force is "
        "below some 1.4 times the force at yield; Thornton's never does"
    )

    def pressure(self) -> float:
        """Return (0.454 + 0.41·ν)·H."""
        return (0.454 + 0.41 * self.poisson) * PLASTIC_CONSTRAINT * self._yield_strength()

    def loading(self, indentation: ArrayLike) -> FloatArray:
        """Return N/N_Y at D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        first = blended(d, 1.0, 1.1, d**1.5, 1.03 * d**1.425)
        return blended(d, 6.0, 6.3, first, 1.40 * d**1.263)

    def residual(self, indentation: ArrayLike) -> FloatArray:
        """Return δ_r/δ_Y after unloading from D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return np.asarray(d * (1.0 - d**-0.28) * (1.0 - d**-0.69))
