"""A ring of bays in complex modes, and the local compliance that the modes beyond the cut-off leave.

Theory: docs/theory/track.rst, section 13.4.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wheeltapper.lower.track import bay, waves
from wheeltapper.lower.track.section import Section
from wheeltapper.march.general.structure import Ring

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

RESIDUAL_DEGREE = 14
UNIT_RATE = 1e4
"""1/s; rates are divided by it, so that positions and velocities are of one size in the eigenproblem."""
REAL = 1e-10
"""A rate is real where its imaginary part is smaller than this share of it."""


class TrackModes(NamedTuple):
    """A ring, and what else its modes move.

    Attributes
    ----------
    ring
        As the march takes it.
    rotation
        Of the rail's cross-section, as `ring.deflection`: (elements, degree + 1, modes), 1/m per unit of amplitude.
    sleeper, sleeper_drive
        Deflection of the sleeper at the beginning of the bay, as `ring.deflection`, and what a force on it does, as
        `ring.drive`, (modes,); zero where there is none.
    cutoff
        f_cut, Hz: no kept rate is larger than 2π times it.
    """

    ring: Ring
    rotation: ComplexArray
    sleeper: ComplexArray
    sleeper_drive: ComplexArray
    cutoff: float


class _Modes(NamedTuple):
    """Kept modes of all wavenumbers: nodes' values and what a force at a node does, (2·NODES + 1, modes) each."""

    rates: ComplexArray
    turns: ComplexArray
    weights: FloatArray
    values: ComplexArray
    driven: ComplexArray


@lru_cache(maxsize=16)
def ring_of(section: Section, bays: int, cutoff: float) -> TrackModes:
    """Return the ring of some bays with all modes up to a frequency, Hz."""
    elements = bay.element_count(section, cutoff)
    modes = _modes(section, elements, bays, 2.0 * np.pi * cutoff)
    nodes = len(modes.values) // 2
    edges = np.linspace(0.0, section.spacing, elements + 1)
    deflection, rotation = (_by_powers(modes.values[rows]) for rows in (slice(nodes), slice(nodes, 2 * nodes)))
    drive = _by_powers(modes.driven[:nodes])
    residual = _residual(section, edges, -modes.weights / modes.rates, deflection, drive)
    ring = Ring(
        modes.rates, modes.turns, modes.weights, edges, deflection, drive, residual, section.spacing, bays
    )  # fmt: skip
    return TrackModes(ring, rotation, modes.values[-1], modes.driven[-1], cutoff)


def _modes(section: Section, elements: int, bays: int, most: float) -> _Modes:
    """Return the modes of half of the wavenumbers, 0 to π/a, and those that they imply of the other half."""
    numbers = np.arange(bays // 2 + 1)
    phases = 2.0 * np.pi * numbers / bays
    held = bay.matrices(section, elements, phases)
    down = np.linalg.inv(np.linalg.cholesky(held.mass))  # well conditioned: the mass of a few dozen nodes
    rates, right, left = _eigenvectors(down, held)
    size = np.sqrt(section.mass * section.spacing)  # of a mode: as if the rail alone moved by one
    found = []
    for i, number in enumerate(numbers):
        one = _kept(rates[i], right[i], left[i], most)
        unknowns = down[i].T @ (one.values * size)
        driven = down[i].T @ (one.driven / (size * bays))
        real, own_mirror = one.rates.imag == 0.0, number in (0, bays / 2)  # there k and -k are the same
        turns = np.full(len(real), np.exp(1j * phases[i]))
        weights = np.where(real & own_mirror, 1.0, 2.0)
        shapes = held.shapes[i]
        found.append(_Modes(one.rates, turns, weights, shapes @ unknowns, shapes.conj() @ driven))
        again = ~real & (not own_mirror)  # of -k; where a rate is real, its conjugate serves both k and -k
        found.append(
            _Modes(
                one.rates[again], turns[again].conj(), weights[again], shapes.conj() @ unknowns[:, again],
                shapes @ driven[:, again],
            )
        )  # fmt: skip
    return _Modes(*(np.concatenate(columns, axis=-1) for columns in zip(*found, strict=True)))


def _eigenvectors(down: FloatArray, held: bay.Bay) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return rates, 1/s, positions of the right and velocities of the left vectors, for unknowns of unit mass.

    Right vectors are columns, left ones rows; they are biorthonormal also where rates coincide.
    """
    stiffness, damping = (down @ one @ down.swapaxes(1, 2) for one in (held.stiffness, held.damping))
    count = stiffness.shape[1]
    system = np.zeros((len(stiffness), 2 * count, 2 * count))
    system[:, :count, count:] = np.eye(count)
    system[:, count:, :count] = -stiffness / UNIT_RATE**2
    system[:, count:, count:] = -damping / UNIT_RATE
    rates, right = np.linalg.eig(system)
    left = np.linalg.inv(right)
    found = UNIT_RATE * rates, right[:, :count], left[:, :, count:] / UNIT_RATE
    rates, right, left = (one.astype(complex) for one in found)  # they are real where all rates are
    return rates, right, left


def _kept(rates: ComplexArray, right: ComplexArray, left: ComplexArray, most: float) -> _Modes:
    """Return the modes of one wavenumber below a rate, of each conjugate pair one, by rising rates."""
    real = np.abs(rates.imag) <= REAL * np.abs(rates)
    kept = np.flatnonzero((np.abs(rates) < most) & (real | (rates.imag > 0.0)))
    kept = kept[np.argsort(np.abs(rates[kept]))]
    lengths = np.linalg.norm(right[:, kept], axis=0)
    found = np.where(real[kept], rates[kept].real, rates[kept])
    return _Modes(found, found, lengths, right[:, kept] / lengths, left[kept].T * lengths)


def _by_powers(nodes: ComplexArray) -> ComplexArray:
    """Return nodes' values, (nodes, modes), as polynomials of each element, (elements, degree + 1, modes)."""
    starts = range(0, len(nodes) - 1, bay.DEGREE)
    return np.stack([bay.powers_of_nodes() @ nodes[start : start + bay.DEGREE + 1] for start in starts])


def _residual(
    section: Section, edges: FloatArray, statics: ComplexArray, deflection: ComplexArray, drive: ComplexArray
) -> FloatArray:
    """Return the static compliance at a point that the modes leave to be added, by powers: (elements, 15).

    `statics` is the static amplitude of each mode under a unit drive, times its weight.
    """
    places = chebyshev.chebpts1(RESIDUAL_DEGREE + 1)
    x = 0.5 * (edges[:-1, None] + edges[1:, None] + places * np.diff(edges)[:, None])
    powers = places[:, None] ** np.arange(bay.DEGREE + 1)
    there = (powers @ deflection) * (powers @ drive)
    missing = waves.response(section, 0.0, x, x)[..., 0].real - np.real(there @ statics)
    return np.asarray(np.linalg.solve(places[:, None] ** np.arange(RESIDUAL_DEGREE + 1), missing[..., None])[..., 0])
