"""One bay in spectral elements: its matrices at any Bloch wavenumber, real and symmetric.

The rail's deflection w and rotation θ are polynomials in each element, held at the points of Gauss and Lobatto. At the
wavenumber k the state of a bay is e^{ika} times that of the bay before, which ties its last node to its first: with two
elements 32 unknowns of the rail, and one of the sleeper. The track looks the same from both ends; therefore unknowns
can be chosen for which all matrices are real (docs/theory/track.rst, section 13.3).
"""

from __future__ import annotations

from functools import cache
from math import ceil, hypot, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wheeltapper.lower.track.section import Section

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

DEGREE = 8
FEWEST_ELEMENTS = 2
WAVES = 1.35
"""Most wavelengths in an element, at the cut-off: so the residual, of degree 14, is met to 1e-6 of the compliance."""


class Bay(NamedTuple):
    """Matrices at some wavenumbers.

    Attributes
    ----------
    mass, damping, stiffness
        (wavenumbers, unknowns, unknowns).
    shapes
        From the unknowns to the nodes' deflections, then rotations, then the sleeper:
        (wavenumbers, 2·nodes + 1, unknowns); without a sleeper its row is zero. The last node of a bay is the first
        one of the next.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    shapes: ComplexArray


@cache
def node_places() -> FloatArray:
    """Return the points of Gauss and Lobatto of one element, from -1 to 1."""
    inner = legendre.Legendre.basis(DEGREE).deriv().roots()
    return np.concatenate([[-1.0], np.sort(np.real(inner)), [1.0]])


@cache
def powers_of_nodes() -> FloatArray:
    """Return the polynomials that are 1 at one node and 0 at the others: (powers, nodes), by rising powers."""
    return np.asarray(np.linalg.inv(np.vander(node_places(), increasing=True)))


def element_count(section: Section, cutoff: float) -> int:
    """Return how many elements a bay needs for waves up to a frequency, Hz."""
    omega = 2.0 * pi * cutoff
    shear = omega * sqrt(section.mass / section.shear)
    bending = sqrt(omega * sqrt(section.mass / section.bending))
    wavelengths = section.spacing * hypot(shear, bending) / (2.0 * pi)  # at least as many as of a Timoshenko beam
    return max(FEWEST_ELEMENTS, ceil(wavelengths / WAVES))


@cache
def _element_integrals() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return ∫ φφ, ∫ φ'φ and ∫ φ'φ' dζ over an element, each (nodes, nodes)."""
    places, weights = legendre.leggauss(DEGREE + 1)
    powers = np.arange(DEGREE + 1)
    values = places[:, None] ** powers @ powers_of_nodes()
    slopes = powers * places[:, None] ** np.maximum(powers - 1, 0) @ powers_of_nodes()
    return (
        values.T @ (weights[:, None] * values),
        slopes.T @ (weights[:, None] * values),
        slopes.T @ (weights[:, None] * slopes),
    )


def rail_matrices(section: Section, elements: int) -> tuple[FloatArray, FloatArray]:
    """Return mass and stiffness of the rail of one bay with both ends free; deflections first, then rotations."""
    half, nodes = 0.5 * section.spacing / elements, elements * DEGREE + 1
    both, slope, slopes = _element_integrals()
    mass, stiffness = np.zeros((2, 2 * nodes, 2 * nodes))
    for element in range(elements):
        w = slice(element * DEGREE, element * DEGREE + DEGREE + 1)
        t = slice(nodes + w.start, nodes + w.stop)
        mass[w, w] += section.mass * half * both
        mass[t, t] += section.rotary * half * both
        stiffness[w, w] += section.shear / half * slopes
        stiffness[w, t] -= section.shear * slope
        stiffness[t, w] -= section.shear * slope.T
        stiffness[t, t] += section.shear * half * both + section.bending / half * slopes
    return mass, stiffness


def _mirrored_basis(free: int, sign: float) -> ComplexArray:
    """Return a basis of the values at `free` + 1 nodes in which a motion that equals its own mirror image is real.

    With the phase e^{ikx} taken off, the mirror image at a seat has at node j the conjugate value of node `free` - j,
    for rotations with the opposite `sign`.
    """
    basis = np.zeros((free + 1, free), dtype=complex)
    root = np.sqrt(0.5)
    for j in (0, free // 2):
        basis[j, j] = 1.0 if sign > 0 else 1j
    for j in range(1, free // 2):
        basis[j, [j, free - j]] = root, 1j * root
        basis[free - j, [j, free - j]] = sign * root, -sign * 1j * root
    basis[free] = basis[0]
    return basis


def _shapes(elements: int, turns: FloatArray, sleeper: bool) -> ComplexArray:
    """Return the map from the unknowns to the nodes' values, as in `Bay`."""
    free = elements * DEGREE
    places = np.add.outer(np.arange(elements), 0.5 * (node_places()[:-1] + 1.0)).ravel() / elements
    phase = np.exp(1j * np.multiply.outer(turns, np.append(places, 1.0)))[:, :, None]
    shapes = np.zeros((len(turns), 2 * free + 3, 2 * free + sleeper), dtype=complex)
    shapes[:, : free + 1, :free] = phase * _mirrored_basis(free, 1.0)
    shapes[:, free + 1 : -1, free : 2 * free] = phase * _mirrored_basis(free, -1.0)
    if sleeper:
        shapes[:, -1, -1] = 1.0
    return shapes


def matrices(section: Section, elements: int, turns: FloatArray) -> Bay:
    """Return the matrices of a bay at wavenumbers, given as the phase k·a over one bay, (wavenumbers,)."""
    sleeper = section.sleeper > 0.0
    shapes = _shapes(elements, turns, sleeper)
    rail = shapes[:, :-1]
    mass, stiffness = (np.real(rail.conj().swapaxes(1, 2) @ one @ rail) for one in rail_matrices(section, elements))
    damping = section.loss * stiffness
    for matrix, pad, ballast in (
        (stiffness, section.pad, section.ballast),
        (damping, section.pad_damping, section.ballast_damping),
    ):
        matrix[:, 0, 0] += pad
        if sleeper:
            matrix[:, -1, 0] -= pad
            matrix[:, 0, -1] -= pad
            matrix[:, -1, -1] += pad + ballast
    if sleeper:
        mass[:, -1, -1] += section.sleeper
    return Bay(mass, damping, stiffness, shapes)
