"""Integrals over a march from its logs: impulses, works, a rule for others; and the extremes of its indentations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.march import Found
from wheeltapper.march.general.replay import path_slopes, replay, rows_until
from wheeltapper.march.program import FloatArray


class Pressing(NamedTuple):
    """Rising times, s, forces, N, and weights, s: Σ weights·force·f(times) is the integral of force·f.

    The nodes are those at which the march has solved for the force, so that its singularities at losses and impacts do
    no harm.
    """

    times: FloatArray
    force: FloatArray
    weights: FloatArray


class SolvedParts(NamedTuple):
    """Logged parts of one contact with the same number of nodes, at these, (parts, nodes) each.

    Attributes
    ----------
    times
        s.
    delta, slope
        Indentation, m, and its derivative by σ.
    pace
        dt/dσ, s.
    force
        N.
    weights
        Of the rule over σ, (nodes,).
    """

    times: FloatArray
    delta: FloatArray
    slope: FloatArray
    pace: FloatArray
    force: FloatArray
    weights: FloatArray


class Works(NamedTuple):
    """Works and energies of a march, J.

    Attributes
    ----------
    contact
        What the contacts took, ∫ N·δ' dt.
    path
        What the paths gave, ∫ N·y' dt.
    bodies
        What the contacts took from the bodies, ∫ N·shapes'·v dt.
    dissipated
        In the bodies' dampers.
    ends
        Kinetic energy, and energy of the springs, of the bodies at the start and at the end: (2, 2).
    load
        Work of the loads.
    """

    contact: FloatArray
    path: FloatArray
    bodies: FloatArray
    dissipated: float
    ends: FloatArray
    load: float


def joints(found: Found, end: float) -> FloatArray:
    """Return the times, s, between which no force of a contact has a joint, from 0 to the end."""
    rows, last = found.logs.rows, end / found.prepared.grid.seconds
    edges = np.unique(np.append(rows[:, layout.ROW_STEP] + rows[:, layout.ROW_FROM], last))
    return edges[edges <= last] * found.prepared.grid.seconds


def pressing(found: Found, contact: int, end: float) -> Pressing:
    """Return the rule for a contact from the start up to a time, s."""
    rows, seconds = rows_until(found, contact, end), found.prepared.grid.seconds
    counts = rows.rows[:, layout.ROW_NODES].astype(int)
    parts = [np.empty((3, 0))]
    for count in np.unique(counts[counts > 1]).tolist():
        some = counts == count
        times = (rows.rows[some][:, [layout.ROW_STEP]] + rows.theta[some, :count]) * seconds
        weights = gauss_nodes(count).weights * rows.pace[some, :count] * seconds
        force = rows.force[some, :count] * found.prepared.units.force
        parts.append(np.stack([times.ravel(), force.ravel(), weights.ravel()]))
    times, force, weights = np.concatenate(parts, axis=1)
    order = np.argsort(times, kind="stable")
    return Pressing(times[order], force[order], weights[order])


def solved_parts(found: Found, contact: int, end: float) -> Iterator[SolvedParts]:
    """Return the parts of a contact in which it has a force, up to a time, s."""
    rows, seconds = rows_until(found, contact, end), found.prepared.grid.seconds
    counts = rows.rows[:, layout.ROW_NODES].astype(int)
    for count in np.unique(counts[counts > 1]).tolist():
        some, nodes = counts == count, gauss_nodes(count)
        theta = np.column_stack([rows.rows[some][:, layout.ROW_FROM], rows.theta[some, :count]])
        times = (rows.rows[some][:, [layout.ROW_STEP]] + theta) * seconds
        delta = replay(found, times.ravel()).indentation[:, contact].reshape(times.shape)
        yield SolvedParts(
            times[:, 1:], delta[:, 1:], delta @ nodes.slopes.T, rows.pace[some, :count] * seconds,
            rows.force[some, :count] * found.prepared.units.force, nodes.weights,
        )  # fmt: skip


def extremes(found: Found, end: float) -> tuple[float, float]:
    """Return the largest indentation, m, and its largest rate either way, m/s, of any wheel's contact."""
    deepest = fastest = 0.0
    for contact in range(len(found.prepared.system.wheels)):
        for part in solved_parts(found, contact, end):
            deepest = max(deepest, float(part.delta.max()))
            fastest = max(fastest, float(np.abs(part.slope / part.pace).max()))
    return deepest, fastest


def impulses(found: Found, contact: int, begins: FloatArray, end: float) -> FloatArray:
    """Return the impulse of a contact between each of some times and the next, the last up to an end, N s."""
    rows, seconds = rows_until(found, contact, end), found.prepared.grid.seconds
    total = np.append(0.0, np.cumsum(rows.total[:, 0])) * seconds * found.prepared.units.force
    first = np.searchsorted(rows.starts, begins / seconds - 1e-9)
    return np.diff(total[np.append(first, len(rows.rows))])


def works(found: Found, end: float) -> Works:
    """Return works and energies from the start up to a time, s; those of the contacts each on its own."""
    system = found.prepared.system
    contact, path, bodies = np.zeros((3, len(system.contacts)))
    for i, one in enumerate(system.contacts):
        rule = pressing(found, i, end)
        counted = rule.force * rule.weights
        path[i] = system.speed * counted @ path_slopes(one, one.start + system.speed * rule.times)
        bodies[i] = counted @ (replay(found, rule.times).velocity @ system.bodies.shapes)[:, i]
        contact[i] = sum(float((part.weights * part.force * part.slope).sum()) for part in solved_parts(found, i, end))
    return Works(contact, path, bodies, *_of_bodies(found, end))


def _of_bodies(found: Found, end: float) -> tuple[float, FloatArray, float]:
    """Return what the bodies' dampers took, energies at both ends, and the loads' work."""
    bodies, edges = found.prepared.system.bodies, joints(found, end)
    nodes = gauss_nodes(found.prepared.method.nodes)
    times = (edges[:-1, None] + np.diff(edges)[:, None] * nodes.places).ravel()
    velocity = replay(found, times).velocity
    powers = np.einsum("ti,ij,tj->t", velocity, bodies.damping, velocity)
    lost = float(powers @ (np.diff(edges)[:, None] * nodes.weights).ravel())
    at = replay(found, np.array([0.0, end]))
    kinetic = 0.5 * np.einsum("ti,ij,tj->t", at.velocity, bodies.mass, at.velocity)
    springs = 0.5 * np.einsum("ti,ij,tj->t", at.displacement, bodies.stiffness, at.displacement)
    load = float((at.displacement[1] - at.displacement[0]) @ bodies.load)
    return lost, np.column_stack([kinetic, springs]), load
