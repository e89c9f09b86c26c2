"""Tangents of one step's series: every product by its rule, LANES directions at a time (see tangent_path.py)."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march import layout
from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import F, N, Q, R, T, U, W, Y, Z
from wheeltapper.march.program import FloatArray
from wheeltapper.march.tangent_path import DA, DB, DT, DY, DZ, LANES


@kernel
def sum_at(D: FloatArray, row: int, n: int, x: float, lane: int) -> float:
    """Return Σ D[row + k, lane]·x^k, k = 0 … n."""
    total = D[row + n, lane]
    for k in range(n - 1, -1, -1):
        total = total * x + D[row + k, lane]
    return total


@kernel
def sums_at(D: FloatArray, row: int, n: int, x: float, out: FloatArray) -> None:
    """Write Σ D[row + k, lane]·x^k, k = 0 … n, of all lanes."""
    for lane in range(LANES):
        out[lane] = D[row + n, lane]
    for k in range(n - 1, -1, -1):
        for lane in range(LANES):
            out[lane] = out[lane] * x + D[row + k, lane]


@kernel
def _horner_tangent(n: int, degree: int, first: int, rows: int, S: FloatArray, D: FloatArray) -> None:
    """Advance the tangents of the nested series to order n: those of R^k = c_k + t(s)·R^{k+1}."""
    for lane in range(LANES):
        D[rows + degree * layout.WIDTH + n, lane] = D[first + degree, lane] if n == 0 else 0.0
    for k in range(degree - 1, -1, -1):
        here = rows + k * layout.WIDTH
        above = here + layout.WIDTH
        for lane in range(LANES):
            D[here + n, lane] = D[first + k, lane] if n == 0 else 0.0
        for j in range(n + 1):
            r = S[above + n - j]
            t = S[T + j]
            for lane in range(LANES):
                D[here + n, lane] += D[T + j, lane] * r + t * D[above + n - j, lane]


@kernel
def contact_tangent(
    numbers: FloatArray, turns: FloatArray, order: int, on_deck: bool, carried: FloatArray, S: FloatArray,
    D: FloatArray,
) -> None:  # fmt: skip
    """Fill the tangents of rows T, U, W, Y, Z up to `order` and of N up to order - 1. `contact_series` has run."""
    K = numbers[contract.STIFFNESS]
    G = numbers[contract.DAMPING]
    quadratic = numbers[contract.QUADRATIC]
    cubic = numbers[contract.CUBIC]
    eta = numbers[contract.HYSTERESIS]
    mass = numbers[contract.DECK_MASS]
    degree = int(S[layout.HERE_DEGREE])
    fdegree = int(S[layout.HERE_FACTOR_DEGREE])
    omega = S[layout.HERE_OMEGA]
    wavy = omega != 0.0
    stiff = K - omega * omega
    a = S[layout.HERE_AMP_SIN]
    b = S[layout.HERE_AMP_COS]
    gain_sin = stiff * a - G * omega * b
    gain_cos = stiff * b + G * omega * a
    for k in range(degree + 1):
        up = S[layout.HERE_POLY + k + 1] * (k + 1) if k + 1 <= degree else 0.0
        for lane in range(LANES):
            d = turns[contract.STIFFNESS, lane] * S[layout.HERE_POLY + k] + K * D[layout.HERE_POLY + k, lane]
            d += turns[contract.DAMPING, lane] * up
            if k + 1 <= degree:
                d += G * (k + 1) * D[layout.HERE_POLY + k + 1, lane]
            if k + 2 <= degree:
                d += (k + 2) * (k + 1) * D[layout.HERE_POLY + k + 2, lane]
            D[layout.COMP + k, lane] = d
    for lane in range(LANES):
        D[T, lane] = carried[DT, lane]
        D[U, lane] = carried[DA, lane]
        D[W, lane] = carried[DB, lane]
        D[Y, lane] = carried[DY, lane]
        D[Z, lane] = carried[DZ, lane]
        if wavy:
            d_phase = D[layout.HERE_PHASE0, lane] + omega * carried[DT, lane]
            D[layout.SINES, lane] = S[layout.COSINES] * d_phase
            D[layout.COSINES, lane] = -S[layout.SINES] * d_phase
    for n in range(order):
        _horner_tangent(n, degree, layout.COMP, layout.HORNER, S, D)
        if fdegree >= 0:
            _horner_tangent(n, fdegree, layout.HERE_FACTOR, layout.HORNER_FACTOR, S, D)
        for lane in range(LANES):
            D[Q + n, lane] = 0.0
            D[R + n, lane] = 0.0
            D[F + n, lane] = 0.0
            D[N + n, lane] = 0.0
            D[layout.WORK + n, lane] = 0.0
        for j in range(n + 1):
            u = S[U + n - j]
            for lane in range(LANES):
                D[Q + n, lane] += 2.0 * u * D[U + j, lane]
        for j in range(n + 1):
            u = cubic * S[U + n - j]
            q = cubic * S[Q + n - j]
            for lane in range(LANES):
                D[R + n, lane] += D[Q + j, lane] * u + D[U + j, lane] * q
        for lane in range(LANES):
            D[R + n, lane] += quadratic * D[Q + n, lane]
            D[F + n, lane] = D[R + n, lane]
        if fdegree >= 0:
            for lane in range(LANES):
                D[F + n, lane] = 0.0
            for j in range(n + 1):
                c = S[layout.HORNER_FACTOR + n - j]
                r = S[R + n - j]
                for lane in range(LANES):
                    D[F + n, lane] += D[layout.HORNER_FACTOR + j, lane] * r + D[R + j, lane] * c
        for lane in range(LANES):
            D[N + n, lane] = D[F + n, lane]
        if eta != 0.0:
            for j in range(n + 1):
                w = S[W + n - j]
                f = S[F + n - j]
                for lane in range(LANES):
                    D[N + n, lane] += turns[contract.HYSTERESIS, lane] * S[F + j] * w
                    D[N + n, lane] += eta * (D[F + j, lane] * w + D[W + j, lane] * f)
        for lane in range(LANES):
            acceleration = 0.0
            if mass > 0.0:
                acceleration = -numbers[contract.DECK_STIFFNESS] * D[Y + n, lane]
                acceleration -= numbers[contract.DECK_DAMPING] * D[Z + n, lane]
                moved = turns[contract.DECK_STIFFNESS, lane] * S[Y + n] + turns[contract.DECK_DAMPING, lane] * S[Z + n]
                acceleration -= moved
                if on_deck:
                    acceleration -= D[N + n, lane]
                    if n == 0:
                        acceleration += turns[contract.PRESTRESS, lane]
                acceleration = (acceleration - turns[contract.DECK_MASS, lane] * S[layout.ACC + n]) / mass
            D[layout.ACC + n, lane] = acceleration
            f = D[layout.HORNER + n, lane]
            if wavy:
                d_stiff = turns[contract.STIFFNESS, lane] - 2.0 * omega * D[layout.HERE_OMEGA, lane]
                d_drag = turns[contract.DAMPING, lane] * omega + G * D[layout.HERE_OMEGA, lane]
                d_a = D[layout.HERE_AMP_SIN, lane]
                d_b = D[layout.HERE_AMP_COS, lane]
                d_sin = d_stiff * a + stiff * d_a - d_drag * b - G * omega * d_b
                d_cos = d_stiff * b + stiff * d_b + d_drag * a + G * omega * d_a
                waves = d_sin * S[layout.SINES + n] + gain_sin * D[layout.SINES + n, lane]
                f += waves + d_cos * S[layout.COSINES + n] + gain_cos * D[layout.COSINES + n, lane]
            lift = -S[Q + n]
            sway = -S[W + n]
            d_lift = -D[Q + n, lane]
            d_sway = -D[W + n, lane]
            if on_deck:
                lift += S[Y + n]
                sway += S[Z + n]
                d_lift += D[Y + n, lane]
                d_sway += D[Z + n, lane]
                f += acceleration
            f += turns[contract.STIFFNESS, lane] * lift + K * d_lift + turns[contract.DAMPING, lane] * sway + G * d_sway
            D[layout.WORK + n, lane] = f - D[N + n, lane]
        part = 1.0 / (n + 1)
        for lane in range(LANES):
            D[T + n + 1, lane] = D[U + n, lane] * part
            D[U + n + 1, lane] = 0.5 * D[W + n, lane] * part
            D[W + n + 1, lane] = 0.0
            D[Y + n + 1, lane] = 0.0
            D[Z + n + 1, lane] = 0.0
        for j in range(n + 1):
            u = S[U + n - j] * part
            g = S[layout.WORK + n - j] * part
            for lane in range(LANES):
                D[W + n + 1, lane] += D[U + j, lane] * g + D[layout.WORK + j, lane] * u
        if mass > 0.0:
            for j in range(n + 1):
                u = S[U + n - j] * part
                z = S[Z + n - j] * part
                c = S[layout.ACC + n - j] * part
                for lane in range(LANES):
                    D[Y + n + 1, lane] += D[U + j, lane] * z + D[Z + j, lane] * u
                    D[Z + n + 1, lane] += D[U + j, lane] * c + D[layout.ACC + j, lane] * u
        if wavy:
            for lane in range(LANES):
                D[layout.SINES + n + 1, lane] = D[layout.HERE_OMEGA, lane] / omega * S[layout.SINES + n + 1]
                D[layout.COSINES + n + 1, lane] = D[layout.HERE_OMEGA, lane] / omega * S[layout.COSINES + n + 1]
            for j in range(n + 1):
                u = S[U + n - j] * part * omega
                s = S[layout.SINES + n - j] * part * omega
                c = S[layout.COSINES + n - j] * part * omega
                for lane in range(LANES):
                    D[layout.SINES + n + 1, lane] += D[U + j, lane] * c + D[layout.COSINES + j, lane] * u
                    D[layout.COSINES + n + 1, lane] -= D[U + j, lane] * s + D[layout.SINES + j, lane] * u


@kernel
def flight_tangent(
    numbers: FloatArray, turns: FloatArray, on_deck: bool, bonded: bool, carried: FloatArray, S: FloatArray,
    D: FloatArray,
) -> None:  # fmt: skip
    """Fill the tangents of rows U (y), W (v), Y and Z at fixed time. The series of the step have been made."""
    K = numbers[contract.STIFFNESS]
    G = numbers[contract.DAMPING]
    mass = numbers[contract.DECK_MASS]
    for lane in range(LANES):
        D[U, lane] = carried[DA, lane]
        D[W, lane] = carried[DB, lane]
        D[Y, lane] = carried[DY, lane]
        D[Z, lane] = carried[DZ, lane]
    for n in range(layout.FLIGHT_ORDER):
        part = 1.0 / (n + 1)
        if bonded:
            for lane in range(LANES):
                _bonded_force_tangent(n, lane, on_deck, S, D)
        else:
            for lane in range(LANES):
                D[N + n, lane] = 0.0
        y = S[U + n]
        v = S[W + n]
        for lane in range(LANES):
            rate = D[N + n, lane] - K * D[U + n, lane] - G * D[W + n, lane]
            rate -= turns[contract.STIFFNESS, lane] * y + turns[contract.DAMPING, lane] * v
            D[U + n + 1, lane] = D[W + n, lane] * part
            D[W + n + 1, lane] = rate * part
        if mass > 0.0:
            for lane in range(LANES):
                pull = -numbers[contract.DECK_STIFFNESS] * D[Y + n, lane]
                pull -= numbers[contract.DECK_DAMPING] * D[Z + n, lane]
                pull -= turns[contract.DECK_STIFFNESS, lane] * S[Y + n] + turns[contract.DECK_DAMPING, lane] * S[Z + n]
                if on_deck:
                    pull -= D[N + n, lane]
                    if n == 0:
                        pull += turns[contract.PRESTRESS, lane]
                pull -= turns[contract.DECK_MASS, lane] * (n + 1) * S[Z + n + 1]
                D[Y + n + 1, lane] = D[Z + n, lane] * part
                D[Z + n + 1, lane] = pull / mass * part


@kernel
def _bonded_force_tangent(n: int, lane: int, on_deck: bool, S: FloatArray, D: FloatArray) -> None:
    """Write the tangent of order n of N = factor·(y_k + Y - y), in time."""
    path = D[layout.HERE_POLY + n, lane] if n <= int(S[layout.HERE_DEGREE]) else 0.0
    if S[layout.HERE_OMEGA] != 0.0:
        path += _harmonic_tangent(n, lane, S, D)
    D[F + n, lane] = path - D[U + n, lane] + (D[Y + n, lane] if on_deck else 0.0)
    force = D[F + n, lane]
    fdegree = int(S[layout.HERE_FACTOR_DEGREE])
    if fdegree >= 0:
        force = 0.0
        for j in range(min(n, fdegree) + 1):
            force += S[layout.HERE_FACTOR + j] * D[F + n - j, lane]
            force += D[layout.HERE_FACTOR + j, lane] * _clearance_tangent(n - j, on_deck, S)
    D[N + n, lane] = force


@kernel
def _clearance_tangent(n: int, on_deck: bool, S: FloatArray) -> float:
    return S[F + n] - S[U + n] + (S[Y + n] if on_deck else 0.0)


@kernel
def _harmonic_tangent(n: int, lane: int, S: FloatArray, D: FloatArray) -> float:
    """Return the tangent of the harmonic's coefficient of order n in time."""
    omega = S[layout.HERE_OMEGA]
    power = 1.0
    for k in range(1, n + 1):
        power *= omega / k
    phase = S[layout.HERE_PHASE0] + 0.5 * np.pi * n
    s = sin(phase)
    c = cos(phase)
    h = S[layout.HERE_AMP_SIN] * s + S[layout.HERE_AMP_COS] * c
    d = D[layout.HERE_AMP_SIN, lane] * s + D[layout.HERE_AMP_COS, lane] * c
    d += (S[layout.HERE_AMP_SIN] * c - S[layout.HERE_AMP_COS] * s) * D[layout.HERE_PHASE0, lane]
    return power * (d + h * n * D[layout.HERE_OMEGA, lane] / omega)
