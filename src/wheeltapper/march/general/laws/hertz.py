"""Hertz: N = C·δ^(3/2)."""

from __future__ import annotations

from math import sqrt

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

HERTZ_CONSTANT = 1
"""Column of C."""


@inlined_uncounted_kernel
def hertz_force(delta: float, numbers: FloatArray) -> tuple[float, float]:
    """Return the force of an indentation, and its derivative."""
    root = sqrt(max(delta, 0.0))
    slope = numbers[HERTZ_CONSTANT] * root
    return slope * root * root, 1.5 * slope
