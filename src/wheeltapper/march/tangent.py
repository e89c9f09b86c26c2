"""Derivatives of a march with respect to parameters: its steps are gone through once more, with their tangents.

LANES directions at a time; in each, the numbers of the program, the pieces of the path and the start change at given
rates. Between events the regularised system is differentiated (every product by its rule, every series analytic):

contact row   tangents at fixed s of t, u, w, Y, Z            flight row   tangents at fixed time of y, v, Y, Z
for each row: series, tangents of the series -> force maxima inside it -> its end
at the end of a contact, and at every breakpoint: to fixed time, where y, v, Y, Z are continuous
    (but where the force itself jumps: v_p += (a_before - a_after)·dt_b/dp)
at a landing: t_p = -g_p/g', u_p = 0, all else the total derivative along the event

(The project's numerics reference, section 5.)
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import (
    ACC,
    AMP_COS,
    AMP_SIN,
    COMP,
    COSINE,
    DEGREE,
    FACTOR,
    FACTOR_DEGREE,
    FLIGHT_ORDER,
    HERE,
    HORNER,
    HORNER_FACTOR,
    OMEGA,
    PHASE0,
    POLY,
    SINE,
    WIDTH,
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
    BONDED,
    CONTACT,
    DECK_V,
    DECK_Y,
    DEFAULT_ORDER,
    LENGTH,
    ON_DECK,
    PHASE,
    PIECE,
    SHIFT,
    TIME,
    A,
    B,
    FloatArray,
    IntArray,
)
from wheeltapper.march.roots import evaluate, evaluate_derivative
from wheeltapper.march.series import (
    bonded_series,
    contact_series,
    factor_at,
    flight_series,
    localise,
    path_at,
    taylor_shift,
)
from wheeltapper.march.step import time_to
from wheeltapper.march.unrolled_tangent import tangent_flat_12, tangent_wave_12

LANES = 8
"""Directions that are carried at a time."""
# Rows of the carried tangents: of time, of u and w (in contact) or y and v, of the deck, of the table's shift and of
# the time of the next breakpoint; u and w once more, at the end of a contact step.
DT, DA, DB, DY, DZ, DSHIFT, DBREAK, DU, DW = range(9)
CARRIED = 9
# The motion at a step's end, in its own variables.
AFTER, FIRST, SECOND, THIRD, FOURTH = range(5)
# What is found: of events and peaks the derivative of the time, then of the rate or of the force.
OF_TIME, OF_SIZE = 0, 1
GRAZING = 1e-3
"""Events with a smaller indentation rate (scaled) make a derivative meaningless."""


@kernel
def localise_tangent(
    pieces: FloatArray, bends: FloatArray, base: int, table: IntArray, numbers: FloatArray, turns: FloatArray,
    step: FloatArray, carried: FloatArray, S: FloatArray, D: FloatArray,
) -> None:  # fmt: skip
    """Write the derivatives of the present piece's local form, at fixed time. `localise` has run.

    `bends` holds derivatives of the pieces, bends[table[lane], base + piece] those of a lane (-1: none); `turns`
    (NUMBERS, LANES) those of the numbers.
    """
    piece = int(step[PIECE])
    time = step[TIME]
    row = pieces[piece]
    pace = numbers[contract.PACE]
    lift = numbers[contract.LIFT]
    away = pace * time - step[SHIFT] - row[contract.CENTRE]
    wavenumber = row[contract.WAVENUMBER]
    degree = int(row[contract.DEGREE])
    fdegree = int(row[contract.FACTOR_DEGREE])
    for lane in range(LANES):
        bent = table[lane] >= 0
        d_away = turns[contract.PACE, lane] * time - carried[DSHIFT, lane]
        d_lift = turns[contract.LIFT, lane]
        d_wavenumber = 0.0
        D[HERE + AMP_SIN, lane] = row[contract.SINE] * d_lift
        D[HERE + AMP_COS, lane] = row[contract.COSINE] * d_lift
        if bent:
            bend = bends[table[lane], base + piece]
            d_away -= bend[contract.CENTRE]
            d_wavenumber = bend[contract.WAVENUMBER]
            D[HERE + AMP_SIN, lane] += bend[contract.SINE] * lift
            D[HERE + AMP_COS, lane] += bend[contract.COSINE] * lift
        D[HERE + OMEGA, lane] = d_wavenumber * pace + wavenumber * turns[contract.PACE, lane]
        D[HERE + PHASE0, lane] = d_wavenumber * away + wavenumber * d_away
        D[WORK, lane] = d_away / row[contract.SCALE]
    scale = row[contract.SCALE]
    for part in range(2):
        last = degree if part == 0 else fdegree
        if last < 0:
            continue
        source = contract.COEFFICIENT if part == 0 else contract.FACTOR
        target = HERE + POLY if part == 0 else HERE + FACTOR
        gain = lift if part == 0 else 1.0
        taylor_shift(pieces, piece, source, last, away / scale, 1.0, 1.0, WORK, S)
        for lane in range(LANES):
            d_gain = turns[contract.LIFT, lane] if part == 0 else 0.0
            rate = pace / scale
            d_rate = turns[contract.PACE, lane] / scale
            power = 1.0
            d_power = 0.0
            for k in range(last + 1):
                c = S[WORK + k]
                d_c = (k + 1) * S[WORK + k + 1] * D[WORK, lane] if k < last else 0.0
                D[target + k, lane] = d_gain * power * c + gain * (d_power * c + power * d_c)
                d_power = d_power * rate + power * d_rate
                power *= rate
        for lane in range(LANES):
            if table[lane] < 0:
                continue
            taylor_shift(bends[table[lane]], base + piece, source, last, away / scale, 1.0, 1.0, WORK, S)
            power = gain
            for k in range(last + 1):
                D[target + k, lane] += power * S[WORK + k]
                power *= pace / scale


@kernel
def path_tangent(after: float, lane: int, S: FloatArray, D: FloatArray) -> tuple[float, float]:
    """Return the derivatives, at fixed time, of the path's height and velocity at a time after the step's start."""
    degree = int(S[HERE + DEGREE])
    y = D[HERE + POLY + degree, lane]
    v = 0.0
    for k in range(degree - 1, -1, -1):
        v = v * after + y
        y = y * after + D[HERE + POLY + k, lane]
    omega = S[HERE + OMEGA]
    if omega != 0.0:
        phase = S[HERE + PHASE0] + omega * after
        d_phase = D[HERE + PHASE0, lane] + D[HERE + OMEGA, lane] * after
        s = sin(phase)
        c = cos(phase)
        across = S[HERE + AMP_SIN] * c - S[HERE + AMP_COS] * s
        y += D[HERE + AMP_SIN, lane] * s + D[HERE + AMP_COS, lane] * c + across * d_phase
        v += D[HERE + OMEGA, lane] * across
        v += omega * (D[HERE + AMP_SIN, lane] * c - D[HERE + AMP_COS, lane] * s)
        v -= omega * (S[HERE + AMP_SIN] * s + S[HERE + AMP_COS] * c) * d_phase
    return y, v


@kernel
def factor_tangent(after: float, lane: int, S: FloatArray, D: FloatArray) -> float:
    """Return the derivative, at fixed time, of the factor on the contact force."""
    degree = int(S[HERE + FACTOR_DEGREE])
    value = 0.0
    for k in range(degree, -1, -1):
        value = value * after + D[HERE + FACTOR + k, lane]
    return value


@kernel
def at(D: FloatArray, row: int, n: int, x: float, lane: int) -> float:
    """Return Σ D[row + k, lane]·x^k, k = 0 … n."""
    total = D[row + n, lane]
    for k in range(n - 1, -1, -1):
        total = total * x + D[row + k, lane]
    return total


@kernel
def _horner_tangent(n: int, degree: int, first: int, rows: int, S: FloatArray, D: FloatArray) -> None:
    """Advance the tangents of the nested series to order n: those of R^k = c_k + t(s)·R^{k+1}."""
    for lane in range(LANES):
        D[rows + degree * WIDTH + n, lane] = D[first + degree, lane] if n == 0 else 0.0
    for k in range(degree - 1, -1, -1):
        here = rows + k * WIDTH
        above = here + WIDTH
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
    degree = int(S[HERE + DEGREE])
    fdegree = int(S[HERE + FACTOR_DEGREE])
    omega = S[HERE + OMEGA]
    wavy = omega != 0.0
    stiff = K - omega * omega
    a = S[HERE + AMP_SIN]
    b = S[HERE + AMP_COS]
    gain_sin = stiff * a - G * omega * b
    gain_cos = stiff * b + G * omega * a
    for k in range(degree + 1):
        up = S[HERE + POLY + k + 1] * (k + 1) if k + 1 <= degree else 0.0
        for lane in range(LANES):
            d = turns[contract.STIFFNESS, lane] * S[HERE + POLY + k] + K * D[HERE + POLY + k, lane]
            d += turns[contract.DAMPING, lane] * up
            if k + 1 <= degree:
                d += G * (k + 1) * D[HERE + POLY + k + 1, lane]
            if k + 2 <= degree:
                d += (k + 2) * (k + 1) * D[HERE + POLY + k + 2, lane]
            D[COMP + k, lane] = d
    for lane in range(LANES):
        D[T, lane] = carried[DT, lane]
        D[U, lane] = carried[DA, lane]
        D[W, lane] = carried[DB, lane]
        D[Y, lane] = carried[DY, lane]
        D[Z, lane] = carried[DZ, lane]
        if wavy:
            d_phase = D[HERE + PHASE0, lane] + omega * carried[DT, lane]
            D[SINE, lane] = S[COSINE] * d_phase
            D[COSINE, lane] = -S[SINE] * d_phase
    for n in range(order):
        _horner_tangent(n, degree, COMP, HORNER, S, D)
        if fdegree >= 0:
            _horner_tangent(n, fdegree, HERE + FACTOR, HORNER_FACTOR, S, D)
        for lane in range(LANES):
            D[Q + n, lane] = 0.0
            D[R + n, lane] = 0.0
            D[F + n, lane] = 0.0
            D[N + n, lane] = 0.0
            D[WORK + n, lane] = 0.0
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
                c = S[HORNER_FACTOR + n - j]
                r = S[R + n - j]
                for lane in range(LANES):
                    D[F + n, lane] += D[HORNER_FACTOR + j, lane] * r + D[R + j, lane] * c
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
                acceleration = (
                    -numbers[contract.DECK_STIFFNESS] * D[Y + n, lane] - numbers[contract.DECK_DAMPING] * D[Z + n, lane]
                )
                acceleration -= (
                    turns[contract.DECK_STIFFNESS, lane] * S[Y + n] + turns[contract.DECK_DAMPING, lane] * S[Z + n]
                )
                if on_deck:
                    acceleration -= D[N + n, lane]
                    if n == 0:
                        acceleration += turns[contract.PRESTRESS, lane]
                acceleration = (acceleration - turns[contract.DECK_MASS, lane] * S[ACC + n]) / mass
            D[ACC + n, lane] = acceleration
            f = D[HORNER + n, lane]
            if wavy:
                d_stiff = turns[contract.STIFFNESS, lane] - 2.0 * omega * D[HERE + OMEGA, lane]
                d_drag = turns[contract.DAMPING, lane] * omega + G * D[HERE + OMEGA, lane]
                d_a = D[HERE + AMP_SIN, lane]
                d_b = D[HERE + AMP_COS, lane]
                d_sin = d_stiff * a + stiff * d_a - d_drag * b - G * omega * d_b
                d_cos = d_stiff * b + stiff * d_b + d_drag * a + G * omega * d_a
                f += (
                    d_sin * S[SINE + n]
                    + gain_sin * D[SINE + n, lane]
                    + d_cos * S[COSINE + n]
                    + gain_cos * D[COSINE + n, lane]
                )
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
            D[WORK + n, lane] = f - D[N + n, lane]
        part = 1.0 / (n + 1)
        for lane in range(LANES):
            D[T + n + 1, lane] = D[U + n, lane] * part
            D[U + n + 1, lane] = 0.5 * D[W + n, lane] * part
            D[W + n + 1, lane] = 0.0
            D[Y + n + 1, lane] = 0.0
            D[Z + n + 1, lane] = 0.0
        for j in range(n + 1):
            u = S[U + n - j] * part
            g = S[WORK + n - j] * part
            for lane in range(LANES):
                D[W + n + 1, lane] += D[U + j, lane] * g + D[WORK + j, lane] * u
        if mass > 0.0:
            for j in range(n + 1):
                u = S[U + n - j] * part
                z = S[Z + n - j] * part
                c = S[ACC + n - j] * part
                for lane in range(LANES):
                    D[Y + n + 1, lane] += D[U + j, lane] * z + D[Z + j, lane] * u
                    D[Z + n + 1, lane] += D[U + j, lane] * c + D[ACC + j, lane] * u
        if wavy:
            for lane in range(LANES):
                D[SINE + n + 1, lane] = D[HERE + OMEGA, lane] / omega * S[SINE + n + 1]
                D[COSINE + n + 1, lane] = D[HERE + OMEGA, lane] / omega * S[COSINE + n + 1]
            for j in range(n + 1):
                u = S[U + n - j] * part * omega
                s = S[SINE + n - j] * part * omega
                c = S[COSINE + n - j] * part * omega
                for lane in range(LANES):
                    D[SINE + n + 1, lane] += D[U + j, lane] * c + D[COSINE + j, lane] * u
                    D[COSINE + n + 1, lane] -= D[U + j, lane] * s + D[SINE + j, lane] * u


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
    for n in range(FLIGHT_ORDER):
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
    path = D[HERE + POLY + n, lane] if n <= int(S[HERE + DEGREE]) else 0.0
    if S[HERE + OMEGA] != 0.0:
        path += _harmonic_tangent(n, lane, S, D)
    D[F + n, lane] = path - D[U + n, lane] + (D[Y + n, lane] if on_deck else 0.0)
    force = D[F + n, lane]
    fdegree = int(S[HERE + FACTOR_DEGREE])
    if fdegree >= 0:
        force = 0.0
        for j in range(min(n, fdegree) + 1):
            force += S[HERE + FACTOR + j] * D[F + n - j, lane]
            force += D[HERE + FACTOR + j, lane] * _clearance(n - j, on_deck, S)
    D[N + n, lane] = force


@kernel
def _clearance(n: int, on_deck: bool, S: FloatArray) -> float:
    return S[F + n] - S[U + n] + (S[Y + n] if on_deck else 0.0)


@kernel
def _harmonic_tangent(n: int, lane: int, S: FloatArray, D: FloatArray) -> float:
    """Return the tangent of the harmonic's coefficient of order n in time."""
    omega = S[HERE + OMEGA]
    power = 1.0
    for k in range(1, n + 1):
        power *= omega / k
    phase = S[HERE + PHASE0] + 0.5 * np.pi * n
    s = sin(phase)
    c = cos(phase)
    h = S[HERE + AMP_SIN] * s + S[HERE + AMP_COS] * c
    d = D[HERE + AMP_SIN, lane] * s + D[HERE + AMP_COS, lane] * c
    d += (S[HERE + AMP_SIN] * c - S[HERE + AMP_COS] * s) * D[HERE + PHASE0, lane]
    return power * (d + h * n * D[HERE + OMEGA, lane] / omega)


