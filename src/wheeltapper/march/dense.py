"""Any time of a march, exactly: the series of the step that holds it is computed once more and evaluated.

Also the energy's integrals, by Gauss quadrature on the same series (analytic in the step's own variable).
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.events import force as contact_force
from wheeltapper.march.flight import bonded_series, flight_series
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import FLIGHT_ORDER, SCRATCH, T, U, W, Y, Z
from wheeltapper.march.program import (
    BONDED,
    CONTACT,
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
from wheeltapper.march.roots import evaluate
from wheeltapper.march.series import (
    contact_series,
    enter_law,
    factor_at,
    localise,
    localise_marks,
    path_at,
    residual_at,
)
from wheeltapper.march.step import time_to

# Columns of the dense output.
WHEEL_Y, WHEEL_V, WHEEL_A, FORCE, DELTA, DELTA_V, PATH_Y, PATH_V, OUT_DECK_Y, OUT_DECK_V, OUT_DECK_A, RESIDUAL = range(
    12
)
OUT_COLUMNS = 12
# Columns of the energy's integrals over a step.
WORK_PATH, WORK_FACTOR, LOST_SUSPENSION, LOST_DECK, LOST_CONTACT, IMPULSE, CONTACT_TIME = range(7)
INTEGRALS = 7


@kernel
def touches(step: FloatArray) -> bool:
    """Return True for a contact step, whose variable is s."""
    return bool(step[PHASE] == CONTACT or step[PHASE] >= YIELDING)


@kernel
def _prepare(pieces: FloatArray, numbers: FloatArray, law: FloatArray, step: FloatArray, S: FloatArray) -> bool:
    """Compute the series of a step; return True for a contact step."""
    on_deck = step[ON_DECK] != 0.0
    localise(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
    if law.shape[0] > 0:
        localise_marks(pieces, numbers, int(step[PIECE]), step[SHIFT], step[TIME], S)
        enter_law(int(step[PHASE]) - YIELDING if step[PHASE] >= YIELDING else -1, law, S)
    if touches(step):
        order = int(numbers[contract.ORDER])
        contact_series(numbers, order, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S)
        return True
    if step[PHASE] == BONDED:
        bonded_series(numbers, FLIGHT_ORDER, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S)
    else:
        flight_series(numbers, FLIGHT_ORDER, step[A], step[B], step[DECK_Y], step[DECK_V], on_deck, S)
    return False


@kernel
def _fill(numbers: FloatArray, step: FloatArray, x: float, S: FloatArray, out: FloatArray) -> float:
    """Write all quantities at x of the prepared step's own variable; return the time after the step's start."""
    on_deck = step[ON_DECK] != 0.0
    contact = touches(step)
    deck = numbers[contract.DECK_MASS] > 0.0
    order = int(numbers[contract.ORDER]) if contact else FLIGHT_ORDER
    after = evaluate(S, T, order, x) if contact else x
    first = evaluate(S, U, order, x)
    second = evaluate(S, W, order, x)
    deck_y = evaluate(S, Y, order, x) if deck else 0.0
    deck_v = evaluate(S, Z, order, x) if deck else 0.0
    height, velocity, _ = path_at(after, S)
    lift = deck_y if on_deck else 0.0
    lift_v = deck_v if on_deck else 0.0
    force = 0.0
    if contact:
        delta = first * first
        rate = second
        force = contact_force(numbers, after, first, second, S)
        y = height + lift - delta
        v = velocity + lift_v - rate
    else:
        y = first
        v = second
        delta = height + lift - y
        rate = velocity + lift_v - v
        if step[PHASE] == BONDED:
            factor, _ = factor_at(after, S)
            force = factor * delta
    out[WHEEL_Y] = y
    out[WHEEL_V] = v
    out[WHEEL_A] = -1.0 - numbers[contract.STIFFNESS] * y - numbers[contract.DAMPING] * v + force
    out[FORCE] = force
    out[DELTA] = delta
    out[DELTA_V] = rate
    out[PATH_Y] = height
    out[PATH_V] = velocity
    out[OUT_DECK_Y] = deck_y
    out[OUT_DECK_V] = deck_v
    out[RESIDUAL] = residual_at(after, S)
    out[OUT_DECK_A] = 0.0
    if deck:
        pull = -numbers[contract.DECK_STIFFNESS] * deck_y - numbers[contract.DECK_DAMPING] * deck_v
        if on_deck:
            pull += numbers[contract.PRESTRESS] - force
        out[OUT_DECK_A] = pull / numbers[contract.DECK_MASS]
    return after


@kernel
def dense(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, steps: FloatArray, times: FloatArray, out: FloatArray
) -> None:
    """Write all quantities at the given rising times (scaled) into the rows of `out`."""
    S = np.zeros(SCRATCH)
    present = -1
    row = 0
    for i in range(len(times)):
        while row + 1 < len(steps) and steps[row + 1, TIME] <= times[i]:
            row += 1
        step = steps[row]
        if row != present:
            _prepare(pieces, numbers, law, step, S)
            present = row
        after = max(times[i] - step[TIME], 0.0)
        contact = touches(step)
        x = min(after, step[LENGTH]) if not contact else 0.0
        if contact and after > 0.0:
            order = int(numbers[contract.ORDER])
            whole = evaluate(S, T, order, step[LENGTH])
            x = step[LENGTH] if after >= whole else time_to(S, order, step[LENGTH], after)
        _fill(numbers, step, x, S, out[i])


@kernel
def integrals(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray, steps: FloatArray, nodes: FloatArray,
    weights: FloatArray, out: FloatArray, ends: FloatArray,
) -> None:  # fmt: skip
    """Write each step's integrals into `out`, and the quantities at its two ends into ends[step, 0 or 1].

    Where the contact yields, LOST_CONTACT is all work of the contact force; what of it is stored is not yet taken off.
    """
    S = np.zeros(SCRATCH)
    point = np.zeros(OUT_COLUMNS)
    for i in range(len(steps)):
        step = steps[i]
        contact = _prepare(pieces, numbers, law, step, S)
        _fill(numbers, step, 0.0, S, ends[i, 0])
        _fill(numbers, step, step[LENGTH], S, ends[i, 1])
        order = int(numbers[contract.ORDER])
        total = out[i]
        total[:] = 0.0
        for j in range(len(nodes)):
            x = nodes[j] * step[LENGTH]
            after = _fill(numbers, step, x, S, point)
            weight = weights[j] * step[LENGTH]
            if contact:
                weight *= evaluate(S, U, order, x)
            total[LOST_SUSPENSION] += weight * numbers[contract.DAMPING] * point[WHEEL_V] ** 2
            total[LOST_DECK] += weight * numbers[contract.DECK_DAMPING] * point[OUT_DECK_V] ** 2
            total[WORK_PATH] += weight * point[FORCE] * point[PATH_V]
            total[IMPULSE] += weight * point[FORCE]
            if contact:
                total[CONTACT_TIME] += weight
            if step[PHASE] >= YIELDING:
                total[LOST_CONTACT] += weight * point[FORCE] * point[DELTA_V]
            elif contact:
                factor, rate = factor_at(after, S)
                delta = point[DELTA]
                stored = numbers[contract.QUADRATIC] * delta**2 / 2.0 + numbers[contract.CUBIC] * delta**2.5 / 2.5
                total[WORK_FACTOR] += weight * rate * stored
                elastic = factor * delta * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * np.sqrt(delta))
                total[LOST_CONTACT] += weight * (point[FORCE] - elastic) * point[DELTA_V]
