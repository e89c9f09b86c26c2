"""The verb `plot`: pictures of all results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.ask.marks import Marks
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.wagon import Wagon, wagon_for
from wheeltapper.diagnosis.finding import Finding
from wheeltapper.diagnosis.force.imitation_map import TITLE as IMITATION
from wheeltapper.diagnosis.force.reconstruction import Force
from wheeltapper.diagnosis.performance import Performance
from wheeltapper.diagnosis.site.design import Design
from wheeltapper.faces.charts import draw_border, draw_chart, features_of
from wheeltapper.faces.findings import draw_design, draw_finding, draw_imitation, draw_performance
from wheeltapper.faces.irregularities import draw_irregularity
from wheeltapper.faces.joints import draw_limits
from wheeltapper.faces.orbits import DRAWN, draw_orbit, draw_traces, is_traces
from wheeltapper.faces.panels import RED, legend_above
from wheeltapper.faces.rails import draw_on_rails
from wheeltapper.faces.results import draw_comfort, draw_force, draw_recording, draw_records
from wheeltapper.faces.tracks import TRACKS
from wheeltapper.faces.vehicles import draw_modes, draw_modes_over_speed, draw_vehicle, is_modes
from wheeltapper.faces.wagons import draw_comparison, draw_wagon, history_with_events
from wheeltapper.faces.wear import draw_marks, draw_wear
from wheeltapper.ground.arguments import as_count, as_list, as_path
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import BOGIE, FLEXIBLE_TRACK, SEVERAL_BODIES, WHEELSETS
from wheeltapper.record.labels import CHART_TITLE, WEAR_TITLE
from wheeltapper.record.limits.comparison import LimitCheck
from wheeltapper.record.record import Record
from wheeltapper.record.recording import Recording

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wheeltapper.orbits.orbit import Orbit

    Labelled = xr.Dataset | xr.DataArray

STYLE = Path(__file__).with_name("wheeltapper.mplstyle")
"""The style sheet of all figures."""


def plot(
    what: Record | list[Record] | Vehicle | Irregularity | Recording | Force | Marks | Finding | Design | Performance
    | LimitCheck | Orbit | Labelled | list[xr.Dataset],
    path: str | Path | None = None,
    features: list[str] | None = None,
    border: xr.Dataset | None = None,
    against: Record | None = None,
    wheelset: int = 1,
) -> Figure:  # fmt: skip
    """Draw a result: a record or several, a chart, a recording, a finding, modes and the like; or a wagon.

    A record: path and wheel, normal force with losses shaded and impacts marked, and the deck if there is one. The
    record of a wagon: normal forces of all wheels, and the acceleration of the car body. A chart of two varied fields:
    level curves of each feature, with arrows of the gradient and its specificity if there are gradients; cells without
    a value or a reliable gradient are hatched. A chart of one field: lines; of samples: clouds. A wagon: side view, end
    view and plan, with its elements by name. Its modes: their roots, and the shapes of those that last longest.

    Parameters
    ----------
    what
        Result of `simulate`, `sweep`, `marks`, `wear_in`, `diagnose`, `assess`, `design_site`, `modes`, `comfort`,
        `reconstructed`, `read_recording`, `load`, `limits.check`, a function of `orbits` or `tracks`; a `Wagon`; an
        irregularity; or a list of records of a wheelset, whose forces are drawn over each other, of modes at rising
        speeds, or of borders from `orbits.trace`.
    path
        Path of the picture; None: it is only returned.
    features
        Features of a chart that are drawn; by default all.
    border
        Result of `wheeltapper.border`, drawn over a chart of the same two fields.
    against, wheelset
        For a wagon's record: the record of a core model, such as that of `wheeltapper.reduced`. It is drawn over the
        response of this wheelset, with the differences in peaks, intervals and times.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, which is not registered with pyplot: show it in a notebook, or save it.
    """
    import matplotlib.style

    path = None if path is None else as_path(path, "path", "the path of a .png, .pdf or .svg")
    if features is not None:
        features = as_list(features, "features", "names of the chart's features")
        if not features:
            raise InputError("", "features", "none", "names of the chart's features, or None for all")
    if border is not None and "line" not in getattr(border, "data_vars", ()):
        raise InputError("", "border", value_text(border), "what `wheeltapper.border` returned")
    if against is not None and not isinstance(against, Record):
        raise InputError("", "against", value_text(against), "a Record")
    wheelset = as_count(wheelset, "wheelset")
    if against is None and wheelset != 1:
        raise InputError("", "wheelset", f"{wheelset} without `against`", "1, or a record to draw over that wheelset's")
    title = getattr(what, "attrs", {}).get("title")
    for name, given in (("features", features), ("border", border)):
        if given is not None and title != CHART_TITLE:
            raise InputError("", name, value_text(given), "None, unless `what` is a chart")
    with matplotlib.style.context(STYLE):
        if against is not None:
            if not isinstance(what, Record) or SEVERAL_BODIES not in what.scenario.needs:
                raise InputError("", "against", "a record to draw over", "None, unless `what` is the record of a wagon")
            figure = draw_comparison(what, against, wheelset)
        elif title == CHART_TITLE:
            figure = _drawn_chart(what, features, border)
        else:
            figure = _drawer_of(what)(what)
        if path is not None:
            save(figure, path)
    return figure


def _drawer_of(what: Any) -> Callable[[Any], Figure]:
    """Return the function that draws a result: by its kind, by its title, or by what it holds."""
    from wheeltapper.orbits.orbit import Orbit

    by_kind: dict[type, Callable[[Any], Figure]] = {
        Record: _drawn_record, Vehicle: _drawn_vehicle, Irregularity: draw_irregularity, Marks: draw_marks,
        Finding: draw_finding, Design: draw_design, LimitCheck: draw_limits, Performance: draw_performance,
        Recording: draw_recording, Force: draw_force, Orbit: draw_orbit,
    }  # fmt: skip
    by_title: dict[str, Any] = {**TRACKS, **DRAWN, WEAR_TITLE: draw_wear, IMITATION: draw_imitation}
    title, variables = str(getattr(what, "attrs", {}).get("title")), set(getattr(what, "data_vars", ()))
    found = next((draw for kind, draw in by_kind.items() if isinstance(what, kind)), by_title.get(title))
    if found is not None:
        return found
    if is_traces(what):
        return draw_traces
    if isinstance(what, list | tuple):
        return draw_modes_over_speed if len(what) and all(map(is_modes, what)) else draw_records
    if is_modes(what):
        return draw_modes
    if {"weighted_acceleration", "mean_comfort"} <= variables:
        return draw_comfort
    raise InputError("", "what", value_text(what), "a Record, a chart, an evolution, marks, a finding or the like")


def _drawn_chart(chart: Any, features: list[str] | None, border: xr.Dataset | None) -> Figure:
    from matplotlib.figure import Figure

    chosen = features_of(chart) if features is None else features
    figure = Figure()
    draw_chart(figure, chart, chosen)
    if border is not None:
        draw_border(figure, chart, border)
    return figure


def _drawn_vehicle(vehicle: Vehicle) -> Figure:
    wagon = wagon_for(vehicle)
    if not isinstance(wagon, Wagon):
        raise InputError("", "what", value_text(vehicle), "a Wagon; other vehicles have no bodies to draw")
    return draw_vehicle(wagon)


def _drawn_record(record: Record) -> Figure:
    if SEVERAL_BODIES in record.scenario.needs:
        return draw_wagon(record)
    in_the_plane = record.scenario.needs & {FLEXIBLE_TRACK, WHEELSETS, BOGIE}
    return draw_on_rails(record) if in_the_plane else _drawn_figure(record)


def _drawn_figure(record: Record) -> Figure:
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


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure; refuse a path that cannot be written."""
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise InputError(
            str(path), "plot", f"a place or suffix that cannot be written ({error})", "a writable .png, .pdf or .svg"
        ) from error


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
