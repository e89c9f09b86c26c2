"""Tangents of the path and of the contact's factor, in the local form of one step.

D has the rows of the scratch array S (layout.py), each with LANES entries: the derivatives of what stands in S.
"""

from __future__ import annotations

from math import cos, sin

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import PIECE, SHIFT, TIME, FloatArray, IntArray
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.series import taylor_shift

LANES = 8
"""Number of directions that are carried at a time."""
# Rows of the carried tangents: of time, of u and w (in contact) or y and v, of the deck, of the table's shift and of
# the time of the next breakpoint; u and w once more, at the end of a contact step.
DT, DA, DB, DY, DZ, DSHIFT, DBREAK, DU, DW = range(9)
CARRIED = 9
# What is found: of events and peaks the derivative of the time, then of the rate or of the force; of the start and of
# the end those of the wheel's displacement and velocity, then of the deck's.
OF_TIME, OF_SIZE = range(2)
OF_HEIGHT, OF_VELOCITY, OF_DECK_HEIGHT, OF_DECK_VELOCITY = range(4)


@uncounted_kernel
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
        D[layout.HERE_AMP_SIN, lane] = row[contract.SINE] * d_lift
        D[layout.HERE_AMP_COS, lane] = row[contract.COSINE] * d_lift
        if bent:
            bend = bends[table[lane], base + piece]
            d_away -= bend[contract.CENTRE]
            d_wavenumber = bend[contract.WAVENUMBER]
            D[layout.HERE_AMP_SIN, lane] += bend[contract.SINE] * lift
            D[layout.HERE_AMP_COS, lane] += bend[contract.COSINE] * lift
        D[layout.HERE_OMEGA, lane] = d_wavenumber * pace + wavenumber * turns[contract.PACE, lane]
        D[layout.HERE_PHASE0, lane] = d_wavenumber * away + wavenumber * d_away
        D[layout.WORK, lane] = d_away / row[contract.SCALE]
    scale = row[contract.SCALE]
    for part in range(2):
        last = degree if part == 0 else fdegree
        if last < 0:
            continue
        source = contract.COEFFICIENT if part == 0 else contract.FACTOR
        target = layout.HERE_POLY if part == 0 else layout.HERE_FACTOR
        gain = lift if part == 0 else 1.0
        taylor_shift(pieces, piece, source, last, away / scale, 1.0, 1.0, layout.WORK, S)
        for lane in range(LANES):
            d_gain = turns[contract.LIFT, lane] if part == 0 else 0.0
            rate = pace / scale
            d_rate = turns[contract.PACE, lane] / scale
            power = 1.0
            d_power = 0.0
            for k in range(last + 1):
                c = S[layout.WORK + k]
                d_c = (k + 1) * S[layout.WORK + k + 1] * D[layout.WORK, lane] if k < last else 0.0
                D[target + k, lane] = d_gain * power * c + gain * (d_power * c + power * d_c)
                d_power = d_power * rate + power * d_rate
                power *= rate
        for lane in range(LANES):
            if table[lane] < 0:
                continue
            taylor_shift(bends[table[lane]], base + piece, source, last, away / scale, 1.0, 1.0, layout.WORK, S)
            power = gain
            for k in range(last + 1):
                D[target + k, lane] += power * S[layout.WORK + k]
                power *= pace / scale


@uncounted_kernel
def path_tangent(after: float, lane: int, S: FloatArray, D: FloatArray) -> tuple[float, float]:
    """Return the derivatives, at fixed time, of the path's height and velocity at a time after the step's start."""
    degree = int(S[layout.HERE_DEGREE])
    y = D[layout.HERE_POLY + degree, lane]
    v = 0.0
    for k in range(degree - 1, -1, -1):
        v = v * after + y
        y = y * after + D[layout.HERE_POLY + k, lane]
    omega = S[layout.HERE_OMEGA]
    if omega != 0.0:
        phase = S[layout.HERE_PHASE0] + omega * after
        d_phase = D[layout.HERE_PHASE0, lane] + D[layout.HERE_OMEGA, lane] * after
        s = sin(phase)
        c = cos(phase)
        across = S[layout.HERE_AMP_SIN] * c - S[layout.HERE_AMP_COS] * s
        y += D[layout.HERE_AMP_SIN, lane] * s + D[layout.HERE_AMP_COS, lane] * c + across * d_phase
        v += D[layout.HERE_OMEGA, lane] * across
        v += omega * (D[layout.HERE_AMP_SIN, lane] * c - D[layout.HERE_AMP_COS, lane] * s)
        v -= omega * (S[layout.HERE_AMP_SIN] * s + S[layout.HERE_AMP_COS] * c) * d_phase
    return y, v


@uncounted_kernel
def factor_tangent(after: float, lane: int, S: FloatArray, D: FloatArray) -> float:
    """Return the derivative, at fixed time, of the factor on the contact force."""
    degree = int(S[layout.HERE_FACTOR_DEGREE])
    value = 0.0
    for k in range(degree, -1, -1):
        value = value * after + D[layout.HERE_FACTOR + k, lane]
    return value


@uncounted_kernel
def sum_at(D: FloatArray, row: int, n: int, x: float, lane: int) -> float:
    """Return Σ D[row + k, lane]·x^k, k = 0 … n."""
    total = D[row + n, lane]
    for k in range(n - 1, -1, -1):
        total = total * x + D[row + k, lane]
    return total


@uncounted_kernel
def sums_at(D: FloatArray, row: int, n: int, x: float, out: FloatArray) -> None:
    """Write Σ D[row + k, lane]·x^k, k = 0 … n, of all lanes."""
    for lane in range(LANES):
        out[lane] = D[row + n, lane]
    for k in range(n - 1, -1, -1):
        for lane in range(LANES):
            out[lane] = out[lane] * x + D[row + k, lane]
