"""Tangents at the end of a step: at a loss, a landing, a breakpoint, a jump of the force."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march import tangent_path
from wheeltapper.march.kernel import kernel
from wheeltapper.march.layout import U, W
from wheeltapper.march.program import DECK_V, DECK_Y, LENGTH, ON_DECK, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray
from wheeltapper.march.roots import NONE, evaluate, first_root
from wheeltapper.march.series import deck_acceleration, factor_at, localise, path_at
from wheeltapper.march.tangent_path import DA, DB, DBREAK, DSHIFT, DT, DU, DW, DY, DZ, LANES, factor_tangent

# The motion at a step's end, in its own variables.
AFTER, FIRST, SECOND, THIRD, FOURTH = range(5)
# The same as displacements, velocities and accelerations, and the contact force.
(
    PATH_HEIGHT, PATH_VELOCITY, PATH_BEND, WHEEL_HEIGHT, WHEEL_VELOCITY, WHEEL_BEND, DECK_HEIGHT, DECK_VELOCITY,
    DECK_BEND, PUSH,
) = range(10)  # fmt: skip


@kernel
def motion_at_end(numbers: FloatArray, step: FloatArray, end: FloatArray, S: FloatArray, here: FloatArray) -> None:
    """Write the motion at the end of a step, localised in S, from PATH_HEIGHT to PUSH."""
    on_deck = step[ON_DECK] != 0.0
    height, velocity, bend = path_at(end[AFTER], S)
    factor, _ = factor_at(end[AFTER], S)
    lift = end[THIRD] if on_deck else 0.0
    lift_rate = end[FOURTH] if on_deck else 0.0
    y = end[FIRST]
    v = end[SECOND]
    force = 0.0
    if step[PHASE] == contract.CONTACT:
        u = end[FIRST]
        y = height + lift - u * u
        v = velocity + lift_rate - end[SECOND]
        law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
        force = max(factor * law * (1.0 + numbers[contract.HYSTERESIS] * end[SECOND]), 0.0)
    elif step[PHASE] == contract.BONDED:
        force = factor * (height + lift - y)
    here[PATH_HEIGHT] = height
    here[PATH_VELOCITY] = velocity
    here[PATH_BEND] = bend
    here[WHEEL_HEIGHT] = y
    here[WHEEL_VELOCITY] = v
    here[WHEEL_BEND] = -1.0 - numbers[contract.STIFFNESS] * y - numbers[contract.DAMPING] * v + force
    here[DECK_HEIGHT] = end[THIRD]
    here[DECK_VELOCITY] = end[FOURTH]
    here[DECK_BEND] = deck_acceleration(numbers, end[THIRD], end[FOURTH], on_deck, force)
    here[PUSH] = force


@kernel
def enter_contact(step: FloatArray, carried: FloatArray, S: FloatArray, D: FloatArray) -> bool:
    """Convert tangents at fixed time to those of a contact step that starts here; return False if it grazes.

    In that case the regularised variables have no tangents, and none are computed any more.
    """
    u = step[A]
    on_deck = step[ON_DECK] != 0.0
    for lane in range(LANES):
        height, velocity = tangent_path.path_tangent(0.0, lane, S, D)
        delta = height - carried[DA, lane] + (carried[DY, lane] if on_deck else 0.0)
        carried[DB, lane] = velocity - carried[DB, lane] + (carried[DZ, lane] if on_deck else 0.0)
        carried[DT, lane] = 0.0
        carried[DA, lane] = delta / (2.0 * u) if u > 1e-7 else np.nan
    return u > 1e-7


@kernel
def land_tangents(
    here: FloatArray, carried: FloatArray, on_deck: bool, after: float, S: FloatArray, D: FloatArray
) -> None:
    """Turn tangents at fixed time, before a landing, into those along it; `here` is the motion there."""
    rate = here[PATH_VELOCITY] - here[WHEEL_VELOCITY] + (here[DECK_VELOCITY] if on_deck else 0.0)
    bend = here[PATH_BEND] - here[WHEEL_BEND] + (here[DECK_BEND] if on_deck else 0.0)
    for lane in range(LANES):
        height, velocity = tangent_path.path_tangent(after, lane, S, D)
        gap = height - carried[DA, lane] + (carried[DY, lane] if on_deck else 0.0)
        sway = velocity - carried[DB, lane] + (carried[DZ, lane] if on_deck else 0.0)
        delay = -gap / rate
        carried[DT, lane] = delay
        carried[DA, lane] = 0.0
        carried[DB, lane] = sway + bend * delay
        carried[DY, lane] += here[DECK_VELOCITY] * delay
        carried[DZ, lane] += here[DECK_BEND] * delay


@kernel
def force_turns_on_or_off(
    numbers: FloatArray, turns: FloatArray, here: FloatArray, carried: FloatArray, on_deck: bool, after: float,
    of_event: FloatArray, S: FloatArray, D: FloatArray,
) -> float:  # fmt: skip
    """Write the derivatives of time and rate where Hunt-Crossley's force ends or begins while indented.

    There the rate is -1/η. `carried` are tangents at fixed time, `here` is the motion. Return how fast the rate
    passes that value.
    """
    bend = here[PATH_BEND] - here[WHEEL_BEND] + (here[DECK_BEND] if on_deck else 0.0)
    for lane in range(LANES):
        _, velocity = tangent_path.path_tangent(after, lane, S, D)
        sway = velocity - carried[DB, lane] + (carried[DZ, lane] if on_deck else 0.0)
        moved = turns[contract.HYSTERESIS, lane] / numbers[contract.HYSTERESIS] ** 2
        of_event[tangent_path.OF_TIME, lane] = (moved - sway) / bend
        of_event[tangent_path.OF_SIZE, lane] = moved
    return abs(bend)


@kernel
def closest_approach(step: FloatArray, order: int, u: float, w: float, S: FloatArray) -> float:
    """Return how near a contact step comes to grazing, u = w = 0, if it turns there: the smallest u in it; else 1.

    u and w are those at its end, its series stand in S.
    """
    if not step[B] < 0.0 < w:
        return 1.0
    root, _ = first_root(S, W, order, 0.0, step[LENGTH], 1.0, 0.0)
    return min(step[A], u) if root == NONE else evaluate(S, U, order, root)


@kernel
def leave_contact(
    here: FloatArray, end: FloatArray, on_deck: bool, carried: FloatArray, S: FloatArray, D: FloatArray
) -> None:
    """Turn the tangents at the end of a contact step, at fixed s, into those at fixed time."""
    for lane in range(LANES):
        dt = carried[DT, lane]
        height, velocity = tangent_path.path_tangent(end[AFTER], lane, S, D)
        y = height + here[PATH_VELOCITY] * dt - 2.0 * end[FIRST] * carried[DA, lane]
        v = velocity + here[PATH_BEND] * dt - carried[DB, lane]
        if on_deck:
            y += carried[DY, lane]
            v += carried[DZ, lane]
        carried[DU, lane] = carried[DA, lane]
        carried[DW, lane] = carried[DB, lane]
        carried[DA, lane] = y - here[WHEEL_VELOCITY] * dt
        carried[DB, lane] = v - here[WHEEL_BEND] * dt
        carried[DY, lane] -= here[DECK_VELOCITY] * dt
        carried[DZ, lane] -= here[DECK_BEND] * dt


@kernel
def break_moves(
    bends: FloatArray, base: int, table: contract.IntArray, numbers: FloatArray, turns: FloatArray, step: FloatArray,
    after: FloatArray, carried: FloatArray,
) -> None:  # fmt: skip
    """Write the derivatives of the time of the breakpoint between two steps, and of the table's shift."""
    pace = numbers[contract.PACE]
    piece = int(step[PIECE])
    for lane in range(LANES):
        carried[DBREAK, lane] = 0.0
        bent = table[lane] >= 0
        if after[PIECE] != step[PIECE] or after[SHIFT] != step[SHIFT]:
            moved = carried[DSHIFT, lane] - turns[contract.PACE, lane] * after[TIME]
            if bent:
                moved += bends[table[lane], base + piece, contract.STOP]
            carried[DBREAK, lane] = moved / pace
            if after[SHIFT] != step[SHIFT] and bent:
                loop = int(after[PIECE])
                carried[DSHIFT, lane] += (
                    bends[table[lane], base + piece, contract.STOP] - bends[table[lane], base + loop, contract.START]
                )
        elif after[ON_DECK] != step[ON_DECK]:
            which = contract.DECK_FROM if after[ON_DECK] != 0.0 else contract.DECK_TO
            carried[DBREAK, lane] = turns[which, lane]


