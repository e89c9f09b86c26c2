"""Thornton's law: the contact pressure is cut off at its value at yield."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic, FloatArray

FIRST_YIELD = 1.60
"""Ratio of the largest pressure to the yield strength at first yield under a sphere (criterion of von Mises, ν =
0.3)."""


class Thornton(ElasticPlastic):
    """N/N_Y = 1 + 1.5·(D - 1): continuously differentiable once, and no impact returns more energy than it received.

    The flattened spot has the radius R·N_Hertz/N at the largest force: δ_r = δ - (N/C)^(2/3)·(N/N_Hertz)^(1/3).

    Source: C. Thornton, Coefficient of restitution for collinear collisions of elastic-perfectly plastic spheres,
    Journal of Applied Mechanics 64 (1997); docs/theory/elastic_plastic.rst, section 4.2.
    """

    def pressure(self) -> float:
        """Return 1.60·Y."""
        return FIRST_YIELD * self._yield_strength()

    def loading(self, indentation: ArrayLike) -> FloatArray:
        """Return N/N_Y at D ≥ 1."""
        return np.asarray(1.5 * np.asarray(indentation, dtype=float) - 0.5)

    def residual(self, indentation: ArrayLike) -> FloatArray:
        """Return δ_r/δ_Y after unloading from D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return np.asarray(d - self.loading(d) / np.sqrt(d))
