"""Taylor series in time of one step without contact force, or in a bilateral contact."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march import layout
from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import F, N, U, W, Y, Z
from wheeltapper.march.program import FloatArray


@kernel
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


@kernel
def free_series(
    K: float, G: float, load: float, y: float, v: float, row: int, rate: int, order: int, S: FloatArray
) -> None:
    """Fill two rows with the motion of a mass of one on its spring and damper, as series in time."""
    S[row] = y
    S[rate] = v
    for n in range(order):
        part = 1.0 / (n + 1)
        next_v = (load - K * y - G * v) * part
        y = v * part
        v = next_v
        load = 0.0
        S[row + n + 1] = y
        S[rate + n + 1] = v


@kernel
def flight_series(
    numbers: FloatArray, order: int, y: float, v: float, deck_y: float, deck_v: float, on_deck: bool, S: FloatArray
) -> None:
    """Fill U (y), W (v), CLEAR (y_k + Y - y) and, with a deck, Y and Z up to `order`, as series in time."""
    path_series(order, S)
    free_series(numbers[contract.STIFFNESS], numbers[contract.DAMPING], -1.0, y, v, U, W, order, S)
    for n in range(order + 1):
        S[layout.CLEAR + n] = S[F + n] - S[U + n]
    mass = numbers[contract.DECK_MASS]
    if mass > 0.0:
        load = numbers[contract.PRESTRESS] / mass if on_deck else 0.0
        free_series(
            numbers[contract.DECK_STIFFNESS] / mass, numbers[contract.DECK_DAMPING] / mass, load, deck_y, deck_v,
            Y, Z, order, S,
        )  # fmt: skip
        if on_deck:
            for n in range(order + 1):
                S[layout.CLEAR + n] += S[Y + n]


@kernel
def bonded_series(
    numbers: FloatArray, order: int, y: float, v: float, deck_y: float, deck_v: float, on_deck: bool, S: FloatArray
) -> None:
    """Fill the same rows in a bilateral contact, and N = factor·(y_k + Y - y), tension included."""
    deck = numbers[contract.DECK_MASS] > 0.0
    fdegree = int(S[layout.HERE_FACTOR_DEGREE])
    path_series(order, S)
    S[U] = y
    S[W] = v
    S[Y] = deck_y
    S[Z] = deck_v
    for n in range(order + 1):
        S[layout.CLEAR + n] = S[F + n] - S[U + n] + (S[Y + n] if on_deck else 0.0)
        force = S[layout.CLEAR + n]
        if fdegree >= 0:
            force = 0.0
            for j in range(min(n, fdegree) + 1):
                force += S[layout.HERE_FACTOR + j] * S[layout.CLEAR + n - j]
        S[N + n] = force
        if n == order:
            break
        a = force - numbers[contract.STIFFNESS] * S[U + n] - numbers[contract.DAMPING] * S[W + n]
        b = -numbers[contract.DECK_STIFFNESS] * S[Y + n] - numbers[contract.DECK_DAMPING] * S[Z + n]
        if on_deck:
            b -= force
        if n == 0:
            a -= 1.0
            if on_deck:
                b += numbers[contract.PRESTRESS]
        S[U + n + 1] = S[W + n] / (n + 1)
        S[W + n + 1] = a / (n + 1)
        S[Y + n + 1] = S[Z + n] / (n + 1) if deck else 0.0
        S[Z + n + 1] = b / numbers[contract.DECK_MASS] / (n + 1) if deck else 0.0


@kernel
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
