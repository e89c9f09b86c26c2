"""Jackson's and Green's law, fitted to finite elements of a hemisphere."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic, FloatArray, blended

ELASTIC_TO, PLASTIC_FROM = 1.9, 2.0
"""D up to which the law is Hertz's, and D from which on it is the published plastic one. Between them it is blended."""
HARDNESS = 2.84
"""Ratio of hardness to yield strength in the limit of a contact that is small compared with the radius."""


class JacksonGreen(ElasticPlastic):
    """Hertz's law to D = 1.9, from 2.0 on exp(-D^(5/12)/4)·D^1.5 + (4·2.84/C_S)·(1 - exp(-D^(5/9)/25))·D.

    Yield, D = 1, begins inside the body, at the pressure C_S·Y with C_S = 1.295·exp(0.736·ν). The residual is
    1.02·D·(1 - ((D + 5.9)/6.9)^-0.54). The published force jumps by half a per cent at D = 1.9; here there is a smooth
    transition from 1.9 to 2.0.

    Source: R. L. Jackson and I. Green, A finite element study of elasto-plastic hemispherical contact against a rigid
    flat, Journal of Tribology 127 (2005); R. L. Jackson, I. Green and D. B. Marghitu (2010) for the residual;
    docs/theory/elastic_plastic.rst, section 4.2.
    """

    borders: ClassVar[tuple[float, ...]] = (ELASTIC_TO, PLASTIC_FROM)
    limit: ClassVar[float] = 250.0

    @property
    def _onset_factor(self) -> float:
        return 1.295 * float(np.exp(0.736 * self.poisson))

    def pressure(self) -> float:
        """Return C_S·Y."""
        return self._onset_factor * self._yield_strength()

    def loading(self, indentation: ArrayLike) -> FloatArray:
        """Return N/N_Y at D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        fading = np.exp(-0.25 * d ** (5.0 / 12.0)) * d**1.5
        plastic = 4.0 * HARDNESS / self._onset_factor * -np.expm1(-(d ** (5.0 / 9.0)) / 25.0) * d
        return blended(d, ELASTIC_TO, PLASTIC_FROM, d**1.5, fading + plastic)

    def residual(self, indentation: ArrayLike) -> FloatArray:
        """Return δ_r/δ_Y after unloading from D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return np.asarray(1.02 * d * (1.0 - ((d + 5.9) / 6.9) ** -0.54))