@kernel
def corner_force(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, end: FloatArray, here: FloatArray,
    carried: FloatArray, lane: int, S: FloatArray, D: FloatArray,
) -> float:  # fmt: skip
    """Return the derivative of the force at a breakpoint, along its motion; NaN where no contact was before it."""
    if step[PHASE] != contract.CONTACT:
        return np.nan
    after, u, w = end[AFTER], end[FIRST], end[SECOND]
    factor, rate = factor_at(after, S)
    eta = numbers[contract.HYSTERESIS]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    stiff = 2.0 * numbers[contract.QUADRATIC] + 3.0 * numbers[contract.CUBIC] * u
    dt = carried[DBREAK, lane] - carried[DT, lane]
    bend = here[PATH_BEND] - here[WHEEL_BEND] + (here[DECK_BEND] if step[ON_DECK] != 0.0 else 0.0)
    # From fixed s along the breakpoint: u·du is half the change of the indentation, so that u = 0 needs no division.
    half = u * carried[DU, lane] + 0.5 * w * dt
    change = factor * stiff * half * (1.0 + eta * w)
    change += factor * law * (eta * (carried[DW, lane] + bend * dt) + turns[contract.HYSTERESIS, lane] * w)
    change += (factor_tangent(after, lane, S, D) + rate * carried[DBREAK, lane]) * law * (1.0 + eta * w)
    return change