@kernel
def _motion(numbers: FloatArray, step: FloatArray, end: FloatArray, S: FloatArray, here: FloatArray) -> None:
    """Write path, velocity, acceleration of the path, y, v, a, Y, Z, Z', N at the end of a step, localised in S."""
    on_deck = step[ON_DECK] != 0.0
    mass = numbers[contract.DECK_MASS]
    height, velocity, bend = path_at(end[AFTER], S)
    factor, _ = factor_at(end[AFTER], S)
    lift = end[THIRD] if on_deck else 0.0
    lift_rate = end[FOURTH] if on_deck else 0.0
    y = end[FIRST]
    v = end[SECOND]
    force = 0.0
    if step[PHASE] == CONTACT:
        u = end[FIRST]
        y = height + lift - u * u
        v = velocity + lift_rate - end[SECOND]
        law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
        force = max(factor * law * (1.0 + numbers[contract.HYSTERESIS] * end[SECOND]), 0.0)
    elif step[PHASE] == BONDED:
        force = factor * (height + lift - y)
    pull = 0.0
    if mass > 0.0:
        pull = -numbers[contract.DECK_STIFFNESS] * end[THIRD] - numbers[contract.DECK_DAMPING] * end[FOURTH]
        if on_deck:
            pull += numbers[contract.PRESTRESS] - force
        pull /= mass
    here[0] = height
    here[1] = velocity
    here[2] = bend
    here[3] = y
    here[4] = v
    here[5] = -1.0 - numbers[contract.STIFFNESS] * y - numbers[contract.DAMPING] * v + force
    here[6] = end[THIRD]
    here[7] = end[FOURTH]
    here[8] = pull
    here[9] = force


