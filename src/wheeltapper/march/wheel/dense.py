"""The motion at any time of a march, and the integrals of its energy.

A march keeps the state at the start of each step. Here the series of a step is computed once more from that state, and
evaluated at the times asked for: to the accuracy of the march itself. The energy's integrals over a step are Gauss
sums over the same series; they converge fast, because the motion is analytic in the step's own variable.

`steps` are the rows of a march. Quantities of the motion are written to the columns OUT_WHEEL_Y and on, those of a
damper's own end to the columns behind them. `law` is None where the contact does not yield.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import kernel, uncounted_kernel
from wheeltapper.march.common.program import DECK_V, DECK_Y, LENGTH, ON_DECK, PHASE, TIME, A, B, FloatArray
from wheeltapper.march.steps import series
from wheeltapper.march.steps.held_end import damper_ends, held_coefficients
from wheeltapper.march.steps.layout import BUSH, FLIGHT_ORDER, PUSH, N, T, U, W, Y, Z
from wheeltapper.march.wheel.events import force as contact_force
from wheeltapper.march.wheel.events import is_contact_phase
from wheeltapper.march.wheel.roots import evaluate
from wheeltapper.march.wheel.step import push, repeat_step, time_to

# Columns of the dense output.
(
    OUT_WHEEL_Y, OUT_WHEEL_V, OUT_WHEEL_A, OUT_FORCE, OUT_DELTA, OUT_DELTA_V, OUT_PATH_Y, OUT_PATH_V, OUT_PATH_A,
    OUT_DECK_Y, OUT_DECK_V, OUT_DECK_A, OUT_RESIDUAL,
) = range(13)  # fmt: skip
OUT_COLUMNS = 13
# Columns that follow where the damper has an end of its own: its displacement, and the damper's force on the wheel.
OUT_END_Y, OUT_DAMPER_FORCE = range(OUT_COLUMNS, OUT_COLUMNS + 2)
ENDED_OUT_COLUMNS = OUT_COLUMNS + 2
# Columns of the energy's integrals over a step.
WORK_PATH, WORK_FACTOR, LOST_SUSPENSION, LOST_DECK, LOST_CONTACT, IMPULSE, CONTACT_TIME = range(7)
INTEGRALS = 7
BEGINS, FINISHES = range(2)
"""A step's start and end."""


@uncounted_kernel
def prepare_step(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, step: FloatArray,
    S: FloatArray,
) -> bool:  # fmt: skip
    """Compute the series of a step; return True for one in s."""
    series.enter_piece(pieces, numbers, law, step, S)
    repeat_step(pieces, numbers, step, S)
    return is_contact_phase(step[PHASE])


