"""Layout of the scratch memory of an octet of contacts: entry i of the row at T is L[T + i], one per lane."""

from __future__ import annotations

from wheeltapper.march import assembly as contract
from wheeltapper.march.assembly import LANE_COLUMNS, LANES, RATE, TABLES, TERMS
from wheeltapper.march.program import MAX_DEGREE

# First the columns of `assembly`, then the values that are set between steps.
_ROWS = iter(range(LANE_COLUMNS * LANES, 400 * LANES, LANES))


def _rows(count: int) -> tuple[int, ...]:
    return tuple(next(_ROWS) for _ in range(count))


SIDES, RADII = contract.SIDE * LANES, contract.NOMINAL * LANES
(ON, PIECE, SHIFT, UNTIL, ON_DECK, CELL, NEW_CELL, CURVE_CELL) = _rows(8)
"""Whether the contact may carry force; piece and shift of the path, and the end of the piece; whether the wheel is on
the deck; the cells of the geometry's tables and of the creep law's curve."""
(CENTRE_TIME, PACE, WAVE_SINE, WAVE_COSINE, OMEGA) = _rows(5)
(POLY, *_) = _rows(MAX_DEGREE + 1)
(FACTORS, *_) = _rows(MAX_DEGREE + 1)
"""The present piece over time: polynomials of (t - CENTRE_TIME)·PACE, and a wave."""
(CELLS, *_) = _rows(TABLES * TERMS)
(CURVES, *_) = _rows(TERMS)
"""The present cells of both."""
(QY, QZ, QROLL, QYAW, VX, VY, VZ, VROLL, VPITCH, VYAW) = _rows(10)
(PATH, PATH_RATE, BULGE, BULGE_RATE) = _rows(4)
"""Height and velocity of the path, and the factor on C^(1/3)."""
(U, U_RATE, G, SLOPE, ARM, ROLLING, DELTA, DELTA_RATE, ROOT_C, ROOT_C_RATE) = _rows(10)
(NORMAL, NORMAL_RATE, CUBE_ROOT) = _rows(3)
"""Normal force N (its component along z), its rate, and N^(1/3)."""
(STIFF_X, STIFF_Y, STIFF_SPIN, STIFF_TURN, FLAT) = _rows(5)
"""Kalker's coefficients at this force, and b/a."""
(SLIP_X, SLIP_Y, SLIP_TURN, FX, FY, MZ, SHARE) = _rows(7)
"""Slip velocities, creep forces and moment, and the share of the linear resultant that remains."""
(UX, UY, TURN_X, TURN_Y, PX, PY, SUM_X, SUM_Y) = _rows(8)
"""FASTSIM: scaled slips and spins, the traction where it has come to, and its sum."""
FLAGS = next(_ROWS)
DEGREE_FLAG, WAVE_FLAG, FACTOR_FLAG, AWAKE = range(FLAGS, FLAGS + 4)
"""Degree of the octet's polynomials, whether any lane has a wave or a factor, and whether it has to be computed."""
ROWS = int(next(_ROWS))
GATHERED = (
    (QY, contract.Y), (QZ, contract.Z), (QROLL, contract.ROLL), (QYAW, contract.YAW), (VX, RATE + contract.X),
    (VY, RATE + contract.Y), (VZ, RATE + contract.Z), (VROLL, RATE + contract.ROLL), (VPITCH, RATE + contract.PITCH),
    (VYAW, RATE + contract.YAW),
)  # fmt: skip
