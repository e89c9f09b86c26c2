"""Derivatives of a general march along some directions: of its events, its force maxima, its impulses and its end."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march import program as contract
from wheeltapper.march.general import layout, tangent, turned
from wheeltapper.march.general import tables as tabulation
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.careful import sigmas_of
from wheeltapper.march.general.laws import switch
from wheeltapper.march.general.march import Found, room_of, stage_of
from wheeltapper.march.general.records import Motion
from wheeltapper.march.general.replay import Rows, pace_at, rows_of
from wheeltapper.march.kernel import is_compiled
from wheeltapper.march.program import FloatArray, IntArray

AT_PART_START = 1e-9
"""Macro steps; a maximum no farther from where a part begins is there."""


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
    tables, data, q = found.prepared.tables, found.prepared.data, found.prepared.method.nodes
    bends = [one.pieces for one in each if one.pieces is not None]
    bent = np.cumsum([one.pieces is not None for one in each]) - 1
    modal = [one.tables for one in each if one.tables is not None and one.tables.decay.size]
    which = np.cumsum([one.tables is not None and bool(one.tables.decay.size) for one in each]) - 1
    held: Any = (np.stack([one.reads for one in modal]), np.stack([one.writes for one in modal])) if modal else (
        np.zeros((1, 1, 1, q, 2, 0), tables.reads.dtype), np.zeros((1, 1, 1, q, 2, 0), tables.reads.dtype)
    )  # fmt: skip
    changed: Any = {
        name: _stacked(each, name, getattr(tables, name), axis)
        for name, axis in (
            ("bodies_read", None), ("bodies_write", None), ("bodies_step", None), ("kernels", 1), ("cross", 2),
            ("residual", 1),
        )
    }  # fmt: skip
    return tangent.Turns(
        bent=np.where([one.pieces is not None for one in each], bent, -1),
        bends=np.stack(bends) if bends else np.zeros((1, *data.pieces.shape)),
        laws=np.stack([one.laws for one in each]), seconds=np.array([one.seconds for one in each]),
        structured=np.array([one.tables is not None for one in each], dtype=np.int64), **changed,
        modal=np.where([one.tables is not None and bool(one.tables.decay.size) for one in each], which, -1),
        reads=held[0], writes=held[1],
        decay=np.stack([one.decay for one in modal]) if modal else np.zeros((1, 1, 2, 0)),
    )  # fmt: skip


def _scratch(contacts: int, directions: int, q: int, modes: int, states: int) -> tuple[tangent.Posed, tangent.Carried]:
    parts, nodes = layout.MOST_PARTS + 2, layout.MOST_NODES

    def of_parts(*more: int) -> FloatArray:
        return np.zeros((contacts, parts, *more))

    def whole(*more: int) -> IntArray:
        return np.zeros((contacts, *more), dtype=np.int64)

    def along(*more: int) -> FloatArray:
        return np.zeros((directions, contacts, *more))

    posed = tangent.Posed(
        counts=whole(2), rows=whole(parts), P=of_parts(nodes, nodes), pace=of_parts(nodes), J=of_parts(nodes, nodes),
        K=of_parts(nodes, nodes), r=of_parts(nodes), slope=of_parts(nodes), viscous=of_parts(nodes),
        smoothly=whole(parts), given=of_parts(directions, nodes), direct=of_parts(directions, nodes),
        jumps=whole(parts), drop=of_parts(), moved=of_parts(directions), risen=of_parts(directions),
        after=whole(parts), events=whole(parts), steep=of_parts(), bend=of_parts(), leaps=whole(parts),
        raised=of_parts(2, directions), forces=np.zeros((contacts, directions, parts, nodes)),
    )  # fmt: skip
    carried = tangent.Carried(
        free=along(q), change=along(q), moments=along(q), began=along(), felt=along(q),
        shares=np.zeros((directions + 1, contacts, q, q)), sums=np.zeros((q, q)),
        modes=np.zeros((directions, 2, modes)), spare=np.zeros(max(32, states)),
    )  # fmt: skip
    return posed, carried


def tangent_arguments(found: Found, turns: list[turned.SystemTurn]) -> tuple[Any, ...]:
    """Return the arguments of the kernel: the directions, and two more of all wheels' height and velocity at the start.

    They tell how a small change of the start grows.
    """
    prepared, logs = found.prepared, found.logs
    each = [_direction(found, turn) for turn in turns]
    contacts, q = len(prepared.data.starts), prepared.method.nodes
    states, modes = prepared.tables.bodies_step.shape[1], prepared.tables.decay.shape[2]
    idle = _Direction(None, np.zeros((contacts, switch.LAW_NUMBERS)), 0.0, None, None)
    all_of = [*each, idle, idle]
    count = len(all_of)
    state = tangent.Turned(
        np.zeros((count, 2, modes)), np.zeros((count, states)), np.zeros((count, contacts)),
        np.zeros((count, contacts)), np.zeros(contacts),
    )  # fmt: skip
    for number, one in enumerate(each):
        state.modes[number], state.began[number] = one.start.modes, one.start.began
        state.bodies[number, :-1] = one.start.bodies
    bodies = prepared.system.bodies
    freedoms = len(bodies.mass)
    wheels = bodies.shapes.sum(axis=1) > 0.0
    state.bodies[-2, :freedoms], state.bodies[-1, freedoms:-1] = wheels, wheels[tabulation.heavy_of(bodies)]
    state.began[-2] = 1.0 / prepared.units.length
    motion = Motion(*(table.copy() for table in prepared.motion))
    posed, carried = _scratch(contacts, count, q, modes, states)
    told = tangent.Told(
        np.zeros((len(logs.rows), count, layout.MOST_NODES)), np.zeros((len(logs.rows), count)),
        np.zeros(len(logs.rows)), np.zeros((len(logs.events), 2, count)),
        np.zeros((len(logs.moments) + 1, count, states)),
    )  # fmt: skip
    return (
        prepared.tables, _turns(found, all_of), prepared.data, logs, motion, stage_of(contacts, q, modes), state, posed,
        carried, told, room_of(states),
    )  # fmt: skip


def is_ready(found: Found) -> bool:
    """Return False where finding derivatives of a march begins with compiling."""
    return is_compiled(tangent.tangent_kernel, tangent_arguments(found, []))


def tangents(found: Found, turns: list[turned.SystemTurn]) -> Tangents:
    """Return the derivatives of a march along some directions."""
    arguments = tangent_arguments(found, turns)
    tables, told = arguments[1], arguments[-2]
    if not tangent.tangent_kernel(*arguments):
        raise ArithmeticError("contacts do not settle with each other")
    prepared, logs, count = found.prepared, found.logs, len(turns)
    grid, units = prepared.grid, prepared.units
    at = logs.events[:, layout.EVENT_STEP] + logs.events[:, layout.EVENT_PART]
    order = np.argsort(at, kind="stable")[: len(found.events)]
    at, seconds = at[order], grid.seconds(logs.events[order, layout.EVENT_STEP])
    slower = tables.seconds[:count]
    events = told.events[order][:, :, :count]
    events[:, tangent.OF_TIME] = events[:, tangent.OF_TIME] * seconds[:, None] + grid.times(at)[:, None] * slower
    events[:, tangent.OF_SIZE] *= units.length
    peaks = _of_peaks(found, told, slower)
    return Tangents(
        events, peaks, told.bodies[-1, :count, :-1], _of_impulses(found, told, slower), told.bodies[-1, count:, :-1]
    )


# -- from parts to maxima and impulses --------------------------------------------------------------------------------


def _of_peaks(found: Found, told: tangent.Told, slower: FloatArray) -> FloatArray:
    """Return the derivatives of time and force of the maxima, (peaks, 2, directions)."""
    prepared, logs, grid = found.prepared, found.logs, found.prepared.grid
    at = logs.peaks[:, layout.MAXIMUM_STEP] + logs.peaks[:, layout.MAXIMUM_PART]
    order = np.argsort(at, kind="stable")[: len(found.peaks)]
    at, contact = at[order], logs.peaks[order, layout.MAXIMUM_CONTACT]
    seconds = grid.seconds(logs.peaks[order, layout.MAXIMUM_STEP])
    out = np.full((len(order), 2, len(slower)), np.nan)
    for i in range(len(prepared.data.starts)):
        own, rows = np.flatnonzero(contact == i), rows_of(found, i)
        mine = np.flatnonzero(logs.rows[:, layout.ROW_CONTACT] == i)
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
    found: Found, told: tangent.Told, rows: Rows, mine: IntArray, peaks: IntArray, at: FloatArray, out: FloatArray
) -> None:
    """Write the derivatives of maxima where the path has a kink or jumps: they move with it."""
    ends = rows.rows[:, layout.ROW_STEP] + rows.rows[:, layout.ROW_TO]
    for peak in peaks:
        begins, stops = (np.flatnonzero(np.abs(edge - at[peak]) < AT_PART_START) for edge in (rows.starts, ends))
        if not len(begins):
            continue
        moved = told.moved[mine[begins[-1]], : out.shape[2]]
        sides = [(row, sigma) for some, sigma in ((stops, 1.0), (begins, 0.0)) for row in some]
        size = found.peaks[peak, 1] / found.prepared.units.force
        best = np.inf
        for row, sigma in sides:
            if rows.rows[row, layout.ROW_NODES] == 1:
                continue
            where, there = np.array([row]), np.array([sigma])
            force = _along(rows.force, rows, where, there)
            if abs(force[0][0, 0] - size) < best:
                best = abs(force[0][0, 0] - size)
                change = _along(told.forces[mine], rows, where, there)[0][0, : out.shape[2]]
                pace = pace_at(rows.rows[where], there)[0]
                out[peak, tangent.OF_TIME], out[peak, tangent.OF_SIZE] = moved, change + force[1][0] / pace * moved


def _sigma(rows: Rows, row: IntArray, at: FloatArray) -> FloatArray:
    out = np.zeros(len(row))
    sigmas_of(at - rows.rows[row, layout.ROW_STEP], row, rows.rows, out)
    return np.clip(out, 0.0, 1.0)


def _along(values: FloatArray, rows: Rows, row: IntArray, sigma: FloatArray) -> list[FloatArray]:
    """Return polynomials held at the nodes of some rows, and two derivatives by σ, at one σ of each: (places, …)."""
    values = values[row].reshape(
        len(row), values[:1].size // layout.MOST_NODES if len(values) else 0, layout.MOST_NODES
    )
    out = [np.zeros(values.shape[:2]) for _ in range(3)]
    counts = rows.rows[row, layout.ROW_NODES].astype(int)
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
        rows, mine = rows_of(found, i), np.flatnonzero(logs.rows[:, layout.ROW_CONTACT] == i)
        counts = rows.rows[:, layout.ROW_NODES].astype(int)
        for count in np.unique(counts[counts > 1]).tolist():
            some = np.flatnonzero(counts == count)
            weights = gauss_nodes(count).weights * rows.pace[some, :count]
            out[mine[some]] = np.einsum("rn,rdn->rd", weights, told.forces[mine[some], : len(slower), :count])
        out[mine] += rows.total[:, :1] * slower + told.drops[mine, None] * told.moved[mine, : len(slower)]
    return np.asarray(out * (grid.seconds(logs.rows[:, layout.ROW_STEP]) * units.force)[:, None])


def impulse_rates(found: Found, rates: Tangents, contact: int) -> FloatArray:
    """Return the derivatives of a contact's impulses from each impact to the next loss, N·s, (impacts, directions).

    NaN where a contact lasts beyond the march.
    """
    rows, grid = found.logs.rows, found.prepared.grid
    mine = np.flatnonzero(rows[:, layout.ROW_CONTACT] == contact)
    starts = rows[mine, layout.ROW_STEP] + rows[mine, layout.ROW_FROM]
    total = np.vstack([np.zeros(rates.pressed.shape[1]), np.cumsum(rates.pressed[mine], axis=0)])
    events = found.events[found.events[:, contract.EVENT_CONTACT] == contact]
    impacts = np.flatnonzero(events[:, contract.EVENT_KIND] == contract.IMPACT)
    out = np.full((len(impacts), rates.pressed.shape[1]), np.nan)
    for number, impact in enumerate(impacts):
        if impact + 1 < len(events):
            first, last = np.searchsorted(starts, grid.steps(events[impact : impact + 2, 0]) - tangent.AT_PART_END)
            out[number] = total[last] - total[first]
    return out
