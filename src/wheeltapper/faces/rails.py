"""Pictures of runs on rails that give way, and of several wheelsets in the plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.faces.panels import BLUE, GREEN, RED, legend_above
from wheeltapper.faces.wagons import history_with_events
from wheeltapper.ground.needs import FLEXIBLE_TRACK
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLACES = 3_000
"""Number of points of the motion of rail and sleeper."""


def draw_in_plane(record: Record) -> Figure:
    """Draw the forces of all wheelsets, the rail under them, and rail and sleeper at one place.

    That is the first seat that is told to be an anomaly, or else where the force was largest.
    """
    from matplotlib.figure import Figure

    history = history_with_events(record)
    bends = FLEXIBLE_TRACK in record.scenario.needs
    figure = Figure(figsize=(8.0, 8.0 if bends else 3.5))
    axes = figure.subplots(3 if bends else 1, 1, sharex=True, squeeze=False)[:, 0]
    _draw_each(axes[0], history, history.normal_force / 1e3, "normal force [kN]")
    if bends:
        _draw_each(axes[1], history, 1e3 * history.rail_displacement, "rail under the wheel [mm]")
        _draw_place(axes[2], record)
    axes[-1].set_xlabel("time [ms]")
    figure.align_ylabels(axes.tolist())
    figure.suptitle(str(record), fontsize=9)
    return figure


def _draw_each(axis: Axes, history: Any, values: Any, label: str) -> None:
    """Draw a variable of each wheelset."""
    if "wheelset" not in values.dims:
        axis.plot(1e3 * history.time, values, linewidth=0.9)
    else:
        for wheelset in history.wheelset.values:
            axis.plot(1e3 * history.time, values.sel(wheelset=wheelset), linewidth=0.9, label=f"wheelset {wheelset}")
        legend_above(axis)
    axis.set_ylabel(label)


def _draw_place(axis: Axes, record: Record) -> None:
    """Draw what rail and sleeper do at an anomaly, or nearest to where the force was largest."""
    track = record.scenario.track
    named = [seat for item in track.anomalies for seat in item.places]
    x = record.scenario.speed * record.end / 2.0
    if record.peaks.sizes["peak"]:
        top = record.peaks.isel(peak=int(np.argmax(record.peaks.normal_force.data)))
        x = float(record.scenario.speed * top.time + record._contacts.position[int(top.contact)])
    seat = named[0] if named else round((x - track.first_sleeper) / track.spacing)
    x = track.first_sleeper + seat * track.spacing if named else x
    found = record.track(PLACES / record.end, rail=[x], seat=[seat])
    place = f"rail at x = {x:.3f} m"
    axis.plot(1e3 * found.time, 1e3 * found.rail_displacement.isel(rail=0), color=BLUE, linewidth=0.9, label=place)
    if "sleeper_displacement" in found:
        sleeper = 1e3 * found.sleeper_displacement.isel(seat=0)
        axis.plot(1e3 * found.time, sleeper, color=GREEN, linewidth=0.9, label=f"sleeper at seat {seat}")
    axis.set_ylabel("displacement [mm]")
    force = axis.twinx()
    force.plot(1e3 * found.time, found.pad_force.isel(seat=0) / 1e3, color=RED, linewidth=0.7, label=f"pad {seat}")
    force.set_ylabel("pad force [kN]", color=RED)
    if named and "ballast_force" in found:
        ballast = found.ballast_force.isel(seat=0) / 1e3
        force.plot(1e3 * found.time, ballast, color=RED, linewidth=0.7, linestyle="--")
        force.set_ylabel("pad force, ballast force (dashed) [kN]", color=RED)
        events = record.events
        for time in events.time.values[np.char.startswith(events.kind.values.astype(str), "void")]:
            axis.axvline(1e3 * time, color=GREEN, linewidth=0.5)
    legend_above(axis)
