"""A ring with some seats that differ, in modes of its own: the regular ring's modes, coupled by what differs.

The kept modes of the regular ring, with the additional springs and dampers as forces on them, are a linear system
again; its eigenvectors are the modes of the irregular ring. The bay of that ring is the whole of it: amplitudes are the
same from everywhere, and shapes go once around (docs/theory/track.rst, section 13.10).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wheeltapper.ground.progress import patiently, progress_counter
from wheeltapper.lower.track import responses, waves
from wheeltapper.lower.track.anomalies import Void
from wheeltapper.lower.track.responses import BALLAST, PAD, Extra
from wheeltapper.lower.track.ring import RESIDUAL_DEGREE, ring_of
from wheeltapper.lower.track.section import Section
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.march.general.contract import Port
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import real_times

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
BLOCK = 8
"""Bays that are turned at a time: the modes of a ring at all of its places would be its largest table by far."""
SECONDS = 8e-10
"""Time that eigenvectors take over the cube of the number of unknowns, s, to tell how far they are."""
SHAPED = 5
"""How often `_around` goes around a ring."""


class IrregularModes(NamedTuple):
    """A ring with some seats that differ, and what else its modes move; `TrackModes` of one bay, that is all of it.

    Attributes
    ----------
    ring, rotation, cutoff
        As of `TrackModes`; the bay is the whole ring.
    rail, sleeper, sleeper_drive
        At each seat: of the rail and the sleeper, (bays, modes).
    sleeper_residual
        Compliance of a sleeper that the modes leave out, where its ballast differs, (bays,), m/N.
    vectors
        What each mode is in those of the regular ring, real parts above imaginary parts, (2·regular modes, modes).
    """

    ring: Ring
    rotation: ComplexArray
    rail: ComplexArray
    sleeper: ComplexArray
    sleeper_drive: ComplexArray
    sleeper_residual: FloatArray
    cutoff: float
    vectors: ComplexArray

    def port_of(self, void: Void, arm: float = 1.0) -> Port:
        """Return a sleeper over a void as forces press it up, at so many times the rail's distance from its middle.

        What the modes leave out of the sleeper is next to nothing, and of either sign. A damper's force would follow by
        it with a time of some 1e-8 s, late or early, which no step resolves: there it is none.
        """
        place = void.seat % len(self.sleeper)
        residual = float(self.sleeper_residual[place]) * arm**2 if void.damping == 0.0 else 0.0
        return Port(-arm * self.sleeper[place], -arm * self.sleeper_drive[place], void.gap, residual)


@lru_cache(maxsize=4)
def irregular_ring(section: Section, bays: int, cutoff: float, extras: tuple[Extra, ...]) -> IrregularModes:
    """Return the ring of some bays with what differs at some seats, 0 to bays - 1."""
    with algebra_on_one_thread():  # threads that wait for busy cores made its matrices six times slower
        return _irregular_ring(section, bays, cutoff, extras)


def _irregular_ring(section: Section, bays: int, cutoff: float, extras: tuple[Extra, ...]) -> IrregularModes:
    regular = ring_of(section, bays, cutoff)
    ring, weights = regular.ring, regular.ring.weights
    turns: ComplexArray = np.exp(1j * np.multiply.outer(np.arange(bays), np.angle(ring.turns)))
    at_seat = (-1.0) ** np.arange(ring.deflection.shape[1])
    rail, rail_drive = at_seat @ ring.deflection[0], at_seat @ ring.drive[0]
    seats = np.array([extra.seat for extra in extras])
    pad = np.array([extra.kind == PAD for extra in extras])[:, None]
    reads = weights * turns[seats] * np.where(pad, rail - regular.sleeper, regular.sleeper)
    drives = turns[seats].conj() * np.where(pad, rail_drive - regular.sleeper_drive, regular.sleeper_drive)
    tell = progress_counter("bays of an irregular track", SHAPED * bays)
    missed = _missed(section, ring, turns, extras, reads, drives, tell)
    stiff, damp = _feedback(extras, missed.own)
    at_once = np.linalg.inv(np.eye(len(extras)) - damp @ _rows(reads) @ _columns(drives).T)
    shown = at_once @ (stiff @ _rows(reads) + damp @ _rows(reads * ring.rates))
    system = np.block([
        [np.diag(ring.rates.real), -np.diag(ring.rates.imag)], [np.diag(ring.rates.imag), np.diag(ring.rates.real)]
    ])  # fmt: skip
    rates, right, left = _eigenvectors(system + _columns(drives).T @ shown)
    forces = _times(shown, right)
    weighted: ComplexArray = weights * turns
    deflection, rotation = (_around(weighted, one, _rows, right, tell) for one in (ring.deflection, regular.rotation))
    entered = _times(at_once.T, _times(_columns(drives), left.T))
    drive = _around(turns.conj(), ring.drive, _columns, left.T, tell)
    pushed = _around(turns.conj(), ring.drive, _columns, _rows(reads).T, tell)
    given = missed.along @ stiff.T + pushed @ damp.T
    deflection += _times(missed.along, forces)
    drive += _times(given, entered) + _times(missed.along @ damp.T, entered * rates)
    edges = np.append(np.add.outer(np.arange(bays) * ring.spacing, ring.edges[:-1]).ravel(), bays * ring.spacing)
    long = Ring(
        rates, np.ones(len(rates), dtype=complex), np.where(rates.imag == 0.0, 1.0, 2.0), edges, deflection, drive,
        np.zeros((len(edges) - 1, RESIDUAL_DEGREE + 1)), bays * ring.spacing, 1, bays,
    )  # fmt: skip
    found = IrregularModes(
        long._replace(residual=_residual(long, missed.static)), rotation,
        _times(_rows(weighted * rail), right), _times(_rows(weighted * regular.sleeper), right),
        _times(_columns(turns.conj() * regular.sleeper_drive), left.T), np.zeros(bays), cutoff, right,
    )  # fmt: skip
    between = responses.between(section, extras, 0.0, bays * section.spacing).real
    return found._replace(sleeper_residual=_sleeper_residual(found, extras, between))


def _rows(reads: ComplexArray) -> FloatArray:
    """Return readings of amplitudes (..., modes), weighted, as those of their real and imaginary parts."""
    return np.concatenate([reads.real, -reads.imag], axis=-1)


def _columns(drives: ComplexArray) -> FloatArray:
    """Return what forces do to amplitudes (..., modes) as what they do to their real and imaginary parts."""
    return np.concatenate([drives.real, drives.imag], axis=-1)


def _times(real: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return real rows (..., n) times a real or complex matrix."""
    rows = real.reshape(-1, real.shape[-1])
    product = real_times(rows, matrix) if np.iscomplexobj(matrix) else rows @ matrix
    return np.asarray(product.reshape(*real.shape[:-1], matrix.shape[1]))


