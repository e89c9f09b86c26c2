"""Work and energy of a march, from the states at the ends of its steps alone: a check that costs little of the march.

Of wheel and deck, whatever the law of the contact (scaled units; M: kinetic energy, springs, weight and prestress):

    dM/dt = N·(y_k' - w) - D·v - γ·Z²

D·v is what the damper takes (power.py). At both ends of a step the power is known as a short series in the step's own
variable, and Hermite's rule integrates it over the step. Displacements and velocities go on over every event, so M is
known at every end. Steps in an elastic contact, the most by far, are checked many at once (plain_power.py).

    of each step: series at its start (the end of the step before, where nothing changed there), and at its end
                  what is missing:  M(end) - M(start) - ∫ power
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march import plain_power as plain
from wheeltapper.march import program as contract
from wheeltapper.march.events import is_contact_phase
from wheeltapper.march.kernel import inlined_kernel, kernel
from wheeltapper.march.power import (
    CONTACT_WORK,
    LONG,
    LONG_RULE,
    LOST,
    PATH_WORK,
    POWER_TERMS,
    SHORT,
    SHORT_RULE,
    write_power,
)
from wheeltapper.march.program import (
    CONTACT,
    DECK_V,
    DECK_Y,
    END_DEFLECTION,
    END_MODE,
    ENDED_COLUMNS,
    LENGTH,
    ON_DECK,
    PHASE,
    PIECE,
    SHIFT,
    TIME,
    YIELDING,
    A,
    B,
    FloatArray,
)
from wheeltapper.march.series import NO_PIECE, enter_law, localise, localise_marks, path_at

# What is summed: what is missing, its largest amount so far, works and losses by amount, largest energies.
MISSING, LARGEST_MISSING, WORKED, LARGEST_KINETIC, LARGEST_ELASTIC = range(5)
SUMS = 5
ROUNDING = 1e-10
"""An indentation below this part of the displacement is rounding: there the contact opens."""


@kernel
def _enter_piece(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, state: FloatArray, S: FloatArray
) -> None:
    """Put the piece and the law of a state in S, as functions of the time from there on."""
    localise(pieces, numbers, int(state[PIECE]), state[SHIFT], state[TIME], S)
    if law is not None:
        localise_marks(pieces, numbers, int(state[PIECE]), state[SHIFT], state[TIME], S)
        enter_law(int(state[PHASE]) - YIELDING if state[PHASE] >= YIELDING else NO_PIECE, law, S)


@kernel
def _rail_motion(state: FloatArray, S: FloatArray) -> tuple[float, float]:
    """Return displacement and velocity of the rail under the wheel in a state whose piece stands in S."""
    height, velocity, _ = path_at(0.0, S)
    if state[ON_DECK] != 0.0:
        height += state[DECK_Y]
        velocity += state[DECK_V]
    return height, velocity


@kernel
def _wheel_motion(state: FloatArray, S: FloatArray) -> tuple[float, float]:
    """Return displacement and velocity of the wheel in a state whose piece stands in S."""
    if not is_contact_phase(state[PHASE]):
        return state[A], state[B]
    height, velocity = _rail_motion(state, S)
    return height - state[A] * state[A], velocity - state[B]


@kernel
def _put_wheel(y: float, v: float, state: FloatArray, S: FloatArray) -> None:
    """Write displacement and velocity of the wheel into a state whose piece stands in S, as its phase has them."""
    state[A], state[B] = y, v
    if is_contact_phase(state[PHASE]):
        height, velocity = _rail_motion(state, S)
        depth = height - y
        state[A] = sqrt(depth) if depth > ROUNDING * (1.0 + abs(y)) else 0.0
        state[B] = velocity - v


@kernel
def _energy(numbers: FloatArray, state: FloatArray, y: float, v: float) -> float:
    """Return kinetic energy, that of the springs, and that of the wheel's weight; the state tells the deck's motion."""
    wheel = 0.5 * v * v + 0.5 * numbers[contract.STIFFNESS] * y * y + y
    deck_y, deck_v = state[DECK_Y], state[DECK_V]
    deck = numbers[contract.DECK_MASS] * deck_v * deck_v + numbers[contract.DECK_STIFFNESS] * deck_y * deck_y
    return wheel + 0.5 * deck


@kernel
def _short_sum(h: float, k: int, begins: FloatArray, ends: FloatArray) -> float:
    """Return the integral over a step of length h of the power at k, from SHORT terms."""
    total, sign = 0.0, -1.0  # the last of an even number of terms
    for n in range(SHORT - 1, -1, -1):
        total = SHORT_RULE[n] * (begins[k + n] + sign * ends[k + n]) + h * total
        sign = -sign
    return h * total


@kernel
def _long_sum(h: float, k: int, begins: FloatArray, ends: FloatArray) -> float:
    """Return the same from LONG terms."""
    total, power, sign = 0.0, h, 1.0
    for n in range(LONG):
        total += power * LONG_RULE[n] * (begins[k + n] + sign * ends[k + n])
        power *= h
        sign = -sign
    return total


@inlined_kernel
def _add_step(
    numbers: FloatArray, step: FloatArray, after: FloatArray, y: float, v: float, end_y: float, end_v: float,
    begins: FloatArray, ends: FloatArray, sums: FloatArray,
) -> None:  # fmt: skip
    """Add one step to the sums, with the wheel's motion and the power at its start and at its end."""
    h = step[LENGTH]
    if is_contact_phase(step[PHASE]):
        worked = _short_sum(h, PATH_WORK, begins, ends)
        gained = _short_sum(h, CONTACT_WORK, begins, ends)
        lost = _short_sum(h, LOST, begins, ends)
    else:
        worked = _long_sum(h, PATH_WORK, begins, ends)
        gained = _long_sum(h, CONTACT_WORK, begins, ends)
        lost = _long_sum(h, LOST, begins, ends)
    change = _energy(numbers, after, end_y, end_v) - _energy(numbers, step, y, v)
    if step[ON_DECK] != 0.0:
        change -= numbers[contract.PRESTRESS] * (after[DECK_Y] - step[DECK_Y])
    sums[MISSING] += change - (worked - gained - lost)
    sums[LARGEST_MISSING] = max(sums[LARGEST_MISSING], abs(sums[MISSING]))
    sums[WORKED] += abs(worked) + abs(lost)
    sums[LARGEST_KINETIC] = max(sums[LARGEST_KINETIC], 0.5 * v * v)
    sums[LARGEST_ELASTIC] = max(sums[LARGEST_ELASTIC], abs(gained))


