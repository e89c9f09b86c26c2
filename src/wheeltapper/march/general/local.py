"""The contact problem of one contact over part of a macro step: forces at Gauss nodes, with the structure as a kernel.

With z = 2θ - 1, Legendre's polynomials P_l, and the moments m_l(θ) = ∫ P_l(z) N dθ since the macro step's start,

    D(θ) = Σ_l P_l(z)·(c_l - Σ_m B_lm·m_m(θ)) + path(θ),    D = δ + r·N,    N = law(δ).

The c are the gap's free motion and B the structure's answer to a force, both as polynomials over the macro step; r is
the local compliance that the structure's modes leave out. Forces are held at nodes of σ, in which they stay smooth near
an impact and a loss (layout.py).
"""

from __future__ import annotations

from math import sqrt

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Row
from wheeltapper.march.general import layout, paths
from wheeltapper.march.general.algebra import factorise, solve_factorised
from wheeltapper.march.general.laws.switch import LAW_RATED, forces, trend
from wheeltapper.march.general.layout import AFTER_IMPACT, BEFORE_LOSS, EVENLY
from wheeltapper.march.general.records import Nodes, Room, Site

MOST_ITERATIONS = 30
KEEPS_MATRIX = 1e-2
"""Corrections smaller than this, in static indentations, keep the matrix of the one before."""
SHORT_LAG = 0.05
"""Lag of a rate-dependent indentation, over a part, below which it is not resolved."""
STAGNANT = 1e-11
"""Corrections smaller than this that do not shrink are rounding."""
TOO_FAR = 1e6
"""Indentation at which a solve has diverged."""


@uncounted_kernel
def legendre_rows(n: int, theta: FloatArray, q: int, P: FloatArray) -> None:
    """Write P_l(2θ_k - 1), (k, l)."""
    for k in range(n):
        z = 2.0 * theta[k] - 1.0
        before = 1.0
        value = z
        P[k, layout.BEGIN] = 1.0
        for m in range(1, q):
            P[k, m] = value
            later = ((2 * m + 1) * z * value - m * before) / (m + 1)
            before = value
            value = later


@uncounted_kernel
def sum_at(theta: float, q: int, a: FloatArray) -> tuple[float, float]:
    """Return Σ a_l P_l(2θ - 1) and its derivative by θ."""
    z = 2.0 * theta - 1.0
    before = 1.0
    value = z
    slope_before = 0.0
    slope = 1.0
    total = a[layout.BEGIN]
    total_slope = 0.0
    for m in range(1, q):
        total += a[m] * value
        total_slope += a[m] * slope
        later = ((2 * m + 1) * z * value - m * before) / (m + 1)
        slope_later = slope_before + (2 * m + 1) * value
        before = value
        value = later
        slope_before = slope
        slope = slope_later
    return total, 2.0 * total_slope


@uncounted_kernel
def free_sum(q: int, c: FloatArray, B: FloatArray, moments: FloatArray, out: FloatArray) -> None:
    """Write c - B·moments."""
    for j in range(q):
        total = c[j]
        for m in range(q):
            total -= B[j, m] * moments[m]
        out[j] = total


@inlined_uncounted_kernel
def gap_at(theta: float, q: int, a: FloatArray, site: Site) -> tuple[float, float]:
    """Return D and its derivative by θ at fixed moments, given its coefficients."""
    value, slope = sum_at(theta, q, a)
    height, steepness = paths.height_and_slope(site.pieces, site.place, site.x0, site.stride, site.lift, theta)
    return value + height, slope + steepness


@uncounted_kernel
def map_nodes(
    n: int, places: FloatArray, how: int, origin: float, span: float, s0: float, s1: float, room: Room
) -> None:
    """Write θ and dθ/dσ at the nodes; for an even map `origin` and `span` are its start and its length."""
    width = s1 - s0
    for k in range(n):
        s = s0 + width * places[k]
        if how == EVENLY:
            room.theta[k] = origin + span * places[k]
            room.pace[k] = span
        elif how == AFTER_IMPACT:
            room.theta[k] = origin + s * s
            room.pace[k] = 2.0 * s * width
        elif how == BEFORE_LOSS:
            room.theta[k] = origin - s * s
            room.pace[k] = -2.0 * s * width
        else:
            room.theta[k] = origin + span * s * s * (3.0 - 2.0 * s)
            room.pace[k] = 6.0 * span * s * (1.0 - s) * width


@uncounted_kernel
def rates(n: int, slopes: FloatArray, began: float, seconds: float, room: Room) -> None:
    """Write the indentation's rate at the nodes, from its polynomial through the start and the nodes."""
    for k in range(n):
        total = slopes[k, layout.BEGIN] * began
        for j in range(n):
            total += slopes[k, j + 1] * room.delta[j]
        room.rate[k] = total / (room.pace[k] * seconds)


