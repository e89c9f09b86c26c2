"""Layout of the flat array `L` of the lane kernels: entry i of the row at T is L[T + i], one per lane."""

from __future__ import annotations

LANES = 8
CONTACT_ORDER, FLIGHT_ORDER = 12, 22


def _row_starts(first: int, *lengths: int) -> list[int]:
    """Return the starts of series with the given numbers of rows, and the end of the last one."""
    starts = [first]
    for length in lengths:
        starts.append(starts[-1] + LANES * length)
    return starts


# A step's start: contact has (u, w), flight (y, v). Then the cell's suspension and path: load 1 + K·level and level,
# the factors of sine and cosine in the forcing and in the height, the path's phase in turns RATE·time - OFFSET.
(
    LANE_TIME, LANE_U0, LANE_W0, LANE_K, LANE_G, LANE_LOAD, LANE_LEVEL, LANE_GAIN_SIN, LANE_GAIN_COS, LANE_AMP_SIN,
    LANE_AMP_COS, LANE_OMEGA, LANE_RATE, LANE_OFFSET, LANE_UNTIL, LANE_GOAL,
) = range(0, 16 * LANES, LANES)  # fmt: skip
# The same of one cell, one after the other from K on, as its row holds them.
(
    CELL_K, CELL_G, CELL_LOAD, CELL_LEVEL, CELL_GAIN_SIN, CELL_GAIN_COS, CELL_AMP_SIN, CELL_AMP_COS, CELL_OMEGA,
    CELL_RATE, CELL_OFFSET, CELL_UNTIL, CELL_GOAL,
) = range((LANE_GOAL - LANE_K) // LANES + 1)  # fmt: skip
# A step's end: length, time, (u, w), whether w keeps its sign for certain, whether the step holds no event for certain.
LANE_LENGTH, LANE_T_END, LANE_U_END, LANE_W_END, LANE_CALM, LANE_GO = range(16 * LANES, 22 * LANES, LANES)
# A root search in (0, 1): the place, its bracket, the sign at 0, number of sign changes, whether it is found (only one
# that is alone is sought); then the motion there. FRESH: a flight that begins at δ = 0.
LANE_X, LANE_LOW, LANE_HIGH, LANE_SIGN, LANE_CHANGES, LANE_DONE, LANE_T_ROOT, LANE_U_ROOT, LANE_W_ROOT, LANE_FRESH = (
    range(22 * LANES, 32 * LANES, LANES)
)
# Series: u and w of a contact step, y and v of a flight, and the polynomial whose root is sought.
LANE_U, LANE_W, LANE_Y, LANE_V, LANE_POLYNOMIAL, LANE_ENTRIES = _row_starts(
    32 * LANES, CONTACT_ORDER + 1, CONTACT_ORDER + 1, FLIGHT_ORDER + 1, FLIGHT_ORDER + 1, FLIGHT_ORDER + 1
)
