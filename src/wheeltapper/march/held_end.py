"""What holds the end of a damper, with play or with a bush in series, as coefficients of a step's equations.

G is the damping where the end is rigid, B and β are the constants of a bush (steps/equations.py). While the end is
free, all three are zero. The DAMPING among the numbers is zero in a program with such a damper.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march import layout
from wheeltapper.march import program as contract
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.program import FloatArray


@uncounted_kernel
def held_coefficients(mode: float, damper: FloatArray) -> tuple[float, float, float]:
    """Return G of a rigid end, B and β of a bush, as far as something holds the end."""
    if mode == contract.FREE:
        return 0.0, 0.0, 0.0
    if damper[contract.DAMPER_BUSH] > 0.0:
        return 0.0, damper[contract.DAMPER_BUSH], damper[contract.DAMPER_BUSH] / damper[contract.DAMPER_DAMPING]
    return damper[contract.DAMPER_DAMPING], 0.0, 0.0


@uncounted_kernel
def hold_end(damper: FloatArray, mode: float, S: FloatArray) -> None:
    """Put these coefficients in S, where contact steps find them."""
    S[layout.END_G], S[layout.END_B], S[layout.END_BETA] = held_coefficients(mode, damper)


@uncounted_kernel
def flight_reach_with_end(numbers: FloatArray, damper: FloatArray, state: FloatArray) -> float:
    """Return the time over which the series of a flight, of wheel and bush, are exact to rounding."""
    G, soft, rate = held_coefficients(state[contract.END_MODE], damper)
    return 2.0 / max(np.sqrt(numbers[contract.STIFFNESS]) + G + np.sqrt(soft) + rate, 1e-3)