@inlined_uncounted_kernel
def jacobian(n: int, slopes: FloatArray, seconds: float, rated: bool, room: Room) -> None:
    """Write the derivative of the residual by the indentations in J."""
    for i in range(n):
        for j in range(n):
            room.J[i, j] = room.K[i, j] * room.slope[j]
        room.J[i, i] += 1.0 + room.r[i] * room.slope[i]
    if not rated:
        return
    for k in range(n):
        share = room.viscous[k] / (room.pace[k] * seconds)
        for i in range(n):
            answer = room.K[i, k] * share
            if i == k:
                answer += room.r[k] * share
            for j in range(n):
                room.J[i, j] += answer * slopes[k, j + 1]


@inlined_uncounted_kernel
def lag(n: int, seconds: float, room: Room) -> float:
    """Return the time in which a rate-dependent indentation follows the gap, over the part's length.

    Under a local compliance r such a law makes the indentation a state of its own, which follows the gap with the lag
    r·∂N/∂δ'. A short lag is not resolved: then the indentation is the one that follows smoothly.
    """
    most = 0.0
    for k in range(n):
        most = max(most, room.r[k] * room.viscous[k] / (room.pace[k] * seconds))
    return most


@inlined_uncounted_kernel
def press_nodes(n: int, slopes: FloatArray, site: Site, room: Room) -> None:
    """Write the forces of the indentations at the nodes, with their rates where they depend on them."""
    if site.law[LAW_RATED] != 0.0:
        rates(n, slopes, site.place["began"], site.seconds, room)
    forces(
        site.law, site.table, site.place["stretch"], n, room.delta, room.rate, room.left, room.factor, room.N,
        room.slope, room.viscous,
    )  # fmt: skip


@inlined_uncounted_kernel
def newton(n: int, nodes: Nodes, tolerance: float, site: Site, room: Room) -> bool:
    """Solve δ + r·N + K·N = d for the indentations, from those in `room.delta`; return False if that fails.

    K holds the structure's answer and the integration. In the end N is the force of δ.
    """
    rated = site.law[LAW_RATED] != 0.0
    lags = rated and site.place["lags"] != 0.0
    size = 1.0  # behind a first correction, of a new matrix, about its square is left
    for turn in range(MOST_ITERATIONS):
        slopes = nodes.slopes if lags else nodes.own_slopes
        press_nodes(n, slopes, site, room)
        if turn == 0 and rated and lags != (lag(n, site.seconds, room) >= SHORT_LAG):
            lags = not lags
            site.place["lags"] = 1.0 if lags else 0.0
            slopes = nodes.slopes if lags else nodes.own_slopes
            press_nodes(n, slopes, site, room)
        for i in range(n):
            total = room.d[i] - room.delta[i] - room.r[i] * room.N[i]
            for j in range(n):
                total -= room.K[i, j] * room.N[j]
            room.F[i] = total
        if turn == 0 or size > KEEPS_MATRIX:
            jacobian(n, slopes, site.seconds, rated, room)
            factorise(room.J, n)
        solve_factorised(room.J, n, room.F)
        before = size
        size = 0.0
        for i in range(n):
            room.delta[i] += room.F[i]
            size = max(size, abs(room.F[i]))
        if not size < TOO_FAR:
            return False
        converged = size < tolerance or (size < KEEPS_MATRIX and size * size < tolerance * before)
        if converged or (size < STAGNANT and size >= 0.5 * before):
            if not rated:
                press_nodes(n, slopes, site, room)
                return True
            for i in range(n):  # what is left is of the size of the tolerance
                room.N[i] += room.slope[i] * room.F[i] - room.viscous[i] * room.rate[i]
            rates(n, slopes, site.place["began"], site.seconds, room)
            for i in range(n):
                room.N[i] += room.viscous[i] * room.rate[i]
            return True
    return False


@uncounted_kernel
def newton_apart(n: int, nodes: Nodes, tolerance: float, site: Site, room: Room) -> bool:
    """Do as `newton`, where a call costs less than the code of another copy."""
    return newton(n, nodes, tolerance, site, room)


@inlined_uncounted_kernel
def pose_part(nodes: Nodes, q: int, how: int, origin: float, span: float, s0: float, s1: float, site: Site, room: Room) -> None:  # fmt: skip  # noqa: E501
    """Write what the problem of one part consists of at its nodes: θ, its pace, D without the force, r, factor, and K.

    `room.free` holds D's coefficients at the part's start.
    """
    n = len(nodes.places)
    map_nodes(n, nodes.places, how, origin, span, s0, s1, room)
    P = room.P
    legendre_rows(n, room.theta, q, P)
    paths.heights(site.pieces, site.place, site.x0, site.stride, site.lift, n, room.theta, room.height, room.factor)
    paths.surfaces(site.pieces, site.place, site.x0, site.stride, site.lift, n, room.theta, room.left, room.factor)
    for k in range(n):
        total = room.height[k]
        local = 0.0
        for m in range(q):
            total += P[k, m] * room.free[m]
            local += P[k, m] * site.local[m]
        room.d[k] = total
        room.r[k] = local
    for k in range(n):
        for m in range(q):
            room.T[k, m] = 0.0
        for j in range(q):
            share = P[k, j]
            for m in range(q):
                room.T[k, m] += share * site.B[j, m]
    for k in range(n):
        for i in range(n):
            total = 0.0
            for m in range(q):
                total += room.T[k, m] * P[i, m]
            room.K[k, i] = total * nodes.integrals[k, i] * room.pace[i]


