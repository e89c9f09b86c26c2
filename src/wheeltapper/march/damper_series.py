"""Taylor series of one step of a wheel whose damper has an end that moves: with play, or with a bush in series.

Displacement y and velocity v of the wheel have rows of their own, in contact too: where the end meets or leaves a stop
is a root of one of them. With the deflection e of the bush, and all else as in series.py, a contact step in s follows

    y' = u·v     v' = u·a     a = N - 1 - K·y - G·v - B·e     e' = u·(v - β·e)     w' = u·(y_k'' + A - a)

A step in flight is the same in time, with u = 1 and N = 0. G is the damping where the end is rigid, B and β are the
constants of a bush. While the end is free, all three are zero. The DAMPING among the numbers is zero in such a program.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march import layout
from wheeltapper.march import program as contract
from wheeltapper.march.flight import flight_series
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import F, N, Q, R, T, U, W, Y, Z
from wheeltapper.march.program import DECK_V, DECK_Y, ON_DECK, A, B, FloatArray
from wheeltapper.march.series import _next_horner, _start_horner, rail_at


@kernel
def held_coefficients(mode: float, damper: FloatArray) -> tuple[float, float, float]:
    """Return G of a rigid end, B and β of a bush, as far as something holds the end."""
    if mode == contract.FREE:
        return 0.0, 0.0, 0.0
    if damper[contract.DAMPER_BUSH] > 0.0:
        return 0.0, damper[contract.DAMPER_BUSH], damper[contract.DAMPER_BUSH] / damper[contract.DAMPER_DAMPING]
    return damper[contract.DAMPER_DAMPING], 0.0, 0.0


@kernel
def _product_coefficient(a: int, b: int, n: int, S: FloatArray) -> float:
    """Return coefficient n of the product of two rows."""
    total = 0.0
    for j in range(n + 1):
        total += S[a + j] * S[b + n - j]
    return total


@kernel
def _path_acceleration(S: FloatArray) -> int:
    """Put the polynomial part of y_k'' in row COMP; return its degree."""
    degree = int(S[layout.HERE_DEGREE])
    if degree < 2:
        S[layout.COMP] = 0.0
        return 0
    for k in range(degree - 1):
        S[layout.COMP + k] = (k + 2) * (k + 1) * S[layout.HERE_POLY + k + 2]
    return degree - 2


@kernel
def _set_order_zero(state: FloatArray, S: FloatArray) -> None:
    """Set order zero of all rows from the state at the step's start."""
    height, velocity = rail_at(0.0, state, S)
    S[T] = 0.0
    S[U] = state[A]
    S[W] = state[B]
    S[Y] = state[DECK_Y]
    S[Z] = state[DECK_V]
    S[layout.WHEEL_Y] = height - state[A] * state[A]
    S[layout.WHEEL_V] = velocity - state[B]
    S[layout.BUSH] = state[contract.END_DEFLECTION]
    S[layout.SINES] = sin(S[layout.HERE_PHASE0])
    S[layout.COSINES] = cos(S[layout.HERE_PHASE0])


@kernel
def _contact_force(numbers: FloatArray, n: int, S: FloatArray) -> float:
    """Advance the rows of the contact force to order n."""
    S[Q + n] = _product_coefficient(U, U, n, S)
    S[R + n] = numbers[contract.QUADRATIC] * S[Q + n] + numbers[contract.CUBIC] * _product_coefficient(Q, U, n, S)
    S[F + n] = S[R + n]
    degree = int(S[layout.HERE_FACTOR_DEGREE])
    if degree >= 0:
        if n > 0:
            _next_horner(n, degree, layout.HORNER_FACTOR, S)
        S[F + n] = _product_coefficient(layout.HORNER_FACTOR, R, n, S)
    S[N + n] = S[F + n]
    if numbers[contract.HYSTERESIS] != 0.0:
        S[N + n] += numbers[contract.HYSTERESIS] * _product_coefficient(F, W, n, S)
    return S[N + n]


