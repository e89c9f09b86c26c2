"""Work and energy of a march, from the states at the ends of its steps alone: a check that costs little of the march.

Of wheel and deck, whatever the law of the contact (scaled units; M: kinetic energy, springs, weight and prestress):

    dM/dt = N·(y_k' - w) - D·v - γ·Z²

D·v is what the damper takes. At both ends of a step the power is known as a short series in the step's own variable,
and Hermite's rule integrates it over the step (steps/powers.py). Displacements and velocities go on over every event,
so M is known at every end. Steps between which only the motion changes are checked together, eight ends at a time.

    of each step what is missing:  M(end) - M(start) - ∫ power
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, kernel, uncounted_kernel
from wheeltapper.march.common.program import LENGTH, ON_DECK, PHASE, PIECE, SHIFT, TERMS, TIME, A, B, FloatArray
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps.calling import call_eight
from wheeltapper.march.steps.lane_rows import LANES
from wheeltapper.march.steps.layout import SCRATCH
from wheeltapper.march.steps.series import localise, rail_at
from wheeltapper.march.wheel.apart import numbers_to_row, path_to_row
from wheeltapper.march.wheel.events import is_contact_phase, is_free, wheel_motion

# What is summed: what is missing, its largest amount so far, works and losses by amount, largest energies.
MISSING, LARGEST_MISSING, WORKED, LARGEST_KINETIC, LARGEST_ELASTIC = range(5)
SUMS = 5
ROUNDING = 1e-10
"""An indentation below this part of the displacement is rounding: there the contact opens."""


@uncounted_kernel
def _put_wheel(y: float, v: float, state: FloatArray, S: FloatArray) -> None:
    """Write displacement and velocity of the wheel into a state whose piece stands in S, as its phase has them."""
    state[A], state[B] = y, v
    if is_contact_phase(state[PHASE]):
        height, velocity = rail_at(0.0, state, S)
        depth = height - y
        state[A] = sqrt(depth) if depth > ROUNDING * (1.0 + abs(y)) else 0.0
        state[B] = velocity - v


@inlined_uncounted_kernel
def _kind_of(phase: float) -> int:
    """Return the number of the function for energies in a phase (steps/powers.py)."""
    return 2 if phase >= contract.YIELDING else 1 if phase == contract.CONTACT else 0


@inlined_uncounted_kernel
def _goes_on(step: FloatArray, after: FloatArray) -> bool:
    """Return whether nothing but the motion is another in the state after a step."""
    same = True
    for column in (PHASE, PIECE, SHIFT, ON_DECK):
        same = same and after[column] == step[column]
    return same and (len(step) < contract.ENDED_COLUMNS or after[contract.END_MODE] == step[contract.END_MODE])


@uncounted_kernel
def _write_end_state(
    pieces: FloatArray, numbers: FloatArray, step: FloatArray, after: FloatArray, S: FloatArray, end: FloatArray
) -> None:
    """Write the state after a step as that step left it into `end`."""
    y, v = wheel_motion(pieces, numbers, after, S)
    for k in range(len(end)):
        end[k] = after[k]
    for column in (PHASE, PIECE, SHIFT, ON_DECK):
        end[column] = step[column]
    if len(step) == contract.ENDED_COLUMNS and after[contract.END_MODE] != step[contract.END_MODE]:
        end[contract.END_MODE] = step[contract.END_MODE]
        end[contract.END_DEFLECTION] = 0.0  # nothing is let go before its force is gone
    localise(pieces, numbers, int(end[PIECE]), end[SHIFT], end[TIME], S)
    _put_wheel(y, v, end, S)


@uncounted_kernel
def _last_alike(steps: FloatArray, first: int) -> int:
    """Return the number of the last of the steps from `first` on after which only the motion is another."""
    i = first
    while i + 1 < len(steps) and _goes_on(steps[i], steps[i + 1]):
        i += 1
    return i


@inlined_uncounted_kernel
def _put(value: float, row: int, L: FloatArray) -> None:
    """Write a number in all lanes."""
    for i in range(LANES):
        L[row + i] = value


@uncounted_kernel
def _put_polynomial(gain: float, piece: FloatArray, first: int, degree: int, row: int, L: FloatArray) -> None:
    """Write a polynomial of a piece in all lanes; `first` is its first column."""
    for k in range(TERMS):
        _put(gain * piece[first + k] if k <= degree else 0.0, row + LANES * k, L)


@uncounted_kernel
def _put_model(
    numbers: FloatArray, piece: FloatArray, law: FloatArray, state: FloatArray, row: FloatArray, L: FloatArray
) -> None:  # fmt: skip
    """Write what does not change while steps go on as in this state in all lanes; `row` has room for CELL_NUMBERS."""
    mode = state[contract.END_MODE] if len(state) == contract.ENDED_COLUMNS else contract.FREE
    numbers_to_row(numbers, state[ON_DECK], mode, row)
    path_to_row(numbers, piece, state[SHIFT], row)
    for k in range(at.CELL_NUMBERS):
        first = at.LANE_K if k < at.FIXED_NUMBERS else at.LANE_BUSH - LANES * at.FIXED_NUMBERS
        _put(row[k], first + LANES * k, L)
    lift = numbers[contract.LIFT]
    _put(numbers[contract.DECK_MASS], at.LANE_MASS, L)
    _put_polynomial(lift, piece, contract.COEFFICIENT, int(piece[contract.DEGREE]), at.LANE_PATH, L)
    touches, degree = not is_free(state[PHASE]), int(piece[contract.FACTOR_DEGREE])
    _put_polynomial(1.0, piece, contract.FACTOR, degree if touches else -1, at.LANE_FACTOR, L)
    if touches and degree < 0:
        _put(1.0, at.LANE_FACTOR, L)
    if state[PHASE] >= contract.YIELDING:
        yields = law[int(state[PHASE]) - contract.YIELDING]
        _put(yields[contract.LAW_CENTRE], at.LANE_LAW_CENTRE, L)
        _put(1.0 / yields[contract.LAW_SCALE], at.LANE_LAW_RATE, L)
        _put_polynomial(1.0, yields, contract.LAW_FORCE, TERMS, at.LANE_LAW, L)
        residual = int(piece[contract.RESIDUAL_DEGREE])
        _put_polynomial(lift, piece, contract.RESIDUAL, residual, at.LANE_RESIDUAL, L)


@inlined_uncounted_kernel
def _put_state(i: int, state: FloatArray, before: float, after: float, L: FloatArray) -> None:
    """Write a state in a lane, with the lengths of the steps before and after it."""
    L[at.LANE_TIME + i], L[at.LANE_U0 + i], L[at.LANE_W0 + i] = state[TIME], state[A], state[B]
    L[at.LANE_DECK_Y + i], L[at.LANE_DECK_V + i] = state[contract.DECK_Y], state[contract.DECK_V]
    L[at.LANE_BUSH_Y + i] = state[contract.END_DEFLECTION] if len(state) == contract.ENDED_COLUMNS else 0.0
    L[at.LANE_BEFORE + i], L[at.LANE_AFTER + i] = before, after


@uncounted_kernel
def _add_steps(steps: FloatArray, end: FloatArray, powers: float, L: FloatArray, sums: FloatArray) -> None:
    """Add steps between which only the motion changes to the sums; `end` is the last one's."""
    begun = worked = gained = lost = 0.0
    for first in range(0, len(steps) + 1, LANES):
        for i in range(LANES):
            k = min(first + i, len(steps))
            before, after = steps[k - 1, LENGTH] if k > 0 else 0.0, steps[k, LENGTH] if k < len(steps) else 0.0
            _put_state(i, steps[k] if k < len(steps) else end, before, after, L)
        call_eight(powers, L)
        for i in range(min(LANES, len(steps) + 1 - first)):
            if first + i > 0:
                half = 0.5 * L[at.LANE_BEFORE + i]  # what the contact takes and gives need not be exact
                sums[MISSING] += L[at.LANE_ENERGY + i] - L[at.LANE_GAIN_BEFORE + i] - begun
                sums[LARGEST_MISSING] = max(sums[LARGEST_MISSING], abs(sums[MISSING]))
                sums[WORKED] += half * abs(worked + L[at.LANE_WORKED + i]) + abs(lost + L[at.LANE_LOST_BEFORE + i])
                sums[LARGEST_ELASTIC] = max(sums[LARGEST_ELASTIC], half * abs(gained + L[at.LANE_GAINED + i]))
            sums[LARGEST_KINETIC] = max(sums[LARGEST_KINETIC], L[at.LANE_KINETIC + i])
            begun = L[at.LANE_ENERGY + i] + L[at.LANE_GAIN_AFTER + i]
            worked, gained, lost = L[at.LANE_WORKED + i], L[at.LANE_GAINED + i], L[at.LANE_LOST_AFTER + i]


@kernel
def balance_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, steps: FloatArray, last: FloatArray,
    sums: FloatArray, made: FloatArray,
) -> None:  # fmt: skip
    """Add what some steps, after which the state is `last`, leave missing and exchange to `sums` (SUMS,).

    `made` says where the code of `powers` is.
    """
    S, L, row = np.zeros(SCRATCH), np.zeros(at.ENERGY_ENTRIES), np.zeros(at.CELL_NUMBERS)
    end = np.empty(steps.shape[1])
    i = 0
    while i < len(steps):
        first, i = i, _last_alike(steps, i) + 1
        step = steps[first]
        _write_end_state(pieces, numbers, step, steps[i] if i < len(steps) else last, S, end)
        _put_model(numbers, pieces[int(step[PIECE])], law, step, row, L)
        _add_steps(steps[first:i], end, made[_kind_of(step[PHASE])], L, sums)
