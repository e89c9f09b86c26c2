"""Tangents of the plainest contact steps, by the straight-line code of unrolled_tangent.py."""

from __future__ import annotations

from math import cos, sin

from wheeltapper.march import layout
from wheeltapper.march import program as contract
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import W
from wheeltapper.march.program import LENGTH, TIME, A, B, FloatArray
from wheeltapper.march.roots import evaluate_derivative
from wheeltapper.march.step import repeat_step, time_to
from wheeltapper.march.tangent_events import AFTER, FIRST, FOURTH, SECOND, THIRD
from wheeltapper.march.tangent_path import DA, DB, DT, LANES, OF_SIZE, OF_TIME
from wheeltapper.march.unrolled_tangent import tangent_flat_12, tangent_wave_12


@kernel
def is_plain(S: FloatArray) -> bool:
    """Return True where the present path is level or one wave of some amplitude, and the contact's factor one."""
    if S[layout.HERE_DEGREE] != 0.0 or S[layout.HERE_FACTOR_DEGREE] >= 0.0:
        return False
    return S[layout.HERE_OMEGA] == 0.0 or S[layout.HERE_AMP_SIN] != 0.0 or S[layout.HERE_AMP_COS] != 0.0


@kernel
def plain_tangents(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, x: float, carried: FloatArray, end: FloatArray,
    S: FloatArray, D: FloatArray, L: FloatArray,
) -> None:  # fmt: skip
    """Carry the tangents over a contact step up to x, where the contact is plain and the path level or one wave."""
    K = numbers[contract.STIFFNESS]
    G = numbers[contract.DAMPING]
    level = S[layout.HERE_POLY]
    omega = S[layout.HERE_OMEGA]
    for lane in range(LANES):
        L[lane] = carried[DT, lane]
        L[LANES + lane] = carried[DA, lane]
        L[2 * LANES + lane] = carried[DB, lane]
        L[3 * LANES + lane] = turns[contract.STIFFNESS, lane]
        L[4 * LANES + lane] = turns[contract.DAMPING, lane]
        L[5 * LANES + lane] = turns[contract.STIFFNESS, lane] * level + K * D[layout.HERE_POLY, lane]
    if omega == 0.0:
        t, u, w = tangent_flat_12(K, G, 1.0 + K * level, step[A], step[B], x, L)
    else:
        a = S[layout.HERE_AMP_SIN]
        b = S[layout.HERE_AMP_COS]
        stiff = K - omega * omega
        gain_sin = stiff * a - G * omega * b
        gain_cos = stiff * b + G * omega * a
        s = sin(S[layout.HERE_PHASE0])
        c = cos(S[layout.HERE_PHASE0])
        along = gain_sin * s + gain_cos * c
        across = gain_sin * c - gain_cos * s
        size = gain_sin * gain_sin + gain_cos * gain_cos
        for lane in range(LANES):
            d_omega = D[layout.HERE_OMEGA, lane]
            d_a = D[layout.HERE_AMP_SIN, lane]
            d_b = D[layout.HERE_AMP_COS, lane]
            d_stiff = turns[contract.STIFFNESS, lane] - 2.0 * omega * d_omega
            d_drag = turns[contract.DAMPING, lane] * omega + G * d_omega
            d_sin = d_stiff * a + stiff * d_a - d_drag * b - G * omega * d_b
            d_cos = d_stiff * b + stiff * d_b + d_drag * a + G * omega * d_a
            L[6 * LANES + lane] = (d_sin * gain_sin + d_cos * gain_cos) / size
            turn = (d_cos * gain_sin - d_sin * gain_cos) / size
            L[7 * LANES + lane] = (D[layout.HERE_PHASE0, lane] + turn) / omega
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
def plain_peak(
    pieces: FloatArray, numbers: FloatArray, turns: FloatArray, step: FloatArray, peak: int, peaks: FloatArray,
    of_peaks: FloatArray, carried: FloatArray, end: FloatArray, S: FloatArray, D: FloatArray, L: FloatArray,
) -> None:  # fmt: skip
    """Write the derivatives of a force maximum inside a plain contact step; the carried tangents stay at its start."""
    order = int(numbers[contract.ORDER])
    repeat_step(pieces, numbers, None, step, S)
    x = time_to(S, order, step[LENGTH], peaks[peak, contract.PEAK_TIME] - step[TIME])
    slope = evaluate_derivative(S, W, order, x)
    for lane in range(LANES):
        L[9 * LANES + lane] = carried[DT, lane]
        L[10 * LANES + lane] = carried[DA, lane]
        L[11 * LANES + lane] = carried[DB, lane]
    plain_tangents(numbers, turns, step, x, carried, end, S, D, L)
    u = end[FIRST]
    for lane in range(LANES):
        of_peaks[peak, OF_SIZE, lane] = 3.0 * u * u * carried[DA, lane]
        of_peaks[peak, OF_TIME, lane] = carried[DT, lane] - u * carried[DB, lane] / slope
        carried[DT, lane] = L[9 * LANES + lane]
        carried[DA, lane] = L[10 * LANES + lane]
        carried[DB, lane] = L[11 * LANES + lane]
