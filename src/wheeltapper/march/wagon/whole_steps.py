"""A macro step of a vehicle on rails that give way, solved at once: collocation at Gauss's nodes.

While nothing happens, all that moves is smooth over a macro step, but too fast for the steps of an explicit method: the
rails ring up to their highest mode. At the Gauss nodes of the step the rails' deflections are known numbers and a
matrix times the forces at all nodes. The motion at the nodes follows from the rates there, and these from the motion:

1. velocities are integrals of accelerations from the step's start to the nodes, displacements those of velocities;
2. the rails' deflections, by the present forces, and the gaps;
3. the forces of each wheel at all nodes together, with what they do to its own gap, by the rail below it and by the
   wheelset. By itself this would settle slowly;
4. creep, elements, suspension: new accelerations. Where creep makes the turns settle slowly, as it does at low speeds
   and with the spin of the wheelsets, their change is solved with what it does to the creep forces.

Some three such turns do. A step in which something may happen, whose forces have not settled, or are not smooth enough
for the nodes, is left to the march that locates events (`multibody`).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from wheeltapper.march.common.kernel import inlined_uncounted_kernel, kernel, uncounted_kernel
from wheeltapper.march.common.program import SOFT, FloatArray, IntArray
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import passing, sliders
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import HALF, LANES, PLACES, ROLL, TO_RATE
from wheeltapper.march.wagon.contact_laws import push
from wheeltapper.march.wagon.crossing import corner_ahead
from wheeltapper.march.wagon.elements import deflection
from wheeltapper.march.wagon.rail_answers import places_of
from wheeltapper.march.wagon.rail_motion import is_flanged, press_octet
from wheeltapper.march.wagon.rates import add_element_forces, body_rates
from wheeltapper.march.wagon.voids import four_of, void_number
from wheeltapper.march.wagon.wheel_paths import evaluate_paths, gather_motions, set_piece
from wheeltapper.march.wagon.wheels import add_body_forces, creep_forces, normal_forces

MOST_ROUNDS = 9
"""Turns after which a step is given up."""
NODES_SETTLED = 3e-8
"""Error of the forces and of the states' changes that ends the turns, by how fast these have become smaller: static
forces, and scales of the states."""
FIRST_TURNS = 2
"""Turns whose changes are not compared: those of the first ones are as large as Newton's corrections leave them."""
POOR = 0.03
"""Ratio of the changes of the states in two turns from which on slips are damped."""
TAIL = 1e-6
"""Largest of the last two Legendre coefficients of a force, in static forces."""
MOST_CORRECTIONS = 5
ROUGHLY, CORRECTED = 1e-3, 1e-6
"""Newton's corrections of the forces of a wheel in a turn, and those that end them in the first turn and in later ones,
in static forces; the error is their square or, with the matrix of the turn before, some hundredth of them."""
NODE_PLACES, NODE_WEIGHTS, NODE_MATRICES = range(3)
NODE_VALUES, NODE_TRANSFORM, NODE_INTEGRALS, NODE_TWICE, NODE_BERNSTEIN, NODE_SLOPES = range(6)
"""Rows of the packed matrices of the nodes, and the matrices by number."""
FIRST_NODE = 0
INSIDE = 1.0 - 1e-9
"""Place in a step before which a path's break is within it; a later one is at its end."""
CONSTANT, LINEAR = range(2)
"""Legendre polynomials."""
LEFT_AND_RIGHT, LEFT_OR_RIGHT = range(2)
"""Sums of what both rails do together, and against one another."""
SLIPS_ALONG, SLIPS_ACROSS = range(2)
"""Groups of slips: of both wheels along the rail, together and against one another; and across it."""


class Nodal(NamedTuple):
    """A macro step at its q Gauss nodes: matrices, which are those of `general.records.Nodes`, and what is there."""

    places: FloatArray  # (q,)
    weights: FloatArray  # (q,)
    values: FloatArray  # (q, q)
    transform: FloatArray  # (q, q)
    integrals: FloatArray  # (q, q)
    twice: FloatArray  # (q, q): integrals of integrals
    bernstein: FloatArray  # (q, q)
    slopes: FloatArray  # (q + 2, q): to derivatives at 0, at the nodes and at 1
    states: FloatArray  # (q, states)
    rates: FloatArray  # (q, states)
    before: FloatArray  # (q, states): the rates of the turn before
    paths: FloatArray  # (octets, q, 2·LANES): heights, and the factors on C^(1/3)
    softness: FloatArray  # (treads, q, LANES)
    free: FloatArray  # (treads, q, LANES): deflections without the step's forces
    rails: FloatArray  # (treads, q, LANES): deflections but for the local compliance
    gaps: FloatArray  # (octets, q, LANES): indentations but for the local compliance
    constants: FloatArray  # (octets, q, LANES): C^(1/3)
    forces: FloatArray  # (treads, q, LANES): of a wheel's tread and flange together
    wanted: FloatArray  # (treads, q, LANES): those of the present turn
    depths: FloatArray  # (octets, q, LANES): indentations
    normals: FloatArray  # (octets, q, LANES): forces of treads and flanges
    began: FloatArray  # (octets, 2·LANES): pieces and shifts of the paths at the step's start
    shifts: FloatArray  # (treads, LANES): largest lateral shifts at the nodes
    creep: FloatArray  # (treads, 2, LANES): damping of the wheelsets' slips over their inertia, in a step
    slips: FloatArray  # (treads, 2, q, q, LANES): factors for these
    own: FloatArray  # (treads, q, q, LANES): what a force at a node does to its own gap at a node
    factors: FloatArray  # (treads, q, q, LANES): of Newton's matrix of the forces
    change: FloatArray  # (q, LANES)
    sums: FloatArray  # (2, one)
    solid: FloatArray  # (ways·one²,): what forces at the nodes do to the deflections there, force first
    row: FloatArray  # (one,)
    pulls: FloatArray  # (q, rigid): forces of rigid friction that sticks


