"""Sums and extremes over steps, for features beyond events and force maxima: impulses and the highest position.

For each step its series is computed again, whose integral is its impulse; that is added to the present contact. The
highest position is taken at its ends, and inside where the wheel turns. A step without contact force ends the present
contact; the first step after it begins the next one.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import ENOUGH, LENGTH, PHASE, TIME, FloatArray
from wheeltapper.march.wheel.dense import OUT_WHEEL_V, OUT_WHEEL_Y, fill_row, impulse, prepare_step
from wheeltapper.march.wheel.events import is_free

# Entries of the tally: highest position and its time, number of contacts that impacts began, whether such a contact is
# going on, whether the last step was without contact force, whether there was a step, and whether the wheel rose at its
# end: velocities go on over all events.
HIGHEST, HIGHEST_TIME, CONTACTS, STILL_OPEN, FLEW, BEGUN, RISES = range(7)
TALLY = 7


@uncounted_kernel
def _note_position(height: float, time: float, tally: FloatArray) -> None:
    if height > tally[HIGHEST]:
        tally[HIGHEST] = height
        tally[HIGHEST_TIME] = time


@uncounted_kernel
def _note_highest(
    numbers: FloatArray, step: FloatArray, lo: float, hi: float, tally: FloatArray,
    S: FloatArray, point: FloatArray,
) -> None:  # fmt: skip
    """Note the highest position between two places of the prepared step between which the wheel stops rising."""
    after = 0.0
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        after = fill_row(numbers, step, middle, S, point)
        if point[OUT_WHEEL_V] > 0.0:
            lo = middle
        else:
            hi = middle
    _note_position(point[OUT_WHEEL_Y], step[TIME] + after, tally)


@uncounted_kernel
def tally_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, steps: FloatArray,
    count: int, tally: FloatArray, impulses: FloatArray, S: FloatArray, point: FloatArray,
) -> None:  # fmt: skip
    """Add the first `count` steps to a cell's tally, and their impulses to the rows of `impulses`."""
    for i in range(count):
        step = steps[i]
        flying = is_free(step[PHASE])
        prepare_step(pieces, numbers, law, step, S)
        if flying:
            tally[STILL_OPEN] = 0.0
        elif tally[FLEW] != 0.0:
            tally[STILL_OPEN] = 1.0
            impulses[int(tally[CONTACTS])] = 0.0
            tally[CONTACTS] += 1.0
        tally[FLEW] = 1.0 if flying else 0.0
        if tally[BEGUN] == 0.0:
            fill_row(numbers, step, 0.0, S, point)
            _note_position(point[OUT_WHEEL_Y], step[TIME], tally)
            tally[BEGUN], tally[RISES] = 1.0, 1.0 if point[OUT_WHEEL_V] > 0.0 else 0.0
        if tally[STILL_OPEN] != 0.0:
            impulses[int(tally[CONTACTS]) - 1] += impulse(pieces, numbers, step, S)
        after = fill_row(numbers, step, step[LENGTH], S, point)
        _note_position(point[OUT_WHEEL_Y], step[TIME] + after, tally)
        rises = point[OUT_WHEEL_V] > 0.0
        if tally[RISES] != 0.0 and not rises:  # steps are too short for the wheel to turn twice
            _note_highest(numbers, step, 0.0, step[LENGTH], tally, S, point)
        tally[RISES] = 1.0 if rises else 0.0


@uncounted_kernel
def end_tally(why: int, tally: FloatArray, impulses: FloatArray) -> None:
    """Forget the impulse of a contact that outlasts the run."""
    if why != ENOUGH and tally[STILL_OPEN] != 0.0:
        impulses[int(tally[CONTACTS]) - 1] = np.nan
