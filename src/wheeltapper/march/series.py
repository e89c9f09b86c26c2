"""Taylor series of one step, as recurrences: contact in the regularised variable s, flight in time.

Contact (δ = u², dt = u ds, w = dδ/dt; the project's numerics reference, section 1.2):

    t' = u     u' = w/2     w' = u·(F + A + K·(Y - u²) + G·(Z - w) - N)     Y' = u·Z     Z' = u·A
    F = 1 + K·y_k + G·y_k' + y_k''         A = (-N + prestress - κ·Y - γ·Z)/μ   on the deck
    N = factor(t)·(quadratic·u² + cubic·u³)·(1 + η·w)

The path is a polynomial plus a harmonic in time; polynomials are composed with t(s) by Horner's rule on truncated
series, order by order, because t is known only up to the order that has been reached.

Rows of the scratch array `S` hold the series; their names are the constants below.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numba import njit

from wheeltapper.march.program import MAX_DEGREE, FloatArray, Program

# Rows of the scratch array. Contact: series in s. Flight: series in t; U and W then hold y and v.
T, U, W, Y, Z, Q, R, F, N, ACC, SINE, COSINE, TREND, CLEAR, COMP, WORK = range(16)
HORNER = 16  # MAX_DEGREE + 1 rows for the path
HORNER_FACTOR = HORNER + MAX_DEGREE + 1  # MAX_DEGREE + 1 rows for the factor
ROWS = HORNER_FACTOR + MAX_DEGREE + 1
WIDTH = 24
FLIGHT_ORDER = 18

# Entries of the local path: polynomial in (t - t0), harmonic, factor.
POLY, AMP_SIN, AMP_COS, PHASE0, OMEGA, DEGREE, FACTOR_DEGREE, FACTOR = 0, 9, 10, 11, 12, 13, 14, 15
LOCAL = FACTOR + MAX_DEGREE + 1


@njit(cache=True, error_model="numpy")
def _shift(source: FloatArray, degree: int, at: float, rate: float, gain: float, out: FloatArray, first: int) -> None:
    """Write the polynomial Σ source[k]·ξ^k, ξ = at + rate·τ, times gain, as a polynomial in τ from out[first] on."""
    for k in range(degree + 1):
        out[first + k] = source[k]
    for i in range(degree):
        for k in range(degree - 1, i - 1, -1):
            out[first + k] += at * out[first + k + 1]
    for k in range(degree + 1):
        out[first + k] *= gain
        gain *= rate


@njit(cache=True, error_model="numpy")
def localise(program: Program, piece: int, shift: float, time: float, local: FloatArray) -> None:
    """Write the path and the factor of one piece as functions of the time after `time` (scaled units)."""
    path = program.path
    away = program.pace * time - shift - path.centre[piece]
    at = away / path.scale[piece]
    rate = program.pace / path.scale[piece]
    degree = path.degree[piece]
    local[DEGREE] = degree
    _shift(path.coefficient[piece], degree, at, rate, program.lift, local, POLY)
    local[AMP_SIN] = path.harmonic[piece, 0] * program.lift
    local[AMP_COS] = path.harmonic[piece, 1] * program.lift
    wavenumber = path.harmonic[piece, 2]
    local[OMEGA] = wavenumber * program.pace
    local[PHASE0] = wavenumber * away
    degree = path.factor_degree[piece]
    local[FACTOR_DEGREE] = degree
    if degree >= 0:
        _shift(path.factor[piece], degree, at, rate, 1.0, local, FACTOR)


@njit(cache=True, error_model="numpy")
def path_at(local: FloatArray, after: float) -> tuple[float, float, float]:
    """Return the path's height, velocity and acceleration (scaled) at a time after the step's start."""
    degree = int(local[DEGREE])
    y = local[POLY + degree]
    v = 0.0
    a = 0.0
    for k in range(degree - 1, -1, -1):
        a = a * after + 2.0 * v
        v = v * after + y
        y = y * after + local[POLY + k]
    omega = local[OMEGA]
    if omega != 0.0:
        phase = local[PHASE0] + omega * after
        s = sin(phase)
        c = cos(phase)
        h = local[AMP_SIN] * s + local[AMP_COS] * c
        y += h
        v += omega * (local[AMP_SIN] * c - local[AMP_COS] * s)
        a -= omega * omega * h
    return y, v, a


@njit(cache=True, error_model="numpy")
def factor_at(local: FloatArray, after: float) -> tuple[float, float]:
    """Return the factor on the contact force and its rate at a time after the step's start."""
    degree = int(local[FACTOR_DEGREE])
    if degree < 0:
        return 1.0, 0.0
    value = local[FACTOR + degree]
    rate = 0.0
    for k in range(degree - 1, -1, -1):
        rate = rate * after + value
        value = value * after + local[FACTOR + k]
    return value, rate


