"""Layout of the flat array `L` of the lane kernels: entry i of the row at T is L[T + i], one per lane."""

from __future__ import annotations

from wheeltapper.march.common.program import NUMBERS, PIECE_COLUMNS, TERMS

LANES = 8


def _row_starts(first: int, *lengths: int) -> list[int]:
    """Return the starts of blocks with the given numbers of rows, and the end of the last one."""
    starts = [first]
    for length in lengths:
        starts.append(starts[-1] + LANES * length)
    return starts


# A step's start: contact has (u, w), flight (y, v). Then the cell's suspension and path: load 1 + K·level and level,
# the factors of sine and cosine in the height, the path's phase in turns RATE·time - OFFSET, and the contact's force
# QUADRATIC·u² + CUBIC·u³.
(
    LANE_TIME, LANE_U0, LANE_W0, LANE_K, LANE_G, LANE_LOAD, LANE_LEVEL, LANE_AMP_SIN, LANE_AMP_COS, LANE_OMEGA,
    LANE_RATE, LANE_OFFSET, LANE_UNTIL, LANE_GOAL, LANE_CUBIC, LANE_QUADRATIC,
) = range(0, 16 * LANES, LANES)  # fmt: skip
# What only some kinds of steps have: the force's factor (1 + ETA·w); the place ξ on a polynomial piece, PACE·time -
# ORIGIN; the deck, divided by its mass: whether the wheel is ON it, its prestress there, its spring and damper, and
# 1/mass there; its motion at the step's start; and whether the force rises and falls with u.
(
    LANE_ETA, LANE_PACE, LANE_ORIGIN, LANE_ON, LANE_PRESTRESS, LANE_DECK_STIFF, LANE_DECK_DRAG, LANE_SHARE, LANE_DECK_Y,
    LANE_DECK_V, LANE_STEADY,
) = range(16 * LANES, 27 * LANES, LANES)  # fmt: skip
# The same numbers of one cell, one after the other from K on, as its row holds them.
(
    CELL_K, CELL_G, CELL_LOAD, CELL_LEVEL, CELL_AMP_SIN, CELL_AMP_COS, CELL_OMEGA, CELL_RATE, CELL_OFFSET, CELL_UNTIL,
    CELL_GOAL, CELL_CUBIC, CELL_QUADRATIC,
    CELL_ETA, CELL_PACE, CELL_ORIGIN, CELL_ON, CELL_PRESTRESS, CELL_DECK_STIFF, CELL_DECK_DRAG, CELL_SHARE,
    CELL_BUSH, CELL_BUSH_RATE, CELL_GIVES,
) = range(24)  # fmt: skip
PLAIN_NUMBERS, FIXED_NUMBERS, CELL_NUMBERS = CELL_QUADRATIC + 1, CELL_SHARE + 1, CELL_GIVES + 1
"""How many of them a plain contact has, one without a damper's end, and how many there are."""
# A step's end: length, time, (u, w), the deck's motion, whether the force is monotone for certain, whether hysteresis
# never takes the force away, whether the step holds no event for certain.
(
    LANE_LENGTH, LANE_T_END, LANE_U_END, LANE_W_END, LANE_DECK_Y_END, LANE_DECK_V_END, LANE_CALM, LANE_HOLDS, LANE_GO,
) = range(27 * LANES, 36 * LANES, LANES)  # fmt: skip
# A root search in (0, 1): the place, its bracket, the sign at 0, number of sign changes, whether it is found (only one
# that is alone is sought); then the motion there. FRESH: a flight that begins at δ = 0. ENDS: how a step ends.
(
    LANE_X, LANE_LOW, LANE_HIGH, LANE_SIGN, LANE_CHANGES, LANE_DONE, LANE_T_ROOT, LANE_U_ROOT, LANE_W_ROOT, LANE_FRESH,
    LANE_ENDS,
) = range(36 * LANES, 47 * LANES, LANES)  # fmt: skip
# Series: u and w of a contact step (of a flight those of the deck), the contact force; a piece of the path, times the
# lift, and of the factor, in powers of ξ; y and v of a flight (of a contact step those of the deck), the rail's height
# in a flight, and the polynomial whose root is sought. The room after u keeps what a step writes away from places that
# are a multiple of 4096 bytes (64 rows) behind what the next step reads: a processor takes them for the same.
# At the end time and motion at the start of the step before: a step that is no event moves a lane's start, and the
# march with tangents keeps it. Then of a damper's end the bush, its rate, whether it gives, its deflection at a step's
# start and end, and that as a series.
(
    LANE_U, LANE_W, LANE_N, LANE_PATH, LANE_FACTOR, LANE_Y, LANE_V, LANE_RAIL, LANE_POLYNOMIAL, LANE_WAS,
    LANE_DECK_WAS, LANE_BUSH, LANE_BUSH_RATE, LANE_GIVES, LANE_BUSH_Y, LANE_BUSH_Y_END, LANE_E, LANE_ENTRIES,
) = _row_starts(47 * LANES, 33, 23, 23, TERMS, TERMS, *[23] * 4, 3, 2, *[1] * 5, 23)  # fmt: skip
# Energies at eight ends of steps: the deck's mass, lengths of the steps before and after each (0: none); of a plastic
# law centre, 1/scale and coefficients, and the residual indentation, in powers of ξ. Found are the energy; what each
# end adds to the integrals of the power, and of what is lost, over the steps before and after it; the powers of the
# path and of the contact, times u; and the wheel's kinetic energy.
(
    LANE_MASS, LANE_BEFORE, LANE_AFTER, LANE_LAW_CENTRE, LANE_LAW_RATE, LANE_ENERGY, LANE_GAIN_BEFORE, LANE_GAIN_AFTER,
    LANE_LOST_BEFORE, LANE_LOST_AFTER, LANE_WORKED, LANE_GAINED, LANE_KINETIC,
) = range(LANE_ENTRIES, LANE_ENTRIES + 13 * LANES, LANES)  # fmt: skip
LANE_LAW, LANE_RESIDUAL, ENERGY_ENTRIES = _row_starts(LANE_ENTRIES + 13 * LANES, TERMS, TERMS)
# Tangents of eight steps of known length, one direction at a time: changes of the start; of what a kind of steps has;
# of the harmonic's phase; of t, u, w and the deck's motion at the end.
(
    LANE_OF_TIME, LANE_OF_U, LANE_OF_W, LANE_OF_DECK_Y, LANE_OF_DECK_V, LANE_OF_K, LANE_OF_G, LANE_OF_LOAD,
    LANE_OF_AMP_SIN, LANE_OF_AMP_COS, LANE_OF_OMEGA, LANE_OF_PHASE, LANE_OF_ETA, LANE_OF_PRESTRESS,
    LANE_OF_DECK_STIFF, LANE_OF_DECK_DRAG, LANE_OF_SHARE, LANE_OF_T_END, LANE_OF_U_END, LANE_OF_W_END,
    LANE_OF_DECK_Y_END, LANE_OF_DECK_V_END, LANE_SHIFT, LANE_OF_SHIFT,
) = range(LANE_ENTRIES, LANE_ENTRIES + 24 * LANES, LANES)  # fmt: skip
# What they are derived from (beside where the path stands, SHIFT): the columns of a piece of the path and their
# changes, a row each; the numbers of the cell and their changes, one after the other, the same in all lanes. Then the
# changes of the forcing and the factor about the step's start in powers of time; and the coefficients of the steps'
# series that their tangents need.
BASE_ROWS = 900
(
    LANE_PIECE, LANE_OF_PIECE, LANE_NUMBERS, LANE_OF_NUMBERS, LANE_OF_FORCING, LANE_OF_FACTOR_HERE, LANE_BASE,
    TANGENT_ENTRIES,
) = _row_starts(
    LANE_ENTRIES + 24 * LANES, PIECE_COLUMNS, PIECE_COLUMNS, *[-(-NUMBERS // LANES)] * 2, TERMS, TERMS, BASE_ROWS
)  # fmt: skip
