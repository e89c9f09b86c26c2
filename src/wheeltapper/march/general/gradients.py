"""Derivatives of a general march along some directions: of its events, its force maxima, its impulses and its end."""

from __future__ import annotations

from math import ceil
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.general import layout, tangent, turned
from wheeltapper.march.general import tables as tabulation
from wheeltapper.march.general.algebra import LANES
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.careful import sigmas_of
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.march import Found, order_of, room_of
from wheeltapper.march.general.replay import Parts, pace_at, rows_of

AT_PART_START = 1e-9
"""Macro steps; a maximum no farther from where a part begins is there."""
IN_ONE_PASS = LANES - 2
"""Directions of one pass, beside the two of the start."""


class Tangents(NamedTuple):
    """Derivatives along some directions, in SI units; the rows are those of `Found`.

    Attributes
    ----------
    events
        Of time, s, and rate of indentation, m/s, (events, 2, directions).
    peaks
        Of time and force, N, (peaks, 2, directions); NaN where a maximum has no derivative.
    states
        Of the bodies' states at the march's end, (directions, states).
    pressed
        Of the impulse of each logged part, N·s, (rows, directions).
    of_starts
        How the state at the end changes with the heights and velocities of all wheels at the start, (2, states).
    """

    events: FloatArray
    peaks: FloatArray
    states: FloatArray
    pressed: FloatArray
    of_starts: FloatArray


class _Direction(NamedTuple):
    """What one direction brings; None where it changes nothing."""

    pieces: FloatArray | None
    laws: FloatArray
    seconds: float
    tables: Any
    start: Any


def _direction(found: Found, turn: turned.SystemTurn) -> _Direction:
    prepared = found.prepared
    pieces, laws = turned.turned_pieces(prepared, turn), turned.turned_laws(prepared, turn)
    start = turned.turned_start(prepared, turn, laws, pieces)
    moved = turn.is_structured or bool(np.any(start.offsets))
    return _Direction(
        pieces,
        laws,
        turned.slowed(prepared, turn),
        turned.turned_tables(prepared, turn, start.offsets) if moved else None,
        start,
    )


def _stacked(each: list[_Direction], name: str, like: FloatArray, axis: int | None = None) -> FloatArray:
    """Return a table of all directions; `axis` is that of the places, of which one may stand for all."""
    tables = [None if one.tables is None else getattr(one.tables, name) for one in each]
    places = max((table.shape[axis] for table in tables if table is not None), default=1) if axis is not None else 0
    shape = list(like.shape)
    if axis is not None:
        shape[axis] = places
    out = np.zeros((len(each), *shape))
    for whole, table in zip(out, tables, strict=True):
        if table is not None:
            whole[:] = table
    return out


def _turns(found: Found, each: list[_Direction]) -> tangent.Turns:
    prepared = found.prepared
    tables, data, ring = prepared.tables, prepared.data, prepared.system.ring
    bends = [one.pieces for one in each if one.pieces is not None]
    bent = np.cumsum([one.pieces is not None for one in each]) - 1
    changed: Any = {
        name: _stacked(each, name, getattr(tables, name), axis)
        for name, axis in (
            ("bodies_read", None), ("bodies_write", None), ("bodies_step", None), ("kernels", 1), ("matrices", 1),
            ("cross", 2),
        )
    }  # fmt: skip
    rates = np.zeros(0, complex) if ring is None else ring.rates[order_of(ring)]
    rates = np.multiply.outer(prepared.grid.lengths, rates)
    nodes = data.macro
    return tangent.Turns(
        bent=np.where([one.pieces is not None for one in each], bent, -1),
        bends=np.stack(bends) if bends else np.zeros((1, *data.pieces.shape)),
        laws=np.stack([one.laws for one in each]), seconds=np.array([one.seconds for one in each]),
        structured=np.array([one.tables is not None for one in each], dtype=np.int64), **changed,
        rates=np.stack([rates.real, rates.imag], axis=1), later=nodes.transform * nodes.places @ nodes.values,
        remaining=nodes.values.T * (1.0 - nodes.places) @ nodes.transform.T,
    )  # fmt: skip


