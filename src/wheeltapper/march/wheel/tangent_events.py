"""Tangents at the end of a step: at a loss, a landing, a breakpoint, a jump of the force."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import LENGTH, ON_DECK, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray
from wheeltapper.march.steps import tangent_path
from wheeltapper.march.steps.layout import U, W
from wheeltapper.march.steps.series import deck_acceleration, factor_at, localise
from wheeltapper.march.steps.tangent_path import DA, DB, DBREAK, DSHIFT, DT, DU, DW, DY, DZ, LANES, factor_tangent
from wheeltapper.march.wheel import dense
from wheeltapper.march.wheel.events import elastic_force
from wheeltapper.march.wheel.roots import NONE, evaluate, first_root

# The motion at a step's end, in its own variables.
AFTER, FIRST, SECOND, THIRD, FOURTH = range(5)
# The path on one of the pieces that meet at a joint.
(
    JOINT_AWAY, JOINT_X, JOINT_Y, JOINT_SLOPE, JOINT_BEND, JOINT_SINE, JOINT_COSINE, JOINT_PUSH,
) = range(8)  # fmt: skip
JOINT = 8


@uncounted_kernel
def parting(here: FloatArray, on_deck: bool) -> float:
    """Return the second derivative of the indentation of a motion by the time."""
    return float(here[dense.OUT_PATH_A] - here[dense.OUT_WHEEL_A] + (here[dense.OUT_DECK_A] if on_deck else 0.0))


@uncounted_kernel
def force_tangent(
    numbers: FloatArray, turns: FloatArray, lane: int, after: float, u: float, w: float, bend: float, d_u: float,
    d_w: float, d_t: float, moved: float, S: FloatArray, D: FloatArray,
) -> float:  # fmt: skip
    """Return the derivative of an elastic contact's force at a time that itself moves.

    Parameters
    ----------
    numbers, turns, lane
        The numbers of the program, their derivatives, and the direction.
    after
        The time after the start of the step whose piece of the path is in S and D.
    u, w, bend
        The motion, and the rate of w in time.
    d_u, d_w, d_t
        Derivatives of u, w and the time at fixed s.
    moved
        Derivative of the time at which the force is asked for; zero: it is fixed.
    """
    factor, rate = factor_at(after, S)
    eta, delay = numbers[contract.HYSTERESIS], moved - d_t
    law = u * u * (numbers[contract.QUADRATIC] + numbers[contract.CUBIC] * u)
    stiff = 2.0 * numbers[contract.QUADRATIC] + 3.0 * numbers[contract.CUBIC] * u
    # u·du is half the change of the indentation, so that u = 0 needs no division.
    change = factor * stiff * (u * d_u + 0.5 * w * delay) * (1.0 + eta * w)
    change += factor * law * (eta * (d_w + bend * delay) + turns[contract.HYSTERESIS, lane] * w)
    return float(change + (factor_tangent(after, lane, S, D) + rate * moved) * law * (1.0 + eta * w))


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
    rate = here[dense.OUT_PATH_V] - here[dense.OUT_WHEEL_V] + (here[dense.OUT_DECK_V] if on_deck else 0.0)
    bend = parting(here, on_deck)
    for lane in range(LANES):
        height, velocity = tangent_path.path_tangent(after, lane, S, D)
        gap = height - carried[DA, lane] + (carried[DY, lane] if on_deck else 0.0)
        sway = velocity - carried[DB, lane] + (carried[DZ, lane] if on_deck else 0.0)
        delay = -gap / rate
        carried[DT, lane] = delay
        carried[DA, lane] = 0.0
        carried[DB, lane] = sway + bend * delay
        carried[DY, lane] += here[dense.OUT_DECK_V] * delay
        carried[DZ, lane] += here[dense.OUT_DECK_A] * delay


@uncounted_kernel
def force_turns_on_or_off(
    numbers: FloatArray, turns: FloatArray, here: FloatArray, carried: FloatArray, on_deck: bool, after: float,
    of_event: FloatArray, S: FloatArray, D: FloatArray,
) -> float:  # fmt: skip
    """Write the derivatives of time and rate where Hunt-Crossley's force ends or begins while indented.

    There the rate is -1/η. `carried` are tangents at fixed time, `here` is the motion. Return how fast the rate
    passes that value.
    """
    bend = parting(here, on_deck)
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
        y = height + here[dense.OUT_PATH_V] * dt - 2.0 * end[FIRST] * carried[DA, lane]
        v = velocity + here[dense.OUT_PATH_A] * dt - carried[DB, lane]
        if on_deck:
            y += carried[DY, lane]
            v += carried[DZ, lane]
        carried[DU, lane] = carried[DA, lane]
        carried[DW, lane] = carried[DB, lane]
        carried[DA, lane] = y - here[dense.OUT_WHEEL_V] * dt
        carried[DB, lane] = v - here[dense.OUT_WHEEL_A] * dt
        carried[DY, lane] -= here[dense.OUT_DECK_V] * dt
        carried[DZ, lane] -= here[dense.OUT_DECK_A] * dt


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
    bend = parting(here, step[ON_DECK] != 0.0)
    return force_tangent(
        numbers, turns, lane, end[AFTER], end[FIRST], end[SECOND], bend, carried[DU, lane], carried[DW, lane],
        carried[DT, lane], carried[DBREAK, lane], S, D,
    )  # fmt: skip


@uncounted_kernel
def leapt_force(
    numbers: FloatArray, turns: FloatArray, step: FloatArray, carried: FloatArray, S: FloatArray, D: FloatArray,
    of_peak: FloatArray, here: FloatArray,
) -> None:  # fmt: skip
    """Write the derivative of a force that has jumped up at a breakpoint, along its motion, from the step behind it.

    `here` is scratch memory for a motion.
    """
    if step[PHASE] != contract.CONTACT or not step[A] > 0.0:
        of_peak[tangent_path.OF_SIZE, :] = np.nan
        return
    dense.fill_start(numbers, step, S, here)
    bend = parting(here, step[ON_DECK] != 0.0)
    for lane in range(LANES):
        of_peak[tangent_path.OF_SIZE, lane] = force_tangent(
            numbers, turns, lane, 0.0, step[A], step[B], bend, carried[DA, lane], carried[DB, lane], 0.0,
            carried[DBREAK, lane], S, D,
        )  # fmt: skip


@uncounted_kernel
def force_jump(
    pieces: FloatArray, numbers: FloatArray, after: FloatArray, here: FloatArray,
    carried: FloatArray, S: FloatArray, there: FloatArray,
) -> None:  # fmt: skip
    """Add the effect of a jump of the force at a breakpoint on the velocities at fixed time.

    `here` is the motion before it; `there` is scratch memory for the one behind it.
    """
    localise(pieces, numbers, int(after[PIECE]), after[SHIFT], after[TIME], S)
    dense.fill_start(numbers, after, S, there)
    force, pull = there[dense.OUT_FORCE], there[dense.OUT_DECK_A]
    leap = here[dense.OUT_FORCE] - force
    if abs(leap) <= 1e-11 * (1.0 + abs(force)):
        leap = 0.0
    deck_leap = here[dense.OUT_DECK_A] - pull
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
    quadratic, cubic, eta = numbers[contract.QUADRATIC], numbers[contract.CUBIC], numbers[contract.HYSTERESIS]
    here[JOINT_PUSH] = elastic_force(factor, quadratic, cubic, eta, u, w)


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
