"""Eight wheels on their paths: the motion of their wheelsets, and the paths at a time."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import assembly as asm
from wheeltapper.march.assembly import (
    HALF,
    LANES,
    TO_RATE,
)
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import (
    CENTRE,
    COEFFICIENT,
    COSINE,
    DEGREE,
    FACTOR,
    FACTOR_DEGREE,
    MAX_DEGREE,
    PIECE_COLUMNS,
    SCALE,
    SINE,
    STOP,
    WAVENUMBER,
    FloatArray,
    IntArray,
)
from wheeltapper.march.wheel_rows import (
    BULGE,
    BULGE_RATE,
    CENTRE_TIME,
    DEGREE_FLAG,
    FACTOR_FLAG,
    FACTORS,
    GATHERED,
    PATH_RATE,
    ROW_OMEGA,
    ROW_ON_DECK,
    ROW_PACE,
    ROW_PATH,
    ROW_PIECE,
    ROW_POLY,
    ROW_SHIFT,
    ROW_UNTIL,
    SIDES,
    WAVE_COSINE,
    WAVE_FLAG,
    WAVE_SINE,
)


@kernel
def set_piece(lane: int, data: FloatArray, plan: IntArray, L: FloatArray) -> None:
    """Write the present piece of a lane's path as functions of time."""
    pieces = plan[asm.AT_PIECES]
    row = data[
        pieces + int(L[ROW_PIECE + lane]) * PIECE_COLUMNS : pieces + (int(L[ROW_PIECE + lane]) + 1) * PIECE_COLUMNS
    ]
    speed = data[asm.SPEED]
    L[ROW_UNTIL + lane] = np.inf
    L[CENTRE_TIME + lane] = 0.0
    if speed > 0.0:
        L[ROW_UNTIL + lane] = (row[STOP] + L[ROW_SHIFT + lane]) / speed
        L[CENTRE_TIME + lane] = (row[CENTRE] + L[ROW_SHIFT + lane]) / speed
    L[ROW_PACE + lane] = speed / row[SCALE]
    for k in range(MAX_DEGREE + 1):
        L[ROW_POLY + k * LANES + lane] = row[COEFFICIENT + k] if k <= row[DEGREE] else 0.0
        L[FACTORS + k * LANES + lane] = row[FACTOR + k] if k <= row[FACTOR_DEGREE] else 0.0
    if row[FACTOR_DEGREE] < 0.0:
        L[FACTORS + lane] = 1.0
    L[WAVE_SINE + lane] = row[SINE]
    L[WAVE_COSINE + lane] = row[COSINE]
    L[ROW_OMEGA + lane] = row[WAVENUMBER] * speed
    L[DEGREE_FLAG] = 0.0
    L[WAVE_FLAG] = 0.0
    L[FACTOR_FLAG] = 0.0
    for i in range(LANES):
        if L[SIDES + i] != 0.0:
            at = pieces + int(L[ROW_PIECE + i]) * PIECE_COLUMNS
            L[DEGREE_FLAG] = max(L[DEGREE_FLAG], data[at + DEGREE])
            if data[at + SINE] != 0.0 or data[at + COSINE] != 0.0:
                L[WAVE_FLAG] = 1.0
            if data[at + FACTOR_DEGREE] >= 0.0:
                L[FACTOR_FLAG] = 1.0


@kernel
def gather(w: FloatArray, L: FloatArray) -> None:
    """Copy the motion of the wheelsets into the lanes."""
    for i in range(HALF):
        at = int(L[asm.BODY * LANES + i]) * asm.PLACES
        for row, place in GATHERED:
            L[row + i] = w[at + place]
            L[row + HALF + i] = w[at + place]


@kernel
def follow(t: float, deck: int, w: FloatArray, L: FloatArray) -> None:
    """Evaluate the paths at a time: height, velocity, and the factor on C^(1/3)."""
    for i in range(LANES):
        L[ROW_PATH + i] = L[ROW_POLY + i]
        L[PATH_RATE + i] = 0.0
        L[BULGE + i] = 1.0
        L[BULGE_RATE + i] = 0.0
    if L[DEGREE_FLAG] > 0.0:
        _powers(t, ROW_POLY, ROW_PATH, PATH_RATE, L)
    if L[FACTOR_FLAG] > 0.0:
        _powers(t, FACTORS, BULGE, BULGE_RATE, L)
    if L[WAVE_FLAG] > 0.0:
        for i in range(LANES):
            if L[WAVE_SINE + i] != 0.0 or L[WAVE_COSINE + i] != 0.0:
                phase = L[ROW_OMEGA + i] * (t - L[CENTRE_TIME + i])
                sine = np.sin(phase)
                cosine = np.cos(phase)
                L[ROW_PATH + i] += L[WAVE_SINE + i] * sine + L[WAVE_COSINE + i] * cosine
                L[PATH_RATE + i] += L[ROW_OMEGA + i] * (L[WAVE_SINE + i] * cosine - L[WAVE_COSINE + i] * sine)
    if deck >= 0:
        at = deck * asm.PLACES + asm.MOTION_Z
        for i in range(LANES):
            L[ROW_PATH + i] += L[ROW_ON_DECK + i] * w[at]
            L[PATH_RATE + i] += L[ROW_ON_DECK + i] * w[at + TO_RATE]


@kernel
def _powers(t: float, source: int, value: int, rate: int, L: FloatArray) -> None:
    """Evaluate the lanes' polynomials over time, and their rates."""
    for i in range(LANES):
        place = (t - L[CENTRE_TIME + i]) * L[ROW_PACE + i]
        total = 0.0
        slope = 0.0
        for k in range(MAX_DEGREE, -1, -1):
            slope = slope * place + total
            total = total * place + L[source + k * LANES + i]
        L[value + i] = total
        L[rate + i] = slope * L[ROW_PACE + i]
