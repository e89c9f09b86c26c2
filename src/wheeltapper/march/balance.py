"""Work and energy of a march, from the states at the ends of its steps alone: a check that costs little of the march.

Of wheel and deck, whatever the law of the contact (scaled units; M: kinetic energy, springs, weight and prestress):

    dM/dt = N·(y_k' - w) - G·v² - γ·Z²

At both ends of a step the power is known as a short series in the step's own variable, and Hermite's rule integrates
it over the step. Displacements and velocities go on over every event, so M is known at every end.

    of each step: short series at its start (the end of the step before, where nothing changed there), and at its end
                  what is missing:  M(end) - M(start) - ∫ power
"""

from __future__ import annotations

from math import factorial, sqrt

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.events import touches
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import SCRATCH
from wheeltapper.march.power import CONTACT_WORK, DOT, LONG, LOST, PATH, SHORT, contact_power, free_power, plain_power
from wheeltapper.march.program import (
    BONDED,
    DECK_V,
    DECK_Y,
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
from wheeltapper.march.series import enter_law, localise, localise_marks, path_at

# What is summed: what is missing, its largest amount so far, works and losses by amount, largest energies.
MISSING, LARGEST_MISSING, WORKED, LARGEST_KINETIC, LARGEST_ELASTIC = range(5)
SUMS = 5


def _rule(terms: int) -> FloatArray:
    """Return the weights of Hermite's rule for the series at the start; for that at the end, signs alternate."""
    k = terms - 1
    return np.array([
        factorial(k + 1) / factorial(2 * k + 2) * factorial(2 * k + 1 - j) / factorial(k - j) / (j + 1)
        for j in range(terms)
    ])  # fmt: skip


SHORT_RULE, LONG_RULE = _rule(SHORT), _rule(LONG)


@kernel
def _enter(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, step: FloatArray, time: float, S: FloatArray
) -> None:
    """Put the piece and the law of a step in S, as functions of the time after `time`."""
    localise(pieces, numbers, int(step[PIECE]), step[SHIFT], time, S)
    if law.shape[0] > 0:
        localise_marks(pieces, numbers, int(step[PIECE]), step[SHIFT], time, S)
        enter_law(int(step[PHASE]) - YIELDING if step[PHASE] >= YIELDING else -1, law, S)


@kernel
def held_at(step: FloatArray, S: FloatArray) -> tuple[float, float]:
    """Return displacement and velocity of the wheel in a state whose piece stands in S."""
    if not touches(step[PHASE]):
        return step[A], step[B]
    height, velocity, _ = path_at(0.0, S)
    if step[ON_DECK] != 0.0:
        height += step[DECK_Y]
        velocity += step[DECK_V]
    return height - step[A] * step[A], velocity - step[B]


@kernel
def _energy(numbers: FloatArray, y: float, v: float, deck_y: float, deck_v: float) -> float:
    """Return kinetic energy, that of the springs, and that of the wheel's weight."""
    wheel = 0.5 * v * v + 0.5 * numbers[contract.STIFFNESS] * y * y + y
    deck = numbers[contract.DECK_MASS] * deck_v * deck_v + numbers[contract.DECK_STIFFNESS] * deck_y * deck_y
    return wheel + 0.5 * deck


@kernel
def _short_sum(h: float, a: FloatArray, b: FloatArray) -> float:
    """Return the integral over a step of length h from the series at its ends, of SHORT terms."""
    r = SHORT_RULE
    return h * (
        r[0] * (a[0] + b[0]) + h * (r[1] * (a[1] - b[1]) + h * (r[2] * (a[2] + b[2]) + h * r[3] * (a[3] - b[3])))
    )


@kernel
def _long_sum(h: float, a: FloatArray, b: FloatArray) -> float:
    """Return the same from LONG terms."""
    total, power, sign = 0.0, h, 1.0
    for n in range(LONG):
        total += power * LONG_RULE[n] * (a[n] + sign * b[n])
        power *= h
        sign = -sign
    return total


@kernel
def settle(
    numbers: FloatArray, step: FloatArray, after: FloatArray, y: float, v: float, end_y: float, end_v: float,
    begins: FloatArray, ends: FloatArray, sums: FloatArray,
) -> None:  # fmt: skip
    """Add one step to the sums, with the wheel's motion and the power at its start and at its end."""
    if touches(step[PHASE]):
        worked = _short_sum(step[LENGTH], begins[PATH], ends[PATH])
        gained = _short_sum(step[LENGTH], begins[CONTACT_WORK], ends[CONTACT_WORK])
        lost = _short_sum(step[LENGTH], begins[LOST], ends[LOST])
    else:
        worked = _long_sum(step[LENGTH], begins[PATH], ends[PATH])
        gained = _long_sum(step[LENGTH], begins[CONTACT_WORK], ends[CONTACT_WORK])
        lost = _long_sum(step[LENGTH], begins[LOST], ends[LOST])
    change = _energy(numbers, end_y, end_v, after[DECK_Y], after[DECK_V])
    change -= _energy(numbers, y, v, step[DECK_Y], step[DECK_V])
    if step[ON_DECK] != 0.0:
        change -= numbers[contract.PRESTRESS] * (after[DECK_Y] - step[DECK_Y])
    sums[MISSING] += change - (worked - gained - lost)
    sums[LARGEST_MISSING] = max(sums[LARGEST_MISSING], abs(sums[MISSING]))
    sums[WORKED] += abs(worked) + abs(lost)
    sums[LARGEST_KINETIC] = max(sums[LARGEST_KINETIC], 0.5 * v * v)
    sums[LARGEST_ELASTIC] = max(sums[LARGEST_ELASTIC], abs(gained))


@kernel
def seen_from(step: FloatArray, after: FloatArray, y: float, v: float, S: FloatArray) -> tuple[float, float]:
    """Return u and w at the end of a contact step, whose piece stands in S, from the wheel's motion there."""
    height, velocity, _ = path_at(0.0, S)
    if step[ON_DECK] != 0.0:
        height += after[DECK_Y]
        velocity += after[DECK_V]
    depth = height - y
    return sqrt(depth) if depth > DOT * (1.0 + abs(y)) else 0.0, velocity - v


@kernel
def balance_kernel(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, steps: FloatArray, last: FloatArray, sums: FloatArray
) -> None:
    """Add what some steps, after which the state is `last`, leave missing and exchange to `sums` (SUMS,)."""
    S = np.zeros(SCRATCH)
    P = np.zeros((4, LONG))
    begins, ends = np.zeros((3, LONG)), np.zeros((3, LONG))
    work = np.zeros(contract.TERMS)
    plain = law.shape[0] == 0 and numbers[contract.DECK_MASS] == 0.0
    known = False
    y = v = 0.0
    for i in range(len(steps)):
        step = steps[i]
        after = steps[i + 1] if i + 1 < len(steps) else last
        contact, on_deck = touches(step[PHASE]), step[ON_DECK] != 0.0
        if not known and contact and plain:
            y, v = plain_power(pieces, numbers, step, step[TIME], True, y, v, step[A], step[B], work, begins)
        elif not known:
            _enter(pieces, numbers, law, step, step[TIME], S)
            y, v = held_at(step, S)
            if contact:
                contact_power(numbers, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S, P, begins)
            else:
                bonded = step[PHASE] == BONDED
                free_power(numbers, bonded, y, v, step[DECK_Y], step[DECK_V], on_deck, S, P, begins)
        # -- the end, as this step sees it
        known = (
            contact
            and step[PHASE] == after[PHASE]
            and step[PIECE] == after[PIECE]
            and step[SHIFT] == after[SHIFT]
            and step[ON_DECK] == after[ON_DECK]
        )
        if known and plain:
            end_y, end_v = plain_power(pieces, numbers, after, after[TIME], True, y, v, after[A], after[B], work, ends)
        else:
            _enter(pieces, numbers, law, after, after[TIME], S)
            end_y, end_v = held_at(after, S)
        if known and plain:
            pass
        elif contact and plain:
            plain_power(pieces, numbers, step, after[TIME], False, end_y, end_v, 0.0, 0.0, work, ends)
        elif known:
            contact_power(numbers, after[A], after[B], after[DECK_Y], after[DECK_V], on_deck, S, P, ends)
        else:
            _enter(pieces, numbers, law, step, after[TIME], S)
            if contact:
                u, w = seen_from(step, after, end_y, end_v, S)
                contact_power(numbers, u, w, after[DECK_Y], after[DECK_V], on_deck, S, P, ends)
            else:
                bonded = step[PHASE] == BONDED
                free_power(numbers, bonded, end_y, end_v, after[DECK_Y], after[DECK_V], on_deck, S, P, ends)
        settle(numbers, step, after, y, v, end_y, end_v, begins, ends, sums)
        begins, ends = ends, begins
        y, v = end_y, end_v
