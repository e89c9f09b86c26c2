"""What places of a track read of its modes, and what the modes miss of the static field around a force.

Positions count from a seat at zero, m. A row of numbers (modes,) gives the reading Σ weights·Re[row·turns**d·a] where
the amplitudes a refer to a bay that lies `d` bays behind that of the place; the time derivative has row·rates instead.
Deflections are positive down, the strain at the foot in tension, forces in compression; the shear force is
Q = κGA·(w' - θ), positive behind a wheel and negative ahead of it (docs/theory/track.rst, section 13.6).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wheeltapper.lower.track import responses, waves
from wheeltapper.lower.track.irregular import IrregularModes, by_powers, static_field
from wheeltapper.lower.track.responses import BALLAST, PAD, Extra
from wheeltapper.lower.track.ring import TrackModes, ring_of
from wheeltapper.lower.track.section import Section
from wheeltapper.march.general.structure import Ring

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
SAME_EDGE = 1e-9
"""Edges of polynomials no farther from each other, in distances of seats, are one."""


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


class Places(NamedTuple):
    """Places as the ring knows them: number of the bay, number of the element, and ζ in it."""

    bay: NDArray[np.int64]
    element: NDArray[np.int64]
    zeta: FloatArray


def places_of(ring: Ring, x: FloatArray) -> Places:
    """Return where positions lie."""
    bay = np.floor(x / ring.spacing).astype(np.int64)
    within = x - bay * ring.spacing
    element = np.clip(np.searchsorted(ring.edges, within, side="right") - 1, 0, len(ring.edges) - 2)
    start, stop = ring.edges[element], ring.edges[element + 1]
    return Places(bay, element, 2.0 * (within - start) / (stop - start) - 1.0)


class Place(NamedTuple):
    """One of them."""

    bay: int
    element: int
    zeta: float


def place_of(ring: Ring, x: float) -> Place:
    """Return where a position lies."""
    (bay,), (element,), (zeta,) = places_of(ring, np.array([x]))
    return Place(int(bay), int(element), float(zeta))


def rail_rows(section: Section, foot: float, modes: TrackModes | IrregularModes, x: float) -> RailRows:
    """Return the rows of a place of the rail; `foot` is the distance from the neutral axis to the strain."""
    ring = modes.ring
    _, element, zeta = place_of(ring, x)
    powers = np.arange(ring.deflection.shape[1])
    values = zeta**powers
    slopes = powers * zeta ** np.maximum(powers - 1, 0) * 2.0 / (ring.edges[1] - ring.edges[0])
    rotation = modes.rotation[element]
    shear = section.shear * (1.0 + section.loss * ring.rates)
    return RailRows(
        values @ ring.deflection[element],
        -foot * (slopes @ rotation),
        shear * (slopes @ ring.deflection[element] - values @ rotation),
    )


def seat_rows(section: Section, modes: TrackModes | IrregularModes, seat: int) -> SeatRows:
    """Return the rows of a seat, whose pad and ballast are those of the section."""
    ring = modes.ring
    if isinstance(modes, IrregularModes):
        rail, sleeper = modes.rail[seat % ring.seats], modes.sleeper[seat % ring.seats]
    else:
        rail, sleeper = (-1.0) ** np.arange(ring.deflection.shape[1]) @ ring.deflection[0], modes.sleeper
    pad = (section.pad + section.pad_damping * ring.rates) * (rail - sleeper)
    ballast = (section.ballast + section.ballast_damping * ring.rates) * sleeper
    return SeatRows(sleeper, pad, ballast)


def section_at(section: Section, extras: tuple[Extra, ...], seat: int) -> Section:
    """Return the section with pad and ballast of one seat of the ring."""
    for extra in extras:
        if extra.seat == seat and extra.kind == PAD:
            section = section._replace(
                pad=section.pad + extra.stiffness, pad_damping=section.pad_damping + extra.damping
            )
        if extra.seat == seat and extra.kind == BALLAST:
            section = section._replace(
                ballast=section.ballast + extra.stiffness, ballast_damping=section.ballast_damping + extra.damping
            )
    return section


def modes_at_rest(ring: Ring, rows: ComplexArray, bay: int, where: FloatArray) -> FloatArray:
    """Return the static readings (positions, rows), by the modes alone, of unit forces at some places.

    Parameters
    ----------
    ring
        The ring.
    rows
        Of what reads, (rows, modes).
    bay
        The bay that reads.
    where
        Places of the force, (positions,), m.
    """
    at = places_of(ring, where)
    powers = at.zeta[:, None] ** np.arange(ring.drive.shape[1])
    out = np.empty((len(where), len(rows)))
    for force in np.unique(at.bay):  # in each of them a reading is a polynomial of the place
        amplitudes = -ring.weights / ring.rates * ring.turns ** (bay - force)
        polynomials = np.real(np.tensordot(ring.drive, (rows * amplitudes).T, axes=1))
        here = at.bay == force
        out[here] = np.einsum("xp,xpr->xr", powers[here], polynomials[at.element[here]])
    return out


class Rest(NamedTuple):
    """What modes miss at rest of readings at a place, as polynomials of where the force is.

    Attributes
    ----------
    edges
        Of the pieces, rising, m.
    powers
        Of ζ, from -1 to 1 over a piece, (pieces, degree + 1, readings).
    period
        After which all repeats, m.
    """

    edges: FloatArray
    powers: FloatArray
    period: float = np.inf

    def at(self, where: FloatArray) -> FloatArray:
        """Return it for unit forces at places, and its first three derivatives by them, (4, positions, readings).

        At an edge it is that of the piece before.
        """
        x = where if np.isinf(self.period) else np.mod(where, self.period)
        piece = np.clip(np.searchsorted(self.edges, x, side="left") - 1, 0, len(self.powers) - 1)
        half = 0.5 * np.diff(self.edges)[piece]
        zeta = (x - self.edges[piece]) / half - 1.0
        held, out = self.powers, np.empty((4, len(x), self.powers.shape[2]))
        for order in range(4):
            powers = zeta[:, None] ** np.arange(held.shape[1]) / half[:, None] ** order
            out[order] = np.einsum("xp,xpr->xr", powers, held[piece])
            held = held[:, 1:] * np.arange(1, held.shape[1])[:, None]
        return out

    def moved(self, by: float) -> Rest:
        """Return it for a place that lies further on, m."""
        return self._replace(edges=self.edges + by)


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
    state = waves.response(section, 0.0, where, at).real
    exact = np.stack([state[..., 0], -foot / section.bending * state[..., 2], state[..., 3]], axis=-1)
    rows = rail_rows(section, foot, modes, at)
    still = np.stack([rows.deflection, rows.strain, rows.shear / (1.0 + section.loss * modes.ring.rates)])
    return np.asarray(exact - modes_at_rest(modes.ring, still, place_of(modes.ring, at).bay, where))


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
    shapes = (-1.0) ** np.arange(ring.deflection.shape[1]) @ ring.deflection[0]
    rows = modes.sleeper, section.pad * (shapes - modes.sleeper), section.ballast * modes.sleeper
    return np.asarray(exact - modes_at_rest(ring, np.stack(rows), seat, where))


@lru_cache(maxsize=256)
def rest_of_place(section: Section, foot: float, bays: int, cutoff: float, at: float) -> Rest:
    """Return what `static_rest` does, of a ring by itself, for all places of the force along it."""
    modes = ring_of(section, bays, cutoff)
    return _rest(modes.ring, at, lambda where: static_rest(section, foot, modes, at, where))


@lru_cache(maxsize=256)
def rest_of_seat(section: Section, bays: int, cutoff: float) -> Rest:
    """Return what `seat_rest` does at seat 0, for all places of the force along the ring."""
    modes = ring_of(section, bays, cutoff)
    return _rest(modes.ring, 0.0, lambda where: seat_rest(section, modes, 0, where))


def _rest(ring: Ring, at: float, rest: Callable[[FloatArray], FloatArray]) -> Rest:
    """Return a rest by its values: polynomials of the modes' degree between edges of elements and the place itself."""
    nearest = (np.floor(at / ring.spacing) + np.arange(-(ring.bays // 2) - 1, ring.bays // 2 + 2)) * ring.spacing
    edges = np.unique(np.append(np.add.outer(nearest, ring.edges[:-1]), at))
    edges = edges[np.append(True, np.diff(edges) > SAME_EDGE * ring.spacing)]
    zeta = chebyshev.chebpts1(ring.drive.shape[1])
    x = edges[:-1, None] + 0.5 * (zeta + 1.0) * np.diff(edges)[:, None]
    values = rest(x.ravel()).reshape(*x.shape, -1)
    return Rest(edges, np.asarray(np.linalg.solve(zeta[:, None] ** np.arange(len(zeta)), values)))


def rest_beside(section: Section, foot: float, modes: IrregularModes, extras: tuple[Extra, ...], at: float) -> Rest:
    """Return by how much what the modes miss at a place of the rail differs from what the regular ring's modes miss."""
    bays = modes.ring.seats
    regular = ring_of(section, bays, modes.cutoff)
    field = static_field(section, bays, len(regular.ring.edges) - 1, extras)
    ahead = at - np.array([extra.seat for extra in extras]) * section.spacing
    ahead = responses.nearest(ahead, bays * section.spacing)
    state = responses.shares(section, extras)[0].real[:, None] * waves.response(section, 0.0, 0.0, ahead).real
    shown = np.stack([state[:, 0], -foot / section.bending * state[:, 2], state[:, 3]], axis=-1)
    missed = (field.forces @ shown).reshape(-1, 3)
    for one, sign in ((modes, -1.0), (regular, 1.0)):
        rows = rail_rows(section._replace(loss=0.0), foot, one, at)
        missed += sign * modes_at_rest(one.ring, np.stack(rows), place_of(one.ring, at).bay, field.x.ravel())
    return Rest(modes.ring.edges, by_powers(missed.reshape(len(modes.ring.edges) - 1, -1, 3)), bays * section.spacing)


def seat_rest_around(section: Section, modes: IrregularModes, extras: tuple[Extra, ...], seat: int) -> Rest:
    """Return what the modes miss at a seat of the ring: sleeper in m/N, forces of pad and ballast in N/N."""
    ring = modes.ring
    elements = (len(ring.edges) - 1) // ring.seats
    field = static_field(section, ring.seats, elements, extras)
    length = ring.seats * section.spacing
    seats = np.array([extra.seat for extra in extras])
    kinds = np.array([extra.kind for extra in extras])
    ahead = responses.nearest(seat * section.spacing - field.x, length)
    beside = responses.nearest((seat - seats) * section.spacing, length)
    share = responses.shares(section, extras)[0].real
    rail = waves.response(section, 0.0, 0.0, ahead)[..., 0].real
    rail = rail + field.forces @ (share * waves.response(section, 0.0, 0.0, beside)[..., 0].real)
    of_pad, of_ballast = (field.forces @ ((seats == seat) & (kinds == kind)).astype(float) for kind in (PAD, BALLAST))
    sleeper = np.zeros_like(rail)
    if section.sleeper > 0.0:
        sleeper = (section.pad * rail - of_pad + of_ballast) / (section.pad + section.ballast)
    exact = np.stack([
        sleeper, section.pad * (rail - sleeper) - of_pad, section.ballast * sleeper - of_ballast
    ], axis=-1)  # fmt: skip
    own = section_at(section, extras, seat)._replace(pad_damping=0.0, ballast_damping=0.0)
    shown = modes_at_rest(ring, np.stack(seat_rows(own, modes, seat)), 0, field.x.ravel())
    missed = exact.reshape(-1, 3) - shown
    return Rest(ring.edges, by_powers(missed.reshape(len(ring.edges) - 1, -1, 3)), length)
