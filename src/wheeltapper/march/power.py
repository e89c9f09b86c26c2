"""The power of all that changes the energy of wheel and deck, as short series at one instant.

Per unit of time N·y_k' (PATH), N·w (CONTACT_WORK) and D·v + γ·Z² (LOST), where the damper's force on the wheel is -D:
D = G·v, or G·v + B·e where the damper has an end of its own (damper_series.py). In contact as series in s, times
dt/ds = u, else in time.
"""

from __future__ import annotations

from wheeltapper.march import program as contract
from wheeltapper.march.damper_series import contact_with_end, flight_with_end, held
from wheeltapper.march.dense import touches
from wheeltapper.march.flight import bonded_series, flight_series, path_series
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import BUSH, DEGREE, FACTOR_DEGREE, HERE, WHEEL_V, F, N, T, U, W, Z
from wheeltapper.march.program import BONDED, DECK_V, DECK_Y, END_MODE, ON_DECK, PHASE, A, B, FloatArray
from wheeltapper.march.series import contact_series

SHORT, LONG = 4, 8
"""Terms in contact, where steps are short, and elsewhere."""
PATH, CONTACT_WORK, LOST = range(3)
POWERS = 3
ENOUGH = 5
"""Powers of the path in time beyond this do not reach the terms of a contact."""


@kernel
def _in_s(p: FloatArray, S: FloatArray) -> None:
    """Turn a series of SHORT terms in time into one in s."""
    a, b, c = S[T + 1], S[T + 2], S[T + 3]
    p[3] = p[1] * c + 2.0 * p[2] * a * b + p[3] * a * a * a
    p[2] = p[1] * b + p[2] * a * a
    p[1] = p[1] * a


@kernel
def _times(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Write the product of two series of SHORT terms."""
    out[0] = a[0] * b[0]
    out[1] = a[0] * b[1] + a[1] * b[0]
    out[2] = a[0] * b[2] + a[1] * b[1] + a[2] * b[0]
    out[3] = a[0] * b[3] + a[1] * b[2] + a[2] * b[1] + a[3] * b[0]


@kernel
def _contact_motion(
    numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray, wheel: FloatArray,
    path: FloatArray,
) -> None:  # fmt: skip
    """Fill the rows of a contact from a state, and the velocities of wheel and path as series in s."""
    on_deck = state[ON_DECK] != 0.0
    S[HERE + DEGREE] = min(S[HERE + DEGREE], ENOUGH)
    S[HERE + FACTOR_DEGREE] = min(S[HERE + FACTOR_DEGREE], ENOUGH)
    if damper is None:
        contact_series(numbers, SHORT, state[A], state[B], state[DECK_Y], state[DECK_V], on_deck, S)
        path_series(SHORT, S)
        for n in range(SHORT):
            path[n] = (n + 1) * S[F + n + 1]
        _in_s(path, S)
        for n in range(SHORT):
            wheel[n] = path[n] - S[W + n] + (S[Z + n] if on_deck else 0.0)
    else:
        contact_with_end(numbers, SHORT, damper, state, S)
        for n in range(SHORT):
            wheel[n] = S[WHEEL_V + n]
            path[n] = wheel[n] + S[W + n] - (S[Z + n] if on_deck else 0.0)


@kernel
def _brake(numbers: FloatArray, damper: FloatArray | None, state: FloatArray) -> tuple[float, float]:
    """Return G and B of what holds the damper's end."""
    if damper is None:
        return numbers[contract.DAMPING], 0.0
    else:  # noqa: RET505 - Numba prunes whole branches only
        G, soft, _ = held(state[END_MODE], damper)
        return G, soft


@kernel
def _contact_power(
    numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray, P: FloatArray, out: FloatArray
) -> None:
    """Write the power in a contact."""
    wheel, path, pushed, lost = P[0], P[1], P[2], P[3]
    _contact_motion(numbers, damper, state, S, wheel, path)
    _times(S[N : N + SHORT], S[U : U + SHORT], pushed)
    _times(pushed, path, out[PATH])
    _times(pushed, S[W : W + SHORT], out[CONTACT_WORK])
    G, soft = _brake(numbers, damper, state)
    for n in range(SHORT):
        pushed[n] = G * wheel[n] + soft * S[BUSH + n]
    _times(pushed, wheel, lost)
    bearing = numbers[contract.DECK_DAMPING]
    if bearing > 0.0:
        _times(S[Z : Z + SHORT], S[Z : Z + SHORT], wheel)
        for n in range(SHORT):
            lost[n] += bearing * wheel[n]
    _times(lost, S[U : U + SHORT], out[LOST])


@kernel
def _free_power(
    numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray, out: FloatArray
) -> None:
    """Write the power without contact force, or in a bilateral contact."""
    on_deck, bonded = state[ON_DECK] != 0.0, state[PHASE] == BONDED
    if damper is not None:
        flight_with_end(numbers, damper, state, S)
    elif bonded:
        bonded_series(numbers, LONG, state[A], state[B], state[DECK_Y], state[DECK_V], on_deck, S)
    else:
        flight_series(numbers, LONG, state[A], state[B], state[DECK_Y], state[DECK_V], on_deck, S)
    G, soft = _brake(numbers, damper, state)
    bearing = numbers[contract.DECK_DAMPING]
    out[:] = 0.0
    for n in range(LONG):
        for j in range(n + 1):
            out[LOST, n] += (G * S[W + j] + soft * S[BUSH + j]) * S[W + n - j]
            if bearing > 0.0:
                out[LOST, n] += bearing * S[Z + j] * S[Z + n - j]
            if bonded:
                path = (n - j + 1) * S[F + n - j + 1]
                wheel = S[W + n - j] - (S[Z + n - j] if on_deck else 0.0)
                out[PATH, n] += S[N + j] * path
                out[CONTACT_WORK, n] += S[N + j] * (path - wheel)


@kernel
def power(
    numbers: FloatArray, damper: FloatArray | None, state: FloatArray, S: FloatArray, P: FloatArray, out: FloatArray
) -> None:
    """Write the power in a state whose piece stands in S into `out` (POWERS, LONG).

    `damper` is None where the wheel holds its end: its type tells the compiler which series to leave out.
    """
    if touches(state):
        _contact_power(numbers, damper, state, S, P, out)
    else:
        _free_power(numbers, damper, state, S, out)
