"""Sums and extremes over steps, for features beyond events and force maxima: impulses and the highest position.

For each step its series is computed again. Its impulse is added to the present contact. The highest position is taken
at its ends, and inside where the wheel turns. A step without contact force ends the present contact; the first step
after it begins the next one.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.dense import OUT_FORCE, OUT_WHEEL_V, OUT_WHEEL_Y, fill_row, prepare_step
from wheeltapper.march.events import is_free
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.layout import U
from wheeltapper.march.program import LENGTH, PHASE, TIME, FloatArray
from wheeltapper.march.roots import evaluate

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
NODES, WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
# Entries of the tally: highest position and its time, number of contacts that impacts began, whether such a contact is
# going on, whether the last step was without contact force.
HIGHEST, HIGHEST_TIME, CONTACTS, STILL_OPEN, FLEW = range(5)
TALLY = 5


@uncounted_kernel
def _wheel_velocity(height: float, time: float, tally: FloatArray) -> None:
    if height > tally[HIGHEST]:
        tally[HIGHEST] = height
        tally[HIGHEST_TIME] = time


@uncounted_kernel
def _note_highest(
    numbers: FloatArray, step: FloatArray, lo: float, hi: float, tally: FloatArray, S: FloatArray, point: FloatArray
) -> None:
    """Note the highest position between two places of the prepared step between which the wheel stops rising."""
    after = 0.0
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        after = fill_row(numbers, None, step, middle, S, point)
        if point[OUT_WHEEL_V] > 0.0:
            lo = middle
        else:
            hi = middle
    _wheel_velocity(point[OUT_WHEEL_Y], step[TIME] + after, tally)


@uncounted_kernel
def tally_kernel(
    pieces: FloatArray, numbers: FloatArray, steps: FloatArray, count: int, tally: FloatArray, impulses: FloatArray,
    S: FloatArray, point: FloatArray,
) -> None:  # fmt: skip
    """Add the first `count` steps to a cell's tally, and their impulses to the rows of `impulses`."""
    for i in range(count):
        step = steps[i]
        flying = is_free(step[PHASE])
        contact = prepare_step(pieces, numbers, None, None, step, S)
        if flying:
            tally[STILL_OPEN] = 0.0
        elif tally[FLEW] != 0.0:
            tally[STILL_OPEN] = 1.0
            impulses[int(tally[CONTACTS])] = 0.0
            tally[CONTACTS] += 1.0
        tally[FLEW] = 1.0 if flying else 0.0
        fill_row(numbers, None, step, 0.0, S, point)
        _wheel_velocity(point[OUT_WHEEL_Y], step[TIME], tally)
        before = 0.0
        rising = point[OUT_WHEEL_V] > 0.0
        for j in range(len(NODES) + 1):
            x = NODES[j] * step[LENGTH] if j < len(NODES) else step[LENGTH]
            after = fill_row(numbers, None, step, x, S, point)
            if j < len(NODES) and tally[STILL_OPEN] != 0.0:
                weight = WEIGHTS[j] * step[LENGTH]
                if contact:
                    weight *= evaluate(S, U, int(numbers[contract.ORDER]), x)
                impulses[int(tally[CONTACTS]) - 1] += weight * point[OUT_FORCE]
            _wheel_velocity(point[OUT_WHEEL_Y], step[TIME] + after, tally)
            falling = point[OUT_WHEEL_V] <= 0.0
            if rising and falling:
                _note_highest(numbers, step, before, x, tally, S, point)
            rising = not falling
            before = x
