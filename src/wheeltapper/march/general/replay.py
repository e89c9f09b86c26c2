"""Everything over time from a march's logs: forces between the nodes, indentations, bodies, and the modes of the track.

A logged part holds its force as a polynomial of σ (layout.py), so that the moments m_l(θ) of the force up to any part θ
of a macro step are known. With them come the gap, as in `local.py`, and the structure: a state that is x0 at the macro
step's start and answers a unit force by b is exp(λθH)·(x0 + Σ_l w_l·m_l(θ)), where w_l are the Legendre coefficients of
H·exp(-λθ'H)·b over the macro step.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Rows
from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.careful import sigma_of, sigmas_of
from wheeltapper.march.general.contract import Contact, Marking
from wheeltapper.march.general.laws.switch import FREE_PLAY, SWITCHING, TWO_SIDED
from wheeltapper.march.general.layout import AFTER_IMPACT, BEFORE_LOSS, EVENLY, IM, RE
from wheeltapper.march.general.march import Found
from wheeltapper.march.general.records import Tables
from wheeltapper.march.general.stepping import MODES_EVERY
from wheeltapper.march.general.structure import ComplexArray, Ring
from wheeltapper.march.general.tables import Grid, exponentials, heavy_of, real_times, states_of

AT_ONCE = 8192
"""Samples that are computed at a time."""
STEPS_AT_ONCE = 4096
"""Macro steps through which modes go at a time."""


class Replayed(NamedTuple):
    """Everything at some times, in SI units; deflections and motions positive downwards.

    Attributes
    ----------
    force, force_rate, force_bend
        Of the contacts, and its two derivatives, (times, contacts): N, N/s, N/s².
    indentation, rail, path
        Of the contacts too; the rail's deflection at the contact.
    displacement, velocity, acceleration
        Of the bodies' freedoms, (times, freedoms); NaN for the acceleration of one without mass.
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


class Parts(NamedTuple):
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

    rows: Rows
    starts: FloatArray
    theta: FloatArray
    pace: FloatArray
    force: FloatArray
    before: FloatArray
    total: FloatArray


def rows_until(found: Found, contact: int, end: float) -> Parts:
    """Return the logged parts of a contact up to a time, s; the last one is cut there."""
    whole, stop = rows_of(found, contact), float(found.prepared.grid.steps(np.array(end)))
    cut: Any = (part[: int(np.searchsorted(whole.starts, stop))].copy() for part in whole)
    held = Parts._make(cut)
    row, last = held.rows[-1], len(held.rows) - 1
    at, count = stop - row["step"], int(row["nodes"])
    if at >= row["to"]:
        return held
    if count > 1:
        sigma, nodes = sigma_of(at, row), gauss_nodes(count)
        row["s1"] = row["s0"] + sigma * (row["s1"] - row["s0"])
        values = legendre.legvander(2.0 * sigma * nodes.places - 1.0, count - 1)
        held.force[last, :count] = values @ nodes.transform @ held.force[last, :count]
        theta, pace = mapped(held.rows[-1:], nodes.places)
        held.theta[last, :count], held.pace[last, :count] = theta[0], pace[0]
        powers = legendre.legvander(2.0 * theta[0] - 1.0, held.total.shape[1] - 1)
        held.total[last] = (nodes.weights * pace[0] * held.force[last, :count]) @ powers
    row["to"] = at
    return held


def rows_of(found: Found, contact: int, first: int = 0, last: int | None = None) -> Parts:
    """Return the logged parts of a contact, from a macro step on and up to another one, that included."""
    q = found.prepared.method.nodes
    rows = _logged(found, contact, first, last)
    counts = rows["nodes"].astype(int)
    theta, pace = np.zeros((2, len(rows), layout.MOST_NODES))
    total = np.zeros((len(rows), q))
    force = np.zeros((len(rows), layout.MOST_NODES))
    for count in np.unique(counts[counts > 1]):
        some, nodes = counts == count, gauss_nodes(int(count))
        theta[some, :count], pace[some, :count] = mapped(rows[some], nodes.places)
        force[some, :count] = rows["forces"][some, :count]
        powers = legendre.legvander(2.0 * theta[some, :count] - 1.0, q - 1)
        total[some] = np.einsum("rk,rkm->rm", nodes.weights * pace[some, :count] * force[some, :count], powers)
    steps = rows["step"]
    summed = np.cumsum(total, axis=0) - total
    begins = np.searchsorted(steps, steps)
    return Parts(rows, steps + rows["from"], theta, pace, force, summed - summed[begins], total)