@kernel
def _enter_contact(step: FloatArray, carried: FloatArray, S: FloatArray, D: FloatArray) -> bool:
    """Turn tangents at fixed time into those of a contact step that starts here; return False where it grazes."""
    u = step[A]
    on_deck = step[ON_DECK] != 0.0
    for lane in range(LANES):
        height, velocity = path_tangent(0.0, lane, S, D)
        delta = height - carried[DA, lane] + (carried[DY, lane] if on_deck else 0.0)
        carried[DB, lane] = velocity - carried[DB, lane] + (carried[DZ, lane] if on_deck else 0.0)
        carried[DT, lane] = 0.0
        carried[DA, lane] = delta / (2.0 * u) if u > 1e-7 else 0.0
    return u > 1e-7


@kernel
def _land(here: FloatArray, carried: FloatArray, on_deck: bool, after: float, S: FloatArray, D: FloatArray) -> None:
    """Turn tangents at fixed time, before a landing, into those along it; `here` is the motion there."""
    rate = here[1] - here[4] + (here[7] if on_deck else 0.0)
    bend = here[2] - here[5] + (here[8] if on_deck else 0.0)
    for lane in range(LANES):
        height, velocity = path_tangent(after, lane, S, D)
        gap = height - carried[DA, lane] + (carried[DY, lane] if on_deck else 0.0)
        sway = velocity - carried[DB, lane] + (carried[DZ, lane] if on_deck else 0.0)
        delay = -gap / rate
        carried[DT, lane] = delay
        carried[DA, lane] = 0.0
        carried[DB, lane] = sway + bend * delay
        carried[DY, lane] += here[7] * delay
        carried[DZ, lane] += here[8] * delay


