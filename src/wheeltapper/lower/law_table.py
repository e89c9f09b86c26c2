"""A user's own contact law as a table for the general march.

N(δ, δ') = δ^e·s(v, δ') with v = sqrt(δ/δ_most): near zero a law that grows like δ^e has a smooth s. It is interpolated
by polynomials in equal cells of v, and of the rate where the law depends on it; cells are halved until a check between
the nodes is exact enough.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.general.contract import Law
from wheeltapper.march.general.laws.switch import TABULATED

FloatArray = NDArray[np.float64]

TERMS, RATE_TERMS = 6, 4
"""Terms of the polynomials of a cell, in v and in the rate."""
MOST_CELLS, MOST_RATE_CELLS = 1024, 64
FASTEST = 2.0
"""Largest rate of indentation that a table is made for, m/s; rolling wheels strike with less."""
GOAL = 1e-9
"""Error, over the largest force, at which halving ends."""


class Tabulated(NamedTuple):
    """A law's table, and its largest error at places between the nodes, over the largest force of the table."""

    law: Law
    error: float


def tabulated_law(
    force: Callable[..., FloatArray], exponent: float, largest: float, rated: bool = False, fastest: float = FASTEST
) -> Tabulated:
    """Tabulate a law.

    Parameters
    ----------
    force
        N of arrays of the indentation in m, or of indentation and rate in m/s where it is `rated`.
    exponent
        e, with which the force grows near zero.
    largest
        Largest indentation of the table, m.
    rated
        True where the force depends on the rate.
    fastest
        Largest rate of the table, either way, m/s.

    Raises
    ------
    ValueError
        If the force is not finite, or not positive anywhere.
    """

    def at(v: FloatArray, rate: FloatArray) -> FloatArray:
        delta = largest * v * v
        given = force(delta, rate) if rated else force(delta)
        return np.asarray(given, dtype=float) / delta**exponent

    scale = _largest_force(at, exponent, largest, rated, fastest)
    cells, bands, error = 4, 1, np.inf
    while True:
        table = _table(at, cells, bands, rated, fastest)
        before, error = error, _error(at, table, cells, bands, rated, fastest) * largest**exponent / scale
        if error < GOAL or cells == MOST_CELLS or (error > 0.5 * before and error < 1e-7):
            break
        cells, bands = min(2 * cells, MOST_CELLS), min(2 * bands, MOST_RATE_CELLS) if rated else 1
    slowest, width = (-fastest, 2.0 * fastest / bands) if rated else (0.0, 1.0)
    terms = RATE_TERMS if rated else 1
    numbers = np.array([exponent, largest, cells, TERMS, 0.0, 1.0, slowest, width, bands, terms], dtype=float)
    return Tabulated(Law(TABULATED, numbers, table), error)


def _largest_force(
    at: Callable[[FloatArray, FloatArray], FloatArray], exponent: float, largest: float, rated: bool, fastest: float
) -> float:
    """Return the largest force at rest or at any rate, where the table ends; refuse what is no law."""
    v = np.linspace(0.02, 1.0, 50)
    rates = np.linspace(-fastest, fastest, 9) if rated else np.zeros(1)
    stiffness = np.array([at(v, np.full_like(v, rate)) for rate in rates])
    if not np.isfinite(stiffness).all():
        raise ValueError("the force is not a finite number everywhere from 0 to the largest indentation")
    most = float((stiffness * v ** (2.0 * exponent)).max() * largest**exponent)
    if most <= 0.0:
        raise ValueError("the force is nowhere positive")
    return most


def _nodes(terms: int) -> FloatArray:
    """Return Chebyshev's nodes from 0 to 1."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(terms) + 0.5) / terms))


def _places(cells: int, bands: int, xi: FloatArray, rho: FloatArray, rated: bool, fastest: float) -> list[FloatArray]:
    """Return v and the rate at places of all cells: (bands, cells, xi, rho) each."""
    v = (np.arange(cells)[:, None] + xi) / cells
    low, width = (-fastest, 2.0 * fastest / bands) if rated else (0.0, 0.0)
    rate = low + width * (np.arange(bands)[:, None] + rho)
    return list(np.broadcast_arrays(v[None, :, :, None], rate[:, None, None, :]))


def _table(
    at: Callable[[FloatArray, FloatArray], FloatArray], cells: int, bands: int, rated: bool, fastest: float
) -> FloatArray:
    """Return the coefficients of all cells, (bands·cells, TERMS·terms in the rate)."""
    xi, rho = _nodes(TERMS), _nodes(RATE_TERMS if rated else 1)
    values = at(*_places(cells, bands, xi, rho, rated, fastest))
    along = np.linalg.inv(np.vander(xi, increasing=True))
    across = np.linalg.inv(np.vander(rho, increasing=True))
    rows = np.einsum("in,bcnm,jm->bcij", along, values, across)
    return np.ascontiguousarray(rows.reshape(bands * cells, -1))


def _error(
    at: Callable[[FloatArray, FloatArray], FloatArray], table: FloatArray, cells: int, bands: int, rated: bool,
    fastest: float,
) -> float:  # fmt: skip
    """Return the largest error of the force between the nodes, over δ_most^e."""
    xi = np.linspace(0.0, 1.0, 2 * TERMS + 1)[1::2]
    rho = np.linspace(0.0, 1.0, 2 * RATE_TERMS + 1)[1::2] if rated else np.zeros(1)
    v, rate = _places(cells, bands, xi, rho, rated, fastest)
    terms = RATE_TERMS if rated else 1
    rows = table.reshape(bands, cells, TERMS, terms)
    powers, across = np.vander(xi, TERMS, increasing=True), np.vander(rho, terms, increasing=True)
    away = np.einsum("ni,bcij,mj->bcnm", powers, rows, across) - at(v, rate)
    return float(np.abs(away * v**3).max())
