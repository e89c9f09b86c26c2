"""Polynomials on one interval, held at its Gauss nodes: Legendre and Bernstein coefficients, integrals, ends."""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general.records import Nodes

AHEAD_DEGREE = 3
"""Of what is extrapolated over a whole interval; more is useless where the force rings."""


def bernstein_values(places: FloatArray, degree: int) -> FloatArray:
    """Return Bernstein's polynomials at some places: (place, polynomial)."""
    k = np.arange(degree + 1)
    binomials = np.array([comb(degree, int(j)) for j in k], dtype=float)
    x = places[:, None]
    return np.asarray(binomials * x**k * (1.0 - x) ** (degree - k))


def _legendre_derivatives(at: float, count: int, order: int) -> FloatArray:
    """Return a derivative by θ of P_l(2θ - 1) for l < count."""
    rows = [2.0**order * legendre.legval(2.0 * at - 1.0, legendre.legder(one, order)) for one in np.eye(count)]
    return np.array(rows)


@cache
def gauss_nodes(count: int) -> Nodes:
    """Return the Gauss nodes and their matrices."""
    z, twice = legendre.leggauss(count)
    places, weights = 0.5 * (z + 1.0), 0.5 * twice
    values = np.asarray(legendre.legvander(z, count - 1), dtype=float)
    transform = (2.0 * np.arange(count)[:, None] + 1.0) * values.T * weights
    integrated = np.stack([legendre.legval(z, legendre.legint(one, lbnd=-1)) for one in np.eye(count)], axis=1)
    ends = np.concatenate([[0.0], places, [1.0]])
    later = legendre.legvander(z + 2.0, AHEAD_DEGREE) @ transform[: AHEAD_DEGREE + 1]
    scaled = np.asarray(legendre.legvander(2.0 * ends[:-1] - 1.0, count), dtype=float)
    derived = np.stack([2.0 * legendre.legval(z, legendre.legder(one)) for one in np.eye(count + 1)], axis=1)
    end, end_slope, end_bend = (_legendre_derivatives(1.0, count, order) @ transform for order in range(3))
    return Nodes(
        places, weights, values, transform, np.asarray(0.5 * integrated @ transform), end, end_slope, end_bend,
        _inverse(bernstein_values(places, count - 1)), _inverse(bernstein_values(ends, count + 1)),
        np.asarray(derived @ _inverse(scaled)), np.pad(derived[:, :count] @ transform, ((0, 0), (1, 0))),
        _inverse(scaled).sum(axis=0), later,
    )  # fmt: skip


def _inverse(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrix), dtype=float)


FLIGHT_DEGREE = 15
"""Of the polynomial that isolates the touches of a flight."""


@cache
def flight_nodes() -> tuple[FloatArray, FloatArray]:
    """Return the places from 0 to 1 at which a flight is looked at, and the matrix to Bernstein coefficients."""
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(FLIGHT_DEGREE + 1) / FLIGHT_DEGREE)
    return places, _inverse(bernstein_values(places, FLIGHT_DEGREE))
