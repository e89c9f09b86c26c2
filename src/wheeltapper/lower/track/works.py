"""Powers of a ring under wheels that move along it: lost, stored, and missed (docs/theory/track.rst, section 13.7)."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.track.energy import RingEnergy, energy_of, form
from wheeltapper.lower.track.readouts import Places
from wheeltapper.lower.track.section import Section
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import real_times

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


class Pressed(NamedTuple):
    """A wheel on the ring at some times.

    Attributes
    ----------
    at
        Its place; bays count from the one from which amplitudes are seen.
    powers, changes
        Powers of ζ times the force, and the derivative of that over time, (times, POWERS).
    """

    at: Places
    powers: FloatArray
    changes: FloatArray


class RingState(NamedTuple):
    """A ring at some times.

    Attributes
    ----------
    held, rates
        Amplitudes and their derivatives, (times, modes).
    wheels
        On it.
    beside, beside_rates
        What drives the amplitudes other than the wheels, and its derivative; None where nothing does.
    """

    held: ComplexArray
    rates: ComplexArray
    wheels: list[Pressed]
    beside: ComplexArray | None = None
    beside_rates: ComplexArray | None = None


class RingPowers(NamedTuple):
    """Powers at some times, W, (times,) each.

    Attributes
    ----------
    lost
        What the dampers take.
    given
        The wheels' forces times the velocity of the rail, as the modes have it.
    beside
        What does the rest of what drives the modes.
    missed
        What `given`, `beside` and the wheels' forces on their own residual do that is neither lost nor stored.
    """

    lost: FloatArray
    given: FloatArray
    beside: FloatArray
    missed: FloatArray


def powers_of(energy: RingEnergy, known: Products, state: RingState) -> RingPowers:
    """Return the powers of a ring."""
    ring, forms, readings = energy.modes.ring, energy.forms, energy.readings
    columns = energy.columns(state.rates)
    lost = form(columns, forms.lost, columns)
    given, beside, missed = np.zeros((3, len(lost)))
    for wheel in state.wheels:
        seen = read(ring, [readings.rail, readings.rubbed, readings.missed], state.rates, wheel.at)
        given += _times(seen[:, 0], wheel.powers)
        lost += 2.0 * _times(seen[:, 1], wheel.changes)
        missed += _times(seen[:, 2], wheel.changes)
        for other in state.wheels:
            rubbed = known.of("damping", wheel.at, other.at, wheel.changes, other.changes)
            lost += rubbed
            missed -= rubbed
            if other is not wheel:  # a wheel does not see the residual of another one
                missed -= known.of("shown", wheel.at, other.at, wheel.powers, other.changes)
        if state.beside is not None:
            missed -= _times(read(ring, [readings.beside], state.beside, wheel.at)[:, 0], wheel.changes)
    if state.beside is not None and state.beside_rates is not None:
        beside += form(columns, forms.driven, energy.columns(state.beside))
        missed -= 2.0 * form(columns, forms.kinetic, energy.columns(state.beside_rates))
    return RingPowers(lost, given, beside, missed)


def stored_by(energy: RingEnergy, known: Products, state: RingState, residuals: FloatArray) -> FloatArray:
    """Return the energy of a ring, J, (times,).

    `residuals`, (wheels, times), are those under the wheels, m/N: in a point they are more than what elements of finite
    degree give way.
    """
    held, rates = energy.columns(state.held), energy.columns(state.rates)
    out = form(held, energy.forms.elastic, held) + form(rates, energy.forms.kinetic, rates)
    for wheel, residual in zip(state.wheels, residuals, strict=True):
        out += _times(read(energy.modes.ring, [energy.readings.stretched], state.held, wheel.at)[:, 0], wheel.powers)
        out += 0.5 * residual * wheel.powers[:, 0] ** 2
        out -= 0.5 * known.of("shown", wheel.at, wheel.at, wheel.powers, wheel.powers)
        for other in state.wheels:
            out += 0.5 * known.of("stiffness", wheel.at, other.at, wheel.powers, other.powers)
    return out


def _times(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("tp,tp->t", one, other))


class Products(dict[tuple[str, int, int, int], FloatArray]):
    """Products of the fields of two forces, kept by their elements and by how many bays the first lies ahead."""

    def __init__(self, energy: RingEnergy) -> None:
        super().__init__()
        self.energy = energy

    def __missing__(self, key: tuple[str, int, int, int]) -> FloatArray:
        kind, *where = key
        matrices = {"damping": self.energy.damping, "stiffness": self.energy.stiffness}
        found = self.energy.between(matrices[kind], *where) if kind in matrices else self.energy.shown(*where)
        self[key] = found
        return found

    def of(self, kind: str, here: Places, there: Places, left: FloatArray, right: FloatArray) -> FloatArray:
        """Return them for forces at places, by powers of ζ times what the fields are multiplied by, (times,)."""
        out = np.empty(len(left))
        for some, (one, other, ahead) in _alike(here.element, there.element, here.bay - there.bay):
            out[some] = _times(left[some] @ self[kind, one, other, ahead], right[some])
        return out


@lru_cache(maxsize=4)
def products_of(section: Section, bays: int, cutoff: float) -> Products:
    """Return the products of the ring that `energy_of` knows: all runs on it share them."""
    return Products(energy_of(section, bays, cutoff))


def _alike(*kinds: NDArray[np.int64]) -> list[tuple[NDArray[np.int64] | slice, list[int]]]:
    """Return which of some items are alike in all respects, and their respects."""
    rows, which = np.unique(np.stack(kinds, axis=1), axis=0, return_inverse=True)
    return [(_as_slice(np.flatnonzero(which.ravel() == number)), row) for number, row in enumerate(rows.tolist())]


def _as_slice(some: NDArray[np.int64]) -> NDArray[np.int64] | slice:
    """Return numbers that follow each other as a slice, for which nothing is copied."""
    return slice(some[0], some[-1] + 1) if some[-1] - some[0] == len(some) - 1 else some


def read(ring: Ring, readings: list[ComplexArray], values: ComplexArray, at: Places) -> FloatArray:
    """Return readings of amplitudes at places, by powers of ζ: (times, readings, powers)."""
    out = np.empty((len(values), len(readings), readings[0].shape[1]))
    for some, (element, ahead) in _alike(at.element, at.bay):
        rows = np.concatenate([reading[element] for reading in readings])
        if ahead:
            rows = rows * ring.turns**ahead
        out[some] = (values[some].view(float) @ rows.conj().view(float).T).reshape(-1, *out.shape[1:])
    return out


def driven(ring: Ring, at: Places, pressing: FloatArray) -> ComplexArray:
    """Return what forces at places, by powers of ζ, do to the amplitudes, (times, modes)."""
    out = np.empty((len(pressing), len(ring.rates)), dtype=complex)
    for some, (element, ahead) in _alike(at.element, at.bay):
        out[some] = real_times(pressing[some], ring.drive[element] * ring.turns**-ahead)
    return out


def by_zeta(ring: Ring, at: Places, count: int) -> tuple[FloatArray, FloatArray]:
    """Return powers of ζ at places, and their derivatives by x, (times, count)."""
    powers = at.zeta[:, None] ** np.arange(count)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = np.arange(1, count) * powers[:, :-1] * 2.0 / (ring.edges[1] - ring.edges[0])
    return powers, slopes
