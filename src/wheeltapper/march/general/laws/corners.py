"""A force in straight stretches over a displacement, or over its rate: N = f_s + k_s·(u - u_s), u = δ or δ'.

A row of the table is one stretch: where it begins, u_s, f_s and k_s, in SI units; the first one begins at minus
infinity. Within a stretch the force goes on straight beyond its corners, so that a march finds them from inside.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray

CORNERED_COUNT, CORNERED_FIRST, CORNERED_PER_LENGTH, CORNERED_FORCE = range(1, 5)
"""Columns: number of stretches, the table's first row, units of length in m and of force in N."""
STRETCH_BEGIN, STRETCH_PLACE, STRETCH_FORCE, STRETCH_SLOPE = range(4)
"""Columns of a row: its begin, u_s, f_s, k_s."""


@inlined_uncounted_kernel
def cornered_force(u: float, stretch: float, numbers: FloatArray, table: FloatArray) -> tuple[float, float]:
    """Return the force of a displacement or a rate in a stretch, and its derivative."""
    row = table[int(numbers[CORNERED_FIRST] + stretch)]
    slope = row[STRETCH_SLOPE] * numbers[CORNERED_PER_LENGTH] / numbers[CORNERED_FORCE]
    along = u - row[STRETCH_PLACE] / numbers[CORNERED_PER_LENGTH]
    return row[STRETCH_FORCE] / numbers[CORNERED_FORCE] + slope * along, slope


@uncounted_kernel
def corner_at(stretch: float, numbers: FloatArray, table: FloatArray) -> float:
    """Return where a stretch begins; infinity behind the last one."""
    if stretch >= numbers[CORNERED_COUNT]:
        return np.inf
    return table[int(numbers[CORNERED_FIRST] + stretch), STRETCH_BEGIN] / numbers[CORNERED_PER_LENGTH]
