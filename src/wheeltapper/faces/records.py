"""Pictures of a run: path and wheel, the contact force with losses shaded and impacts marked, and the deck."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.faces.panels import RED, legend_above
from wheeltapper.faces.rails import draw_in_plane
from wheeltapper.faces.wagons import draw_wagon, history_with_events
from wheeltapper.ground.needs import BOGIE, FLEXIBLE_TRACK, SEVERAL_BODIES, WHEELSETS
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw_record(record: Record) -> Figure:
    """Draw a run: of a wheel its path, force and deck; on rails these, too; of a wagon the forces of all wheels."""
    if SEVERAL_BODIES in record.scenario.needs:
        return draw_wagon(record)
    in_the_plane = record.scenario.needs & {FLEXIBLE_TRACK, WHEELSETS, BOGIE}
    return draw_in_plane(record) if in_the_plane else _draw_wheel(record)


def _draw_wheel(record: Record) -> Figure:
    from matplotlib.figure import Figure

    history = history_with_events(record)
    has_deck = "deck_acceleration" in history
    figure = Figure(figsize=(8.0, 7.5 if has_deck else 6.0))
    axes = figure.subplots(3 if has_deck else 2, 1, sharex=True)
    _draw_motion(axes[0], history)
    _draw_force(axes[1], record, history)
    if has_deck:
        axes[2].plot(1e3 * history.time, history.deck_acceleration)
        axes[2].set_ylabel("deck acceleration [m/s²]")
    for axis in axes:
        shade_losses(axis, record)
    for axis in axes[:2]:
        legend_above(axis)
    axes[-1].set_xlabel("time [ms]")
    figure.suptitle(str(record), fontsize=9)
    return figure


def _draw_motion(axis: Axes, history: Any) -> None:
    time = 1e3 * history.time
    axis.plot(time, 1e6 * history.constraint, color="0.5", label="path over the irregularity")
    axis.plot(time, 1e6 * history.wheel_displacement, label="wheel's centre")
    axis.set_ylabel("displacement [µm]")


def _draw_force(axis: Axes, record: Record, history: Any) -> None:
    axis.plot(1e3 * history.time, history.normal_force / 1e3)
    axis.axhline(record.static_force / 1e3, color="0.5", linewidth=0.8, linestyle="--", label="static")
    impacts = record.events.time.values[record.events.kind.values == "impact"]  # quicker than all of `impacts`
    axis.plot(1e3 * impacts, np.zeros_like(impacts), "v", markersize=4, color=RED, label="impact")
    axis.set_ylabel("normal force [kN]")


def shade_losses(axis: Axes, record: Record) -> None:
    """Shade the times without contact on an axis in milliseconds."""
    kinds, times = record.events.kind.values, record.events.time.values
    starts = times[kinds == "loss"]
    ends = np.append(times[kinds == "impact"], record.end)
    lengths = ends[np.searchsorted(ends[:-1], starts)] - starts
    if len(starts):  # one collection: a span for each loss takes a minute to make where there are thousands
        spans = list(zip(1e3 * starts, 1e3 * lengths, strict=True))
        over = axis.get_xaxis_transform()
        axis.broken_barh(spans, (0.0, 1.0), transform=over, color=RED, alpha=0.12, linewidth=0, label="out of contact")
