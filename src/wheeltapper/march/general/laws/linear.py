"""Linear springs, N = k·δ: one that does not pull, and one that does."""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

LINEAR_STIFFNESS = 1
"""Column of k."""


@inlined_uncounted_kernel
def linear_force(delta: float, numbers: FloatArray) -> tuple[float, float]:
    """Return the force of an indentation, and its derivative."""
    if delta <= 0.0:
        return 0.0, 0.0
    return numbers[LINEAR_STIFFNESS] * delta, numbers[LINEAR_STIFFNESS]


@inlined_uncounted_kernel
def bonded_force(delta: float, numbers: FloatArray) -> tuple[float, float]:
    """Return the force of an indentation of either sign, and its derivative."""
    return numbers[LINEAR_STIFFNESS] * delta, numbers[LINEAR_STIFFNESS]
