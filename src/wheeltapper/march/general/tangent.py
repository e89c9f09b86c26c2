"""Tangents of a march: its logged parts once more, linearised at fixed nodes, along several directions at a time.

A part solves δ + r·N + K·N = d for the indentations δ at its nodes (local.py). At the same nodes a small change of a
parameter, written Δ, changes them by

    (1 + (r + K)·N_δ)·Δδ = Δd - Δr·N - ΔK·N - (r + K)·N_p,    ΔN = N_δ·Δδ + N_p,

N_δ the law's slope and N_p its direct derivative. The matrix is that of Newton's method, the same in all directions;
the moments of ΔN change what follows, the modes and the bodies, as those of N do. The ends of parts move, too, but N is
zero at losses and impacts, so that moments do not feel it. Where the force jumps with the path, or with the factor on
it, they change by this jump times the way of the joint. Events move by Δθ = -ΔD/D' at fixed moments.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row
from wheeltapper.march.general import local, modal, paths
from wheeltapper.march.general.algebra import LANES, copy, factorise, solve_lanes
from wheeltapper.march.general.careful import EVENTS_NOW, ROWS_NOW, SNAP, share_part
from wheeltapper.march.general.laws.switch import LAW_RATED, forces
from wheeltapper.march.general.layout import BEGIN, EVENLY, IM, RE
from wheeltapper.march.general.records import Data, Logs, Motion, Nodes, Room, Site, Tables
from wheeltapper.march.general.stepping import bays_ahead

AT_PART_END = 4e-8
"""Parts of a macro step; an event no farther from the end of a logged part is at it."""
MOST_TURN_SWEEPS = 60
INDENTED = 1e-6
"""Gap at an event, in units of length, above which the surfaces indent each other."""
SETTLED = 1e-12
"""Change of what contacts feel of each other, over all that they feel, at which it is known."""
STAYS, LEAPS, PULLS_THERE = range(3)
"""Events where D falls or rises through zero, where the path jumps, and where a law begins or ends to pull."""
OF_TIME, OF_SIZE = 0, 1
"""Rows of an event's derivatives: of its part of a macro step, and of the rate of indentation there."""
LAW_CONSTANT, LAW_LOSS = 1, 2
"""Columns of a law's numbers that may change: its constant, and the loss of Hunt and Crossley."""


class Turns(NamedTuple):
    """Derivatives along some directions, at most LANES, in the march's units.

    Attributes
    ----------
    bent
        The table of `bends` that each direction has, -1 for none, (directions,).
    bends
        Of the path's pieces at fixed places, (tables, pieces, PIECE_COLUMNS), m; their DEGREE and FACTOR_DEGREE are
        those of the derivatives themselves.
    laws
        (directions, contacts, LAW_NUMBERS).
    seconds
        Of the macro step, over its length, (directions,).
    structured
        1 where tables of the structure change, (directions,).
    bodies_read, bodies_write, bodies_step, kernels, matrices, cross
        Of these tables, behind the direction's axis.
    rates
        λ·H of the modes for each length H of a step, (lengths, 2, modes).
    later, remaining
        From Legendre coefficients to those of the polynomial times θ at the nodes, and from moments of a force to those
        of the force times 1 - θ, (q, q) both. A macro step that lasts longer changes what is read of the modes by
        λ·H·θ, and what they take by λ·H·(1 - θ).
    """

    bent: IntArray
    bends: FloatArray
    laws: FloatArray
    seconds: FloatArray
    structured: IntArray
    bodies_read: FloatArray
    bodies_write: FloatArray
    bodies_step: FloatArray
    kernels: FloatArray
    matrices: FloatArray
    cross: FloatArray
    rates: FloatArray
    later: FloatArray
    remaining: FloatArray


class Turned(NamedTuple):
    """Derivatives of the state, which go along; each direction has a lane.

    Attributes
    ----------
    modes
        (columns, 2, modes): a column for each direction. Where the speed changes, then those of the march itself, and
        one of scratch.
    bodies, began
        (states, LANES), (contacts, LANES).
    shifts
        How the path's table has moved under each contact, m, (contacts, LANES).
    pressed
        Force at the end of each contact's last part, (contacts,).
    """

    modes: FloatArray
    bodies: FloatArray
    began: FloatArray
    shifts: FloatArray
    pressed: FloatArray


class Posed(NamedTuple):
    """The parts and events of a macro step, ready for all directions: of contact, part (or event) and so on.

    Attributes
    ----------
    counts
        Parts and events of each contact, (contacts, 2).
    rows
        Their logged rows, (contacts, parts).
    P, pace, J, K, slope, viscous
        As in `Room`, J factorised; K where a law depends on the rate.
    smoothly
        Whether the rate is taken from the nodes alone.
    given, direct
        Right-hand side, and N_p, (contacts, parts, nodes, LANES).
    jumps, drop, moved, risen
        Whether the path jumps where a part begins, by how much the force drops there, how far its beginning moves, and
        the gap there rises at fixed moments.
    after, events, steep, bend, leaps
        Of the events: behind how many parts, logged row, D' and D'', and whether it is at a jump of the path, or of a
        law that would pull: such an event's time has no derivative.
    raised
        Change of the gap and of its slope at fixed moments, (contacts, events, 2, LANES).
    forces
        The solution, (contacts, parts, nodes, LANES).
    """

    counts: IntArray
    rows: IntArray
    P: FloatArray
    pace: FloatArray
    J: FloatArray
    K: FloatArray
    r: FloatArray
    slope: FloatArray
    viscous: FloatArray
    smoothly: IntArray
    given: FloatArray
    direct: FloatArray
    jumps: IntArray
    drop: FloatArray
    moved: FloatArray
    risen: FloatArray
    after: IntArray
    events: IntArray
    steep: FloatArray
    bend: FloatArray
    leaps: IntArray
    raised: FloatArray
    forces: FloatArray


