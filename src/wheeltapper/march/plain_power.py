"""Energy and power of wheel and deck in an elastic contact, at several instants at once, as straight-line code.

Contacts that do not yield, under a damper without an end of its own: what nearly all marches are made of. Their steps
are straight-line code too, and by power.py their check would take longer than they. A row of `L` holds
one quantity at all instants. The loops over them have no branch and no call, and every offset is known when they are
compiled: then LLVM turns them into vectors.
"""

from __future__ import annotations

from math import factorial, pi

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.power import SHORT_RULE
from wheeltapper.march.program import DECK_V, DECK_Y, LENGTH, ON_DECK, PIECE, SHIFT, TIME, A, B, FloatArray

STATES = 16
"""Number of instants in a row."""
# Of each instant: the time, u and w, the deck's Y and Z, lengths of the steps before and after it (0: none), the path
# and the factor on the force in powers of time.
(
    WHEN, U0, W0, DECK_PLACE, SWING, STEP_BEFORE, STEP_AFTER, P0, P1, P2, P3, P4, F0, F1, F2, F3, F4,
) = range(0, 17 * STATES, STATES)  # fmt: skip
# What is found: the energy, what this end of the steps before and after adds to the integrals of its rate over them by
# Hermite's rule, the powers of the path, of the contact and of what is lost times u, and the wheel's kinetic energy.
ENERGY, GAIN_BEFORE, GAIN_AFTER, WORKING, GAINING, LOSING, KINETIC = range(17 * STATES, 24 * STATES, STATES)
ENTRIES = 24 * STATES
TIME_POWERS = 5
"""Powers of time that reach the terms of a contact."""
FULL_TURN = 2.0 * pi
S1, S2, S3, S4, S5, S6, S7 = ((-1) ** k / factorial(2 * k + 1) for k in range(1, 8))
C1, C2, C3, C4, C5, C6, C7, C8 = ((-1) ** k / factorial(2 * k) for k in range(1, 9))
WEIGHT_1, WEIGHT_2, WEIGHT_3, WEIGHT_4 = (float(weight) for weight in SHORT_RULE)


@kernel
def _in_time(
    pieces: FloatArray, piece: int, source: int, degree: int, at: float, rate: float, gain: float, work: FloatArray,
    first: int, L: FloatArray,
) -> None:  # fmt: skip
    """Write gain·Σ pieces[piece, source + k]·ξ^k, ξ = at + rate·τ, in powers of τ from L[first] on, one a row."""
    for k in range(contract.TERMS):
        work[k] = pieces[piece, source + k] if k <= degree else 0.0
    for i in range(min(degree, TIME_POWERS)):
        for k in range(degree - 1, i - 1, -1):
            work[k] += at * work[k + 1]
    for k in range(TIME_POWERS):
        L[first + k * STATES] = gain * work[k]
        gain *= rate


@kernel
def _add_harmonic(rate: float, offset: float, amp_sin: float, amp_cos: float, L: FloatArray) -> None:
    """Add a harmonic, whose phase is rate·time - offset in turns, to the path at all instants."""
    omega = FULL_TURN * rate
    square = 0.5 * omega * omega
    for i in range(STATES):
        turns = rate * L[WHEN + i] - offset
        x = 0.25 * FULL_TURN * (turns - np.rint(turns))
        z = x * x
        s = x * (1.0 + z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * (S6 + z * S7)))))))
        c = 1.0 + z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * (C6 + z * (C7 + z * C8)))))))
        s, c = 2.0 * s * c, c * c - s * s
        s, c = 2.0 * s * c, c * c - s * s
        h, d = amp_sin * s + amp_cos * c, omega * (amp_sin * c - amp_cos * s)
        L[P0 + i] += h
        L[P1 + i] += d
        L[P2 + i] -= square * h
        L[P3 + i] -= square * d / 3.0
        L[P4 + i] += square * square * h / 6.0


