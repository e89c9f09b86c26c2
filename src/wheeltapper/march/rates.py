"""The rates of change of a vehicle's state: contacts by octets, nonlinear elements one by one, the rest by columns.

`data` and `plan` are a flattened assembly; `wheels` (octets, ROWS) the contacts; `pieces` (elements,) the present
pieces of the nonlinear elements; `Q` (bodies·LANES,) scratch for the forces on the bodies.
"""

from __future__ import annotations

from wheeltapper.march import assembly as asm
from wheeltapper.march.assembly import FLANGE, HALF, LANES, PLACES, TO_RATE
from wheeltapper.march.columns import add_columns
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray, IntArray
from wheeltapper.march.wheel_rows import AWAKE, ROW_ON_DECK, VPITCH
from wheeltapper.march.wheels import add_body_forces, creep_forces, paths_and_forces


@kernel
def contact_forces(t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Compute indentations and normal forces of all contacts that are awake."""
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] != 0.0:
            paths_and_forces(t, data, plan, plan[plan[asm.AT_KINDS] + o], w, L)


@kernel
def deflection(element: int, data: FloatArray, plan: IntArray, w: FloatArray) -> float:
    """Return the deflection of a nonlinear element."""
    spans = plan[asm.AT_ELEMENT_SPANS] + element
    index = plan[asm.AT_ELEMENT_INDEX]
    weights = plan[asm.AT_WEIGHTS]
    total = 0.0
    for j in range(plan[spans], plan[spans + 1]):
        total += data[weights + j] * w[plan[index + j]]
    return total


@kernel
def _add_element_forces(
    data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray, Q: FloatArray, out: FloatArray
) -> None:
    """Add the forces of the nonlinear elements, each on its present piece, and the rates inside series elements."""
    for element in range(pieces.shape[0]):
        corner = plan[plan[asm.AT_ELEMENT_CORNERS] + element] + int(pieces[element])
        at = plan[asm.AT_CORNERS] + 2 * corner
        start, force = data[at], data[at + 1]
        rise = data[at + 3] - force
        if force == 0.0 and rise == 0.0:
            continue
        pull = force + rise / (data[at + 2] - start) * (deflection(element, data, plan, w) - start)
        inside = plan[asm.AT_INSIDE] + 2 * element
        within = int(data[inside])
        spans = plan[asm.AT_ELEMENT_SPANS] + element
        for j in range(plan[spans], plan[spans + 1]):
            place = plan[plan[asm.AT_ELEMENT_INDEX] + j]
            if place != within:
                Q[(place // PLACES) * LANES + place % PLACES] -= data[plan[asm.AT_WEIGHTS] + j] * pull
        if within >= 0:
            out[within] = pull / data[inside + 1]


@kernel
def _body_rates(data: FloatArray, plan: IntArray, w: FloatArray, Q: FloatArray, out: FloatArray) -> None:
    """Write the rates of the bodies' displacements and velocities."""
    mobility = plan[asm.AT_MOBILITY]
    columns, index = plan[asm.AT_COLUMNS], plan[asm.AT_INDEX]
    force_columns, force_index = plan[asm.AT_FORCE_COLUMNS], plan[asm.AT_FORCE_INDEX]
    for body in range(plan[asm.BODIES]):
        at = body * PLACES
        own = body * LANES
        for k in range(LANES):
            out[at + k] = w[at + TO_RATE + k]
            out[at + TO_RATE + k] = data[mobility + own + k] * Q[own + k]
        spans = plan[asm.AT_SPANS] + body
        add_columns(data, columns, plan, index, plan[spans], plan[spans + 1], w, out, at + TO_RATE)
        spans = plan[asm.AT_FORCE_SPANS] + body
        if plan[spans + 1] > plan[spans]:
            add_columns(data, force_columns, plan, force_index, plan[spans], plan[spans + 1], Q, out, at + TO_RATE)


@kernel
def rates(
    t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray,
    out: FloatArray,
) -> None:  # fmt: skip
    """Write the rates of the state at a time."""
    deck = int(data[asm.DECK])
    loads = plan[asm.AT_LOADS]
    for i in range(Q.shape[0]):
        Q[i] = data[loads + i]
    treads = int(data[asm.TREADS])
    on_deck = 0.0
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] == 0.0:
            continue
        kind = plan[plan[asm.AT_KINDS] + o]
        paths_and_forces(t, data, plan, kind, w, L)
        inclined = kind == FLANGE
        if inclined and data[asm.QUASI_STATIC] != 0.0:
            for i in range(LANES):
                L[VPITCH + i] = wheels[o - treads, VPITCH + i]
        creep_forces(data, plan, inclined, L)
        add_body_forces(inclined, deck, L, Q)
        if deck >= 0:
            for i in range(HALF):
                on_deck += L[ROW_ON_DECK + i]
    if on_deck > 0.0:
        Q[deck * LANES + asm.MOTION_Z] += data[asm.DECK_PRESTRESS]
    for i in range(Q.shape[0] * (PLACES // LANES), out.shape[0]):
        out[i] = 0.0
    _add_element_forces(data, plan, w, pieces, Q, out)
    _body_rates(data, plan, w, Q, out)
