"""What a track answers to a harmonic force: at the contact, and in a sensor, for all places of the force.

A pair of gauges reads a force between them at once, and that part jumps where the force passes a gauge. It stands
apart; the rest is smooth along the track.

Theory: docs/theory/gauges.rst, section 16.2.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.gauges.passing import HIGHEST, PASSED
from wheeltapper.lower.track import waves
from wheeltapper.lower.track.section import Section

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
PLACES = 24
"""Places in a bay at which responses are known."""
STEP = 12.5
"""Of the frequencies at which they are known, Hz."""
NEAR = 1e-7
"""Of the spacing: places that are nearer are one."""
LOWEST = 0.5
"""In place of the frequency zero, Hz."""


class Responses(NamedTuple):
    """Responses of a track to unit forces that vary as e^{iωt}.

    Attributes
    ----------
    frequencies
        Hz, rising by equal steps from zero.
    spacing
        Of the seats, m.
    under
        The rail's deflection under the force, m/N, (frequencies, PLACES + 1), from one seat to the next.
    first
        First place of `read` from the seat, in units of spacing/PLACES.
    read
        Readings of each sensor, N/N, (frequencies, places, sensors), without the force where it is between its gauges.
    ends
        Of the gauges behind and ahead of each pair, m from the seat, (sensors, 2).
    seat
        Where the seat is from which places count, m along the track.
    """

    frequencies: FloatArray
    spacing: float
    under: ComplexArray
    first: int
    read: ComplexArray
    ends: FloatArray
    seat: float = 0.0

    def contact(self, frequencies: FloatArray, stiffness: float, mass: float) -> ComplexArray:
        """Return the force per height below a wheel, N/m, (frequencies, PLACES + 1).

        `stiffness` is that of the contact about its static force, N/m, `mass` that of the wheel, kg.
        """
        return np.asarray(1.0 / (1.0 / stiffness + self.giving(frequencies, mass)))

    def giving(self, frequencies: FloatArray, mass: float) -> ComplexArray:
        """Return by how much rail and wheel come apart per force between them, m/N, (frequencies, PLACES + 1)."""
        lower, share = self._between(frequencies)
        under = (1.0 - share)[:, None] * self.under[lower] + share[:, None] * self.under[lower + 1]
        inertia = 1.0 / (mass * (2.0 * np.pi * np.maximum(frequencies, LOWEST)) ** 2)
        return np.asarray(under - inertia[:, None])

    def giving_at_all(self, frequencies: FloatArray, mass: float) -> ComplexArray:
        """Return `giving` also above the known frequencies: there, a rail gives way as a beam does, with f^-1.5."""
        known = np.minimum(frequencies, self.frequencies[-1])
        inertia = [1.0 / (mass * (2.0 * np.pi * np.maximum(f, LOWEST)) ** 2) for f in (known, frequencies)]
        beyond = np.where(frequencies > known, known / np.maximum(frequencies, LOWEST), 1.0) ** 1.5
        rail = self.giving(known, mass) + inertia[0][:, None]
        return np.asarray(rail * beyond[:, None] - inertia[1][:, None])

    def between_places(self, x: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Return between which of the PLACES of a bay places are, and where."""
        place, share = np.divmod(np.mod((x - self.seat) / self.spacing, 1.0) * PLACES, 1.0)
        return np.minimum(place.astype(np.int64), PLACES - 1), share

    def at_places(self, values: ComplexArray, x: FloatArray) -> ComplexArray:
        """Return values from one seat to the next, (frequencies, PLACES + 1), at places, (frequencies, places)."""
        lower, share = self.between_places(x)
        return np.asarray((1.0 - share) * values[:, lower] + share * values[:, lower + 1])

    def readings(self, frequencies: FloatArray, x: FloatArray, half: float = 1e-6) -> ComplexArray:
        """Return the readings of unit forces at places, (sensors, frequencies, places).

        The part of a pair that stands between its gauges is the mean over what is up to `half` m from each place.
        """
        lower, share = self._between(frequencies)
        left, beside = self.beside_places(x)
        read = (1.0 - share)[:, None, None] * self.read[lower] + share[:, None, None] * self.read[lower + 1]
        found = (1.0 - beside)[:, None] * read[:, left] + beside[:, None] * read[:, left + 1]
        return np.asarray(np.moveaxis(found, 2, 0) + self.between_gauges(x, half)[:, None])

    def beside_places(self, x: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Return behind which of the places of `read` places are, and how far from it to the next one."""
        along, beside = np.divmod((x - self.seat) * PLACES / self.spacing - self.first, 1.0)
        return np.clip(along.astype(np.int64), 0, self.read.shape[1] - 2), beside

    def between_gauges(self, x: FloatArray, half: float) -> FloatArray:
        """Return which share of what is up to `half` m from each place is between gauges, (sensors, places)."""
        behind, ahead = (self.ends + self.seat).T[..., None]
        between = np.minimum(x + half, ahead) - np.maximum(x - half, behind)
        return np.asarray(np.clip(between / (2.0 * half), 0.0, 1.0))

    def change_to(self, other: Responses, step: float) -> Responses:
        """Return by how much another track answers otherwise, over a step."""
        return self._replace(read=(other.read - self.read) / step, ends=np.zeros_like(self.ends))

    def _between(self, frequencies: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Return between which of the known frequencies others lie, and where."""
        whole, share = np.divmod(frequencies / self.frequencies[1], 1.0)
        lower = np.clip(whole.astype(np.int64), 0, len(self.frequencies) - 2)
        return lower, np.where(whole > lower, 1.0, share)


@lru_cache(maxsize=32)
def responses_of(section: Section, places: tuple[tuple[float, float], ...], first: float, last: float) -> Responses:
    """Return the responses of a track to forces between two places, m from a seat, in pairs of shear gauges.

    `places` are the gauges behind and ahead of each pair, m from that seat.
    """
    omega = 2.0 * np.pi * np.maximum(_frequencies(), LOWEST)
    step = section.spacing / PLACES
    begin, end = int(np.floor(first / step)) - 1, int(np.ceil(last / step)) + 2
    forces = np.arange(begin, end)
    ends = np.array(places)
    bays = np.floor(ends / section.spacing + NEAR)
    inside, which = np.unique(np.round(ends - bays * section.spacing, 9), return_inverse=True)
    apart, place = np.divmod(forces[:, None] - PLACES * bays.astype(int).ravel(), PLACES)
    bay = np.arange(apart.min(), apart.max() + 1)
    gauges = inside + NEAR * section.spacing  # a force at a gauge is behind it, however numbers are rounded
    where, at = np.arange(PLACES)[:, None, None] * step, gauges - bay[:, None] * section.spacing
    field = waves.response(section, omega[:, None, None, None], where, at, waves.SHEAR)
    shear = field[:, place, apart - bay[0], which.ravel()].reshape(len(omega), len(forces), -1, 2)
    beyond = forces[:, None, None] <= ends / step + PLACES * NEAR
    between = beyond[..., 1] & ~beyond[..., 0]
    return bare_responses(section)._replace(first=begin, read=shear[..., 0] - shear[..., 1] - between, ends=ends)


def bare_responses(section: Section) -> Responses:
    """Return the responses of a track without sensors."""
    frequencies = _frequencies()
    within = np.arange(PLACES + 1) * section.spacing / PLACES
    omega = 2.0 * np.pi * np.maximum(frequencies, LOWEST)
    under = waves.response(section, omega[:, None], within, within, waves.DEFLECTION)
    return Responses(
        frequencies, section.spacing, under, 0, np.zeros((len(omega), 2, 0), dtype=complex), np.zeros((0, 2))
    )


def _frequencies() -> FloatArray:
    return np.arange(0.0, PASSED * HIGHEST + 0.5 * STEP, STEP)