def _scratch(found: Found, columns: int) -> tuple[tangent.Posed, tangent.Carried]:
    prepared = found.prepared
    contacts, q = len(prepared.data.starts), prepared.method.nodes
    states, modes = prepared.tables.bodies_step.shape[1], prepared.tables.decay.shape[2]
    parts, nodes = layout.MOST_PARTS + 2, layout.MOST_NODES

    def of_parts(*more: int) -> FloatArray:
        return np.zeros((contacts, parts, *more))

    def whole(*more: int) -> IntArray:
        return np.zeros((contacts, *more), dtype=np.int64)

    def of_contacts(*more: int) -> FloatArray:
        return np.zeros((contacts, *more, LANES))

    posed = tangent.Posed(
        counts=whole(2), rows=whole(parts), P=of_parts(nodes, nodes), pace=of_parts(nodes), J=of_parts(nodes, nodes),
        K=of_parts(nodes, nodes), r=of_parts(nodes), slope=of_parts(nodes), viscous=of_parts(nodes),
        smoothly=whole(parts), given=of_parts(nodes, LANES), direct=of_parts(nodes, LANES),
        jumps=whole(parts), drop=of_parts(), moved=of_parts(LANES), risen=of_parts(LANES),
        after=whole(parts), events=whole(parts), steep=of_parts(), bend=of_parts(), leaps=whole(parts),
        raised=of_parts(2, LANES), forces=of_parts(nodes, LANES),
    )  # fmt: skip
    carried = tangent.Carried(
        free=of_contacts(q), change=of_contacts(q), moments=of_contacts(q), began=of_contacts(), felt=of_contacts(q),
        steps=np.zeros(LANES), sizes=np.zeros(LANES), shares=of_contacts(q, q), base=np.zeros((contacts, q, q)),
        sums=np.zeros((q, q)), gap=np.zeros((q, LANES)), delta=np.zeros((nodes, LANES)),
        bodies=np.zeros((states, LANES)), seen=np.zeros((columns, q)), written=np.zeros((columns, q)),
        rows=np.zeros((q, 2, modes), prepared.tables.reads.dtype),
    )  # fmt: skip
    return posed, carried


def tangent_arguments(found: Found, turns: list[turned.SystemTurn]) -> tuple[Any, ...]:
    """Return the arguments of the kernel: the directions, and two more of all wheels' height and velocity at the start.

    They tell how a small change of the start grows.
    """
    prepared, logs = found.prepared, found.logs
    each = [_direction(found, turn) for turn in turns]
    contacts, states = len(prepared.data.starts), prepared.tables.bodies_step.shape[1]
    idle = _Direction(None, np.zeros((contacts, switch.LAW_NUMBERS)), 0.0, None, None)
    all_of = [*each, idle, idle]
    count = len(all_of)
    marched = 2 if any(one.seconds for one in each) else 0  # columns of the march itself
    columns = 2 * ceil((count + marched) / 2)  # they are multiplied in fours and pairs
    state = tangent.Turned(
        np.zeros((columns, *prepared.motion.modes.shape)), np.zeros((states, LANES)), np.zeros((contacts, LANES)),
        np.zeros((contacts, LANES)), np.zeros(contacts),
    )  # fmt: skip
    for number, one in enumerate(each):
        state.modes[number], state.began[:, number] = one.start.modes, one.start.began
        state.bodies[:-1, number] = one.start.bodies
    if marched:
        state.modes[count] = prepared.motion.modes
    bodies = prepared.system.bodies
    freedoms = len(bodies.mass)
    wheels = bodies.shapes.sum(axis=1) > 0.0
    state.bodies[:freedoms, count - 2] = wheels
    state.bodies[freedoms:-1, count - 1] = wheels[tabulation.heavy_of(bodies)]
    state.began[:, count - 2] = 1.0 / prepared.units.length
    motion = prepared.motion.copy()
    told = tangent.Told(
        np.zeros((len(logs.rows), layout.MOST_NODES, LANES)), np.zeros((len(logs.rows), LANES)),
        np.zeros(len(logs.rows)), np.zeros((len(logs.events), 2, LANES)),
    )  # fmt: skip
    return (
        prepared.tables, _turns(found, all_of), prepared.data, logs, motion, state, *_scratch(found, columns), told,
        room_of(states),
    )  # fmt: skip


