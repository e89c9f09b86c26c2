"""Rails that give way below a vehicle, within one macro step: what the wheels feel of them, and they of the wheels.

Over a macro step, θ from 0 to 1 and z = 2θ - 1, rail and sleepers are known to the wheels by a few numbers. With
Legendre's polynomials P_m and the moments m_jl = ∫ P_l(z) N_j dθ of the force of each wheel since the step's start, the
deflection under wheel i is

    w_i(θ) = Σ_m P_m(z)·(d_im + Σ_j Σ_l B_ijml·m_jl) + r_i(θ)·N_i

where d is what moves without these forces, B the track's answer to them, and r the local compliance that its modes
leave out. The moments are states of the vehicle's march; what is between two macro steps is done in `rails`. The
wheels' treads and flanges press the same place of a rail.

Both rails are equal. They move together and against one another: d, B and the deflections w belong to these two ways,
of which the left rail is the sum and the right one the difference.

Wheelsets come in fours, as in the octets of contacts, so that the innermost index is a lane: coefficients of one way
are (fours, nodes, HALF). Sleepers over voids follow in fours of their own: the ballast presses them up (voids.py). The
array `rails` of an assembly holds, one behind the other: RAIL_NUMBERS; d of both ways; r; B of each way with the force
first, only one where sleepers do not roll; and scratch memory: P and P', the deflections' coefficients, the moments'
rates of both rails, and over voids P''.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from wheeltapper.march.common.kernel import inlined_kernel, kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import contact_laws as laws
from wheeltapper.march.wagon import rail_answers
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import HALF, LANES
from wheeltapper.march.wagon.rail_answers import answer_at_once, places_of, sum_lanes, sum_ways, write_growth
from wheeltapper.march.wagon.voids import measure_voids, press_voids

MOST_TURNS = 40
"""Iterations for the forces on the local compliance; they rise to the solution from below, quadratically at last."""
FORCE_SETTLED = 1e-9
"""Relative change of the forces that ends them: the next one would be its square."""
INVERSES = tuple(1.0 / (m + 1.0) for m in range(17))
"""1/(m + 1); a division would wait for the one before it."""
GRIP_SETTLED = 1e-13
"""Change of the grips that ends what depends on rates."""
SHORTEST_LAG = 0.025
"""Shortest time by which the rate of an indentation that is a state follows, in the longest macro steps."""
ONE = 1
"""Place of the size of one rail's coefficients in what `places_of` returns."""


def rails_array(
    nodes: int, fours: int, states: int, rolls: bool, force: float, at_once: bool, over_voids: bool = False
) -> FloatArray:  # fmt: skip
    """Return the array `rails` of rails at rest without a load; the moments begin at `states` in the state.

    `rolls` says that the rails against one another are another track than the rails together, `at_once` that macro
    steps in which nothing happens are solved at once. `force`: near a static one, N. `over_voids`: fours of sleepers
    follow those of wheelsets.
    """
    one = fours * nodes * HALF
    against = one * one if rolls else 0
    out = np.zeros(asm.RAIL_NUMBERS + 2 * one + one + one * one + against + 2 * nodes + 4 * one + over_voids * nodes)
    out[asm.RAIL_SECONDS] = 1.0
    out[[asm.RAIL_NODES, asm.RAIL_FOURS, asm.RAIL_STATES, asm.RAIL_AGAINST]] = nodes, fours, states, against
    out[[asm.RAIL_FORCE, asm.RAIL_AT_ONCE]] = force, at_once
    return out


