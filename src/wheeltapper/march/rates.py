"""The rates of change of a vehicle's state: contacts by octets, nonlinear elements one by one, the rest by blocks."""

from __future__ import annotations

from wheeltapper.march import assembly as contract
from wheeltapper.march.assembly import FLANGE, HALF, LANES, MOTIONS, PLACES, RATE, Assembly
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray
from wheeltapper.march.wheels import AWAKE, NORMAL, ON_DECK, VPITCH, approach, follow, gather, push, rub


@kernel
def touch(t: float, A: Assembly, w: FloatArray, wheels: FloatArray) -> None:
    """Compute indentations and normal forces of all contacts that are awake."""
    deck = int(A.numbers[contract.DECK])
    first = A.numbers[contract.FIRST_SHIFT]
    finer = A.numbers[contract.CELLS_PER_M]
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] == 0.0:
            continue
        gather(w, L)
        follow(t, deck, w, L)
        approach(first, finer, A.cells[A.kinds[o]], L)


@kernel
def deflection(element: int, A: Assembly, w: FloatArray) -> float:
    """Return the deflection of a nonlinear element."""
    total = 0.0
    for j in range(A.element_spans[element], A.element_spans[element + 1]):
        total += A.element_weight[j] * w[A.element_index[j]]
    return total


@kernel
def _pull(A: Assembly, w: FloatArray, pieces: FloatArray, Q: FloatArray, out: FloatArray) -> None:
    """Add the forces of the nonlinear elements, each on its present piece, and the rates inside series elements."""
    for element in range(pieces.shape[0]):
        corner = A.element_corners[element] + int(pieces[element])
        start, force = A.corners[corner, 0], A.corners[corner, 1]
        stiffness = (A.corners[corner + 1, 1] - force) / (A.corners[corner + 1, 0] - start)
        pull = force + stiffness * (deflection(element, A, w) - start)
        inside = int(A.element_inside[element, 0])
        for j in range(A.element_spans[element], A.element_spans[element + 1]):
            at = A.element_index[j]
            if at != inside:
                Q[(at // PLACES) * LANES + at % PLACES] -= A.element_weight[j] * pull
        if inside >= 0:
            out[inside] = pull / A.element_inside[element, 1]


@kernel
def _accelerate(body: int, A: Assembly, w: FloatArray, Q: FloatArray, out: FloatArray) -> None:
    """Write the rates of one body's displacements and velocities."""
    a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = 0.0
    for j in range(A.spans[body], A.spans[body + 1]):
        M = A.blocks[j]
        start = A.sources[j] * PLACES
        for half in range(2):
            for k in range(MOTIONS):
                x = w[start + half * RATE + k]
                row = M[half * MOTIONS + k]
                a0 += row[0] * x
                a1 += row[1] * x
                a2 += row[2] * x
                a3 += row[3] * x
                a4 += row[4] * x
                a5 += row[5] * x
                a6 += row[6] * x
                a7 += row[7] * x
    for j in range(A.force_spans[body], A.force_spans[body + 1]):
        M = A.force_blocks[j]
        start = A.force_sources[j] * LANES
        for k in range(MOTIONS):
            x = Q[start + k]
            row = M[k]
            a0 += row[0] * x
            a1 += row[1] * x
            a2 += row[2] * x
            a3 += row[3] * x
            a4 += row[4] * x
            a5 += row[5] * x
            a6 += row[6] * x
            a7 += row[7] * x
    at = body * PLACES
    for k in range(LANES):
        out[at + k] = w[at + RATE + k]
    out[at + RATE] = a0
    out[at + RATE + 1] = a1
    out[at + RATE + 2] = a2
    out[at + RATE + 3] = a3
    out[at + RATE + 4] = a4
    out[at + RATE + 5] = a5
    out[at + RATE + 6] = a6
    out[at + RATE + 7] = a7


@kernel
def rates(
    t: float, A: Assembly, w: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray, out: FloatArray
) -> None:
    """Write the rates of the state at a time.

    `wheels` (octets, ROWS) are the contacts, `pieces` (elements,) the present pieces of the nonlinear elements, `Q` is
    scratch for the forces on the bodies.
    """
    deck = int(A.numbers[contract.DECK])
    for i in range(Q.shape[0]):
        Q[i] = A.loads[i]
    touch(t, A, w, wheels)
    treads = int(A.numbers[contract.TREADS])
    on_deck = 0.0
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] == 0.0:
            continue
        inclined = A.kinds[o] == FLANGE
        if inclined and A.numbers[contract.QUASI_STATIC] != 0.0:
            for i in range(LANES):
                L[VPITCH + i] = wheels[o - treads, VPITCH + i]
        rub(A, inclined, L)
        push(inclined, deck, L, Q)
        for i in range(HALF):
            on_deck += L[ON_DECK + i]
    if deck >= 0 and on_deck > 0.0:
        Q[deck * LANES + contract.Z] += A.numbers[contract.PRESTRESS]
    for i in range(Q.shape[0] * (PLACES // LANES), out.shape[0]):
        out[i] = 0.0
    _pull(A, w, pieces, Q, out)
    for body in range(Q.shape[0] // LANES):
        _accelerate(body, A, w, Q, out)