@cache
def packed_nodes(count: int) -> FloatArray:
    """Return the matrices of Gauss nodes as rows of one array; of no nodes none."""
    if count == 0:
        return np.zeros((2, 0))
    n = gauss_nodes(count)
    slopes = np.vstack([-n.end_slope[::-1], n.own_slopes[:, 1:], n.end_slope])
    twice = n.integrals @ n.integrals
    return np.vstack([n.places, n.weights, n.values, n.transform, n.integrals, twice, n.bernstein, slopes])


@kernel
def _matrix(number: int, gauss: FloatArray) -> FloatArray:
    """Return one of the packed matrices."""
    q = gauss.shape[1]
    return gauss[NODE_MATRICES + number * q : NODE_MATRICES + (number + 1) * q]


@kernel
def nodal_for(
    gauss: FloatArray, states: int, data: FloatArray, plan: IntArray, wheels: FloatArray, pieces: FloatArray
) -> Nodal:  # fmt: skip
    """Return the matrices, and room."""
    q, octets, treads = gauss.shape[1], wheels.shape[0], int(data[asm.TREADS])
    one = (treads + octets - plan[asm.WHEEL_OCTETS]) * q * HALF
    return Nodal(
        gauss[NODE_PLACES], gauss[NODE_WEIGHTS], _matrix(NODE_VALUES, gauss), _matrix(NODE_TRANSFORM, gauss),
        _matrix(NODE_INTEGRALS, gauss), _matrix(NODE_TWICE, gauss), _matrix(NODE_BERNSTEIN, gauss),
        gauss[NODE_MATRICES + NODE_SLOPES * q :],
        np.zeros((q, states)), np.zeros((q, states)), np.zeros((q, states)), np.zeros((octets, q, 2 * LANES)),
        np.zeros((treads, q, LANES)), np.zeros((treads, q, LANES)), np.zeros((treads, q, LANES)),
        np.zeros((octets, q, LANES)), np.zeros((octets, q, LANES)), np.zeros((treads, q, LANES)),
        np.zeros((treads, q, LANES)), np.zeros((octets, q, LANES)), np.zeros((octets, q, LANES)),
        np.zeros((octets, 2 * LANES)), np.zeros((treads, LANES)), np.zeros((treads, 2, LANES)),
        np.zeros((treads, 2, q, q, LANES)), np.zeros((treads, q, q, LANES)),
        np.zeros((treads, q, q, LANES)), np.zeros((q, LANES)),
        np.zeros((2, one)), np.zeros(2 * one * one), np.zeros(one), np.zeros((q, len(pieces) - plan[asm.RIGID_FROM])),
    )  # fmt: skip


