"""What a ring takes, stores and loses in a run (docs/theory/track.rst, section 13.7)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.track.energy import POWERS, RingEnergy
from wheeltapper.lower.track.irregular import IrregularModes, regular_amplitudes
from wheeltapper.lower.track.readouts import places_of
from wheeltapper.lower.track.section import Section
from wheeltapper.lower.track.works import (
    Pressed,
    Products,
    RingPowers,
    RingState,
    by_zeta,
    driven,
    powers_of,
    products_of,
    read,
    stored_by,
)
from wheeltapper.march.general.replay import Starts
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.task import Marched

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.plane import LoweredPlane

FloatArray = NDArray[np.float64]
AT_ONCE = 16
"""Macro steps that are looked at together: so many that the modes at their nodes stay in the processor's cache."""


class TrackWorks(NamedTuple):
    """Energies and works of the track over a run, J, of one rail.

    Attributes
    ----------
    stored
        Change of the energy of the track's deflection and velocity, the residual's included.
    lost
        Dissipated in rail, pads and ballast.
    given
        What the contact forces did at the velocity of the rail under them.
    anomalies
        What forces of anomalous seats did, and those of the ballast under voids.
    missed
        What `given` and `anomalies` do that is neither stored nor lost, because the modes beyond the cut-off are at
        rest at any time.
    slope
        What the wheels' forces do as the wheels go on along a rail that is not level, against their traction.
    sudden
        What the residual took of the contacts, as forces jumped: part of `given` and of `stored`.
    """

    stored: float
    lost: float
    given: float
    anomalies: float
    missed: float
    slope: float
    sudden: float


GIVEN = TrackWorks._fields.index("given") - 1
"""Of the works that are integrals over time."""


class _Rail(NamedTuple):
    """Forces of the wheels at some times and the rail under them, (wheels, times) each.

    Attributes
    ----------
    force
        N.
    velocity
        Of the rail, m/s, as the modes have it; of a ring of equal bays it is not looked for.
    slope
        Of the rail, with that of the residual.
    residual
        m/N.
    """

    force: FloatArray
    velocity: FloatArray
    slope: FloatArray
    residual: FloatArray


def track_works(section: Section, lowered: LoweredPlane, march: Marched) -> TrackWorks:
    """Return energies and works of the track of a run."""
    assert lowered.modes is not None
    ring = lowered.modes.ring
    known = products_of(section, ring.bays * ring.seats, lowered.modes.cutoff)
    energy, starts, works = known.energy, march.starts(), np.zeros(len(TrackWorks._fields) - 2)
    for rule in march.rules(AT_ONCE):
        state, rail = _track_at(energy, lowered, march, rule.times, starts)
        lost, given, anomalies, missed = powers_of(energy, known, state)
        if state.beside is not None:  # there the rail has deflections of its own
            missed += (rail.force * rail.velocity).sum(axis=0) - given
            given = (rail.force * rail.velocity).sum(axis=0)
        slope = lowered.program.system.speed * (rail.force * rail.slope).sum(axis=0)
        works += np.stack([lost, given, anomalies, missed, slope]) @ rule.weights
    works[:-1] += _done_by_jumps(energy, known, lowered, march)
    state, rail = _track_at(energy, lowered, march, np.array([0.0, march.end]), march.starts())
    stored = float(np.diff(stored_by(energy, known, state, rail.residual))[0])
    works[GIVEN] += 0.5 * np.diff((rail.residual * rail.force**2).sum(axis=0))[0]
    return TrackWorks._make([stored, *works.tolist(), _taken_by_jumps(lowered, march)])