@kernel
def _put_path(pieces: FloatArray, numbers: FloatArray, state: FloatArray, count: int, L: FloatArray) -> None:
    """Write path and factor at the first instants, whose times stand in L, all on the piece of a state."""
    piece = int(state[PIECE])
    pace, lift, scale = numbers[contract.PACE], numbers[contract.LIFT], pieces[piece, contract.SCALE]
    origin = state[SHIFT] + pieces[piece, contract.CENTRE]
    degree, factor_degree = int(pieces[piece, contract.DEGREE]), int(pieces[piece, contract.FACTOR_DEGREE])
    for row in range(P0, F3 + STATES, STATES):
        value = lift * pieces[piece, contract.COEFFICIENT] if row == P0 else 1.0 if row == F0 else 0.0
        for i in range(STATES):
            L[row + i] = value
    if degree > 0 or factor_degree >= 0:
        work = np.empty(contract.TERMS)
        for i in range(count):
            at, rate = (pace * L[WHEN + i] - origin) / scale, pace / scale
            _in_time(pieces, piece, contract.COEFFICIENT, degree, at, rate, lift, work, P0 + i, L)
            if factor_degree >= 0:
                _in_time(pieces, piece, contract.FACTOR, factor_degree, at, rate, 1.0, work, F0 + i, L)
    turns = pieces[piece, contract.WAVENUMBER] / FULL_TURN
    if turns != 0.0:
        amp_sin, amp_cos = lift * pieces[piece, contract.SINE], lift * pieces[piece, contract.COSINE]
        _add_harmonic(turns * pace, turns * origin, amp_sin, amp_cos, L)


