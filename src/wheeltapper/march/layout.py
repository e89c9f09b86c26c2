"""Where things stand in the flat scratch array `S` of the kernels: series, the present piece, the state, the counts.

Coefficient n of the series in row T is S[T + n]. The positions are NumPy integers: Numba compiles a kernel anew for
every plain integer constant that it is called with.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import cast

import numpy as np

from wheeltapper.march.program import MAX_DEGREE


def _positions(values: Iterable[int]) -> tuple[int, ...]:
    return cast("tuple[int, ...]", tuple(np.int64(value) for value in values))


WIDTH = 24
# Contact: series in s. Flight: series in t; U and W then hold y and v.
T, U, W, Y, Z, Q, R, F, N, ACC, SINE, COSINE, TREND, CLEAR, COMP, WORK, SCALED, SHIFTED, DEPTH = _positions(
    range(0, 19 * WIDTH, WIDTH)
)
# Where the damper has an end of its own: the wheel's displacement, velocity and acceleration in contact, the bush's
# deflection and its rate.
WHEEL_Y, WHEEL_V, WHEEL_A, BUSH, BUSH_RATE = _positions(range(19 * WIDTH, 24 * WIDTH, WIDTH))
HORNER, HORNER_FACTOR, HORNER_RESIDUAL, HORNER_BEARS, HORNER_LAW, HERE = _positions(
    (24 + blocks * (MAX_DEGREE + 1)) * WIDTH for blocks in range(6)
)
"""MAX_DEGREE + 1 rows each for what follows the path; then the present piece as functions of time."""
(FLIGHT_ORDER,) = _positions([22])

# Entries of the present piece, from HERE on: polynomial in (t - t0), harmonic, factor, residual indentation, what the
# surface bears; then of the plastic law that holds: how many terms (0: it is elastic), centre, scale, and the terms.
POLY, AMP_SIN, AMP_COS, PHASE0, OMEGA, DEGREE, FACTOR_DEGREE, FACTOR = 0, 9, 10, 11, 12, 13, 14, 15
RESIDUAL_DEGREE = FACTOR + MAX_DEGREE + 1
RESIDUAL = RESIDUAL_DEGREE + 1
BEARS_DEGREE = RESIDUAL + MAX_DEGREE + 1
BEARS = BEARS_DEGREE + 1
LAW_TERMS = BEARS + MAX_DEGREE + 1
LAW_CENTRE, LAW_SCALE, LAW = LAW_TERMS + 1, LAW_TERMS + 2, LAW_TERMS + 3
STATE = HERE + LAW + MAX_DEGREE + 1  # the present state
MARK = STATE + 16  # how the force has gone since its last maximum (events.py)
COUNT = MARK + 8
# Counts: steps, events, peaks so far; whether the last step ended in a loss; impacts so far, those at
# and after which the march ends (-1: none), and whether it has to; steps in a row in which no time passed; events of
# the damper's end so far; pieces in use.
STEPS, EVENTS, PEAKS, OPENED, IMPACTS, UNTIL_IMPACT, UNTIL_LOSS, SEEN, IDLE, STOPS, PIECES = range(11)
SCRATCH = int(COUNT + PIECES + 1)
