"""Layout of the scratch memory of an octet of contacts: entry i of the row at T is L[T + i], one per lane."""

from __future__ import annotations

from wheeltapper.march.common.program import MAX_DEGREE
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import LANE_COLUMNS, LANES, TABLE_TERMS, TABLES, TO_RATE

# First the columns of `assembly`, then the values that are set between steps.
_ROWS = iter(range(LANE_COLUMNS * LANES, 400 * LANES, LANES))


def _next_rows(count: int) -> tuple[int, ...]:
    return tuple(next(_ROWS) for _ in range(count))


SIDES, RADII = asm.SIDE * LANES, asm.NOMINAL * LANES
(ON, ROW_PIECE, ROW_SHIFT, ROW_UNTIL, ROW_ON_DECK, CELL, NEW_CELL, CURVE_CELL) = _next_rows(8)
"""Whether the contact may carry force; piece and shift of the path, and the end of the piece; whether the wheel is on
the deck; the cells of the geometry's tables and of the creep law's curve."""
(CENTRE_TIME, ROW_PACE, WAVE_SINE, WAVE_COSINE, ROW_OMEGA) = _next_rows(5)
(ROW_POLY, *_) = _next_rows(MAX_DEGREE + 1)
(FACTORS, *_) = _next_rows(MAX_DEGREE + 1)
"""The present piece over time: polynomials of (t - CENTRE_TIME)·PACE, and a wave."""
(CELLS, *_) = _next_rows(TABLES * TABLE_TERMS)
(CURVES, *_) = _next_rows(TABLE_TERMS)
"""The present cells of both."""
(QY, QZ, QROLL, QYAW, VX, VY, VZ, VROLL, VPITCH, VYAW) = _next_rows(10)
(ROW_PATH, PATH_RATE, BULGE, BULGE_RATE) = _next_rows(4)
"""Height and velocity of the path, and the factor on C^(1/3)."""
(ROW_RAIL, RAIL_RATE) = _next_rows(2)
"""Deflection and velocity of the rail, positive downwards; zero where it does not give way."""
(SOFTNESS, ROW_FORCE, ROW_EXCESS, STEEPNESS, ROW_SINKS) = _next_rows(5)
"""Of a wheel on such a rail: its local compliance, the force on it, what its solution needs, and what the present
force adds to its velocity."""
(ROW_U, U_RATE, ROW_G, SLOPE, ARM, ROLLING, ROW_DELTA, DELTA_RATE, ROOT_C, ROOT_C_RATE) = _next_rows(10)
(NORMAL, NORMAL_RATE, CUBE_ROOT) = _next_rows(3)
"""Normal force N (its component along z), its rate, and the cube root of its elastic part."""
(GRIP, ROW_HOLD, GRIP_RATE, FORCE_GROWTH, TRUE_RATE, TRUE_SINKING) = _next_rows(6)
"""Of a contact whose force depends on the indentation's rate: the ratio of the force to its elastic part, negative
where it would pull; what is positive just where there is a force, m; and what `growths.py` found last: the rates of
that ratio, of the force, of the indentation, and of the rail's deflection."""
(FREE_DELTA, FREE_RATE, FREE_RAIL, FREE_RAIL_RATE, LATE_RATE, LAG_TIME, HELD_RATE) = _next_rows(7)
"""Of such a contact on a rail that gives way: indentation, deflection and rates without what the force does to it; the
rate that is a state, which follows late, and the time by which it does; and that at which its force is taken, zero
where it depends on none."""
(SLEEPER_DEPTH, DEPTH_RATE, DEPTH_BEND, FREE_DEPTH_RATE, FREE_DEPTH_BEND) = _next_rows(5)
"""Of a sleeper in the ballast below a void, negative above it: its depth and two derivatives, and these but for what
the present forces add."""
(STIFF_X, STIFF_Y, STIFF_SPIN, STIFF_TURN, ROW_FLATNESS) = _next_rows(5)
"""Kalker's coefficients at this force, and b/a."""
(SLIP_X, SLIP_Y, SLIP_TURN, FX, FY, MZ, SHARE) = _next_rows(7)
"""Slip velocities, creep forces and moment, and the share of the linear resultant that remains."""
(UX, UY, TURN_X, TURN_Y, PX, PY, SUM_X, SUM_Y) = _next_rows(8)
"""FASTSIM: scaled slips and spins, the traction where it has come to, and its sum."""
(STRETCH, ROW_LEFT, LEFT_RATE, ROW_BEARS, BEARS_RATE) = _next_rows(5)
"""Of a contact that may yield: the stretch of its law (0 where it is elastic), the residual indentation of the surface,
and the indentation from there at which it yields, with their rates."""
(TO_UPPER, TO_UPPER_RATE, TO_LOWER, TO_LOWER_RATE) = _next_rows(4)
"""How far it is within that stretch, m, from its upper and from its lower border; infinite where there is none."""
(LEFT_POLY, *_) = _next_rows(MAX_DEGREE + 1)
(BEARS_POLY, *_) = _next_rows(MAX_DEGREE + 1)
"""The present piece of both over time, as that of the path."""
FLAGS = next(_ROWS)
DEGREE_FLAG, WAVE_FLAG, FACTOR_FLAG, AWAKE, MARK_FLAG, INCLINED_FLAG, VOID_FLAG = range(FLAGS, FLAGS + 7)
"""Degree of the octet's polynomials, whether any lane has a wave or a factor, whether it has to be computed, whether
any lane has marks, 1 of flanges, else 0, and 1 of voids, else 0. Voids are never awake: that is for wheels."""
OCTET_ROWS = int(next(_ROWS))
GATHERED = (
    (QY, asm.MOTION_Y), (QZ, asm.MOTION_Z), (QROLL, asm.ROLL), (QYAW, asm.YAW), (VX, TO_RATE + asm.MOTION_X),
    (VY, TO_RATE + asm.MOTION_Y), (VZ, TO_RATE + asm.MOTION_Z), (VROLL, TO_RATE + asm.ROLL),
    (VPITCH, TO_RATE + asm.PITCH), (VYAW, TO_RATE + asm.YAW),
)  # fmt: skip
FREED = ((ROW_DELTA, FREE_DELTA), (DELTA_RATE, FREE_RATE), (ROW_RAIL, FREE_RAIL), (RAIL_RATE, FREE_RAIL_RATE))
"""What the forces on a rail that gives way change, and where it is held without that."""
