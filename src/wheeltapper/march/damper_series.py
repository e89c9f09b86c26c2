"""Taylor series of one step with a damper whose end moves on its own: with play, or with a bush in series.

The wheel's displacement y and velocity v have rows of their own in contact too: events of the end are their roots. With
e the deflection of the bush, and all else as in series.py:

    y' = u·v     v' = u·a     a = N - 1 - K·y - G·v - B·e     e' = u·(v - β·e)     w' = u·(y_k'' + A - a)

In flight the same with u = 1, N = 0. G (a rigid end) or B and β (a bush) are those of what holds the end; while it is
free, all are zero. The numbers' own DAMPING is zero.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.flight import flight_series
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import (
    ACC,
    BUSH,
    BUSH_RATE,
    CLEAR,
    COMP,
    COSINES,
    FLIGHT_ORDER,
    HERE_AMP_COS,
    HERE_AMP_SIN,
    HERE_DEGREE,
    HERE_FACTOR,
    HERE_FACTOR_DEGREE,
    HERE_OMEGA,
    HERE_PHASE0,
    HERE_POLY,
    HORNER,
    HORNER_FACTOR,
    SINES,
    WHEEL_A,
    WHEEL_V,
    WHEEL_Y,
    WORK,
    F,
    N,
    Q,
    R,
    T,
    U,
    W,
    Y,
    Z,
)  # fmt: skip
from wheeltapper.march.program import (
    DAMPER_BUSH,
    DAMPER_DAMPING,
    DECK_V,
    DECK_Y,
    END_DEFLECTION,
    END_MODE,
    FREE,
    ON_DECK,
    A,
    B,
    FloatArray,
)
from wheeltapper.march.series import _next_horner, _start_horner, path_at


@kernel
def held(mode: float, damper: FloatArray) -> tuple[float, float, float]:
    """Return G of a rigid end, B and β of a bush, as far as something holds the end."""
    if mode == FREE:
        return 0.0, 0.0, 0.0
    if damper[DAMPER_BUSH] > 0.0:
        return 0.0, damper[DAMPER_BUSH], damper[DAMPER_BUSH] / damper[DAMPER_DAMPING]
    return damper[DAMPER_DAMPING], 0.0, 0.0


@kernel
def _product(a: int, b: int, n: int, S: FloatArray) -> float:
    """Return coefficient n of the product of two rows."""
    total = 0.0
    for j in range(n + 1):
        total += S[a + j] * S[b + n - j]
    return total


@kernel
def _bending(S: FloatArray) -> int:
    """Put the polynomial part of y_k'' in row COMP; return its degree."""
    degree = int(S[HERE_DEGREE])
    if degree < 2:
        S[COMP] = 0.0
        return 0
    for k in range(degree - 1):
        S[COMP + k] = (k + 2) * (k + 1) * S[HERE_POLY + k + 2]
    return degree - 2


@kernel
def _start(state: FloatArray, S: FloatArray) -> None:
    """Set order zero of all rows from the state at the step's start."""
    height, velocity, _ = path_at(0.0, S)
    if state[ON_DECK] != 0.0:
        height += state[DECK_Y]
        velocity += state[DECK_V]
    S[T] = 0.0
    S[U] = state[A]
    S[W] = state[B]
    S[Y] = state[DECK_Y]
    S[Z] = state[DECK_V]
    S[WHEEL_Y] = height - state[A] * state[A]
    S[WHEEL_V] = velocity - state[B]
    S[BUSH] = state[END_DEFLECTION]
    S[SINES] = sin(S[HERE_PHASE0])
    S[COSINES] = cos(S[HERE_PHASE0])


@kernel
def _contact_force(numbers: FloatArray, n: int, S: FloatArray) -> float:
    """Advance the rows of the contact force to order n."""
    S[Q + n] = _product(U, U, n, S)
    S[R + n] = numbers[contract.QUADRATIC] * S[Q + n] + numbers[contract.CUBIC] * _product(Q, U, n, S)
    S[F + n] = S[R + n]
    degree = int(S[HERE_FACTOR_DEGREE])
    if degree >= 0:
        if n > 0:
            _next_horner(n, degree, HORNER_FACTOR, S)
        S[F + n] = _product(HORNER_FACTOR, R, n, S)
    S[N + n] = S[F + n]
    if numbers[contract.HYSTERESIS] != 0.0:
        S[N + n] += numbers[contract.HYSTERESIS] * _product(F, W, n, S)
    return S[N + n]


