"""The figure of plastic deformation: the laws, and their marks on a corrugated rail."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.panels import legend_above
from wheeltapper.faces.paper.plastic import AT_RESONANCE, BEYOND_RESONANCE, WAVELENGTH, yielding_corrugation
from wheeltapper.faces.paper.setting import STATIC

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LAWS = {
    "Thornton": wt.contact.Thornton(), "Stronge": wt.contact.Stronge(),
    "Jackson and Green": wt.contact.JacksonGreen(), "Kogut and Etsion": wt.contact.KogutEtsion(),
}  # fmt: skip
LARGEST = 3.0
"""Largest indentation over that at yield in the picture of the laws."""


def _draw_laws(axis: Axes) -> None:
    """Draw loading and unloading of the laws, over force and indentation at yield."""
    elastic = np.linspace(0.0, 1.0, 60)
    for name, law in LAWS.items():
        loaded = np.linspace(1.0, LARGEST, 200)
        top, left = float(law.loading(LARGEST)), float(law.residual(LARGEST))
        back = np.linspace(left, LARGEST, 200)
        (line,) = axis.plot(np.append(elastic, loaded), np.append(elastic**1.5, law.loading(loaded)))
        line.set_label(name)
        axis.plot(back, top * ((back - left) / (LARGEST - left)) ** 1.5, color=line.get_color(), linestyle="--")
    axis.plot(
        np.linspace(0.0, LARGEST, 200),
        np.linspace(0.0, LARGEST, 200) ** 1.5,
        color="black",
        linestyle=":",
        label="Hertz",
    )
    axis.plot([], [], "k-", label="loading")
    axis.plot([], [], "k--", label="unloading")
    axis.set(xlabel="indentation over that at yield", ylabel="force over that at yield", title="the laws")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=4, fontsize=8)


def _draw_profile(axis: Axes, speed: float, passes: int, hardening: float) -> None:
    """Draw some waves of the rail before and after the passes."""
    worn = wt.wear_in(yielding_corrugation(speed), passes, hardening=hardening)
    shown = worn.sel(position=slice(1.5, 1.5 + 6 * WAVELENGTH))
    for index, label in ((0, "virgin"), (-1, f"after {passes} wheels" if passes > 1 else "after a wheel")):
        axis.plot(1e3 * shown.position, 1e6 * shown.height[index], label=label)
    axis.set(xlabel="position [mm]", ylabel="height [µm]", title=f"the rail, {speed:g} m/s")
    legend_above(axis)


def plastic(figure: Figure) -> None:
    """Draw the laws, crests that are smoothed beyond resonance, marks at resonance, and the effect of hardening."""
    figure.set_size_inches(10.0, 8.0)
    laws, beyond, at, forces = figure.subplots(2, 2).ravel()
    _draw_laws(laws)
    _draw_profile(beyond, BEYOND_RESONANCE, 100, 0.0)
    _draw_profile(at, AT_RESONANCE, 1, 1.0)
    for hardening, label in ((1.0, "hardening"), (0.0, "no hardening, until they run away")):
        worn = wt.wear_in(yielding_corrugation(AT_RESONANCE), 30, hardening=hardening)
        forces.plot(worn["pass"], worn.largest_force / STATIC, "o-", markersize=3, label=label)
    forces.set(xlabel="wheel", ylabel="largest N/N₀", title=f"at {AT_RESONANCE:g} m/s", ylim=(0.0, None))
    legend_above(forces)
    figure.suptitle("C44, C48, C49: plastic deformation of a corrugated rail, 50 µm, 5 cm")


DRAW: dict[str, Callable[[Figure], None]] = {"plastic": plastic}
