"""Waves of the infinite track, exactly: transfer matrices of the Timoshenko rail and of a seat, and Bloch's waves.

The state of the rail is (w, θ, M, Q): deflection (positive down), rotation, M = EI·θ' and Q = κGA·(w' - θ), as
amplitudes of e^{+iωt}. Inside, it is scaled by powers of the spacing, so that its numbers are of one size
(docs/theory/track.rst, section 13.2).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.track.section import Section

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

ABSORPTION = 1e-9
"""By this share of itself a frequency is taken below the real axis: so undamped waves, too, leave the load."""

MOST_GROWTH = 1e9
"""Where the near field decays by more from seat to seat, rounding spoils the slow waves beyond 1e-6."""

DEFLECTION, SHEAR = 0, 3
"""Of the four states."""

SAME_LENGTH = 13
"""Lengths that agree to so many digits, in distances of seats, are one."""


class Waves(NamedTuple):
    """Bloch's waves at some frequencies; states are those just before a seat.

    Attributes
    ----------
    rail
        Matrix of the rail's equations, (..., 4, 4): s' = rail·s, for x in units of the spacing.
    seat
        Transfer across a seat, (..., 4, 4).
    factors
        Of the state from bay to bay, (..., 4), by rising size: two waves that decay forwards, two that decay backwards.
    states
        (..., 4, 4): a column for each wave.
    """

    rail: ComplexArray
    seat: ComplexArray
    factors: ComplexArray
    states: ComplexArray


def seat_stiffness(section: Section, omega: Any) -> Any:
    """Return the force with which a seat resists a harmonic deflection of the rail of 1 m, N/m."""
    pad = section.pad + 1j * omega * section.pad_damping
    if section.sleeper == 0.0:
        return pad
    below = section.ballast + 1j * omega * section.ballast_damping - section.sleeper * omega**2
    return pad * below / (pad + below)


def waves_at(section: Section, omega: Any) -> Waves:
    """Return the waves at angular frequencies, rad/s, of any shape."""
    omega = np.asarray(omega) * (1.0 - 1j * ABSORPTION)
    a, hard = section.spacing, 1.0 + 1j * omega * section.loss
    unit = section.bending / a**3  # of forces: N per m of deflection
    rail = np.zeros((*omega.shape, 4, 4), dtype=complex)
    rail[..., 0, 1] = 1.0
    rail[..., 0, 3] = unit * a / (section.shear * hard)
    rail[..., 1, 2] = 1.0 / hard
    rail[..., 2, 1] = -section.rotary * omega**2 / (unit * a)
    rail[..., 2, 3] = -1.0
    rail[..., 3, 0] = -section.mass * a * omega**2 / unit
    seat = np.broadcast_to(np.eye(4, dtype=complex), rail.shape).copy()
    seat[..., 3, 0] = seat_stiffness(section, omega) / unit
    factors, states = np.linalg.eig(_transfer(rail, np.ones(omega.shape)) @ seat)
    order = np.argsort(np.abs(factors), axis=-1)
    return Waves(
        rail, seat, np.take_along_axis(factors, order, -1), np.take_along_axis(states, order[..., None, :], -1)
    )


def _transfer(rail: ComplexArray, along: FloatArray) -> ComplexArray:
    """Return the transfer over some lengths of rail without seats, in units of the spacing."""
    if not rail[..., 2:, :2].any():  # at rest the deflection is a cubic: the exponential series ends
        step = rail * along[..., None, None]
        return np.asarray(np.eye(4) + step @ (np.eye(4) + step @ (np.eye(4) + step / 3.0) / 2.0))
    from scipy.linalg import expm

    of_each = rail.shape[:-2]
    _, first, which = np.unique(np.round(along, SAME_LENGTH), return_index=True, return_inverse=True)
    shape = np.broadcast_shapes(of_each, along.shape)
    if len(first) * np.prod(of_each) > np.prod(shape):
        return np.asarray(expm(rail * along[..., None, None]))
    lengths = along.ravel()[first]  # they repeat from bay to bay
    found = _exponentials(rail.tobytes(), of_each, lengths.tobytes())
    rows = np.arange(int(np.prod(of_each))).reshape(of_each)
    return np.asarray(found.reshape(-1, len(first), 4, 4)[rows, which.reshape(along.shape)])


def response(section: Section, omega: Any, where: Any, at: Any, state: int | None = None) -> ComplexArray:
    """Return the states of the infinite track at places `at` under harmonic unit forces at places `where`.

    Parameters
    ----------
    section
        The track.
    omega
        Angular frequencies, rad/s.
    where, at
        m from a seat; all three are broadcast against each other.
    state
        Which of the four is asked for, 0 to 3; all where it is None.

    Returns
    -------
    ComplexArray
        (..., 4): w in m/N, θ in 1/N, M in N·m/N and Q in N/N; at the force itself those just behind it (larger x).
        Of one state (...).
    """
    omega, where, at = (np.asarray(one, dtype=float) for one in (omega, where, at))
    shape = np.broadcast_shapes(omega.shape, where.shape, at.shape)
    waves, a = waves_at(section, omega), section.spacing
    bay, last = np.floor(where / a), np.floor(at / a)
    x, y, n = where / a - bay, at / a - last, last - bay
    left, right = waves.states[..., 2:], waves.states[..., :2]
    before = _transfer(waves.rail, x) @ waves.seat @ left
    after = _transfer(waves.rail, x - 1.0) @ right
    jump = np.array([0.0, 0.0, 0.0, -1.0])[:, None]
    sizes = np.linalg.solve(np.concatenate([-before, after], axis=-1), jump)[..., 0]
    behind = (n > 0) | ((n == 0) & (y >= x))  # here the waves run forwards
    forwards = sizes[..., 2:] * waves.factors[..., :2] ** np.maximum(n, 0.0)[..., None]
    backwards = sizes[..., :2] * waves.factors[..., 2:] ** np.minimum(n, 0.0)[..., None]
    unit = section.bending / a**3
    scales = np.array([1.0 / unit, 1.0 / (unit * a), a, 1.0])
    asked = np.arange(4) if state is None else np.array([state])
    ahead = scales[asked, None] * (_transfer(waves.rail, y - 1.0) @ right)[..., asked, :]
    back = scales[asked, None] * (_transfer(waves.rail, y) @ waves.seat @ left)[..., asked, :]
    found = np.where(behind[..., None], _summed(ahead, forwards), _summed(back, backwards))
    found = np.broadcast_to(found, (*shape, len(asked)))
    return found if state is None else found[..., 0]


def _summed(states: ComplexArray, sizes: ComplexArray) -> ComplexArray:
    """Return the sums of two waves, (..., states): much faster than products of as many small matrices."""
    return np.asarray(states[..., 0] * sizes[..., None, 0] + states[..., 1] * sizes[..., None, 1])


def decay(section: Section, omega: Any) -> FloatArray:
    """Return how fast the slowest wave decays at angular frequencies, dB/m."""
    slowest = np.abs(waves_at(section, omega).factors[..., 1])
    return np.asarray(-20.0 * np.log10(slowest) / section.spacing)


def growth(section: Section, omega: Any) -> FloatArray:
    """Return by how much the rail's near field decays from seat to seat at angular frequencies; see `MOST_GROWTH`."""
    return np.asarray(np.abs(waves_at(section, omega).factors[..., 3]))


def pinned(section: Section) -> float:
    """Return the angular frequency at which the rail vibrates between immovable seats, rad/s."""
    k2 = (np.pi / section.spacing) ** 2
    quartic = section.rotary * section.mass / section.shear
    middle = section.mass + k2 * (section.rotary + section.mass * section.bending / section.shear)
    last = section.bending * k2**2
    return float(np.sqrt(2.0 * last / (middle + np.sqrt(middle**2 - 4.0 * quartic * last))))


@lru_cache(maxsize=16)
def _exponentials(rail: bytes, of_each: tuple[int, ...], lengths: bytes) -> ComplexArray:
    """Return the transfers over several lengths of rail: tracks that differ in their seats only have the same."""
    from scipy.linalg import expm

    matrices = np.frombuffer(rail, dtype=complex).reshape(*of_each, 1, 4, 4)
    return np.asarray(expm(matrices * np.frombuffer(lengths)[:, None, None]))
