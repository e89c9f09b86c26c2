"""Everything over time from a march's logs: forces between the nodes, indentations, bodies, and the modes of the track.

A logged part holds its force as a polynomial of σ (layout.py), so that the moments m_l(θ) of the force up to any part θ
of a macro step are known. With them come the gap, as in `local.py`, and the structure: a state that is x0 at the macro
step's start and answers a unit force by b is exp(λθH)·(x0 + Σ_l w_l·m_l(θ)), where w_l are the Legendre coefficients of
H·exp(-λθ'H)·b over the macro step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march import program as contract
from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.careful import sigma_of, sigmas_of
from wheeltapper.march.general.contract import Contact
from wheeltapper.march.general.layout import AFTER_IMPACT, BEFORE_LOSS, EVENLY, IM, RE
from wheeltapper.march.general.march import Found, Prepared
from wheeltapper.march.general.records import Motion, Stage
from wheeltapper.march.general.stepping import MODES_EVERY, write_kernel
from wheeltapper.march.general.structure import ComplexArray
from wheeltapper.march.general.tables import exponentials, states_of
from wheeltapper.march.program import FloatArray, IntArray

AT_ONCE = 8192
"""Samples that are computed at a time."""


class Replayed(NamedTuple):
    """Everything at some times, in SI units; deflections and motions positive downwards.

    Attributes
    ----------
    force, force_rate, force_bend
        Of the contacts, and its two derivatives, (times, contacts): N, N/s, N/s².
    indentation, rail, path
        Of the contacts too; the rail's deflection at the contact.
    displacement, velocity, acceleration
        Of the bodies' freedoms, (times, freedoms).
    """

    force: FloatArray
    force_rate: FloatArray
    force_bend: FloatArray
    indentation: FloatArray
    rail: FloatArray
    path: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class Rows(NamedTuple):
    """The logged parts of one contact, one after the other.

    Attributes
    ----------
    rows
        As in layout.py.
    starts
        Where they begin, in macro steps.
    theta, pace, force
        At the nodes, (rows, MOST_NODES), zero beyond a row's own nodes; θ, dθ/dσ, and the force.
    before
        Moments of the macro step up to the row's start, (rows, q).
    total
        Those of the row alone.
    """

    rows: FloatArray
    starts: FloatArray
    theta: FloatArray
    pace: FloatArray
    force: FloatArray
    before: FloatArray
    total: FloatArray


def rows_until(found: Found, contact: int, end: float) -> Rows:
    """Return the logged parts of a contact up to a time, s; the last one is cut there."""
    whole, stop = rows_of(found, contact), end / found.prepared.grid.seconds
    held = Rows(*(part[: int(np.searchsorted(whole.starts, stop))].copy() for part in whole))
    row, last = held.rows[-1], len(held.rows) - 1
    at, count = stop - row[layout.ROW_STEP], int(row[layout.ROW_NODES])
    if at >= row[layout.ROW_TO]:
        return held
    if count > 1:
        sigma, nodes = sigma_of(at, row), gauss_nodes(count)
        row[layout.ROW_S1] = row[layout.ROW_S0] + sigma * (row[layout.ROW_S1] - row[layout.ROW_S0])
        values = legendre.legvander(2.0 * sigma * nodes.places - 1.0, count - 1)
        held.force[last, :count] = values @ nodes.transform @ held.force[last, :count]
        theta, pace = _mapped(row[None], nodes.places)
        held.theta[last, :count], held.pace[last, :count] = theta[0], pace[0]
        powers = legendre.legvander(2.0 * theta[0] - 1.0, held.total.shape[1] - 1)
        held.total[last] = (nodes.weights * pace[0] * held.force[last, :count]) @ powers
    row[layout.ROW_TO] = at
    return held


def rows_of(found: Found, contact: int) -> Rows:
    """Return the logged parts of a contact."""
    q = found.prepared.method.nodes
    rows = found.logs.rows[found.logs.rows[:, layout.ROW_CONTACT] == contact]
    counts = rows[:, layout.ROW_NODES].astype(int)
    theta, pace = np.zeros((2, len(rows), layout.MOST_NODES))
    total = np.zeros((len(rows), q))
    force = np.zeros((len(rows), layout.MOST_NODES))
    for count in np.unique(counts[counts > 1]):
        some, nodes = counts == count, gauss_nodes(int(count))
        theta[some, :count], pace[some, :count] = _mapped(rows[some], nodes.places)
        force[some, :count] = rows[some, layout.ROW_FORCES : layout.ROW_FORCES + count]
        powers = legendre.legvander(2.0 * theta[some, :count] - 1.0, q - 1)
        total[some] = np.einsum("rk,rkm->rm", nodes.weights * pace[some, :count] * force[some, :count], powers)
    steps = rows[:, layout.ROW_STEP]
    summed = np.cumsum(total, axis=0) - total
    first = np.searchsorted(steps, steps)
    return Rows(rows, steps + rows[:, layout.ROW_FROM], theta, pace, force, summed - summed[first], total)


def _mapped(rows: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return θ and dθ/dσ at places of rows."""
    how, origin, span, s0, s1 = (
        rows[:, [column]]
        for column in (layout.ROW_MAP, layout.ROW_ORIGIN, layout.ROW_SPAN, layout.ROW_S0, layout.ROW_S1)
    )
    s = s0 + (s1 - s0) * places
    theta = np.select(
        [how == EVENLY, how == AFTER_IMPACT, how == BEFORE_LOSS],
        [origin + span * s, origin + s**2, origin - s**2], origin + span * s**2 * (3.0 - 2.0 * s),
    )  # fmt: skip
    pace = np.select(
        [how == EVENLY, how == AFTER_IMPACT, how == BEFORE_LOSS],
        [span * np.ones_like(s), 2.0 * s, -2.0 * s], 6.0 * span * s * (1.0 - s),
    )  # fmt: skip
    return theta, pace * (s1 - s0)


