"""Tangents of the path and of the contact's factor: what they are derived from, and their values after a step's start.

D has the rows of the scratch array S, each with LANES entries: the derivatives of what stands in S. Below them it has
those of the program's numbers and the carried tangents (layout.py).
"""

from __future__ import annotations

from math import cos, sin

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import PIECE, SHIFT, FloatArray, IntArray
from wheeltapper.march.steps import layout

LANES = 8
"""Number of directions that are carried at a time."""
# Rows of the carried tangents: of time, of u and w (in contact) or y and v, of the deck, of the table's shift and of
# the time of the next breakpoint; u and w once more, at the end of a contact step.
DT, DA, DB, DY, DZ, DSHIFT, DBREAK, DU, DW = range(9)
# What is found: of events and peaks the derivative of the time, then of the rate or of the force; of the start and of
# the end those of the wheel's displacement and velocity, then of the deck's.
OF_TIME, OF_SIZE = range(2)
OF_HEIGHT, OF_VELOCITY, OF_DECK_HEIGHT, OF_DECK_VELOCITY = range(4)


@uncounted_kernel
def show_piece(
    pieces: FloatArray, bends: FloatArray, base: int, table: IntArray, state: FloatArray, time: float, S: FloatArray,
    D: FloatArray,
) -> None:  # fmt: skip
    """Put the piece of the path of a state, and how it changes, where the functions that differentiate it look.

    `bends` holds derivatives of the pieces, bends[table[lane], base + piece] those of a lane (-1: none; D has zeros for
    it from the start).
    """
    piece = int(state[PIECE])
    row = pieces[piece]
    S[layout.PIECE_TIME], S[layout.PIECE_SHIFT] = time, state[SHIFT]
    for column in range(contract.CENTRE, contract.PIECE_COLUMNS):
        S[layout.PIECE_ROW + column] = row[column]
    if row[contract.FACTOR_DEGREE] < 0.0:
        S[layout.PIECE_ROW + contract.FACTOR] = 1.0
    for lane in range(LANES):
        if table[lane] >= 0:
            bend = bends[table[lane], base + piece]
            for column in range(contract.CENTRE, contract.PIECE_COLUMNS):
                D[layout.PIECE_ROW + column, lane] = bend[column]


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
