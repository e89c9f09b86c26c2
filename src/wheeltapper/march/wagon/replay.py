"""The dense solution of a vehicle's march: each asked step is computed again from its start, with all contact forces.

`steps` and `states` are those of a march; times are in rising order.
"""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.kernel import kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon import whole_steps
from wheeltapper.march.wagon.assembly import LANES, PLACES, TO_RATE
from wheeltapper.march.wagon.contact_laws import is_lossy, is_own, is_plastic, own_energy, own_force, yield_energy
from wheeltapper.march.wagon.elements import corner_at, deflection, depends_on_rate, last_piece, pull_of, steepness
from wheeltapper.march.wagon.growths import find_growths
from wheeltapper.march.wagon.multibody import MultibodyMarch, RailLog, Work, work_for
from wheeltapper.march.wagon.passing import RUN_CARRIED, enable_flanges, pass_breaks, start_kernel
from wheeltapper.march.wagon.pressing import contact_forces
from wheeltapper.march.wagon.rail_motion import enter_logged_step
from wheeltapper.march.wagon.rates import rates
from wheeltapper.march.wagon.sliders import bound_of, enter_holds, side_of, slider_number, slip_rate
from wheeltapper.march.wagon.stepping import FIRST_STAGE, dense_step, make_step
from wheeltapper.march.wagon.unrolled_dop853 import DENSE_STAGES, POWERS, STAGES, between
from wheeltapper.march.wheel.dense import BEGINS, FINISHES

# Columns of the powers.
(
    LOAD_POWER, PATH_POWER, SHAPE_POWER, DAMPER_POWER, FRICTION_POWER, DRIVE_POWER, STAND_IN_POWER, RAIL_POWER,
    SLIDER_POWER, MATERIAL_POWER, BEARING_POWER,
) = range(11)  # fmt: skip
POWERS_KEPT = 11
WORK_NODES = 6
"""Number of nodes of Gauss's rule in each step."""
PARTS = 4
"""Number of parts with such nodes in a macro step that was solved at once."""


@kernel
def _repeat_step(
    row: int, steps: FloatArray, states: FloatArray, data: FloatArray, plan: IntArray, w: FloatArray, y: FloatArray,
    wheels: FloatArray, pieces: FloatArray, Q: FloatArray, K: FloatArray, P: FloatArray, F: FloatArray,
    spare: FloatArray, scales: FloatArray, nodal: whole_steps.Nodal,
) -> bool:  # fmt: skip
    """Make one step again, with its dense solution; return True for one that is a macro step solved at once."""
    t, h = steps[row, asm.STEP_TIME], steps[row, asm.STEP_LENGTH]
    closed = steps[row, asm.STEP_CLOSED]
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            wheels[o, wheel.ON + i] = closed % 2.0
            closed = np.floor(closed / 2.0)
    for element in range(pieces.shape[0]):
        pieces[element] = steps[row, asm.STEP_ELEMENTS + element]
    if is_plastic(data):
        for o in range(int(data[asm.TREADS])):
            for i in range(LANES):
                wheels[o, wheel.STRETCH + i] = steps[row, asm.STEP_ELEMENTS + pieces.shape[0] + o * LANES + i]
    enter_holds(data, plan, pieces)
    w[:] = states[row]
    contact_forces(t, data, plan, w, wheels)
    enable_flanges(data, wheels)
    rates(t, data, plan, w, wheels, pieces, Q, K[FIRST_STAGE], True)
    if closed > 0.0:
        whole_steps.keep_pieces(wheels, nodal)
        whole_steps.repeat_whole(t, scales, data, plan, w, y, wheels, pieces, Q, K[FIRST_STAGE], nodal)
        return True
    make_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P)
    rates(t + h, data, plan, y, wheels, pieces, Q, K[STAGES], True)
    dense_step(t, h, data, plan, w, y, wheels, pieces, Q, K, P, F, spare)
    return False


