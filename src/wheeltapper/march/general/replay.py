"""What happened at any time of a march, computed again from its log: forces, indentations, bodies, modes.

The log holds forces at the nodes of every part between events, and of each macro step the polynomial c of each gap and
the bodies' state. Moments of the force up to a time follow by integrating the forces' polynomials; with them the gap,
the bodies and the modes are those that the march itself had (local.py, tables.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march import program as numbers
from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.contract import Contact
from wheeltapper.march.general.march import Found, Prepared, _order
from wheeltapper.march.general.stepping import MODES_EVERY
from wheeltapper.march.general.structure import ComplexArray
from wheeltapper.march.general.tables import driven_nodes, exponential, states_of
from wheeltapper.march.program import FloatArray, IntArray


class Replayed(NamedTuple):
    """The motion at some times.

    Attributes
    ----------
    force, indentation
        Of the contacts, N and m; an indentation below zero is a gap: (times, contacts).
    path, rail
        Height of the path under each contact, and deflection of the rail or deck there, positive down, m.
    displacement, velocity, acceleration
        Of the bodies' freedoms, positive down, (times, freedoms).
    bay, place
        Of the first contact: its bay, and its position from the bay's beginning, m, (times,).
    amplitudes
        Of the ring's modes as seen from that bay, (times, modes); None if they were not asked for.
    """

    force: FloatArray
    indentation: FloatArray
    path: FloatArray
    rail: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    bay: IntArray
    place: FloatArray
    amplitudes: ComplexArray | None


class _Parts(NamedTuple):
    """Of one contact at some times: force in units, and moments since the macro step's start, (times, q)."""

    force: FloatArray
    moments: FloatArray


def replay(found: Found, times: FloatArray, modes: bool = False) -> Replayed:
    """Return the motion at some times, s, in any order, not after the march's end; `modes` asks for those too."""
    prepared = found.prepared
    step, theta = _steps_of(found, np.asarray(times, dtype=float))
    contacts = range(len(prepared.system.contacts))
    parts = [_parts(found, i, step, theta) for i in contacts]
    force = np.column_stack([part.force for part in parts])
    stride = prepared.system.speed * prepared.grid.seconds
    along = stride * (step + theta)
    path = np.column_stack([path_heights(one, one.start + along) for one in prepared.system.contacts])
    indentation = np.column_stack([_indentation(found, i, step, theta, parts[i], path[:, i]) for i in contacts])
    shares = np.stack([part.moments @ gauss_nodes(prepared.method.nodes).transform for part in parts], axis=1)
    bodies, rates = _bodies(found, step, theta, force, shares)
    count = len(prepared.system.bodies.mass)
    wheel = bodies[:, :count] @ prepared.system.bodies.shapes + found.sinking
    spacing = 0.0 if prepared.system.ring is None else prepared.system.ring.spacing
    bay = np.array([_bay(prepared, 0, one) for one in step])
    return Replayed(
        force * prepared.units.force, indentation, path, wheel + path - indentation, bodies[:, :count],
        bodies[:, count:-1], rates[:, count:-1], bay, prepared.system.contacts[0].position + along - bay * spacing,
        _modes(found, step, theta, shares) if modes else None,
    )  # fmt: skip