@kernel
def contact_with_end(numbers: FloatArray, order: int, damper: FloatArray, state: FloatArray, S: FloatArray) -> None:
    """Fill the rows of one contact step up to `order` from a state (or a row of steps), N up to one order less."""
    K = numbers[contract.STIFFNESS]
    mass = numbers[contract.DECK_MASS]
    G, soft, rate = held(state[END_MODE], damper)
    on_deck = state[ON_DECK] != 0.0
    omega = S[HERE_OMEGA]
    degree = _bending(S)
    _start(state, S)
    _start_horner(COMP, degree, HORNER, S)
    if S[HERE_FACTOR_DEGREE] >= 0.0:
        _start_horner(HERE_FACTOR, int(S[HERE_FACTOR_DEGREE]), HORNER_FACTOR, S)
    for n in range(order):
        part = 1.0 / (n + 1)
        force = _contact_force(numbers, n, S)
        if n > 0:
            _next_horner(n, degree, HORNER, S)
        S[WHEEL_A + n] = force - K * S[WHEEL_Y + n] - G * S[WHEEL_V + n] - soft * S[BUSH + n]
        if n == 0:
            S[WHEEL_A] -= 1.0
        S[WORK + n] = S[HORNER + n] - S[WHEEL_A + n]
        if omega != 0.0:
            S[WORK + n] -= omega * omega * (S[HERE_AMP_SIN] * S[SINES + n] + S[HERE_AMP_COS] * S[COSINES + n])
            S[SINES + n + 1] = omega * part * _product(U, COSINES, n, S)
            S[COSINES + n + 1] = -omega * part * _product(U, SINES, n, S)
        S[Y + n + 1] = 0.0
        S[Z + n + 1] = 0.0
        if mass > 0.0:
            pull = -numbers[contract.DECK_STIFFNESS] * S[Y + n] - numbers[contract.DECK_DAMPING] * S[Z + n]
            if on_deck:
                pull -= force
                if n == 0:
                    pull += numbers[contract.PRESTRESS]
            S[ACC + n] = pull / mass
            if on_deck:
                S[WORK + n] += S[ACC + n]
            S[Y + n + 1] = part * _product(U, Z, n, S)
            S[Z + n + 1] = part * _product(U, ACC, n, S)
        S[BUSH + n + 1] = 0.0
        if soft > 0.0:
            S[BUSH_RATE + n] = S[WHEEL_V + n] - rate * S[BUSH + n]
            S[BUSH + n + 1] = part * _product(U, BUSH_RATE, n, S)
        S[T + n + 1] = part * S[U + n]
        S[U + n + 1] = 0.5 * part * S[W + n]
        S[W + n + 1] = part * _product(U, WORK, n, S)
        S[WHEEL_Y + n + 1] = part * _product(U, WHEEL_V, n, S)
        S[WHEEL_V + n + 1] = part * _product(U, WHEEL_A, n, S)


@kernel
def flight_with_end(numbers: FloatArray, damper: FloatArray, state: FloatArray, S: FloatArray) -> None:
    """Fill U (y), W (v), CLEAR, BUSH and, with a deck, Y and Z, as series in time from a state (or a row of steps)."""
    on_deck = state[ON_DECK] != 0.0
    flight_series(numbers, FLIGHT_ORDER, state[A], state[B], state[DECK_Y], state[DECK_V], on_deck, S)
    G, soft, rate = held(state[END_MODE], damper)
    S[BUSH] = state[END_DEFLECTION]
    if G == 0.0 and soft == 0.0:
        return
    for n in range(FLIGHT_ORDER):
        part = 1.0 / (n + 1)
        pull = numbers[contract.STIFFNESS] * S[U + n] + G * S[W + n] + soft * S[BUSH + n]
        if n == 0:
            pull += 1.0
        S[U + n + 1] = part * S[W + n]
        S[W + n + 1] = -part * pull
        S[BUSH + n + 1] = part * (S[W + n] - rate * S[BUSH + n]) if soft > 0.0 else 0.0
        S[CLEAR + n + 1] = S[F + n + 1] - S[U + n + 1]
        if on_deck:
            S[CLEAR + n + 1] += S[Y + n + 1]


@kernel
def flight_reach_with_end(numbers: FloatArray, damper: FloatArray, state: FloatArray) -> float:
    """Return the time over which those series of wheel and bush are exact to rounding."""
    G, soft, rate = held(state[END_MODE], damper)
    return 2.0 / max(np.sqrt(numbers[contract.STIFFNESS]) + G + np.sqrt(soft) + rate, 1e-3)
