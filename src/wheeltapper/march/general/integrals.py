"""Integrals over a march from its logs: impulses, works, a rule for others; and the extremes of its indentations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.rows import Rows
from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.careful import sigmas_of
from wheeltapper.march.general.march import Found
from wheeltapper.march.general.replay import mapped, path_slopes, replay, rows_until, steps_at


class Rule(NamedTuple):
    """Rising times, s, and weights, s: Σ weights·f(times) is the integral of f."""

    times: FloatArray
    weights: FloatArray


RULE_STEPS = 512
"""Macro steps of one rule."""
SAME_SIGMA = 1e-12
SUDDEN = 1e-5
"""Of the static force: the smallest jump of a force that counts as one."""
BESIDE = 1e-9
"""How far from a jump, in macro steps, what is on its two sides is looked at."""
EVEN_LEAST = 0.35
"""Share of the nodes of a macro step that a very short part of it is given, where nothing is singular."""


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
        By the bodies' dampers, at each freedom, (freedoms,); those of a deck's bearing act at the last one alone.
    ends
        Kinetic energy, and energy of the springs, of the bodies at the start and at the end: (2, 2).
    load
        Work of the loads.
    """

    contact: FloatArray
    path: FloatArray
    bodies: FloatArray
    dissipated: FloatArray
    ends: FloatArray
    load: float


def rules(found: Found, end: float, steps: int = RULE_STEPS) -> Iterator[Rule]:
    """Return rules for integrals over the whole march up to a time, s, one after the other, for some macro steps each.

    Between two joints of any contact's force the nodes are those of Gauss over σ of a contact that has just had an
    event, or is going to, so that what is singular there does no harm.
    """
    grid, method = found.prepared.grid, found.prepared.method
    last = min(float(grid.steps(np.array(end))), float(found.steps))  # rounding may lie beyond the last step
    for first in range(0, int(np.ceil(last)), steps):
        until = min(float(first + steps), last)
        rows = found.logs.rows
        begin, stop = np.searchsorted(rows["step"], [first, until])
        rows = rows[begin:stop]
        starts = rows["step"] + rows["from"]
        edges = np.unique(np.append(starts[starts < until], until))
        held = _leading(rows, edges)
        even = np.ceil(method.nodes * (EVEN_LEAST + (1.0 - EVEN_LEAST) * np.diff(edges)))
        counts = np.where(held["map"] == layout.EVENLY, even, method.careful_nodes)
        parts = [
            _nodes_over(held[some], edges[:-1][some], edges[1:][some], int(count))
            for count in np.unique(counts)
            for some in [counts == count]
        ]
        at, weights = np.concatenate(parts, axis=1)
        at, weights = at[(order := np.argsort(at, kind="stable"))], weights[order]
        yield Rule(grid.times(at), weights * grid.seconds(at))


def _leading(rows: Rows, edges: FloatArray) -> Rows:
    """Return for each interval the row over whose σ to integrate."""
    middles = 0.5 * (edges[:-1] + edges[1:])
    chosen = np.zeros(len(middles), rows.dtype)
    for contact in np.unique(rows["contact"]):
        own = rows[rows["contact"] == contact]
        here = own[np.searchsorted(own["step"] + own["from"], middles, side="right") - 1]
        curved = (here["nodes"] > 1) & (here["map"] != layout.EVENLY)
        chosen[curved] = here[curved]
    even = chosen["nodes"] == 0.0
    chosen["step"][even] = np.floor(middles[even])
    chosen["map"][even] = layout.EVENLY
    chosen["span"][even] = chosen["s1"][even] = 1.0
    return chosen


def _nodes_over(rows: Rows, begins: FloatArray, ends: FloatArray, count: int) -> FloatArray:
    """Return times and weights, both in macro steps, of Gauss nodes over σ of rows, from their part to another."""
    nodes, each = gauss_nodes(count), np.arange(len(rows))
    sigmas = np.empty((2, len(rows)))
    for sigma, at in zip(sigmas, (begins, ends), strict=True):
        sigmas_of(at - rows["step"], each, rows, sigma)
    sigmas = np.where(np.abs(sigmas - np.rint(sigmas)) < SAME_SIGMA, np.rint(sigmas), sigmas)
    span = (sigmas[1] - sigmas[0])[:, None]
    theta, pace = mapped(rows, sigmas[0][:, None] + span * nodes.places)
    return np.stack([(rows["step"][:, None] + theta).ravel(), (nodes.weights * span * pace).ravel()])


