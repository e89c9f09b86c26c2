"""Polynomials on one interval, held at its Gauss nodes: Legendre and Bernstein coefficients, integrals, ends."""

from __future__ import annotations

from functools import cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wheeltapper.march.program import FloatArray


class Nodes(NamedTuple):
    """The Gauss nodes of an interval from 0 to 1, and what is linear in values there; n nodes.

    Attributes
    ----------
    places, weights
        (n,).
    values
        Legendre's polynomials at the nodes, P_l(2θ - 1), (node, l).
    transform
        From values to coefficients of Legendre's polynomials, (l, node).
    integrals
        From values to the integral from 0 to each node, (node, node).
    end, end_slope, end_bend
        From values to the value, the first and the second derivative at 1, (n,).
    bernstein
        From values to Bernstein coefficients, (n, n).
    ended
        From the value at 0, the values at the nodes and the value at 1 to Bernstein coefficients, (n + 2, n + 2).
    slopes
        From the value at 0 and the values at the nodes to the derivative at the nodes, (n, n + 1).
    ahead
        From values to those of the same polynomial, without what is above its third degree, one interval later.
    """

    places: FloatArray
    weights: FloatArray
    values: FloatArray
    transform: FloatArray
    integrals: FloatArray
    end: FloatArray
    end_slope: FloatArray
    end_bend: FloatArray
    bernstein: FloatArray
    ended: FloatArray
    slopes: FloatArray
    ahead: FloatArray


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
    values = legendre.legvander(z, count - 1)
    transform = (2.0 * np.arange(count)[:, None] + 1.0) * values.T * weights
    integrated = np.stack([legendre.legval(z, legendre.legint(one, lbnd=-1)) for one in np.eye(count)], axis=1)
    ends = np.concatenate([[0.0], places, [1.0]])
    later = legendre.legvander(z + 2.0, AHEAD_DEGREE) @ transform[: AHEAD_DEGREE + 1]
    scaled = legendre.legvander(2.0 * ends[:-1] - 1.0, count)
    derived = np.stack([2.0 * legendre.legval(z, legendre.legder(one)) for one in np.eye(count + 1)], axis=1)
    return Nodes(
        places, weights, values, transform, 0.5 * integrated @ transform,
        *(_legendre_derivatives(1.0, count, order) @ transform for order in range(3)),
        np.linalg.inv(bernstein_values(places, count - 1)), np.linalg.inv(bernstein_values(ends, count + 1)),
        derived @ np.linalg.inv(scaled), later,
    )  # fmt: skip


FLIGHT_DEGREE = 15
"""Of the polynomial that isolates the touches of a flight."""


@cache
def flight_nodes() -> tuple[FloatArray, FloatArray]:
    """Return the places from 0 to 1 at which a flight is looked at, and the matrix to Bernstein coefficients."""
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(FLIGHT_DEGREE + 1) / FLIGHT_DEGREE)
    return places, np.linalg.inv(bernstein_values(places, FLIGHT_DEGREE))
