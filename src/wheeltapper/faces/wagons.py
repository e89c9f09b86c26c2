"""Pictures of wagons: the forces of all wheels, and one wheelset with its equivalent core model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.ask.reduced import compare_responses
from wheeltapper.faces.panels import BLUE, GREEN, RED, legend_above, number_text
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLES = 6_000
"""Number of points of a drawn history."""
STYLES = {"left": {"color": BLUE}, "right": {"color": RED, "linestyle": "--"}}


def history_with_events(record: Record) -> Any:
    """Return the history at uniform times, with every event and peak in it."""
    times = np.linspace(0.0, record.end, SAMPLES)
    return record.at(np.unique(np.concatenate([times, record.events.time.values, record.peaks.time.values])))


def draw_wagon(record: Record) -> Figure:
    """Draw the normal forces of all wheels, and the vertical acceleration of the first body."""
    from matplotlib.figure import Figure

    history = history_with_events(record)
    wheelsets = history.wheelset.values
    figure = Figure(figsize=(8.0, 1.7 * (len(wheelsets) + 1)))
    axes = figure.subplots(len(wheelsets) + 1, 1, sharex=True)
    forces = history.normal_force.values / 1e3
    low, high = float(forces.min()), float(forces.max())
    room = max(0.05 * (high - low), 0.01 * abs(high))  # forces at rest are lines, and no noise that looks like an event
    for axis, wheelset in zip(axes[:-1], wheelsets, strict=True):
        for side, style in STYLES.items():
            force = history.normal_force.sel(wheelset=wheelset, side=side)
            axis.plot(1e3 * history.time, force / 1e3, label=side, linewidth=0.9, **style)
        axis.ticklabel_format(useOffset=False)
        axis.set(ylabel="N [kN]", ylim=(low - room, high + room))
        axis.set_title(f"wheelset {wheelset}")
    legend_above(axes[0])
    body = str(history.body.values[0])
    axes[-1].plot(1e3 * history.time, history.acceleration.sel(body=body, motion="z"), color=GREEN)
    axes[-1].set(xlabel="time [ms]", ylabel="upwards [m/s²]")
    axes[-1].set_title(f"acceleration of the {body}")
    figure.align_ylabels(axes)
    figure.suptitle(str(record), fontsize=9)
    return figure


def draw_comparison(record: Record, other: Record, wheelset: int) -> Figure:
    """Draw the force on one wheelset and that of a core model over each other, and their differences."""
    from matplotlib.figure import Figure

    if SEVERAL_BODIES in other.scenario.needs:
        raise InputError("", "against", "the record of a wagon", "the record of a core model")
    count = len(record.scenario.vehicle.axles)
    if not 1 <= wheelset <= count:
        raise InputError("", "wheelset", str(wheelset), f"1 to {count}")
    found = compare_responses(record, other, wheelset)
    figure = Figure(figsize=(8.0, 6.5))
    forces, differences = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    history = history_with_events(record)
    both = history.normal_force.sel(wheelset=wheelset).sum("side")
    forces.plot(1e3 * history.time, both / 1e3, label=f"wheelset {wheelset} of the wagon")
    core = history_with_events(other)
    forces.plot(1e3 * core.time, core.normal_force / 1e3, "--", color=RED, label="core model")
    forces.set_ylabel("normal force of both wheels [kN]")
    legend_above(forces)
    _draw_differences(differences, found)
    figure.suptitle(_differences_text(found), fontsize=9)
    return figure


def _draw_differences(axis: Axes, found: Any) -> None:
    axis.plot(1e3 * found.peak_time, 100.0 * (found.peak_ratio - 1.0), "o", markersize=3, color=BLUE)
    axis.set(xlabel="time [ms]")
    axis.set_ylabel("peaks, difference [%]", color=BLUE)
    delays = axis.twinx()
    delays.plot(1e3 * found.event_time, 1e6 * found.event_delay, "s", markersize=3, color=RED)
    delays.set_ylabel("events, delay [µs]", color=RED)


def _differences_text(found: Any) -> str:
    """Return the largest differences as a sentence."""

    def largest_difference(values: Any) -> float:
        return float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else float("nan")

    peaks, intervals, events = (
        number_text(factor * largest_difference(values), 2)
        for factor, values in (
            (100.0, found.peak_ratio.values - 1.0), (100.0, found.interval_ratio.values - 1.0),
            (1e6, found.event_delay.values),
        )
    )  # fmt: skip
    return f"largest differences: peaks {peaks} %, intervals {intervals} %, events {events} µs"
