"""What a ring's kept modes and the residual take, store and lose in a run (docs/theory/track.rst, section 13.7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from wheeltapper.lower.on_rails import LoweredOnRails
from wheeltapper.lower.track.energy import Group, energy_groups, lost_power, received_power, stored_energy
from wheeltapper.lower.track.irregular import IrregularModes, pressed_by_extras, regular_amplitudes
from wheeltapper.lower.track.readouts import places_of
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import Section
from wheeltapper.march import run
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.task import Marched

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
CHUNK = 2048
"""Times that are looked at together; their modes and shapes take 16 bytes each and mode."""
NODES = 10
"""Of the Gauss rule between two joints of the logged force, for what the dampers take."""


class TrackWorks(NamedTuple):
    """Energies and works of the track over a run, J, of one rail.

    Attributes
    ----------
    stored
        Change of the energy of the kept modes.
    residual
        Change of that of the residual, r·N²/2.
    lost
        Dissipated in rail, pads and ballast.
    received
        What the kept modes took of the contact forces, and of what differs at anomalous seats.
    anomalies
        What they took of the latter alone, and of the ballast under voids.
    pressed
        The forces times the velocity of the rail under them, as the kept modes have it.
    slope
        What the wheels' forces do as the wheels go on along a rail that is not level, against their traction.
    """

    stored: float
    residual: float
    lost: float
    anomalies: float
    received: float
    pressed: float
    slope: float


def track_works(section: Section, lowered: LoweredOnRails, march: Marched) -> TrackWorks:
    """Return energies and works of the track of a run."""
    assert lowered.modes is not None
    ring, modes = lowered.modes.ring, lowered.modes
    groups = energy_groups(section, ring.bays * ring.seats, modes.cutoff)
    both = np.array([0.0, march.end])
    stored = float(np.diff(stored_energy(groups, _regular(modes, run.modes_of_track(march, both).amplitudes)))[0])
    forces = run.replay_rails(march, both).force
    speed, held = lowered.program.system.speed, 0.0
    sums = np.zeros(3)
    for number, contact in enumerate(lowered.program.system.wheels):
        held += float(np.diff(_residual(ring, speed * both + contact.position)[0] * forces[:, number] ** 2)[0])
        rule = run.pressing_on_rails(march, number)
        for first in range(0, len(rule.times), CHUNK):
            some = slice(first, first + CHUNK)
            powers = _powers(modes, groups, march, rule.times[some], contact.position, speed, rule.force[some])
            sums += powers @ (rule.force[some] * rule.weights[some])
    lost, anomalies = _lost(modes, groups, march)
    for number, port in enumerate(lowered.program.system.ports, len(lowered.program.system.wheels)):
        rule = run.pressing_on_rails(march, number)
        for first in range(0, len(rule.times), CHUNK):
            some = slice(first, first + CHUNK)
            here = _regular(modes, run.modes_of_track(march, rule.times[some]).amplitudes)
            taken = received_power(groups, here, np.broadcast_to(_regular(modes, port.drive[None]), here.shape))
            anomalies += float(taken @ (rule.force[some] * rule.weights[some]))
    sums[0] += anomalies
    return TrackWorks(stored, 0.5 * held, lost, anomalies, *sums.tolist())


def _regular(modes: TrackModes | IrregularModes, amplitudes: ComplexArray) -> ComplexArray:
    """Return amplitudes as those of the ring of equal bays, whose energy is known."""
    return regular_amplitudes(modes, amplitudes) if isinstance(modes, IrregularModes) else amplitudes


def _powers(
    modes: TrackModes | IrregularModes, groups: tuple[Group, ...], march: Marched, times: FloatArray, position: float,
    speed: float, force: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return, per unit of a contact's force, what modes receive, the rail's velocity, its slope's power: (3, times)."""
    ring = modes.ring
    found = run.modes_of_track(march, times)
    x = speed * times + position
    at = places_of(ring, x)
    here = ring.turns ** (at.bay - found.bay)[:, None] * found.amplitudes
    powers = at.zeta[:, None] ** np.arange(ring.deflection.shape[1])
    shapes, drives, slopes = (np.empty(here.shape, dtype=complex) for _ in range(3))
    for one in np.unique(at.element):
        some = at.element == one
        half = 0.5 * (ring.edges[one + 1] - ring.edges[one])
        shapes[some], drives[some] = powers[some] @ ring.deflection[one], powers[some] @ ring.drive[one]
        slopes[some] = powers[some, :-1] @ polynomial.polyder(ring.deflection[one]) / half
    steep = np.real((slopes * here) @ ring.weights) + 0.5 * force * _residual(ring, x)[1]
    velocity = np.real((shapes * ring.rates * here) @ ring.weights)
    received = received_power(groups, _regular(modes, here), _regular(modes, drives))
    return np.stack([received, velocity, speed * steep])


def _residual(ring: Ring, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the residual and its slope at positions."""
    at = places_of(ring, x)
    powers = at.zeta[:, None] ** np.arange(ring.residual.shape[1])
    slopes = polynomial.polyder(ring.residual, axis=1) * 2.0 / (ring.edges[1] - ring.edges[0])
    return (
        np.einsum("xp,xp->x", powers, ring.residual[at.element]),
        np.einsum("xp,xp->x", powers[:, :-1], slopes[at.element]),
    )


def _lost(modes: TrackModes | IrregularModes, groups: tuple[Group, ...], march: Marched) -> tuple[float, float]:
    """Return what the track's dampers take, and what the kept modes take of what differs at seats.

    By Gauss rules between the joints of all contacts' forces.
    """
    edges = run.joints_on_rails(march)
    places, weights = np.polynomial.legendre.leggauss(NODES)
    times = edges[:-1, None] + 0.5 * np.diff(edges)[:, None] * (places + 1.0)
    factors = (0.5 * np.diff(edges)[:, None] * weights).ravel()
    lost = taken = 0.0
    for first in range(0, times.size, CHUNK):
        some = slice(first, first + CHUNK)
        own = run.modes_of_track(march, times.ravel()[some]).amplitudes
        here = _regular(modes, own)
        lost += float(lost_power(groups, here) @ factors[some])
        if isinstance(modes, IrregularModes):
            taken += float(received_power(groups, here, pressed_by_extras(modes, own)) @ factors[some])
    return lost, taken