@njit(cache=True, error_model="numpy")
def _forcing(program: Program, local: FloatArray, S: FloatArray) -> tuple[int, float, float]:
    """Put the polynomial part of F = 1 + K·y_k + G·y_k' + y_k'' in row COMP; return its degree and harmonic gains."""
    K = program.stiffness
    G = program.damping
    degree = int(local[DEGREE])
    for k in range(degree + 1):
        S[COMP, k] = K * local[POLY + k]
        if k + 1 <= degree:
            S[COMP, k] += G * (k + 1) * local[POLY + k + 1]
        if k + 2 <= degree:
            S[COMP, k] += (k + 2) * (k + 1) * local[POLY + k + 2]
    S[COMP, 0] += 1.0
    omega = local[OMEGA]
    a = local[AMP_SIN]
    b = local[AMP_COS]
    stiff = K - omega * omega
    drag = G * omega
    if K == 0.0 and G == 0.0:
        while degree > 0 and S[COMP, degree] == 0.0:
            degree -= 1
    return degree, stiff * a - drag * b, stiff * b + drag * a


@njit(cache=True, error_model="numpy")
def _start_horner(source: FloatArray, first: int, degree: int, S: FloatArray, rows: int) -> None:
    """Set order zero of the nested series of a polynomial composed with t(s), t(0) = 0."""
    for k in range(degree + 1):
        S[rows + k, 0] = source[first + k]


@njit(cache=True, error_model="numpy")
def _next_horner(n: int, degree: int, S: FloatArray, rows: int) -> None:
    """Advance the nested series to order n: R^k_n = Σ_{j=1..n} t_j·R^{k+1}_{n-j}."""
    S[rows + degree, n] = 0.0
    for k in range(degree - 1, -1, -1):
        total = 0.0
        for j in range(1, n + 1):
            total += S[T, j] * S[rows + k + 1, n - j]
        S[rows + k, n] = total


@njit(cache=True, error_model="numpy")
def contact_series(
    program: Program, order: int, local: FloatArray, u: float, w: float, y: float, z: float, on_deck: bool, S: FloatArray
) -> None:
    """Fill rows T, U, W, Y, Z up to `order` and N up to order - 1: one contact step from (u, w, Y, Z)."""
    K = program.stiffness
    G = program.damping
    quadratic = program.quadratic
    cubic = program.cubic
    eta = program.hysteresis
    deck = program.deck_mass > 0.0
    degree, gain_sin, gain_cos = _forcing(program, local, S)
    wavy = local[OMEGA] != 0.0
    omega = local[OMEGA]
    fdegree = int(local[FACTOR_DEGREE])
    S[T, 0] = 0.0
    S[U, 0] = u
    S[W, 0] = w
    S[Y, 0] = y
    S[Z, 0] = z
    _start_horner(S[COMP], 0, degree, S, HORNER)
    if fdegree >= 0:
        _start_horner(local, FACTOR, fdegree, S, HORNER_FACTOR)
    if wavy:
        S[SINE, 0] = sin(local[PHASE0])
        S[COSINE, 0] = cos(local[PHASE0])
    for n in range(order):
        q = 0.0
        for j in range(n + 1):
            q += S[U, j] * S[U, n - j]
        S[Q, n] = q
        r = 0.0
        for j in range(n + 1):
            r += S[Q, j] * S[U, n - j]
        S[R, n] = quadratic * q + cubic * r
        if n > 0:
            _next_horner(n, degree, S, HORNER)
        f = S[HORNER, n]
        if wavy:
            f += gain_sin * S[SINE, n] + gain_cos * S[COSINE, n]
        force = S[R, n]
        if fdegree >= 0:
            if n > 0:
                _next_horner(n, fdegree, S, HORNER_FACTOR)
            force = 0.0
            for j in range(n + 1):
                force += S[HORNER_FACTOR, j] * S[R, n - j]
        S[F, n] = force
        if eta != 0.0:
            for j in range(n + 1):
                force += eta * S[F, j] * S[W, n - j]
        S[N, n] = force
        acceleration = 0.0
        if deck:
            acceleration = -program.deck_stiffness * S[Y, n] - program.deck_damping * S[Z, n]
            if on_deck:
                acceleration -= force
                if n == 0:
                    acceleration += program.prestress
            acceleration /= program.deck_mass
        S[ACC, n] = acceleration
        if on_deck:
            f += acceleration + K * (S[Y, n] - q) + G * (S[Z, n] - S[W, n]) - force
        else:
            f += -K * q - G * S[W, n] - force
        S[WORK, n] = f
        w_next = 0.0
        for j in range(n + 1):
            w_next += S[U, j] * S[WORK, n - j]
        S[T, n + 1] = S[U, n] / (n + 1)
        S[U, n + 1] = 0.5 * S[W, n] / (n + 1)
        S[W, n + 1] = w_next / (n + 1)
        if deck:
            y_next = 0.0
            z_next = 0.0
            for j in range(n + 1):
                y_next += S[U, j] * S[Z, n - j]
                z_next += S[U, j] * S[ACC, n - j]
            S[Y, n + 1] = y_next / (n + 1)
            S[Z, n + 1] = z_next / (n + 1)
        else:
            S[Y, n + 1] = 0.0
            S[Z, n + 1] = 0.0
        if wavy:
            s_next = 0.0
            c_next = 0.0
            for j in range(n + 1):
                s_next += S[U, j] * S[COSINE, n - j]
                c_next += S[U, j] * S[SINE, n - j]
            S[SINE, n + 1] = omega * s_next / (n + 1)
            S[COSINE, n + 1] = -omega * c_next / (n + 1)


