"""What places of a track read of its modes, and what the modes miss of the static field around a force.

Positions count from a seat at zero, m. A row of numbers (modes,) gives the reading Σ weights·Re[row·turns**d·a] where
the amplitudes a refer to a bay that lies `d` bays behind that of the place; the time derivative has row·rates instead.
Deflections are positive down, the strain at the foot in tension, forces in compression; the shear force is
Q = κGA·(w' - θ), positive behind a wheel and negative ahead of it (docs/theory/track.rst, section 13.6).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.track import waves
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import Section
from wheeltapper.march.general.structure import Ring

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


class RailRows(NamedTuple):
    """Rows of a place of the rail, (modes,) each.

    Attributes
    ----------
    deflection
        m.
    strain
        At the underside of the foot.
    shear
        N.
    """

    deflection: ComplexArray
    strain: ComplexArray
    shear: ComplexArray


class SeatRows(NamedTuple):
    """Rows of a seat, (modes,) each; of the sleeper and the ballast they are zero where there is no sleeper.

    Attributes
    ----------
    sleeper
        Deflection, m.
    pad, ballast
        Forces, N.
    """

    sleeper: ComplexArray
    pad: ComplexArray
    ballast: ComplexArray


class Place(NamedTuple):
    """A place as the ring knows it: number of its bay, number of its element, and ζ in it."""

    bay: int
    element: int
    zeta: float


def place_of(ring: Ring, x: float) -> Place:
    """Return where a position lies."""
    bay = int(np.floor(x / ring.spacing))
    within = x - bay * ring.spacing
    element = int(np.clip(np.searchsorted(ring.edges, within, side="right") - 1, 0, len(ring.edges) - 2))
    start, stop = ring.edges[element : element + 2]
    return Place(bay, element, float(2.0 * (within - start) / (stop - start) - 1.0))


def rail_rows(section: Section, foot: float, modes: TrackModes, x: float) -> RailRows:
    """Return the rows of a place of the rail; `foot` is the distance from the neutral axis to the strain."""
    ring = modes.ring
    at = place_of(ring, x)
    powers = np.arange(ring.deflection.shape[1])
    values = at.zeta**powers
    slopes = powers * at.zeta ** np.maximum(powers - 1, 0) * 2.0 / (ring.edges[1] - ring.edges[0])
    rotation = modes.rotation[at.element]
    shear = section.shear * (1.0 + section.loss * ring.rates)
    return RailRows(
        values @ ring.deflection[at.element],
        -foot * (slopes @ rotation),
        shear * (slopes @ ring.deflection[at.element] - values @ rotation),
    )


def seat_rows(section: Section, modes: TrackModes) -> SeatRows:
    """Return the rows of the seat at the beginning of a bay."""
    ring = modes.ring
    rail = (-1.0) ** np.arange(ring.deflection.shape[1]) @ ring.deflection[0]
    pad = (section.pad + section.pad_damping * ring.rates) * (rail - modes.sleeper)
    ballast = (section.ballast + section.ballast_damping * ring.rates) * modes.sleeper
    return SeatRows(modes.sleeper, pad, ballast)


def drive_at(ring: Ring, x: FloatArray) -> ComplexArray:
    """Return Ψ at positions, (positions, modes), in the frame of the bay of each."""
    within = x - ring.spacing * np.floor(x / ring.spacing)
    element = np.clip(np.searchsorted(ring.edges, within, side="right") - 1, 0, len(ring.edges) - 2)
    zeta = 2.0 * (within - ring.edges[element]) / (ring.edges[1] - ring.edges[0]) - 1.0
    powers = zeta[:, None] ** np.arange(ring.drive.shape[1])
    out = np.empty((len(x), len(ring.rates)), dtype=complex)
    for one in range(len(ring.edges) - 1):
        out[element == one] = powers[element == one] @ ring.drive[one]
    return out


def static_rest(section: Section, foot: float, modes: TrackModes, at: float, where: FloatArray) -> FloatArray:
    """Return what the modes miss at a place of the static field of unit forces at other places.

    Parameters
    ----------
    section, foot, modes
        The track, the distance from the neutral axis to the strain, and the ring.
    at
        The place that reads, m.
    where
        Places of the force, (positions,), m.

    Returns
    -------
    FloatArray
        (positions, 3): deflection in m/N, strain in 1/N, shear in N/N. The first two are as good as zero some bays
        away; the shear, whose jump under the force the modes cannot make, only falls with the distance.
    """
    ring = modes.ring
    state = waves.response(section, 0.0, where, at).real
    exact = np.stack([state[..., 0], -foot / section.bending * state[..., 2], state[..., 3]], axis=-1)
    away = np.floor(at / ring.spacing) - np.floor(where / ring.spacing)
    turned = ring.turns ** away[:, None] * drive_at(ring, where) * (-ring.weights / ring.rates)
    rows = rail_rows(section, foot, modes, at)
    kept = np.real(turned @ np.stack(_at_rest(rows, section, ring), axis=-1))
    return np.asarray(exact - kept)


def seat_rest(section: Section, modes: TrackModes, seat: int, where: FloatArray) -> FloatArray:
    """Return what the modes miss at a seat of the static field of unit forces at other places.

    Returns
    -------
    FloatArray
        (positions, 3): deflection of the sleeper in m/N, force of the pad and of the ballast in N/N; the columns of
        sleeper and ballast are zero where there is no sleeper.
    """
    ring = modes.ring
    rail = waves.response(section, 0.0, where, seat * section.spacing)[..., 0].real
    sleeper = rail * section.pad / (section.pad + section.ballast) if section.sleeper > 0.0 else np.zeros_like(rail)
    exact = np.stack([sleeper, section.pad * (rail - sleeper), section.ballast * sleeper], axis=-1)
    away = seat - np.floor(where / ring.spacing)
    turned = ring.turns ** away[:, None] * drive_at(ring, where) * (-ring.weights / ring.rates)
    shapes = (-1.0) ** np.arange(ring.deflection.shape[1]) @ ring.deflection[0]
    rows = modes.sleeper, section.pad * (shapes - modes.sleeper), section.ballast * modes.sleeper
    return np.asarray(exact - np.real(turned @ np.stack(rows, axis=-1)))


def _at_rest(rows: RailRows, section: Section, ring: Ring) -> RailRows:
    """Return the rows for a state that does not change: without the rail's damping."""
    return rows._replace(shear=rows.shear / (1.0 + section.loss * ring.rates))
