"""Pictures of sites: where their sensors lie along the track, and what a sensor lets through."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.sensor.along import AlongTrack, AtSeat
from wheeltapper.describe.sensor.base import Sensor
from wheeltapper.describe.sensor.deck_acceleration import DeckAcceleration
from wheeltapper.describe.site import Site
from wheeltapper.faces.panels import BLUE, COLOURS, RED, legend_above, panels
from wheeltapper.faces.scenarios import draw_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HIGHEST = 0.5
"""The highest frequency that is drawn, over the rate of samples."""


def draw_site(site: Site) -> Figure:
    """Draw the places of the sensors along the track, and the deck with its irregularity."""
    has_passage = site.passage is not None
    rows = int(bool(site.sensors)) + 2 * int(has_passage)
    figure, axes = panels(rows, 1.0 + 2.6 * rows)
    if site.sensors:
        _draw_places(axes[0], site.sensors, site.spacing)
    if has_passage:
        draw_path(axes[-2], site.passage)
        _draw_response(axes[-1], site.sensor)
        axes[-1].set_title(f"the deck's sensor: {_sensor_words(site.sensor)}")
    passage = f", passages at {float(site.passage.speed):g} m/s over a deck" if has_passage else ""
    sensors = f", {len(site.sensors)} sensors along the track" if site.sensors else ""
    figure.suptitle(f"site {site.name}".rstrip() + passage + sensors, x=0.02, ha="left")
    return figure


def _draw_places(axis: Axes, sensors: tuple[AlongTrack, ...], spacing: float | None) -> None:
    """Draw each sensor in the row of its rail."""
    rails = list(dict.fromkeys(sensor.side or "both rails" for sensor in sensors))
    for sensor in sensors:
        row, colour = rails.index(sensor.side or "both rails"), _colour_of(sensor)
        label = None if sensor.kind in axis.get_legend_handles_labels()[1] else sensor.kind
        ends = sensor.extent(spacing)
        axis.plot(ends, [row, row], "s-", color=colour, linewidth=4.0, markersize=5, label=label)
        axis.annotate(sensor.name, (0.5 * sum(ends), row), (0, 7), textcoords="offset points", ha="center", fontsize=7)
    axis.set_yticks(range(len(rails)), rails)
    axis.set(xlabel="x, along the track [m]", ylim=(len(rails) - 0.5, -0.6))
    legend_above(axis, 4)


def _colour_of(sensor: AlongTrack) -> str:
    kinds = [kind.__name__ for kind in makeable_nouns(AlongTrack)]
    return COLOURS[kinds.index(type(sensor).__name__) % len(COLOURS)]


def _sensor_words(sensor: DeckAcceleration) -> str:
    said = [f"{sensor.rate / 1e3:g} kHz"]
    said += [] if sensor.cutoff is None else [f"filter of order {sensor.order} at {sensor.cutoff / 1e3:g} kHz"]
    said += [] if sensor.range is None else [f"range ± {sensor.range:g} m/s²"]
    return ", ".join(said)


def _draw_response(axis: Axes, sensor: DeckAcceleration) -> None:
    """Draw what the filter before the converter lets through: Butterworth's 1/√(1 + (f/f_c)^2n)."""
    frequency = np.geomspace(1.0, HIGHEST * sensor.rate, 300)
    cutoff = np.inf if sensor.cutoff is None else sensor.cutoff
    with np.errstate(over="ignore"):
        level = -10.0 * np.log10(1.0 + (frequency / cutoff) ** (2 * sensor.order))
    axis.semilogx(frequency, level, color=BLUE)
    axis.axvline(HIGHEST * sensor.rate, color=RED, linewidth=0.8, linestyle="--", label="half the rate of samples")
    axis.set(xlabel="frequency [Hz]", ylabel="transmission [dB]", ylim=(-80.0, 5.0))
    legend_above(axis)


def _draw_number(axis: Axes, sensor: Sensor, of: str, number: int, side: str, colour: str) -> None:
    """Draw a sensor at a place that has a number, as a seat or a wheelset."""
    axis.plot([number], [0], "s", color=colour, label=sensor.kind)
    axis.set_yticks([0], [side])
    axis.set(xlabel=f"{of} [number]", xlim=(number - 4, number + 4), ylim=(0.5, -0.6))
    legend_above(axis)


def draw_sensor(sensor: Sensor) -> Figure:
    """Draw what a deck's sensor lets through, or the place of a sensor on the track or on a vehicle."""
    figure, (axis,) = panels(1, 3.5)
    if isinstance(sensor, DeckAcceleration):
        _draw_response(axis, sensor)
        figure.suptitle(f"sensor of the deck: {_sensor_words(sensor)}", x=0.02, ha="left")
        return figure
    if isinstance(sensor, AtSeat) and sensor.seat is not None:
        _draw_number(axis, sensor, "seat", sensor.seat, sensor.side or "both rails", _colour_of(sensor))
    elif hasattr(sensor, "wheelset"):
        _draw_number(axis, sensor, "wheelset", sensor.wheelset, getattr(sensor, "side", None) or "both sides", BLUE)
    elif isinstance(sensor, AlongTrack):
        _draw_places(axis, (sensor,), None)
    figure.suptitle(f"sensor {sensor.name}", x=0.02, ha="left")
    return figure