@kernel
def _leave_contact(
    here: FloatArray, end: FloatArray, on_deck: bool, carried: FloatArray, S: FloatArray, D: FloatArray
) -> None:
    """Turn the tangents at the end of a contact step, at fixed s, into those at fixed time."""
    for lane in range(LANES):
        dt = carried[DT, lane]
        height, velocity = path_tangent(end[AFTER], lane, S, D)
        y = height + here[1] * dt - 2.0 * end[FIRST] * carried[DA, lane]
        v = velocity + here[2] * dt - carried[DB, lane]
        if on_deck:
            y += carried[DY, lane]
            v += carried[DZ, lane]
        carried[DU, lane] = carried[DA, lane]
        carried[DW, lane] = carried[DB, lane]
        carried[DA, lane] = y - here[4] * dt
        carried[DB, lane] = v - here[5] * dt
        carried[DY, lane] -= here[7] * dt
        carried[DZ, lane] -= here[8] * dt


@kernel
def _peaks_inside(
    numbers: FloatArray, step: FloatArray, end: float, peaks: FloatArray, peak: int, of_peaks: FloatArray,
    S: FloatArray, D: FloatArray,
) -> int:  # fmt: skip
    """Write the derivatives of the smooth force maxima inside a step; return the next maximum's row."""
    contact = step[PHASE] == CONTACT
    order = int(numbers[contract.ORDER]) if contact else int(FLIGHT_ORDER)
    cubic = numbers[contract.CUBIC]
    quadratic = numbers[contract.QUADRATIC]
    plain = numbers[contract.HYSTERESIS] == 0.0 and S[HERE + FACTOR_DEGREE] < 0.0
    while _is_inside(peaks, peak, end):
        after = peaks[peak, contract.PEAK_TIME] - step[TIME]
        x = time_to(S, order, step[LENGTH], after) if contact else after
        for lane in range(LANES):
            if not contact:
                of_peaks[peak, OF_SIZE, lane] = at(D, N, order - 1, x, lane)
                bend = _second(S, N, order, x)
                of_peaks[peak, OF_TIME, lane] = -_slope(D, N, order - 1, x, lane) / bend
            elif plain:
                u = evaluate(S, U, order, x)
                slope = evaluate_derivative(S, W, order, x)
                d_u = at(D, U, order, x, lane)
                d_w = at(D, W, order, x, lane)
                of_peaks[peak, OF_SIZE, lane] = (2.0 * quadratic * u + 3.0 * cubic * u * u) * d_u
                of_peaks[peak, OF_TIME, lane] = at(D, T, order, x, lane) - u * d_w / slope
            else:
                u = evaluate(S, U, order, x)
                bend = _second(S, N, order - 1, x)
                of_peaks[peak, OF_SIZE, lane] = at(D, N, order - 1, x, lane)
                of_peaks[peak, OF_TIME, lane] = at(D, T, order, x, lane) - u * _slope(D, N, order - 1, x, lane) / bend
        peak += 1
    return peak


