"""Voids below a track: contacts between sleepers and ballast, in octets behind those of the wheels.

A sleeper over a void is a place of the rails, as those below wheels are (rail_motion.py); its force presses it up. With
the depth D of the sleeper in the ballast, and the compliance r that the modes leave out of it, a closed void has the
force N = (k·D + c·D')/(1 + r·k). The rate is the true one, with what the present forces add to it at once; voids with
a damper have no r (docs/theory/track.rst).

A void is closed just where both D and k·D + c·D' are positive. So ROW_DELTA is the one of them, in
m, that decides: the latter of a closed void, and of an open one in the ballast that its sleeper has left behind.
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import inlined_kernel, kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import HALF, LANES
from wheeltapper.march.wagon.rail_answers import answer_at_once, places_of, sum_lanes, sum_ways, write_growth

MOST_SETTLING = 16
"""Turns at most until forces of dampers and what they do to the rails at once agree; some 4 do."""
SETTLED_FORCE = 1e-13
"""Change of these forces that ends the turns, in static forces of a wheel."""


@inlined_kernel
def void_number(column: int, i: int, o: int, data: FloatArray, plan: IntArray) -> float:
    """Return a number of a void in a lane of an octet."""
    row = (o - plan[asm.WHEEL_OCTETS]) * asm.VOID_COLUMNS + column
    return data[plan[asm.AT_VOIDS] + row * LANES + i]


@inlined_kernel
def four_of(o: int, data: FloatArray, plan: IntArray) -> int:
    """Return the four of sleepers of an octet, behind those of wheelsets."""
    return int(data[asm.TREADS]) + o - plan[asm.WHEEL_OCTETS]


@kernel
def measure_voids(data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Write the sleepers' depths in the ballast and their derivatives, but for what the present forces add to these."""
    nodes, one, _, local, _, values, slopes, present, growing = places_of(data, plan)
    pace = 2.0 / data[plan[asm.AT_RAILS] + asm.RAIL_SECONDS]
    bends = growing + 2 * one
    data[bends] = 0.0
    data[bends + 1] = 0.0
    for m in range(1, nodes - 1):
        data[bends + m + 1] = data[bends + m - 1] + (2 * m + 1) * data[slopes + m]
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        L = wheels[o]
        first = four_of(o, data, plan) * nodes * HALF
        sum_lanes(local + first, values, nodes, wheel.SOFTNESS, data, L)
        sum_ways(present + first, one, values, nodes, wheel.SLEEPER_DEPTH, data, L)
        sum_ways(present + first, one, slopes, nodes, wheel.FREE_DEPTH_RATE, data, L)
        sum_ways(present + first, one, bends, nodes, wheel.FREE_DEPTH_BEND, data, L)
        for i in range(LANES):
            L[wheel.SLEEPER_DEPTH + i] = -L[wheel.SLEEPER_DEPTH + i] - void_number(asm.VOID_GAP, i, o, data, plan)
            L[wheel.FREE_DEPTH_RATE + i] *= -pace
            L[wheel.FREE_DEPTH_BEND + i] *= -pace * pace


@kernel
def _is_damped(data: FloatArray, plan: IntArray, wheels: FloatArray) -> bool:
    """Return True where a damper touches a sleeper."""
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            touches = L[wheel.ON + i] != 0.0 or L[wheel.SLEEPER_DEPTH + i] > 0.0
            if touches and void_number(asm.VOID_DAMPING, i, o, data, plan) > 0.0:
                return True
    return False