def _steps_of(found: Found, times: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return macro steps and parts of them."""
    steps = times / found.prepared.grid.seconds
    if times.size and (times.min() < 0.0 or steps.max() > found.steps * (1.0 + 1e-9)):
        raise ValueError(f"times are from 0 to the march's end at {found.time} s")
    step = np.minimum(steps.astype(np.int64), found.steps - 1)
    return step, steps - step


# -- one contact ------------------------------------------------------------------------------------------------------


def map_parts(rows: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return θ and dθ/dσ at σ, (rows, places), of logged rows."""
    how = rows[:, layout.ROW_MAP][:, None]
    origin, span = rows[:, layout.ROW_ORIGIN][:, None], rows[:, layout.ROW_SPAN][:, None]
    width = (rows[:, layout.ROW_S1] - rows[:, layout.ROW_S0])[:, None]
    s = rows[:, layout.ROW_S0][:, None] + width * sigma
    even, after, before = how == layout.EVENLY, how == layout.AFTER_IMPACT, how == layout.BEFORE_LOSS
    theta = np.where(before, origin - s * s, origin + span * s * s * (3.0 - 2.0 * s))
    theta = np.where(even, origin + span * s, np.where(after, origin + s * s, theta))
    pace = np.where(before, -2.0 * s * width, 6.0 * span * s * (1.0 - s) * width)
    return theta, np.where(even, span, np.where(after, 2.0 * s * width, pace))


def sigma_of_parts(rows: FloatArray, theta: FloatArray) -> FloatArray:
    """Return σ at one part θ of each logged row."""
    how, origin, span = rows[:, layout.ROW_MAP], rows[:, layout.ROW_ORIGIN], rows[:, layout.ROW_SPAN]
    safe = np.where(span == 0.0, 1.0, span)
    away = theta - origin
    root = np.sqrt(np.maximum(np.where(how == layout.BEFORE_LOSS, -away, away), 0.0))
    x = np.clip(away / safe, 0.0, 1.0)
    smoothstep = 0.5 - np.sin(np.arcsin(1.0 - 2.0 * x) / 3.0)
    for _ in range(3):  # the closed form loses digits at both ends
        slope = 6.0 * smoothstep * (1.0 - smoothstep)
        error = smoothstep * smoothstep * (3.0 - 2.0 * smoothstep) - x
        smoothstep -= np.where(slope > 1e-6, error / np.where(slope > 1e-6, slope, 1.0), 0.0)
    s = np.where(how == layout.EVENLY, away / safe, np.where(how == layout.IMPACT_TO_LOSS, smoothstep, root))
    s0 = rows[:, layout.ROW_S0]
    return np.asarray(np.clip((s - s0) / (rows[:, layout.ROW_S1] - s0), 0.0, 1.0))


def _parts(found: Found, contact: int, step: IntArray, theta: FloatArray) -> _Parts:
    """Return force and moments of one contact."""
    rows = found.logs.rows[found.logs.rows[:, layout.ROW_CONTACT] == contact]
    at = np.searchsorted(rows[:, layout.ROW_STEP] + rows[:, layout.ROW_FROM], step + theta, side="right") - 1
    first = np.searchsorted(rows[:, layout.ROW_STEP], step, side="left")
    at = np.maximum(at, first)
    q = found.prepared.method.nodes
    force, moments = np.zeros(len(step)), np.zeros((len(step), q))
    most = int((at - first).max(initial=0))
    for back in range(most + 1):  # the part itself, then those before it in the same macro step
        there = at - back >= first
        chosen = rows[(at - back)[there]]
        until = sigma_of_parts(chosen, theta[there]) if back == 0 else np.ones(len(chosen))
        for nodes in np.unique(chosen[:, layout.ROW_NODES]).astype(int):
            if nodes == 1:  # a flight
                continue
            some = chosen[:, layout.ROW_NODES] == nodes
            target = np.flatnonzero(there)[some]
            value, integral = _forces_to(chosen[some], nodes, until[some], q)
            moments[target] += integral
            if back == 0:
                force[target] = value
    return _Parts(force, moments)


def _forces_to(rows: FloatArray, count: int, sigma: FloatArray, q: int) -> tuple[FloatArray, FloatArray]:
    """Return the force at σ of each row, and its moments from the row's start to there."""
    nodes = gauss_nodes(count)
    N = rows[:, layout.ROW_FORCES : layout.ROW_FORCES + count]
    z = 2.0 * sigma - 1.0
    polynomials = legendre.legvander(z, count)
    value = np.einsum("rl,ln,rn->r", polynomials[:, :count], nodes.transform, N)
    theta, pace = map_parts(rows, np.broadcast_to(nodes.places, N.shape))
    weighted = (pace * N)[:, :, None] * legendre.legvander(2.0 * theta - 1.0, q - 1)
    degrees = np.arange(count)
    below = np.concatenate([-np.ones((len(z), 1)), polynomials[:, : count - 1]], axis=1)
    integrals = 0.5 * (polynomials[:, 1:] - below) / (2.0 * degrees + 1.0)
    integrals[:, 0] = 0.5 * (z + 1.0)
    return np.maximum(value, 0.0), np.einsum("rl,ln,rnm->rm", integrals, nodes.transform, weighted)


def path_heights(contact: Contact, x: FloatArray) -> FloatArray:
    """Return the height of a contact's path, m, at places of its own table."""
    pieces = contact.pieces
    if contact.loop < len(pieces):
        begin, end = pieces[contact.loop, numbers.START], pieces[-1, numbers.STOP]
        x = np.where(x >= end, begin + np.mod(x - begin, end - begin), x)
    rows = pieces[np.maximum(np.searchsorted(pieces[:, numbers.START], x, side="right") - 1, 0)]
    from_centre = x - rows[:, numbers.CENTRE]
    xi = from_centre / rows[:, numbers.SCALE]
    height = np.zeros(len(x))
    for k in range(numbers.MAX_DEGREE, -1, -1):
        height = height * xi + rows[:, numbers.COEFFICIENT + k]
    phase = rows[:, numbers.WAVENUMBER] * from_centre
    return np.asarray(height + rows[:, numbers.SINE] * np.sin(phase) + rows[:, numbers.COSINE] * np.cos(phase))


def _indentation(found: Found, i: int, step: IntArray, theta: FloatArray, part: _Parts, path: FloatArray) -> FloatArray:
    """Return the indentation of one contact, m."""
    prepared, tables = found.prepared, found.prepared.tables
    p = step % tables.matrices.shape[1]
    polynomials = legendre.legvander(2.0 * theta - 1.0, prepared.method.nodes - 1)
    answered = np.einsum("tlm,tm->tl", tables.kernels[i, p], part.moments)
    gap = np.sum(polynomials * (found.logs.gaps[step, i] - answered), axis=1)
    local = np.sum(polynomials * tables.residual[i, p], axis=1) * part.force
    return np.asarray((gap - local) * prepared.units.length + path)


# -- bodies and modes -------------------------------------------------------------------------------------------------


def _lagrange(prepared: Prepared, theta: FloatArray) -> FloatArray:
    """Return Lagrange's polynomials of the macro nodes at parts of a step, (times, q)."""
    polynomials = legendre.legvander(2.0 * theta - 1.0, prepared.method.nodes - 1)
    return np.asarray(polynomials @ gauss_nodes(prepared.method.nodes).transform)


def _bodies(
    found: Found, step: IntArray, theta: FloatArray, forces: FloatArray, shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return states of the bodies and their rates."""
    prepared = found.prepared
    seconds, unit = prepared.grid.seconds, prepared.units.force
    states = states_of(prepared.system.bodies)
    places = gauss_nodes(prepared.method.nodes).places * seconds
    free = np.stack([exponential(states.A * place) for place in places])
    driven = np.stack([[exponential(states.A * (a - b)) @ states.B for b in places] for a in places])
    now = np.einsum("kab,tb->tka", free, found.logs.bodies[step])
    now -= seconds * unit * np.einsum("kjac,tcj->tka", driven, shares)
    x = np.einsum("tk,tka->ta", _lagrange(prepared, theta), now)
    return x, x @ states.A.T - unit * forces @ states.B.T


def _modes(found: Found, step: IntArray, theta: FloatArray, shares: FloatArray) -> ComplexArray:
    """Return the amplitudes as seen from the bay of the first contact."""
    prepared, tables = found.prepared, found.prepared.tables
    ring = prepared.system.ring
    if ring is None:
        return np.zeros((len(step), 0), dtype=complex)
    order = _order(ring)
    angles, rates = np.angle(ring.turns[order]), ring.rates[order] * prepared.grid.seconds
    phases = tables.matrices.shape[1]
    takes = driven_nodes(ring, order, prepared.grid, gauss_nodes(prepared.method.nodes))
    out = np.zeros((len(step), len(ring.rates)), dtype=complex)
    state, at = np.zeros(len(rates), dtype=complex), -1
    for t in np.argsort(step, kind="stable"):
        state, at = _modes_at_step(found, state, at, int(step[t]))
        now = state
        for i in range(len(prepared.system.contacts)):
            drive = (shares[t, i] * prepared.units.force) @ takes[tables.sets[i]][(tables.phase[i] + step[t]) % phases]
            ahead = _bay(prepared, i, step[t]) - _bay(prepared, 0, step[t])
            now = now + (drive if ahead == 0 else drive * np.exp(-1j * angles * ahead))
        out[t, order] = now * np.exp(rates * theta[t])
    return out


def _bay(prepared: Prepared, contact: int, step: int) -> int:
    """Return the bay of a contact in a macro step."""
    tables = prepared.tables
    if prepared.grid.stride == 0.0:
        return int(tables.bay[contact])
    return int(tables.bay[contact] + (tables.phase[contact] + step) // tables.matrices.shape[1])


def _modes_at_step(found: Found, state: ComplexArray, at: int, step: int) -> tuple[ComplexArray, int]:
    """Return the amplitudes at the start of a macro step, from those at an earlier one or from the log."""
    prepared, tables, logs = found.prepared, found.prepared.tables, found.logs
    if at < 0 or step // MODES_EVERY > at // MODES_EVERY:
        at = step // MODES_EVERY * MODES_EVERY
        state = logs.modes[at // MODES_EVERY, 0] + 1j * logs.modes[at // MODES_EVERY, 1]
    phases, bays = tables.matrices.shape[1], len(tables.turns)
    while at < step:
        state = state * (tables.decay[0] + 1j * tables.decay[1])
        for i in range(len(tables.phase)):
            rows = tables.writes[tables.sets[i], (tables.phase[i] + at) % phases]
            gained = logs.moments[at, i] @ rows[:, 0] + 1j * (logs.moments[at, i] @ rows[:, 1])
            turn = tables.turns[(_bay(prepared, i, at) - _bay(prepared, 0, at)) % bays]
            state = state + gained * (turn[0] - 1j * turn[1])
        if _bay(prepared, 0, at + 1) > _bay(prepared, 0, at):
            turn = tables.turns[1 % bays]
            state = state * (turn[0] + 1j * turn[1])
        at += 1
    return state, at
