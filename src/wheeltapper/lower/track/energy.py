"""Energy of a ring's kept modes: what they store, lose, and take from forces (docs/theory/track.rst, section 13.7).

The kept modes are a linear system of their own, s' = A·s + P·b·N, with the projector P on them and the answer b of the
whole ring to a unit force. With the energy ½·sᵀE·s of the whole ring, their energy rises by N·bᵀPᵀE·s and falls by what
the dampers take, exactly.
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


class Group(NamedTuple):
    """Modes that share a wavenumber, up to its sign, and what they store and lose together.

    With the column b of the amplitudes of `forwards` and the conjugate ones of `backwards` the energy is b^H·stored·b,
    J, and the loss b^H·lost·b, W. Different wavenumbers have no energy together.

    Attributes
    ----------
    forwards, backwards
        Numbers of the modes of the wavenumber k and of -k.
    stored, lost
        Hermitian.
    """

    forwards: IntArray
    backwards: IntArray
    stored: ComplexArray
    lost: ComplexArray

    def column(self, amplitudes: ComplexArray) -> ComplexArray:
        """Return what the matrices act on, (times, modes of the group), of amplitudes (times, modes)."""
        return np.concatenate([amplitudes[:, self.forwards], amplitudes[:, self.backwards].conj()], axis=1)


@lru_cache(maxsize=4)
def energy_groups(section: Section, bays: int, cutoff: float) -> tuple[Group, ...]:
    """Return the groups of the modes of `ring_of` for the same ring."""
    modes = ring_of(section, bays, cutoff)
    ring = modes.ring
    number = np.rint(np.angle(ring.turns) * ring.bays / (2.0 * np.pi)).astype(np.int64)
    number[2 * number == -ring.bays] *= -1  # k and -k are the same there
    nodes = _node_values(modes) * (0.5 * ring.weights)
    mass, damping, stiffness = _bay_matrices(section, len(ring.edges) - 1)
    found = []
    for one in np.unique(np.abs(number)):
        own_mirror = 2 * one in (0, ring.bays)
        forwards = np.flatnonzero(number == one)
        backwards = forwards if own_mirror else np.flatnonzero(number == -one)
        places = np.concatenate([nodes[:, forwards], nodes[:, backwards].conj()], axis=1)
        speeds = places * np.concatenate([ring.rates[forwards], ring.rates[backwards].conj()])
        share = 0.5 * ring.bays if own_mirror else float(ring.bays)
        stored = places.conj().T @ stiffness @ places + speeds.conj().T @ mass @ speeds
        found.append(Group(forwards, backwards, share * stored, 2.0 * share * (speeds.conj().T @ damping @ speeds)))
    return tuple(found)


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


def stored_energy(groups: tuple[Group, ...], amplitudes: ComplexArray) -> FloatArray:
    """Return the energy of the kept modes, J, of amplitudes (times, modes)."""
    return _sum_of_forms([(group.column(amplitudes), group.stored, group.column(amplitudes)) for group in groups])


def lost_power(groups: tuple[Group, ...], amplitudes: ComplexArray) -> FloatArray:
    """Return what the dampers of rail, pads and ballast take, W, of amplitudes (times, modes)."""
    return _sum_of_forms([(group.column(amplitudes), group.lost, group.column(amplitudes)) for group in groups])


def received_power(groups: tuple[Group, ...], amplitudes: ComplexArray, forced: ComplexArray) -> FloatArray:
    """Return what the kept modes take from forces, W; `forced` is Ψ·N, (times, modes), as amplitudes are seen."""
    return 2.0 * _sum_of_forms([(group.column(amplitudes), group.stored, group.column(forced)) for group in groups])


def _sum_of_forms(forms: list[tuple[ComplexArray, ComplexArray, ComplexArray]]) -> FloatArray:
    """Return the real part of Σ a^H·M·b over all groups."""
    return np.asarray(sum(np.einsum("ti,ti->t", left.conj(), right @ matrix.T).real for left, matrix, right in forms))
