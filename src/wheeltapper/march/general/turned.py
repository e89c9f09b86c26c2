"""Derivatives of what a march is given along one direction: of its tables, its laws, its paths and its start.

Units of length and force stay as they are: they only scale. The macro steps keep their places along the track; a change
of speed changes their length in time, and nothing that is a function of place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general import layout, tables
from wheeltapper.march.general import march as general
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.contract import Bodies, Law
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.structure import ComplexArray
from wheeltapper.march.general.tangent import LAW_CONSTANT, factor_turn, path_turn


class SystemTurn(NamedTuple):
    """Derivatives of a system along one direction, in SI units.

    Attributes
    ----------
    bodies
        Of mass, damping, stiffness and load; shapes do not change.
    static
        Of the contacts' static forces, (contacts,), N.
    laws
        Of the numbers of each contact's law; empty where they do not change.
    paths
        Of the pieces of each contact at fixed places, in their own columns; None where they do not change.
    speed
        Of the speed.
    """

    bodies: Bodies
    static: FloatArray
    laws: tuple[FloatArray, ...]
    paths: tuple[FloatArray | None, ...]
    speed: float = 0.0

    @property
    def is_structured(self) -> bool:
        """Whether tables of the structure change."""
        changed = (self.bodies.mass, self.bodies.damping, self.bodies.stiffness, self.bodies.load, self.static)
        return self.speed != 0.0 or any(bool(np.any(one)) for one in changed)


class TurnedTables(NamedTuple):
    """Derivatives of `Tables`, by the names there; those of modes follow from the tables themselves (tangent.py)."""

    bodies_read: FloatArray
    bodies_write: FloatArray
    bodies_step: FloatArray
    kernels: FloatArray
    matrices: FloatArray
    cross: FloatArray


class TurnedStart(NamedTuple):
    """Derivatives of the start: bodies, offsets, m, modes in the order of the tables, indentations in units."""

    bodies: FloatArray
    offsets: FloatArray
    modes: FloatArray
    began: FloatArray


def slowed(prepared: general.Prepared, turn: SystemTurn) -> float:
    """Return the derivative of the macro step's length in time, over that length."""
    return -turn.speed / prepared.system.speed if turn.speed else 0.0


# -- the path and the laws --------------------------------------------------------------------------------------------


def turned_pieces(prepared: general.Prepared, turn: SystemTurn) -> FloatArray | None:
    """Return the derivatives of all contacts' pieces behind each other; their degrees are their own."""
    if all(one is None for one in turn.paths):
        return None
    contacts = prepared.system.contacts
    held = [
        np.zeros_like(contact.pieces) if one is None else one
        for contact, one in zip(contacts, turn.paths, strict=True)
    ]  # fmt: skip
    out = np.vstack(held)
    for column, source, least in (
        (contract.DEGREE, contract.COEFFICIENT, 0), (contract.FACTOR_DEGREE, contract.FACTOR, -1)
    ):  # fmt: skip
        used = out[:, source : source + contract.TERMS] != 0.0
        out[:, column] = np.where(used, np.arange(contract.TERMS), least).max(axis=1)
    return out


def turned_laws(prepared: general.Prepared, turn: SystemTurn) -> FloatArray:
    """Return the derivatives of the laws' numbers in the march's units, (contacts, LAW_NUMBERS)."""
    out = np.zeros((len(turn.laws), switch.LAW_NUMBERS))
    for row, contact, numbers in zip(out, prepared.system.contacts, turn.laws, strict=True):
        if not np.any(numbers):
            continue
        linear = contact.law.kind in (switch.LINEAR_LAW, switch.TWO_SIDED)
        law = Law(switch.LINEAR_LAW if linear else switch.HUNT_CROSSLEY, numbers)
        row[1 : 1 + len(numbers)] = general.law_row(contact._replace(law=law), prepared.units, 0)[1 : 1 + len(numbers)]
    return out


# -- bodies -----------------------------------------------------------------------------------------------------------


class _TurnedBodies(NamedTuple):
    """Bodies and their derivatives as one system: of x and Δx; `over` times H, and what reads Δx."""

    over: FloatArray
    B: FloatArray
    S: FloatArray


def _turned_bodies(prepared: general.Prepared, turn: SystemTurn, slower: float, seconds: float) -> _TurnedBodies:
    """Return them over macro steps of one length, s."""
    bodies = prepared.system.bodies
    states, heavy = tables.states_of(bodies), tables.heavy_of(bodies)
    E = tables.equations_of(bodies, heavy).E
    by = tables.equations_of(turn.bodies, heavy, 0.0)
    A, B = np.linalg.solve(E, by.F - by.E @ states.A), np.linalg.solve(E, by.G - by.E @ states.B)
    none, total = np.zeros_like(states.A), states.A * seconds
    return _TurnedBodies(
        np.block([[total, none], [A * seconds + total * slower, total]]), np.vstack([states.B, B]),
        np.hstack([np.zeros_like(states.S), states.S]),
    )  # fmt: skip