def tangents(found: Found, turns: list[turned.SystemTurn]) -> Tangents:
    """Return the derivatives of a march along some directions."""
    groups = [turns[first : first + IN_ONE_PASS] for first in range(0, max(len(turns), 1), IN_ONE_PASS)]
    parts = [_tangents(found, group) for group in groups]
    if len(parts) == 1:
        return parts[0]
    events, peaks, pressed = (
        np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in ("events", "peaks", "pressed")
    )
    states = np.concatenate([part.states for part in parts])
    return Tangents(events, peaks, states, pressed, parts[0].of_starts)


def _tangents(found: Found, turns: list[turned.SystemTurn]) -> Tangents:
    arguments = tangent_arguments(found, turns)
    tables, state, told = arguments[1], arguments[5], arguments[-2]
    if not tangent.tangent_kernel(*arguments):
        raise ArithmeticError("contacts do not settle with each other")
    prepared, logs, count = found.prepared, found.logs, len(turns)
    grid, units = prepared.grid, prepared.units
    at = logs.events["step"] + logs.events["part"]
    order = np.argsort(at, kind="stable")[: len(found.events)]
    at, seconds = at[order], grid.seconds(logs.events["step"][order])
    slower = tables.seconds[:count]
    events = told.events[order][:, :, :count]
    events[:, tangent.OF_TIME] = events[:, tangent.OF_TIME] * seconds[:, None] + grid.times(at)[:, None] * slower
    events[:, tangent.OF_SIZE] *= units.length
    told = told._replace(forces=np.ascontiguousarray(told.forces.transpose(0, 2, 1)[:, :count]))
    peaks = _of_peaks(found, told, slower)
    ends = state.bodies[:-1].T
    return Tangents(events, peaks, ends[:count], _of_impulses(found, told, slower), ends[count : count + 2])


# -- from parts to maxima and impulses --------------------------------------------------------------------------------