@uncounted_kernel
def _answer_at_nodes(
    values: FloatArray, integrals: FloatArray, answers: FloatArray, row: FloatArray, out: FloatArray
) -> None:  # fmt: skip
    """Write what forces at the nodes do to the deflections at the nodes, from what their moments do.

    Both are flat, of each way; `row` is scratch memory.
    """
    q, one = len(values), len(row)
    fours = one // (q * HALF)
    for way in range(len(answers) // (one * one)):
        begin = way * one * one
        for a in range(fours):
            for k in range(q):
                for b in range(HALF):
                    for n in range(one):
                        row[n] = 0.0
                    for m in range(q):
                        at = begin + ((a * q + m) * HALF + b) * one
                        value = values[k, m]
                        for n in range(one):
                            row[n] += value * answers[at + n]
                    to = begin + ((a * q + k) * HALF + b) * one
                    for c in range(fours):
                        for j in range(q):
                            at = to + (c * q + j) * HALF
                            for d in range(HALF):
                                out[at + d] = 0.0
                            for m in range(q):
                                value = integrals[j, k] * values[j, m]
                                for d in range(HALF):
                                    out[at + d] += value * row[(c * q + m) * HALF + d]


@kernel
def answers_at_nodes(gauss: FloatArray, fours: int, answers: FloatArray, out: FloatArray) -> None:
    """Write what forces at the nodes do to the deflections there, from what moments do, of each place in a bay."""
    q = gauss.shape[1]
    row = np.empty(fours * q * HALF)
    for place in range(len(answers)):
        _answer_at_nodes(_matrix(NODE_VALUES, gauss), _matrix(NODE_INTEGRALS, gauss), answers[place], row, out[place])


@kernel
def keep_pieces(wheels: FloatArray, nodal: Nodal) -> None:
    """Keep on which pieces of their paths the contacts are."""
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            nodal.began[o, i] = wheels[o, wheel.ROW_PIECE + i]
            nodal.began[o, LANES + i] = wheels[o, wheel.ROW_SHIFT + i]


@kernel
def return_to_pieces(data: FloatArray, plan: IntArray, wheels: FloatArray, nodal: Nodal) -> None:
    """Go back to the pieces that were kept."""
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            shift = nodal.began[o, LANES + i]
            if L[wheel.ROW_PIECE + i] != nodal.began[o, i] or L[wheel.ROW_SHIFT + i] != shift:
                L[wheel.ROW_PIECE + i] = nodal.began[o, i]
                L[wheel.ROW_SHIFT + i] = shift
                set_piece(i, data, plan, L)


@kernel
def _know_paths(
    t: float, h: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, nodal: Nodal
) -> bool:  # fmt: skip
    """Write the heights of the paths at the nodes; return False where a path breaks so that these do not tell of it.

    That is a kink, a jump, or a break before the first node or behind the last one.
    """
    last, until = t + INSIDE * h, passing.next_break(data, t, wheels)
    broken = until <= last
    if until <= t + nodal.places[FIRST_NODE] * h:
        return False
    if broken:
        keep_pieces(wheels, nodal)
    for k in range(len(nodal.places)):
        now = t + nodal.places[k] * h
        if broken and passing.pass_breaks(now, data, plan, wheels) != SOFT:
            return_to_pieces(data, plan, wheels, nodal)
            return False
        for o in range(wheels.shape[0]):
            L = wheels[o]
            if L[wheel.AWAKE] == 0.0:
                continue
            evaluate_paths(now, -1, w, L)
            for i in range(LANES):
                nodal.paths[o, k, i] = L[wheel.ROW_PATH + i]
                nodal.paths[o, k, LANES + i] = L[wheel.BULGE + i]
    if broken:
        beyond = passing.next_break(data, t + nodal.places[-1] * h, wheels) <= last
        return_to_pieces(data, plan, wheels, nodal)
        return not beyond
    return True


@uncounted_kernel
def _know_rails(data: FloatArray, plan: IntArray, nodal: Nodal) -> None:
    """Write the local compliance and the free deflections at the nodes."""
    nodes, one, free, local, _, _, _, _, _ = places_of(data, plan)
    for o in range(int(data[asm.TREADS])):
        first = o * nodes * HALF
        for k in range(nodes):
            soft, deflections = nodal.softness[o, k], nodal.free[o, k]
            soft[:] = 0.0
            deflections[:] = 0.0
            for m in range(nodes):
                value = nodal.values[k, m]
                at = first + m * HALF
                for i in range(HALF):
                    soft[i] += value * data[local + at + i]
                    deflections[i] += value * (data[free + at + i] + data[free + one + at + i])
                    deflections[HALF + i] += value * (data[free + at + i] - data[free + one + at + i])
            for i in range(HALF):
                soft[HALF + i] = soft[i]


@uncounted_kernel
def _know_own_answers(
    h: float, solid: FloatArray, data: FloatArray, plan: IntArray, wheels: FloatArray, nodal: Nodal
) -> None:  # fmt: skip
    """Write what a force at a node does to the gap of its own wheel at the nodes: by the rail, and by the wheelset."""
    nodes, one, _, _, _, _, _, _, _ = places_of(data, plan)
    against = int(data[plan[asm.AT_RAILS] + asm.RAIL_AGAINST])
    light = nodal.change[FIRST_NODE]
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        for i in range(LANES):
            mobility = plan[asm.AT_OWN_MOBILITY] + int(L[asm.BODY * LANES + i]) * LANES
            arm = L[wheel.ARM + i]
            light[i] = h * h * (data[mobility + asm.MOTION_Z] + arm * arm * data[mobility + ROLL])
        for k in range(nodes):
            for j in range(nodes):
                own = nodal.own[o, k, j]
                at = (o * nodes + j) * HALF * one + (o * nodes + k) * HALF
                for i in range(HALF):
                    rail = 0.5 * (solid[at + i * (one + 1)] + solid[against + at + i * (one + 1)])
                    own[i] = rail + nodal.twice[k, j] * light[i]
                    own[HALF + i] = rail + nodal.twice[k, j] * light[HALF + i]


@inlined_uncounted_kernel
def _add_four(
    a: float, x: FloatArray, b: float, y: FloatArray, c: float, u: FloatArray, d: float, v: FloatArray, out: FloatArray
) -> None:  # fmt: skip
    for i in range(len(out)):
        out[i] += a * x[i] + b * y[i] + c * u[i] + d * v[i]


@inlined_uncounted_kernel
def _add_two(a: float, x: FloatArray, b: float, y: FloatArray, out: FloatArray) -> None:
    for i in range(len(out)):
        out[i] += a * x[i] + b * y[i]


@uncounted_kernel
def _move_nodes(h: float, bodies: int, behind: int, w: FloatArray, nodal: Nodal) -> None:
    """Write the motion at the nodes, of which there are an even number, from the rates there."""
    q = len(nodal.places)
    for second in range(2):
        for k in range(q):
            out = nodal.states[k, :behind]
            for i in range(behind):
                out[i] = w[i]
            row = nodal.integrals[k]
            for j in range(0, q - 3, 4):
                _add_four(
                    h * row[j], nodal.rates[j, :behind], h * row[j + 1], nodal.rates[j + 1, :behind], h * row[j + 2],
                    nodal.rates[j + 2, :behind], h * row[j + 3], nodal.rates[j + 3, :behind], out,
                )  # fmt: skip
            for j in range(q - q % 4, q, 2):
                _add_two(h * row[j], nodal.rates[j, :behind], h * row[j + 1], nodal.rates[j + 1, :behind], out)
        if second == 0:
            for k in range(q):
                for body in range(bodies):
                    at = body * PLACES
                    for i in range(TO_RATE):
                        nodal.rates[k, at + i] = nodal.states[k, at + TO_RATE + i]


@uncounted_kernel
def _press_rails(solid: FloatArray, data: FloatArray, plan: IntArray, nodal: Nodal) -> None:
    """Write the deflections at the nodes under the present forces."""
    nodes, one, _, _, _, _, _, _, _ = places_of(data, plan)
    against = int(data[plan[asm.AT_RAILS] + asm.RAIL_AGAINST])
    treads = int(data[asm.TREADS])
    together, apart = nodal.sums[LEFT_AND_RIGHT], nodal.sums[LEFT_OR_RIGHT]
    together[:] = 0.0
    apart[:] = 0.0
    for o in range(treads):
        for j in range(nodes):
            for i in range(0, HALF, 2):
                left, right = nodal.forces[o, j, i], nodal.forces[o, j, HALF + i]
                left_2, right_2 = nodal.forces[o, j, i + 1], nodal.forces[o, j, HALF + i + 1]
                at = ((o * nodes + j) * HALF + i) * one
                _add_two(
                    0.5 * (left + right), solid[at : at + one], 0.5 * (left_2 + right_2),
                    solid[at + one : at + 2 * one], together,
                )  # fmt: skip
                at += against
                _add_two(
                    0.5 * (left - right), solid[at : at + one], 0.5 * (left_2 - right_2),
                    solid[at + one : at + 2 * one], apart,
                )  # fmt: skip
    for o in range(treads):
        for k in range(nodes):
            at = (o * nodes + k) * HALF
            for i in range(HALF):
                nodal.rails[o, k, i] = nodal.free[o, k, i] + together[at + i] + apart[at + i]
                nodal.rails[o, k, HALF + i] = nodal.free[o, k, HALF + i] + together[at + i] - apart[at + i]


@inlined_uncounted_kernel
def _measure(
    k: int, o: int, tread: int, data: FloatArray, plan: IntArray, w: FloatArray, nodal: Nodal, L: FloatArray
) -> None:  # fmt: skip
    """Compute an octet's indentations at a node, without local compliance."""
    gather_motions(w, L)
    for i in range(LANES):
        L[wheel.ROW_PATH + i] = nodal.paths[o, k, i]
        L[wheel.BULGE + i] = nodal.paths[o, k, LANES + i]
        L[wheel.ROW_RAIL + i] = nodal.rails[tread, k, i]
    count = plan[asm.CELLS_EACH]
    cells = plan[asm.AT_CELLS] + plan[plan[asm.AT_KINDS] + o] * count * asm.TABLES * asm.TABLE_TERMS
    normal_forces(data[asm.FIRST_SHIFT], data[asm.CELLS_PER_M], data, cells, count, L)


@uncounted_kernel
def _measure_gaps(data: FloatArray, plan: IntArray, wheels: FloatArray, nodal: Nodal) -> None:
    """Write gaps and constants of all contacts at the nodes."""
    treads = int(data[asm.TREADS])
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[wheel.AWAKE] == 0.0:
            continue
        for k in range(len(nodal.places)):
            _measure(k, o, o % treads, data, plan, nodal.states[k], nodal, L)
            for i in range(LANES):
                nodal.gaps[o, k, i] = L[wheel.ROW_DELTA + i]
                nodal.constants[o, k, i] = L[wheel.ROOT_C + i] * L[wheel.BULGE + i]


@uncounted_kernel
def _factorise(M: FloatArray) -> None:
    """Factorise a matrix of each lane in place, without exchanges: it is one and something small or positive."""
    q = M.shape[0]
    for p in range(q):
        for i in range(LANES):
            M[p, p, i] = 1.0 / M[p, p, i]
        for k in range(p + 1, q):
            for i in range(LANES):
                M[k, p, i] *= M[p, p, i]
            for j in range(p + 1, q):
                for i in range(LANES):
                    M[k, j, i] -= M[k, p, i] * M[p, j, i]


@uncounted_kernel
def _substitute(M: FloatArray, x: FloatArray) -> None:
    """Solve with the factors of each lane in place."""
    q = M.shape[0]
    for k in range(1, q):
        for j in range(k):
            for i in range(LANES):
                x[k, i] -= M[k, j, i] * x[j, i]
    for k in range(q - 1, -1, -1):
        for j in range(k + 1, q):
            for i in range(LANES):
                x[k, i] -= M[k, j, i] * x[j, i]
        for i in range(LANES):
            x[k, i] *= M[k, k, i]


@uncounted_kernel
def _solve_wheels(
    o: int, flange: int, anew: bool, enough: float, T: FloatArray, G: FloatArray, nodal: Nodal
) -> None:  # fmt: skip
    """Solve the forces of an octet of wheels at all nodes, with what they do to their own gaps.

    `flange` is the octet of their flanges, -1 where these cannot touch. By Newton's method, whose matrix is made `anew`
    or is that of the turn before; `enough` is the correction that ends it, N.
    """
    q = len(nodal.places)
    forces, wanted, own, M, change = nodal.forces[o], nodal.wanted[o], nodal.own[o], nodal.factors[o], nodal.change
    for k in range(q):
        for i in range(LANES):
            wanted[k, i] = forces[k, i]
    for turn in range(MOST_CORRECTIONS):
        most = 0.0
        for k in range(q):
            sinks = change[k]
            for i in range(LANES):
                sinks[i] = nodal.softness[o, k, i] * wanted[k, i]
                T[wheel.BULGE + i] = 1.0
                T[wheel.ROOT_C + i] = nodal.constants[o, k, i]
            if turn > 0:
                for j in range(q):
                    for i in range(LANES):
                        sinks[i] += own[k, j, i] * (wanted[j, i] - forces[j, i])
            for i in range(LANES):
                pushed, steep = push(i, nodal.gaps[o, k, i] - sinks[i], None, T)
                T[wheel.ROW_EXCESS + i] = pushed - wanted[k, i]
                T[wheel.STEEPNESS + i] = steep
            if flange >= 0:
                for i in range(LANES):
                    G[wheel.BULGE + i] = 1.0
                    G[wheel.ROOT_C + i] = nodal.constants[flange, k, i]
                    pushed, steep = push(i, nodal.gaps[flange, k, i] - sinks[i], None, G)
                    T[wheel.ROW_EXCESS + i] += pushed
                    T[wheel.STEEPNESS + i] += steep
            for i in range(LANES):
                change[k, i] = T[wheel.ROW_EXCESS + i]
            if turn == 0 and anew:
                for j in range(q):
                    for i in range(LANES):
                        M[k, j, i] = T[wheel.STEEPNESS + i] * own[k, j, i]
                for i in range(LANES):
                    M[k, k, i] += 1.0 + T[wheel.STEEPNESS + i] * nodal.softness[o, k, i]
        if turn == 0 and anew:
            _factorise(M)
        _substitute(M, change)
        for k in range(q):
            for i in range(LANES):
                most = max(most, abs(change[k, i]))
                wanted[k, i] = max(wanted[k, i] + change[k, i], 0.0)
        if most <= enough:
            break


@uncounted_kernel
def _first_rates(start: FloatArray, data: FloatArray, plan: IntArray, wheels: FloatArray, nodal: Nodal) -> None:
    """Write rates at the nodes: those at the start, but for what the forces have become."""
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        for i in range(LANES):
            if L[wheel.SIDES + i] == 0.0:
                continue
            body = int(L[asm.BODY * LANES + i])
            at = body * PLACES + TO_RATE
            mobility = plan[asm.AT_OWN_MOBILITY] + body * LANES
            turns = L[wheel.SIDES + i] * L[wheel.ARM + i] * data[mobility + ROLL]
            for k in range(len(nodal.places)):
                more = nodal.wanted[o, k, i] - nodal.forces[o, k, i]
                nodal.rates[k, at + asm.MOTION_Z] += data[mobility + asm.MOTION_Z] * more
                nodal.rates[k, at + ROLL] += turns * more


@uncounted_kernel
def _rates_at_nodes(
    data: FloatArray, plan: IntArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray, nodal: Nodal
) -> None:  # fmt: skip
    """Write the rates at the nodes under the forces that were solved."""
    q, treads, loads = len(nodal.places), int(data[asm.TREADS]), plan[asm.AT_LOADS]
    for o in range(treads):
        for k in range(q):
            sinks = nodal.rails[o, k]
            for j in range(q):
                for i in range(LANES):
                    sinks[i] += nodal.own[o, k, j, i] * (nodal.wanted[o, j, i] - nodal.forces[o, j, i])
    nodal.shifts[:] = 0.0
    for k in range(q):
        w, out = nodal.states[k], nodal.rates[k]
        for i in range(Q.shape[0]):
            Q[i] = data[loads + i]
        for o in range(wheels.shape[0]):
            L = wheels[o]
            if L[wheel.AWAKE] == 0.0:
                continue
            tread = o % treads
            _measure(k, o, tread, data, plan, w, nodal, L)
            T = wheels[tread]
            for i in range(LANES):
                T[wheel.SOFTNESS + i] = nodal.softness[tread, k, i]
                T[wheel.ROW_FORCE + i] = nodal.wanted[tread, k, i]
            press_octet(None, T, L)
            inclined = o >= treads
            if not inclined:
                for i in range(LANES):
                    nodal.shifts[o, i] = max(nodal.shifts[o, i], abs(L[wheel.ROW_U + i]))
            elif data[asm.QUASI_STATIC] != 0.0:
                for i in range(LANES):
                    L[wheel.VPITCH + i] = T[wheel.VPITCH + i]
            creep_forces(data, plan, inclined, L)
            add_body_forces(inclined, -1, L, Q)
            for i in range(LANES):
                nodal.depths[o, k, i] = L[wheel.ROW_DELTA + i]
                nodal.normals[o, k, i] = L[wheel.NORMAL + i]
        for i in range(Q.shape[0] * (PLACES // LANES), out.shape[0]):
            out[i] = 0.0
        add_element_forces(data, plan, w, pieces, Q, out)
        sliders.add_slider_forces(data, plan, w, pieces, Q, out)
        body_rates(data, plan, w, Q, out)
        sliders.hold_rigid(data, plan, pieces, out)
        for i in range(nodal.pulls.shape[1]):
            nodal.pulls[k, i] = data[sliders.hold_row(sliders.RIGID_PULLS, pieces, plan) + i]


@uncounted_kernel
def _know_creep(h: float, data: FloatArray, plan: IntArray, wheels: FloatArray, nodal: Nodal) -> None:
    """Write factors that let slips settle, from the creep forces that were computed last.

    A wheelset's slips are damped by Kalker's coefficients: those of both wheels together along the rail, to which its
    spin gives way first; those against one another, by its yaw; and across, by its lateral motion and its roll.
    """
    q = len(nodal.places)
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        creep = nodal.creep[o]
        for i in range(HALF):
            for group in range(2):
                creep[group, i] = 0.0
                creep[group, HALF + i] = 0.0
            if L[wheel.SIDES + i] == 0.0 or data[asm.CREEP] == asm.NO_CREEP:
                continue
            light = plan[asm.AT_OWN_MOBILITY] + int(L[asm.BODY * LANES + i]) * LANES
            along = L[wheel.STIFF_X + i] + L[wheel.STIFF_X + HALF + i]
            across = L[wheel.STIFF_Y + i] + L[wheel.STIFF_Y + HALF + i]
            square, arm = L[wheel.RADII + i] * L[wheel.RADII + i], L[wheel.ARM + i]
            if data[light + asm.PITCH] > 0.0 and data[asm.QUASI_STATIC] == 0.0:
                creep[SLIPS_ALONG, i] = h * along * (data[light + asm.MOTION_X] + square * data[light + asm.PITCH])
            creep[SLIPS_ALONG, HALF + i] = h * along * arm * arm * data[light + asm.YAW]
            creep[SLIPS_ACROSS, i] = h * across * (data[light + asm.MOTION_Y] + square * data[light + ROLL])
        for group in range(2):
            M = nodal.slips[o, group]
            for k in range(q):
                for j in range(q):
                    for i in range(LANES):
                        M[k, j, i] = creep[group, i] * nodal.integrals[k, j]
                for i in range(LANES):
                    M[k, k, i] += 1.0
            _factorise(M)


@uncounted_kernel
def _let_slips_settle(data: FloatArray, plan: IntArray, wheels: FloatArray, nodal: Nodal) -> None:
    """Correct the change of the wheelsets' accelerations in this turn by what it does to the creep forces."""
    q, change = len(nodal.places), nodal.change
    for o in range(int(data[asm.TREADS])):
        L = wheels[o]
        for group in range(2):
            for k in range(q):
                for i in range(HALF):
                    at = int(L[asm.BODY * LANES + i]) * PLACES + TO_RATE
                    one, other = (asm.PITCH, asm.YAW) if group == SLIPS_ALONG else (asm.MOTION_Y, asm.MOTION_Y)
                    change[k, i] = nodal.rates[k, at + one] - nodal.before[k, at + one]
                    change[k, HALF + i] = nodal.rates[k, at + other] - nodal.before[k, at + other]
            _substitute(nodal.slips[o, group], change)
            for i in range(HALF):
                if L[wheel.SIDES + i] == 0.0:
                    continue
                body = int(L[asm.BODY * LANES + i])
                at, light = body * PLACES + TO_RATE, plan[asm.AT_OWN_MOBILITY] + body * LANES
                radius = L[wheel.RADII + i]
                for k in range(q):
                    rates, before = nodal.rates[k], nodal.before[k]
                    if group == SLIPS_ACROSS:
                        less = before[at + asm.MOTION_Y] + change[k, i] - rates[at + asm.MOTION_Y]
                        rates[at + asm.MOTION_Y] += less
                        if data[light + asm.MOTION_Y] > 0.0:
                            rates[at + ROLL] += radius * data[light + ROLL] / data[light + asm.MOTION_Y] * less
                        continue
                    rates[at + asm.YAW] = before[at + asm.YAW] + change[k, HALF + i]
                    if nodal.creep[o, SLIPS_ALONG, i] > 0.0:
                        less = before[at + asm.PITCH] + change[k, i] - rates[at + asm.PITCH]
                        rates[at + asm.PITCH] += less
                        rates[at + asm.MOTION_X] -= (
                            data[light + asm.MOTION_X] / (radius * data[light + asm.PITCH]) * less
                        )


@uncounted_kernel
def _take_forces(unit: float, nodal: Nodal) -> float:
    """Take the forces of this turn; return the largest change, in static forces."""
    most = 0.0
    for o in range(nodal.forces.shape[0]):
        for k in range(len(nodal.places)):
            for i in range(LANES):
                most = max(most, abs(nodal.wanted[o, k, i] - nodal.forces[o, k, i]))
                nodal.forces[o, k, i] = nodal.wanted[o, k, i]
    return most / unit


@uncounted_kernel
def _largest_change(h: float, behind: int, scales: FloatArray, nodal: Nodal) -> float:
    """Return by how much the rates of this turn change a state, in its scale."""
    most = 0.0
    for k in range(len(nodal.places)):
        for i in range(behind):
            most = max(most, abs(nodal.rates[k, i] - nodal.before[k, i]) * scales[i])
    return most * h


@inlined_uncounted_kernel
def _still_left(change: float, last: float) -> float:
    """Return the error that is left after a change, if changes go on to become smaller as they do."""
    return change * min(change / last, 1.0) if last > 0.0 else change


@inlined_uncounted_kernel
def _is_slow(change: float, last: float) -> bool:
    """Return True for a change that is not settled, and more than half as large as the last one."""
    return not (change <= NODES_SETTLED or change < 0.5 * last)


@uncounted_kernel
def _settle_step(
    t: float, solid: FloatArray, data: FloatArray, plan: IntArray, scales: FloatArray, w: FloatArray,
    wheels: FloatArray, pieces: FloatArray, Q: FloatArray, start: FloatArray, nodal: Nodal,
) -> int:  # fmt: skip
    """Solve for motion and forces at the nodes; return the number of turns, 0 where these do not settle.

    `start` are the rates at the step's start, and the forces there are in the contacts.
    """
    at = plan[asm.AT_RAILS]
    unit = data[at + asm.RAIL_FORCE]
    h, behind = data[at + asm.RAIL_SECONDS], int(data[at + asm.RAIL_STATES])
    treads, bodies = int(data[asm.TREADS]), plan[asm.BODIES]
    for o in range(treads):
        for k in range(len(nodal.places)):
            for i in range(LANES):
                nodal.forces[o, k, i] = wheels[o, wheel.ROW_FORCE + i]
    for k in range(len(nodal.places)):
        for i in range(behind):
            nodal.rates[k, i] = start[i]
    if not _know_paths(t, h, data, plan, w, wheels, nodal):
        return 0
    _know_rails(data, plan, nodal)
    _know_own_answers(h, solid, data, plan, wheels, nodal)
    damped = False
    last, last_moved = np.inf, np.inf
    enough = ROUGHLY * unit
    for turn in range(MOST_ROUNDS):
        _move_nodes(h, bodies, behind, w, nodal)
        _press_rails(solid, data, plan, nodal)
        _measure_gaps(data, plan, wheels, nodal)
        for o in range(treads):
            flange = o + treads if is_flanged(o, data, plan, wheels) else -1
            _solve_wheels(o, flange, turn <= 1, enough, wheels[o], wheels[max(flange, 0)], nodal)
        if turn == 0:
            _first_rates(start, data, plan, wheels, nodal)
            _take_forces(unit, nodal)
            enough = CORRECTED * unit
            continue
        for k in range(len(nodal.places)):
            for i in range(behind):
                nodal.before[k, i] = nodal.rates[k, i]
        _rates_at_nodes(data, plan, wheels, pieces, Q, nodal)
        most = _take_forces(unit, nodal)
        moved = _largest_change(h, behind, scales, nodal)
        if turn > 1 and max(_still_left(most, last), _still_left(moved, last_moved)) <= NODES_SETTLED:
            return turn + 1
        if damped:
            if _is_slow(most, last) or _is_slow(moved, last_moved):
                return 0
            _let_slips_settle(data, plan, wheels, nodal)
        elif turn > 1 and moved > max(POOR * last_moved, NODES_SETTLED):
            damped = True
            _know_creep(h, data, plan, wheels, nodal)
            _let_slips_settle(data, plan, wheels, nodal)
        elif turn > FIRST_TURNS and _is_slow(most, last):
            return 0
        last, last_moved = most, moved
    return 0


@uncounted_kernel
def _is_smooth(unit: float, nodal: Nodal) -> bool:
    """Return True where the forces are polynomials of the nodes' degree, as far as they need to be."""
    q = len(nodal.places)
    for o in range(nodal.forces.shape[0]):
        for m in range(q - 2, q):
            for i in range(LANES):
                total = 0.0
                for k in range(q):
                    total += nodal.transform[m, k] * nodal.forces[o, k, i]
                if not abs(total) <= TAIL * unit:
                    return False
    return True


@uncounted_kernel
def expand(matrix: FloatArray, values: FloatArray, out: FloatArray) -> None:
    """Write the coefficients of what an octet has at the nodes, (q, LANES); the matrix makes them, (q, q)."""
    for m in range(len(matrix)):
        for i in range(LANES):
            out[m, i] = 0.0
        for k in range(len(matrix)):
            value = matrix[m, k]
            for i in range(LANES):
                out[m, i] += value * values[k, i]


@uncounted_kernel
def _stay_open(o: int, data: FloatArray, plan: IntArray, L: FloatArray, nodal: Nodal) -> bool:
    """Return True where all voids of an octet are open all through the step."""
    q, one, free, _, _, _, _, _, _ = places_of(data, plan)
    together, apart = nodal.sums[LEFT_AND_RIGHT], nodal.sums[LEFT_OR_RIGHT]
    first = four_of(o, data, plan) * q * HALF
    above = nodal.change[FIRST_NODE]
    for m in range(q):
        for i in range(LANES):
            above[i] = void_number(asm.VOID_GAP, i, o, data, plan)
        for k in range(q):
            bernstein = nodal.bernstein[m, k]
            for i in range(HALF):
                both = together[first + k * HALF + i]
                half = apart[first + k * HALF + i]
                for n in range(q):
                    value = nodal.values[k, n]
                    both += value * data[free + first + n * HALF + i]
                    half += value * data[free + one + first + n * HALF + i]
                above[i] += bernstein * (both + half)
                above[HALF + i] += bernstein * (both - half)
        for i in range(LANES):
            if L[wheel.ON + i] != 0.0 or not above[i] > 0.0:
                return False
    return True


@uncounted_kernel
def _nothing_happens(data: FloatArray, plan: IntArray, wheels: FloatArray, pieces: FloatArray, nodal: Nodal) -> bool:
    """Return True where no contact changes in the step, no flange or sleeper comes near, no corner is reached."""
    q, treads = len(nodal.places), int(data[asm.TREADS])
    for o in range(treads):
        asleep = plan[asm.WHEEL_OCTETS] > treads and wheels[o + treads, wheel.AWAKE] == 0.0
        for i in range(LANES):
            widest = nodal.shifts[o, i]
            if widest > data[asm.LARGEST_SHIFT] or (asleep and widest > data[asm.FLANGE_FROM]):
                return False
    for o in range(wheels.shape[0]):
        if wheels[o, wheel.AWAKE] == 0.0:
            continue
        L = wheels[o]
        expand(nodal.bernstein, nodal.depths[o], nodal.change)
        for m in range(q):
            for i in range(LANES):
                if L[wheel.SIDES + i] != 0.0 and not (2.0 * L[wheel.ON + i] - 1.0) * nodal.change[m, i] > 0.0:
                    return False
    for o in range(plan[asm.WHEEL_OCTETS], wheels.shape[0]):
        if not _stay_open(o, data, plan, wheels[o], nodal):
            return False
    for element in range(plan[asm.LAWS]):
        for k in range(q):
            here = deflection(element, data, plan, nodal.states[k])
            if corner_ahead(element, here, data, plan, pieces) >= 0:
                return False
    return _all_go_on(data, plan, pieces, nodal)


@uncounted_kernel
def _all_go_on(data: FloatArray, plan: IntArray, pieces: FloatArray, nodal: Nodal) -> bool:
    """Return True where no friction sticks, slides or parts in the step.

    What is left until it does, as a polynomial of the nodes' degree, has no Bernstein coefficient below zero.
    """
    q = len(nodal.places)
    left, left_of_load = nodal.row[:q], nodal.row[q : 2 * q]
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        rigid = element - plan[asm.RIGID_FROM]
        pressed = sliders.is_pressed(element, data, plan) and pieces[element] != asm.PARTED
        for k in range(q):
            if rigid >= 0:
                data[sliders.hold_row(sliders.RIGID_PULLS, pieces, plan) + rigid] = nodal.pulls[k, rigid]
            held = asm.FULL_BACK <= pieces[element] <= asm.FULL_FORTH
            left[k] = 1.0 if held else sliders.slider_gap(element, data, plan, nodal.states[k], pieces)
            left_of_load[k] = sliders.load_gap(element, data, plan, nodal.states[k], pieces) if pressed else 1.0
        for m in range(q):
            gap, load = 0.0, 0.0
            for k in range(q):
                gap += nodal.bernstein[m, k] * left[k]
                load += nodal.bernstein[m, k] * left_of_load[k]
            if not min(gap, load) > 0.0:
                return False
    return True


@uncounted_kernel
def _write_end(w: FloatArray, y: FloatArray, data: FloatArray, plan: IntArray, nodal: Nodal) -> bool:
    """Write the state at the step's end, with the moments; return False where it is lost."""
    nodes, one, _, _, _, _, _, _, _ = places_of(data, plan)
    at = plan[asm.AT_RAILS]
    h, behind = data[at + asm.RAIL_SECONDS], int(data[at + asm.RAIL_STATES])
    for i in range(len(y)):
        y[i] = w[i] if i < behind else 0.0
    for k in range(0, nodes, 2):
        _add_two(
            h * nodal.weights[k], nodal.rates[k, :behind], h * nodal.weights[k + 1], nodal.rates[k + 1, :behind],
            y[:behind],
        )  # fmt: skip
    for o in range(int(data[asm.TREADS])):
        for m in range(nodes):
            to = behind + (o * nodes + m) * HALF
            for i in range(HALF):
                y[to + i] = 0.0
                y[one + to + i] = 0.0
            for k in range(nodes):
                value = nodal.weights[k] * nodal.values[k, m]
                for i in range(HALF):
                    y[to + i] += value * nodal.forces[o, k, i]
                    y[one + to + i] += value * nodal.forces[o, k, HALF + i]
    largest = 0.0
    for i in range(len(y)):
        largest = max(largest, abs(y[i])) if y[i] == y[i] else np.inf
    return largest < 1e12


@kernel
def state_within(x: float, data: FloatArray, plan: IntArray, w: FloatArray, nodal: Nodal, out: FloatArray) -> None:
    """Write the state at a place of the step, 0 to 1, from what is at the nodes."""
    q, one, _, _, _, _, _, _, _ = places_of(data, plan)
    at = plan[asm.AT_RAILS]
    h, behind = data[at + asm.RAIL_SECONDS], int(data[at + asm.RAIL_STATES])
    treads = int(data[asm.TREADS])
    legendre, sums = np.empty(q + 1), np.zeros(q)
    _write_legendre(2.0 * x - 1.0, legendre)
    for m in range(q):
        below = legendre[m - 1] if m > 0 else -1.0
        integral = 0.5 * (legendre[m + 1] - below) / (2 * m + 1)
        for k in range(q):
            sums[k] += integral * nodal.transform[m, k]
    for i in range(len(out)):
        out[i] = w[i] if i < behind else 0.0
    for k in range(0, q, 2):
        _add_two(
            h * sums[k], nodal.rates[k, :behind], h * sums[k + 1], nodal.rates[k + 1, :behind], out[:behind]
        )  # fmt: skip
    # the moments of the forces' polynomials, which the nodes of a part of the step integrate exactly
    force = np.empty(LANES)
    for part in range(q):
        _write_legendre(2.0 * x * nodal.places[part] - 1.0, legendre)
        for o in range(treads):
            force[:] = 0.0
            for k in range(q):
                value = 0.0
                for m in range(q):
                    value += legendre[m] * nodal.transform[m, k]
                for i in range(LANES):
                    force[i] += value * nodal.forces[o, k, i]
            for m in range(q):
                weight = x * nodal.weights[part] * legendre[m]
                to = behind + (o * q + m) * HALF
                for i in range(HALF):
                    out[to + i] += weight * force[i]
                    out[one + to + i] += weight * force[HALF + i]


@uncounted_kernel
def _write_legendre(z: float, out: FloatArray) -> None:
    """Write Legendre's polynomials at z."""
    out[CONSTANT] = 1.0
    out[LINEAR] = z
    for m in range(1, len(out) - 1):
        out[m + 1] = ((2 * m + 1) * z * out[m] - m * out[m - 1]) / (m + 1)


@uncounted_kernel
def repeat_whole(
    t: float, scales: FloatArray, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray,
    wheels: FloatArray, pieces: FloatArray, Q: FloatArray, start: FloatArray, nodal: Nodal,
) -> None:  # fmt: skip
    """Solve a macro step again that has been solved before."""
    _, one, _, _, at, _, _, _, _ = places_of(data, plan)
    size = one * one + int(data[plan[asm.AT_RAILS] + asm.RAIL_AGAINST])
    _answer_at_nodes(nodal.values, nodal.integrals, data[at : at + size], nodal.row, nodal.solid[:size])
    _settle_step(t, nodal.solid, data, plan, scales, w, wheels, pieces, Q, start, nodal)
    _write_end(w, y, data, plan, nodal)


@uncounted_kernel
def solve_whole(
    t: float, solid: FloatArray, data: FloatArray, plan: IntArray, scales: FloatArray, w: FloatArray,
    y: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray, start: FloatArray, nodal: Nodal,
) -> int:  # fmt: skip
    """Solve a macro step from w to y; return its turns, 0 where it is to be marched."""
    unit = data[plan[asm.AT_RAILS] + asm.RAIL_FORCE]
    turns = _settle_step(t, solid, data, plan, scales, w, wheels, pieces, Q, start, nodal)
    if turns == 0 or not _is_smooth(unit, nodal) or not _nothing_happens(data, plan, wheels, pieces, nodal):
        return 0
    return turns if _write_end(w, y, data, plan, nodal) else 0


@kernel
def is_possible(data: FloatArray, plan: IntArray) -> bool:
    """Return True for a vehicle whose macro steps may be solved at once."""
    return bool(data[asm.CONTACT_LAW] == asm.HERTZIAN and data[plan[asm.AT_RAILS] + asm.RAIL_AT_ONCE] != 0.0)