@kernel
def _slope(D: FloatArray, row: int, n: int, x: float, lane: int) -> float:
    total = 0.0
    for k in range(n, 0, -1):
        total = total * x + k * D[row + k, lane]
    return total


@kernel
def _second(S: FloatArray, row: int, n: int, x: float) -> float:
    total = 0.0
    for k in range(n, 1, -1):
        total = total * x + k * (k - 1) * S[row + k]
    return total


@kernel
def _break_moves(
    bends: FloatArray, base: int, table: IntArray, numbers: FloatArray, turns: FloatArray, step: FloatArray,
    after: FloatArray, carried: FloatArray,
) -> None:  # fmt: skip
    """Write how the time of the breakpoint between two steps moves, and how the table's shift does."""
    pace = numbers[contract.PACE]
    piece = int(step[PIECE])
    for lane in range(LANES):
        carried[DBREAK, lane] = 0.0
        bent = table[lane] >= 0
        if after[PIECE] != step[PIECE] or after[SHIFT] != step[SHIFT]:
            moved = carried[DSHIFT, lane] - turns[contract.PACE, lane] * after[TIME]
            if bent:
                moved += bends[table[lane], base + piece, contract.STOP]
            carried[DBREAK, lane] = moved / pace
            if after[SHIFT] != step[SHIFT] and bent:
                loop = int(after[PIECE])
                carried[DSHIFT, lane] += (
                    bends[table[lane], base + piece, contract.STOP] - bends[table[lane], base + loop, contract.START]
                )
        elif after[ON_DECK] != step[ON_DECK]:
            which = contract.DECK_FROM if after[ON_DECK] != 0.0 else contract.DECK_TO
            carried[DBREAK, lane] = turns[which, lane]


@kernel
def _flight_tangents(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, carried: FloatArray, end: FloatArray, S: FloatArray,
    D: FloatArray,
) -> None:  # fmt: skip
    """Carry the tangents over a localised step without regularised contact; write the motion at its end."""
    bonded = step[PHASE] == BONDED
    on_deck = step[ON_DECK] != 0.0
    x = step[LENGTH]
    if bonded:
        bonded_series(numbers, FLIGHT_ORDER, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S)
    else:
        flight_series(numbers, FLIGHT_ORDER, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S)
    flight_tangent(numbers, turns, on_deck, bonded, carried, S, D)
    deck = numbers[contract.DECK_MASS] > 0.0
    for lane in range(LANES):
        carried[DA, lane] = at(D, U, FLIGHT_ORDER, x, lane)
        carried[DB, lane] = at(D, W, FLIGHT_ORDER, x, lane)
        if deck:
            carried[DY, lane] = at(D, Y, FLIGHT_ORDER, x, lane)
            carried[DZ, lane] = at(D, Z, FLIGHT_ORDER, x, lane)
    end[AFTER] = x
    end[FIRST] = evaluate(S, U, FLIGHT_ORDER, x)
    end[SECOND] = evaluate(S, W, FLIGHT_ORDER, x)
    end[THIRD] = evaluate(S, Y, FLIGHT_ORDER, x) if deck else 0.0
    end[FOURTH] = evaluate(S, Z, FLIGHT_ORDER, x) if deck else 0.0