def _of_peaks(found: Found, told: tangent.Told, slower: FloatArray) -> FloatArray:
    """Return the derivatives of time and force of the maxima, (peaks, 2, directions)."""
    prepared, logs, grid = found.prepared, found.logs, found.prepared.grid
    at = logs.peaks["step"] + logs.peaks["part"]
    order = np.argsort(at, kind="stable")[: len(found.peaks)]
    at, contact = at[order], logs.peaks["contact"][order]
    seconds = grid.seconds(logs.peaks["step"][order])
    out = np.full((len(order), 2, len(slower)), np.nan)
    for i in range(len(prepared.data.starts)):
        own, rows = np.flatnonzero(contact == i), rows_of(found, i)
        mine = np.flatnonzero(logs.rows["contact"] == i)
        smooth = own[found.peaks[own, 3] == 0.0]
        row = np.clip(np.searchsorted(rows.starts, at[smooth], side="right") - 1, 0, None)
        sigma = _sigma(rows, row, at[smooth])
        force, change = _along(rows.force, rows, row, sigma), _along(told.forces[mine], rows, row, sigma)
        pace = pace_at(rows.rows[row], sigma)[0][:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            later = -change[1] / force[2] * pace
        out[smooth, tangent.OF_TIME] = later[:, : len(slower)]
        out[smooth, tangent.OF_SIZE] = change[0][:, : len(slower)]
        _of_corners(found, told, rows, mine, own[found.peaks[own, 3] != 0.0], at, out)
    out[:, tangent.OF_TIME] = out[:, tangent.OF_TIME] * seconds[:, None] + grid.times(at)[:, None] * slower
    out[:, tangent.OF_SIZE] *= prepared.units.force
    return out


def _of_corners(
    found: Found, told: tangent.Told, rows: Parts, mine: IntArray, peaks: IntArray, at: FloatArray, out: FloatArray
) -> None:
    """Write the derivatives of maxima where the path has a kink or jumps: they move with it."""
    ends = rows.rows["step"] + rows.rows["to"]
    for peak in peaks:
        begins, stops = (np.flatnonzero(np.abs(edge - at[peak]) < AT_PART_START) for edge in (rows.starts, ends))
        if not len(begins):
            continue
        moved = told.moved[mine[begins[-1]], : out.shape[2]]
        sides = [(row, sigma) for some, sigma in ((stops, 1.0), (begins, 0.0)) for row in some]
        size = found.peaks[peak, 1] / found.prepared.units.force
        best = np.inf
        for row, sigma in sides:
            if rows.rows["nodes"][row] == 1:
                continue
            where, there = np.array([row]), np.array([sigma])
            force = _along(rows.force, rows, where, there)
            if abs(force[0][0, 0] - size) < best:
                best = abs(force[0][0, 0] - size)
                change = _along(told.forces[mine], rows, where, there)[0][0, : out.shape[2]]
                pace = pace_at(rows.rows[where], there)[0]
                out[peak, tangent.OF_TIME], out[peak, tangent.OF_SIZE] = moved, change + force[1][0] / pace * moved


def _sigma(rows: Parts, row: IntArray, at: FloatArray) -> FloatArray:
    out = np.zeros(len(row))
    sigmas_of(at - rows.rows["step"][row], row, rows.rows, out)
    return np.clip(out, 0.0, 1.0)


def _along(values: FloatArray, rows: Parts, row: IntArray, sigma: FloatArray) -> list[FloatArray]:
    """Return polynomials held at the nodes of some rows, and two derivatives by σ, at one σ of each: (places, …)."""
    values = values[row].reshape(
        len(row), values[:1].size // layout.MOST_NODES if len(values) else 0, layout.MOST_NODES
    )
    out = [np.zeros(values.shape[:2]) for _ in range(3)]
    counts = rows.rows["nodes"][row].astype(int)
    for count in np.unique(counts[counts > 1]).tolist():
        some, nodes = counts == count, gauss_nodes(count)
        coefficients = values[some, :, :count] @ nodes.transform.T
        z = 2.0 * sigma[some] - 1.0
        for order, held in enumerate(out):
            basis = np.stack([2.0**order * legendre.legval(z, legendre.legder(one, order)) for one in np.eye(count)], 1)
            held[some] = (coefficients * basis[:, None]).sum(axis=2)
    return out


def _of_impulses(found: Found, told: tangent.Told, slower: FloatArray) -> FloatArray:
    """Return the derivatives of the impulse of each logged part, N·s, (rows, directions)."""
    logs, units, grid = found.logs, found.prepared.units, found.prepared.grid
    out = np.zeros((len(logs.rows), len(slower)))
    for i in range(len(found.prepared.data.starts)):
        rows, mine = rows_of(found, i), np.flatnonzero(logs.rows["contact"] == i)
        counts = rows.rows["nodes"].astype(int)
        for count in np.unique(counts[counts > 1]).tolist():
            some = np.flatnonzero(counts == count)
            weights = gauss_nodes(count).weights * rows.pace[some, :count]
            out[mine[some]] = np.einsum("rn,rdn->rd", weights, told.forces[mine[some], : len(slower), :count])
        out[mine] += rows.total[:, :1] * slower + told.drops[mine, None] * told.moved[mine, : len(slower)]
    return np.asarray(out * (grid.seconds(logs.rows["step"]) * units.force)[:, None])


def impulse_rates(found: Found, rates: Tangents, contact: int) -> FloatArray:
    """Return the derivatives of a contact's impulses from each impact to the next loss, N·s, (impacts, directions).

    NaN where a contact lasts beyond the march.
    """
    rows, grid = found.logs.rows, found.prepared.grid
    mine = np.flatnonzero(rows["contact"] == contact)
    starts = rows["step"][mine] + rows["from"][mine]
    total = np.vstack([np.zeros(rates.pressed.shape[1]), np.cumsum(rates.pressed[mine], axis=0)])
    events = found.events[found.events[:, contract.EVENT_CONTACT] == contact]
    impacts = np.flatnonzero(events[:, contract.EVENT_KIND] == contract.IMPACT)
    out = np.full((len(impacts), rates.pressed.shape[1]), np.nan)
    for number, impact in enumerate(impacts):
        if impact + 1 < len(events):
            first, last = np.searchsorted(starts, grid.steps(events[impact : impact + 2, 0]) - tangent.AT_PART_END)
            out[number] = total[last] - total[first]
    return out