@kernel
def begin_of_step(step: int, ends: FloatArray) -> float:
    """Return when a macro step begins, s; `ends` are those of a bay's, from 0 on."""
    count = len(ends) - 1
    return (step // count) * ends[count] + ends[step % count]


@kernel
def step_at(t: float, ends: FloatArray) -> int:
    """Return the macro step in which a time lies."""
    count = len(ends) - 1
    bays = int(t / ends[count])
    own = np.searchsorted(ends, t - bays * ends[count], "right") - 1
    return bays * count + int(min(max(own, 0), count - 1))


@kernel
def enter_macro_step(
    step: int, ends: FloatArray, free: FloatArray, local: FloatArray, answers: FloatArray, data: FloatArray,
    plan: IntArray,
) -> None:  # fmt: skip
    """Write what the wheels know of the rails in a macro step: d, r and B, flat."""
    at, own = plan[asm.AT_RAILS], step % (len(ends) - 1)
    data[at + asm.RAIL_BEGAN] = begin_of_step(step, ends)
    data[at + asm.RAIL_SECONDS] = ends[own + 1] - ends[own]
    for k in range(len(ends) - 1):
        data[at + asm.RAIL_LONGEST] = max(data[at + asm.RAIL_LONGEST], ends[k + 1] - ends[k])
    _, _, to_free, to_local, to_answers, _, _, _, _ = places_of(data, plan)
    data[to_free : to_free + len(free)] = free
    data[to_local : to_local + len(local)] = local
    data[to_answers : to_answers + len(answers)] = answers


@kernel
def enter_logged_step(
    t: float, ends: FloatArray, free: FloatArray, local: FloatArray, answers: FloatArray, data: FloatArray,
    plan: IntArray,
) -> None:  # fmt: skip
    """Do as `enter_macro_step` for the macro step in which a time lies, from a log; do nothing where there is none."""
    if len(free) > 0:
        step = min(step_at(t, ends), len(free) - 1)
        place = step % len(local)
        enter_macro_step(step, ends, free[step], local[place], answers[place], data, plan)


@inlined_kernel
def _write_legendre(z: float, nodes: int, values: int, slopes: int, data: FloatArray) -> None:
    """Write Legendre's polynomials and their derivatives at z."""
    before = 1.0
    value = z
    slope_before = 0.0
    slope = 1.0
    data[values] = 1.0
    data[slopes] = 0.0
    for m in range(1, nodes):
        data[values + m] = value
        data[slopes + m] = slope
        later = z * value + m * INVERSES[m] * (z * value - before)
        slope_later = slope_before + (2 * m + 1) * value
        before = value
        value = later
        slope_before = slope
        slope = slope_later


@kernel
def free_rails(t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Compute the rails' deflections and velocities but for what the present forces add."""
    at = plan[asm.AT_RAILS]
    seconds = data[at + asm.RAIL_SECONDS]
    nodes, one, free, _, answers, values, slopes, present, _ = places_of(data, plan)
    _write_legendre(2.0 * (t - data[at + asm.RAIL_BEGAN]) / seconds - 1.0, nodes, values, slopes, data)
    for k in range(2 * one):
        data[present + k] = data[free + k]
    rail_answers.add_answers(
        one, int(data[at + asm.RAIL_STATES]), answers, int(data[at + asm.RAIL_AGAINST]), present, w, data
    )
    treads, octets = int(data[asm.TREADS]), plan[asm.WHEEL_OCTETS]
    for o in range(octets):
        L = wheels[o]
        own = present + o % treads * nodes * HALF
        sum_ways(own, one, values, nodes, wheel.ROW_RAIL, data, L)
        sum_ways(own, one, slopes, nodes, wheel.RAIL_RATE, data, L)
        for i in range(LANES):
            L[wheel.RAIL_RATE + i] *= 2.0 / seconds
    if octets < wheels.shape[0]:
        measure_voids(data, plan, wheels)


@inlined_kernel
def _settle(flanged: bool, law: FloatArray | None, T: FloatArray, G: FloatArray) -> None:
    """Write the forces of wheels' treads, T, and flanges, G, on the local compliance r together.

    N = Σ C·max(D - r·N, 0)^1.5 over both, where D is the indentation on a rail without it. Newton's method from zero:
    the right side falls and bends upwards, so that it never passes the solution. `law`: None of Hertz's, or the data.
    """
    for i in range(LANES):
        T[wheel.ROW_FORCE + i] = 0.0
    for _ in range(MOST_TURNS):
        most = 0.0
        for i in range(LANES):
            force = T[wheel.ROW_FORCE + i]
            pushed, steep = laws.push(i, T[wheel.ROW_DELTA + i] - T[wheel.SOFTNESS + i] * force, law, T)
            T[wheel.ROW_EXCESS + i] = pushed - force
            T[wheel.STEEPNESS + i] = steep
        if flanged:
            for i in range(LANES):
                sinks = T[wheel.SOFTNESS + i] * T[wheel.ROW_FORCE + i]
                pushed, steep = laws.push(i, G[wheel.ROW_DELTA + i] - sinks, law, G)
                T[wheel.ROW_EXCESS + i] += pushed
                T[wheel.STEEPNESS + i] += steep
        for i in range(LANES):
            change = T[wheel.ROW_EXCESS + i] / (1.0 + T[wheel.SOFTNESS + i] * T[wheel.STEEPNESS + i])
            T[wheel.ROW_FORCE + i] += change
            most = max(most, abs(change) - FORCE_SETTLED * abs(T[wheel.ROW_FORCE + i]))
        if most <= 0.0:
            break


@inlined_kernel
def press_octet(law: FloatArray | None, T: FloatArray, L: FloatArray) -> None:
    """Write indentations and forces of contacts where the rails give way under the forces that were found."""
    for i in range(LANES):
        sinks = T[wheel.SOFTNESS + i] * T[wheel.ROW_FORCE + i]
        delta = L[wheel.ROW_DELTA + i] - sinks
        L[wheel.ROW_RAIL + i] += sinks
        L[wheel.ROW_DELTA + i] = delta
        if law is None:
            n = L[wheel.ROOT_C + i] * L[wheel.BULGE + i] * sqrt(max(delta, 0.0)) * L[wheel.ON + i]
            L[wheel.CUBE_ROOT + i] = n
            L[wheel.NORMAL + i] = n * n * n
        elif laws.is_own(law):
            laws.press_own(i, law, L)
        else:
            L[wheel.NORMAL + i], _ = laws.push(i, delta, law, L)
            elastic = max(L[wheel.NORMAL + i], 0.0)
            if law[asm.CONTACT_LAW] == asm.LOSSY:
                c = L[wheel.ROOT_C + i] * L[wheel.BULGE + i] * L[wheel.ON + i]
                L[wheel.CUBE_ROOT + i] = c * sqrt(max(delta, 0.0))
            else:
                L[wheel.CUBE_ROOT + i] = np.cbrt(elastic)


@kernel
def press_rails(rated: bool, data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Correct indentations, forces and, if `rated`, their rates by what the present forces do to the rails."""
    if data[asm.CONTACT_LAW] == asm.HERTZIAN:
        _press_once(rated, None, data, plan, wheels)
    elif laws.is_lossy(data):
        _press_by_rates(data, plan, wheels)
    else:
        _press_once(rated, data, data, plan, wheels)
        if laws.is_plastic(data):
            for o in range(int(data[asm.TREADS])):
                laws.measure_borders(data, wheels[o])


@kernel
def gather_lags(data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Copy the indentations' rates that are states into the lanes."""
    begin = _first_lag(data, plan)
    for o in range(plan[asm.WHEEL_OCTETS]):
        for i in range(LANES):
            wheels[o, wheel.LATE_RATE + i] = w[begin + o * LANES + i]


@kernel
def write_lag_rates(data: FloatArray, plan: IntArray, wheels: FloatArray, out: FloatArray) -> None:
    """Write how fast these follow what was computed last."""
    begin = _first_lag(data, plan)
    for o in range(plan[asm.WHEEL_OCTETS]):
        L = wheels[o]
        for i in range(LANES):
            if L[wheel.AWAKE] != 0.0 and L[wheel.SIDES + i] != 0.0:
                out[begin + o * LANES + i] = (L[wheel.DELTA_RATE + i] - L[wheel.LATE_RATE + i]) / L[wheel.LAG_TIME + i]


@kernel
def catch_up(data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Let the rates that are states of open contacts be the present ones.

    An open contact knows its rate at once, a closed one late. So one that closes by its grip, while it is indented,
    would else fall back to the rate of a moment before, at which it would pull.
    """
    if plan[asm.AT_RAILS] == 0:
        return
    begin = _first_lag(data, plan)
    for o in range(plan[asm.WHEEL_OCTETS]):
        L = wheels[o]
        for i in range(LANES):
            if L[wheel.AWAKE] != 0.0 and L[wheel.ON + i] == 0.0:
                w[begin + o * LANES + i] = L[wheel.DELTA_RATE + i]


@inlined_kernel
def _first_lag(data: FloatArray, plan: IntArray) -> int:
    """Return where the indentations' rates stand in the state: behind the moments."""
    nodes_and_one = places_of(data, plan)
    return int(data[plan[asm.AT_RAILS] + asm.RAIL_STATES]) + 2 * nodes_and_one[ONE]


@kernel
def _press_by_rates(data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Do so with forces that depend on the indentations' rates, which these forces change: until both agree.

    With the local compliance r the rate follows late, by τ = r·∂N/∂δ' / (1 + r·∂N/∂δ), what it would be without the
    term of δ'' in N'. What follows it by τ + τ' is a state; of the rest, τ' to τ + τ', none is late. That errs by τ·τ'
    in the second derivative, and is never stiffer than τ', although τ ends with the force.
    """
    treads = int(data[asm.TREADS])
    shortest = SHORTEST_LAG * data[plan[asm.AT_RAILS] + asm.RAIL_LONGEST]
    for o in range(plan[asm.WHEEL_OCTETS]):
        for row, free in wheel.FREED:
            for i in range(LANES):
                wheels[o, free + i] = wheels[o, row + i]
    for turn in range(MOST_TURNS):
        if turn > 0:
            for o in range(plan[asm.WHEEL_OCTETS]):
                for row, free in wheel.FREED:
                    for i in range(LANES):
                        wheels[o, row + i] = wheels[o, free + i]
        _press_once(True, data, data, plan, wheels)  # type: ignore[arg-type]
        most = 0.0
        for o in range(plan[asm.WHEEL_OCTETS]):
            L = wheels[o]
            T = wheels[o % treads]
            if L[wheel.AWAKE] == 0.0:
                continue
            for i in range(LANES):
                r, late, before = T[wheel.SOFTNESS + i], L[wheel.LATE_RATE + i], L[wheel.GRIP + i]
                viscosity = laws.viscosity_of(i, L[wheel.HELD_RATE + i], data, L)
                lag = shortest + max(r * viscosity / (1.0 + r * T[wheel.STEEPNESS + i]), 0.0)
                L[wheel.LAG_TIME + i] = lag
                laws.hold_by_rate(i, late + shortest / lag * (L[wheel.DELTA_RATE + i] - late), data, L)
                most = max(most, abs(L[wheel.GRIP + i] - before) * L[wheel.ON + i])
        if most <= GRIP_SETTLED:
            break


@inlined_kernel
def is_flanged(o: int, data: FloatArray, plan: IntArray, wheels: FloatArray) -> bool:
    """Return True where the flanges of an octet of treads may touch."""
    treads = int(data[asm.TREADS])
    return bool(plan[asm.WHEEL_OCTETS] > treads and wheels[(o + treads) % wheels.shape[0], wheel.AWAKE] != 0.0)


@kernel
def _press_once(rated: bool, law: FloatArray | None, data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Do so for given grips; `law` is None of Hertz's, or the data."""
    nodes, _, _, local, _, values, _, _, _ = places_of(data, plan)
    treads = int(data[asm.TREADS])
    for o in range(treads):
        T, flanged = wheels[o], is_flanged(o, data, plan, wheels)
        G = wheels[o + treads] if flanged else T
        first = o * nodes * HALF
        sum_lanes(local + first, values, nodes, wheel.SOFTNESS, data, T)
        _settle(flanged, law, T, G)
        press_octet(law, T, T)
        if flanged:
            press_octet(law, T, G)
        write_growth(o, wheel.ROW_FORCE, values, data, plan, T)
    if plan[asm.WHEEL_OCTETS] < wheels.shape[0]:
        press_voids(rated, data, plan, wheels)
    if rated:
        _add_force_rates(law, data, plan, wheels)


@inlined_kernel
def _growths(i: int, law: FloatArray | None, L: FloatArray) -> tuple[float, float]:
    """Return what a contact's force grows by with its constant, N/s, and with the indentation's rate, N/m."""
    c = L[wheel.ROOT_C + i] * L[wheel.BULGE + i]
    growth = L[wheel.ROOT_C_RATE + i] * L[wheel.BULGE + i] + L[wheel.ROOT_C + i] * L[wheel.BULGE_RATE + i]
    root = sqrt(max(L[wheel.ROW_DELTA + i], 0.0)) * L[wheel.ON + i]
    n = L[wheel.CUBE_ROOT + i]
    if law is None:
        return 3.0 * n * n * root * growth, 1.5 * n * c * c * L[wheel.ON + i]
    else:  # noqa: RET505 - Numba prunes whole branches only
        if laws.is_plastic(law):
            return laws.yield_growth(i, law, L)
        force, steep = laws.push(i, L[wheel.ROW_DELTA + i], law, L)
        if laws.is_own(law):
            return laws.own_growth(i, force, steep, L), steep
        return 3.0 * force * growth / c, steep


@kernel
def _add_force_rates(law: FloatArray | None, data: FloatArray, plan: IntArray, wheels: FloatArray) -> None:
    """Correct the rates: the rails yield to the present forces at once by a little, and r·N changes."""
    seconds = data[plan[asm.AT_RAILS] + asm.RAIL_SECONDS]
    nodes, one, _, local, _, values, slopes, present, _ = places_of(data, plan)
    answer_at_once(data, plan)
    treads = int(data[asm.TREADS])
    for o in range(treads):
        T, flanged = wheels[o], is_flanged(o, data, plan, wheels)
        G = wheels[o + treads] if flanged else T
        first = o * nodes * HALF
        sum_ways(present + first, one, values, nodes, wheel.ROW_SINKS, data, T)
        sum_lanes(local + first, slopes, nodes, wheel.ROW_EXCESS, data, T)
        for i in range(LANES):
            r = T[wheel.SOFTNESS + i]
            sinks = (T[wheel.ROW_SINKS + i] + 2.0 * T[wheel.ROW_EXCESS + i] * T[wheel.ROW_FORCE + i]) / seconds
            grown, steep = _growths(i, law, T)
            rises = grown + steep * (T[wheel.DELTA_RATE + i] - sinks)
            if flanged:
                grown, more = _growths(i, law, G)
                rises += grown + more * (G[wheel.DELTA_RATE + i] - sinks)
                steep += more
            T[wheel.ROW_SINKS + i] = sinks + r * rises / (1.0 + r * steep)
        _sink(law, T, T)
        if flanged:
            _sink(law, T, G)


@inlined_kernel
def _sink(law: FloatArray | None, T: FloatArray, L: FloatArray) -> None:
    """Write the rates of contacts whose rails sink faster by what was found."""
    for i in range(LANES):
        L[wheel.RAIL_RATE + i] += T[wheel.ROW_SINKS + i]
        L[wheel.DELTA_RATE + i] -= T[wheel.ROW_SINKS + i]
        grown, steep = _growths(i, law, L)
        L[wheel.NORMAL_RATE + i] = grown + steep * L[wheel.DELTA_RATE + i]


@kernel
def write_moment_rates(data: FloatArray, plan: IntArray, out: FloatArray) -> None:
    """Write the rates of the moments of the forces that were computed last."""
    at = plan[asm.AT_RAILS]
    states, over = int(data[at + asm.RAIL_STATES]), 1.0 / data[at + asm.RAIL_SECONDS]
    _, one, _, _, _, _, _, _, growing = places_of(data, plan)
    for k in range(2 * one):
        out[states + k] = data[growing + k] * over
