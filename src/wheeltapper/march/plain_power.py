"""Energy and power in an elastic contact, at several instants at once, as straight-line code.

Contacts that do not yield, under a damper without an end of its own: what nearly all marches are made of. Their steps
may be straight-line code too (unrolled.py), and by power.py their check would take longer than they. The contact's own
energy needs no integral (scaled units; E: energy of the elastic law, x: its force, f: the factor; N = f·x·(1 + η·w)):

    H = v²/2 + K·y²/2 + y + (μ·Z² + κ·Y²)/2 - prestress·Y + f·E
    dH/dt = N·y_k' + f'·E - G·v² - γ·Z² - η·f·x·w²

A row of `L` holds one quantity at all instants; the loops over them have no branch and no call, and every offset is
known when they are compiled: then LLVM turns them into vectors.
"""

from __future__ import annotations

from math import factorial, pi

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.power import SHORT_RULE
from wheeltapper.march.program import PIECE, SHIFT, FloatArray

STATES = 16
"""Number of instants in a row."""
# Of each instant: the time, u and w, the deck's Y and Z, lengths of the steps before and after it, the path and the
# factor on the force in powers of time.
(
    WHEN, U0, W0, DECK, SWING, BEFORE, AFTER, P0, P1, P2, P3, P4, F0, F1, F2, F3, F4,
) = range(0, 17 * STATES, STATES)  # fmt: skip
# What is found: H, what this end of the steps before and after adds to the integrals of dH/dt over them by Hermite's
# rule, the powers of the path and of what is lost, v²/2, and f·E.
ENERGY, GAIN_BEFORE, GAIN_AFTER, WORKING, LOSING, KINETIC, ELASTIC = range(17 * STATES, 24 * STATES, STATES)
ENTRIES = 24 * STATES
POWERS = 5
"""Powers of time that reach the terms of a contact."""
TURN = 2.0 * pi
S1, S2, S3, S4, S5, S6, S7 = ((-1) ** k / factorial(2 * k + 1) for k in range(1, 8))
C1, C2, C3, C4, C5, C6, C7, C8 = ((-1) ** k / factorial(2 * k) for k in range(1, 9))
FIRST, SECOND, THIRD, FOURTH = (float(weight) for weight in SHORT_RULE)


@kernel
def _in_time(
    pieces: FloatArray, piece: int, source: int, degree: int, at: float, rate: float, gain: float, first: int,
    L: FloatArray,
) -> None:  # fmt: skip
    """Write gain·Σ pieces[piece, source + k]·ξ^k, ξ = at + rate·τ, in powers of τ, below each other from L[first] on."""
    work = np.empty(contract.TERMS)
    for k in range(contract.TERMS):
        work[k] = pieces[piece, source + k] if k <= degree else 0.0
    for i in range(min(degree, POWERS)):
        for k in range(degree - 1, i - 1, -1):
            work[k] += at * work[k + 1]
    for k in range(POWERS):
        L[first + k * STATES] = gain * work[k]
        gain *= rate


@kernel
def put_path(pieces: FloatArray, numbers: FloatArray, step: FloatArray, count: int, L: FloatArray) -> None:
    """Write the path and the factor at the first instants of L, whose times stand in it, all on the piece of a step."""
    piece = int(step[PIECE])
    pace, lift, scale = numbers[contract.PACE], numbers[contract.LIFT], pieces[piece, contract.SCALE]
    origin = step[SHIFT] + pieces[piece, contract.CENTRE]
    degree, factor_degree = int(pieces[piece, contract.DEGREE]), int(pieces[piece, contract.FACTOR_DEGREE])
    for row in range(P0, F4 + STATES, STATES):
        value = lift * pieces[piece, contract.COEFFICIENT] if row == P0 else 1.0 if row == F0 else 0.0
        for i in range(STATES):
            L[row + i] = value
    if degree > 0 or factor_degree >= 0:
        for i in range(count):
            at, rate = (pace * L[WHEN + i] - origin) / scale, pace / scale
            _in_time(pieces, piece, contract.COEFFICIENT, degree, at, rate, lift, P0 + i, L)
            if factor_degree >= 0:
                _in_time(pieces, piece, contract.FACTOR, factor_degree, at, rate, 1.0, F0 + i, L)
    wavenumber = pieces[piece, contract.WAVENUMBER]
    if wavenumber != 0.0:
        amp_sin, amp_cos = lift * pieces[piece, contract.SINE], lift * pieces[piece, contract.COSINE]
        _add_harmonic(wavenumber / TURN * pace, wavenumber / TURN * origin, wavenumber * pace, amp_sin, amp_cos, L)