class _At(NamedTuple):
    """Samples of one contact: its force, what that becomes by θ, and by θ again, and its moments there."""

    force: FloatArray
    rate: FloatArray
    bend: FloatArray
    moments: FloatArray


STILL = 1e-6
"""dθ/dσ, in macro steps, below which a sample is at an impact or a loss, where the force begins with no slope."""


def _sampled(rows: Rows, step: IntArray, theta: FloatArray) -> _At:
    q = rows.total.shape[1]
    index = np.searchsorted(rows.starts, step + theta, side="right") - 1
    index = np.clip(index, np.searchsorted(rows.starts, step), np.searchsorted(rows.starts, step + 1.0) - 1)
    sigma = np.zeros(len(theta))
    sigmas_of(theta, index, rows.rows, sigma)
    sigma = np.clip(sigma, 0.0, 1.0)
    (force, rate, bend), moments = np.zeros((3, len(theta))), rows.before[index]
    counts = rows.rows[index, layout.ROW_NODES].astype(int)
    for count in np.unique(counts[counts > 1]):
        some, nodes = np.flatnonzero(counts == count), gauss_nodes(int(count))
        own, z = index[some], 2.0 * sigma[some] - 1.0
        values = np.asarray(legendre.legvander(z, count), dtype=float)
        coefficients = rows.force[own, :count] @ nodes.transform.T
        by_sigma = _derivatives(int(count))
        force[some], slope, curve = (
            (coefficients @ np.linalg.matrix_power(by_sigma, order) * values[:, :count]).sum(axis=1)
            for order in range(3)
        )
        pace, turn = pace_at(rows.rows[own], sigma[some])
        moves = np.abs(pace) > STILL
        rate[some[moves]] = slope[moves] / pace[moves]
        bend[some[moves]] = (curve[moves] - rate[some[moves]] * turn[moves]) / pace[moves] ** 2
        powers = np.asarray(legendre.legvander(2.0 * rows.theta[own, :count] - 1.0, q - 1), dtype=float)
        rates = (rows.pace[own, :count] * rows.force[own, :count])[:, :, None] * powers  # (samples, nodes, q)
        changes = np.einsum("jk,skm->sjm", nodes.transform, rates)
        moments[some] += np.einsum("sj,sjm->sm", _integrated(values), changes)
    return _At(np.maximum(force, 0.0), rate, bend, moments)