def _around(
    turns: ComplexArray, shapes: ComplexArray, parts: Callable[[ComplexArray], FloatArray], matrix: NDArray[Any],
    tell: Callable[[int], None],
) -> NDArray[Any]:  # fmt: skip
    """Return shapes of a bay, (elements, terms, modes), turned into all bays, times a matrix: (all elements, 15, n).

    `turns` is that of each bay and mode, `parts` returns the real rows that the matrix takes, and `tell` counts bays.
    """
    (elements, terms, _), matrix = shapes.shape, np.ascontiguousarray(matrix)
    found = np.zeros((len(turns) * elements, RESIDUAL_DEGREE + 1, matrix.shape[1]), dtype=matrix.dtype)
    for first in range(0, len(turns), BLOCK):
        some = turns[first : first + BLOCK, None, None]
        rows = parts(some * shapes).reshape(-1, terms, len(matrix))
        found[first * elements :][: len(rows), :terms] = _times(rows, matrix)
        tell(len(some))
    return found


def _eigenvectors(system: FloatArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return rates, right vectors in columns and left ones in rows, one of each conjugate pair, by rising rates."""
    expected = SECONDS * len(system) ** 3
    rates, right = patiently(lambda: np.linalg.eig(system), "modes of an irregular track", expected)
    kept = np.flatnonzero(rates.imag >= 0.0)
    kept = kept[np.argsort(np.abs(rates[kept]), kind="stable")]
    found, right = rates[kept].astype(complex), right[:, kept].astype(complex)
    pairs = found.imag > 0.0
    inverse = np.linalg.inv(np.hstack([right.real, right.imag[:, pairs]]))  # of what is real, an eighth of the work
    left = inverse[: len(kept)].astype(complex)
    left[pairs] = 0.5 * (left[pairs] - 1j * inverse[len(kept) :])
    return found, right, left


def _feedback(extras: tuple[Extra, ...], own: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the extras' forces per deflection, and per rate of deflection, that the kept modes show them.

    The deflections that the modes miss, `own` per force, are added at rest.
    """
    stiffness, damping = (np.array([getattr(extra, name) for extra in extras]) for name in ("stiffness", "damping"))
    given = np.linalg.inv(np.eye(len(extras)) + stiffness[:, None] * own)
    return -given * stiffness, -given @ (damping[:, None] * np.linalg.inv(np.eye(len(extras)) + own * stiffness))


class StaticField(NamedTuple):
    """The irregular track at rest under unit forces at the points of each element, (bays, points).

    Attributes
    ----------
    x
        The points, m from seat 0.
    felt
        Of the regular track at each extra, (bays, points, extras), m/N.
    forces
        Of the extras, (bays, points, extras), N/N.
    """

    x: FloatArray
    felt: FloatArray
    forces: FloatArray


@cache
def points() -> FloatArray:
    """Return the points of one element, from -1 to 1."""
    return np.asarray(chebyshev.chebpts1(RESIDUAL_DEGREE + 1))


@lru_cache(maxsize=4)
def static_field(section: Section, bays: int, elements: int, extras: tuple[Extra, ...]) -> StaticField:
    """Return the static field of a ring of some bays, of a number of elements each."""
    length = bays * section.spacing
    inside = ((np.arange(elements)[:, None] + 0.5 * (points() + 1.0)) * section.spacing / elements).ravel()
    around = np.add.outer(np.arange(bays) * section.spacing, inside)
    share = responses.shares(section, extras)[0].real
    rail = waves.response(section, 0.0, 0.0, responses.nearest(around, length))[..., 0].real
    behind = (np.arange(bays)[:, None] - [extra.seat for extra in extras]) % bays
    felt = share * np.moveaxis(rail[behind], 1, -1)
    return StaticField(around, felt, responses.forces(section, extras, 0.0, felt, length).real)


class _Missed(NamedTuple):
    """What kept modes miss at rest.

    Attributes
    ----------
    own
        Of what extras feel of each other, (extras, extras), m/N.
    along
        Of what the rail feels of them, by powers, (all elements, 15, extras).
    static
        Deflection of the irregular track under a force at the same place, at the points of each element,
        (all elements, 15), m/N.
    """

    own: FloatArray
    along: FloatArray
    static: FloatArray


def _missed(
    section: Section, ring: Ring, turns: ComplexArray, extras: tuple[Extra, ...], reads: ComplexArray,
    drives: ComplexArray, tell: Callable[[int], None],
) -> _Missed:  # fmt: skip
    """Return what the modes of the regular ring miss; `reads` and `drives` are the extras', (extras, modes)."""
    field, statics = static_field(section, ring.bays, len(ring.edges) - 1, extras), -drives / ring.rates
    exact = responses.between(section, extras, 0.0, ring.bays * ring.spacing).real
    regular = waves.response(section, 0.0, field.x[0], field.x[0])[..., 0].real
    static = regular + (field.felt * field.forces).sum(axis=-1)
    powers = points()[:, None] ** np.arange(ring.deflection.shape[1])
    shown = _around(ring.weights * turns, powers @ ring.deflection, _rows, _columns(statics).T, tell)
    along = by_powers(field.felt.reshape(shown.shape) - shown)
    return _Missed(exact - _rows(reads) @ _columns(statics).T, along, static.reshape(-1, len(points())))


def by_powers(values: FloatArray) -> FloatArray:
    """Return values at the points of each element, (elements, points, ...), as polynomials."""
    powers = points()[:, None] ** np.arange(len(points()))
    return np.asarray(np.linalg.solve(powers, values.reshape(*values.shape[:2], -1)).reshape(values.shape))


def _residual(ring: Ring, static: FloatArray) -> FloatArray:
    """Return the compliance that the modes leave to be added, by powers."""
    powers = points()[:, None] ** np.arange(RESIDUAL_DEGREE + 1)
    there = real_times(powers, ring.deflection) * real_times(powers, ring.drive)
    return by_powers(static - np.real(there @ (-ring.weights / ring.rates)))


def _sleeper_residual(modes: IrregularModes, extras: tuple[Extra, ...], regular: FloatArray) -> FloatArray:
    """Return what the modes leave of the compliance of sleepers at rest, where the ballast differs, (bays,), m/N.

    `regular` is what extras feel of each other on the regular track.
    """
    stiffness = np.array([extra.stiffness for extra in extras])
    exact = np.linalg.solve(np.eye(len(extras)) + regular * stiffness, regular)
    shown = np.real(modes.sleeper * modes.sleeper_drive / -modes.ring.rates) @ modes.ring.weights
    found = np.zeros(len(shown))
    for number, extra in enumerate(extras):
        if extra.kind == BALLAST:
            found[extra.seat] = exact[number, number] - shown[extra.seat]
    return found


def regular_amplitudes(modes: IrregularModes, amplitudes: ComplexArray) -> ComplexArray:
    """Return amplitudes (times, modes) as those of the regular ring, seen from seat 0."""
    parts = np.real((modes.ring.weights * amplitudes) @ modes.vectors.T)
    count = parts.shape[1] // 2
    return np.asarray(parts[:, :count] + 1j * parts[:, count:])