@kernel
def leapt_force(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, carried: FloatArray, S: FloatArray, D: FloatArray,
    of_peak: FloatArray,
) -> None:  # fmt: skip
    """Write the derivative of a force that has jumped up at a breakpoint, along its motion, from the step behind it."""
    u, w = step[A], step[B]
    if step[PHASE] != contract.CONTACT or not u > 0.0:
        of_peak[tangent_path.OF_SIZE, :] = np.nan
        return
    on_deck = step[ON_DECK] != 0.0
    height, velocity, bend = path_at(0.0, S)
    factor, rate = factor_at(0.0, S)
    eta = numbers[contract.HYSTERESIS]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    stiff = 2.0 * numbers[contract.QUADRATIC] + 3.0 * numbers[contract.CUBIC] * u
    grip = 1.0 + eta * w
    y = height - u * u
    v = velocity - w
    if on_deck:
        y += step[DECK_Y]
        v += step[DECK_V]
        pull = numbers[contract.PRESTRESS] - factor * law * grip
        pull -= numbers[contract.DECK_STIFFNESS] * step[DECK_Y] + numbers[contract.DECK_DAMPING] * step[DECK_V]
        bend += pull / numbers[contract.DECK_MASS]
    bend += 1.0 + numbers[contract.STIFFNESS] * y + numbers[contract.DAMPING] * v - factor * law * grip
    for lane in range(LANES):
        dt = carried[DBREAK, lane]
        change = factor * stiff * (u * carried[DA, lane] + 0.5 * w * dt) * grip
        change += factor * law * (eta * (carried[DB, lane] + bend * dt) + turns[contract.HYSTERESIS, lane] * w)
        of_peak[tangent_path.OF_SIZE, lane] = change + (factor_tangent(0.0, lane, S, D) + rate * dt) * law * grip


