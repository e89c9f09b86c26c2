"""Tangents at the end of a step: at a loss, a landing, a breakpoint, a jump of the force."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import LENGTH, ON_DECK, PHASE, PIECE, SHIFT, TIME, A, B, FloatArray
from wheeltapper.march.steps import layout, tangent_path
from wheeltapper.march.steps.calling import call_turned
from wheeltapper.march.steps.layout import U, W
from wheeltapper.march.steps.series import deck_acceleration, factor_at, localise
from wheeltapper.march.steps.tangent_path import DA, DB, DBREAK, DSHIFT, DT, DU, DW, DY, DZ, LANES, factor_tangent
from wheeltapper.march.steps.variants import TURN_JOINT
from wheeltapper.march.wheel import dense
from wheeltapper.march.wheel.events import elastic_force
from wheeltapper.march.wheel.roots import NONE, evaluate, first_root

# The motion at a step's end, in its own variables.
AFTER, FIRST, SECOND, THIRD, FOURTH = range(5)


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
def _meet_joint(
    pieces: FloatArray, bends: FloatArray, base: int, table: contract.IntArray, numbers: FloatArray, state: FloatArray,
    time: float, u: float, w: float, S: FloatArray, D: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Find the path at a joint on one of its pieces: return its acceleration and the force.

    Height and velocity stand at JOINT_HEIGHT and JOINT_VELOCITY of S, their changes of D.
    """
    tangent_path.show_piece(pieces, bends, base, table, state, time, S, D)
    call_turned(S[layout.DERIVATIVES + TURN_JOINT], numbers, S, D)
    quadratic, cubic, eta = numbers[contract.QUADRATIC], numbers[contract.CUBIC], numbers[contract.HYSTERESIS]
    return S[layout.JOINT_ACCELERATION], elastic_force(S[layout.JOINT_FACTOR], quadratic, cubic, eta, u, w)


@uncounted_kernel
def cross_in_contact(
    pieces: FloatArray, bends: FloatArray, base: int, table: contract.IntArray, numbers: FloatArray, turns: FloatArray,
    step: FloatArray, after: FloatArray, end: FloatArray, carried: FloatArray, S: FloatArray, D: FloatArray,
) -> None:  # fmt: skip
    """Take tangents at fixed s over a smooth joint of two pieces, where only accelerations jump.

    The changed motion reaches the joint DBREAK - DT later than `s` says; until then the rates before it hold. At fixed
    time the wheel keeps displacement and velocity. The tangents of two pieces of the path differ by what the joint
    moves, and by what their fits leave. Behind the joint s counts so that DT is zero there.
    """
    u, w, time = end[FIRST], end[SECOND], after[TIME]
    leap, before = _meet_joint(pieces, bends, base, table, numbers, step, time, u, w, S, D)
    for lane in range(LANES):
        carried[DA, lane] -= D[layout.JOINT_HEIGHT, lane] / (2.0 * u)
        carried[DB, lane] -= D[layout.JOINT_VELOCITY, lane]
    break_moves(bends, base, table, numbers, turns, step, after, carried)
    bend, behind = _meet_joint(pieces, bends, base, table, numbers, after, time, u, w, S, D)
    on_deck = step[ON_DECK] != 0.0
    leap -= bend
    lighter = before - behind
    deck_leap = -lighter / numbers[contract.DECK_MASS] if on_deck else 0.0
    y, v = S[layout.JOINT_HEIGHT] - u * u, S[layout.JOINT_VELOCITY] - w
    deck_bend = deck_acceleration(numbers, end[THIRD], end[FOURTH], on_deck, behind)
    if on_deck:
        y += end[THIRD]
        v += end[FOURTH]
        bend += deck_bend
    bend += 1.0 + numbers[contract.STIFFNESS] * y + numbers[contract.DAMPING] * v - behind
    for lane in range(LANES):
        dt = carried[DT, lane]
        delay = carried[DBREAK, lane] - dt
        carried[DA, lane] += (D[layout.JOINT_HEIGHT, lane] - w * dt) / (2.0 * u)
        carried[DB, lane] += D[layout.JOINT_VELOCITY, lane] + (deck_leap - lighter) * delay - (leap + bend) * dt
        carried[DY, lane] -= end[FOURTH] * dt
        carried[DZ, lane] += deck_leap * delay - deck_bend * dt
        carried[DT, lane] = 0.0
