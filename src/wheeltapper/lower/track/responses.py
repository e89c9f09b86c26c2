"""Exact responses of the infinite track with some seats that differ (docs/theory/track.rst, section 13.10).

What differs at a seat acts as a force on an otherwise regular track: that of the additional pad, between rail and
sleeper, and that of the additional ballast, on the sleeper. The forces follow from the deflections that they meet.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.track import waves
from wheeltapper.lower.track.section import Section

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
PAD, BALLAST = 0, 1


class Extra(NamedTuple):
    """What a seat has beyond the others: a spring and a damper, negative where it has less.

    Attributes
    ----------
    seat
        Its number.
    kind
        PAD or BALLAST.
    stiffness, damping
        N/m and N·s/m.
    """

    seat: int
    kind: int
    stiffness: float
    damping: float


def shares(section: Section, extras: tuple[Extra, ...], omega: Any = 0.0) -> tuple[Any, Any]:
    """Return what of a unit force of each extra comes to the rail, (..., extras), and how a seat gives by itself, m/N.

    By reciprocity the share is also what an extra feels of a unit deflection of the rail at its seat.
    """
    omega = np.asarray(omega)[..., None]
    pad = section.pad + 1j * omega * section.pad_damping
    below = section.ballast + 1j * omega * section.ballast_damping - section.sleeper * omega**2
    kinds = np.array([extra.kind for extra in extras], dtype=int)
    if section.sleeper == 0.0:
        return np.ones((*omega.shape[:-1], len(extras))) + 0j, 0.0 * pad
    return np.where(kinds == PAD, below, pad) / (pad + below), 1.0 / (pad + below)


def between(section: Section, extras: tuple[Extra, ...], omega: Any, period: float = np.inf) -> ComplexArray:
    """Return what each extra feels of a unit force of each other, (..., extras, extras), m/N."""
    omega = np.asarray(omega, dtype=float)
    seats = np.array([extra.seat for extra in extras])
    kinds = np.array([extra.kind for extra in extras], dtype=int)
    ahead = nearest(np.subtract.outer(seats, seats) * section.spacing, period)
    apart, number = np.unique(np.abs(ahead).round(9), return_inverse=True)
    rail = waves.response(section, omega[..., None], 0.0, apart)[..., 0][..., number.reshape(ahead.shape)]
    share, own = shares(section, extras, omega)
    sign = np.where(np.equal.outer(kinds, kinds), 1.0, -1.0) * np.equal.outer(seats, seats)
    return np.asarray(share[..., :, None] * rail * share[..., None, :] + own[..., None] * sign)


def nearest(ahead: Any, period: float) -> Any:
    """Return distances to the nearest image on a ring."""
    return ahead - period * np.round(ahead / period) if np.isfinite(period) else ahead


def stiffnesses(extras: tuple[Extra, ...], omega: Any = 0.0) -> ComplexArray:
    """Return the dynamic stiffness of each extra, (..., extras), N/m."""
    k, c = (np.array([getattr(extra, name) for extra in extras]) for name in ("stiffness", "damping"))
    return np.asarray(k + 1j * np.asarray(omega)[..., None] * c)


def response(section: Section, extras: tuple[Extra, ...], omega: Any, where: Any, at: Any) -> ComplexArray:
    """Return the states of the track at places `at` under harmonic unit forces at places `where`, as `waves.response`.

    Parameters
    ----------
    section, extras
        The track, and what differs at some seats.
    omega, where, at
        rad/s, m and m from seat 0; all three are broadcast against each other.
    """
    omega, where, at = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in (omega, where, at)))
    regular = waves.response(section, omega, where, at)
    if not extras:
        return regular
    x = np.array([extra.seat for extra in extras]) * section.spacing
    share, _ = shares(section, extras, omega)
    felt = share * waves.response(section, omega[..., None], where[..., None], x)[..., 0]
    force = forces(section, extras, omega, felt)
    shown = waves.response(section, omega[..., None], x, at[..., None])  # (..., extras, 4)
    return np.asarray(regular + np.einsum("...p,...pf->...f", share * force, shown))


def forces(section: Section, extras: tuple[Extra, ...], omega: Any, felt: Any, period: float = np.inf) -> ComplexArray:
    """Return the forces of all extras, (..., extras), N, where the regular track would have the deflections `felt`."""
    stiff = stiffnesses(extras, omega)
    matrix = np.eye(len(extras)) + stiff[..., :, None] * between(section, extras, omega, period)
    solved = np.linalg.inv(matrix).swapaxes(-1, -2)
    if solved.ndim == 2:
        return np.asarray(-(stiff * felt) @ solved)
    return np.asarray((-(stiff * felt)[..., None, :] @ solved)[..., 0, :])
