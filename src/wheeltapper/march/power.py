"""The powers that change the energy of wheel and deck, as short series at one instant.

They are N·y_k' (PATH), N·w (CONTACT_WORK) and G·v² + γ·Z² (LOST), per unit of time. In contact the series are in s,
times dt/ds = u, otherwise in time. The most common case, an elastic contact on a stiff rail, is written out.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from wheeltapper.march import program as contract
from wheeltapper.march.flight import bonded_series, flight_series
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import AMP_COS, AMP_SIN, DEGREE, HERE, OMEGA, PHASE0, POLY, N, T, U, W, Z
from wheeltapper.march.program import PIECE, SHIFT, FloatArray
from wheeltapper.march.series import contact_series

SHORT, LONG = 4, 8
"""Number of terms of the series: in contact, where steps are short, and elsewhere."""
PATH, CONTACT_WORK, LOST = range(3)
DOT = 1e-10
"""Ratio of the indentation to the displacement below which the indentation is rounding, because the contact opens
here."""


@kernel
def _shifted(pieces: FloatArray, piece: int, source: int, degree: int, at: float, terms: int, work: FloatArray) -> None:
    """Write the first terms of Σ pieces[piece, source + k]·ξ^k in powers of ξ - at."""
    for k in range(max(degree + 1, terms)):
        work[k] = pieces[piece, source + k] if k <= degree else 0.0
    for i in range(min(degree, terms)):
        for k in range(degree - 1, i - 1, -1):
            work[k] += at * work[k + 1]


@kernel
def plain_power(
    pieces: FloatArray, numbers: FloatArray, step: FloatArray, time: float, is_own: bool, y: float, v: float,
    u0: float, w0: float, work: FloatArray, G: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Write the power at a time in an elastic contact without a deck as series in s; return the wheel's motion.

    `is_own`: the state is u0, w0; else it is the wheel's displacement y and velocity v.
    """
    K, drag, eta = numbers[contract.STIFFNESS], numbers[contract.DAMPING], numbers[contract.HYSTERESIS]
    quadratic, cubic = numbers[contract.QUADRATIC], numbers[contract.CUBIC]
    piece = int(step[PIECE])
    # -- path and factor in powers of time
    pace, lift = numbers[contract.PACE], numbers[contract.LIFT]
    away = pace * time - step[SHIFT] - pieces[piece, contract.CENTRE]
    p0 = lift * pieces[piece, contract.COEFFICIENT]
    p1 = p2 = p3 = p4 = f1 = f2 = f3 = 0.0
    f0 = 1.0
    degree, factor_degree = int(pieces[piece, contract.DEGREE]), int(pieces[piece, contract.FACTOR_DEGREE])
    if degree > 0 or factor_degree >= 0:
        scale = pieces[piece, contract.SCALE]
        at, rate = away / scale, pace / scale
        _shifted(pieces, piece, contract.COEFFICIENT, degree, at, 5, work)
        part = lift * rate
        p0, p1, p2 = lift * work[0], part * work[1], part * rate * work[2]
        part *= rate * rate
        p3, p4 = part * work[3], part * rate * work[4]
        if factor_degree >= 0:
            _shifted(pieces, piece, contract.FACTOR, factor_degree, at, 4, work)
            f0, f1, f2, f3 = work[0], rate * work[1], rate * rate * work[2], rate * rate * rate * work[3]
    wavenumber = pieces[piece, contract.WAVENUMBER]
    if wavenumber != 0.0:
        s, c = sin(wavenumber * away), cos(wavenumber * away)
        omega = wavenumber * pace
        square = 0.5 * omega * omega
        h = lift * (pieces[piece, contract.SINE] * s + pieces[piece, contract.COSINE] * c)
        d = lift * omega * (pieces[piece, contract.SINE] * c - pieces[piece, contract.COSINE] * s)
        p0 += h
        p1 += d
        p2 -= square * h
        p3 -= square * d / 3.0
        p4 += square * square * h / 6.0
    # -- the state
    if is_own:
        y, v = p0 - u0 * u0, p1 - w0
    else:
        depth = p0 - y
        u0 = sqrt(depth) if depth > DOT * (1.0 + abs(y)) else 0.0
        w0 = p1 - v
    # -- series of u, w, the contact force n and the path's velocity e in s
    t1, u1 = u0, 0.5 * w0
    b0 = u0 * u0 * (quadratic + cubic * u0)
    n0 = f0 * b0 * (1.0 + eta * w0)
    a0 = 1.0 + K * p0 + drag * p1 + 2.0 * p2 - K * u0 * u0 - drag * w0 - n0
    w1 = u0 * a0
    t2, u2 = 0.5 * u1, 0.25 * w1
    q1 = 2.0 * u0 * u1
    r1 = 1.5 * q1 * u0
    b1 = quadratic * q1 + cubic * r1
    g1 = f1 * t1
    x0, x1 = f0 * b0, f0 * b1 + g1 * b0
    n1 = x1 + eta * (x0 * w1 + x1 * w0)
    c1 = K * p1 + 2.0 * drag * p2 + 6.0 * p3
    a1 = c1 * t1 - K * q1 - drag * w1 - n1
    w2 = 0.5 * (u0 * a1 + u1 * a0)
    t3, u3 = u2 / 3.0, w2 / 6.0
    q2 = 2.0 * u0 * u2 + u1 * u1
    r2 = 3.0 * u0 * (u1 * u1 + u0 * u2)
    b2 = quadratic * q2 + cubic * r2
    g2 = f1 * t2 + f2 * t1 * t1
    x2 = f0 * b2 + g1 * b1 + g2 * b0
    n2 = x2 + eta * (x0 * w2 + x1 * w1 + x2 * w0)
    c2 = K * p2 + 3.0 * drag * p3 + 12.0 * p4
    a2 = c1 * t2 + c2 * t1 * t1 - K * q2 - drag * w2 - n2
    w3 = (u0 * a2 + u1 * a1 + u2 * a0) / 3.0
    b3 = quadratic * 2.0 * (u0 * u3 + u1 * u2) + cubic * (u1 * u1 * u1 + 6.0 * u0 * u1 * u2 + 3.0 * u0 * u0 * u3)
    g3 = f1 * t3 + 2.0 * f2 * t1 * t2 + f3 * t1 * t1 * t1
    x3 = f0 * b3 + g1 * b2 + g2 * b1 + g3 * b0
    n3 = x3 + eta * (x0 * w3 + x1 * w2 + x2 * w1 + x3 * w0)
    e0 = p1
    e1 = 2.0 * p2 * t1
    e2 = 2.0 * p2 * t2 + 3.0 * p3 * t1 * t1
    e3 = 2.0 * p2 * t3 + 6.0 * p3 * t1 * t2 + 4.0 * p4 * t1 * t1 * t1
    # -- the powers, times dt/ds = u
    m0, m1, m2 = n0 * u0, n0 * u1 + n1 * u0, n0 * u2 + n1 * u1 + n2 * u0
    m3 = n0 * u3 + n1 * u2 + n2 * u1 + n3 * u0
    G[PATH, 0], G[PATH, 1] = m0 * e0, m0 * e1 + m1 * e0
    G[PATH, 2], G[PATH, 3] = m0 * e2 + m1 * e1 + m2 * e0, m0 * e3 + m1 * e2 + m2 * e1 + m3 * e0
    G[CONTACT_WORK, 0], G[CONTACT_WORK, 1] = m0 * w0, m0 * w1 + m1 * w0
    G[CONTACT_WORK, 2] = m0 * w2 + m1 * w1 + m2 * w0
    G[CONTACT_WORK, 3] = m0 * w3 + m1 * w2 + m2 * w1 + m3 * w0
    v0, v1, v2, v3 = e0 - w0, e1 - w1, e2 - w2, e3 - w3
    s0, s1, s2, s3 = v0 * v0, 2.0 * v0 * v1, 2.0 * v0 * v2 + v1 * v1, 2.0 * (v0 * v3 + v1 * v2)
    G[LOST, 0], G[LOST, 1] = drag * s0 * u0, drag * (s0 * u1 + s1 * u0)
    G[LOST, 2] = drag * (s0 * u2 + s1 * u1 + s2 * u0)
    G[LOST, 3] = drag * (s0 * u3 + s1 * u2 + s2 * u1 + s3 * u0)
    return y, v


