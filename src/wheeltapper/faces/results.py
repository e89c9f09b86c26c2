"""Pictures of what is not a record: recordings, forces, comfort; and of several records together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.diagnosis.force.reconstruction import Force
from wheeltapper.faces.panels import BLUE, GREEN, RED, legend_above, panels
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.record.record import Record
from wheeltapper.record.recording import Recording

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SCALES = {"deck acceleration": (1.0, "m/s²"), "force": (1e-3, "kN")}
"""Factor and unit in which a recording's quantity is drawn."""
MOST = 8
"""Most records in one picture; more lines could not be told apart."""


def draw_recording(recording: Recording) -> Figure:
    """Draw the samples over time; clipped ones are marked, missing ones are gaps."""
    figure, (axis,) = panels()
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
    figure, (axis,) = panels()
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


def draw_comfort(comfort: xr.Dataset) -> Figure:
    """Draw the weighted accelerations along each axis, their running r.m.s., and that of each block."""
    from matplotlib.figure import Figure

    has_blocks = bool(comfort.sizes["block"])
    figure = Figure(figsize=(9.0, 6.5 + 2.0 * has_blocks))
    axes = figure.subplots(2 + has_blocks, 1, sharex=True)
    for number, name in enumerate(comfort.axis.values):
        along = comfort.sel(axis=name)
        style = {"color": (BLUE, RED, GREEN)[number], "linewidth": 0.8}
        axes[0].plot(comfort.time, along.weighted_acceleration, label=str(name), **style)
        axes[1].plot(
            comfort.time, along.running_rms, label=_with_value("MTVV", along.maximum_transient_vibration), **style
        )
        if has_blocks:
            high = _with_value("95 %:", along.percentile_95)
            axes[2].plot(comfort.block, along.continuous_comfort, "o-", markersize=4, label=high, **style)
    rail = f"Wd and {comfort.attrs['vertical_weighting'].split()[0]}"
    means = "root mean square over"
    titles = (f"weighted by {rail}", f"{means} 1 s, by Wd and Wk (ISO 2631-1)", f"{means} 5 s, by {rail} (EN 12299)")
    for axis, title in zip(axes, titles, strict=False):
        axis.set_title(title)
        axis.set_ylabel("acceleration [m/s²]")
        legend_above(axis)
    for axis in axes[1:]:
        axis.set_ylim(bottom=0.0)
    axes[-1].set_xlabel("time [s]")
    mean = f"{float(comfort.mean_comfort):.3g}" if has_blocks else "unknown, it needs a block of 5 s"
    figure.suptitle(f"comfort, {comfort.attrs['body']}: mean comfort (EN 12299) {mean}")
    return figure


def _with_value(name: str, found: xr.DataArray) -> str:
    value = float(found)
    return f"{name} {round(value, 6):.3g} m/s²" if np.isfinite(value) else f"{name} unknown"


def draw_records(records: Sequence[Any]) -> Figure:
    """Draw the normal forces of several records of a wheelset over each other."""
    if not 1 <= len(records) <= MOST:
        raise InputError("", "what", f"a list of {len(records)}", f"1 to {MOST} records")
    figure, (axis,) = panels()
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
