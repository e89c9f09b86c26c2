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
T, U, W, Y, Z, Q, R, F, N, ACC, SINE, COSINE, TREND, CLEAR, COMP, WORK, SCALED, SHIFTED = _positions(
    range(0, 18 * WIDTH, WIDTH)
)
HORNER, HORNER_FACTOR, HERE = _positions((18 + rows) * WIDTH for rows in (0, MAX_DEGREE + 1, 2 * (MAX_DEGREE + 1)))
"""MAX_DEGREE + 1 rows for the path, as many for the factor; then the present piece as functions of time."""
(FLIGHT_ORDER,) = _positions([22])

# Entries of the present piece, from HERE on: polynomial in (t - t0), harmonic, factor.
POLY, AMP_SIN, AMP_COS, PHASE0, OMEGA, DEGREE, FACTOR_DEGREE, FACTOR = 0, 9, 10, 11, 12, 13, 14, 15
STATE = HERE + FACTOR + MAX_DEGREE + 1  # the present state
MARK = STATE + 16  # a corner of the force that waits for the other side of a breakpoint
COUNT = MARK + 8
# Counts: steps (at COUNT itself), events, peaks so far; whether the last step ended in a loss; impacts so far, those at
# and after which the march ends (-1: none), and whether it has to; steps in a row in which no time passed.
EVENTS, PEAKS, OPENED, IMPACTS, UNTIL_IMPACT, UNTIL_LOSS, SEEN, IDLE = range(1, 9)
SCRATCH = int(COUNT + IDLE + 1)