@kernel
def _state_at(
    t: float, x: float, at_once: bool, data: FloatArray, plan: IntArray, w: FloatArray, F: FloatArray,
    wheels: FloatArray, nodal: whole_steps.Nodal, out: FloatArray,
) -> None:  # fmt: skip
    """Write the state at a time and place, 0 to 1, of a step that was repeated; contacts go to their pieces there."""
    if at_once:
        whole_steps.return_to_pieces(data, plan, wheels, nodal)
        pass_breaks(t, data, plan, wheels)
        whole_steps.state_within(x, data, plan, w, nodal, out)
    else:
        between(x, w, F, out)


@kernel
def replay_kernel(
    flat: asm.FlatAssembly, start: FloatArray, steps: FloatArray, states: FloatArray, rails: RailLog, times: FloatArray,
    rows: IntArray, work: Work, out: FloatArray, out_rates: FloatArray, out_wheels: FloatArray, scales: FloatArray,
    gauss: FloatArray,
) -> None:  # fmt: skip
    """Write states, rates and some rows of the contacts at times: (times, states), the same, (times, rows, lanes)."""
    data, plan = flat
    ends, free, local, answers = rails
    wheels, pieces, Q = work.wheels, work.pieces, work.Q
    n = start.shape[0]
    w, y, spare = np.empty(n), np.empty(n), np.empty(n)
    K, F, P = np.empty((DENSE_STAGES, n)), np.empty((POWERS, n)), np.ones(DENSE_STAGES)
    start_kernel(data, plan, start, w, wheels, pieces, np.empty(RUN_CARRIED))
    nodal = whole_steps.nodal_for(gauss, n, data, plan, wheels, pieces)
    at_once = False
    row = -1
    entered = -1
    for k in range(times.shape[0]):
        while row + 1 < steps.shape[0] and (row < 0 or steps[row + 1, asm.STEP_TIME] <= times[k]):
            row += 1
            pass_breaks(steps[row, asm.STEP_TIME], data, plan, wheels)
        if entered != row:
            middle = steps[row, asm.STEP_TIME] + 0.5 * steps[row, asm.STEP_LENGTH]
            enter_logged_step(middle, ends, free, local, answers, data, plan)
            at_once = _repeat_step(
                row, steps, states, data, plan, w, y, wheels, pieces, Q, K, P, F, spare, scales, nodal
            )  # fmt: skip
            entered = row
        x = min((times[k] - steps[row, asm.STEP_TIME]) / steps[row, asm.STEP_LENGTH], 1.0)
        _state_at(times[k], x, at_once, data, plan, w, F, wheels, nodal, spare)
        rates(times[k], data, plan, spare, wheels, pieces, Q, out_rates[k], True)
        if is_lossy(data):
            find_growths(times[k], data, plan, spare, out_rates[k], wheels)
        out[k] = spare
        for j in range(rows.shape[0]):
            for o in range(wheels.shape[0]):
                for i in range(LANES):
                    out_wheels[k, j, o * LANES + i] = wheels[o, rows[j] + i]


@kernel
def _share_of_work(data: FloatArray) -> float:
    """Return a contact's elastic energy over its force times its indentation."""
    return 0.5 if data[asm.CONTACT_LAW] == asm.STRAIGHT or data[asm.CONTACT_LAW] == asm.PULLING else 0.4


@kernel
def _stored_force(i: int, data: FloatArray, L: FloatArray) -> float:
    """Return the elastic part of a contact's force, also where an indented contact is released without a force."""
    if not is_lossy(data):
        return L[wheel.NORMAL + i]
    if L[wheel.SIDES + i] == 0.0 or L[wheel.AWAKE] == 0.0:
        return 0.0
    if is_own(data):
        force, _ = own_force(i, L[wheel.ROW_DELTA + i], 0.0, data, L)
        return force
    n = L[wheel.ROOT_C + i] * L[wheel.BULGE + i] * np.sqrt(max(L[wheel.ROW_DELTA + i], 0.0))
    return n * n * n


@kernel
def _contact_energy(i: int, data: FloatArray, L: FloatArray) -> float:
    """Return the elastic energy of a wheel's contact; that of voids belongs to the track."""
    if L[wheel.VOID_FLAG] != 0.0:
        return 0.0
    if is_plastic(data):
        stored, _ = yield_energy(i, data, L)
        return stored * L[wheel.ON + i]
    if is_own(data):
        there = L[wheel.SIDES + i] * L[wheel.SIDES + i] * L[wheel.AWAKE] if is_lossy(data) else L[wheel.ON + i]
        return own_energy(i, data, L) * there
    return _share_of_work(data) * _stored_force(i, data, L) * L[wheel.ROW_DELTA + i]


