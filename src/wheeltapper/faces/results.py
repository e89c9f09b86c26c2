"""Pictures of what is not a record: recordings, forces, modes, comfort; and of several records together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.diagnosis.force.reconstruction import Force
from wheeltapper.faces.panels import BLUE, RED, legend_above
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.record.record import Record
from wheeltapper.record.recording import Recording

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCALES = {"deck acceleration": (1.0, "m/s²"), "force": (1e-3, "kN")}
"""Factor and unit in which a recording's quantity is drawn."""
MOST = 8
"""Most records in one picture; more lines could not be told apart."""


def draw_recording(recording: Recording) -> Figure:
    """Draw the samples over time; clipped ones are marked, missing ones are gaps."""
    figure, axis = _one_panel()
    factor, unit = SCALES[recording.quantity]
    times, samples = 1e3 * recording.times, factor * recording.samples
    axis.plot(times, samples, color=BLUE, linewidth=0.8, label="recorded")
    if recording.clipped.any():
        axis.plot(times[recording.clipped], samples[recording.clipped], "x", color=RED, markersize=3, label="clipped")
        legend_above(axis)
    axis.set(xlabel="time after the trigger [ms]", ylabel=f"{recording.quantity} [{unit}]")
    figure.suptitle(recording.source or "recording")
    return figure


def draw_force(force: Force) -> Figure:
    """Draw a reconstructed force over time, with twice its standard error where that is finite."""
    figure, axis = _one_panel()
    times, middle, half = 1e3 * force.times, force.force / 1e3, 2e-3 * force.deviation
    half = np.where(np.isfinite(half), half, np.nan)
    axis.fill_between(
        times, middle - half, middle + half, color=RED, alpha=0.3, linewidth=0, label="± 2 standard errors"
    )
    axis.plot(times, middle, color=BLUE, linewidth=0.9, label="normal force")
    axis.set(xlabel="time after the trigger [ms]", ylabel="normal force [kN]")
    legend_above(axis)
    figure.suptitle(
        f"force by the method “{force.method}”, within 1 % from {force.band[0]:.3g} to {force.band[1]:.3g} Hz"
    )
    return figure


def draw_modes(modes: xr.Dataset) -> Figure:
    """Draw frequency and damping ratio of each mode, by its name."""
    from matplotlib.figure import Figure

    count = modes.sizes["mode"]
    figure = Figure(figsize=(10.0, 1.5 + 0.2 * count))
    frequencies, ratios = figure.subplots(1, 2, sharey=True)
    rows = np.arange(count)
    frequencies.plot(modes.frequency, rows, "o", color=BLUE, markersize=4)
    frequencies.set_yticks(rows, [str(name) for name in modes.name.values], fontsize=7)
    frequencies.set(xscale="log", xlabel="frequency [Hz]", ylim=(count - 0.5, -0.5))
    ratios.plot(100.0 * modes.damping_ratio, rows, "o", color=RED, markersize=4)
    ratios.axvline(0.0, color="0.5", linewidth=0.8)
    ratios.set(xlabel="damping ratio [%]")
    figure.suptitle(f"modes at {float(modes.attrs['speed']):g} m/s")
    return figure


def draw_comfort(comfort: xr.Dataset) -> Figure:
    """Draw the weighted acceleration of each block along each axis."""
    figure, axis = _one_panel()
    for name in comfort.axis.values:
        block = comfort.continuous_comfort.sel(axis=name)
        axis.plot(comfort.block, block, "o-", markersize=4, label=str(name))
    axis.set(xlabel="end of the block [s]", ylabel="weighted acceleration [m/s²]", ylim=(0.0, None))
    legend_above(axis)
    figure.suptitle(f"comfort, {comfort.attrs['body']}: mean comfort (EN 12299) {float(comfort.mean_comfort):.3g}")
    return figure


def draw_records(records: Sequence[Any]) -> Figure:
    """Draw the normal forces of several records of a wheelset over each other."""
    if not 1 <= len(records) <= MOST:
        raise InputError("", "what", f"a list of {len(records)}", f"1 to {MOST} records")
    figure, axis = _one_panel()
    figure.set_size_inches(10.0, 4.5 + 0.2 * len(records))
    for number, record in enumerate(records):
        if not isinstance(record, Record) or SEVERAL_BODIES in record.scenario.needs:
            raise InputError("", f"what.{number}", value_text(record), "the record of a wheelset")
        times = np.unique(np.concatenate([np.linspace(0.0, record.end, 4000), record.peaks.time.values]))
        history = record.at(times)
        axis.plot(1e3 * history.time, history.normal_force / 1e3, linewidth=0.9, label=f"{number}: {record}")
    axis.set(xlabel="time [ms]", ylabel="normal force [kN]")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), fontsize=7)
    return figure


def _one_panel() -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5))
    return figure, figure.subplots()