# -- tables -----------------------------------------------------------------------------------------------------------


def _turned_answers(prepared: general.Prepared, slower: float) -> FloatArray:
    """Return the derivatives of the ring's answers to forces, (contact, other, phases, q, q), m/N.

    A force at one node shows at another by H·exp(λ·H·θ), θ the way between them in macro steps.
    """
    ring, grid, method = prepared.system.ring, prepared.grid, prepared.method
    nodes, contacts, q = gauss_nodes(method.nodes), len(prepared.system.contacts), method.nodes
    assert ring is not None
    order = general.order_of(ring)
    made = tables.sets_of(ring, order, grid, lambda part: tables.ring_tables(ring, order, grid, part, nodes))
    straight, faster = np.zeros((2, contacts, contacts, grid.rows, q, q))
    ignored = np.zeros((contacts, grid.rows, q))
    tables.ring_kernels(ring, order, grid, made, [], straight, ignored)
    rates = np.multiply.outer(grid.lengths[grid.lengths_of_rows], ring.rates[order])[:, None]
    made = [one._replace(takes=one.takes * rates) for one in made]
    tables.ring_kernels(ring, order, grid, made, [], faster, ignored)
    return np.asarray(slower * (straight + np.subtract.outer(nodes.places, nodes.places) * faster))


def turned_tables(prepared: general.Prepared, turn: SystemTurn, offsets: FloatArray) -> TurnedTables:
    """Return the derivatives of the tables; `offsets` are those of the start's, m."""
    system, method, units, grid = prepared.system, prepared.method, prepared.units, prepared.grid
    nodes, q, contacts = gauss_nodes(method.nodes), method.nodes, len(system.contacts)
    slower, scale = slowed(prepared, turn), units.force / units.length
    g = np.zeros((contacts, contacts, grid.rows if len(grid.lengths) > 1 else 1, q, q))
    if system.ring is not None and turn.speed:
        g = _turned_answers(prepared, slower)
    reads, writes, steps = [], [], []
    for seconds, some in grid.alike():
        bodies = _turned_bodies(prepared, turn, slower, seconds)
        read, write, step, answers = _turned_body_tables(prepared, bodies, slower, seconds)
        g[:, :, some] += answers[:, :, None]
        read[:, 0, -1] += offsets / units.length
        reads.append(read)
        writes.append(write)
        steps.append(step)
    g *= scale
    own = np.arange(contacts)
    out = TurnedTables(
        np.stack(reads), np.stack(writes), np.stack(steps), nodes.transform @ g[own, own] @ nodes.transform.T,
        g[own, own] * nodes.integrals, g,
    )  # fmt: skip
    return TurnedTables._make(np.ascontiguousarray(part) for part in out)


