"""Johnson's and Stronge's law: the mean pressure grows with the logarithm of the contained plastic zone."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from wheeltapper.describe.contact.elastic_plastic import PLASTIC_CONSTRAINT, ElasticPlastic, FloatArray
from wheeltapper.describe.contact.thornton import FIRST_YIELD

AT_YIELD = 1.1
"""ϑ: ratio of the mean pressure to the yield strength at first yield."""
FULLY_PLASTIC = 0.5 * (1.0 + float(np.exp(3.0 * AT_YIELD * (PLASTIC_CONSTRAINT / AT_YIELD - 1.0))))
"""D = 82.5, from which on the contact is fully plastic: its mean pressure stays 2.8·Y."""


class Stronge(ElasticPlastic):
    """N/N_Y = x·(1 + ln x/3.3), x = 2·D - 1; fully plastic, 2.8·Y, from D = 82.5 on. The paper's law.

    The residual is D - √(2·D - 1). The slope jumps from 1.5 to 2.61 at D = 1, as published: just above yield the
    contact is stiffer than Hertz's, and an impact whose largest force is below some 3.6 N_Y returns more energy than it
    received. Coefficients of restitution reach 1.06: the law suits rolling, and not impacts on one spot.

    Source: W. J. Stronge, Impact Mechanics (2000), after K. L. Johnson, Contact Mechanics (1985);
    docs/theory/elastic_plastic.rst, section 4.2.
    """

    borders: ClassVar[tuple[float, ...]] = (FULLY_PLASTIC,)
    warning: ClassVar[str] = (
        "Stronge's law gives more energy back than it took (restitution up to 1.06) in impacts whose largest force is "
        "below some 3.6 times the force at yield; Thornton's never does"
    )

    def pressure(self) -> float:
        """Return 1.60·Y."""
        return FIRST_YIELD * self._yield_strength()

    def loading(self, indentation: ArrayLike) -> FloatArray:
        """Return N/N_Y at D ≥ 1."""
        x = 2.0 * np.asarray(indentation, dtype=float) - 1.0
        return np.asarray(x * np.minimum(1.0 + np.log(x) / (3.0 * AT_YIELD), PLASTIC_CONSTRAINT / AT_YIELD))

    def residual(self, indentation: ArrayLike) -> FloatArray:
        """Return δ_r/δ_Y after unloading from D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return np.asarray(d - np.sqrt(2.0 * d - 1.0))
