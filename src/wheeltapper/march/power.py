"""The powers that change the energy of wheel and deck, as short series at one instant.

Per unit of time N·y_k' (PATH), N·w (CONTACT_WORK) and D·v + γ·Z² (LOST), where the damper's force on the wheel is -D:
D = G·v, or G·v + B·e where the damper has an end of its own (held_end.py). In contact as series in s, times
dt/ds = u, else in time.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.events import is_contact_phase
from wheeltapper.march.flight import path_series
from wheeltapper.march.held_end import held_coefficients
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import (
    BUSH,
    CLEAR,
    COMP,
    TREND,
    WHEEL_V,
    WHEEL_Y,
    WORK,
    F,
    N,
    T,
    U,
    W,
    Z,
)
from wheeltapper.march.program import BONDED, DECK_Y, END_MODE, ON_DECK, PHASE, A, B, FloatArray
from wheeltapper.march.step import repeat_step

SHORT, LONG = 4, 8
"""Number of terms of the series: in contact, where steps are short, and elsewhere."""
PATH_WORK, CONTACT_WORK, LOST = 0, LONG, 2 * LONG
POWER_TERMS = 3 * LONG
"""Where in an array each power's series stands, and how long the array is."""


def _hermite_weights(terms: int) -> FloatArray:
    """Return the weights of Hermite's rule for the series at the start; for that at the end, signs alternate."""
    k = terms - 1
    return np.array([
        factorial(k + 1) / factorial(2 * k + 2) * factorial(2 * k + 1 - j) / factorial(k - j) / (j + 1)
        for j in range(terms)
    ])  # fmt: skip


SHORT_RULE, LONG_RULE = _hermite_weights(SHORT), _hermite_weights(LONG)
# Rows of S that are free once the series of a contact are known: the path's velocity, N·u, D and what is lost.
PATH_V, PUSHED, BRAKED, SPENT = CLEAR, TREND, COMP, WORK


@kernel
def _multiply_series(a: int, b: int, S: FloatArray, out: FloatArray, first: int) -> None:
    """Write the product of two rows of S, SHORT terms, from out[first] on."""
    out[first] = S[a] * S[b]
    out[first + 1] = S[a] * S[b + 1] + S[a + 1] * S[b]
    out[first + 2] = S[a] * S[b + 2] + S[a + 1] * S[b + 1] + S[a + 2] * S[b]
    out[first + 3] = S[a] * S[b + 3] + S[a + 1] * S[b + 2] + S[a + 2] * S[b + 1] + S[a + 3] * S[b]


@kernel
def _path_velocity(S: FloatArray) -> None:
    """Fill row PATH_V from the path's series in time in row F, as a series in s."""
    a, b, c = S[T + 1], S[T + 2], S[T + 3]
    first, second, third = 2.0 * S[F + 2], 3.0 * S[F + 3], 4.0 * S[F + 4]
    S[PATH_V] = S[F + 1]
    S[PATH_V + 1] = first * a
    S[PATH_V + 2] = first * b + second * a * a
    S[PATH_V + 3] = first * c + 2.0 * second * a * b + third * a * a * a


@kernel
def _contact_motion(damper: FloatArray | None, state: FloatArray, S: FloatArray) -> float:
    """Fill rows WHEEL_V and PATH_V of a contact whose series stand in S; return the wheel's displacement."""
    on_deck = state[ON_DECK] != 0.0
    if damper is None:
        path_series(SHORT, S)
        _path_velocity(S)
        for n in range(SHORT):
            S[WHEEL_V + n] = S[PATH_V + n] - S[W + n] + (S[Z + n] if on_deck else 0.0)
        return S[F] - state[A] * state[A] + (state[DECK_Y] if on_deck else 0.0)
    else:  # noqa: RET505 - Numba prunes whole branches only
        for n in range(SHORT):
            S[PATH_V + n] = S[WHEEL_V + n] + S[W + n] - (S[Z + n] if on_deck else 0.0)
        return S[WHEEL_Y]


@kernel
def _damping_at_end(numbers: FloatArray, damper: FloatArray | None, state: FloatArray) -> tuple[float, float]:
    """Return G and B of what holds the damper's end."""
    if damper is None:
        return numbers[contract.DAMPING], 0.0
    else:  # noqa: RET505 - Numba prunes whole branches only
        G, soft, _ = held_coefficients(state[END_MODE], damper)
        return G, soft


@kernel
def _contact_power(
    numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray, out: FloatArray
) -> tuple[float, float]:
    """Write the power in a contact; return the wheel's motion."""
    y = _contact_motion(damper, state, S)
    _multiply_series(N, U, S, S, PUSHED)
    _multiply_series(PUSHED, PATH_V, S, out, PATH_WORK)
    _multiply_series(PUSHED, W, S, out, CONTACT_WORK)
    G, soft = _damping_at_end(numbers, damper, state)
    for n in range(SHORT):
        S[BRAKED + n] = G * S[WHEEL_V + n] + soft * S[BUSH + n]
    _multiply_series(BRAKED, WHEEL_V, S, S, SPENT)
    bearing = numbers[contract.DECK_DAMPING]
    if bearing > 0.0:
        _multiply_series(Z, Z, S, S, BRAKED)
        for n in range(SHORT):
            S[SPENT + n] += bearing * S[BRAKED + n]
    _multiply_series(SPENT, U, S, out, LOST)
    return y, S[WHEEL_V]


@kernel
def _free_power(
    numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray, out: FloatArray
) -> None:
    """Write the power without contact force, or in a bilateral contact."""
    on_deck, bonded = state[ON_DECK] != 0.0, state[PHASE] == BONDED
    G, soft = _damping_at_end(numbers, damper, state)
    bearing = numbers[contract.DECK_DAMPING]
    out[:] = 0.0
    for n in range(LONG):
        for j in range(n + 1):
            k = n - j
            out[LOST + n] += (G * S[W + j] + soft * S[BUSH + j]) * S[W + k]
            if bearing > 0.0:
                out[LOST + n] += bearing * S[Z + j] * S[Z + k]
            if bonded:
                path = (k + 1) * S[F + k + 1]
                wheel = S[W + k] - (S[Z + k] if on_deck else 0.0)
                out[PATH_WORK + n] += S[N + j] * path
                out[CONTACT_WORK + n] += S[N + j] * (path - wheel)


@kernel
def write_power(
    pieces: FloatArray, numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray,
    out: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Write the power in a state whose piece stands in S into `out` (POWER_TERMS,); return the wheel's motion.

    `damper` is None where the wheel holds its end: its type tells the compiler which series to leave out.
    """
    repeat_step(pieces, numbers, damper, state, S)
    if is_contact_phase(state[PHASE]):
        return _contact_power(numbers, damper, state, S, out)
    _free_power(numbers, damper, state, S, out)
    return state[A], state[B]