@njit(cache=True, error_model="numpy")
def _path_series(local: FloatArray, order: int, S: FloatArray) -> None:
    """Put the path's own series in time in row F."""
    degree = int(local[DEGREE])
    for k in range(order + 1):
        S[F, k] = local[POLY + k] if k <= degree else 0.0
    omega = local[OMEGA]
    if omega != 0.0:
        s = sin(local[PHASE0])
        c = cos(local[PHASE0])
        for k in range(order + 1):
            S[F, k] += local[AMP_SIN] * s + local[AMP_COS] * c
            s, c = omega * c / (k + 1), -omega * s / (k + 1)


@njit(cache=True, error_model="numpy")
def flight_series(
    program: Program,
    order: int,
    local: FloatArray,
    y: float,
    v: float,
    deck_y: float,
    deck_v: float,
    on_deck: bool,
    S: FloatArray,
) -> None:
    """Fill U (y), W (v), Y, Z, N and CLEAR (y_k + Y - y) up to `order`, as series in time after the step's start.

    Without contact N is zero; in a bonded contact N = factor·(y_k + Y - y), tension included.
    """
    bonded = program.bonded
    deck = program.deck_mass > 0.0
    fdegree = int(local[FACTOR_DEGREE])
    _path_series(local, order, S)
    S[U, 0] = y
    S[W, 0] = v
    S[Y, 0] = deck_y
    S[Z, 0] = deck_v
    for n in range(order + 1):
        S[CLEAR, n] = S[F, n] - S[U, n] + (S[Y, n] if on_deck else 0.0)
        force = 0.0
        if bonded:
            if fdegree < 0:
                force = S[CLEAR, n]
            else:
                for j in range(min(n, fdegree) + 1):
                    force += local[FACTOR + j] * S[CLEAR, n - j]
        S[N, n] = force
        if n == order:
            break
        a = force - program.stiffness * S[U, n] - program.damping * S[W, n]
        b = -program.deck_stiffness * S[Y, n] - program.deck_damping * S[Z, n]
        if on_deck:
            b -= force
        if n == 0:
            a -= 1.0
            if on_deck:
                b += program.prestress
        S[U, n + 1] = S[W, n] / (n + 1)
        S[W, n + 1] = a / (n + 1)
        S[Y, n + 1] = S[Z, n] / (n + 1) if deck else 0.0
        S[Z, n + 1] = b / program.deck_mass / (n + 1) if deck else 0.0


@njit(cache=True, error_model="numpy")
def flight_reach(program: Program, local: FloatArray) -> float:
    """Return the time over which the flight series of order FLIGHT_ORDER is exact to rounding."""
    rate = np.sqrt(program.stiffness) + program.damping + abs(local[OMEGA])
    if program.deck_mass > 0.0:
        rate += np.sqrt(program.deck_stiffness / program.deck_mass) + program.deck_damping / program.deck_mass
    if program.bonded:
        rate += 1.0
        if program.deck_mass > 0.0:
            rate += np.sqrt(1.0 / program.deck_mass)
    return min(16.0, 1.0 / max(rate, 1e-3))