@kernel
def _add_harmonic(rate: float, offset: float, omega: float, amp_sin: float, amp_cos: float, L: FloatArray) -> None:
    """Add a harmonic, whose phase is rate·time - offset in turns, to the path at all instants."""
    square = 0.5 * omega * omega
    for i in range(STATES):
        turns = rate * L[WHEN + i] - offset
        x = 0.25 * TURN * (turns - np.rint(turns))
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
def find_power(numbers: FloatArray, on_deck: float, L: FloatArray) -> None:
    """Find energy and power at all instants of L."""
    K, G, eta = numbers[contract.STIFFNESS], numbers[contract.DAMPING], numbers[contract.HYSTERESIS]
    quadratic, cubic, prestress = numbers[contract.QUADRATIC], numbers[contract.CUBIC], numbers[contract.PRESTRESS]
    mass, stiff, drag = numbers[contract.DECK_MASS], numbers[contract.DECK_STIFFNESS], numbers[contract.DECK_DAMPING]
    per_mass = 1.0 / mass if mass > 0.0 else 0.0
    push, kappa, gamma = on_deck * per_mass, stiff * per_mass, drag * per_mass
    for i in range(STATES):
        u0, w0, Y0, Z0 = L[U0 + i], L[W0 + i], L[DECK + i], L[SWING + i]
        p2, p3, p4 = 2.0 * L[P2 + i], 3.0 * L[P3 + i], 4.0 * L[P4 + i]
        f0, f1, f2, f3, f4 = L[F0 + i], L[F1 + i], L[F2 + i], L[F3 + i], L[F4 + i]
        # -- series in s: t, the path's velocity e, indentation q, elastic force x and N, deck Y and Z, wheel y and v
        t1, u1, e0, q0 = u0, 0.5 * w0, L[P1 + i], u0 * u0
        y0, v0 = L[P0 + i] + on_deck * Y0 - q0, e0 + on_deck * Z0 - w0
        b0 = q0 * (quadratic + cubic * u0)
        x0 = f0 * b0
        n0 = x0 * (1.0 + eta * w0)
        a0 = n0 - 1.0 - K * y0 - G * v0
        d0 = push * (prestress - n0) - kappa * Y0 - gamma * Z0
        y1, v1, Y1, Z1 = u0 * v0, u0 * a0, u0 * Z0, u0 * d0
        t2, u2, e1 = 0.5 * u1, 0.0, p2 * t1
        w1 = e1 + on_deck * Z1 - v1
        u2 = 0.25 * w1
        q1 = 2.0 * u0 * u1
        b1 = quadratic * q1 + 1.5 * cubic * q1 * u0
        g1 = f1 * t1
        x1 = f0 * b1 + g1 * b0
        n1 = x1 + eta * (x0 * w1 + x1 * w0)
        a1 = n1 - K * y1 - G * v1
        d1 = -push * n1 - kappa * Y1 - gamma * Z1
        y2, v2 = 0.5 * (u0 * v1 + u1 * v0), 0.5 * (u0 * a1 + u1 * a0)
        Y2, Z2 = 0.5 * (u0 * Z1 + u1 * Z0), 0.5 * (u0 * d1 + u1 * d0)
        e2 = p2 * t2 + p3 * t1 * t1
        w2 = e2 + on_deck * Z2 - v2
        t3, u3 = u2 / 3.0, w2 / 6.0
        q2 = 2.0 * u0 * u2 + u1 * u1
        b2 = quadratic * q2 + 3.0 * cubic * u0 * (u1 * u1 + u0 * u2)
        g2 = f1 * t2 + f2 * t1 * t1
        x2 = f0 * b2 + g1 * b1 + g2 * b0
        n2 = x2 + eta * (x0 * w2 + x1 * w1 + x2 * w0)
        a2 = n2 - K * y2 - G * v2
        d2 = -push * n2 - kappa * Y2 - gamma * Z2
        v3, Z3 = (u0 * a2 + u1 * a1 + u2 * a0) / 3.0, (u0 * d2 + u1 * d1 + u2 * d0) / 3.0
        e3 = p2 * t3 + 2.0 * p3 * t1 * t2 + p4 * t1 * t1 * t1
        w3 = e3 + on_deck * Z3 - v3
        q3 = 2.0 * (u0 * u3 + u1 * u2)
        b3 = quadratic * q3 + cubic * (u1 * u1 * u1 + 6.0 * u0 * u1 * u2 + 3.0 * u0 * u0 * u3)
        g3 = f1 * t3 + 2.0 * f2 * t1 * t2 + f3 * t1 * t1 * t1
        x3 = f0 * b3 + g1 * b2 + g2 * b1 + g3 * b0
        n3 = x3 + eta * (x0 * w3 + x1 * w2 + x2 * w1 + x3 * w0)
        # -- the powers, path's and lost, and that of the factor on the contact's energy E
        k0, k1, k2, k3 = w0 * w0, 2.0 * w0 * w1, 2.0 * w0 * w2 + w1 * w1, 2.0 * (w0 * w3 + w1 * w2)
        lost0 = G * v0 * v0 + drag * Z0 * Z0 + eta * x0 * k0
        lost1 = 2.0 * (G * v0 * v1 + drag * Z0 * Z1) + eta * (x0 * k1 + x1 * k0)
        lost2 = G * (2.0 * v0 * v2 + v1 * v1) + drag * (2.0 * Z0 * Z2 + Z1 * Z1) + eta * (x0 * k2 + x1 * k1 + x2 * k0)
        lost3 = 2.0 * (G * (v0 * v3 + v1 * v2) + drag * (Z0 * Z3 + Z1 * Z2))
        lost3 += eta * (x0 * k3 + x1 * k2 + x2 * k1 + x3 * k0)
        E0 = q0 * q0 * (0.5 * quadratic + 0.4 * cubic * u0)
        E1, E2, E3 = b0 * q1, b0 * q2 + 0.5 * b1 * q1, b0 * q3 + (2.0 * b1 * q2 + b2 * q1) / 3.0
        c0, c1, c2 = f1, 2.0 * f2 * t1, 2.0 * f2 * t2 + 3.0 * f3 * t1 * t1
        c3 = 2.0 * f2 * t3 + 6.0 * f3 * t1 * t2 + 4.0 * f4 * t1 * t1 * t1
        worked0 = n0 * e0
        r0 = worked0 + c0 * E0 - lost0
        r1 = n0 * e1 + n1 * e0 + c0 * E1 + c1 * E0 - lost1
        r2 = n0 * e2 + n1 * e1 + n2 * e0 + c0 * E2 + c1 * E1 + c2 * E0 - lost2
        r3 = n0 * e3 + n1 * e2 + n2 * e1 + n3 * e0 + c0 * E3 + c1 * E2 + c2 * E1 + c3 * E0 - lost3
        # -- by Hermite's rule, dt = u ds
        m0, m1 = FIRST * (r0 * u0), SECOND * (r0 * u1 + r1 * u0)
        m2, m3 = THIRD * (r0 * u2 + r1 * u1 + r2 * u0), FOURTH * (r0 * u3 + r1 * u2 + r2 * u1 + r3 * u0)
        h = L[AFTER + i]
        L[GAIN_AFTER + i] = h * (m0 + h * (m1 + h * (m2 + h * m3)))
        h = L[BEFORE + i]
        L[GAIN_BEFORE + i] = h * (m0 - h * (m1 - h * (m2 - h * m3)))
        L[WORKING + i], L[LOSING + i] = worked0 * u0, lost0 * u0
        L[KINETIC + i], L[ELASTIC + i] = 0.5 * v0 * v0, f0 * E0
        deck = 0.5 * (mass * Z0 * Z0 + stiff * Y0 * Y0) - on_deck * prestress * Y0
        L[ENERGY + i] = 0.5 * v0 * v0 + 0.5 * K * y0 * y0 + y0 + deck + f0 * E0