def _done_by_jumps(energy: RingEnergy, known: Products, lowered: LoweredPlane, march: Marched) -> FloatArray:
    """Return the works, as in `RingPowers`, of forces that jump.

    The powers have terms with the rate of the forces, over which the integral is the jump times the mean of both sides.
    What has the rate twice, the residual's own loss, has no integral; a jump is taken to lose nothing there.
    """
    times, modes = march.jumps(), lowered.modes
    assert modes is not None
    if not times.size:
        return np.zeros(len(RingPowers._fields))
    found = march.modes(times.ravel(), False, march.starts())
    turned = modes.ring.turns ** np.diff(found.bay)[::2, None]
    jump = found.forced[1::2] - found.forced[::2] * turned
    regular = regular_amplitudes(modes, jump) if isinstance(modes, IrregularModes) else jump
    after, _ = _track_at(energy, lowered, march, times[:, 1], march.starts())
    before, later = found.force[::2], found.force[1::2]
    wheels = list[Pressed]()
    for number, one in enumerate(after.wheels):
        powers, _ = by_zeta(energy.modes.ring, one.at, POWERS)
        mean, step = (0.5 * (before + later))[:, [number]], (later - before)[:, [number]]
        wheels.append(Pressed(one.at, powers * mean, powers * step))
    state = after._replace(rates=after.rates - 0.5 * regular, wheels=wheels)
    if after.beside is not None:
        other = regular - np.sum([driven(energy.modes.ring, one.at, one.changes) for one in wheels], axis=0)
        state = state._replace(beside=after.beside - 0.5 * other, beside_rates=other)
    done, undone = (np.stack(powers_of(energy, known, _times(state, sign))) for sign in (1.0, -1.0))
    odd: FloatArray = 0.5 * (done - undone)
    return np.asarray(odd.sum(axis=1))


def _taken_by_jumps(lowered: LoweredPlane, march: Marched) -> float:
    """Return what the residual took of the contacts as their forces jumped, J."""
    assert lowered.modes is not None
    times, wheels = march.jumps(), lowered.program.system.wheels
    x = lowered.program.system.speed * times[:, 1:] + np.array([wheel.position for wheel in wheels])
    residual = _residual(lowered.modes.ring, x.ravel())[0].reshape(x.shape)
    force = march.at(times.ravel()).force[:, : len(wheels)].reshape(*times.shape, len(wheels))
    return float(0.5 * (residual * np.diff(force**2, axis=1)[:, 0]).sum())


def _times(state: RingState, sign: float) -> RingState:
    """Return a state with what has the rate of the forces times a number."""
    rates = None if state.beside_rates is None else sign * state.beside_rates
    wheels = [one._replace(changes=sign * one.changes) for one in state.wheels]
    return state._replace(wheels=wheels, beside_rates=rates)


def _track_at(
    energy: RingEnergy, lowered: LoweredPlane, march: Marched, times: FloatArray, starts: Starts
) -> tuple[RingState, _Rail]:
    """Return the ring of equal bays, and the rail under the wheels, at some times."""
    modes, regular, speed = lowered.modes, energy.modes.ring, lowered.program.system.speed
    assert modes is not None
    ring, irregular = modes.ring, isinstance(modes, IrregularModes)
    found = march.modes(times, irregular, starts)
    held, rates = found.amplitudes, ring.rates * found.amplitudes + found.forced
    rail = _Rail(*np.zeros((4, len(lowered.program.system.wheels), len(times))))
    wheels = list[Pressed]()
    for number, contact in enumerate(lowered.program.system.wheels):
        x, force = speed * times + contact.position, found.force[:, [number]]
        at = places_of(regular, x)
        powers, slopes = by_zeta(regular, at, POWERS)
        changes = speed * slopes * force + powers * found.force_rate[:, [number]]
        wheels.append(Pressed(at if irregular else at._replace(bay=at.bay - found.bay), powers * force, changes))
        at = places_of(ring, x)
        at, shapes = at._replace(bay=at.bay - found.bay), ring.weights * ring.deflection
        powers, slopes = by_zeta(ring, at, ring.deflection.shape[1])
        rail.force[number] = force[:, 0]
        rail.residual[number], steep = _residual(ring, x)
        rail.slope[number] = (slopes * read(ring, [shapes], held, at)[:, 0]).sum(axis=1) + 0.5 * steep * force[:, 0]
        if irregular:
            rail.velocity[number] = (powers * read(ring, [shapes], rates, at)[:, 0]).sum(axis=1)
    if not isinstance(modes, IrregularModes):
        return RingState(held, rates, wheels), rail
    bends = ring.rates * rates + found.forced_rate
    held, rates, bends = (regular_amplitudes(modes, one) for one in (held, rates, bends))
    beside, beside_rates = rates - regular.rates * held, bends - regular.rates * rates
    for wheel in wheels:
        beside -= driven(regular, wheel.at, wheel.powers)
        beside_rates -= driven(regular, wheel.at, wheel.changes)
    return RingState(held, rates, wheels, beside, beside_rates), rail


def _residual(ring: Ring, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the residual and its slope at positions."""
    at = places_of(ring, x)
    powers, slopes = by_zeta(ring, at, ring.residual.shape[1])
    own = ring.residual[at.element]
    return np.einsum("xp,xp->x", powers, own), np.einsum("xp,xp->x", slopes, own)