@kernel
def _energy_growth(i: int, stored: float, data: FloatArray, L: FloatArray) -> float:
    """Return how the elastic energy of a contact, whose elastic force is given, grows at a constant indentation, W.

    Of a law of one's own it does by the inclination alone, of which ROOT_C³ is the power 2.5: as if it were Hertz's.
    """
    if is_plastic(data):
        _, growth = yield_energy(i, data, L)
        return growth
    growth = L[wheel.BULGE_RATE + i] / L[wheel.BULGE + i] + L[wheel.ROOT_C_RATE + i] / L[wheel.ROOT_C + i]
    return 3.0 * _share_of_work(data) * stored * L[wheel.ROW_DELTA + i] * growth


@kernel
def _released_energy(data: FloatArray, wheels: FloatArray) -> float:
    """Return the elastic energy of contacts that are indented without a force: their material takes all of it."""
    total = 0.0
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            if wheels[o, wheel.ON + i] == 0.0 and not is_plastic(data):
                total += _contact_energy(i, data, wheels[o])
    return total


@kernel
def _take_true_rates(wheels: FloatArray) -> None:
    """Take the rates that were found along the motion; those of lossy contacts on rails that give way are not quite."""
    for o in range(wheels.shape[0]):
        L = wheels[o]
        for i in range(LANES):
            L[wheel.DELTA_RATE + i] = L[wheel.TRUE_RATE + i]
            L[wheel.RAIL_RATE + i] = L[wheel.TRUE_SINKING + i]


