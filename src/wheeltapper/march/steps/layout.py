"""Where things stand in the flat scratch array `S` of the kernels: series, the present piece, the state, the counts.

Coefficient n of the series in row T is S[T + n]. The positions are NumPy integers: Numba compiles a kernel anew for
every plain integer constant that it is called with.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import accumulate
from typing import cast

import numpy as np

from wheeltapper.march.common.program import NUMBERS, PIECE_COLUMNS, TERMS


def int64_positions(values: Iterable[int]) -> tuple[int, ...]:
    """Return NumPy integers that a type checker takes for plain ones."""
    return cast("tuple[int, ...]", tuple(np.int64(value) for value in values))


WIDTH = 24
# Contact: series in s. Flight: series in t; U and W then hold y and v.
T, U, W, Y, Z, N, TREND, CLEAR, WORK, SCALED, SHIFTED, DEPTH, WHEEL_Y, WHEEL_V, BUSH, PUSH = int64_positions(
    range(0, 16 * WIDTH, WIDTH)
)
"""Beside the motion: the contact force, what a root is sought of, the indentation in flight; the indentation of a
virgin surface; and where a damper has an end of its own, the wheel's displacement and velocity in contact and the
bush's deflection; the force by s. The others are room."""
HERE, FLIGHT_ORDER = int64_positions((16 * WIDTH, 22))

# The present piece: polynomial in (t - t0), harmonic, factor, residual indentation, what the surface bears; then of the
# plastic law that holds: number of terms (0: it is elastic), centre, scale, and the terms. Then of a damper's end its
# coefficients (held_end.py). Between which values u and the wheel's displacement stay while nothing happens, and which
# sign the bush's deflection, or the wheel's velocity, has then (0: either). The deck's motion and the bush's deflection
# at the end of a contact step that nothing cuts. For tangents the piece as its table has it, when and how far shifted
# it is met, and what the path and the factor are at a joint. Where the code of steps and of their tangents is
# (steps/written.py). Then the present state.
(
    HERE_POLY, HERE_AMP_SIN, HERE_AMP_COS, HERE_PHASE0, HERE_OMEGA, HERE_DEGREE, HERE_FACTOR_DEGREE, HERE_FACTOR,
    HERE_RESIDUAL_DEGREE, HERE_RESIDUAL, HERE_BEARS_DEGREE, HERE_BEARS, HERE_LAW_TERMS, HERE_LAW_CENTRE, HERE_LAW_SCALE,
    HERE_LAW, END_G, END_B, END_BETA, U_FLOOR, U_CEILING, PLACE_FLOOR, PLACE_CEILING, HEADING, NEXT_Y,
    NEXT_Z, NEXT_BUSH, PIECE_ROW, PIECE_TIME, PIECE_SHIFT, JOINT_HEIGHT, JOINT_VELOCITY, JOINT_ACCELERATION,
    JOINT_FACTOR, FUNCTIONS, DERIVATIVES, STATE,
) = int64_positions(
    accumulate(
        (HERE, *(TERMS, 1, 1, 1, 1, 1, 1), *(TERMS, 1) * 3, 1, 1, TERMS, *(1,) * 11, PIECE_COLUMNS, *(1,) * 6, 32, 20)
    )
)  # fmt: skip
MARK = STATE + 16  # how the force has gone since its last maximum (events.py)
COUNT = MARK + 8
# Counts: steps, events, peaks so far; whether the last step ended in a loss; impacts so far, those at
# and after which the march ends (-1: none), and whether it has to; steps in a row in which no time passed; events of
# the damper's end so far; pieces in use.
STEPS, EVENTS, PEAKS, OPENED, IMPACTS, UNTIL_IMPACT, UNTIL_LOSS, SEEN, IDLE, STOPS, PIECES = range(11)
SCRATCH = int(COUNT + PIECES + 1)
# Rows of tangents, beside those for all of S: how the numbers of a program change, and what is carried from step to
# step (tangent_path.py). All that eight directions need stands in one array: what reads and writes several is not
# made into vectors.
OF_NUMBERS, CARRIED, TURNED_ROWS = int64_positions(accumulate((SCRATCH, NUMBERS, 9)))
