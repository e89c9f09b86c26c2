"""The energy of a ring's modes, and what dampers take, as quadratic forms of the amplitudes.

The kept state is z = Σ_n weights_n Re[X_n a_n], X_n = (shape, λ_n·shape); its energy is z·E·z/2 with the stiffness for
shapes and the mass for rates. Over a whole ring modes of different wavenumbers have no energy in common: only products
of a mode with the conjugate of one of the same wavenumber, and with one of the opposite wavenumber, remain.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.track.section import Section
from wheeltapper.march.general.energy import RingForms

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


def ring_forms(section: Section, modes: TrackModes) -> RingForms:
    """Return the forms of energy and of dissipated power of a ring."""
    ring = modes.ring
    elastic, inert = _fields(section, modes)
    taken, taken_at = _damped(section, modes)
    same = np.abs(ring.turns[:, None] - ring.turns) < 1e-9
    opposite = np.abs(ring.turns[:, None].conj() - ring.turns) < 1e-9
    rates = np.array(ring.rates)

    def forms(left: ComplexArray, rate: bool) -> tuple[ComplexArray, ComplexArray]:
        values = left * rates if rate else left
        weighted = values * ring.weights
        return (
            ring.bays * np.where(same, weighted.conj().T @ weighted, 0.0),
            ring.bays * np.where(opposite, weighted.T @ weighted, 0.0),
        )

    stiff, mass = forms(elastic, False), forms(inert, True)
    lost, lost_at = forms(taken, True), forms(taken_at, True)
    return RingForms(stiff[0] + mass[0], stiff[1] + mass[1], lost[0] + lost_at[0], lost[1] + lost_at[1])


def _fields(section: Section, modes: TrackModes) -> tuple[ComplexArray, ComplexArray]:
    """Return square roots of elastic and kinetic energy (twice it, over one bay): rows whose squares add up to it."""
    rail, rail_mass = _rail_rows(section, modes)
    seat = modes.ring.deflection[0].T @ (-1.0) ** np.arange(modes.ring.deflection.shape[1])
    elastic = [*rail, np.sqrt(section.pad) * (seat - modes.sleeper), np.sqrt(section.ballast) * modes.sleeper]
    return np.array(elastic), np.array([*rail_mass, np.sqrt(section.sleeper) * modes.sleeper])


def _damped(section: Section, modes: TrackModes) -> tuple[ComplexArray, ComplexArray]:
    """Return the same of the power that dampers take, of the rail and at the seats."""
    rail, _ = _rail_rows(section, modes)
    seat = modes.ring.deflection[0].T @ (-1.0) ** np.arange(modes.ring.deflection.shape[1])
    at = [np.sqrt(section.pad_damping) * (seat - modes.sleeper), np.sqrt(section.ballast_damping) * modes.sleeper]
    return np.sqrt(section.loss) * rail, np.array(at)


def _rail_rows(section: Section, modes: TrackModes) -> tuple[ComplexArray, ComplexArray]:
    """Return the rail's part of these rows, by Gauss's quadrature of the shapes' polynomials."""
    ring = modes.ring
    degree = ring.deflection.shape[1] - 1
    zeta, weights = legendre.leggauss(degree + 1)
    powers = zeta[:, None] ** np.arange(degree + 1)
    slopes = np.arange(degree + 1) * zeta[:, None] ** np.maximum(np.arange(degree + 1) - 1, 0)
    elastic, mass = [], []
    for number, length in enumerate(np.diff(ring.edges)):
        root = np.sqrt(0.5 * length * weights)[:, None]
        w, theta = powers @ ring.deflection[number], powers @ modes.rotation[number]
        w_x = slopes @ ring.deflection[number] * (2.0 / length)
        theta_x = slopes @ modes.rotation[number] * (2.0 / length)
        elastic += [np.sqrt(section.bending) * root * theta_x, np.sqrt(section.shear) * root * (w_x - theta)]
        mass += [np.sqrt(section.mass) * root * w, np.sqrt(section.rotary) * root * theta]
    return np.vstack(elastic), np.vstack(mass)