@kernel
def _contact_tangents(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, carried: FloatArray, end: FloatArray, S: FloatArray,
    D: FloatArray,
) -> None:  # fmt: skip
    """Carry the tangents over a localised contact step, at fixed s; write the motion at its end."""
    order = int(numbers[contract.ORDER])
    on_deck = step[ON_DECK] != 0.0
    x = step[LENGTH]
    contact_series(numbers, order, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S)
    contact_tangent(numbers, turns, order, on_deck, carried, S, D)
    for lane in range(LANES):
        carried[DT, lane] = at(D, T, order, x, lane)
        carried[DA, lane] = at(D, U, order, x, lane)
        carried[DB, lane] = at(D, W, order, x, lane)
        carried[DY, lane] = at(D, Y, order, x, lane)
        carried[DZ, lane] = at(D, Z, order, x, lane)
    end[AFTER] = evaluate(S, T, order, x)
    end[FIRST] = evaluate(S, U, order, x)
    end[SECOND] = evaluate(S, W, order, x)
    end[THIRD] = evaluate(S, Y, order, x)
    end[FOURTH] = evaluate(S, Z, order, x)


@kernel
def _plain_tangents(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, x: float, carried: FloatArray, end: FloatArray,
    S: FloatArray, D: FloatArray, L: FloatArray,
) -> None:  # fmt: skip
    """Do what `_contact_tangents` does up to x, where the contact is plain and the path level or one wave."""
    K = numbers[contract.STIFFNESS]
    G = numbers[contract.DAMPING]
    level = S[HERE + POLY]
    omega = S[HERE + OMEGA]
    for lane in range(LANES):
        L[lane] = carried[DT, lane]
        L[LANES + lane] = carried[DA, lane]
        L[2 * LANES + lane] = carried[DB, lane]
        L[3 * LANES + lane] = turns[contract.STIFFNESS, lane]
        L[4 * LANES + lane] = turns[contract.DAMPING, lane]
        L[5 * LANES + lane] = turns[contract.STIFFNESS, lane] * level + K * D[HERE + POLY, lane]
    if omega == 0.0:
        t, u, w = tangent_flat_12(K, G, 1.0 + K * level, step[A], step[B], x, L)
    else:
        a = S[HERE + AMP_SIN]
        b = S[HERE + AMP_COS]
        stiff = K - omega * omega
        gain_sin = stiff * a - G * omega * b
        gain_cos = stiff * b + G * omega * a
        s = sin(S[HERE + PHASE0])
        c = cos(S[HERE + PHASE0])
        along = gain_sin * s + gain_cos * c
        across = gain_sin * c - gain_cos * s
        size = gain_sin * gain_sin + gain_cos * gain_cos
        for lane in range(LANES):
            d_omega = D[HERE + OMEGA, lane]
            d_a = D[HERE + AMP_SIN, lane]
            d_b = D[HERE + AMP_COS, lane]
            d_stiff = turns[contract.STIFFNESS, lane] - 2.0 * omega * d_omega
            d_drag = turns[contract.DAMPING, lane] * omega + G * d_omega
            d_sin = d_stiff * a + stiff * d_a - d_drag * b - G * omega * d_b
            d_cos = d_stiff * b + stiff * d_b + d_drag * a + G * omega * d_a
            L[6 * LANES + lane] = (d_sin * gain_sin + d_cos * gain_cos) / size
            turn = (d_cos * gain_sin - d_sin * gain_cos) / size
            L[7 * LANES + lane] = (D[HERE + PHASE0, lane] + turn) / omega
            L[8 * LANES + lane] = d_omega / omega
        t, u, w = tangent_wave_12(K, G, 1.0 + K * level, along, omega * across, omega * omega, step[A], step[B], x, L)
    for lane in range(LANES):
        carried[DT, lane] = L[lane]
        carried[DA, lane] = L[LANES + lane]
        carried[DB, lane] = L[2 * LANES + lane]
    end[AFTER] = t
    end[FIRST] = u
    end[SECOND] = w
    end[THIRD] = 0.0
    end[FOURTH] = 0.0


