"""Pictures of what is not a record: recordings, forces, comfort; and of several records together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.ask.study import unit_of
from wheeltapper.describe.noun import Noun
from wheeltapper.diagnosis.force.reconstruction import Force
from wheeltapper.faces.panels import BLUE, COLOURS, GREEN, RED, in_unit, legend_above, panels, words
from wheeltapper.ground.errors import InputError
from wheeltapper.record.record import Record
from wheeltapper.record.recordings.recording import Recording

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SCALES = {
    "deck acceleration": (1.0, "m/s²"), "force": (1e-3, "kN"), "displacement": (1e3, "mm"), "strain": (1e6, "µm/m"),
    "vertical acceleration": (1.0, "m/s²"),
}  # fmt: skip
"""Factor and unit in which a recording's quantity is drawn."""
MOST, MOST_APART = 8, 3
"""Most records in one picture, whose lines can be told apart, and most fields by which they are named."""


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


def draw_recordings(recordings: Sequence[Recording], names: Sequence[str] = ()) -> Figure:
    """Draw several recordings, such as the channels of a site, each in a panel of its own on one axis of time.

    Panels are named by the names, or else by number and source.
    """
    if len(recordings) > MOST:
        raise InputError("", "what", f"a list of {len(recordings)}", f"1 to {MOST} recordings")
    figure, axes = panels(len(recordings), 1.0 + 1.6 * len(recordings), sharex=True)
    for number, (axis, recording) in enumerate(zip(axes, recordings, strict=True)):
        factor, unit = SCALES[recording.quantity]
        axis.plot(1e3 * recording.times, factor * recording.samples, color=BLUE, linewidth=0.8)
        axis.set_ylabel(f"[{unit}]")
        source = "" if names else f", {recording.source or 'recording'}"
        axis.set_title(f"{names[number] if names else number + 1}: {recording.quantity}{source}".replace("_", " "))
    axes[-1].set_xlabel("time after the trigger [ms]")
    sources = {recording.source for recording in recordings}
    of_one = f": {Path(sources.pop()).name}" if names and len(sources) == 1 else ""
    figure.suptitle(f"{len(recordings)} recordings{of_one}".replace("_", " "), x=0.02, ha="left")
    return figure


def draw_records(records: Sequence[Record]) -> Figure:
    """Draw the normal forces of several records over each other, in a panel for each wheelset."""
    if len(records) > MOST:
        raise InputError("", "what", f"a list of {len(records)}", f"1 to {MOST} records")
    wheelsets = [_wheelsets_of(record) for record in records]
    for number, count in enumerate(wheelsets):
        if count != wheelsets[0]:
            found = f"a record of {count} wheelsets beside one of {wheelsets[0]}"
            raise InputError("", f"what.{number}", found, "records of as many wheelsets")
    count = wheelsets[0]
    figure, axes = panels(count, 2.5 + 2.0 * count + 0.2 * len(records), 10.0, sharex=True)
    for number, (record, label) in enumerate(zip(records, differences(records), strict=True)):
        times = np.unique(np.concatenate([np.linspace(0.0, record.end, 4000), record.peaks.time.values]))
        force = record.at(times).normal_force / 1e3
        for wheelset, axis in enumerate(axes, 1):
            one = force.sel(wheelset=wheelset) if "wheelset" in force.dims else force
            sides = one.side.values if "side" in one.dims else [None]
            for side in sides:
                axis.plot(
                    1e3 * times, one if side is None else one.sel(side=side), "--" if side == "right" else "-",
                    linewidth=0.9, color=COLOURS[number], label=None if side == "right" else label,
                )  # fmt: skip
    for wheelset, axis in enumerate(axes, 1):
        axis.set_ylabel("normal force [kN]")
        axis.ticklabel_format(useOffset=False)
        if count > 1:
            axis.set_title(f"wheelset {wheelset}")
    axes[-1].set_xlabel("time [ms]")
    axes[-1].legend(loc="upper center", bbox_to_anchor=(0.5, -0.16 * max(1.0, 0.6 * count)), fontsize=7)
    dashed = "; dashed: right" if "side" in force.dims else ""
    figure.suptitle(f"normal forces of {len(records)} runs{dashed}", x=0.02, ha="left")
    return figure


def _wheelsets_of(record: Record) -> int:
    forces = record.static_forces
    return int(forces.sizes.get("wheelset", 1))


def differences(records: Sequence[Record]) -> list[str]:
    """Return what sets each record apart: the fields of its scenario that not all share, or else what it tells."""
    fields = [_flat(record.scenario) for record in records]
    names = dict.fromkeys(name for one in fields for name in one)
    apart = [name for name in names if len({str(one.get(name)) for one in fields}) > 1]
    if not 1 <= len(apart) <= MOST_APART:
        return [f"{number}: {record}" for number, record in enumerate(records)]
    units = {name: _unit_of(records[0].scenario, name) for name in apart}
    return [", ".join(_said(name, one.get(name), units[name]) for name in apart) for one in fields]


def _unit_of(scenario: Any, path: str) -> str:
    try:
        return unit_of(scenario, path)
    except InputError:  # not a field of its own, or of another kind of noun
        return ""


def _flat(noun: Any, path: str = "") -> dict[str, Any]:
    """Return the fields of a scenario by their paths."""
    if isinstance(noun, Noun):
        found: dict[str, Any] = {path: type(noun).__name__} if path else {}
        for name in type(noun).model_fields:
            found |= _flat(getattr(noun, name), f"{path}.{name}".lstrip("."))
        return found
    if isinstance(noun, dict | tuple):
        items = noun.items() if isinstance(noun, dict) else enumerate(noun)
        return {name: value for key, item in items for name, value in _flat(item, f"{path}.{key}").items()}
    return {path: noun}


def _said(name: str, value: Any, unit: str) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        factor, unit = in_unit(value, unit)
        return f"{words(name)} {factor * value:.5g} {unit}".rstrip()
    return f"{words(name)} {'none' if value is None else value}"