@inlined_uncounted_kernel
def continue_force(n: int, gap: float, steepness: float, site: Site, room: Room) -> None:
    """Write the indentations that the force at the part's start would leave if it did not change.

    `gap` and `steepness` are D and its derivative by θ there. Behind a kink of the path the rate changes at once, but
    with a lag the force does not.
    """
    room.delta[layout.BEGIN] = site.place["began"]
    room.rate[layout.BEGIN] = steepness / site.seconds
    forces(
        site.law, site.table, site.place["stretch"], 1, room.delta, room.rate, room.left, room.factor,
        room.N, room.slope, room.viscous,
    )  # fmt: skip
    force = room.N[layout.BEGIN]
    if site.law[LAW_RATED] != 0.0:
        force = max(force, 0.0)
        if lag(1, site.seconds, room) >= SHORT_LAG:
            force = (gap - site.place["began"]) / room.r[layout.BEGIN]
    for k in range(n):
        answer = room.r[k]
        for j in range(n):
            answer += room.K[k, j]
        room.delta[k] = room.d[k] - answer * force


@uncounted_kernel
def solve_part(nodes: Nodes, q: int, how: int, origin: float, span: float, s0: float, s1: float, again: bool, tolerance: float, site: Site, room: Room) -> bool:  # fmt: skip  # noqa: E501
    """Solve for the forces of one part; write the moments at its end. `again`: δ holds a good guess.

    `room.free` and `room.moments` hold D's coefficients and the moments at the part's start.
    """
    n = len(nodes.places)
    pose_part(nodes, q, how, origin, span, s0, s1, site, room)
    P = room.P
    if not again:
        gap, steepness = gap_at(part_of(how, origin, span, s0), q, room.free, site)
        continue_force(n, gap, steepness, site, room)
    if not newton_apart(n, nodes, tolerance, site, room):
        return False
    for m in range(q):
        room.after[m] = room.moments[m]
    for k in range(n):
        share = nodes.weights[k] * room.pace[k] * room.N[k]
        for m in range(q):
            room.after[m] += share * P[k, m]
    return True


@inlined_uncounted_kernel
def tail_of(nodes: Nodes, N: FloatArray) -> float:
    """Return the size of the last two Legendre coefficients of a force."""
    n = len(nodes.places)
    last = 0.0
    other = 0.0
    for k in range(n):
        last += nodes.transform[n - 1, k] * N[k]
        other += nodes.transform[n - 2, k] * N[k]
    return abs(last) + abs(other)


@inlined_uncounted_kernel
def end_indentation(n: int, nodes: Nodes, place: Row, room: Room) -> float:
    """Return the indentation at a part's end, by the polynomial that the rates at the nodes were taken from."""
    total = 0.0
    if place["lags"] == 0.0:
        for k in range(n):
            total += nodes.end[k] * room.delta[k]
        return total
    total = nodes.reach[layout.BEGIN] * place["began"]
    for k in range(n):
        total += nodes.reach[k + 1] * room.delta[k]
    return total


@uncounted_kernel
def trends(n: int, law: FloatArray, table: FloatArray, room: Room, out: FloatArray) -> None:
    """Write at the nodes what has the sign of a rate-dependent law's force."""
    for k in range(n):
        out[k] = trend(law, table, room.delta[k], room.rate[k])


@inlined_uncounted_kernel
def would_pull(nodes: Nodes, law: FloatArray, room: Room) -> bool:
    """Return True where a rate-dependent law pulls at a node or at the end; there are indentations everywhere."""
    if law[LAW_RATED] == 0.0:
        return False
    least, end = room.N[layout.BEGIN], 0.0
    for k in range(len(nodes.places)):
        least = min(least, room.N[k])
        end += nodes.end[k] * room.N[k]
    return min(least, end) <= 0.0


@uncounted_kernel
def part_of(how: int, origin: float, span: float, s: float) -> float:
    """Return the part θ of the macro step at s."""
    if how == EVENLY:
        return origin + span * s
    if how == AFTER_IMPACT:
        return origin + s * s
    if how == BEFORE_LOSS:
        return origin - s * s
    return origin + span * s * s * (3.0 - 2.0 * s)


@uncounted_kernel
def smoothstep_inverse(x: float) -> float:
    """Return s in [0, 1] with s²·(3 - 2·s) = x."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    s = sqrt(x / 3.0) if x < 0.05 else x
    if x > 0.95:
        s = 1.0 - sqrt((1.0 - x) / 3.0)
    for _ in range(60):
        new = s - (s * s * (3.0 - 2.0 * s) - x) / (6.0 * s * (1.0 - s))
        new = min(max(new, 0.5 * s), 0.5 * (1.0 + s))
        if abs(new - s) < 1e-16:
            return new
        s = new
    return s