class Logged(NamedTuple):
    """Which logged rows and events a contact has in a macro step: the first, and the one behind the last."""

    first_row: int
    end_row: int
    first_event: int
    end_event: int


class Part(NamedTuple):
    """A part of a macro step with contact.

    Attributes
    ----------
    i, k, p
        Its contact, its place among the contact's parts, and the phase of the macro step.
    n, nodes
        Its nodes.
    rated
        Whether the law depends on the rate.
    """

    i: int
    k: int
    p: int
    n: int
    nodes: Nodes
    rated: bool


class Carried(NamedTuple):
    """What directions carry over a macro step.

    Attributes
    ----------
    free, change
        Of c, without and with the forces of other contacts, (contacts, q, LANES).
    moments
        Of the forces, (contacts, q, LANES).
    began
        Of the indentation at the part's start, (contacts, LANES).
    felt
        At the nodes, of other contacts, (contacts, q, LANES).
    steps, sizes
        By how much the last sweep has changed what contacts feel, and its size, (LANES,).
    shares
        As in `Stage`, (contacts, q, q, LANES).
    base, sums
        The same of the forces themselves, (contacts, q, q), and scratch of one contact, (q, q).
    gap, delta, bodies
        Scratch memory: (q, LANES), (nodes, LANES), (states, LANES).
    seen, written, rows
        Scratch memory of the modes: (columns, q) twice, (q, 2, modes).
    """

    free: FloatArray
    change: FloatArray
    moments: FloatArray
    began: FloatArray
    felt: FloatArray
    steps: FloatArray
    sizes: FloatArray
    shares: FloatArray
    base: FloatArray
    sums: FloatArray
    gap: FloatArray
    delta: FloatArray
    bodies: FloatArray
    seen: FloatArray
    written: FloatArray
    rows: FloatArray


class Told(NamedTuple):
    """What is found: derivatives of logged rows.

    Attributes
    ----------
    forces
        At the nodes of parts, (rows, nodes, LANES).
    moved
        Of where they begin at a breakpoint of the path, parts of a macro step, (rows, LANES).
    drops
        By how much the force drops there, (rows,).
    events
        (events, 2, LANES).
    """

    forces: FloatArray
    moved: FloatArray
    drops: FloatArray
    events: FloatArray


# -- the path ---------------------------------------------------------------------------------------------------------


@uncounted_kernel
def path_bend(pieces: FloatArray, place: Row, x0: float, stride: float, lift: float, theta: float) -> float:
    """Return the second derivative of the path's height by θ, times `lift`."""
    piece = int(place["piece"])
    scale = 1.0 / pieces[piece, contract.SCALE]
    from_centre = x0 - place["shift"] - pieces[piece, contract.CENTRE] + stride * theta
    xi = from_centre * scale
    total = 0.0
    for j in range(int(pieces[piece, contract.DEGREE]), 1, -1):
        total = total * xi + j * (j - 1) * pieces[piece, contract.COEFFICIENT + j]
    number = pieces[piece, contract.WAVENUMBER]
    phase = number * from_centre
    wave = pieces[piece, contract.SINE] * sin(phase) + pieces[piece, contract.COSINE] * cos(phase)
    return lift * stride * stride * (total * scale * scale - number * number * wave)


@uncounted_kernel
def path_turn(pieces: FloatArray, bent: FloatArray, shifted: float, place: Row, x0: float, stride: float, lift: float, theta: float) -> tuple[float, float]:  # fmt: skip  # noqa: E501
    """Return the derivatives of the path's height, times `lift`, and of its slope by θ, at a part θ."""
    piece = int(place["piece"])
    scale = 1.0 / pieces[piece, contract.SCALE]
    from_centre = x0 - place["shift"] - pieces[piece, contract.CENTRE] + stride * theta
    xi = from_centre * scale
    value = 0.0
    slope = 0.0
    for j in range(int(bent[piece, contract.DEGREE]), -1, -1):
        slope = slope * xi + value
        value = value * xi + bent[piece, contract.COEFFICIENT + j]
    slope *= scale
    number = pieces[piece, contract.WAVENUMBER]
    sine = pieces[piece, contract.SINE]
    cosine = pieces[piece, contract.COSINE]
    sine_turn = bent[piece, contract.SINE]
    cosine_turn = bent[piece, contract.COSINE]
    if sine != 0.0 or cosine != 0.0 or sine_turn != 0.0 or cosine_turn != 0.0:
        s = sin(number * from_centre)
        c = cos(number * from_centre)
        faster = bent[piece, contract.WAVENUMBER]
        across = sine * c - cosine * s
        value += sine_turn * s + cosine_turn * c + across * faster * from_centre
        slope += number * (sine_turn * c - cosine_turn * s) + across * faster
        slope -= number * (sine * s + cosine * c) * faster * from_centre
    value *= lift
    slope *= lift * stride
    if shifted != 0.0:
        _, steepness = paths.height_and_slope(pieces, place, x0, stride, lift, theta)
        value -= steepness / stride * shifted
        slope -= path_bend(pieces, place, x0, stride, lift, theta) / stride * shifted
    return value, slope


@uncounted_kernel
def factor_turn(pieces: FloatArray, bent: FloatArray, shifted: float, place: Row, x0: float, stride: float, theta: float) -> float:  # fmt: skip  # noqa: E501
    """Return the derivative of the path's factor on the force, at a part θ."""
    piece = int(place["piece"])
    scale = 1.0 / pieces[piece, contract.SCALE]
    xi = (x0 - place["shift"] - pieces[piece, contract.CENTRE] + stride * theta) * scale
    total = 0.0
    for j in range(int(bent[piece, contract.FACTOR_DEGREE]), -1, -1):
        total = total * xi + bent[piece, contract.FACTOR + j]
    slope = 0.0
    for j in range(int(pieces[piece, contract.FACTOR_DEGREE]), 0, -1):
        slope = slope * xi + j * pieces[piece, contract.FACTOR + j]
    return total - slope * scale * shifted