def _logged(found: Found, contact: int, first: int, last: int | None) -> Rows:
    """Return the logged rows of a contact, from a macro step on and up to another one, that included."""
    rows = found.logs.rows
    if last is not None:
        begin, end = np.searchsorted(rows["step"], [first, last + 1])
        rows = rows[begin:end]
    return rows[rows["contact"] == contact]


def mapped(rows: Rows, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return θ and dθ/dσ at places of rows, the same in all of them or (rows, places)."""
    how, origin, span, s0, s1 = (rows[name][:, None] for name in ("map", "origin", "span", "s0", "s1"))
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


class At(NamedTuple):
    """Samples of one contact: its force, what that becomes by θ, and by θ again, and its moments there."""

    force: FloatArray
    rate: FloatArray
    bend: FloatArray
    moments: FloatArray


STILL = 1e-6
"""dθ/dσ, in macro steps, below which a sample is at an impact or a loss, where the force begins with no slope."""


def _sampled(rows: Parts, step: IntArray, theta: FloatArray, pulls: bool) -> At:
    q = rows.total.shape[1]
    index, sigma = _places_in(rows.rows, rows.starts, step, theta)
    (force, rate, bend), moments = np.zeros((3, len(theta))), rows.before[index]
    counts = rows.rows["nodes"][index].astype(int)
    for count in np.unique(counts[counts > 1]):
        some, nodes = np.flatnonzero(counts == count), gauss_nodes(int(count))
        own, z = index[some], 2.0 * sigma[some] - 1.0
        values = np.asarray(legendre.legvander(z, count), dtype=float)
        coefficients = rows.force[own, :count] @ nodes.transform.T
        by_sigma = derivatives_of_legendre(int(count))
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
    return At(force if pulls else np.maximum(force, 0.0), rate, bend, moments)


def _places_in(rows: Rows, starts: FloatArray, step: IntArray, theta: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return in which row of a contact each time is, and σ there."""
    index = np.searchsorted(starts, step + theta, side="right") - 1
    index = np.clip(index, np.searchsorted(starts, step), np.searchsorted(starts, step + 1.0) - 1)
    sigma = np.zeros(len(theta))
    sigmas_of(theta, index, rows, sigma)
    return index, np.clip(sigma, 0.0, 1.0)


def _sampled_force(rows: Rows, step: IntArray, theta: FloatArray, pulls: bool) -> FloatArray:
    """Return the force of a contact alone, as `_sampled` does."""
    index, sigma = _places_in(rows, rows["step"] + rows["from"], step, theta)
    force, counts = np.zeros(len(theta)), rows["nodes"].astype(int)
    for count in np.unique(counts[counts > 1]).tolist():
        own, some = counts == count, np.flatnonzero(counts[index] == count)
        coefficients = np.zeros((count, len(rows)))
        coefficients[:, own] = gauss_nodes(count).transform @ rows["forces"][own, :count].T
        force[some] = legendre.legval(2.0 * sigma[some] - 1.0, coefficients[:, index[some]], tensor=False)
    return force if pulls else np.maximum(force, 0.0)


def pace_at(rows: Rows, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return dθ/dσ and d²θ/dσ² at one σ of each row."""
    how, span = rows["map"], rows["span"]
    width = rows["s1"] - rows["s0"]
    s = rows["s0"] + width * sigma
    kinds = [how == EVENLY, how == AFTER_IMPACT, how == BEFORE_LOSS]
    turn = np.select(kinds, [0.0 * s, 2.0 + 0.0 * s, -2.0 + 0.0 * s], 6.0 * span * (1.0 - 2.0 * s)) * width**2
    return mapped(rows, sigma[:, None])[1][:, 0], turn


def _integrated(values: FloatArray) -> FloatArray:
    """Return the integrals over σ from 0 of P_j(2σ - 1), from the values of these up to one degree more."""
    out = np.empty((len(values), values.shape[1] - 1))
    out[:, 0] = 0.5 * (values[:, 1] + 1.0)
    j = np.arange(1, out.shape[1])
    out[:, 1:] = 0.5 * (values[:, 2:] - values[:, :-2]) / (2.0 * j + 1.0)
    return out


def _places(found: Found, times: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the macro step of each time, and the part of it."""
    at = found.prepared.grid.steps(times)
    step = np.clip(np.floor(at).astype(np.int64), 0, found.steps - 1)
    return step, np.clip(at - step, 0.0, 1.0)


def steps_at(found: Found, times: FloatArray) -> IntArray:
    """Return the macro steps of some times, s."""
    return _places(found, times)[0]


def forces(found: Found, times: FloatArray) -> FloatArray:
    """Return the forces of all contacts at some times, s, as `replay` does, and nothing else."""
    step, theta = _places(found, times)
    out = np.empty((len(times), len(found.prepared.system.contacts)))
    for some, part in found.by_stretch(step):
        first, last = int(step[some].min()), int(step[some].max())
        for i, pulls in enumerate(_which_pull(part)):
            out[some, i] = _sampled_force(_logged(part, i, first, last), step[some], theta[some], pulls)
    return out * found.prepared.units.force


def replay(found: Found, times: FloatArray) -> Replayed:
    """Return everything but the modes at some times, s."""
    contacts, freedoms = len(found.prepared.system.contacts), len(found.prepared.system.bodies.mass)
    widths = (contacts,) * 6 + (freedoms,) * 3
    out = Replayed(*(np.empty((len(times), width)) for width in widths))
    for first in range(0, len(times), AT_ONCE):
        chunk = slice(first, first + AT_ONCE)
        step, theta = _places(found, times[chunk])
        for some, part in found.by_stretch(step):
            for whole, own in zip(out, _replayed(part, times[chunk][some], step[some], theta[some]), strict=True):
                whole[chunk][some] = own
    return out


def _sampled_contacts(found: Found, step: IntArray, theta: FloatArray) -> list[At]:
    first, last = int(step.min()), int(step.max())
    pull = enumerate(_which_pull(found))
    return [_sampled(rows_of(found, i, first, last), step, theta, pulls) for i, pulls in pull]


def _which_pull(found: Found) -> list[bool]:
    """Return which contacts can pull."""
    return [contact.law.kind in (TWO_SIDED, FREE_PLAY, *SWITCHING) for contact in found.prepared.system.contacts]


def _replayed(found: Found, times: FloatArray, step: IntArray, theta: FloatArray) -> tuple[FloatArray, ...]:
    prepared = found.prepared
    system, units, tables = prepared.system, prepared.units, prepared.tables
    values = legendre.legvander(2.0 * theta - 1.0, prepared.method.nodes - 1)
    phase = step % tables.matrices.shape[1]
    at = _sampled_contacts(found, step, theta)
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
    first, heavy = states_of(system.bodies), heavy_of(system.bodies)
    rates = states @ first.A.T - force @ first.B.T
    acceleration = np.full((len(times), freedoms), np.nan)
    acceleration[:, heavy] = rates[:, freedoms:-1]
    seconds = prepared.grid.seconds(step)
    rate, bend = np.stack([[one.rate, one.bend / seconds] for one in at], axis=2) * (units.force / seconds)[:, None]
    return force, rate, bend, indentation, rail, path, states[:, :freedoms], rates[:, :freedoms], acceleration


def _body_states(found: Found, step: IntArray, theta: FloatArray, at: list[At]) -> FloatArray:
    """Return the bodies' states, (times, states)."""
    prepared = found.prepared
    grid, nodes = prepared.grid, gauss_nodes(prepared.method.nodes)
    states, seconds = states_of(prepared.system.bodies), prepared.grid.seconds(step)
    held = found.logs.bodies[step].copy()
    for length in np.unique(seconds).tolist():
        back, some = exponentials(states.A * length, -nodes.places) @ states.B, seconds == length
        answers = -length * prepared.units.force * np.tensordot(nodes.transform, back, (1, 0))  # (q, states, contacts)
        for i, one in enumerate(at):
            held[some] += one.moments[some] @ answers[:, :, i]
    places, place = np.unique(theta * seconds / grid.longest, return_inverse=True)  # many steps have the same nodes
    return np.asarray(np.einsum("tij,tj->ti", exponentials(states.A * grid.longest, places)[place], held))


def pressed(found: Found, contact: int, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return indentation, m, and force, N, of one contact at some times, s, and nothing else; zero in flight."""
    indented, force = np.zeros((2, len(times)))
    step, theta = _places(found, times)
    for some, part in found.by_stretch(step) if len(times) else ():
        indented[some], force[some] = _pressed(part, contact, times[some], step[some], theta[some])
    return indented, force


def lay(found: Found, marking: Marking) -> None:
    """Let a memory of rails take what the wheels have done since the last time."""
    system = found.prepared.system
    for wheel, places in marking.ahead(system.speed * found.time):
        contact = system.contacts[wheel]
        depths, forces = pressed(found, wheel, (places - contact.start) / system.speed)
        constant, onset, *_ = contact.law.numbers
        marking.take(
            wheel, np.maximum(depths, 0.0) + surface_along(contact, places)[0], forces / (constant * onset**1.5)
        )


def _pressed(
    found: Found, contact: int, times: FloatArray, step: IntArray, theta: FloatArray
) -> tuple[FloatArray, FloatArray]:
    indented, force = np.zeros((2, len(times)))
    rows, prepared = rows_of(found, contact, int(step.min()), int(step.max())), found.prepared
    index = np.clip(np.searchsorted(rows.starts, step + theta, side="right") - 1, 0, len(rows.rows) - 1)
    sigma = np.zeros(len(times))
    sigmas_of(theta, index, rows.rows, sigma)
    one = prepared.system.contacts[contact]
    kernels, residual = prepared.tables.kernels[contact], prepared.tables.residual[contact]
    counts = rows.rows["nodes"][index].astype(int)
    for count in np.unique(counts[counts > 1]).tolist():
        some, nodes = np.flatnonzero(counts == count), gauss_nodes(count)
        used, back = np.unique(index[some], return_inverse=True)
        own, at = rows.rows["step"][used].astype(int), rows.theta[used, :count]
        powers = np.asarray(legendre.legvander(2.0 * at - 1.0, prepared.method.nodes - 1), dtype=float)
        rates = (rows.pace[used, :count] * rows.force[used, :count])[:, :, None] * powers
        moments = rows.before[used][:, None] + nodes.integrals @ rates
        answers = moments @ kernels[own % len(kernels)].transpose(0, 2, 1)
        free = found.logs.gaps[own, contact][:, None] - answers
        local = (powers * residual[own % len(residual)][:, None]).sum(axis=2)
        x = one.start + prepared.system.speed * prepared.grid.times(own[:, None] + at)
        gap = (powers * free).sum(axis=2) + path_heights(one, x.ravel()).reshape(x.shape) / prepared.units.length
        delta = (gap - local * rows.force[used, :count]) @ nodes.transform.T
        values = np.asarray(legendre.legvander(2.0 * sigma[some] - 1.0, count - 1), dtype=float)
        indented[some] = (delta[back] * values).sum(axis=1) * prepared.units.length
        held = rows.force[used, :count] @ nodes.transform.T
        force[some] = (held[back] * values).sum(axis=1) * prepared.units.force
    return indented, force


# -- the track --------------------------------------------------------------------------------------------------------


class Modes(NamedTuple):
    """The track's modes at some times.

    Attributes
    ----------
    amplitudes, forced, forced_rate
        (times, modes): a, Ψ·N summed over the contacts, and its derivative, as a port sees them that lies in `bay`;
        a' = λ·a + forced. The derivative may not have been asked for.
    bay
        Number of the bay from which they are seen, (times,).
    force, force_rate
        Of the contacts, (times, contacts): N, N/s.
    """

    amplitudes: ComplexArray
    forced: ComplexArray
    forced_rate: ComplexArray
    bay: IntArray
    force: FloatArray
    force_rate: FloatArray

    @property
    def has_bends(self) -> bool:
        """Whether there is the derivative of what is forced, so that second derivatives can be told."""
        return len(self.forced_rate) == len(self.forced)


class TrackRun(NamedTuple):
    """What the modes of a track follow from over a march: its tables, and the moments of the forces on it.

    Attributes
    ----------
    ring, tables, grid
        Of the track.
    force
        Unit of the moments, N.
    moments
        Of each contact's force in each macro step, (steps, contacts, q).
    modes
        At the start of every MODES_EVERY-th macro step, (some, 2, modes).
    """

    ring: Ring
    tables: Tables
    grid: Grid
    force: float
    moments: FloatArray
    modes: FloatArray


def track_run(found: Found) -> TrackRun:
    """Return what the modes of a march follow from."""
    prepared, logs = found.prepared, found.logs
    if prepared.system.ring is None:
        raise ValueError("a rigid rail has no modes")
    return TrackRun(
        prepared.system.ring, prepared.tables, prepared.grid, prepared.units.force, logs.moments, logs.modes
    )  # fmt: skip


def modes(found: Found, times: FloatArray, bends: bool = True, starts: Starts | None = None) -> Modes:
    """Return the track's modes at some times, s; without `bends` there is no `forced_rate`.

    `starts` goes on from where it was left by the call before.
    """
    run, (step, theta) = track_run(found), _places(found, times)
    starts = Starts(run) if starts is None else starts
    return modes_under(run, step, theta, _sampled_contacts(found, step, theta), starts, bends)


def modes_under(
    run: TrackRun, step: IntArray, theta: FloatArray, at: list[At], starts: Starts, bends: bool = True
) -> Modes:
    """Return a track's modes at parts θ of macro steps, where the forces on it and their moments are `at`."""
    ring, seconds, nodes = run.ring, run.grid.seconds(step), run.moments.shape[2]
    back = np.argsort(np.argsort(np.abs(ring.rates), kind="stable"))
    places, place = np.unique(theta * seconds, return_inverse=True)  # many steps have the same nodes
    grown = np.exp(np.multiply.outer(places, ring.rates))
    values = legendre.legvander(2.0 * theta - 1.0, nodes - 1)
    steep = _legendre_slopes(theta, nodes)
    factors = [
        np.stack([
            one.moments, values * (one.force / seconds)[:, None],
            (steep * one.force[:, None] + values * one.rate[:, None]) / seconds[:, None] ** 2,
        ][: 3 if bends else 2])
        for one in at
    ]  # fmt: skip
    out = np.empty((3 if bends else 2, len(step), len(ring.rates)), dtype=complex)
    asked, which = np.unique(step, return_inverse=True)
    begins = starts.at(asked)
    for one, some in _alike(run, step):
        undone = 1.0 / _decay(run, one)
        held = np.zeros((len(out), len(some), len(undone)), dtype=complex)
        held[0] = begins[which[some]]
        for i, factor in enumerate(factors):
            held += real_times(factor[:, some], _taken(run, one, i) * undone)
        held = held[:, :, back]
        if bends:
            held[2] += ring.rates * held[1]
        out[:, some] = held * grown[place[some]]
    force, force_rate = (np.stack([getattr(one, name) for one in at], axis=1) for name in ("force", "rate"))
    bend = out[-1] if bends else out[0, :0]
    by_time = run.force / seconds[:, None]
    return Modes(out[0], out[1], bend, _first_bay(run, step), force * run.force, force_rate * by_time)


def _length(run: TrackRun, step: int) -> int:
    """Return which length a macro step has."""
    return int(run.tables.which[step % len(run.tables.which)])


def _decay(run: TrackRun, step: int) -> ComplexArray:
    """Return exp(λH) of a macro step."""
    decay = run.tables.decay[_length(run, step)]
    return np.asarray(decay[RE] + 1j * decay[IM])


def _taken(run: TrackRun, step: int, contact: int) -> ComplexArray:
    """Return what the moments of a contact's force in a macro step do to the modes at its end, (q, modes)."""
    tables = run.tables
    wheels, phases = len(tables.sets), tables.reads.shape[1]
    if contact >= wheels:
        rows = tables.fixed_writes[contact - wheels, _length(run, step)]
        return _complex(rows)
    rows = tables.writes[tables.sets[contact], (tables.phase[contact] + step) % phases]
    ahead = _bays_ahead(run, step, contact)
    taken = _complex(rows)
    return taken if ahead == 0 else taken * (tables.turns[ahead, RE] - 1j * tables.turns[ahead, IM])


def _legendre_slopes(theta: FloatArray, count: int) -> FloatArray:
    """Return the derivatives of P_l(2θ - 1) by θ, (times, count)."""
    return np.asarray(legendre.legvander(2.0 * theta - 1.0, count - 1) @ derivatives_of_legendre(count).T)


@cache
def derivatives_of_legendre(count: int) -> FloatArray:
    """Return the coefficients of the derivatives of P_l(2θ - 1) by θ, (l, degree)."""
    return 2.0 * np.stack([np.append(legendre.legder(one), 0.0)[:count] for one in np.eye(count)])


def _first_bay(run: TrackRun, step: IntArray) -> IntArray:
    """Return the bay of the first contact, from which amplitudes are seen."""
    tables = run.tables
    moved = step * (run.grid.speed != 0.0)
    return np.asarray(tables.bay[0] + (tables.phase[0] + moved) // tables.reads.shape[1])


def _bays_ahead(run: TrackRun, step: int, contact: int) -> int:
    """Return how many bays a contact is ahead of the first one, of those of the ring."""
    tables = run.tables
    phases = tables.reads.shape[1]
    own, first = (tables.bay[i] + (tables.phase[i] + step) // phases for i in (contact, 0))
    return int((own - first) % tables.turns.shape[0])


def _complex(rows: FloatArray) -> ComplexArray:
    """Return rows (q, 2, modes) as complex numbers of double precision."""
    out = np.empty((len(rows), rows.shape[2]), dtype=complex)
    out.real, out.imag = rows[:, RE], rows[:, IM]
    return out


def _alike(run: TrackRun, step: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Return which of some macro steps have the same tables: one of them, and where they stand."""
    repeat = int(np.lcm(len(run.tables.which), run.tables.reads.shape[1]))
    _, first, which, count = np.unique(step % repeat, return_index=True, return_inverse=True, return_counts=True)
    yield from zip(step[first].tolist(), np.split(np.argsort(which, kind="stable"), np.cumsum(count))[:-1], strict=True)


class Starts:
    """The modes at the start of macro steps, from the logged states and moments; rising steps go on from each other."""

    def __init__(self, run: TrackRun) -> None:
        self.run, self.reached = run, -1
        self.held = np.empty(0, dtype=complex)

    def at(self, steps: IntArray) -> ComplexArray:
        """Return the modes at the start of rising macro steps, as the tables have them, (steps, modes)."""
        known = steps // MODES_EVERY * MODES_EVERY
        before = np.append(self.reached, steps[:-1])
        begins = np.where((known <= before) & (before <= steps), before, known)
        out = np.empty((len(steps), self.run.tables.decay.shape[2]), dtype=complex)
        parts = np.cumsum(steps - begins) // STEPS_AT_ONCE
        for some in np.split(np.arange(len(steps)), np.flatnonzero(np.diff(parts)) + 1):
            self._walk(begins[some], steps[some], out[some[0] : some[0] + len(some)])
        return out

    def checkpoints(self) -> ComplexArray:
        """Return the modes at the start of every MODES_EVERY-th macro step of the run, from its first one alone."""
        last = np.arange(0, len(self.run.moments), MODES_EVERY)
        out = np.empty((len(last), self.run.tables.decay.shape[2]), dtype=complex)
        for number, end in enumerate(last):
            self._walk(np.array([max(self.reached, 0)]), np.array([end]), out[number : number + 1])
        return out

    def _walk(self, begins: IntArray, ends: IntArray, out: ComplexArray) -> None:
        """Write the modes at the ends of ways, each from where the way before ended, or from a logged state."""
        run, tables = self.run, self.run.tables
        way = np.concatenate([np.arange(*ends_of) for ends_of in zip(begins, ends, strict=True)])
        taken = np.zeros((len(way), out.shape[1]), dtype=complex)
        for one, some in _alike(run, way):
            for i in range(run.moments.shape[1]):
                taken[some] += real_times(run.moments[way[some], i], _taken(run, one, i))
        decays = tables.decay[:, RE] + 1j * tables.decay[:, IM]
        turn = tables.turns[1 % len(tables.turns), RE] + 1j * tables.turns[1 % len(tables.turns), IM]
        lengths = tables.which[way % len(tables.which)].tolist()
        enters = (np.diff(_first_bay(run, np.stack([way, way + 1])), axis=0)[0] != 0).tolist()
        done = 0
        for number, (begin, end) in enumerate(zip(begins.tolist(), ends.tolist(), strict=True)):
            if begin != self.reached:
                self.held = run.modes[begin // MODES_EVERY, RE] + 1j * run.modes[begin // MODES_EVERY, IM]
            for _ in range(begin, end):
                self.held = self.held * decays[lengths[done]] + taken[done]
                if enters[done]:
                    self.held *= turn
                done += 1
            self.reached = end
            out[number] = self.held


# -- the path ---------------------------------------------------------------------------------------------------------


def path_heights(contact: Contact, x: FloatArray) -> FloatArray:
    """Return the height of a contact's path, m, at places of its own table."""
    piece, from_centre = _piece_at(contact, x)
    columns = contact.pieces.T
    out = _along(contact, x, contract.DEGREE, contract.COEFFICIENT)
    sine, cosine = columns[contract.SINE], columns[contract.COSINE]
    if sine.any() or cosine.any():
        wave = columns[contract.WAVENUMBER][piece] * from_centre
        out += sine[piece] * np.sin(wave) + cosine[piece] * np.cos(wave)
    return out


def surface_along(contact: Contact, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what earlier wheels have left, and what the surface bears, m, at places of a yielding contact's table."""
    left = _along(contact, x, contract.RESIDUAL_DEGREE, contract.RESIDUAL)
    return left, _along(contact, x, contract.BEARS_DEGREE, contract.BEARS)


def factors_along(contact: Contact, x: FloatArray) -> FloatArray:
    """Return the factor on a contact's force at places of its own table."""
    return _along(contact, x, contract.FACTOR_DEGREE, contract.FACTOR, 1.0)


def _along(contact: Contact, x: FloatArray, degree: int, first: int, without: float = 0.0) -> FloatArray:
    """Return polynomials whose degree and terms are in these columns of pieces, or a number where there are none."""
    piece, from_centre = _piece_at(contact, x)
    columns = contact.pieces.T
    xi, out = from_centre / columns[contract.SCALE][piece], np.zeros(len(x))
    for k in range(int(columns[degree].max()), -1, -1):
        out = out * xi + np.where(k <= columns[degree], columns[first + k], 0.0)[piece]
    return np.where(columns[degree][piece] < 0.0, without, out)


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
    piece, from_centre = _piece_at(contact, x)
    return contact.pieces[piece], from_centre


def _piece_at(contact: Contact, x: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the numbers of these pieces instead."""
    pieces = contact.pieces
    if contact.loop < len(pieces):
        begin, end = pieces[contact.loop, contract.START], pieces[-1, contract.STOP]
        x = np.where(x >= end, begin + np.mod(x - begin, end - begin), x)
    piece = np.clip(np.searchsorted(pieces[:, contract.START], x, side="right") - 1, 0, len(pieces) - 1)
    return piece, x - pieces[piece, contract.CENTRE]
