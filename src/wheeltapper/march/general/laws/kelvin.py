"""Kelvin and Voigt's spring and damper, which presses only: N = k·δ + c·δ'."""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_uncounted_kernel
from wheeltapper.march.common.program import FloatArray

KELVIN_STIFFNESS = 1
"""Column of k."""
KELVIN_DAMPING = 2
"""Column of c."""


@inlined_uncounted_kernel
def kelvin_force(delta: float, rate: float, numbers: FloatArray) -> tuple[float, float, float]:
    """Return the force of an indentation and its rate, and its derivatives by both; negative where it would pull."""
    stiffness = numbers[KELVIN_STIFFNESS]
    damping = numbers[KELVIN_DAMPING]
    return stiffness * delta + damping * rate, stiffness, damping
