"""What holds the end of a damper, with play or with a bush in series, as coefficients of a step's equations.

G is the damping where the end is rigid, B and β are the constants of a bush (steps/equations.py). While the end is
free, all three are zero. The DAMPING of a wheel with such a damper is zero.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.steps import layout


@inlined_uncounted_kernel
def damper_ends(numbers: FloatArray) -> bool:
    """Return whether the damper has an end of its own."""
    return bool(numbers[contract.DAMPER_PLAY] > 0.0 or numbers[contract.DAMPER_BUSH] > 0.0)


@uncounted_kernel
def held_coefficients(mode: float, numbers: FloatArray) -> tuple[float, float, float]:
    """Return G of a rigid end, B and β of a bush, as far as something holds the end."""
    if mode == contract.FREE:
        return 0.0, 0.0, 0.0
    if numbers[contract.DAMPER_BUSH] > 0.0:
        return 0.0, numbers[contract.DAMPER_BUSH], numbers[contract.DAMPER_BUSH] / numbers[contract.DAMPER_DAMPING]
    return numbers[contract.DAMPER_DAMPING], 0.0, 0.0


@uncounted_kernel
def hold_end(numbers: FloatArray, mode: float, S: FloatArray) -> None:
    """Put these coefficients in S, where contact steps find them."""
    S[layout.END_G], S[layout.END_B], S[layout.END_BETA] = held_coefficients(mode, numbers)


@uncounted_kernel
def flight_reach_with_end(numbers: FloatArray, state: FloatArray) -> float:
    """Return the time over which the series of a flight, of wheel and bush, are exact to rounding."""
    G, soft, rate = held_coefficients(state[contract.END_MODE], numbers)
    return 2.0 / max(np.sqrt(numbers[contract.STIFFNESS]) + G + np.sqrt(soft) + rate, 1e-3)
