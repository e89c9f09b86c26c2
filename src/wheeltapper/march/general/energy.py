"""The energy balance of a march: where the work of loads, of the path and of the motion along it goes.

The structure's energy is that of the kept modes. Their state z has the rate A·z + P·b·N under a contact's force N, P
the projector on the kept modes; so a force gives them the power N·(P·b)·E·z. With all modes that is the force times the
velocity of the rail at the contact. The local compliance r stores r·N²/2; r changes as the contact moves along.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.general import layout
from wheeltapper.march.general.basis import gauss_nodes
from wheeltapper.march.general.march import Found, Prepared, compliance_at, shapes_at
from wheeltapper.march.general.replay import Replayed, replay
from wheeltapper.march.general.structure import ComplexArray, Ring
from wheeltapper.march.program import FloatArray


class RingForms(NamedTuple):
    """Quadratic forms of a ring's amplitudes: Re[a*·hermitian·a + a·symmetric·a]/4 is the energy, J.

    Twice the same with `lost` and `lost_symmetric` is the power that the ring's dampers take, W.
    """

    hermitian: ComplexArray
    symmetric: ComplexArray
    lost: ComplexArray
    lost_symmetric: ComplexArray


class Balance(NamedTuple):
    """Energies in J at the end of an interval less those at its start, and what was exchanged in it.

    Attributes
    ----------
    track, local
        Energy of the kept modes, and of the local compliance.
    dissipated
        By the track's dampers.
    given
        To the modes by the contacts, N·(P·b)·E·z.
    local_given, local_changed
        To the local compliance by the contacts, and to the contacts by its change with the position.
    truncation
        Force times velocity of the rail at the contacts, by the kept modes' rates, less `given`.
    exchanged
        Energy that went from the contacts to the modes or back, either way.
    imbalance
        Of the modes: what was given, less what is stored and dissipated.
    """

    track: float
    local: float
    dissipated: float
    given: float
    local_given: float
    local_changed: float
    truncation: float
    exchanged: float
    imbalance: float


def _form(hermitian: ComplexArray, symmetric: ComplexArray, left: ComplexArray, right: ComplexArray) -> FloatArray:
    """Return Re[left*·hermitian·right + left·symmetric·right]/2 for rows of amplitudes."""
    return np.asarray(0.5 * np.real(np.sum(left.conj() * (right @ hermitian.T) + left * (right @ symmetric.T), axis=1)))


def track_energy(forms: RingForms, amplitudes: ComplexArray) -> FloatArray:
    """Return the energy of the kept modes at some times, J."""
    return 0.5 * _form(forms.hermitian, forms.symmetric, amplitudes, amplitudes)


def quadrature(found: Found, start: float, end: float, most: float = 0.25) -> tuple[FloatArray, FloatArray]:
    """Return times and weights that integrate what is smooth between events and changes of a path's piece, s.

    Near an event the nodes are those of its square root. `most` is the longest interval in macro steps.
    """
    prepared = found.prepared
    steps = np.arange(0, found.steps + 1) * prepared.grid.seconds
    rows = found.logs.rows
    columns = layout.ROW_FROM, layout.ROW_TO
    joints = [(rows[:, layout.ROW_STEP] + rows[:, column]) * prepared.grid.seconds for column in columns]
    edges = np.unique(np.concatenate([[start, end], steps, *joints, found.events[:, 0]]))
    edges = edges[(edges >= start) & (edges <= end)]
    edges = edges[np.concatenate([[True], np.diff(edges) > 1e-13])]
    longest = most * prepared.grid.seconds
    cuts = [
        np.linspace(a, b, max(2, int(np.ceil((b - a) / longest)) + 1))[:-1]
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]
    edges = np.append(np.concatenate(cuts), edges[-1])
    nodes = gauss_nodes(12)
    smooth = nodes.places**2 * (3.0 - 2.0 * nodes.places)
    weights = nodes.weights * 6.0 * nodes.places * (1.0 - nodes.places)
    lengths = np.diff(edges)
    return (edges[:-1, None] + lengths[:, None] * smooth).ravel(), (lengths[:, None] * weights).ravel()


def balance(found: Found, forms: RingForms, start: float, end: float) -> Balance:
    """Return the balance of the track over an interval of time, s; all contacts on one ring."""
    times, weights = quadrature(found, start, end)
    seen = replay(found, times, modes=True)
    ends = replay(found, np.array([start, end]), modes=True)
    amplitudes, at_ends = _amplitudes(seen), _amplitudes(ends)
    given = np.zeros(len(times))
    velocity_power, local_changed, local = given.copy(), given.copy(), np.zeros(2)
    for i in range(seen.force.shape[1]):
        N = seen.force[:, i]
        shows, takes, _, slope = _at_contact(found.prepared, seen, i)
        given += N * _form(forms.hermitian, forms.symmetric, takes, amplitudes)
        ring = _ring(found.prepared)
        velocity_power += N * np.real((shows * amplitudes) @ (ring.weights * ring.rates))
        local_changed += 0.5 * slope * found.prepared.system.speed * N * N
        local += 0.5 * _at_contact(found.prepared, ends, i)[2] * ends.force[:, i] ** 2
    stored = np.diff(track_energy(forms, at_ends))[0]
    lost = weights @ _form(forms.lost, forms.lost_symmetric, amplitudes, amplitudes)
    got = weights @ given
    return Balance(
        float(stored), float(local[1] - local[0]), float(lost), float(got),
        float(local[1] - local[0] + weights @ local_changed), float(weights @ local_changed),
        float(weights @ velocity_power - got), float(weights @ np.abs(given)), float(got - stored - lost),
    )  # fmt: skip


def _ring(prepared: Prepared) -> Ring:
    """Return the ring that a system must have."""
    ring = prepared.system.ring
    if ring is None:
        raise ValueError("a rigid rail has no energy")
    return ring


def _amplitudes(seen: Replayed) -> ComplexArray:
    """Return the amplitudes, which were asked for."""
    assert seen.amplitudes is not None
    return seen.amplitudes


def _at_contact(
    prepared: Prepared, seen: Replayed, i: int
) -> tuple[ComplexArray, ComplexArray, FloatArray, FloatArray]:
    """Return shapes, what drives them, local compliance and its slope under a contact, as seen from the first bay."""
    ring, contacts = _ring(prepared), prepared.system.contacts
    x = seen.place + contacts[i].position - contacts[0].position
    bay = np.floor(x / ring.spacing)
    inside = x - bay * ring.spacing
    turn = np.exp(1j * np.multiply.outer(bay, np.angle(ring.turns)))
    h = 1e-6 * ring.spacing
    low, high = np.maximum(inside - h, 0.0), np.minimum(inside + h, ring.spacing)
    slope = (compliance_at(ring, high) - compliance_at(ring, low)) / (high - low)
    return (
        shapes_at(ring, ring.deflection, inside) * turn, shapes_at(ring, ring.drive, inside) / turn,
        compliance_at(ring, inside), slope,
    )  # fmt: skip
