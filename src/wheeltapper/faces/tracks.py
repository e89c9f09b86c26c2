"""Pictures of what is asked of a track alone: receptance, static deflection, decay, and the pinned-pinned shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.faces.panels import BLUE, RED, legend_above
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SEAT = "seat"


def draw_receptance(receptance: xr.DataArray) -> Figure:
    """Draw modulus and phase over frequency, a line for each place."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.5))
    modulus, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    places = receptance if "place" in receptance.dims else receptance.expand_dims("place", -1)
    for number in range(places.sizes["place"]):
        line = _over_frequency(places.isel(place=number))
        modulus.loglog(line.frequency, 1e9 * np.abs(line), label=_place_words(line))
        phase.semilogx(line.frequency, np.degrees(np.angle(line)))
    _mark_pinned(modulus, receptance)
    modulus.set_ylabel("receptance [nm/N]")
    phase.set(xlabel="frequency [Hz]", ylabel="phase [°]", ylim=(-180.0, 0.0 if _is_direct(receptance) else 180.0))
    phase.set_yticks(np.arange(-180, 1 if _is_direct(receptance) else 181, 90))
    legend_above(modulus)
    return figure


def draw_static(deflection: xr.DataArray) -> Figure:
    """Draw the static deflection under the load over its place."""
    from matplotlib.figure import Figure

    if deflection.ndim != 1 or deflection.sizes["place"] < 2:
        raise InputError("", "what", "one static deflection", "those of two or more places")
    figure = Figure(figsize=(8.0, 4.0))
    axis = figure.subplots()
    along = deflection.sortby("where")
    axis.plot(along["where"], 1e9 * along, "-o" if along.size < 20 else "-", color=BLUE, markersize=4)
    _mark_seats(axis, deflection.attrs["spacing"], float(along["where"].min()), float(along["where"].max()))
    axis.set(xlabel="place of the load from a seat [m]", ylabel="deflection over force [nm/N]")
    legend_above(axis)
    return figure


def draw_decay(decay: xr.DataArray) -> Figure:
    """Draw the decay rate over frequency."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5))
    axis = figure.subplots()
    line = _over_frequency(decay)
    axis.loglog(line.frequency, line, color=BLUE)
    _mark_pinned(axis, decay)
    axis.set(xlabel="frequency [Hz]", ylabel="decay rate [dB/m]")
    legend_above(axis)
    return figure


def draw_pinned(frequency: xr.DataArray) -> Figure:
    """Draw how the rail vibrates at the pinned-pinned frequency."""
    from matplotlib.figure import Figure

    spacing = frequency.attrs["spacing"]
    figure = Figure(figsize=(8.0, 3.0))
    axis = figure.subplots()
    x = np.linspace(-0.25 * spacing, 3.25 * spacing, 400)
    axis.plot(x, np.sin(np.pi * x / spacing), color=BLUE)
    _mark_seats(axis, spacing, x[0], x[-1])
    axis.set(xlabel="place from a seat [m]", ylabel="deflection, relative", ylim=(-1.3, 1.3))
    legend_above(axis)
    figure.suptitle(f"pinned-pinned vibration of the rail, {float(frequency):.5g} Hz")
    return figure


def _over_frequency(line: xr.DataArray) -> xr.DataArray:
    """Return what can be drawn over a logarithmic axis: several frequencies, above zero, in order."""
    if "frequency" not in line.dims or int((line.frequency > 0.0).sum()) < 2:
        raise InputError("", "what", "values at fewer than two frequencies above zero", "those at two or more")
    return line.sortby("frequency").isel(frequency=np.sort(line.frequency.values) > 0.0)


def _is_direct(receptance: xr.DataArray) -> bool:
    return bool((receptance["where"] == receptance["at"]).all())


def _place_words(line: xr.DataArray) -> str:
    where, at = float(line["where"]), float(line["at"])
    return f"at {where:.4g} m" if where == at else f"at {at:.4g} m, force at {where:.4g} m"


def _mark_pinned(axis: Axes, data: xr.DataArray) -> None:
    axis.axvline(data.attrs["pinned_pinned"], color=RED, linewidth=0.8, linestyle="--", label="pinned-pinned")


def _mark_seats(axis: Axes, spacing: float, start: float, stop: float) -> None:
    seats = spacing * np.arange(np.ceil(start / spacing - 1e-9), np.floor(stop / spacing + 1e-9) + 1)
    for number, seat in enumerate(seats[:200]):
        axis.axvline(seat, color="0.6", linewidth=0.8, linestyle=":", label=SEAT if number == 0 else None)
