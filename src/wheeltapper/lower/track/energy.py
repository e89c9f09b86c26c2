"""Energy of a ring: what deflection and velocity store, and what is lost (docs/theory/track.rst, section 13.7).

Under forces N at places x of the rail the ring's deflection is u = Σ c·Re[φ·a] + Σ R(x)·N, with the field R of what the
modes beyond the cut-off add at rest. Its velocity is p = Σ c·Re[φ·a'] and (R·N)'; at rest there is none. Stored is
½·u·K·u + ½·p·M·p, lost u'·C·u'. Both are exact sums over the wavenumbers, of small matrices each.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.track import bay
from wheeltapper.lower.track.ring import TrackModes, ring_of
from wheeltapper.lower.track.section import Section

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
POWERS = bay.DEGREE + 1
"""Of ζ, in which shapes and fields of an element are polynomials."""


class Forms(NamedTuple):
    """Hermitian and other forms of the amplitudes, by wavenumber: (wavenumbers, most, most) each.

    With the column b of the amplitudes of k and the conjugate ones of -k, that of two states is Re[b^H·form·b].

    Attributes
    ----------
    elastic, kinetic
        ½·u·K·u of deflections, ½·p·M·p of amplitudes' rates.
    lost
        p·C·p of rates.
    driven
        What a drive of the amplitudes does to rates, p·(M·λ + C)·φ: its force is what moves the modes so.
    """

    elastic: ComplexArray
    kinetic: ComplexArray
    lost: ComplexArray
    driven: ComplexArray


class Readings(NamedTuple):
    """Sums over the amplitudes that are polynomials of the place of a force, (elements, POWERS, modes) each.

    Re Σ reading·amplitudes, contracted with powers of ζ times N it has that of R·N, with their rates that of (R·N)'.

    Attributes
    ----------
    rail
        The rail's deflection at the place, by the modes.
    stretched
        R·K·u of amplitudes.
    rubbed
        R·C·p of rates.
    missed
        (R·N)'·(M·p̂ - C·p) - p·M·φ·(Ψ·N)' of rates, where p̂ are the rates of λ·rates.
    beside
        R·(M·λ + C)·φ of drives.
    """

    rail: ComplexArray
    stretched: ComplexArray
    rubbed: ComplexArray
    missed: ComplexArray
    beside: ComplexArray


class RingEnergy(NamedTuple):
    """What is needed for the energy of a ring.

    Attributes
    ----------
    modes
        The ring's.
    numbers, mirrored
        Of the amplitudes of each wavenumber, (wavenumbers, most); and which of them are conjugate there. Where there
        are fewer, forms have zeros.
    forms, readings
        See there.
    fields
        R at the nodes of a bay, for unit powers of ζ in the bay of the force: (wavenumbers, nodes, elements, POWERS).
    phases, shares
        k·a, and what a product of two columns counts in the ring, (wavenumbers,).
    damping, stiffness
        Of a bay, (nodes, nodes).
    """

    modes: TrackModes
    numbers: IntArray
    mirrored: NDArray[np.bool_]
    forms: Forms
    readings: Readings
    fields: ComplexArray
    phases: FloatArray
    shares: FloatArray
    damping: FloatArray
    stiffness: FloatArray

    def columns(self, amplitudes: ComplexArray) -> ComplexArray:
        """Return what the forms act on, (wavenumbers, times, most), of amplitudes (times, modes)."""
        found = amplitudes.T[self.numbers.ravel()].reshape(*self.numbers.shape, -1)
        found[self.mirrored] = found[self.mirrored].conj()
        return np.ascontiguousarray(found.swapaxes(1, 2))

    def between(self, matrix: FloatArray, here: int, there: int, ahead: int) -> FloatArray:
        """Return R·matrix·R of forces in two elements, by powers of both ζ; the first lies some bays ahead."""
        turned = self.shares * np.exp(1j * self.phases * ahead)
        one, other = self.fields[:, :, here], self.fields[:, :, there]
        return np.asarray(np.einsum("k,kip,ij,kjq->pq", turned, one.conj(), matrix, other, optimize=True).real)

    def shown(self, here: int, there: int, ahead: int) -> FloatArray:
        """Return R at the places of a first element, of forces in a second one, by powers of both ζ."""
        ring = self.modes.ring
        nodes = slice(here * bay.DEGREE, here * bay.DEGREE + POWERS)
        turned = self.shares / ring.bays * np.exp(1j * self.phases * ahead)
        seen = np.einsum("k,knq->nq", turned, self.fields[:, nodes, there]).real
        return np.asarray(bay.powers_of_nodes() @ seen)


def form(left: ComplexArray, matrix: ComplexArray, right: ComplexArray) -> FloatArray:
    """Return Re[left^H·matrix·right] summed over the wavenumbers, (times,), of columns."""
    product = right @ matrix.swapaxes(1, 2)
    return np.asarray(np.einsum("kti,kti->t", left.view(float), product.view(float)))


@lru_cache(maxsize=4)
def energy_of(section: Section, bays: int, cutoff: float) -> RingEnergy:
    """Return the energy of `ring_of` for the same ring."""
    modes = ring_of(section, bays, cutoff)
    ring, wavenumbers = modes.ring, np.arange(bays // 2 + 1)
    alone = 2 * wavenumbers % bays == 0  # k and -k are the same
    numbers, mirrored, kept = _members(modes, wavenumbers, alone)
    shares = np.where(alone, 1.0, 2.0) * bays
    phases = 2.0 * np.pi * wavenumbers / bays
    places = _seen(np.moveaxis(0.5 * ring.weights * _node_values(modes), 1, 0)[numbers], mirrored) * kept[:, :, None]
    places = places.swapaxes(1, 2)  # (wavenumbers, nodes, most)
    rates = np.where(kept, _seen(ring.rates[numbers], mirrored), 1.0)
    drives = _seen(np.moveaxis(ring.drive, 2, 0)[numbers], mirrored)
    mass, damping, stiffness = _bay_matrices(section, len(ring.edges) - 1)
    fields = _static_fields(section, modes, phases)
    fields += np.einsum(
        "kim,kmep->kiep", places, drives / rates[:, :, None, None], optimize=True
    )  # those kept, at rest
    weighed, rubbed, stretched = (
        shares[:, None, None] * places.conj().swapaxes(1, 2) @ one for one in (mass, damping, stiffness)
    )
    inertia = weighed @ places
    forms = Forms(
        0.5 * stretched @ places, 0.5 * inertia, rubbed @ places, (inertia * rates[:, None]) + rubbed @ places
    )

    def reading(values: ComplexArray) -> ComplexArray:
        """Return as sums over the amplitudes what is a product with their columns, (wavenumbers, most, elements, p)."""
        out = np.zeros((len(ring.rates), *values.shape[2:]), dtype=complex)
        np.add.at(out, numbers, _seen(values.conj(), mirrored))
        return np.ascontiguousarray(np.moveaxis(out, 0, 2))

    by_mass, by_damping, by_stiffness = (
        reading(np.einsum("kmi,kiep->kmep", one, fields, optimize=True)) for one in (weighed, rubbed, stretched)
    )
    moved = reading(np.einsum("kmn,knep->kmep", inertia, drives, optimize=True))
    readings = Readings(
        ring.weights * ring.deflection, by_stiffness, by_damping, by_mass * ring.rates - by_damping - moved,
        by_mass * ring.rates + by_damping,
    )  # fmt: skip
    return RingEnergy(modes, numbers, mirrored, forms, readings, fields, phases, shares, damping, stiffness)


def _members(
    modes: TrackModes, wavenumbers: IntArray, alone: NDArray[np.bool_]
) -> tuple[IntArray, NDArray[np.bool_], NDArray[np.bool_]]:  # fmt: skip
    """Return the numbers of the modes of k and -k, which are those of -k, and which there are: (wavenumbers, most)."""
    bays = modes.ring.bays
    of = np.rint(np.angle(modes.ring.turns) * bays / (2.0 * np.pi)).astype(np.int64)
    of[2 * of == -bays] *= -1
    both = [
        (np.flatnonzero(of == k), np.flatnonzero(of == (k if own else -k)))
        for k, own in zip(wavenumbers, alone, strict=True)
    ]
    most = max(1, *(len(one) + len(other) for one, other in both))
    numbers = np.zeros((len(both), most), dtype=np.int64)
    mirrored, kept = np.zeros((2, len(both), most), dtype=bool)
    for k, (one, other) in enumerate(both):
        count = len(one) + len(other)
        numbers[k, :count] = np.concatenate([one, other])
        mirrored[k, len(one) : count] = True
        kept[k, :count] = True
    return numbers, mirrored, kept


def _seen(values: ComplexArray, mirrored: NDArray[np.bool_]) -> ComplexArray:
    """Return values (wavenumbers, most, ...), conjugate where they are mirrored."""
    where = mirrored.reshape(*mirrored.shape, *(1 for _ in values.shape[2:]))
    return np.where(where, values.conj(), values)


def _static_fields(section: Section, modes: TrackModes, phases: FloatArray) -> ComplexArray:
    """Return the ring at rest under unit powers of ζ, as `RingEnergy.fields`, with all its modes."""
    ring = modes.ring
    elements = len(ring.edges) - 1
    held = bay.matrices(section, elements, phases)
    nodes = elements * bay.DEGREE + 1
    loads = np.zeros((nodes, elements, POWERS))
    for element in range(elements):
        loads[element * bay.DEGREE : element * bay.DEGREE + POWERS, element] = bay.powers_of_nodes().T
    driven = held.shapes[:, :nodes].conj().swapaxes(1, 2) @ loads.reshape(nodes, -1)
    found = held.shapes @ np.linalg.solve(held.stiffness, driven) / ring.bays
    return np.asarray(found.reshape(*found.shape[:2], elements, POWERS))


def _node_values(modes: TrackModes) -> ComplexArray:
    """Return deflections and rotations of a bay's nodes, and the sleeper's deflection: (2·nodes + 1, modes)."""
    places = bay.node_places()
    powers = places[:, None] ** np.arange(len(places))
    found = []
    for shapes in (modes.ring.deflection, modes.rotation):
        each = powers @ shapes
        found += [*each[:, :-1].reshape(-1, shapes.shape[-1]), each[-1, -1]]
    return np.stack([*found, modes.sleeper])


def _bay_matrices(section: Section, elements: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mass, damping and stiffness of a bay, its rail with free ends, for the values of `_node_values`."""
    rail_mass, rail_stiffness = bay.rail_matrices(section, elements)
    mass, stiffness = (np.pad(one, (0, 1)) for one in (rail_mass, rail_stiffness))
    damping = section.loss * stiffness
    pair = np.ix_([0, -1], [0, -1])
    pad = np.array([[1.0, -1.0], [-1.0, 1.0]]) if section.sleeper > 0.0 else np.diag([1.0, 0.0])
    for matrix, of_pad, of_ballast in (
        (stiffness, section.pad, section.ballast),
        (damping, section.pad_damping, section.ballast_damping),
    ):
        matrix[pair] += of_pad * pad
        matrix[-1, -1] += of_ballast
    mass[-1, -1] += section.sleeper
    return mass, damping, stiffness
