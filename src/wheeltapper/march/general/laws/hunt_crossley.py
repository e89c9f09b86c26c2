"""Hunt and Crossley (1975): N = C·δ^(3/2)·(1 + η·δ'); where that would pull, the march releases the contact."""

from __future__ import annotations

from math import sqrt

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

CROSSLEY_CONSTANT = 1
"""Column of C."""
CROSSLEY_LOSS = 2
"""Column of η."""


@inlined_uncounted_kernel
def hunt_crossley_force(delta: float, rate: float, numbers: FloatArray) -> tuple[float, float, float]:
    """Return the force of an indentation and its rate, and its derivatives by both; negative where it would pull."""
    root = sqrt(max(delta, 0.0))
    slope = numbers[CROSSLEY_CONSTANT] * root
    elastic = slope * root * root
    share = 1.0 + numbers[CROSSLEY_LOSS] * rate
    return elastic * share, 1.5 * slope * share, elastic * numbers[CROSSLEY_LOSS]
