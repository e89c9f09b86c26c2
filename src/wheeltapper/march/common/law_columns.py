"""Columns of the numbers and pieces of elastic-plastic laws (plastic_law.py)."""

from __future__ import annotations

from wheeltapper.march.common.program import LAW_COLUMNS

PLASTIC_CONSTANT, PLASTIC_ONSET, PLASTIC_FIRST, PLASTIC_PIECES = range(1, 5)
"""Numbers: C, δ_Y, first row of the pieces, and their number."""
PIECE_STRETCH = LAW_COLUMNS
"""Column of a piece behind those of `common.program`: the number of the law's borders up to its start."""
PLASTIC_COLUMNS = PIECE_STRETCH + 1
PIECE_STORED = PLASTIC_COLUMNS
"""Column of a piece, in the wagon's march only: the work of loading a virgin surface up to its start, over N_Y·δ_Y."""
YIELD_COLUMNS = PIECE_STORED + 1