@kernel
def _write_powers(
    data: FloatArray, plan: IntArray, damping: FloatArray, places: IntArray, w: FloatArray, wheels: FloatArray,
    pieces: FloatArray, rate: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Write the powers of all that is no potential; damping (motions, motions) acts on the states at `places`."""
    out[:] = 0.0
    loads = plan[asm.AT_LOADS]
    for body in range(plan[asm.BODIES]):
        for k in range(LANES):
            out[LOAD_POWER] += data[loads + body * LANES + k] * w[body * PLACES + TO_RATE + k]
    for a in range(places.shape[0]):
        of_deck = data[asm.DECK] >= 0.0 and a == places.shape[0] - 1
        for b in range(places.shape[0]):
            power = damping[a, b] * w[places[a] + TO_RATE] * w[places[b] + TO_RATE]
            out[BEARING_POWER if of_deck else DAMPER_POWER] += power
    for element in range(plan[asm.LAWS]):
        within = plan[plan[asm.AT_INSIDE] + element]
        if within >= 0 or depends_on_rate(element, plan):
            extends = rate[within] if within >= 0 else deflection(element, data, plan, w)
            out[DAMPER_POWER] += extends * pull_of(element, int(pieces[element]), data, plan, w)
    for element in range(plan[asm.LAWS], pieces.shape[0]):
        side = side_of(pieces[element])
        if side != 0.0:
            force = max(bound_of(element, side, False, data, plan, w, pieces), 0.0)
            out[SLIDER_POWER] += force * slip_rate(element, side, data, plan, w, pieces)
    deck = int(data[asm.DECK])
    lossy = is_lossy(data)
    on_deck = 0.0
    for o in range(wheels.shape[0]):
        L = wheels[o]
        inclined = plan[plan[asm.AT_KINDS] + o] == asm.FLANGE
        for i in range(LANES):
            on_deck += L[wheel.ROW_ON_DECK + i]
            side, n, stored = L[wheel.SIDES + i], L[wheel.NORMAL + i], _stored_force(i, data, L)
            if side == 0.0 or (stored == 0.0 and n == 0.0) or L[wheel.ON + i] == 0.0:
                continue
            path_rate = L[wheel.PATH_RATE + i]
            if deck >= 0:
                path_rate -= L[wheel.ROW_ON_DECK + i] * w[deck * PLACES + asm.MOTION_Z + TO_RATE]
            out[PATH_POWER] += n * path_rate
            out[RAIL_POWER] += n * L[wheel.RAIL_RATE + i]
            out[SHAPE_POWER] += _energy_growth(i, stored, data, L)
            if lossy:
                out[MATERIAL_POWER] += (n - stored) * L[wheel.DELTA_RATE + i]
            if data[asm.CREEP] == asm.NO_CREEP:
                continue
            slip = L[wheel.FX + i] * L[wheel.SLIP_X + i] + L[wheel.FY + i] * L[wheel.SLIP_Y + i]
            slip += L[wheel.MZ + i] * L[wheel.SLIP_TURN + i]
            fy, fz = L[wheel.FY + i], 0.0
            if inclined:
                climb = side * L[wheel.ROW_G + i]
                fy /= np.sqrt(1.0 + climb * climb)
                fz = climb * fy
            at = int(L[asm.BODY * LANES + i]) * PLACES + TO_RATE
            along = L[wheel.VX + i] - side * L[wheel.ARM + i] * L[wheel.VYAW + i]
            given = L[wheel.FX + i] * (along - L[wheel.ROLLING + i] * w[at + asm.PITCH])
            across = L[wheel.VY + i] + L[wheel.ROLLING + i] * L[wheel.VROLL + i]
            given += fy * across + L[wheel.MZ + i] * L[wheel.VYAW + i]
            given += fz * (L[wheel.VZ + i] + side * L[wheel.ARM + i] * L[wheel.VROLL + i])
            out[FRICTION_POWER] -= slip
            out[DRIVE_POWER] += given - slip
    if deck >= 0 and on_deck > 0.0:
        out[STAND_IN_POWER] += data[asm.DECK_PRESTRESS] * w[deck * PLACES + asm.MOTION_Z + TO_RATE]


@kernel
def _elastic_energies(
    end: int, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray, contacts: FloatArray,
    elements: FloatArray,
) -> None:  # fmt: skip
    """Write the elastic energies of contacts and nonlinear elements in a state that was just computed, at an end."""
    contacts[end] = 0.0
    for o in range(wheels.shape[0]):
        for i in range(LANES):
            contacts[end] += _contact_energy(i, data, wheels[o])
    total = 0.0
    for element in range(plan[asm.LAWS], plan[asm.RIGID_FROM]):
        here = deflection(element, data, plan, w)
        total += 0.5 * slider_number(element, asm.SLIDER_STIFFNESS, data, plan) * here * here
    for element in range(plan[asm.LAWS]):
        if depends_on_rate(element, plan):
            continue
        here = deflection(element, data, plan, w)
        last = last_piece(element, plan)
        zero = 0.0
        low = 0.0
        step = 1 if here >= 0.0 else -1
        corner = 0
        while data[corner_at(element, corner + 1, plan)] < 0.0:
            corner += 1
        # the piece from the last negative corner to the first positive one passes through zero
        while True:
            at, after = corner_at(element, corner, plan), corner_at(element, corner + 1, plan)
            slope = steepness(element, corner, data, plan)
            until = min(here, data[after]) if step > 0 else max(here, data[at])
            force = low + slope * (until - zero)
            total += 0.5 * (low + force) * (until - zero)
            if until == here or not 0 <= corner + step <= last:  # NaN ends with the last piece
                break
            zero, low = until, force
            corner += step
    elements[end] = total


@kernel
def energy_kernel(
    flat: asm.FlatAssembly, start: FloatArray, steps: FloatArray, states: FloatArray, rails: RailLog,
    damping: FloatArray, places: IntArray, nodes: FloatArray, weights: FloatArray, work: Work, works: FloatArray,
    impulses: FloatArray, contacts: FloatArray, elements: FloatArray, scales: FloatArray, gauss: FloatArray,
) -> None:  # fmt: skip
    """Write each step's works (steps, POWERS_KEPT), impulses (steps, lanes), and elastic energies at its ends."""
    data, plan = flat
    ends, free, local, answers = rails
    wheels, pieces, Q = work.wheels, work.pieces, work.Q
    n = start.shape[0]
    w, y, spare, rate = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    K, F, P = np.empty((DENSE_STAGES, n)), np.empty((POWERS, n)), np.ones(DENSE_STAGES)
    power = np.empty(POWERS_KEPT)
    nodal = whole_steps.nodal_for(gauss, n, data, plan, wheels, pieces)
    start_kernel(data, plan, start, w, wheels, pieces, np.empty(RUN_CARRIED))
    works[:] = 0.0
    impulses[:] = 0.0
    for row in range(steps.shape[0]):
        t, h = steps[row, asm.STEP_TIME], steps[row, asm.STEP_LENGTH]
        pass_breaks(t, data, plan, wheels)
        enter_logged_step(t + 0.5 * h, ends, free, local, answers, data, plan)
        at_once = _repeat_step(row, steps, states, data, plan, w, y, wheels, pieces, Q, K, P, F, spare, scales, nodal)
        contact_forces(t, data, plan, w, wheels)
        _elastic_energies(BEGINS, data, plan, w, wheels, contacts[row], elements[row])
        works[row, MATERIAL_POWER] += _released_energy(data, wheels)
        parts = PARTS if at_once else 1
        for part in range(parts):
            for k in range(nodes.shape[0]):
                x, weight = (part + nodes[k]) / parts, weights[k] * h / parts
                _state_at(t + x * h, x, at_once, data, plan, w, F, wheels, nodal, spare)
                rates(t + x * h, data, plan, spare, wheels, pieces, Q, rate, True)
                if is_lossy(data) and plan[asm.AT_RAILS] > 0:
                    find_growths(t + x * h, data, plan, spare, rate, wheels)
                    _take_true_rates(wheels)
                _write_powers(data, plan, damping, places, spare, wheels, pieces, rate, power)
                for j in range(POWERS_KEPT):
                    works[row, j] += weight * power[j]
                for o in range(wheels.shape[0]):
                    for i in range(LANES):
                        impulses[row, o * LANES + i] += weight * wheels[o, wheel.NORMAL + i]
        if at_once:
            pass_breaks(t + whole_steps.INSIDE * h, data, plan, wheels)
        contact_forces(t + h, data, plan, y, wheels)
        _elastic_energies(FINISHES, data, plan, y, wheels, contacts[row], elements[row])
        works[row, MATERIAL_POWER] -= _released_energy(data, wheels)


def _nodes_of(A: asm.Assembly) -> int:
    """Return the Gauss nodes of a macro step, 0 on a stiff track."""
    return int(A.rails[asm.RAIL_NODES]) if A.rails.size else 0


def replay(march: MultibodyMarch, times: FloatArray, rows: IntArray) -> tuple[FloatArray, ...]:
    """Return states and rates (times, states) and some rows of the contacts (times, rows, lanes) at rising times."""
    A = march.assembly
    work = work_for(A, 1)
    out = np.empty((len(times), len(A.start)))
    out_rates = np.empty_like(out)
    out_wheels = np.empty((len(times), len(rows), work.wheels.shape[0] * LANES))
    replay_kernel(
        asm.flattened_assembly(A), A.start, march.steps, march.states, march.rails, times, rows, work, out, out_rates,
        out_wheels, A.scales, whole_steps.packed_nodes(_nodes_of(A)),
    )  # fmt: skip
    return out, out_rates, out_wheels


def works(march: MultibodyMarch, damping: FloatArray, places: IntArray) -> tuple[FloatArray, ...]:
    """Return what `energy_kernel` writes."""
    A = march.assembly
    nodes, weights = np.polynomial.legendre.leggauss(WORK_NODES)
    work = work_for(A, 1)
    count = len(march.steps)
    done, impulses = np.zeros((count, POWERS_KEPT)), np.zeros((count, work.wheels.shape[0] * LANES))
    contacts, elements = np.zeros((count, 2)), np.zeros((count, 2))
    steps, states = np.ascontiguousarray(march.steps), np.ascontiguousarray(march.states)  # also of every 16th step
    energy_kernel(
        asm.flattened_assembly(A), A.start, steps, states, march.rails, damping, places, 0.5 * (nodes + 1.0),
        0.5 * weights, work, done, impulses, contacts, elements, A.scales, whole_steps.packed_nodes(_nodes_of(A)),
    )  # fmt: skip
    return done, impulses, contacts, elements