@uncounted_kernel
def bend_at(theta: float, q: int, a: FloatArray) -> float:
    """Return the second derivative by θ of Σ a_l P_l(2θ - 1)."""
    z = 2.0 * theta - 1.0
    before, value = 1.0, z
    slope_before, slope = 0.0, 1.0
    bend_before, bend = 0.0, 0.0
    total = 0.0
    for m in range(1, q):
        total += a[m] * bend
        later = ((2 * m + 1) * z * value - m * before) / (m + 1)
        slope_later = slope_before + (2 * m + 1) * value
        bend_later = bend_before + (2 * m + 1) * slope
        before, value = value, later
        slope_before, slope = slope, slope_later
        bend_before, bend = bend, bend_later
    return 4.0 * total


@inlined_uncounted_kernel
def _turn_at(direction: int, theta: float, turns: Turns, shifts: FloatArray, site: Site) -> tuple[float, float]:
    """Return the derivatives of the path's height and slope along a direction; zero where it changes no path."""
    if turns.bent[direction] < 0:
        return 0.0, 0.0
    return path_turn(
        site.pieces, turns.bends[turns.bent[direction]], shifts[direction], site.place, site.x0, site.stride,
        site.lift, theta,
    )  # fmt: skip


@inlined_uncounted_kernel
def _answered(theta: float, q: int, kernel_turn: FloatArray, moments: FloatArray, out: FloatArray) -> tuple[float, float]:  # fmt: skip  # noqa: E501
    """Return P(θ)·ΔB·moments, and its derivative by θ."""
    for j in range(q):
        total = 0.0
        for m in range(q):
            total += kernel_turn[j, m] * moments[m]
        out[j] = total
    return local.sum_at(theta, q, out)


# -- posing the parts -------------------------------------------------------------------------------------------------


@inlined_uncounted_kernel
def _edge(n: int, nodes: Nodes, N: FloatArray, sign: float) -> float:
    """Return a force at the end (sign 1) or the start (-1) of its part."""
    total = 0.0
    for m in range(n):
        coefficient = 0.0
        for k in range(n):
            coefficient += nodes.transform[m, k] * N[k]
        total += coefficient if sign > 0.0 or m % 2 == 0 else -coefficient
    return total


@inlined_uncounted_kernel
def _enter(i: int, k: int, theta: float, n: int, nodes: Nodes, row: Row, turns: Turns, shifts: FloatArray, pressed: FloatArray, site: Site, posed: Posed, room: Room) -> bool:  # fmt: skip  # noqa: E501
    """Enter the pieces of the path that begin where part k does; return whether the path jumps there."""
    place, ends = site.place, site.ends
    first, last = ends["begin"], ends["end"]
    jumps = False
    moves = False
    for direction in range(len(turns.bent)):
        posed.moved[i, k, direction] = 0.0
    posed.drop[i, k] = 0.0
    while theta < 1.0 and paths.piece_stop(site.pieces, place, site.x0, site.stride) <= theta + SNAP:
        before = int(place["piece"])
        join = paths.enter_next_piece(site.pieces, first, last, ends["loop"], ends["join"], place)
        if join < 0:
            break
        jumps = jumps or join == contract.JUMP
        piece = int(place["piece"])
        for direction in range(len(turns.bent)):
            if turns.bent[direction] >= 0:
                bent = turns.bends[turns.bent[direction]]
                if piece <= before:
                    shifts[direction] += bent[before, contract.STOP] - bent[piece, contract.START]
                way = bent[piece, contract.START] + shifts[direction]
                if piece <= before or bent[piece, contract.START] != 0.0 or join == contract.JUMP:
                    posed.moved[i, k, direction] = way / site.stride
                    moves = True
    if moves:
        after = 0.0
        if n > 1:
            for j in range(n):
                room.N[j] = row["forces"][j]
            after = _edge(n, nodes, room.N, -1.0)
        posed.drop[i, k] = pressed[i] - after
    return jumps


@inlined_uncounted_kernel
def _is_whole(row: Row, q: int) -> bool:
    """Return True where a logged part is a whole macro step at its own nodes."""
    evenly = row["map"] == EVENLY and row["nodes"] == q
    return evenly and row["from"] == 0.0 and row["to"] == 1.0