@kernel
def contact_with_end(numbers: FloatArray, order: int, damper: FloatArray, state: FloatArray, S: FloatArray) -> None:
    """Fill the rows of one contact step up to `order` from a state (or a row of steps), N up to one order less."""
    K = numbers[contract.STIFFNESS]
    mass = numbers[contract.DECK_MASS]
    G, soft, rate = held_coefficients(state[contract.END_MODE], damper)
    on_deck = state[ON_DECK] != 0.0
    omega = S[layout.HERE_OMEGA]
    degree = _path_acceleration(S)
    _set_order_zero(state, S)
    _start_horner(layout.COMP, degree, layout.HORNER, S)
    if S[layout.HERE_FACTOR_DEGREE] >= 0.0:
        _start_horner(layout.HERE_FACTOR, int(S[layout.HERE_FACTOR_DEGREE]), layout.HORNER_FACTOR, S)
    for n in range(order):
        part = 1.0 / (n + 1)
        force = _contact_force(numbers, n, S)
        if n > 0:
            _next_horner(n, degree, layout.HORNER, S)
        S[layout.WHEEL_A + n] = force - K * S[layout.WHEEL_Y + n] - G * S[layout.WHEEL_V + n]
        S[layout.WHEEL_A + n] -= soft * S[layout.BUSH + n]
        if n == 0:
            S[layout.WHEEL_A] -= 1.0
        S[layout.WORK + n] = S[layout.HORNER + n] - S[layout.WHEEL_A + n]
        if omega != 0.0:
            wave = S[layout.HERE_AMP_SIN] * S[layout.SINES + n] + S[layout.HERE_AMP_COS] * S[layout.COSINES + n]
            S[layout.WORK + n] -= omega * omega * wave
            S[layout.SINES + n + 1] = omega * part * _product_coefficient(U, layout.COSINES, n, S)
            S[layout.COSINES + n + 1] = -omega * part * _product_coefficient(U, layout.SINES, n, S)
        S[Y + n + 1] = 0.0
        S[Z + n + 1] = 0.0
        if mass > 0.0:
            pull = -numbers[contract.DECK_STIFFNESS] * S[Y + n] - numbers[contract.DECK_DAMPING] * S[Z + n]
            if on_deck:
                pull -= force
                if n == 0:
                    pull += numbers[contract.PRESTRESS]
            S[layout.ACC + n] = pull / mass
            if on_deck:
                S[layout.WORK + n] += S[layout.ACC + n]
            S[Y + n + 1] = part * _product_coefficient(U, Z, n, S)
            S[Z + n + 1] = part * _product_coefficient(U, layout.ACC, n, S)
        S[layout.BUSH + n + 1] = 0.0
        if soft > 0.0:
            S[layout.BUSH_RATE + n] = S[layout.WHEEL_V + n] - rate * S[layout.BUSH + n]
            S[layout.BUSH + n + 1] = part * _product_coefficient(U, layout.BUSH_RATE, n, S)
        S[T + n + 1] = part * S[U + n]
        S[U + n + 1] = 0.5 * part * S[W + n]
        S[W + n + 1] = part * _product_coefficient(U, layout.WORK, n, S)
        S[layout.WHEEL_Y + n + 1] = part * _product_coefficient(U, layout.WHEEL_V, n, S)
        S[layout.WHEEL_V + n + 1] = part * _product_coefficient(U, layout.WHEEL_A, n, S)


@kernel
def flight_with_end(numbers: FloatArray, damper: FloatArray, state: FloatArray, S: FloatArray) -> None:
    """Fill U (y), W (v), CLEAR, BUSH and, with a deck, Y and Z, as series in time from a state (or a row of steps)."""
    on_deck = state[ON_DECK] != 0.0
    flight_series(numbers, layout.FLIGHT_ORDER, state[A], state[B], state[DECK_Y], state[DECK_V], on_deck, S)
    G, soft, rate = held_coefficients(state[contract.END_MODE], damper)
    S[layout.BUSH] = state[contract.END_DEFLECTION]
    if G == 0.0 and soft == 0.0:
        return
    for n in range(layout.FLIGHT_ORDER):
        part = 1.0 / (n + 1)
        pull = numbers[contract.STIFFNESS] * S[U + n] + G * S[W + n] + soft * S[layout.BUSH + n]
        if n == 0:
            pull += 1.0
        S[U + n + 1] = part * S[W + n]
        S[W + n + 1] = -part * pull
        S[layout.BUSH + n + 1] = part * (S[W + n] - rate * S[layout.BUSH + n]) if soft > 0.0 else 0.0
        S[layout.CLEAR + n + 1] = S[F + n + 1] - S[U + n + 1]
        if on_deck:
            S[layout.CLEAR + n + 1] += S[Y + n + 1]


@kernel
def flight_reach_with_end(numbers: FloatArray, damper: FloatArray, state: FloatArray) -> float:
    """Return the time over which those series of wheel and bush are exact to rounding."""
    G, soft, rate = held_coefficients(state[contract.END_MODE], damper)
    return 2.0 / max(np.sqrt(numbers[contract.STIFFNESS]) + G + np.sqrt(soft) + rate, 1e-3)