@uncounted_kernel
def fill_motion(
    numbers: FloatArray, step: FloatArray, after: float, first: float, second: float, deck_y: float, deck_v: float,
    S: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Write all quantities of a motion `after` the start of the step whose piece of the path is in S.

    `first` and `second` are u and w in contact, else displacement and velocity of the wheel.
    """
    on_deck = step[ON_DECK] != 0.0
    height, velocity, bend = series.path_at(after, S)
    lift = deck_y if on_deck else 0.0
    lift_v = deck_v if on_deck else 0.0
    force = 0.0
    if is_contact_phase(step[PHASE]):
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
        if step[PHASE] == contract.BONDED:
            factor, _ = series.factor_at(after, S)
            force = factor * delta
    out[OUT_WHEEL_Y] = y
    out[OUT_WHEEL_V] = v
    out[OUT_WHEEL_A] = -1.0 - numbers[contract.STIFFNESS] * y - numbers[contract.DAMPING] * v + force
    out[OUT_FORCE] = force
    out[OUT_DELTA] = delta
    out[OUT_DELTA_V] = rate
    out[OUT_PATH_Y] = height
    out[OUT_PATH_V] = velocity
    out[OUT_PATH_A] = bend
    out[OUT_DECK_Y] = deck_y
    out[OUT_DECK_V] = deck_v
    out[OUT_RESIDUAL] = series.residual_at(after, S)
    out[OUT_DECK_A] = series.deck_acceleration(numbers, deck_y, deck_v, on_deck, force)


@uncounted_kernel
def fill_start(numbers: FloatArray, state: FloatArray, S: FloatArray, out: FloatArray) -> None:
    """Write all quantities of a state whose piece of the path is in S."""
    fill_motion(numbers, state, 0.0, state[A], state[B], state[DECK_Y], state[DECK_V], S, out)


@uncounted_kernel
def fill_row(
    numbers: FloatArray, step: FloatArray, x: float, S: FloatArray, out: FloatArray
) -> float:  # fmt: skip
    """Write all quantities at x of the prepared step's own variable; return the time after the step's start."""
    contact = is_contact_phase(step[PHASE])
    deck = numbers[contract.DECK_MASS] > 0.0
    order = int(numbers[contract.ORDER]) if contact else FLIGHT_ORDER
    after = evaluate(S, T, order, x) if contact else x
    deck_y = evaluate(S, Y, order, x) if deck else 0.0
    deck_v = evaluate(S, Z, order, x) if deck else 0.0
    first, second = evaluate(S, U, order, x), evaluate(S, W, order, x)
    fill_motion(numbers, step, after, first, second, deck_y, deck_v, S, out)
    if damper_ends(numbers):
        _fill_end(numbers, step, order, x, S, out)
    return after


@uncounted_kernel
def _fill_end(numbers: FloatArray, step: FloatArray, order: int, x: float, S: FloatArray, out: FloatArray) -> None:
    """Write what the damper's end does, and what its force does to the wheel."""
    mode = step[contract.END_MODE]
    if mode == contract.FREE:
        out[OUT_END_Y] = step[contract.END_PLACE]
        out[OUT_DAMPER_FORCE] = 0.0
        return
    G, soft, _ = held_coefficients(mode, numbers)
    deflection = evaluate(S, BUSH, order, x) if soft > 0.0 else 0.0
    out[OUT_END_Y] = out[OUT_WHEEL_Y] - deflection - mode * numbers[contract.DAMPER_PLAY]
    out[OUT_DAMPER_FORCE] = -G * out[OUT_WHEEL_V] - soft * deflection
    out[OUT_WHEEL_A] += out[OUT_DAMPER_FORCE]


@uncounted_kernel
def _place_at_time(order: int, x: float, s_max: float, time: float, S: FloatArray) -> float:
    """Return s in (0, s_max] with t(s) = time, from a guess."""
    for _ in range(8):
        u = evaluate(S, U, order, x)
        new = x - (evaluate(S, T, order, x) - time) / u if u > 0.0 else 0.0
        if not 0.0 < new <= s_max:
            break
        if abs(new - x) <= 1e-15 * new:
            return new
        x = new
    return time_to(S, order, s_max, time)


@uncounted_kernel
def dense(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, steps: FloatArray,
    times: FloatArray, out: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Write all quantities at the given rising times (scaled) into the rows of `out`."""
    order = int(numbers[contract.ORDER])
    present = -1
    row = 0
    whole = 0.0
    x = 0.0
    for i in range(len(times)):
        while row + 1 < len(steps) and steps[row + 1, TIME] <= times[i]:
            row += 1
        step = steps[row]
        contact = is_contact_phase(step[PHASE])
        if row != present:
            prepare_step(pieces, numbers, law, step, S)
            whole = evaluate(S, T, order, step[LENGTH]) if contact else step[LENGTH]
            present = row
            x = 0.5 * step[LENGTH]
        after = max(times[i] - step[TIME], 0.0)
        if not contact:
            x = min(after, step[LENGTH])
        elif after >= whole:
            x = step[LENGTH]
        else:
            x = _place_at_time(order, x, step[LENGTH], after, S) if after > 0.0 else 0.0
        fill_row(numbers, step, x, S, out[i])


@uncounted_kernel
def impulse(pieces: FloatArray, numbers: FloatArray, step: FloatArray, S: FloatArray) -> float:
    """Return the integral of the contact force over the time of the prepared step: ∫ N·u ds, or ∫ N dt."""
    contact = is_contact_phase(step[PHASE])
    if not contact and step[PHASE] != contract.BONDED:
        return 0.0
    row, last = N, FLIGHT_ORDER
    if contact:
        row, last = PUSH, int(numbers[contract.ORDER]) - 1
        push(pieces, numbers, S)
    total = 0.0
    for n in range(last, -1, -1):
        total = total * step[LENGTH] + S[row + n] / (n + 1)
    return total * step[LENGTH]


@kernel
def integrals(
    pieces: FloatArray, numbers: FloatArray, law: FloatArray | None, steps: FloatArray,
    nodes: FloatArray, weights: FloatArray, out: FloatArray, ends: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Write each step's integrals into `out`, and the quantities at its two ends into ends[step, 0 or 1].

    Where the contact yields, LOST_CONTACT is all work of the contact force; what of it is stored is not yet taken off.
    """
    point = np.zeros(ends.shape[2])
    order = int(numbers[contract.ORDER])
    for i in range(len(steps)):
        step = steps[i]
        contact = prepare_step(pieces, numbers, law, step, S)
        fill_row(numbers, step, 0.0, S, ends[i, BEGINS])
        fill_row(numbers, step, step[LENGTH], S, ends[i, FINISHES])
        total = out[i]
        total[:] = 0.0
        total[IMPULSE] = impulse(pieces, numbers, step, S)
        for j in range(len(nodes)):
            x = nodes[j] * step[LENGTH]
            after = fill_row(numbers, step, x, S, point)
            weight = weights[j] * step[LENGTH]
            if contact:
                weight *= evaluate(S, U, order, x)
            lost = numbers[contract.DAMPING] * point[OUT_WHEEL_V] ** 2
            if damper_ends(numbers):
                lost += point[OUT_DAMPER_FORCE] ** 2 / numbers[contract.DAMPER_DAMPING]
            total[LOST_SUSPENSION] += weight * lost
            total[LOST_DECK] += weight * numbers[contract.DECK_DAMPING] * point[OUT_DECK_V] ** 2
            total[WORK_PATH] += weight * point[OUT_FORCE] * point[OUT_PATH_V]
            if contact:
                total[CONTACT_TIME] += weight
            if step[PHASE] >= contract.YIELDING:
                total[LOST_CONTACT] += weight * point[OUT_FORCE] * point[OUT_DELTA_V]
            elif contact:
                factor, rate = series.factor_at(after, S)
                delta = point[OUT_DELTA]
                stored = numbers[contract.QUADRATIC] * delta**2 / 2.0 + numbers[contract.CUBIC] * delta**2.5 / 2.5
                total[WORK_FACTOR] += weight * rate * stored
                elastic = factor * delta * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * np.sqrt(delta))
                total[LOST_CONTACT] += weight * (point[OUT_FORCE] - elastic) * point[OUT_DELTA_V]
