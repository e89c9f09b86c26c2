"""How a march changes along a direction, at any fixed time: its forces, its bodies and its track.

Tangents tell how the forces change. What bodies and track do is linear in forces, so that they are replayed:

bodies   M·Δy'' + C·Δy' + K·Δy = Δload - shapes·ΔN - ΔM·y'' - ΔC·y' - ΔK·y: bodies and their change are the bodies of
         one system, on which N and ΔN act.
track    The modes take ΔN as they take N. Along a change of the speed V the places x of all wheels move by t·ΔV, so
         that they also take Ψ'(x)·t·N·ΔV.

At a fixed time ΔN is that of a logged node less N' times the change of its time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general import gradients, replay, tangent
from wheeltapper.march.general import tables as tabulation
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.contract import Bodies
from wheeltapper.march.general.laws.switch import TWO_SIDED
from wheeltapper.march.general.march import Found, Prepared, order_of
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.turned import SystemTurn

JUMPS = 1e-6
"""Drop of a force at a joint of the path, over the unit of force, from which on it jumps; less is rounding."""


@dataclass(eq=False)
class Change:
    """The change of a march along a direction, with what records ask of a march.

    It is NaN, but for forces, where the path makes a force jump in another place: there the tangents of bodies and
    track would be impulses.

    Attributes
    ----------
    status, end
        Those of the march.
    """

    status: int
    end: float
    _found: Found
    _turn: SystemTurn
    _forces: FloatArray  # at the nodes of all parts
    _modes: FloatArray  # at the start
    _states: FloatArray

    @property
    def sinking(self) -> FloatArray:
        """Of the march, m."""
        return self._found.sinking

    def at(self, times: FloatArray) -> replay.Replayed:
        """Return everything but the track's modes at some times, s."""
        return replay.Replayed(*(one[:, one.shape[1] // 2 :] for one in replay.replay(self._bodies, times)))

    def forces(self, times: FloatArray) -> FloatArray:
        """Return the forces of all contacts at some times, s, and nothing else."""
        return replay.forces(self._under, times)

    def modes(self, times: FloatArray, bends: bool = True) -> replay.Modes:
        """Return the track's modes at some times, s."""
        return replay.modes(self._track, times, bends)

    def moved(self, times: FloatArray) -> replay.Replayed | None:
        """Return the march's own forces where wheels are elsewhere, by t for a unit of the direction; else None."""
        return replay.replay(self._found, times) if self._turn.speed else None

    @cached_property
    def _under(self) -> Found:
        return _under(self._found, [self._forces])

    @cached_property
    def _bodies(self) -> Found:
        """March and change together: forces and bodies of the march, then those of the change."""
        return _of_bodies(self._found, self._turn, [self._found.logs.rows["forces"], self._forces], self._states)

    @cached_property
    def _track(self) -> Found:
        also = [_times(self._found) * self._found.logs.rows["forces"]] if self._turn.speed else []
        return _of_track(self._found, [self._forces, *also], self._modes)


def changes(found: Found, status: int, end: float, turns: list[SystemTurn]) -> list[Change]:
    """Return how a march changes along some directions."""
    most = gradients.IN_ONE_PASS
    groups = [turns[first : first + most] for first in range(0, len(turns), most)]
    return [change for group in groups for change in _changes(found, status, end, group)]


def _changes(found: Found, status: int, end: float, turns: list[SystemTurn]) -> list[Change]:
    arguments = gradients.tangent_arguments(found, turns)
    tables, state, told = arguments[1], arguments[5], arguments[-2]
    modes, states = state.modes.copy(), state.bodies.copy()  # at the start; the kernel moves them on
    if not tangent.tangent_kernel(*arguments):
        raise ArithmeticError("contacts do not settle with each other")
    out = []
    for lane, turn in enumerate(turns):
        forces = told.forces[:, :, lane]
        if turn.speed:
            forces = forces - _rates(found) * _times(found) * tables.seconds[lane]
        jumps = bool(np.any((np.abs(told.drops) > JUMPS) & (told.moved[:, lane] != 0.0)))
        begin = np.nan if jumps else 1.0
        out.append(Change(status, end, found, turn, forces, begin * modes[lane], begin * states[:-1, lane]))
    return out


# -- forces at nodes --------------------------------------------------------------------------------------------------


def _times(found: Found) -> FloatArray:
    """Return the times of the nodes of all parts, s, (rows, nodes)."""
    return _at_nodes(found, lambda grid, parts, count: grid.times(parts.rows["step"][:, None] + parts.theta[:, :count]))


def _rates(found: Found) -> FloatArray:
    """Return the rates of all forces at their nodes, by s, (rows, nodes)."""

    def rates(grid: tabulation.Grid, parts: replay.Parts, count: int) -> FloatArray:
        nodes = gauss_nodes(count)
        by_sigma = parts.force[:, :count] @ nodes.transform.T @ replay.derivatives_of_legendre(count) @ nodes.values.T
        return np.asarray(by_sigma / parts.pace[:, :count] / grid.seconds(parts.rows["step"])[:, None])

    return _at_nodes(found, rates)


def _at_nodes(found: Found, read: Any) -> FloatArray:
    """Return what is read of the parts of each contact that have the same number of nodes, (rows, nodes)."""
    rows, grid = found.logs.rows, found.prepared.grid
    out = np.zeros(rows["forces"].shape)
    for contact in range(len(found.prepared.system.contacts)):
        mine, parts = np.flatnonzero(rows["contact"] == contact), replay.rows_of(found, contact)
        counts = parts.rows["nodes"].astype(int)
        for count in np.unique(counts[counts > 1]).tolist():
            some = counts == count
            out[mine[some], :count] = read(grid, replay.Parts(*(one[some] for one in parts)), count)
    return out


def _under(found: Found, forces: Sequence[FloatArray]) -> Found:
    """Return a march whose contacts stand there several times, each time with other forces at their nodes."""
    logs, system, many = found.logs, found.prepared.system, len(forces)
    contacts, steps = len(system.contacts), len(logs.moments)
    rows = np.concatenate([logs.rows] * many)
    rows["forces"] = np.concatenate(forces)
    rows["contact"] += np.repeat(np.arange(many) * contacts, len(logs.rows))
    rows = rows[np.argsort(rows["step"], kind="stable")]
    pulling: Any = tuple(one._replace(law=one.law._replace(kind=TWO_SIDED)) for one in system.contacts)  # either sign
    moments = np.zeros((steps, many * contacts, logs.moments.shape[2]))
    held = found._replace(
        prepared=found.prepared._replace(system=system._replace(contacts=pulling * many)),
        logs=logs._replace(rows=rows, gaps=np.full(moments.shape, np.nan)),
    )
    for contact in range(many * contacts):
        parts = replay.rows_of(held, contact)
        np.add.at(moments[:, contact], parts.rows["step"].astype(np.int64), parts.total)
    return held._replace(logs=held.logs._replace(moments=moments))


# -- bodies -----------------------------------------------------------------------------------------------------------


def _of_bodies(found: Found, turn: SystemTurn, forces: list[FloatArray], start: FloatArray) -> Found:
    """Return march and change together; `start` is the change of the bodies' state at time zero."""
    prepared, tables = found.prepared, found.prepared.tables
    both = _both(prepared.system.bodies, turn.bodies)
    held, freedoms, states = _under(found, forces), len(prepared.system.bodies.mass), tabulation.states_of(both)
    began = found.logs.bodies[0]
    state = np.concatenate(
        [began[:freedoms], start[:freedoms], began[freedoms:-1], start[freedoms:], [1.0]]
    )  # fmt: skip
    moved = []
    nodes, unit = gauss_nodes(prepared.method.nodes), prepared.units.force
    for seconds in prepared.grid.lengths.tolist():
        through = tabulation.exponentials(states.A * seconds, 1.0 - nodes.places) @ states.B
        whole = tabulation.exponentials(states.A * seconds, np.ones(1))[0]
        moved.append((whole, -seconds * unit * np.tensordot(nodes.transform, through, (1, 0))))
    log = np.empty((len(held.logs.moments), len(state)))
    for step, moments in enumerate(held.logs.moments):
        whole, taken = moved[tables.which[step % len(tables.which)]]
        log[step] = state
        state = whole @ state + np.tensordot(moments, taken, ((0, 1), (2, 0)))
    twice: Any = {name: np.concatenate([getattr(tables, name)] * 2) for name in ("kernels", "residual")}
    return held._replace(
        prepared=held.prepared._replace(
            system=held.prepared.system._replace(bodies=both), tables=tables._replace(**twice),
            start=prepared.start._replace(offsets=np.tile(prepared.start.offsets, 2)),
        ),
        logs=held.logs._replace(bodies=log),
    )  # fmt: skip


def _both(bodies: Bodies, turn: Bodies) -> Bodies:
    """Return bodies and their change as one block."""
    none = np.zeros_like(bodies.mass)
    mass, damping, stiffness = (
        np.block([[own, none], [change, own]])
        for own, change in (
            (bodies.mass, turn.mass), (bodies.damping, turn.damping), (bodies.stiffness, turn.stiffness)
        )
    )  # fmt: skip
    shapes = np.asarray(np.kron(np.eye(2), bodies.shapes))
    return Bodies(mass, damping, stiffness, shapes, np.concatenate([bodies.load, turn.load]))


# -- the track --------------------------------------------------------------------------------------------------------


def _of_track(found: Found, forces: list[FloatArray], start: FloatArray) -> Found:
    """Return the change of the modes under forces; the second ones, if any, act where shapes have their slopes."""
    held, prepared = _under(found, forces), found.prepared
    if len(forces) > 1:
        held = held._replace(prepared=held.prepared._replace(tables=_with_slopes(prepared)))
    begin = replay.track_run(held)._replace(modes=start[None])
    known = replay.Starts(begin).checkpoints()
    return held._replace(logs=held.logs._replace(modes=np.stack([known.real, known.imag], axis=1)))


def _with_slopes(prepared: Prepared) -> Any:
    """Return tables in which each contact stands once more, and drives the modes by the slopes of their shapes."""
    ring, grid, method, tables = prepared.system.ring, prepared.grid, prepared.method, prepared.tables
    assert ring is not None
    order, nodes = order_of(ring), gauss_nodes(method.nodes)
    steep = _driven_by_slopes(ring)
    made = tabulation.sets_of(steep, order, grid, lambda part: tabulation.ring_tables(steep, order, grid, part, nodes))
    writes = tabulation.modal_tables(steep, order, grid, made, [], nodes, method, prepared.units).writes
    twice: Any = {name: np.tile(getattr(tables, name), 2) for name in ("phase", "bay")}
    sets = np.concatenate([tables.sets, len(tables.writes) + tables.sets])
    return tables._replace(writes=np.concatenate([tables.writes, writes]), sets=sets, **twice)


def _driven_by_slopes(ring: Ring) -> Ring:
    """Return a ring with the derivatives of Ψ along the track in its place."""
    powers, half = np.arange(1.0, ring.drive.shape[1]), 0.5 * np.diff(ring.edges)
    slopes = np.zeros_like(ring.drive)
    slopes[:, :-1] = ring.drive[:, 1:] * powers[:, None] / half[:, None, None]
    return ring._replace(drive=slopes)