@inlined_kernel
def _goes_on(step: FloatArray, after: FloatArray) -> bool:
    """Return whether nothing but the motion is another in the state after a step."""
    same = True
    for column in (PHASE, PIECE, SHIFT, ON_DECK):
        same = same and after[column] == step[column]
    return same and (len(step) < ENDED_COLUMNS or after[END_MODE] == step[END_MODE])


@kernel
def _write_end_state(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, step: FloatArray, after: FloatArray, S: FloatArray,
    end: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Write the state after a step as that step left it into `end`; return the wheel's motion there."""
    _enter_piece(pieces, numbers, law, after, S)
    y, v = _wheel_motion(after, S)
    for k in range(len(end)):
        end[k] = after[k]
    for column in (PHASE, PIECE, SHIFT, ON_DECK):
        end[column] = step[column]
    if len(step) == ENDED_COLUMNS and after[END_MODE] != step[END_MODE]:
        end[END_MODE] = step[END_MODE]
        end[END_DEFLECTION] = 0.0  # nothing is let go before its force is gone
    _enter_piece(pieces, numbers, law, end, S)
    _put_wheel(y, v, end, S)
    return y, v


@kernel
def _last_alike(steps: FloatArray, first: int) -> int:
    """Return the number of the last of the steps from `first` on after which only the motion is another."""
    i = first
    while i + 1 < len(steps) and _goes_on(steps[i], steps[i + 1]):
        i += 1
    return i


@kernel
def _add_contact(
    pieces: FloatArray, numbers: FloatArray, steps: FloatArray, end: FloatArray, L: FloatArray, sums: FloatArray
) -> None:
    """Add steps in an elastic contact, between which only the motion changes, to the sums; `end` is the last one's."""
    begun = working = gaining = losing = 0.0
    for first in range(0, len(steps) + 1, plain.STATES):
        count = plain.find_power(pieces, numbers, steps, first, end, L)
        for i in range(count):
            if first + i > 0:
                half = 0.5 * L[plain.STEP_BEFORE + i]  # what is exchanged need not be exact: by the trapezoidal rule
                sums[MISSING] += L[plain.ENERGY + i] - L[plain.GAIN_BEFORE + i] - begun
                sums[LARGEST_MISSING] = max(sums[LARGEST_MISSING], abs(sums[MISSING]))
                sums[WORKED] += half * (abs(working + L[plain.WORKING + i]) + abs(losing + L[plain.LOSING + i]))
                sums[LARGEST_ELASTIC] = max(sums[LARGEST_ELASTIC], half * abs(gaining + L[plain.GAINING + i]))
            sums[LARGEST_KINETIC] = max(sums[LARGEST_KINETIC], L[plain.KINETIC + i])
            begun = L[plain.ENERGY + i] + L[plain.GAIN_AFTER + i]
            working, gaining, losing = L[plain.WORKING + i], L[plain.GAINING + i], L[plain.LOSING + i]


@kernel
def balance_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, damper: FloatArray | None, steps: FloatArray,
    last: FloatArray, sums: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Add what some steps, after which the state is `last`, leave missing and exchange to `sums` (SUMS,).

    `law` and `damper` are None where single.py says.
    """
    L = np.zeros(plain.ENTRIES)
    begins, ends = np.zeros(POWER_TERMS), np.zeros(POWER_TERMS)
    end = np.empty(steps.shape[1])
    same = False
    y = v = 0.0
    i = 0
    while i < len(steps):
        elastic = law is None and damper is None and steps[i, PHASE] == CONTACT
        first, i = i, _last_alike(steps, i) if elastic else i
        step = steps[i]
        i += 1
        after = steps[i] if i < len(steps) else last
        if elastic:
            _write_end_state(pieces, numbers, law, step, after, S, end)
            _add_contact(pieces, numbers, steps[first:i], end, L, sums)
            same = False
            continue
        if not same:
            _enter_piece(pieces, numbers, law, step, S)
            y, v = write_power(pieces, numbers, damper, step, S, begins)
        same = _goes_on(step, after)
        if same:
            _enter_piece(pieces, numbers, law, after, S)
            end_y, end_v = write_power(pieces, numbers, damper, after, S, ends)
        else:
            end_y, end_v = _write_end_state(pieces, numbers, law, step, after, S, end)
            write_power(pieces, numbers, damper, end, S, ends)
        _add_step(numbers, step, after, y, v, end_y, end_v, begins, ends, sums)
        begins, ends = ends, begins
        y, v = end_y, end_v