def solved_parts(found: Found, contact: int, end: float) -> Iterator[SolvedParts]:
    """Return the parts of a contact in which it has a force, up to a time, s."""
    rows, grid = rows_until(found, contact, end), found.prepared.grid
    counts = rows.rows["nodes"].astype(int)
    for count in np.unique(counts[counts > 1]).tolist():
        some, nodes = counts == count, gauss_nodes(count)
        theta = np.column_stack([rows.rows[some]["from"], rows.theta[some, :count]])
        steps = rows.rows["step"][some]
        times = grid.times(steps[:, None] + theta)
        delta = replay(found, times.ravel()).indentation[:, contact].reshape(times.shape)
        yield SolvedParts(
            times[:, 1:], delta[:, 1:], delta @ nodes.slopes.T, rows.pace[some, :count] * grid.seconds(steps)[:, None],
            rows.force[some, :count] * found.prepared.units.force, nodes.weights,
        )  # fmt: skip


def jumps(found: Found, end: float) -> FloatArray:
    """Return two times, s, one on either side of each jump of a contact's force up to a time, (jumps, 2), in order."""
    times = [np.empty(0)]
    for contact in range(len(found.prepared.system.contacts)):
        rows = rows_until(found, contact, end)
        begins, ends = np.zeros((2, len(rows.rows)))
        counts = rows.rows["nodes"].astype(int)
        for count in np.unique(counts[counts > 1]).tolist():
            some, nodes = counts == count, gauss_nodes(count)
            coefficients = rows.force[some, :count] @ nodes.transform.T
            begins[some], ends[some] = coefficients @ (-1.0) ** np.arange(count), coefficients.sum(axis=1)
        times.append(rows.starts[1:][np.abs(begins[1:] - ends[:-1]) > SUDDEN])
    at = np.sort(np.concatenate(times))
    at = at[np.diff(at, prepend=-np.inf) > 4.0 * BESIDE]
    return found.prepared.grid.times(at[:, None] + np.array([-BESIDE, BESIDE]))


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
    rows, grid = rows_until(found, contact, end), found.prepared.grid
    each = rows.total[:, 0] * grid.seconds(rows.rows["step"])
    total = np.append(0.0, np.cumsum(each)) * found.prepared.units.force
    first = np.searchsorted(rows.starts, grid.steps(begins) - 1e-9)
    return np.diff(total[np.append(first, len(rows.rows))])


def works(found: Found, end: float) -> Works:
    """Return works and energies from the start up to a time, s; those of the contacts each on its own."""
    system = found.prepared.system
    contact, path, taken = np.zeros((3, len(system.contacts)))
    lost = np.zeros(len(system.bodies.load))
    for rule in rules(found, end):
        at = replay(found, rule.times)
        lost += rule.weights @ (at.velocity * (at.velocity @ system.bodies.damping))
        counted = at.force * rule.weights[:, None]
        for some, part in found.by_stretch(steps_at(found, rule.times)):
            taken += (counted[some] * (at.velocity[some] @ part.prepared.system.bodies.shapes)).sum(axis=0)
        for i, one in enumerate(system.contacts):
            path[i] += system.speed * counted[:, i] @ path_slopes(one, one.start + system.speed * rule.times)
    for i in range(len(system.contacts)):
        contact[i] = sum(float((part.weights * part.force * part.slope).sum()) for part in solved_parts(found, i, end))
    return Works(contact, path, taken, lost, *_of_bodies(found, end))


def _of_bodies(found: Found, end: float) -> tuple[FloatArray, float]:
    """Return the bodies' energies at both ends, and the loads' work."""
    bodies, changes = found.prepared.system.bodies, found.changes
    at = replay(found, np.array([0.0, *changes[changes < end], end]))
    kinetic = 0.5 * np.einsum("ti,ij,tj->t", at.velocity, bodies.mass, at.velocity)
    springs = 0.5 * np.einsum("ti,ij,tj->t", at.displacement, bodies.stiffness, at.displacement)
    loads = [one.bodies.load for one in found.prepared.stretches] or [bodies.load]
    load = sum(float(way @ own) for way, own in zip(np.diff(at.displacement, axis=0), loads, strict=False))
    return np.column_stack([kinetic, springs])[[0, -1]], load