def _turned_body_tables(
    prepared: general.Prepared, bodies: _TurnedBodies, slower: float, seconds: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the derivatives of what bodies show, take, do in one step and answer, over steps of one length, s."""
    units, q, size = prepared.units, prepared.method.nodes, bodies.S.shape[1] // 2
    nodes, contacts = gauss_nodes(q), len(bodies.S)
    later = np.subtract.outer(nodes.places, nodes.places).ravel()
    answers = bodies.S @ tables.exponentials(bodies.over, later) @ bodies.B
    answers = seconds * (answers + slower * _answers_of(prepared, later, seconds))
    shown = (bodies.S @ tables.exponentials(bodies.over, nodes.places))[:, :, :size]
    later_still = tables.exponentials(bodies.over, 1.0 - nodes.places) @ bodies.B
    taken = later_still[:, size:] + slower * later_still[:, :size]
    read = (np.tensordot(nodes.transform, shown, (1, 0)) / units.length).transpose(1, 0, 2)
    write = np.tensordot(nodes.transform, taken, (1, 0)) * (-seconds * units.force)
    return (
        np.ascontiguousarray(read), np.ascontiguousarray(write.transpose(2, 0, 1)),
        tables.exponentials(bodies.over, np.ones(1))[0, size:, :size],
        np.moveaxis(answers.reshape(q, q, contacts, contacts), (0, 1), (2, 3)),
    )  # fmt: skip


def _answers_of(prepared: general.Prepared, later: FloatArray, seconds: float) -> FloatArray:
    """Return what bodies answer after some times, in macro steps of one length, s."""
    states = tables.states_of(prepared.system.bodies)
    return np.asarray(states.S @ tables.exponentials(states.A * seconds, later) @ states.B)


# -- the start --------------------------------------------------------------------------------------------------------


def turned_start(
    prepared: general.Prepared, turn: SystemTurn, laws: FloatArray, pieces: FloatArray | None
) -> TurnedStart:
    """Return the derivatives of the static state that `equilibrium` finds, with the wheels where they start.

    `laws` and `pieces` are those of `turned_laws` and `turned_pieces`.
    """
    system, data, units = prepared.system, prepared.data, prepared.units
    static, contacts = general.static_forces(system), len(data.starts)
    deltas, _, spots = general.static_indentations(data, static, units)
    sinking, rising, stronger = np.zeros((3, contacts))
    for i, place in enumerate(general.first_places(data)):
        law = data.laws[i]
        force, slope = general.pressed(deltas[i], law, data.table, spots[i])
        stronger[i] = laws[i, LAW_CONSTANT] / law[LAW_CONSTANT] if laws[i, LAW_CONSTANT] else 0.0
        if pieces is not None:
            at = data.starts[i], 0.0
            rising[i] = path_turn(data.pieces, pieces, 0.0, place, *at, 1.0 / units.length, 0.0)[0]
            stronger[i] += factor_turn(data.pieces, pieces, 0.0, place, *at, 0.0) / spots[i].factor
        sinking[i] = (turn.static[i] / units.force - force * stronger[i]) / slope
    offsets, bodies = (sinking - rising) * units.length, np.zeros(len(prepared.start.bodies))
    if system.bodies.guides.size:
        offsets, moved = (one * units.length for one in _turned_standing(prepared, turn, laws, rising, stronger))
        bodies[: len(system.bodies.mass)] = moved
    gap = offsets + rising * units.length
    modes, compliance = np.zeros((2, 0)), np.zeros(contacts)
    if system.ring is not None:
        amplitudes, deflected, compliance = _turned_rest(prepared, turn)
        local = compliance * turn.static
        offsets, gap = offsets + deflected + local, gap + local
        modes = np.stack([amplitudes.real, amplitudes.imag])
    if turn.bodies.raised.size:
        bodies = general.raised_state(system.bodies._replace(raised=turn.bodies.raised), bodies, offsets)
    gap = (gap + system.bodies.shapes.T @ bodies[: len(system.bodies.mass)]) / units.length
    began = np.zeros(contacts)
    for i in np.flatnonzero(prepared.motion.contacts["phase"] == layout.TOUCHING).tolist():  # δ + r·N(δ) = D
        delta = float(prepared.motion.contacts["began"][i])
        force, slope = general.pressed(delta, data.laws[i], data.table, spots[i])
        soft = compliance[i] * units.force / units.length
        began[i] = (gap[i] - soft * force * stronger[i]) / (1.0 + soft * slope)
    return TurnedStart(bodies, offsets, modes, began)


def _turned_standing(
    prepared: general.Prepared, turn: SystemTurn, laws: FloatArray, rising: FloatArray, stronger: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of what `march.standing` finds; `rising` and `stronger` those of path and force, there."""
    system, data, units = prepared.system, prepared.data, prepared.units
    static = general.static_forces(system)
    delta, height, spots = general.static_indentations(data, static, units)
    level, moved = general.standing(system, static, units, delta, height, spots)
    depth = level + height[: len(static)] + system.bodies.shapes[:, : len(static)].T @ moved
    deeper, missing = np.zeros(len(static)), np.zeros(len(static))
    for i, law in enumerate(data.laws[: len(static)]):
        force, slope = general.pressed(level[i], law, data.table, general.virgin_spot(law))
        share = laws[i, LAW_CONSTANT] / law[LAW_CONSTANT] if laws[i, LAW_CONSTANT] else 0.0
        deeper[i] = (turn.static[i] / units.force - force * share) / slope
        force, slope = general.pressed(depth[i], law, data.table, spots[i])
        missing[i] = turn.static[i] / units.force - force * stronger[i] - slope * (deeper[i] + rising[i])
    pull = system.bodies.shapes[:, : len(static)] @ missing
    pull -= turn.bodies.stiffness @ moved * (units.length / units.force)
    held = general.held_on(system, static, units, level, height, spots)
    return deeper, held.ties @ np.linalg.solve(held.forces_at(moved[held.free])[1], held.ties.T @ pull)


def _turned_rest(prepared: general.Prepared, turn: SystemTurn) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return how the static amplitudes change and the rail's deflections through modes, m.

    Then follows the compliance that these leave out, m/N.
    """
    system = prepared.system
    ring, order = system.ring, general.order_of(system.ring)
    assert ring is not None
    bays, inside = general.bays_of(ring, np.array([contact.position for contact in system.contacts]))
    ahead = np.exp(1j * np.multiply.outer(bays - bays[0], np.angle(ring.turns)))
    shows = tables.shapes_at(ring, ring.deflection, inside) * ahead
    takes = tables.shapes_at(ring, ring.drive, inside) / ahead
    moved = -(takes.T @ turn.static) / ring.rates
    return moved[order], np.real(shows @ (ring.weights * moved)), tables.compliance_at(ring, inside)
