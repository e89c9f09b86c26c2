"""Pictures of marks, and of the wear of rails."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.ask.marks import Marks

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

PARTS = {"elastic": "elastic", "shakedown": "shakes down", "ratcheting": "ratchets"}


def draw_wear(wear: xr.Dataset) -> Figure:
    """Draw an evolution: the rail before and after, its spectrum and growth, and the results of the passes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 12.0))
    axes = figure.subplots(4, 2)
    first, last = wear.isel(kept=0), wear.isel(kept=-1)
    profile, marks = axes[0]
    for one, words in ((first, "virgin"), (last, f"after {int(last.kept)} passes")):
        profile.plot(1e3 * one.position, 1e6 * one.height, label=words)
    profile.set(xlabel="position [mm]", ylabel="height [µm]")
    profile.margins(y=0.2)
    profile.legend(loc="upper right", ncols=2)
    marks.plot(1e3 * last.position, 1e6 * last.permanent_indentation)
    marks.set(xlabel="position [mm]", ylabel="permanent indentation [µm]")
    spectrum, growth = axes[1]
    for one, words in ((first, "virgin"), (last, f"after {int(last.kept)} passes")):
        spectrum.loglog(1e3 * one.wavelength, 1e6 * np.maximum(one.amplitude, 1e-12), label=words)
    spectrum.set(xlabel="wavelength [mm]", ylabel="amplitude [µm]")
    spectrum.legend()
    if wear.sizes["kept"] > 1:
        whole = np.log(last.amplitude / first.amplitude) / float(last.kept)
        growth.semilogx(1e3 * wear.wavelength, whole)
    growth.axhline(0.0, color="0.5", linewidth=0.8)
    growth.set(xlabel="wavelength [mm]", ylabel="mean growth rate per pass")
    force, share = axes[2]
    number = wear["pass"]
    force.plot(number, wear.largest_force / wear.attrs["static_force"])
    force.set(xlabel="pass", ylabel="largest force over static")
    work = force.twinx()
    work.plot(number, wear.plastic_work, color="C1", linestyle="--")
    work.set_ylabel("plastic work [J], dashed")
    share.stackplot(number, *(100.0 * wear[name] for name in PARTS), labels=list(PARTS.values()))
    share.set(xlabel="pass", ylabel="share of the length [%]", ylim=(0.0, 100.0))
    share.legend(loc="lower right", frameon=True)
    impacts, strongest = axes[3]
    impacts.plot(number, wear.impacts_per_metre)
    impacts.set(xlabel="pass", ylabel="impacts per metre", ylim=(0.0, None))
    loudest = wear.amplitude.isel(wavelength=int(first.amplitude.values.argmax()))
    strongest.plot(wear.kept, 1e6 * loudest)
    strongest.set(xlabel="passes made", ylabel=f"amplitude at {1e3 * float(loudest.wavelength):.3g} mm [µm]")
    figure.suptitle(f"{int(wear.sizes['pass'])} passes: {wear.attrs['ended']}", fontsize=9)
    return figure


def draw_marks(marks: Marks) -> Figure:
    """Draw the marks of one pass on the rail and around the wheel."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.5))
    rail, wheel = figure.subplots(2, 1)
    rail.plot(1e3 * marks.table.position, 1e6 * marks.table.rail)
    rail.set(xlabel="position along the rail [mm]", ylabel="rail [µm]")
    wheel.plot(1e3 * np.array(marks.wheel.places), 1e6 * np.array(marks.wheel.deviations))
    wheel.set(xlabel="arc around the wheel [mm]", ylabel="wheel [µm]")
    figure.suptitle("; ".join(marks.notes), fontsize=9)
    return figure
