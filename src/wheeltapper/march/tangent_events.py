"""Tangents at the end of a step: at a loss, a landing, a breakpoint, a jump of the force."""

from __future__ import annotations

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march import tangent_path
from wheeltapper.march.kernel import uncounted_kernel
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

# The path on one of the pieces that meet at a joint.
(
    JOINT_AWAY, JOINT_X, JOINT_Y, JOINT_SLOPE, JOINT_BEND, JOINT_SINE, JOINT_COSINE, JOINT_PUSH,
) = range(8)  # fmt: skip
JOINT = 8


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
def closest_approach(step: FloatArray, order: int, u: float, w: float, S: FloatArray) -> float:
    """Return how near a contact step comes to grazing, u = w = 0, if it turns there: the smallest u in it; else 1.

    u and w are those at its end, its series stand in S.
    """
    if not step[B] < 0.0 < w:
        return 1.0
    root, _ = first_root(S, W, order, 0.0, step[LENGTH], 1.0, 0.0)
    return min(step[A], u) if root == NONE else evaluate(S, U, order, root)


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
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


@uncounted_kernel
def _fill_joint(
    pieces: FloatArray, numbers: FloatArray, step: FloatArray, time: float, u: float, w: float, here: FloatArray
) -> None:  # fmt: skip
    """Write what a piece of the path is at a joint: place, polynomial with derivatives, harmonic, force."""
    row = pieces[int(step[PIECE])]
    away = numbers[contract.PACE] * time - step[SHIFT] - row[contract.CENTRE]
    x = away / row[contract.SCALE]
    y, slope, bend = 0.0, 0.0, 0.0
    for k in range(int(row[contract.DEGREE]), -1, -1):
        bend = bend * x + 2.0 * slope
        slope = slope * x + y
        y = y * x + row[contract.COEFFICIENT + k]
    factor = 1.0
    if row[contract.FACTOR_DEGREE] >= 0.0:
        factor = 0.0
        for k in range(int(row[contract.FACTOR_DEGREE]), -1, -1):
            factor = factor * x + row[contract.FACTOR + k]
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    here[JOINT_AWAY] = away
    here[JOINT_X] = x
    here[JOINT_Y] = y
    here[JOINT_SLOPE] = slope
    here[JOINT_BEND] = bend
    here[JOINT_SINE] = 0.0
    here[JOINT_COSINE] = 1.0
    if row[contract.WAVENUMBER] != 0.0:
        here[JOINT_SINE] = np.sin(row[contract.WAVENUMBER] * away)
        here[JOINT_COSINE] = np.cos(row[contract.WAVENUMBER] * away)
    here[JOINT_PUSH] = max(factor * law * (1.0 + numbers[contract.HYSTERESIS] * w), 0.0)


@uncounted_kernel
def _acceleration_there(pieces: FloatArray, numbers: FloatArray, step: FloatArray, here: FloatArray) -> float:
    """Return the acceleration of the path under a wheel at a joint."""
    row = pieces[int(step[PIECE])]
    rate = numbers[contract.PACE] / row[contract.SCALE]
    omega = row[contract.WAVENUMBER] * numbers[contract.PACE]
    wave = row[contract.SINE] * here[JOINT_SINE] + row[contract.COSINE] * here[JOINT_COSINE]
    return numbers[contract.LIFT] * (here[JOINT_BEND] * rate * rate - omega * omega * wave)


@uncounted_kernel
def _path_there(
    pieces: FloatArray, numbers: FloatArray, step: FloatArray, here: FloatArray
) -> tuple[float, float]:  # fmt: skip
    """Return the path's height and velocity at a joint."""
    row = pieces[int(step[PIECE])]
    omega = row[contract.WAVENUMBER] * numbers[contract.PACE]
    height = here[JOINT_Y] + row[contract.SINE] * here[JOINT_SINE] + row[contract.COSINE] * here[JOINT_COSINE]
    velocity = here[JOINT_SLOPE] * numbers[contract.PACE] / row[contract.SCALE]
    velocity += omega * (row[contract.SINE] * here[JOINT_COSINE] - row[contract.COSINE] * here[JOINT_SINE])
    return numbers[contract.LIFT] * height, numbers[contract.LIFT] * velocity