@kernel
def force_jump(
    pieces: FloatArray, numbers: FloatArray, after: FloatArray, here: FloatArray,
    carried: FloatArray, S: FloatArray,
) -> None:  # fmt: skip
    """Add the effect of a jump of the force at a breakpoint on the velocities at fixed time."""
    localise(pieces, numbers, int(after[PIECE]), after[SHIFT], after[TIME], S)
    factor, _ = factor_at(0.0, S)
    on_deck = after[ON_DECK] != 0.0
    force = 0.0
    if after[PHASE] == contract.CONTACT:
        law = after[A] * after[A] * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * after[A])
        force = max(factor * law * (1.0 + numbers[contract.HYSTERESIS] * after[B]), 0.0)
    elif after[PHASE] == contract.BONDED:
        height, _, _ = path_at(0.0, S)
        force = factor * (height + (after[DECK_Y] if on_deck else 0.0) - after[A])
    pull = deck_acceleration(numbers, here[DECK_HEIGHT], here[DECK_VELOCITY], on_deck, force)
    leap = here[PUSH] - force
    if abs(leap) <= 1e-11 * (1.0 + abs(force)):
        leap = 0.0
    deck_leap = here[DECK_BEND] - pull
    if abs(deck_leap) <= 1e-11 * (1.0 + abs(pull)):
        deck_leap = 0.0
    for lane in range(LANES):
        carried[DB, lane] += leap * carried[DBREAK, lane]
        carried[DZ, lane] += deck_leap * carried[DBREAK, lane]


@kernel
def _bend_and_push(
    pieces: FloatArray, numbers: FloatArray, step: FloatArray, time: float, u: float, w: float
) -> tuple[float, float]:
    """Return the acceleration of the path under a wheel, and the contact force, on the piece of a step at a time."""
    row = pieces[int(step[PIECE])]
    pace = numbers[contract.PACE]
    away = pace * time - step[SHIFT] - row[contract.CENTRE]
    rate = pace / row[contract.SCALE]
    x = away / row[contract.SCALE]
    bend = 0.0
    for k in range(int(row[contract.DEGREE]), 1, -1):
        bend = bend * x + k * (k - 1) * row[contract.COEFFICIENT + k]
    bend *= rate * rate
    omega = row[contract.WAVENUMBER] * pace
    if omega != 0.0:
        phase = row[contract.WAVENUMBER] * away
        bend -= omega * omega * (row[contract.SINE] * np.sin(phase) + row[contract.COSINE] * np.cos(phase))
    factor = 1.0
    if row[contract.FACTOR_DEGREE] >= 0.0:
        factor = 0.0
        for k in range(int(row[contract.FACTOR_DEGREE]), -1, -1):
            factor = factor * x + row[contract.FACTOR + k]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    return numbers[contract.LIFT] * bend, max(factor * law * (1.0 + numbers[contract.HYSTERESIS] * w), 0.0)


@kernel
def cross_in_contact(
    pieces: FloatArray, numbers: FloatArray, step: FloatArray, after: FloatArray, end: FloatArray, carried: FloatArray
) -> None:
    """Take tangents at fixed s over a smooth joint of two pieces, where only accelerations jump.

    The changed motion reaches the joint DBREAK - DT later than `s` says; until then the rates before it hold.
    """
    u, w = end[FIRST], end[SECOND]
    bend, push = _bend_and_push(pieces, numbers, step, after[TIME], u, w)
    bend_behind, push_behind = _bend_and_push(pieces, numbers, after, after[TIME], u, w)
    leap, lighter = bend - bend_behind, push - push_behind
    leap -= lighter
    deck_leap = 0.0
    if step[ON_DECK] != 0.0:
        deck_leap = -lighter / numbers[contract.DECK_MASS]
        leap += deck_leap
    for lane in range(LANES):
        delay = carried[DBREAK, lane] - carried[DT, lane]
        carried[DB, lane] += leap * delay
        carried[DZ, lane] += deck_leap * delay