@kernel
def _path_velocity(terms: int, S: FloatArray, out: FloatArray) -> None:
    """Write the path's velocity as a series in time."""
    degree = int(S[HERE + DEGREE])
    for n in range(terms):
        out[n] = (n + 1) * S[HERE + POLY + n + 1] if n < degree else 0.0
    omega = S[HERE + OMEGA]
    if omega != 0.0:
        s = sin(S[HERE + PHASE0])
        c = cos(S[HERE + PHASE0])
        h = omega * (S[HERE + AMP_SIN] * c - S[HERE + AMP_COS] * s)
        d = -omega * (S[HERE + AMP_SIN] * s + S[HERE + AMP_COS] * c)
        for n in range(terms):
            out[n] += h
            part = omega / (n + 1)
            h, d = d * part, -h * part


@kernel
def _in_s(p: FloatArray, S: FloatArray) -> None:
    """Turn a series of SHORT terms in time into one in s."""
    a, b, c = S[T + 1], S[T + 2], S[T + 3]
    p[3] = p[1] * c + 2.0 * p[2] * a * b + p[3] * a * a * a
    p[2] = p[1] * b + p[2] * a * a
    p[1] = p[1] * a


@kernel
def times(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Write the product of two series of SHORT terms."""
    out[0] = a[0] * b[0]
    out[1] = a[0] * b[1] + a[1] * b[0]
    out[2] = a[0] * b[2] + a[1] * b[1] + a[2] * b[0]
    out[3] = a[0] * b[3] + a[1] * b[2] + a[2] * b[1] + a[3] * b[0]


@kernel
def contact_power(
    numbers: FloatArray, u: float, w: float, deck_y: float, deck_v: float, on_deck: bool, S: FloatArray,
    P: FloatArray, G: FloatArray,
) -> None:  # fmt: skip
    """Write the power in a contact whose piece stands in S as series in s, times dt/ds = u."""
    contact_series(numbers, SHORT, u, w, deck_y, deck_v, on_deck, S)
    velocity, pushed, speed, squared = P[0], P[1], P[2], P[3]
    _path_velocity(SHORT, S, velocity)
    _in_s(velocity, S)
    times(S[N : N + SHORT], S[U : U + SHORT], pushed)
    times(pushed, velocity, G[PATH])
    times(pushed, S[W : W + SHORT], G[CONTACT_WORK])
    for n in range(SHORT):
        speed[n] = velocity[n] - S[W + n]
        if on_deck:
            speed[n] += S[Z + n]
    times(speed, speed, squared)
    for n in range(SHORT):
        squared[n] *= numbers[contract.DAMPING]
    if numbers[contract.DECK_DAMPING] > 0.0:
        times(S[Z : Z + SHORT], S[Z : Z + SHORT], speed)
        for n in range(SHORT):
            squared[n] += numbers[contract.DECK_DAMPING] * speed[n]
    times(squared, S[U : U + SHORT], G[LOST])


@kernel
def free_power(
    numbers: FloatArray, bonded: bool, y: float, v: float, deck_y: float, deck_v: float, on_deck: bool, S: FloatArray,
    P: FloatArray, G: FloatArray,
) -> None:  # fmt: skip
    """Write the power without contact force, or in a bilateral contact, as series in time."""
    if bonded:
        bonded_series(numbers, LONG, y, v, deck_y, deck_v, on_deck, S)
        _path_velocity(LONG, S, P[0])
    else:
        flight_series(numbers, LONG, y, v, deck_y, deck_v, on_deck, S)
    for n in range(LONG):
        worked, gained, suspension, bearing = 0.0, 0.0, 0.0, 0.0
        for j in range(n + 1):
            suspension += S[W + j] * S[W + n - j]
            bearing += S[Z + j] * S[Z + n - j]
            if bonded:
                approach = P[0, n - j] - S[W + n - j]
                if on_deck:
                    approach += S[Z + n - j]
                worked += S[N + j] * P[0, n - j]
                gained += S[N + j] * approach
        G[PATH, n] = worked
        G[CONTACT_WORK, n] = gained
        G[LOST, n] = numbers[contract.DAMPING] * suspension
        if numbers[contract.DECK_DAMPING] > 0.0:
            G[LOST, n] += numbers[contract.DECK_DAMPING] * bearing