def pace_at(rows: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return dθ/dσ and d²θ/dσ² at one σ of each row."""
    how, span = rows[:, layout.ROW_MAP], rows[:, layout.ROW_SPAN]
    width = rows[:, layout.ROW_S1] - rows[:, layout.ROW_S0]
    s = rows[:, layout.ROW_S0] + width * sigma
    kinds = [how == EVENLY, how == AFTER_IMPACT, how == BEFORE_LOSS]
    turn = np.select(kinds, [0.0 * s, 2.0 + 0.0 * s, -2.0 + 0.0 * s], 6.0 * span * (1.0 - 2.0 * s)) * width**2
    return _mapped(rows, sigma[:, None])[1][:, 0], turn


def _integrated(values: FloatArray) -> FloatArray:
    """Return the integrals over σ from 0 of P_j(2σ - 1), from the values of these up to one degree more."""
    out = np.empty((len(values), values.shape[1] - 1))
    out[:, 0] = 0.5 * (values[:, 1] + 1.0)
    j = np.arange(1, out.shape[1])
    out[:, 1:] = 0.5 * (values[:, 2:] - values[:, :-2]) / (2.0 * j + 1.0)
    return out


def _places(found: Found, times: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the macro step of each time, and the part of it."""
    at = times / found.prepared.grid.seconds
    step = np.clip(np.floor(at).astype(np.int64), 0, found.steps - 1)
    return step, np.clip(at - step, 0.0, 1.0)


def replay(found: Found, times: FloatArray) -> Replayed:
    """Return everything but the modes at some times, s."""
    contacts, freedoms = len(found.prepared.system.contacts), len(found.prepared.system.bodies.mass)
    widths = (contacts,) * 6 + (freedoms,) * 3
    out = Replayed(*(np.empty((len(times), width)) for width in widths))
    logged = [rows_of(found, contact) for contact in range(contacts)]
    for first in range(0, len(times), AT_ONCE):
        chunk = slice(first, first + AT_ONCE)
        for whole, part in zip(out, _replayed(found, logged, times[chunk]), strict=True):
            whole[chunk] = part
    return out


def _replayed(found: Found, logged: list[Rows], times: FloatArray) -> tuple[FloatArray, ...]:
    prepared = found.prepared
    system, units, tables = prepared.system, prepared.units, prepared.tables
    step, theta = _places(found, times)
    values = legendre.legvander(2.0 * theta - 1.0, prepared.method.nodes - 1)
    phase = step % tables.matrices.shape[1]
    at = [_sampled(rows, step, theta) for rows in logged]
    states = _body_states(found, step, theta, at)
    freedoms = len(system.bodies.mass)
    down = states[:, :freedoms] @ system.bodies.shapes + prepared.start.offsets
    force, indentation, rail, path = np.empty((4, len(times), len(at)))
    for i, one in enumerate(at):
        contact = system.contacts[i]
        height = path_heights(contact, contact.start + system.speed * times)
        free = found.logs.gaps[step, i] - np.einsum("tlm,tm->tl", tables.kernels[i, phase], one.moments)
        gap = (values * free).sum(axis=1) + height / units.length
        local = (values * tables.residual[i, phase]).sum(axis=1)
        force[:, i] = one.force * units.force
        indentation[:, i] = (gap - local * one.force) * units.length
        path[:, i] = height
        rail[:, i] = down[:, i] + height - indentation[:, i]
    rates = states_of(system.bodies)
    acceleration = (states @ rates.A.T - force @ rates.B.T)[:, freedoms:-1]
    by_time = units.force / prepared.grid.seconds
    rate, bend = np.stack([[one.rate, one.bend / prepared.grid.seconds] for one in at], axis=2) * by_time
    return force, rate, bend, indentation, rail, path, states[:, :freedoms], states[:, freedoms:-1], acceleration


def _body_states(found: Found, step: IntArray, theta: FloatArray, at: list[_At]) -> FloatArray:
    """Return the bodies' states, (times, states)."""
    prepared = found.prepared
    seconds, nodes = prepared.grid.seconds, gauss_nodes(prepared.method.nodes)
    states = states_of(prepared.system.bodies)
    back = exponentials(states.A * seconds, -nodes.places) @ states.B
    answers = np.tensordot(nodes.transform, back, (1, 0)) * (-seconds * prepared.units.force)  # (q, states, contacts)
    held = found.logs.bodies[step].copy()
    for i, one in enumerate(at):
        held += one.moments @ answers[:, :, i]
    return np.einsum("tij,tj->ti", exponentials(states.A * seconds, theta), held)


# -- the track --------------------------------------------------------------------------------------------------------


class Modes(NamedTuple):
    """The track's modes at some times.

    Attributes
    ----------
    amplitudes, forced, forced_rate
        (times, modes): a, Ψ·N summed over the contacts, and its derivative, as a port sees them that lies in `bay`;
        a' = λ·a + forced.
    bay
        Number of the bay from which they are seen, (times,).
    """

    amplitudes: ComplexArray
    forced: ComplexArray
    forced_rate: ComplexArray
    bay: IntArray


def modes(found: Found, times: FloatArray) -> Modes:
    """Return the track's modes at some times, s."""
    prepared = found.prepared
    tables, ring = prepared.tables, prepared.system.ring
    if ring is None:
        raise ValueError("a rigid rail has no modes")
    step, theta = _places(found, times)
    order = np.argsort(np.abs(ring.rates), kind="stable")
    rates, seconds = ring.rates[order], prepared.grid.seconds
    phases = tables.reads.shape[1]
    at = [_sampled(rows_of(found, i), step, theta) for i in range(len(prepared.system.contacts))]
    decay = tables.decay[RE] + 1j * tables.decay[IM]
    values = legendre.legvander(2.0 * theta - 1.0, prepared.method.nodes - 1)
    steep = _legendre_slopes(theta, prepared.method.nodes)
    amplitudes, forced, forced_rate = np.empty((3, len(times), len(rates)), dtype=complex)
    starts = _mode_starts(found, np.unique(step))
    for one, begins in starts.items():
        some = np.flatnonzero(step == one)
        held = np.broadcast_to(begins, (len(some), len(rates))).copy()
        pressed, changing = np.zeros_like(held), np.zeros_like(held)
        grown = np.exp(np.multiply.outer(theta[some] * seconds, rates))
        for i, sample in enumerate(at):
            takes = _taken(found, one, i) / decay  # (q, modes)
            held += sample.moments[some] @ takes
            here = values[some] * sample.force[some, None]
            pressed += here @ takes / seconds
            there = steep[some] * sample.force[some, None] + values[some] * sample.rate[some, None]
            changing += there @ takes / seconds**2
        amplitudes[some] = held * grown
        forced[some] = pressed * grown
        forced_rate[some] = (changing + rates * pressed) * grown
    back = np.argsort(order)
    bay = tables.bay[0] + (tables.phase[0] + step) // phases
    if prepared.grid.stride == 0.0:
        bay = np.full_like(step, tables.bay[0])
    return Modes(amplitudes[:, back], forced[:, back], forced_rate[:, back], bay)


def _taken(found: Found, step: int, contact: int) -> ComplexArray:
    """Return what the moments of a contact's force in a macro step do to the modes at its end, (q, modes)."""
    tables = found.prepared.tables
    wheels, phases = len(tables.sets), tables.reads.shape[1]
    if contact >= wheels:
        rows = tables.fixed_writes[contact - wheels]
        return np.asarray(rows[:, RE] + 1j * rows[:, IM])
    rows = tables.writes[tables.sets[contact], (tables.phase[contact] + step) % phases]
    turn = tables.turns[_bays_ahead(found, step, contact)]
    return np.asarray((rows[:, RE] + 1j * rows[:, IM]) * (turn[RE] - 1j * turn[IM]))


def _legendre_slopes(theta: FloatArray, count: int) -> FloatArray:
    """Return the derivatives of P_l(2θ - 1) by θ, (times, count)."""
    return np.asarray(legendre.legvander(2.0 * theta - 1.0, count - 1) @ _derivatives(count).T)


def _derivatives(count: int) -> FloatArray:
    """Return the coefficients of the derivatives of P_l(2θ - 1) by θ, (l, degree)."""
    return 2.0 * np.stack([np.append(legendre.legder(one), 0.0)[:count] for one in np.eye(count)])


def _bays_ahead(found: Found, step: int, contact: int) -> int:
    """Return how many bays a contact is ahead of the first one, of those of the ring."""
    tables = found.prepared.tables
    phases = tables.reads.shape[1]
    own, first = (tables.bay[i] + (tables.phase[i] + step) // phases for i in (contact, 0))
    return int((own - first) % tables.turns.shape[0])


def _mode_starts(found: Found, wanted: IntArray) -> dict[int, ComplexArray]:
    """Return the modes at the start of some macro steps, from the logged states and moments."""
    prepared, logs = found.prepared, found.logs
    contacts, q = logs.moments.shape[1:]
    count = logs.modes.shape[2]
    line, cube = np.zeros((1, 1)), np.zeros((1, 1, 1))
    stage = Stage(
        cube, cube, np.zeros((1, 2), np.int64), line, line, line, line, cube, line, np.zeros((contacts, q)),
        np.zeros((2, count)),
    )  # fmt: skip
    out: dict[int, ComplexArray] = {}
    motion, reached = _motion_of(logs.modes[0], prepared, contacts), 0
    for step in wanted.tolist():
        checkpoint = step // MODES_EVERY
        if checkpoint * MODES_EVERY > reached:
            reached = checkpoint * MODES_EVERY
            motion = _motion_of(logs.modes[checkpoint], prepared, contacts)
        write_kernel(reached, step, prepared.tables, motion, stage, logs.moments)
        reached = step
        out[step] = motion.modes[RE] + 1j * motion.modes[IM]
    return out


def _motion_of(modes_then: FloatArray, prepared: Prepared, contacts: int) -> Motion:
    """Return a state of the modes alone."""
    states = len(prepared.tables.bodies_step)
    one = np.zeros((1, 1))
    return Motion(modes_then.copy(), np.zeros(states), np.zeros((contacts, 1)), one, one, one)


# -- the path ---------------------------------------------------------------------------------------------------------


def path_heights(contact: Contact, x: FloatArray) -> FloatArray:
    """Return the height of a contact's path, m, at places of its own table."""
    rows, from_centre = _pieces_at(contact, x)
    xi = from_centre / rows[:, contract.SCALE]
    out = np.zeros_like(x)
    for k in range(contract.TERMS - 1, -1, -1):
        out = out * xi + np.where(k <= rows[:, contract.DEGREE], rows[:, contract.COEFFICIENT + k], 0.0)
    wave = rows[:, contract.WAVENUMBER] * from_centre
    return np.asarray(out + rows[:, contract.SINE] * np.sin(wave) + rows[:, contract.COSINE] * np.cos(wave))


def path_slopes(contact: Contact, x: FloatArray) -> FloatArray:
    """Return the slope of a contact's path at places of its own table."""
    rows, from_centre = _pieces_at(contact, x)
    xi = from_centre / rows[..., contract.SCALE]
    out = np.zeros_like(from_centre)
    for k in range(contract.TERMS - 1, 0, -1):
        out = out * xi + np.where(k <= rows[..., contract.DEGREE], k * rows[..., contract.COEFFICIENT + k], 0.0)
    number = rows[..., contract.WAVENUMBER]
    sine, cosine = rows[..., contract.SINE], rows[..., contract.COSINE]
    wave = number * from_centre
    return np.asarray(out / rows[..., contract.SCALE] + number * (sine * np.cos(wave) - cosine * np.sin(wave)))


def _pieces_at(contact: Contact, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the pieces of a path at places of its own table, and how far their centres lie back."""
    pieces = contact.pieces
    if contact.loop < len(pieces):
        begin, end = pieces[contact.loop, contract.START], pieces[-1, contract.STOP]
        x = np.where(x >= end, begin + np.mod(x - begin, end - begin), x)
    piece = np.clip(np.searchsorted(pieces[:, contract.START], x, side="right") - 1, 0, len(pieces) - 1)
    rows = pieces[piece]
    return rows, x - rows[..., contract.CENTRE]
