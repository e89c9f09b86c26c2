"""The power in an elastic contact on a stiff rail, the commonest, as straight-line code.

The steps of such a march are straight-line code too (unrolled.py): by power.py their check would take longer than they.
"""

from __future__ import annotations

from math import cos, sin

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.power import CONTACT_WORK, LOST, PATH_WORK
from wheeltapper.march.program import PIECE, SHIFT, TIME, A, B, FloatArray


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
    pieces: FloatArray, numbers: FloatArray, state: FloatArray, work: FloatArray, out: FloatArray
) -> tuple[float, float]:
    """Write the power in a state in contact, as power.py does; return the wheel's motion."""
    K, drag, eta = numbers[contract.STIFFNESS], numbers[contract.DAMPING], numbers[contract.HYSTERESIS]
    quadratic, cubic = numbers[contract.QUADRATIC], numbers[contract.CUBIC]
    piece, u0, w0 = int(state[PIECE]), state[A], state[B]
    # -- path and factor in powers of time
    pace, lift = numbers[contract.PACE], numbers[contract.LIFT]
    away = pace * state[TIME] - state[SHIFT] - pieces[piece, contract.CENTRE]
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
    out[PATH_WORK], out[PATH_WORK + 1] = m0 * e0, m0 * e1 + m1 * e0
    out[PATH_WORK + 2], out[PATH_WORK + 3] = m0 * e2 + m1 * e1 + m2 * e0, m0 * e3 + m1 * e2 + m2 * e1 + m3 * e0
    out[CONTACT_WORK], out[CONTACT_WORK + 1] = m0 * w0, m0 * w1 + m1 * w0
    out[CONTACT_WORK + 2] = m0 * w2 + m1 * w1 + m2 * w0
    out[CONTACT_WORK + 3] = m0 * w3 + m1 * w2 + m2 * w1 + m3 * w0
    v0, v1, v2, v3 = e0 - w0, e1 - w1, e2 - w2, e3 - w3
    s0, s1, s2, s3 = v0 * v0, 2.0 * v0 * v1, 2.0 * v0 * v2 + v1 * v1, 2.0 * (v0 * v3 + v1 * v2)
    out[LOST], out[LOST + 1] = drag * s0 * u0, drag * (s0 * u1 + s1 * u0)
    out[LOST + 2] = drag * (s0 * u2 + s1 * u1 + s2 * u0)
    out[LOST + 3] = drag * (s0 * u3 + s1 * u2 + s2 * u1 + s3 * u0)
    return p0 - u0 * u0, v0
