"""Eight wheels on their paths: the motion of their wheelsets, and the paths at a time."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import HALF, LANES, TO_RATE


@kernel
def set_piece(lane: int, data: FloatArray, plan: IntArray, L: FloatArray) -> None:
    """Write the present piece of a lane's path as functions of time."""
    pieces = plan[asm.AT_PIECES]
    width = plan[asm.PIECE_WIDTH]
    own = pieces + int(L[wheel.ROW_PIECE + lane]) * width
    row = data[own : own + width]
    speed = data[asm.SPEED]
    L[wheel.ROW_UNTIL + lane] = np.inf
    L[wheel.CENTRE_TIME + lane] = 0.0
    if speed > 0.0:
        L[wheel.ROW_UNTIL + lane] = (row[contract.STOP] + L[wheel.ROW_SHIFT + lane]) / speed
        L[wheel.CENTRE_TIME + lane] = (row[contract.CENTRE] + L[wheel.ROW_SHIFT + lane]) / speed
    L[wheel.ROW_PACE + lane] = speed / row[contract.SCALE]
    for k in range(contract.MAX_DEGREE + 1):
        L[wheel.ROW_POLY + k * LANES + lane] = row[contract.COEFFICIENT + k] if k <= row[contract.DEGREE] else 0.0
        L[wheel.FACTORS + k * LANES + lane] = row[contract.FACTOR + k] if k <= row[contract.FACTOR_DEGREE] else 0.0
    if row[contract.FACTOR_DEGREE] < 0.0:
        L[wheel.FACTORS + lane] = 1.0
    L[wheel.WAVE_SINE + lane] = row[contract.SINE]
    L[wheel.WAVE_COSINE + lane] = row[contract.COSINE]
    L[wheel.ROW_OMEGA + lane] = row[contract.WAVENUMBER] * speed
    L[wheel.DEGREE_FLAG] = 0.0
    L[wheel.WAVE_FLAG] = 0.0
    L[wheel.FACTOR_FLAG] = 0.0
    if data[asm.CONTACT_LAW] == asm.PLASTIC_TREADS:
        _set_marks(lane, row, L)
    for i in range(LANES):
        if L[wheel.SIDES + i] != 0.0:
            at = pieces + int(L[wheel.ROW_PIECE + i]) * width
            L[wheel.DEGREE_FLAG] = max(L[wheel.DEGREE_FLAG], data[at + contract.DEGREE])
            if data[at + contract.SINE] != 0.0 or data[at + contract.COSINE] != 0.0:
                L[wheel.WAVE_FLAG] = 1.0
            if data[at + contract.FACTOR_DEGREE] >= 0.0:
                L[wheel.FACTOR_FLAG] = 1.0


@kernel
def _set_marks(lane: int, row: FloatArray, L: FloatArray) -> None:
    """Write what earlier wheels have left in the present piece of a lane's path as functions of time."""
    for k in range(contract.MAX_DEGREE + 1):
        L[wheel.LEFT_POLY + k * LANES + lane] = row[contract.RESIDUAL + k]
        L[wheel.BEARS_POLY + k * LANES + lane] = row[contract.BEARS + k]
    L[wheel.MARK_FLAG] = 0.0
    for k in range(1, contract.MAX_DEGREE + 1):
        for i in range(LANES):
            if L[wheel.LEFT_POLY + k * LANES + i] != 0.0 or L[wheel.BEARS_POLY + k * LANES + i] != 0.0:
                L[wheel.MARK_FLAG] = 1.0


@kernel
def evaluate_marks(t: float, L: FloatArray) -> None:
    """Evaluate what earlier wheels have left at a time, and how fast it changes under the wheels."""
    if L[wheel.MARK_FLAG] != 0.0:
        _evaluate_polynomials(t, wheel.LEFT_POLY, wheel.ROW_LEFT, wheel.LEFT_RATE, L)
        _evaluate_polynomials(t, wheel.BEARS_POLY, wheel.ROW_BEARS, wheel.BEARS_RATE, L)
        return
    for i in range(LANES):
        L[wheel.ROW_LEFT + i] = L[wheel.LEFT_POLY + i]
        L[wheel.LEFT_RATE + i] = 0.0
        L[wheel.ROW_BEARS + i] = L[wheel.BEARS_POLY + i]
        L[wheel.BEARS_RATE + i] = 0.0


@kernel
def gather_motions(w: FloatArray, L: FloatArray) -> None:
    """Copy the motion of the wheelsets into the lanes."""
    for i in range(HALF):
        at = int(L[asm.BODY * LANES + i]) * asm.PLACES
        for row, place in wheel.GATHERED:
            L[row + i] = w[at + place]
            L[row + HALF + i] = w[at + place]


@kernel
def evaluate_paths(t: float, deck: int, w: FloatArray, L: FloatArray) -> None:
    """Evaluate the paths at a time: height, velocity, and the factor on C^(1/3)."""
    for i in range(LANES):
        L[wheel.ROW_PATH + i] = L[wheel.ROW_POLY + i]
        L[wheel.PATH_RATE + i] = 0.0
        L[wheel.BULGE + i] = 1.0
        L[wheel.BULGE_RATE + i] = 0.0
    if L[wheel.DEGREE_FLAG] > 0.0:
        _evaluate_polynomials(t, wheel.ROW_POLY, wheel.ROW_PATH, wheel.PATH_RATE, L)
    if L[wheel.FACTOR_FLAG] > 0.0:
        _evaluate_polynomials(t, wheel.FACTORS, wheel.BULGE, wheel.BULGE_RATE, L)
    if L[wheel.WAVE_FLAG] > 0.0:
        for i in range(LANES):
            if L[wheel.WAVE_SINE + i] != 0.0 or L[wheel.WAVE_COSINE + i] != 0.0:
                phase = L[wheel.ROW_OMEGA + i] * (t - L[wheel.CENTRE_TIME + i])
                sine = np.sin(phase)
                cosine = np.cos(phase)
                L[wheel.ROW_PATH + i] += L[wheel.WAVE_SINE + i] * sine + L[wheel.WAVE_COSINE + i] * cosine
                turned = L[wheel.WAVE_SINE + i] * cosine - L[wheel.WAVE_COSINE + i] * sine
                L[wheel.PATH_RATE + i] += L[wheel.ROW_OMEGA + i] * turned
    if deck >= 0:
        at = deck * asm.PLACES + asm.MOTION_Z
        for i in range(LANES):
            L[wheel.ROW_PATH + i] += L[wheel.ROW_ON_DECK + i] * w[at]
            L[wheel.PATH_RATE + i] += L[wheel.ROW_ON_DECK + i] * w[at + TO_RATE]


@kernel
def _evaluate_polynomials(t: float, source: int, value: int, rate: int, L: FloatArray) -> None:
    """Evaluate the lanes' polynomials over time, and their rates."""
    for i in range(LANES):
        place = (t - L[wheel.CENTRE_TIME + i]) * L[wheel.ROW_PACE + i]
        total = 0.0
        slope = 0.0
        for k in range(contract.MAX_DEGREE, -1, -1):
            slope = slope * place + total
            total = total * place + L[source + k * LANES + i]
        L[value + i] = total
        L[rate + i] = slope * L[wheel.ROW_PACE + i]
