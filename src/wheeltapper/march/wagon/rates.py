"""The rates of change of a vehicle's state: contacts by octets, nonlinear elements one by one, the rest by columns.

`data` and `plan` are a flattened assembly; `wheels` (octets, ROWS) the contacts; `pieces` (elements,) the present
pieces of the nonlinear elements; `Q` (bodies·LANES,) scratch for the forces on the bodies.
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import kernel, shared_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import FLANGE, HALF, LANES, PLACES, TO_RATE
from wheeltapper.march.wagon.columns import add_columns
from wheeltapper.march.wagon.contact_laws import is_lossy
from wheeltapper.march.wagon.elements import deflection
from wheeltapper.march.wagon.pressing import press_contacts
from wheeltapper.march.wagon.rail_motion import write_lag_rates, write_moment_rates
from wheeltapper.march.wagon.sliders import add_slider_forces, hold_rigid, use_limits
from wheeltapper.march.wagon.wheel_rows import AWAKE, ROW_ON_DECK, VPITCH
from wheeltapper.march.wagon.wheels import add_body_forces, creep_forces, paths_and_forces


@kernel
def add_element_forces(
    data: FloatArray, plan: IntArray, w: FloatArray, pieces: FloatArray, Q: FloatArray, out: FloatArray
) -> None:
    """Add the forces of the nonlinear elements, each on its present piece, and the rates inside series elements."""
    for element in range(plan[asm.LAWS]):
        corner = plan[plan[asm.AT_ELEMENT_CORNERS] + element] + int(pieces[element])
        at = plan[asm.AT_CORNERS] + asm.CORNER_COLUMNS * corner
        force = data[at + asm.CORNER_FORCE]
        rise = data[at + asm.CORNER_COLUMNS + asm.CORNER_FORCE] - force
        if force == 0.0 and rise == 0.0:
            continue
        beyond = deflection(element, data, plan, w) - data[at]
        width = data[at + asm.CORNER_COLUMNS] - data[at]
        pull = force + rise / width * beyond
        within = plan[plan[asm.AT_INSIDE] + element]
        spans = plan[asm.AT_ELEMENT_SPANS] + element
        for j in range(plan[spans], plan[spans + 1]):
            place = plan[plan[asm.AT_ELEMENT_INDEX] + j]
            if place != within:
                Q[(place // PLACES) * LANES + place % LANES] -= data[plan[asm.AT_WEIGHTS] + j] * pull
        if within >= 0:
            rate = data[at + asm.CORNER_RATE]
            gain = data[at + asm.CORNER_COLUMNS + asm.CORNER_RATE] - rate
            out[within] = rate + gain / width * beyond


@kernel
def body_rates(data: FloatArray, plan: IntArray, w: FloatArray, Q: FloatArray, out: FloatArray) -> None:
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


@shared_kernel
def rates(
    t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, pieces: FloatArray, Q: FloatArray,
    out: FloatArray, rated: bool,
) -> None:  # fmt: skip
    """Write the rates of the state at a time; `rated`: those of the contacts too, also on rails that give way."""
    deck = int(data[asm.DECK])
    loads = plan[asm.AT_LOADS]
    for i in range(Q.shape[0]):
        Q[i] = data[loads + i]
    treads = int(data[asm.TREADS])
    on_deck = 0.0
    on_rails = plan[asm.AT_RAILS] > 0
    if on_rails:  # what presses one wheel moves the rail below the others
        press_contacts(t, rated, data, plan, w, wheels)
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] == 0.0:
            continue
        kind = plan[plan[asm.AT_KINDS] + o]
        if not on_rails:
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
    if on_rails:
        write_moment_rates(data, plan, out)
        if is_lossy(data):
            write_lag_rates(data, plan, wheels, out)
    add_element_forces(data, plan, w, pieces, Q, out)
    if plan[asm.LAWS] < pieces.shape[0]:
        add_slider_forces(data, plan, w, pieces, Q, out)
    body_rates(data, plan, w, Q, out)
    if plan[asm.RIGID_FROM] < pieces.shape[0]:
        hold_rigid(data, plan, pieces, out)
        use_limits(data, plan, w, pieces)