@kernel
def _plain_peak(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, peak: int, peaks: FloatArray, of_peaks: FloatArray,
    carried: FloatArray, end: FloatArray, S: FloatArray, D: FloatArray, L: FloatArray,
) -> None:  # fmt: skip
    """Write the derivatives of a force maximum inside a plain contact step; the carried tangents stay at its start."""
    order = int(numbers[contract.ORDER])
    contact_series(numbers, order, step[A], step[B], 0.0, 0.0, False, S)
    x = time_to(S, order, step[LENGTH], peaks[peak, contract.PEAK_TIME] - step[TIME])
    slope = evaluate_derivative(S, W, order, x)
    for lane in range(LANES):
        L[9 * LANES + lane] = carried[DT, lane]
        L[10 * LANES + lane] = carried[DA, lane]
        L[11 * LANES + lane] = carried[DB, lane]
    _plain_tangents(numbers, turns, step, x, carried, end, S, D, L)
    u = end[FIRST]
    for lane in range(LANES):
        of_peaks[peak, OF_SIZE, lane] = 3.0 * u * u * carried[DA, lane]
        of_peaks[peak, OF_TIME, lane] = carried[DT, lane] - u * carried[DB, lane] / slope
        carried[DT, lane] = L[9 * LANES + lane]
        carried[DA, lane] = L[10 * LANES + lane]
        carried[DB, lane] = L[11 * LANES + lane]


@kernel
def tangent_kernel(
    pieces: FloatArray, bends: FloatArray, base: int, table: IntArray, numbers: FloatArray, turns: FloatArray,
    start: FloatArray, steps: FloatArray, last: FloatArray, events: FloatArray, peaks: FloatArray,
    of_events: FloatArray, of_peaks: FloatArray, of_end: FloatArray, S: FloatArray, D: FloatArray,
) -> float:  # fmt: skip
    """Carry the tangents along all steps; return the smallest indentation rate at an event (scaled).

    `start` (2, LANES) holds changes of the start's displacement and velocity beside those of the numbers; `last` is
    the state at the march's end. Written are the derivatives of time and rate of the events, of time and force of the
    peaks, (rows, 2, LANES), and `of_end` (4, LANES): y, v, Y, Z at the march's end, at fixed time.
    """
    carried = np.zeros((CARRIED, LANES))
    here = np.zeros(10)
    end = np.zeros(5)
    L = np.zeros(12 * LANES)
    event = 0
    peak = 0
    gentlest = np.inf
    begun = False
    level = False
    piece = -1.0
    simple = (
        numbers[contract.DECK_MASS] == 0.0
        and numbers[contract.HYSTERESIS] == 0.0
        and numbers[contract.QUADRATIC] == 0.0
        and numbers[contract.CUBIC] == 1.0
        and numbers[contract.ORDER] == DEFAULT_ORDER
    )
    for lane in range(LANES):
        carried[DA, lane] = turns[contract.START_HEIGHT, lane] + start[0, lane]
        carried[DB, lane] = turns[contract.START_VELOCITY, lane] + start[1, lane]
        carried[DSHIFT, lane] = turns[contract.START_SHIFT, lane]
    for i in range(len(steps)):
        step = steps[i]
        after = steps[i + 1] if i + 1 < len(steps) else last
        contact = step[PHASE] == CONTACT
        on_deck = step[ON_DECK] != 0.0
        if not (level and step[PIECE] == piece):  # a level piece looks the same from everywhere
            localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
            localise_tangent(pieces, bends, base, table, numbers, turns, step, carried, S, D)
            level = S[HERE + DEGREE] == 0.0 and S[HERE + FACTOR_DEGREE] < 0.0 and S[HERE + OMEGA] == 0.0
            piece = step[PIECE]
        if contact and not begun and not _enter_contact(step, carried, S, D):
            gentlest = 0.0
        begun = contact
        if not contact:
            _flight_tangents(numbers, turns, step, carried, end, S, D)
            peak = _peaks_inside(numbers, step, after[TIME], peaks, peak, of_peaks, S, D)
        elif simple and _is_plain(S):
            while _is_inside(peaks, peak, after[TIME]):
                _plain_peak(numbers, turns, step, peak, peaks, of_peaks, carried, end, S, D, L)
                peak += 1
            _plain_tangents(numbers, turns, step, step[LENGTH], carried, end, S, D, L)
        else:
            _contact_tangents(numbers, turns, step, carried, end, S, D)
            peak = _peaks_inside(numbers, step, after[TIME], peaks, peak, of_peaks, S, D)
        if abs(step[TIME] + end[AFTER] - after[TIME]) > 1e-9 * (1.0 + abs(after[TIME])):
            gentlest = 0.0  # the march left a grazing contact by a small leap
        if (
            contact
            and after[PHASE] == CONTACT
            and after[PIECE] == step[PIECE]
            and after[SHIFT] == step[SHIFT]
            and after[ON_DECK] == step[ON_DECK]
            and i + 1 < len(steps)
        ):
            continue
        begun = False
        _motion(numbers, step, end, S, here)
        _break_moves(bends, base, table, numbers, turns, step, after, carried)
        if contact:
            _leave_contact(here, end, on_deck, carried, S, D)
        while peak < len(peaks) and peaks[peak, contract.PEAK_TIME] <= after[TIME]:
            for lane in range(LANES):  # a maximum at a breakpoint: its force along the moving breakpoint
                of_peaks[peak, OF_TIME, lane] = carried[DBREAK, lane]
                of_peaks[peak, OF_SIZE, lane] = _corner(numbers, turns, step, end, here, carried, lane, S, D)
            peak += 1
        for lane in range(LANES):
            of_end[0, lane] = carried[DA, lane]
            of_end[1, lane] = carried[DB, lane]
            of_end[2, lane] = carried[DY, lane]
            of_end[3, lane] = carried[DZ, lane]
        landed = False
        while event < len(events) and events[event, contract.EVENT_TIME] <= after[TIME]:
            gentlest = min(gentlest, abs(events[event, contract.EVENT_RATE]))
            broke = events[event, contract.EVENT_CAUSE] != 0.0
            landed = not broke and events[event, contract.EVENT_KIND] == contract.IMPACT
            if landed:
                _land(here, carried, on_deck, end[AFTER], S, D)
                begun = True
            for lane in range(LANES):
                of_events[event, OF_TIME, lane] = carried[DBREAK, lane] if broke else carried[DT, lane]
                if broke or not (landed or contact):
                    of_events[event, OF_SIZE, lane] = np.nan
                else:
                    of_events[event, OF_SIZE, lane] = carried[DB, lane] if landed else carried[DW, lane]
            event += 1
        if after[PIECE] == step[PIECE] and after[ON_DECK] == step[ON_DECK]:
            continue
        level = False
        if not landed and i + 1 < len(steps):
            _force_jump(pieces, numbers, after, here, carried, S)
    return gentlest


