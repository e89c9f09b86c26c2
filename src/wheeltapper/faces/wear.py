"""Pictures of marks, and of the wear of rails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.ask.marks import Marks
from wheeltapper.faces.panels import RED, legend_above

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

WIDE, THIN = {"linewidth": 3.0, "alpha": 0.4}, {"linewidth": 1.0}
"""Lines of the virgin and the worn rail, which may lie on each other."""
EACH: dict[str, Any] = {"marker": "o", "markersize": 3}
"""Lines over passes, of which there may be few."""
NOISE = 1e-3
"""Smallest amplitude, over the largest one, whose growth is drawn; below it there is only rounding and leakage."""
PARTS = {"elastic": "elastic", "shakedown": "shakes down", "ratcheting": "ratchets"}


def draw_wear(wear: xr.Dataset) -> Figure:
    """Draw an evolution: the rail before and after, its spectrum and growth, and the results of the passes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 12.0))
    axes = figure.subplots(4, 2)
    first, last = wear.isel(kept=0), wear.isel(kept=-1)
    profile, marks = axes[0]
    states = ((first, "virgin", WIDE), (last, f"after {int(last.kept)} passes", THIN))
    for one, words, line in states:
        for side, height in _by_side(one.height):
            profile.plot(1e3 * one.position, 1e6 * height, label=" ".join([words, side]).strip(), **line)
    profile.set(xlabel="position [mm]", ylabel="height [µm]")
    legend_above(profile)
    for side, left in _by_side(last.permanent_indentation):
        marks.plot(1e3 * last.position, 1e6 * left, label=side)
    marks.set(xlabel="position [mm]", ylabel="permanent indentation [µm]")
    spectrum, growth = axes[1]
    for one, words, line in states:
        for side, amplitude in _by_side(one.amplitude):
            label = " ".join([words, side]).strip()
            spectrum.loglog(1e3 * one.wavelength, 1e6 * np.maximum(amplitude, 1e-12), label=label, **line)
    spectrum.set(xlabel="wavelength [mm]", ylabel="amplitude [µm]")
    legend_above(spectrum)
    if wear.sizes["kept"] > 1:
        real = first.amplitude > NOISE * float(first.amplitude.max())
        rate = np.log(last.amplitude / first.amplitude) / float(last.kept)
        for _, values in _by_side(rate.where(real)):
            growth.semilogx(1e3 * wear.wavelength, values, "o-", markersize=3)
    growth.axhline(0.0, color="0.5", linewidth=0.8)
    growth.set(xlim=spectrum.get_xlim(), xlabel="wavelength [mm]", ylabel="mean growth rate [1/pass]")
    growth.set_title("waves of at least a thousandth of the highest one")
    force, share = axes[2]
    number = wear["pass"]
    force.plot(number, wear.largest_force / wear.attrs["static_force"], **EACH)
    force.set(xlabel="pass", ylabel="largest force over static")
    work = force.twinx()
    work.plot(number, wear.plastic_work, color=RED, linestyle="--", **EACH)
    work.set_ylabel("plastic work [J], dashed")
    share.stackplot(number, *(100.0 * wear[name] for name in PARTS), labels=list(PARTS.values()))
    share.set(xlabel="pass", ylabel="share of the length [%]", ylim=(0.0, 100.0))
    legend_above(share)
    impacts, strongest = axes[3]
    impacts.plot(number, wear.impacts_per_metre, **EACH)
    impacts.set(xlabel="pass", ylabel="impacts [1/m]", ylim=(0.0, None))
    highest = first.amplitude.max("side") if "side" in wear.dims else first.amplitude
    loudest = wear.amplitude.isel(wavelength=int(highest.values.argmax()))
    for side, amplitude in _by_side(loudest):
        strongest.plot(wear.kept, 1e6 * amplitude, label=side, **EACH)
    strongest.set(xlabel="passes made", ylabel=f"amplitude at {1e3 * float(loudest.wavelength):.3g} mm [µm]")
    for axis in figure.axes:
        if axis not in (spectrum, growth):
            axis.ticklabel_format(useOffset=False)
    for axis in (force, share, impacts, strongest):
        axis.xaxis.get_major_locator().set_params(integer=True)
    figure.suptitle(f"{int(wear.sizes['pass'])} passes: {wear.attrs['ended']}", fontsize=9)
    return figure


def _by_side(values: xr.DataArray) -> list[tuple[str, xr.DataArray]]:
    """Return values of the left and the right rail, of a wagon; others as they are, without a name."""
    if "side" not in values.dims:
        return [("", values)]
    return [(f"{side} rail", values.sel(side=side)) for side in values.side.values]


def draw_marks(marks: Marks) -> Figure:
    """Draw the marks of one pass on the rail and around the wheel."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.5))
    rail, wheel = figure.subplots(2, 1)
    for side, one in _by_side(marks.table.rail):
        rail.plot(1e3 * marks.table.position, 1e6 * one, label=side)
    if "side" in marks.table.dims:
        legend_above(rail)
    rail.set(xlabel="position along the rail [mm]", ylabel="rail [µm]")
    wheel.plot(1e3 * np.array(marks.wheel.places), 1e6 * np.array(marks.wheel.deviations))
    wheel.set(xlabel="arc around the wheel [mm]", ylabel="wheel [µm]")
    figure.suptitle("; ".join(marks.notes), fontsize=9)
    return figure
