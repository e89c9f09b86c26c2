"""Pictures of irregularities: their heights along the rail, and the levels of a spectrum beside what is stated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.density import ZERO_DB, bands_of_levels, published_density, variance_in_bands
from wheeltapper.describe.irregularity.spectrum import Spectrum
from wheeltapper.faces.panels import BLUE, GREEN, RED, in_unit, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RADIUS = 0.46
"""Radius of the wheel over whose circumference irregularities of a wheel are drawn, m."""
POINTS = 4000
WAVES = 10
"""Longest waves of a spectrum that are drawn."""
LIMIT = "ISO 3095:2013"
"""The limit that is drawn beside spectra that reach into its band."""


def draw_irregularity(item: Irregularity) -> Figure:
    """Draw the heights, and of a spectrum the third-octave levels of its realisation beside those stated."""
    from matplotlib.figure import Figure

    spectral = isinstance(item, Spectrum)
    figure = Figure(figsize=(8.0, 7.0 if spectral else 3.5))
    axes = figure.subplots(2 if spectral else 1, 1, squeeze=False)[:, 0]
    _draw_heights(axes[0], item)
    if isinstance(item, Spectrum):
        _draw_levels(axes[1], item)
    figure.suptitle(_title(item), fontsize=9)
    return figure


def _title(item: Irregularity) -> str:
    name = type(item).__name__
    return f"{name}: {item.curve}" if isinstance(item, Spectrum) and item.curve is not None else name


def _draw_heights(axis: Axes, item: Irregularity) -> None:
    first, last = _extent(item)
    x = np.linspace(first, last, POINTS)
    course = item.course(RADIUS)
    inner = [stretch.start for stretch in course.stretches if first < stretch.start < last]
    x = np.union1d(x, [*inner, *(np.nextafter(place, -np.inf) for place in inner)])
    y = course.value(x)
    factor, unit = in_unit(np.abs(y).max(keepdims=True), "m")
    axis.plot(x, factor * y, color=BLUE)
    axis.set(xlabel=f"{'rolled distance' if item.borne == 'wheel' else 'position'} [m]", ylabel=f"height [{unit}]")


def _extent(item: Irregularity) -> tuple[float, float]:
    """Return from where to where an irregularity is drawn, m."""
    if isinstance(item, Spectrum):
        return 0.0, min(WAVES * item.band[1], item.length)
    course = item.course(RADIUS)
    borders = [border for border in (stretch.start for stretch in course.stretches) if np.isfinite(border)]
    first, last = (min(borders), max(borders)) if borders else (0.0, 0.0)
    if course.period is not None:
        last = max(last, first + 3.0 * course.period) if len(borders) < 2 else last
    room = 0.25 * (last - first) or 1.0
    return first - room, last + room


def _draw_levels(axis: Axes, item: Spectrum) -> None:
    """Draw the levels of one period by its Fourier series beside the density's."""
    waves, stated = variance_in_bands(*item.variances())
    x = item.length * np.arange(2 * item.pieces) / (2 * item.pieces)
    lines = 2.0 * np.abs(np.fft.rfft(item.course(RADIUS).value(x)) / len(x)) ** 2
    k = np.arange(len(lines)) / item.length
    inside = (k > (1.0 - 1e-9) / item.band[1]) & (k < (1.0 + 1e-9) / item.band[0])
    found = variance_in_bands(k[inside], lines[inside])
    axis.semilogx(waves, 10.0 * np.log10(stated / ZERO_DB**2), "-s", color=BLUE, markersize=2, label="stated")
    axis.semilogx(
        found[0],
        10.0 * np.log10(found[1] / ZERO_DB**2),
        "o",
        color=GREEN,
        markersize=6,
        fillstyle="none",
        label="realised",
    )
    limit = published_density(LIMIT)
    if limit.known is not None and item.curve != LIMIT and item.band[0] < limit.known[1]:
        axis.semilogx(*bands_of_levels(LIMIT), "--.", color=RED, markersize=3, label=f"limit of {LIMIT}")
    axis.invert_xaxis()
    axis.set(xlabel="wavelength [m]", ylabel="third-octave level [dB re 1 µm]")
    legend_above(axis)