@uncounted_kernel
def _path_change(
    pieces: FloatArray, bends: FloatArray, base: int, table: contract.IntArray, numbers: FloatArray, turns: FloatArray,
    step: FloatArray, time: float, lane: int, shift: float, here: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Return the derivatives, at fixed time, of the path's height and velocity at a joint, on one of its pieces."""
    piece = int(step[PIECE])
    row = pieces[piece]
    pace, lift, wavenumber = numbers[contract.PACE], numbers[contract.LIFT], row[contract.WAVENUMBER]
    d_pace, d_lift = turns[contract.PACE, lane], turns[contract.LIFT, lane]
    rate, d_rate = pace / row[contract.SCALE], d_pace / row[contract.SCALE]
    d_away = d_pace * time - shift
    d_wavenumber, d_sine, d_cosine, moved, moved_slope = 0.0, 0.0, 0.0, 0.0, 0.0
    if table[lane] >= 0:
        bend = bends[table[lane], base + piece]
        d_away -= bend[contract.CENTRE]
        d_wavenumber = bend[contract.WAVENUMBER]
        d_sine, d_cosine = bend[contract.SINE] * lift, bend[contract.COSINE] * lift
        for k in range(int(row[contract.DEGREE]), -1, -1):
            moved_slope = moved_slope * here[JOINT_X] + moved
            moved = moved * here[JOINT_X] + bend[contract.COEFFICIENT + k]
    d_x = d_away / row[contract.SCALE]
    height = d_lift * here[JOINT_Y] + lift * (here[JOINT_SLOPE] * d_x + moved)
    velocity = d_lift * here[JOINT_SLOPE] * rate
    velocity += lift * ((here[JOINT_BEND] * d_x + moved_slope) * rate + here[JOINT_SLOPE] * d_rate)
    if wavenumber != 0.0:
        d_sine += row[contract.SINE] * d_lift
        d_cosine += row[contract.COSINE] * d_lift
        s, c = here[JOINT_SINE], here[JOINT_COSINE]
        omega, d_omega = wavenumber * pace, d_wavenumber * pace + wavenumber * d_pace
        d_phase = d_wavenumber * here[JOINT_AWAY] + wavenumber * d_away
        across = lift * (row[contract.SINE] * c - row[contract.COSINE] * s)
        height += d_sine * s + d_cosine * c + across * d_phase
        velocity += d_omega * across + omega * (d_sine * c - d_cosine * s)
        velocity -= omega * lift * (row[contract.SINE] * s + row[contract.COSINE] * c) * d_phase
    return height, velocity


@uncounted_kernel
def cross_in_contact(
    pieces: FloatArray, bends: FloatArray, base: int, table: contract.IntArray, numbers: FloatArray, turns: FloatArray,
    step: FloatArray, after: FloatArray, end: FloatArray, carried: FloatArray, directions: contract.IntArray,
    before: FloatArray, behind: FloatArray,
) -> None:  # fmt: skip
    """Take tangents at fixed s over a smooth joint of two pieces, where only accelerations jump.

    The changed motion reaches the joint DBREAK - DT later than `s` says; until then the rates before it hold. At fixed
    time the wheel keeps displacement and velocity. The tangents of two pieces of the path differ by what the joint
    moves, and by what their fits leave. Behind the joint s counts so that DT is zero there.
    """
    u, w, time = end[FIRST], end[SECOND], after[TIME]
    _fill_joint(pieces, numbers, step, time, u, w, before)
    _fill_joint(pieces, numbers, after, time, u, w, behind)
    for k in range(len(directions)):
        lane = directions[k]
        height, velocity = _path_change(
            pieces, bends, base, table, numbers, turns, step, time, lane, carried[DSHIFT, lane], before
        )
        carried[DU, lane], carried[DW, lane] = height, velocity
    break_moves(bends, base, table, numbers, turns, step, after, carried)
    for k in range(len(directions)):
        lane = directions[k]
        height, velocity = _path_change(
            pieces, bends, base, table, numbers, turns, after, time, lane, carried[DSHIFT, lane], behind
        )
        carried[DA, lane] += (height - carried[DU, lane]) / (2.0 * u)
        carried[DB, lane] += velocity - carried[DW, lane]
    on_deck = step[ON_DECK] != 0.0
    leap = _acceleration_there(pieces, numbers, step, before)
    bend = _acceleration_there(pieces, numbers, after, behind)
    leap -= bend
    lighter = before[JOINT_PUSH] - behind[JOINT_PUSH]
    deck_leap = -lighter / numbers[contract.DECK_MASS] if on_deck else 0.0
    y, v = _path_there(pieces, numbers, after, behind)
    y -= u * u
    v -= w
    deck_bend = deck_acceleration(numbers, end[THIRD], end[FOURTH], on_deck, behind[JOINT_PUSH])
    if on_deck:
        y += end[THIRD]
        v += end[FOURTH]
        bend += deck_bend
    bend += 1.0 + numbers[contract.STIFFNESS] * y + numbers[contract.DAMPING] * v - behind[JOINT_PUSH]
    for lane in range(LANES):
        dt = carried[DT, lane]
        delay = carried[DBREAK, lane] - dt
        carried[DA, lane] -= 0.5 * w / u * dt
        carried[DB, lane] += (deck_leap - lighter) * delay - (leap + bend) * dt
        carried[DY, lane] -= end[FOURTH] * dt
        carried[DZ, lane] += deck_leap * delay - deck_bend * dt
        carried[DT, lane] = 0.0
