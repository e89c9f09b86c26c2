"""The path as a series in time, and the length of steps without contact force, or in a bilateral contact."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march import layout
from wheeltapper.march import program as contract
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.layout import F
from wheeltapper.march.program import FloatArray


@uncounted_kernel
def path_series(order: int, S: FloatArray) -> None:
    """Put the path's own series in time in row F."""
    degree = int(S[layout.HERE_DEGREE])
    for k in range(order + 1):
        S[F + k] = S[layout.HERE_POLY + k] if k <= degree else 0.0
    omega = S[layout.HERE_OMEGA]
    if omega != 0.0:
        s = sin(S[layout.HERE_PHASE0])
        c = cos(S[layout.HERE_PHASE0])
        h = S[layout.HERE_AMP_SIN] * s + S[layout.HERE_AMP_COS] * c
        d = S[layout.HERE_AMP_SIN] * c - S[layout.HERE_AMP_COS] * s
        for k in range(order + 1):
            S[F + k] += h
            part = omega * (1.0 / (k + 1))
            h, d = d * part, -h * part


@uncounted_kernel
def flight_reach(numbers: FloatArray, S: FloatArray) -> float:
    """Return the time over which the flight series of order FLIGHT_ORDER is exact to rounding."""
    rate = np.sqrt(numbers[contract.STIFFNESS]) + numbers[contract.DAMPING] + abs(S[layout.HERE_OMEGA])
    if numbers[contract.DECK_MASS] > 0.0:
        deck = np.sqrt(numbers[contract.DECK_STIFFNESS] / numbers[contract.DECK_MASS])
        rate += deck + numbers[contract.DECK_DAMPING] / numbers[contract.DECK_MASS]
    if numbers[contract.BILATERAL] != 0.0:
        rate += 1.0
        if numbers[contract.DECK_MASS] > 0.0:
            rate += np.sqrt(1.0 / numbers[contract.DECK_MASS])
    return min(16.0, 2.0 / max(rate, 1e-3))