@kernel
def _is_plain(S: FloatArray) -> bool:
    """Return True where the present path is level or one wave of some amplitude, and the contact's factor one."""
    if S[HERE + DEGREE] != 0.0 or S[HERE + FACTOR_DEGREE] >= 0.0:
        return False
    return S[HERE + OMEGA] == 0.0 or S[HERE + AMP_SIN] != 0.0 or S[HERE + AMP_COS] != 0.0


@kernel
def _is_inside(peaks: FloatArray, peak: int, end: float) -> bool:
    """Return True where the next force maximum lies before `end` and at no breakpoint."""
    return peak < len(peaks) and peaks[peak, contract.PEAK_TIME] <= end and peaks[peak, contract.PEAK_CORNER] == 0.0


@kernel
def _corner(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, end: FloatArray, here: FloatArray,
    carried: FloatArray, lane: int, S: FloatArray, D: FloatArray,
) -> float:  # fmt: skip
    """Return the derivative of the force at a breakpoint, along its motion; NaN where no contact was before it."""
    if step[PHASE] != CONTACT:
        return np.nan
    after, u, w = end[AFTER], end[FIRST], end[SECOND]
    factor, rate = factor_at(after, S)
    eta = numbers[contract.HYSTERESIS]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    stiff = 2.0 * numbers[contract.QUADRATIC] + 3.0 * numbers[contract.CUBIC] * u
    dt = carried[DBREAK, lane] - carried[DT, lane]
    bend = here[2] - here[5] + (here[8] if step[ON_DECK] != 0.0 else 0.0)
    # From fixed s along the breakpoint: u·du is half the change of the indentation, so that u = 0 needs no division.
    half = u * carried[DU, lane] + 0.5 * w * dt
    change = factor * stiff * half * (1.0 + eta * w)
    change += factor * law * (eta * (carried[DW, lane] + bend * dt) + turns[contract.HYSTERESIS, lane] * w)
    change += (factor_tangent(after, lane, S, D) + rate * carried[DBREAK, lane]) * law * (1.0 + eta * w)
    return change


@kernel
def _force_jump(
    pieces: FloatArray, numbers: FloatArray, after: FloatArray, here: FloatArray,
    carried: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Add what a jump of the force at a breakpoint does to the velocities at fixed time."""
    localise(pieces, numbers, int(after[PIECE]), after[SHIFT], after[TIME], S)
    factor, _ = factor_at(0.0, S)
    on_deck = after[ON_DECK] != 0.0
    force = 0.0
    if after[PHASE] == CONTACT:
        law = after[A] * after[A] * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * after[A])
        force = max(factor * law * (1.0 + numbers[contract.HYSTERESIS] * after[B]), 0.0)
    elif after[PHASE] == BONDED:
        height, _, _ = path_at(0.0, S)
        force = factor * (height + (after[DECK_Y] if on_deck else 0.0) - after[A])
    mass = numbers[contract.DECK_MASS]
    pull = 0.0
    if mass > 0.0:
        pull = -numbers[contract.DECK_STIFFNESS] * here[6] - numbers[contract.DECK_DAMPING] * here[7]
        if on_deck:
            pull += numbers[contract.PRESTRESS] - force
        pull /= mass
    leap = here[9] - force
    if abs(leap) <= 1e-11 * (1.0 + abs(force)):
        leap = 0.0
    deck_leap = here[8] - pull
    if abs(deck_leap) <= 1e-11 * (1.0 + abs(pull)):
        deck_leap = 0.0
    for lane in range(LANES):
        carried[DB, lane] += leap * carried[DBREAK, lane]
        carried[DZ, lane] += deck_leap * carried[DBREAK, lane]
