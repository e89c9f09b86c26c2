"""Kalker's creepage coefficients of an elliptic contact, by his table and, beyond it, by his thin ellipses.

    Fx = -G·a·b·C11·ξ        Fy = -G·a·b·C22·η - G·(a·b)^1.5·C23·φ        Mz = G·(a·b)^1.5·C23·η - G·(a·b)²·C33·φ

Source: J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), table E3 and appendix;
docs/theory/wagon.rst, section 7.3.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from math import log, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SLENDER = 0.1
"""Smallest ratio of the shorter to the longer semi-axis of the patch in the table. For more slender patches Kalker's
asymptotic formulas are used."""


class Coefficients(NamedTuple):
    """C11 (longitudinal), C22 (lateral), C23 (spin), C33."""

    c11: float
    c22: float
    c23: float
    c33: float


@cache
def coefficient_table() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Poisson's ratios, ratios a/b in rising order, and the coefficients, (ratios of Poisson, ratios, 4)."""
    text = (files(__package__) / "kalker.csv").read_text(encoding="utf-8")
    lines = [line.split(",") for line in text.splitlines() if not line.startswith("#")][1:]

    def parsed_ratio(entry: str) -> float:
        return 1.0 / float(entry[2:]) if entry.startswith("1/") else float(entry)

    poisson = sorted({float(line[0]) for line in lines})
    held = {(float(line[0]), parsed_ratio(line[1])): [float(entry) for entry in line[2:]] for line in lines}
    ratios = sorted({place for _, place in held})
    return np.array(poisson), np.array(ratios), np.array([[held[nu, place] for place in ratios] for nu in poisson])


@cache
def _table_splines() -> object:
    from scipy.interpolate import PchipInterpolator

    _, ratios, values = coefficient_table()
    return PchipInterpolator(np.log(ratios), np.log(values), axis=1)


def coefficients(a: float, b: float, poisson: float) -> Coefficients:
    """Return the coefficients of an ellipse.

    The logarithms of the table's entries are interpolated without overshoot over the ratio of the semi-axes, and by a
    parabola over Poisson's ratio. Both are exact at the entries. For thinner ellipses Kalker's asymptotic formulas
    hold; at the end of the table they differ from it by a few per cent.

    Parameters
    ----------
    a, b
        Semi-axes along and across the rolling, in one unit.
    poisson
        Poisson's ratio, 0 to 0.5.
    """
    ratio = a / b
    if ratio < SLENDER * (1 - 1e-12):
        return _thin_along(ratio, poisson)
    if ratio > (1 + 1e-12) / SLENDER:
        return _thin_across(1.0 / ratio, poisson)
    at = np.exp(_table_splines()(log(ratio)))  # type: ignore[operator]
    nodes = coefficient_table()[0]
    weights = [np.prod([(poisson - other) / (node - other) for other in nodes if other != node]) for node in nodes]
    return Coefficients(*(float(value) for value in np.array(weights) @ at))


def _thin_along(g: float, nu: float) -> Coefficients:
    """Return the coefficients of an ellipse that is thin along the rolling, g = a/b."""
    big = log(16.0 / g**2)
    spin = pi * sqrt(g) / (3.0 * (1.0 - nu)) * (1.0 + nu * (0.5 * big + log(4.0) - 5.0))
    return Coefficients(pi**2 / (4.0 * (1.0 - nu)), pi**2 / 4.0, spin, pi**2 / (16.0 * (1.0 - nu) * g))


def _thin_across(g: float, nu: float) -> Coefficients:
    """Return the coefficients of an ellipse that is thin across the rolling, g = b/a."""
    big = log(16.0 / g**2)
    across, along = (1.0 - nu) * big + 2.0 * nu, big - 2.0 * nu
    deep = (1.0 - nu) * big - 2.0 + 4.0 * nu
    return Coefficients(
        2.0 * pi / (along * g) * (1.0 + (3.0 - log(4.0)) / along),
        2.0 * pi / g * (1.0 + (1.0 - nu) * (3.0 - log(4.0)) / across) / across,
        2.0 * pi / (3.0 * g**1.5 * deep),
        pi / 4.0 * (1.0 - nu * (big - 2.0) / deep),
    )