@kernel
def _press_sleepers(answered: bool, data: FloatArray, plan: IntArray, wheels: FloatArray) -> float:
    """Write rates of depths and forces, and how their moments grow; return the largest change of a force.

    `answered`: what forces add to the rates at once is known.
    """
    nodes, one, _, _, _, values, _, present, _ = places_of(data, plan)
    over = 1.0 / data[plan[asm.AT_RAILS] + asm.RAIL_SECONDS]
    most = 0.0
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        L, four = wheels[o], four_of(o, data, plan)
        sum_ways(present + four * nodes * HALF, one, values, nodes, wheel.ROW_SINKS, data, L)
        for i in range(LANES):
            k, c = void_number(asm.VOID_STIFFNESS, i, o, data, plan), void_number(asm.VOID_DAMPING, i, o, data, plan)
            rate = L[wheel.FREE_DEPTH_RATE + i]
            if answered:
                rate -= over * L[wheel.ROW_SINKS + i]
            force = k * L[wheel.SLEEPER_DEPTH + i] + c * rate
            force *= L[wheel.ON + i] / (1.0 + L[wheel.SOFTNESS + i] * k)
            most = max(most, abs(force - L[wheel.NORMAL + i]))
            L[wheel.DEPTH_RATE + i], L[wheel.DEPTH_BEND + i] = rate, L[wheel.FREE_DEPTH_BEND + i]
            L[wheel.NORMAL + i] = force
        write_growth(four, wheel.NORMAL, values, data, plan, L)
    return most


@kernel
def _write_growths(factors: int, data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Write how the moments of all present forces grow, with factors P or P'."""
    for o in range(int(data[asm.TREADS])):
        write_growth(o, wheel.ROW_FORCE, factors, data, plan, wheels[o])
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        write_growth(four_of(o, data, plan), wheel.NORMAL, factors, data, plan, wheels[o])


@kernel
def _add_to_bends(factors: int, share: float, data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Add to the second derivatives of depths what growths of moments give, with factors P or P'."""
    answer_at_once(data, plan)
    nodes, one, _, _, _, _, _, present, _ = places_of(data, plan)
    over = 1.0 / data[plan[asm.AT_RAILS] + asm.RAIL_SECONDS]
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        L = wheels[o]
        first = present + four_of(o, data, plan) * nodes * HALF
        sum_ways(first, one, factors, nodes, wheel.ROW_SINKS, data, L)
        for i in range(LANES):
            L[wheel.DEPTH_BEND + i] -= share * over * over * L[wheel.ROW_SINKS + i]


@kernel
def press_voids(rated: bool, data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Write the forces of all voids; if `rated`, also how they, and what ends them, change.

    The second derivative is without the rates of the forces, which add some thousandth to it: it tells what may happen
    in a step, not when.
    """
    _, _, _, _, _, values, slopes, _, _ = places_of(data, plan)
    damped = _is_damped(data, plan, wheels)
    least = SETTLED_FORCE * data[plan[asm.AT_RAILS] + asm.RAIL_FORCE]
    _press_sleepers(False, data, plan, wheels)
    if damped or rated:
        for _ in range(MOST_SETTLING):
            answer_at_once(data, plan)
            if _press_sleepers(True, data, plan, wheels) <= least:
                break
    if not rated:
        return
    if damped:
        _add_to_bends(slopes, 4.0, data, plan, wheels)
        _write_growths(slopes, data, plan, wheels)
        _add_to_bends(values, 2.0, data, plan, wheels)
        _write_growths(values, data, plan, wheels)
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            k, c = void_number(asm.VOID_STIFFNESS, i, o, data, plan), void_number(asm.VOID_DAMPING, i, o, data, plan)
            depth, rate, lag = L[wheel.SLEEPER_DEPTH + i], L[wheel.DEPTH_RATE + i], c / k
            growth = rate + lag * L[wheel.DEPTH_BEND + i]
            L[wheel.NORMAL_RATE + i] = L[wheel.ON + i] * k * growth / (1.0 + L[wheel.SOFTNESS + i] * k)
            by_force = c > 0.0 and (L[wheel.ON + i] != 0.0 or (depth > 0.0 and rate < 0.0))
            L[wheel.ROW_DELTA + i] = depth + lag * rate if by_force else depth
            L[wheel.DELTA_RATE + i] = growth if by_force else rate
            L[wheel.ROW_HOLD + i] = L[wheel.ROW_DELTA + i]
            L[wheel.GRIP + i] = 1.0
