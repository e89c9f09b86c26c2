"""Spectral densities of irregularities: those of `spectra.toml`, and tables; all one-sided, over cycles per metre.

The variance of the height is the integral of the density G(k) over the wavenumber k = 1/wavelength from zero on. A
density S over Ω = 2π·k in rad/m is G(k) = 2π·S(2π·k); one that is stated over negative wavenumbers too is half as high.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError, value_text

__all__ = ["third_octave_levels"]

FloatArray = NDArray[np.float64]
Table = tuple[tuple[float, float], ...]

HALF_BAND = 10.0**0.05
"""Ratio of the upper wavenumber of a third-octave band (base ten, IEC 61260-1) to its middle."""
ZERO_DB = 1e-6
"""R.m.s. height of the level 0 dB, m."""
FEWEST_LINES = 3.0
"""Fewest lines of a periodogram in a band whose level is told."""
NOMINAL = 0.1
"""How far, in bands, a stated middle (0.315 m) may be from the exact one (0.31623 m)."""


@dataclass(frozen=True)
class Density:
    """A one-sided density of the variance over cycles per metre.

    Attributes
    ----------
    variance_between
        The variance of the waves between two wavenumbers (1/m), m².
    known
        Shortest and longest wavelength for which it is known, m; None: it is a formula.
    source
        Where it comes from.
    """

    variance_between: Callable[[FloatArray, FloatArray], FloatArray]
    known: tuple[float, float] | None
    source: str


@cache
def published_densities() -> dict[str, dict[str, Any]]:
    """Return what is published, by name: `levels` or `rational`, and `source`."""
    return tomllib.loads((files(__package__) / "spectra.toml").read_text(encoding="utf-8"))


def published_density(name: str) -> Density:
    """Return a density of `spectra.toml`."""
    held = published_densities()[name]
    if "levels" in held:
        return density_of_levels(tuple((float(wave), float(level)) for wave, level in held["levels"]), held["source"])
    A, c, r = (held["rational"][symbol] for symbol in "Acr")

    def density(k: FloatArray) -> FloatArray:
        omega = 2.0 * pi * k
        return np.asarray(2.0 * pi * A * c**2 / ((r**2 + omega**2) * (c**2 + omega**2)))

    return Density(_by_middles(density), None, held["source"])


def _by_middles(density: Callable[[FloatArray], FloatArray]) -> Callable[[FloatArray, FloatArray], FloatArray]:
    return lambda low, high: density(0.5 * (low + high)) * (high - low)


def exact_middle(wavelength: NDArray[Any]) -> FloatArray:
    """Return exact middles of third-octave bands where nominal ones are given, m; other wavelengths stay."""
    number = 10.0 * np.log10(wavelength)
    nearest = np.rint(number)
    return np.where(np.abs(number - nearest) < NOMINAL, 10.0 ** (0.1 * nearest), wavelength)


def density_of_levels(levels: Table, source: str) -> Density:
    """Return the density of third-octave levels: constant within each band, so that its level is that stated.

    Where the table has wider steps than third-octaves, a level holds up to the geometric mean of the wavelengths.
    """
    wave, level = np.array(sorted(levels, reverse=True)).T
    middle = 1.0 / exact_middle(wave)
    height = (ZERO_DB * 10.0 ** (0.05 * level)) ** 2 / (middle * (HALF_BAND - 1.0 / HALF_BAND))
    edges = np.concatenate([[middle[0] / HALF_BAND], np.sqrt(middle[:-1] * middle[1:]), [middle[-1] * HALF_BAND]])
    below = np.concatenate([[0.0], np.cumsum(height * np.diff(edges))])

    def variance_between(low: FloatArray, high: FloatArray) -> FloatArray:
        return np.asarray(np.interp(high, edges, below) - np.interp(low, edges, below))

    return Density(variance_between, (float(1.0 / edges[-1]), float(1.0 / edges[0])), source)


def density_of_table(densities: Table) -> Density:
    """Return the density through given ones, straight between them over logarithms."""
    wave, given = np.array(sorted(densities, reverse=True)).T
    along, values = -np.log(wave), np.log(given)
    density = _by_middles(lambda k: np.asarray(np.exp(np.interp(np.log(k), along, values))))
    return Density(density, (float(wave[-1]), float(wave[0])), "a table")


def bands_of_levels(name: str) -> tuple[FloatArray, FloatArray]:
    """Return wavelengths (m) and levels (dB re 1 µm) of a published table of levels."""
    waves, levels = np.array(published_densities()[name]["levels"]).T
    return waves, levels


def variance_in_bands(k: FloatArray, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the middles of third-octave bands, m, from long to short, and the sum of the waves' variances in each."""
    band = np.rint(10.0 * np.log10(k)).astype(int)
    sums = np.asarray(np.bincount(band - band.min(), variance), dtype=np.float64)
    middles = 10.0 ** (-0.1 * (band.min() + np.arange(len(sums))))
    return middles[sums > 0.0], sums[sums > 0.0]


def filter_of_patch(wavenumber: FloatArray, radius: float) -> FloatArray:
    """Return |H|², what a circular patch of contact leaves of a wave's variance (Remington 1976).

    |H|² = 1/(1 + π/4·(2π·k·a)³): the mean over the patch, (2·J₁(2π·k·a)/(2π·k·a))², without its zeros
    (docs/theory/irregularities.rst, section 15.5).

    Parameters
    ----------
    wavenumber
        k, 1/m.
    radius
        a, m.
    """
    return np.asarray(1.0 / (1.0 + 0.25 * pi * (2.0 * pi * wavenumber * radius) ** 3))


def third_octave_levels(heights: NDArray[Any], spacing: float | str) -> tuple[FloatArray, FloatArray]:
    """Return the levels of equally spaced heights in third-octave bands of wavelength.

    The straight line through the heights is removed, and the levels follow from the periodogram with a Hann window.
    Bands below two spacings, and bands with fewer than three lines of the periodogram, are left out.

    Parameters
    ----------
    heights
        m.
    spacing
        Distance between two heights, m.

    Returns
    -------
    wavelengths
        Middles of the bands, m, from long to short.
    levels
        dB re 1 µm (r.m.s.).

    Raises
    ------
    InputError
        If there are fewer than 16 heights, or one is not finite, or the spacing is not a positive length.
    """
    spacing, allowed = as_quantity(spacing, "spacing", "length"), "at least 16 finite heights in a row, m"
    try:
        y = np.asarray(heights, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError("", "heights", value_text(heights), allowed) from error
    if y.ndim != 1 or len(y) < 16 or not np.isfinite(y).all():
        raise InputError("", "heights", f"an array of shape {y.shape}, {np.isfinite(y).sum()} finite", allowed)
    along = np.arange(len(y)) - 0.5 * (len(y) - 1)
    y = y - y.mean() - along * (along @ y) / (along @ along)
    window = np.hanning(len(y) + 1)[:-1]
    power = 2.0 * np.abs(np.fft.rfft(y * window)) ** 2 / (len(y) * (window @ window))
    k = np.asarray(np.fft.rfftfreq(len(y), spacing), dtype=np.float64)
    waves, sums = variance_in_bands(k[1:], power[1:])
    lines = (HALF_BAND - 1.0 / HALF_BAND) / waves / k[1]
    kept = (lines >= FEWEST_LINES) & (HALF_BAND / waves <= k[-1])
    return waves[kept], 10.0 * np.log10(sums[kept] / ZERO_DB**2)