@inlined_uncounted_kernel
def _pose(step: int, i: int, logged: Logged, tables: Tables, turns: Turns, data: Data, logs: Logs, motion: Motion, state: Turned, posed: Posed, room: Room) -> None:  # fmt: skip  # noqa: E501
    """Write the linearised problems of a contact's parts in a macro step."""
    q = len(data.macro.places)
    p = step % tables.matrices.shape[1]
    directions = len(turns.bent)
    place = motion.contacts[i]
    speed, phases, seconds = data.settings["speed"], len(tables.which), tables.seconds[tables.which[p]]
    law = data.laws[i]
    site = Site(
        logs.gaps[step, i], tables.kernels[i, p], tables.residual[i, p], data.pieces, place, data.ends[i], law,
        data.table, data.starts[i] + speed * ((step // phases) * tables.clock[phases] + tables.clock[p]),
        speed * seconds, 1.0 / data.settings["length_unit"], seconds,
    )  # fmt: skip
    shifts = state.shifts[i]
    rated = law[LAW_RATED] != 0.0
    paced = rated
    for direction in range(directions):
        paced = paced or turns.laws[direction, i, LAW_LOSS] != 0.0
    room.moments[:q] = 0.0
    event, told = logged.first_event, 0
    count = logged.end_row - logged.first_row
    for k in range(count + 1):
        if k == count and event == logged.end_event:
            break
        row = logs.rows[logged.first_row + min(k, count - 1)]
        n = int(row["nodes"])
        theta = row["from"] if k < count else 2.0
        nodes = data.macro
        if n != q:
            nodes = data.part
        jumps = False
        if k < count:
            posed.rows[i, k] = logged.first_row + k
            posed.jumps[i, k] = 0
            jumps = _enter(i, k, theta, n, nodes, row, turns, shifts, state.pressed, site, posed, room)
        if jumps or event < logged.end_event or not _is_whole(row, q):
            local.free_sum(q, site.c, site.B, room.moments, room.free)
        if jumps:
            posed.jumps[i, k] = 1
            value, _ = local.gap_at(theta, q, room.free, site)
            place["began"] = max(value, 0.0)
            for direction in range(directions):
                risen, _ = _turn_at(direction, theta, turns, shifts, site)
                if turns.structured[direction] != 0:
                    kernel_turn = turns.kernels[direction, i, p % turns.kernels.shape[2]]
                    less, _ = _answered(theta, q, kernel_turn, room.moments, room.spare)
                    risen -= less
                posed.risen[i, k, direction] = risen
        while event < logged.end_event and logs.events[event]["part"] <= theta + AT_PART_END:
            at = logs.events[event]["part"]
            posed.after[i, told] = k
            posed.events[i, told] = event
            posed.steep[i, told] = logs.events[event]["rate"] * site.seconds
            posed.bend[i, told] = bend_at(at, q, room.free) + path_bend(
                site.pieces, place, site.x0, site.stride, site.lift, at
            )
            gap, _ = local.gap_at(at, q, room.free, site)
            posed.leaps[i, told] = STAYS
            if jumps:
                posed.leaps[i, told] = LEAPS
            elif gap > INDENTED:
                posed.leaps[i, told] = PULLS_THERE
            for direction in range(directions):
                value, slope = _turn_at(direction, at, turns, shifts, site)
                if turns.structured[direction] != 0:
                    kernel_turn = turns.kernels[direction, i, p % turns.kernels.shape[2]]
                    less, less_steep = _answered(at, q, kernel_turn, room.moments, room.spare)
                    value -= less
                    slope -= less_steep
                posed.raised[i, told, OF_TIME, direction] = value
                posed.raised[i, told, OF_SIZE, direction] = slope
            if not jumps:
                place["began"] = gap if gap > INDENTED else 0.0
            event += 1
            told += 1
        if k == count:
            break
        state.pressed[i] = 0.0
        if n == 1:
            continue
        part = Part(i, k, p, n, nodes, rated)
        _pose_part(part, row, paced, tables, turns, data, shifts, site, posed, room)
        state.pressed[i] = _edge(n, nodes, room.N, 1.0)
        for j in range(n):
            share = nodes.weights[j] * room.pace[j] * room.N[j]
            for m in range(q):
                room.moments[m] += share * room.P[j, m]
        if paced:
            place["began"] = local.end_indentation(n, nodes, place, room)
    posed.counts[i, ROWS_NOW] = count
    posed.counts[i, EVENTS_NOW] = told


@inlined_uncounted_kernel
def _pose_part(part: Part, row: Row, paced: bool, tables: Tables, turns: Turns, data: Data, shifts: FloatArray, site: Site, posed: Posed, room: Room) -> None:  # fmt: skip  # noqa: E501
    """Write the linearised problem of one part; its forces are in `room.N`."""
    i, k, p, n, nodes, rated = part
    q = len(data.macro.places)
    how = int(row["map"])
    origin, span = row["origin"], row["span"]
    whole = _is_whole(row, q)
    for a in range(n):
        room.N[a] = row["forces"][a]
    if whole:
        paths.heights(
            site.pieces, site.place, site.x0, site.stride, site.lift, n, nodes.places, room.height, room.factor
        )
        for a in range(n):
            room.theta[a] = nodes.places[a]
            room.pace[a] = 1.0
            room.r[a] = tables.residual_nodes[i, p, a]
            total = room.height[a]
            for m in range(q):
                room.P[a, m] = nodes.values[a, m]
                room.K[a, m] = tables.matrices[i, p, a, m]
                total += nodes.values[a, m] * site.c[m]
            room.d[a] = total
    else:
        local.pose_part(nodes, q, how, origin, span, row["s0"], row["s1"], site, room)
    for a in range(n):
        total = room.d[a] - room.r[a] * room.N[a]
        for b in range(n):
            total -= room.K[a, b] * room.N[b]
        room.delta[a] = total
        room.rate[a] = 0.0
    slopes = nodes.slopes
    smoothly = 0
    if paced:
        forces(
            site.law, site.table, site.place["stretch"], n, room.delta, room.rate, room.left, room.factor,
            room.F, room.slope, room.viscous,
        )  # fmt: skip
        if rated and 0.0 < local.lag(n, site.seconds, room) < local.SHORT_LAG:
            slopes = nodes.own_slopes
            smoothly = 1
        site.place["lags"] = 1.0 - smoothly
        local.rates(n, slopes, site.place["began"], site.seconds, room)
    forces(
        site.law, site.table, site.place["stretch"], n, room.delta, room.rate, room.left, room.factor, room.F,
        room.slope, room.viscous,
    )  # fmt: skip
    local.jacobian(n, slopes, site.seconds, rated, room)
    factorise(room.J, n)
    posed.smoothly[i, k] = smoothly
    for a in range(n):
        posed.pace[i, k, a] = room.pace[a]
        posed.slope[i, k, a] = room.slope[a]
        posed.viscous[i, k, a] = room.viscous[a] / (room.pace[a] * site.seconds) if rated else 0.0
        posed.r[i, k, a] = room.r[a]
        for m in range(q):
            posed.P[i, k, a, m] = room.P[a, m]
        for b in range(n):
            posed.J[i, k, a, b] = room.J[a, b]
        if rated:
            for b in range(n):
                posed.K[i, k, a, b] = room.K[a, b]
    structured = False
    for direction in range(len(turns.bent)):
        structured = structured or turns.structured[direction] != 0
    if structured and not whole:
        _moments_at_nodes(n, q, nodes, room)
    for direction in range(len(turns.bent)):
        _pose_direction(direction, q, whole, part, turns, shifts, site, posed, room)


@uncounted_kernel
def _moments_at_nodes(n: int, q: int, nodes: Nodes, room: Room) -> None:
    """Write the moments of the force up to each node of a part in `room.T`, (node, moment)."""
    for a in range(n):
        for m in range(q):
            room.T[a, m] = room.moments[m]
        for b in range(n):
            share = nodes.integrals[a, b] * room.pace[b] * room.N[b]
            for m in range(q):
                room.T[a, m] += share * room.P[b, m]


@inlined_uncounted_kernel
def _pose_direction(direction: int, q: int, whole: bool, part: Part, turns: Turns, shifts: FloatArray, site: Site, posed: Posed, room: Room) -> None:  # fmt: skip  # noqa: E501
    """Write N_p and the right-hand side of one part along a direction, without what was before this macro step.

    `room.T` holds the moments at the nodes, if any direction changes the structure and the part is no `whole` step.
    """
    i, k, p, n, _, rated = part
    given, direct = posed.given[i, k], posed.direct[i, k]
    stronger = turns.laws[direction, i, LAW_CONSTANT]
    lossier = turns.laws[direction, i, LAW_LOSS]
    slower = turns.seconds[direction]
    bent = turns.bent[direction]
    plain = stronger == 0.0 and lossier == 0.0
    factored = bent >= 0 and site.pieces[int(site.place["piece"]), contract.FACTOR_DEGREE] >= 0.0
    if not plain:
        stronger /= site.law[LAW_CONSTANT]
    for a in range(n):
        total = 0.0
        if not plain:
            total = room.N[a] * stronger
            if lossier != 0.0:
                total += room.N[a] * lossier * room.rate[a] / (1.0 + site.law[LAW_LOSS] * room.rate[a])
        if rated and slower != 0.0:
            total -= room.viscous[a] * room.rate[a] * slower
        if factored:
            more = factor_turn(
                site.pieces, turns.bends[bent], shifts[direction], site.place, site.x0, site.stride, room.theta[a]
            )
            total += room.N[a] / room.factor[a] * more
        direct[a, direction] = total
        given[a, direction] = 0.0
    if bent >= 0:
        for a in range(n):
            given[a, direction], _ = _turn_at(direction, room.theta[a], turns, shifts, site)
    if not plain or factored or (rated and slower != 0.0):
        for a in range(n):
            total = room.r[a] * direct[a, direction]
            for b in range(n):
                total += room.K[a, b] * direct[b, direction]
            given[a, direction] -= total
    if turns.structured[direction] == 0:
        return
    if whole:
        matrix = turns.matrices[direction, i, p % turns.matrices.shape[2]]
        for a in range(n):
            total = 0.0
            for b in range(n):
                total += matrix[a, b] * room.N[b]
            given[a, direction] -= total
        return
    kernel_turn = turns.kernels[direction, i, p % turns.kernels.shape[2]]
    for a in range(n):
        for j in range(q):
            total = 0.0
            for m in range(q):
                total += kernel_turn[j, m] * room.T[a, m]
            given[a, direction] -= room.P[a, j] * total


# -- carrying directions over the parts -------------------------------------------------------------------------------


@inlined_uncounted_kernel
def _sum_at(direction: int, theta: float, q: int, a: FloatArray, out: FloatArray) -> tuple[float, float]:
    """Do as `local.sum_at` with one lane of coefficients, (q, LANES)."""
    for j in range(q):
        out[j] = a[j, direction]
    return local.sum_at(theta, q, out)


@inlined_uncounted_kernel
def _gap_of(q: int, fresh: bool, i: int, p: int, tables: Tables, carried: Carried) -> None:
    """Write c - B·moments of all lanes; `fresh` where there are no moments yet."""
    B, c, m, f = tables.kernels[i, p], carried.change[i], carried.moments[i], carried.gap
    for j in range(q):
        for lane in range(LANES):
            f[j, lane] = c[j, lane]
    if fresh:
        return
    for k in range(q):
        for j in range(q):
            answer = B[j, k]
            for lane in range(LANES):
                f[j, lane] -= answer * m[k, lane]


@inlined_uncounted_kernel
def _press(k: int, i: int, q: int, rated: bool, data: Data, logs: Logs, posed: Posed, carried: Carried) -> None:
    """Solve a part along all directions, from the gap's coefficients; write its forces, and add to the moments."""
    m, f, x, began = carried.moments[i], carried.gap, carried.delta, carried.began[i]
    n = int(logs.rows[posed.rows[i, k]]["nodes"])
    nodes = data.macro
    if n != q:
        nodes = data.part
    slopes = nodes.slopes
    if posed.smoothly[i, k] != 0:
        slopes = nodes.own_slopes
    P, given, direct, N = posed.P[i, k], posed.given[i, k], posed.direct[i, k], posed.forces[i, k]
    for a in range(n):
        for lane in range(LANES):
            x[a, lane] = given[a, lane]
    for j in range(q):
        for a in range(n):
            value = P[a, j]
            for lane in range(LANES):
                x[a, lane] += value * f[j, lane]
    if rated:
        for a in range(n):
            share = posed.viscous[i, k, a] * slopes[a, BEGIN]
            for lane in range(LANES):
                x[a, lane] -= posed.r[i, k, a] * share * began[lane]
            for b in range(n):
                for lane in range(LANES):
                    x[b, lane] -= posed.K[i, k, b, a] * share * began[lane]
    solve_lanes(posed.J[i, k], n, x)
    for a in range(n):
        slope = posed.slope[i, k, a]
        for lane in range(LANES):
            N[a, lane] = slope * x[a, lane] + direct[a, lane]
    if rated:
        for a in range(n):
            viscous = posed.viscous[i, k, a]
            for lane in range(LANES):
                N[a, lane] += viscous * slopes[a, BEGIN] * began[lane]
            for b in range(n):
                share = viscous * slopes[a, b + 1]
                for lane in range(LANES):
                    N[a, lane] += share * x[b, lane]
        smoothly = posed.smoothly[i, k] != 0
        for lane in range(LANES):
            began[lane] *= 0.0 if smoothly else nodes.reach[BEGIN]
        for a in range(n):
            share = nodes.end[a] if smoothly else nodes.reach[a + 1]
            for lane in range(LANES):
                began[lane] += share * x[a, lane]
    for a in range(n):
        weight = nodes.weights[a] * posed.pace[i, k, a]
        for j in range(q):
            share = weight * P[a, j]
            for lane in range(LANES):
                m[j, lane] += share * N[a, lane]


@inlined_uncounted_kernel
def _carry(i: int, p: int, tables: Tables, turns: Turns, data: Data, logs: Logs, state: Turned, posed: Posed, carried: Carried, told: Told, room: Room) -> None:  # fmt: skip  # noqa: E501
    """Solve the parts of a contact along all directions, from their change of c; write moments, forces and events."""
    q, directions = len(data.macro.places), len(turns.bent)
    seconds = tables.seconds[tables.which[p]]
    rated = data.laws[i, LAW_RATED] != 0.0
    m, f, began = carried.moments[i], carried.gap, carried.began[i]
    for j in range(q):
        for lane in range(LANES):
            m[j, lane] = 0.0
    for lane in range(LANES):
        began[lane] = state.began[i, lane]
    event, fresh = 0, True
    parts, events = posed.counts[i, ROWS_NOW], posed.counts[i, EVENTS_NOW]
    for k in range(parts + 1):
        if k == parts and event == events:
            break
        if k < parts and posed.drop[i, k] != 0.0:
            fresh = False
            room.theta[BEGIN] = logs.rows[posed.rows[i, k]]["from"]
            local.legendre_rows(1, room.theta, q, room.P)
            for j in range(q):
                for lane in range(LANES):
                    m[j, lane] += posed.drop[i, k] * posed.moved[i, k, lane] * room.P[BEGIN, j]
        _gap_of(q, fresh, i, p, tables, carried)
        if k < parts and posed.jumps[i, k] != 0:
            theta = logs.rows[posed.rows[i, k]]["from"]
            for direction in range(directions):
                value, _ = _sum_at(direction, theta, q, f, room.free)
                began[direction] = value + posed.risen[i, k, direction]
        while event < events and posed.after[i, event] == k:
            row = posed.events[i, event]
            at, leaps = logs.events[row]["part"], posed.leaps[i, event]
            for direction in range(directions):
                value, slope = _sum_at(direction, at, q, f, room.free)
                value += posed.raised[i, event, OF_TIME, direction]
                slope += posed.raised[i, event, OF_SIZE, direction]
                later = -value / posed.steep[i, event]
                if leaps == LEAPS:
                    later = posed.moved[i, k, direction]
                elif leaps == PULLS_THERE:
                    later = np.nan
                slope += posed.bend[i, event] * later - posed.steep[i, event] * turns.seconds[direction]
                told.events[row, OF_TIME, direction] = later
                told.events[row, OF_SIZE, direction] = slope / seconds
                if leaps != LEAPS:
                    hits = logs.events[row]["kind"] == contract.IMPACT
                    began[direction] = value if hits else 0.0
            event += 1
        if k < parts and logs.rows[posed.rows[i, k]]["nodes"] != 1.0:
            _press(k, i, q, rated, data, logs, posed, carried)
            fresh = False


@inlined_uncounted_kernel
def _share_of(i: int, direction: int, base: bool, data: Data, logs: Logs, posed: Posed, carried: Carried, room: Room) -> None:  # fmt: skip  # noqa: E501
    """Write in `carried.sums` what others feel of a contact's change of force, or with `base` of its force."""
    q = len(data.macro.places)
    room.moments[:q] = 0.0
    node = 0
    for k in range(posed.counts[i, ROWS_NOW]):
        row = logs.rows[posed.rows[i, k]]
        n = int(row["nodes"])
        if not base and posed.drop[i, k] != 0.0:
            room.theta[BEGIN] = row["from"]
            local.legendre_rows(1, room.theta, q, room.P)
            for j in range(q):
                room.moments[j] += posed.drop[i, k] * posed.moved[i, k, direction] * room.P[BEGIN, j]
        if n == 1:
            while node < q and data.macro.places[node] <= row["to"]:
                copy(room.moments[:q], carried.sums[node])
                node += 1
            continue
        nodes = data.macro
        if n != q:
            nodes = data.part
        for a in range(n):
            room.N[a] = row["forces"][a] if base else posed.forces[i, k, a, direction]
            room.pace[a] = posed.pace[i, k, a]
            for j in range(q):
                room.P[a, j] = posed.P[i, k, a, j]
        node = share_part(node, row["to"], nodes, data.macro, q, row, room, carried.sums)
        for a in range(n):
            share = nodes.weights[a] * room.pace[a] * room.N[a]
            for j in range(q):
                room.moments[j] += share * room.P[a, j]
    while node < q:
        copy(room.moments[:q], carried.sums[node])
        node += 1


@uncounted_kernel
def _share_of_parts(i: int, direction: int, data: Data, logs: Logs, posed: Posed, carried: Carried, room: Room) -> None:
    """Write what others feel of a contact with events, along one direction."""
    q = len(data.macro.places)
    _share_of(i, direction, False, data, logs, posed, carried, room)
    for k in range(q):
        for m in range(q):
            total = 0.0
            for j in range(q):
                total += carried.sums[k, j] * data.macro.transform[j, m]
            carried.shares[i, k, m, direction] = total


@uncounted_kernel
def _share_base(i: int, data: Data, logs: Logs, posed: Posed, carried: Carried, room: Room) -> None:
    """Write what others feel of a contact's force."""
    q = len(data.macro.places)
    _share_of(i, BEGIN, True, data, logs, posed, carried, room)
    for k in range(q):
        for m in range(q):
            total = 0.0
            for j in range(q):
                total += carried.sums[k, j] * data.macro.transform[j, m]
            carried.base[i, k, m] = total


@inlined_uncounted_kernel
def _share(i: int, directions: int, data: Data, logs: Logs, posed: Posed, carried: Carried, room: Room) -> None:
    """Write what others feel of a contact's change of force."""
    q = len(data.macro.places)
    if posed.counts[i, ROWS_NOW] != 1 or posed.drop[i, BEGIN] != 0.0 or not _is_whole(logs.rows[posed.rows[i, BEGIN]], q):  # fmt: skip  # noqa: E501
        for direction in range(directions):
            _share_of_parts(i, direction, data, logs, posed, carried, room)
        return
    for k in range(q):
        for m in range(q):
            share = data.macro.integrals[k, m]
            for lane in range(LANES):
                carried.shares[i, k, m, lane] = share * posed.forces[i, BEGIN, m, lane]


@inlined_uncounted_kernel
def _feel(i: int, p: int, tables: Tables, turns: Turns, data: Data, carried: Carried) -> float:
    """Write what a contact feels of others along all directions, and its change of c; return by how much it changes."""
    q = len(data.macro.places)
    felt, change, contacts = carried.felt[i], carried.change[i], len(carried.felt)
    most = 0.0
    for k in range(q):
        total = carried.delta[BEGIN]
        for lane in range(LANES):
            total[lane] = 0.0
        for j in range(contacts):
            if tables.coupled[i, j] != 0:
                for m in range(q):
                    answer = tables.cross[i, j, p, k, m]
                    for lane in range(LANES):
                        total[lane] += answer * carried.shares[j, k, m, lane]
                for direction in range(len(turns.bent)):
                    if turns.structured[direction] != 0:
                        crossed = turns.cross[direction, i, j, p % turns.cross.shape[3]]
                        for m in range(q):
                            total[direction] += crossed[k, m] * carried.base[j, k, m]
        for lane in range(LANES):
            step = abs(total[lane] - felt[k, lane])
            most = max(most, step)
            carried.steps[lane] = max(carried.steps[lane], step)
            carried.sizes[lane] = max(carried.sizes[lane], abs(total[lane]))
            felt[k, lane] = total[lane]
    for m in range(q):
        for lane in range(LANES):
            change[m, lane] = carried.free[i, m, lane]
        for k in range(q):
            share = data.macro.transform[m, k]
            for lane in range(LANES):
                change[m, lane] -= share * felt[k, lane]
        for lane in range(LANES):
            carried.sizes[lane] = max(carried.sizes[lane], abs(change[m, lane]))
    return most


# -- the structure ----------------------------------------------------------------------------------------------------


@inlined_uncounted_kernel
def _read_turned(step: int, i: int, tables: Tables, turns: Turns, motion: Motion, state: Turned, carried: Carried) -> None:  # fmt: skip  # noqa: E501
    """Write the change of a contact's free motion, along all directions."""
    directions, q, free = len(turns.bent), carried.free.shape[1], carried.free[i]
    length = tables.which[step % len(tables.which)]
    for m in range(q):
        for lane in range(LANES):
            free[m, lane] = 0.0
        for s in range(len(motion.bodies)):
            shown = tables.bodies_read[length, i, m, s]
            for lane in range(LANES):
                free[m, lane] += shown * state.bodies[s, lane]
    for direction in range(directions):
        if turns.structured[direction] != 0:
            for m in range(q):
                for s in range(len(motion.bodies)):
                    free[m, direction] += turns.bodies_read[direction, length, i, m, s] * motion.bodies[s]
    if state.modes.shape[2] == 0:
        return
    rows = tables.reads[tables.sets[i], (tables.phase[i] + step) % tables.reads.shape[1]]
    if i == 0:
        modal.read_lanes(rows, tables.first, state.modes, carried.seen)
    else:
        modal.seen_from_first(rows, tables.turns[bays_ahead(step, i, tables)], carried.rows)
        modal.read_lanes(carried.rows, tables.first, state.modes, carried.seen)
    for direction in range(directions):
        for m in range(q):
            free[m, direction] += carried.seen[direction, m]
        if turns.seconds[direction] != 0.0:
            for m in range(q):
                total = 0.0
                for j in range(q):
                    total += turns.later[m, j] * carried.seen[directions + 1, j]
                free[m, direction] += turns.seconds[direction] * total


@inlined_uncounted_kernel
def _write_bodies(length: int, tables: Tables, turns: Turns, motion: Motion, moments: FloatArray, state: Turned, carried: Carried) -> None:  # fmt: skip  # noqa: E501
    """Move the change of the bodies over a macro step; `moments` are those of the forces, `motion` before it.

    `length` tells which length the macro step has.
    """
    contacts, states, q = len(moments), len(motion.bodies), moments.shape[1]
    spare = carried.bodies
    for s in range(states):
        for lane in range(LANES):
            spare[s, lane] = 0.0
        for j in range(states):
            share = tables.bodies_step[length, s, j]
            for lane in range(LANES):
                spare[s, lane] += share * state.bodies[j, lane]
    for i in range(contacts):
        for m in range(q):
            for s in range(states):
                share = tables.bodies_write[length, i, m, s]
                for lane in range(LANES):
                    spare[s, lane] += share * carried.moments[i, m, lane]
    for direction in range(len(turns.bent)):
        if turns.structured[direction] != 0:
            for s in range(states):
                for j in range(states):
                    spare[s, direction] += turns.bodies_step[direction, length, s, j] * motion.bodies[j]
                for i in range(contacts):
                    for m in range(q):
                        spare[s, direction] += moments[i, m] * turns.bodies_write[direction, length, i, m, s]
    for s in range(states):
        for lane in range(LANES):
            state.bodies[s, lane] = spare[s, lane]


@inlined_uncounted_kernel
def _write_turned(step: int, marched: bool, tables: Tables, turns: Turns, moments: FloatArray, state: Turned, carried: Carried) -> None:  # fmt: skip  # noqa: E501
    """Move the change of modes over a macro step, along all directions; `marched`: the modes themselves, too."""
    phases, q, directions = tables.reads.shape[1], moments.shape[1], len(turns.bent)
    modes, written = state.modes, carried.written
    moving, length = directions + 1 if marched else directions, tables.which[step % len(tables.which)]
    for column in range(moving):
        modal.turn(tables.decay[length], modes[column, RE], modes[column, IM])
    if marched:
        copy(modes[directions], modes[directions + 1])
    for i in range(len(moments)):
        for direction in range(directions):
            slower = turns.seconds[direction]
            for m in range(q):
                written[direction, m] = carried.moments[i, m, direction] + slower * moments[i, m]
        if marched:
            for m in range(q):
                total = 0.0
                for j in range(q):
                    total += turns.remaining[m, j] * moments[i, j]
                written[directions, m] = moments[i, m]
                written[directions + 1, m] = total
        rows = tables.writes[tables.sets[i], (tables.phase[i] + step) % phases]
        if i == 0:
            modal.write_lanes(rows, tables.first, written, modes)
        else:
            modal.seen_from_first(rows, tables.turns[bays_ahead(step, i, tables)], carried.rows)
            modal.write_lanes(carried.rows, tables.first, written, modes)
    if marched:
        re, im = modes[directions + 1, RE], modes[directions + 1, IM]
        modal.turn(turns.rates[length], re, im)
        for direction in range(directions):
            slower = turns.seconds[direction]
            if slower != 0.0:
                to_re, to_im = modes[direction, RE], modes[direction, IM]
                for n in range(len(re)):
                    to_re[n] += slower * re[n]
                    to_im[n] += slower * im[n]
    if (tables.phase[BEGIN] + step + 1) % phases == 0:
        for column in range(moving):
            modal.turn(tables.turns[1 % tables.turns.shape[0]], modes[column, RE], modes[column, IM])


@inlined_uncounted_kernel
def _tell(i: int, directions: int, logs: Logs, posed: Posed, told: Told) -> None:
    """Write what is found of a contact's parts."""
    for k in range(posed.counts[i, ROWS_NOW]):
        at = posed.rows[i, k]
        told.drops[at] = posed.drop[i, k]
        for direction in range(directions):
            told.moved[at, direction] = posed.moved[i, k, direction]
        n = int(logs.rows[at]["nodes"])
        if n > 1:
            for a in range(n):
                for lane in range(LANES):
                    told.forces[at, a, lane] = posed.forces[i, k, a, lane]


@uncounted_kernel
def tangent_kernel(tables: Tables, turns: Turns, data: Data, logs: Logs, motion: Motion, state: Turned, posed: Posed, carried: Carried, told: Told, room: Room) -> bool:  # fmt: skip  # noqa: E501
    """Carry some directions along a march from its start; return False where contacts do not settle with each other."""
    contacts, directions = len(motion.contacts), len(turns.bent)
    phases = tables.matrices.shape[1]
    shared = contacts > 1
    marched, crossed = False, False
    for direction in range(directions):
        marched = marched or turns.seconds[direction] != 0.0
        crossed = crossed or turns.structured[direction] != 0
    row, event = 0, 0
    for step in range(len(logs.moments)):
        p = step % phases
        copy(logs.bodies[step], motion.bodies)
        if marched:
            plain, scratch = state.modes[directions], state.modes[directions + 1]
            modal.turned(
                turns.rates[tables.which[p % len(tables.which)]], plain[RE], plain[IM], scratch[RE], scratch[IM]
            )
        for i in range(contacts):
            first_row, first_event = row, event
            while row < len(logs.rows) and logs.rows[row]["step"] == step and logs.rows[row]["contact"] == i:  # fmt: skip  # noqa: E501
                row += 1
            while event < len(logs.events) and logs.events[event]["step"] == step and logs.events[event]["contact"] == i:  # fmt: skip  # noqa: E501
                event += 1
            _read_turned(step, i, tables, turns, motion, state, carried)
            _pose(
                step, i, Logged(first_row, row, first_event, event), tables, turns, data, logs, motion, state, posed,
                room,
            )  # fmt: skip
            if shared and crossed:
                _share_base(i, data, logs, posed, carried, room)
        if shared:
            carried.felt[:] = 0.0
            carried.shares[:] = 0.0
        settled = False
        for sweep in range(MOST_TURN_SWEEPS):
            carried.steps[:] = 0.0
            carried.sizes[:] = 0.0
            for i in range(contacts):
                changed = 0.0
                if shared:
                    changed = _feel(i, p, tables, turns, data, carried)
                else:
                    copy(carried.free[i], carried.change[i])
                if sweep == 0 or changed > 0.0:
                    _carry(i, p, tables, turns, data, logs, state, posed, carried, told, room)
                    if shared:
                        _share(i, directions, data, logs, posed, carried, room)
            settled = True
            for lane in range(LANES):
                settled = settled and carried.steps[lane] <= SETTLED * carried.sizes[lane]
            if settled:
                break
        if not settled:
            return False
        copy(carried.began, state.began)
        for i in range(contacts):
            _tell(i, directions, logs, posed, told)
        _write_bodies(tables.which[p % len(tables.which)], tables, turns, motion, logs.moments[step], state, carried)
        if state.modes.shape[2] > 0:
            _write_turned(step, marched, tables, turns, logs.moments[step], state, carried)
    return True