@kernel
def _power(numbers: FloatArray, on_deck: float, L: FloatArray) -> None:
    """Find energy and power at all instants, whose motion and path stand in L, all on the deck (1) or beside it (0)."""
    K, G, eta = numbers[contract.STIFFNESS], numbers[contract.DAMPING], numbers[contract.HYSTERESIS]
    quadratic, cubic, prestress = numbers[contract.QUADRATIC], numbers[contract.CUBIC], numbers[contract.PRESTRESS]
    mass, stiff, drag = numbers[contract.DECK_MASS], numbers[contract.DECK_STIFFNESS], numbers[contract.DECK_DAMPING]
    per_mass = 1.0 / mass if mass > 0.0 else 0.0
    for i in range(STATES):
        u0, w0, Y0, Z0 = L[U0 + i], L[W0 + i], L[DECK_PLACE + i], L[SWING + i]
        p2, p3, p4 = 2.0 * L[P2 + i], 3.0 * L[P3 + i], 4.0 * L[P4 + i]
        f0, f1, f2, f3 = L[F0 + i], L[F1 + i], L[F2 + i], L[F3 + i]
        # -- series in s: time t, the path's velocity e, indentation q, the contact force without hysteresis x and with
        # it n, wheel y and v, deck Y and Z, forces of contact and damper on the wheel a and against the deck b
        t1, u1, q0, e0 = u0, 0.5 * w0, u0 * u0, L[P1 + i]
        y0, v0 = L[P0 + i] + on_deck * Y0 - q0, e0 + on_deck * Z0 - w0
        c0 = q0 * (quadratic + cubic * u0)
        x0 = f0 * c0
        n0 = x0 * (1.0 + eta * w0)
        a0, b0 = n0 - G * v0, on_deck * n0 + drag * Z0
        fall0, sink0 = a0 - 1.0 - K * y0, per_mass * (on_deck * prestress - b0 - stiff * Y0)
        y1, v1, Y1, Z1 = u0 * v0, u0 * fall0, u0 * Z0, u0 * sink0
        e1 = p2 * t1
        w1 = e1 + on_deck * Z1 - v1
        t2, u2, q1 = 0.5 * u1, 0.25 * w1, 2.0 * u0 * u1
        c1 = q1 * (quadratic + 1.5 * cubic * u0)
        g1 = f1 * t1
        x1 = f0 * c1 + g1 * c0
        n1 = x1 + eta * (x0 * w1 + x1 * w0)
        a1, b1 = n1 - G * v1, on_deck * n1 + drag * Z1
        fall1, sink1 = a1 - K * y1, -per_mass * (b1 + stiff * Y1)
        y2, v2 = 0.5 * (u0 * v1 + u1 * v0), 0.5 * (u0 * fall1 + u1 * fall0)
        Y2, Z2 = 0.5 * (u0 * Z1 + u1 * Z0), 0.5 * (u0 * sink1 + u1 * sink0)
        e2 = p2 * t2 + p3 * t1 * t1
        w2 = e2 + on_deck * Z2 - v2
        t3, u3, q2 = u2 / 3.0, w2 / 6.0, 2.0 * u0 * u2 + u1 * u1
        c2 = quadratic * q2 + 3.0 * cubic * u0 * (u1 * u1 + u0 * u2)
        g2 = f1 * t2 + f2 * t1 * t1
        x2 = f0 * c2 + g1 * c1 + g2 * c0
        n2 = x2 + eta * (x0 * w2 + x1 * w1 + x2 * w0)
        a2, b2 = n2 - G * v2, on_deck * n2 + drag * Z2
        fall2, sink2 = a2 - K * y2, -per_mass * (b2 + stiff * Y2)
        v3, Z3 = (u0 * fall2 + u1 * fall1 + u2 * fall0) / 3.0, (u0 * sink2 + u1 * sink1 + u2 * sink0) / 3.0
        w3 = p2 * t3 + 2.0 * p3 * t1 * t2 + p4 * t1 * t1 * t1 + on_deck * Z3 - v3
        q3 = 2.0 * (u0 * u3 + u1 * u2)
        c3 = quadratic * q3 + cubic * (u1 * u1 * u1 + 6.0 * u0 * u1 * u2 + 3.0 * u0 * u0 * u3)
        g3 = f1 * t3 + 2.0 * f2 * t1 * t2 + f3 * t1 * t1 * t1
        x3 = f0 * c3 + g1 * c2 + g2 * c1 + g3 * c0
        n3 = x3 + eta * (x0 * w3 + x1 * w2 + x2 * w1 + x3 * w0)
        a3, b3 = n3 - G * v3, on_deck * n3 + drag * Z3
        # -- the power, times dt/ds = u, and Hermite's rule
        r0, r1 = a0 * v0 - b0 * Z0, a0 * v1 + a1 * v0 - b0 * Z1 - b1 * Z0
        r2 = a0 * v2 + a1 * v1 + a2 * v0 - b0 * Z2 - b1 * Z1 - b2 * Z0
        r3 = a0 * v3 + a1 * v2 + a2 * v1 + a3 * v0 - b0 * Z3 - b1 * Z2 - b2 * Z1 - b3 * Z0
        m0, m1 = WEIGHT_1 * (r0 * u0), WEIGHT_2 * (r0 * u1 + r1 * u0)
        m2, m3 = WEIGHT_3 * (r0 * u2 + r1 * u1 + r2 * u0), WEIGHT_4 * (r0 * u3 + r1 * u2 + r2 * u1 + r3 * u0)
        before, after = L[STEP_BEFORE + i], L[STEP_AFTER + i]
        L[GAIN_BEFORE + i] = before * (m0 - before * (m1 - before * (m2 - before * m3)))
        L[GAIN_AFTER + i] = after * (m0 + after * (m1 + after * (m2 + after * m3)))
        L[WORKING + i], L[GAINING + i] = n0 * e0 * u0, n0 * w0 * u0
        L[LOSING + i] = (G * v0 * v0 + drag * Z0 * Z0) * u0
        L[KINETIC + i] = 0.5 * v0 * v0
        deck = 0.5 * (mass * Z0 * Z0 + stiff * Y0 * Y0) - on_deck * prestress * Y0
        L[ENERGY + i] = 0.5 * (v0 * v0 + K * y0 * y0) + y0 + deck


@kernel
def find_power(
    pieces: FloatArray, numbers: FloatArray, steps: FloatArray, first: int, end: FloatArray, L: FloatArray
) -> int:
    """Find energy and power at the starts of steps from number `first` on, and at their end; return at how many.

    The steps lie in one elastic contact and go on without a change but of the motion; `end` is the state after them.
    """
    count = min(STATES, len(steps) + 1 - first)
    for i in range(count):
        k = first + i
        state = steps[k] if k < len(steps) else end
        L[WHEN + i], L[U0 + i], L[W0 + i] = state[TIME], state[A], state[B]
        L[DECK_PLACE + i], L[SWING + i] = state[DECK_Y], state[DECK_V]
        L[STEP_BEFORE + i] = steps[k - 1, LENGTH] if k > 0 else 0.0
        L[STEP_AFTER + i] = state[LENGTH] if k < len(steps) else 0.0
    _put_path(pieces, numbers, end, count, L)
    _power(numbers, end[ON_DECK], L)
    return count
