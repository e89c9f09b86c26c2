"""Pictures of charts: level curves with gradient arrows, lines, or clouds, depending on the cells."""

from __future__ import annotations

import json
import textwrap
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.paths import value_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.panels import BLUE, RED, Wheels, in_unit, legend_above, number_text, panels, with_unit, words
from wheeltapper.ground.arguments import check_choice
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
ARROWS = 12
"""Approximate number of gradient arrows along each axis."""
INSIDE = 0.45
"""So far from the middle of an axis, over its length, numbers of level curves are not cut."""
MOST_LEVELS, LARGEST_PART = 12, 0.25
"""Most level curves of a map, and the largest share of its cells between two of them at equal distances."""
MOST_TICKS = 6
"""Most intervals along a panel's axis, so that numbers of five digits have room."""
TITLE_WIDTH = 45
"""Most characters in a line of a panel's title."""
MOST_COLUMNS = 4
"""Largest number of panels beside each other."""
WITHOUT = "no value, or no reliable gradient"


def features_of(chart: xr.Dataset) -> list[str]:
    """Return the names of the features in a chart."""
    known = {"status", "gradient_status", "amplification", "condition"}
    parts = ("_gradient", "_elasticity", "_angle")
    return [str(name) for name in chart.data_vars if name not in known and not str(name).endswith(parts)]


def draw_chart_of_all(
    chart: xr.Dataset, features: list[str] | None = None, border: xr.Dataset | None = None, wheels: Wheels = "one"
) -> Figure:  # fmt: skip
    """Draw a chart's features, by default all, and a border over them; or the elasticities of a gradient."""
    from matplotlib.figure import Figure

    chosen = features_of(chart) if features is None else features
    for name in chosen:
        check_choice(name, "features", features_of(chart))
    if "value" in chart.coords:
        return draw_gradient(chart, chosen)
    figure = Figure()
    draw_chart(figure, chart, chosen, wheels)
    if border is not None:
        draw_border(figure, chart, border)
    return figure


def draw_gradient(found: xr.Dataset, features: list[str]) -> Figure:
    """Draw by how many per cent features change where a field changes by one per cent."""
    parts = [(f"{words(name)}{', ' if wheel else ''}{wheel}", one[f"{name}_elasticity"].values)
             for name in features for wheel, one in _of_each_wheel(found, name)]  # fmt: skip
    fields = [words(str(path), _scenario_of(found)) for path in found.parameter.values]
    rows = np.arange(len(fields))
    figure, (axis,) = panels(1, 1.6 + 0.25 * len(fields) * (len(parts) + 1))
    width = 0.8 / len(parts)
    for number, (label, values) in enumerate(parts):
        axis.barh(rows + (number - 0.5 * (len(parts) - 1)) * width, values, 0.9 * width, label=label)
    axis.axvline(0.0, color="0.4", linewidth=0.8)
    axis.set_yticks(rows, fields)
    axis.set(xlabel="change of the feature over that of the field [%/%]", ylim=(len(fields) - 0.5, -0.5))
    legend_above(axis)
    figure.suptitle("elasticities: gradients at the scenario's own values", x=0.02, ha="left", fontsize=9)
    return figure


def draw_border_alone(border: xr.Dataset) -> Figure:
    """Draw the curves of a border over its two fields."""
    first, second, *_ = (str(name) for name in border.data_vars if name != "line")
    figure, (axis,) = panels()
    (x, x_label), (y, y_label) = (_read(border, name) for name in (first, second))
    for line in np.unique(border.line.values):
        here = border.line.values == line
        axis.plot(x[here], y[here], color=BLUE, marker=".", markersize=3)
    axis.set(xlabel=x_label, ylabel=y_label)
    losses = int(border.attrs["losses"])
    figure.suptitle("border at which contact is first lost" if losses == 1 else f"border of the loss number {losses}")
    return figure


def draw_chart(figure: Figure, chart: xr.Dataset, features: list[str], wheels: Wheels = "one") -> None:
    """Draw some of a chart's features side by side: maps of two fields, lines over one, clouds of samples.

    The figure gets the size that they need. Of a feature that each wheel has, lines have one panel for all wheels; of
    maps and clouds there is that of the wheel in which it is largest, or one for each.
    """
    from matplotlib import rcParams

    for name in features:
        check_choice(name, "features", features_of(chart))
    drawn = [(name, some, field) for name in features for some in _in_panels(chart, name, wheels)
             for field in _fields_alone(chart, name)]  # fmt: skip
    columns = min(len(drawn), MOST_COLUMNS)
    rows = -(-len(drawn) // columns)
    figure.set_size_inches(4.6 * columns, 4.4 * rows)
    for number, (name, some, field) in enumerate(drawn, 1):
        axis = figure.add_subplot(rows, columns, number)
        (called, one), *others = some
        dimensions = one[name].dims
        if dimensions == ("cell",):
            _draw_cloud(axis, one, name, [field] if field else _sampled_fields(one))
        elif len(dimensions) == 1:
            _draw_lines(axis, some, name)
        elif len(dimensions) == 2:
            draw_map(axis, one, name)
        else:
            raise InputError(
                "",
                "chart",
                f"{len(dimensions)} varied fields",
                "one or two; choose a slice with chart.sel or chart.isel",
            )
        axis.locator_params(axis="x", nbins=MOST_TICKS)
        if called and not others:
            axis.set_title(f"{called}\n{axis.get_title(rcParams['axes.titlelocation'])}".rstrip(), fontsize=9)


Wheel = tuple[str, "xr.Dataset"]
"""What a wheelset, or a wheel, is called, and its chart."""


def _in_panels(chart: xr.Dataset, name: str, wheels: Wheels) -> list[list[Wheel]]:
    """Return the wheels of a feature, those together that share a panel."""
    every = _of_each_wheel(chart, name)
    dimensions = every[0][1][name].dims
    if len(every) == 1 or (len(dimensions) == 1 and dimensions != ("cell",)):
        return [every]
    if wheels == "all":
        return [[one] for one in every]
    called, most = max(every, key=lambda one: _largest(one[1][name].values))
    return [[(f"{called}: of {len(every)} the one in which it is largest", most)]]


def _largest(values: FloatArray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else -np.inf


def _of_each_wheel(chart: xr.Dataset, name: str) -> list[tuple[str, xr.Dataset]]:
    """Return the charts of all wheelsets, or wheels, with what each is called; "" where a feature has one value."""
    out = [("", chart)]
    if "wheelset" in chart[name].dims:
        out = [(f"wheelset {number}", chart.sel(wheelset=number)) for number in chart.wheelset.values]
    if "side" in chart[name].dims:
        out = [(f"{called}, {side}", one.sel(side=side)) for called, one in out for side in one.side.values]
    return out


def _read(chart: xr.Dataset, name: str) -> tuple[FloatArray, str]:
    """Return the values of a feature or a field in a unit that reads well, and its label."""
    values = np.asarray(chart[name].values, dtype=float)
    factor, unit = in_unit(values, chart[name].attrs.get("units", ""))
    return factor * values, with_unit(words(name, _scenario_of(chart)), unit)


def _scenario_of(chart: xr.Dataset) -> Scenario | None:
    """Return the chart's scenario; None if it is unknown."""
    return _scenario_in(str(chart.attrs.get("scenario", "")))


@lru_cache(maxsize=4)
def _scenario_in(text: str) -> Scenario | None:
    try:
        return Scenario.of(json.loads(text))
    except (TypeError, ValueError):
        return None


def _nominal_value(chart: xr.Dataset, path: str) -> float | None:
    """Return the value of the chart's scenario at a path; None if it is zero or unknown."""
    scenario = _scenario_of(chart)
    try:
        return None if scenario is None else float(value_at(scenario, path)) or None
    except (KeyError, TypeError, ValueError):
        return None


def _scaled_field(chart: xr.Dataset, path: str) -> tuple[FloatArray, float, str]:
    """Return a field's values over a unit, that unit, and the axis label.

    Of a chart with gradients it is the scenario's value, since arrows compare shares of fields.
    """
    values, scenario = np.asarray(chart[path].values, dtype=float), _scenario_of(chart)
    nominal = _nominal_value(chart, path) if "parameter" in chart.coords else None
    name, given = words(path, scenario), chart[path].attrs.get("units", "")
    if nominal is None:
        factor, unit = in_unit(values, given)
        return values * factor, 1.0 / factor, with_unit(name, unit)
    factor, unit = in_unit(nominal, given)
    return values / nominal, nominal, f"{name} over {number_text(factor * nominal)} {unit}".rstrip()


def _is_masked(chart: xr.Dataset, name: str) -> NDArray[np.bool_]:
    masked = np.isnan(chart[name].values)
    if "gradient_status" in chart:
        masked |= chart.gradient_status.values != 0
    return np.asarray(masked)


def draw_map(axis: Axes, chart: xr.Dataset, name: str) -> None:
    """Draw level curves of one feature over two fields, with gradient arrows, masked cells hatched."""
    second, first = (str(dimension) for dimension in chart[name].dims)
    x, x_unit, x_label = _scaled_field(chart, second)
    y, y_unit, y_label = _scaled_field(chart, first)
    values, title = _read(chart, name)
    values = values.T
    if min(values.shape) < 2:
        raise InputError("", "chart", f"a map of {values.shape[1]} x {values.shape[0]} cells", "at least 2 x 2")
    known = np.isfinite(values)
    if np.count_nonzero(known) > 3 and np.ptp(values[known]) > 0.0:
        curves = axis.contour(x, y, np.ma.array(values, mask=~known), levels=_levels(values[known]), colors=BLUE)
        numbers = axis.clabel(curves, fontsize=7, fmt=lambda level: number_text(level, 10), colors="black")
        for number in numbers:
            number.set(zorder=6, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})
            number.set_visible(all(map(_is_inside, number.get_position(), (x, y))))
    elif known.any():
        title += f"\n{values[known].flat[0]:.4g} wherever it is known"
    masked = _is_masked(chart, name).T
    if masked.any():
        axis.contourf(x, y, masked.astype(float), levels=[0.5, 1.5], colors="none", hatches=["////"])
    axis.set(xlabel=x_label, ylabel=y_label, xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))
    if f"{name}_gradient" in chart and {second, first} <= set(chart.parameter.values.tolist()):
        slopes = [chart[f"{name}_gradient"].sel(parameter=path).values.T for path in (second, first)]
        _draw_arrows(axis, x, y, slopes[0] * x_unit, slopes[1] * y_unit, masked)
        title += "\n" + _specificity_text(chart, name, (second, first))
    axis.set_title(title, fontsize=9)


def _levels(values: FloatArray) -> FloatArray:
    """Return the levels of a map's curves: round numbers at equal distances.

    Where these leave a large part of the map without curves, there are about as many values between each two instead,
    and the levels are as round as their distances allow.
    """
    from matplotlib.ticker import MaxNLocator

    whole = bool(np.all(values % 1.0 == 0.0))
    even = MaxNLocator(MOST_LEVELS, steps=[1, 2, 5, 10], integer=whole).tick_values(values.min(), values.max())
    if np.histogram(values, even)[0].max() < LARGEST_PART * len(values):
        return np.asarray(even[1:-1])
    levels = np.unique(np.quantile(values, np.linspace(0.02, 0.98, MOST_LEVELS)))
    if len(levels) < 2:
        return levels
    gaps = np.diff(levels)
    near = np.maximum(np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps)), 0.01 * np.ptp(levels))
    decade = 10.0 ** np.floor(np.log10(near))
    step = decade * np.array([1.0, 2.0, 5.0])[np.searchsorted([2.0, 5.0], near / decade, side="right")]
    return np.unique(np.round(levels / step) * step)


def _is_inside(at: float, ends: FloatArray) -> bool:
    """Return whether a number at this place is not cut by an end of its axis."""
    return bool(abs(at - 0.5 * (ends.min() + ends.max())) < INSIDE * np.ptp(ends))


def _draw_arrows(axis: Axes, x: FloatArray, y: FloatArray, dx: FloatArray, dy: FloatArray, masked: Any) -> None:
    """Draw unit vectors along the gradient in the relative coordinates of the axes."""
    rows, columns = (slice(None, None, max(1, len(values) // ARROWS)) for values in (y, x))
    size = np.where(masked, np.nan, np.hypot(dx, dy))
    with np.errstate(invalid="ignore", divide="ignore"):
        u, v = (dx / size)[rows, columns], (dy / size)[rows, columns]
    axis.quiver(
        x[columns], y[rows], u, v, color=RED, alpha=0.6, width=0.003, scale=ARROWS * 2.2, pivot="mid", zorder=1
    )  # fmt: skip


def _specificity_text(chart: xr.Dataset, name: str, paths: tuple[str, str]) -> str:
    """Return the angle of the feature to its nearest axis at the cell nearest to the scenario's values."""
    if f"{name}_angle" not in chart:
        return ""
    here = {path: _nominal_value(chart, path) for path in paths}
    if any(value is None for value in here.values()):
        return ""
    angles = chart[f"{name}_angle"].sel({path: here[path] for path in paths}, method="nearest")
    best = str(angles.parameter.values[int(np.nanargmin(angles.values))]) if np.isfinite(angles.values).any() else ""
    nearest = words(best, _scenario_of(chart))
    if not best:
        return ""
    said = f"{float(np.nanmin(angles.values)):.1f}° off the {nearest} at the scenario's own values"
    return textwrap.fill(said, TITLE_WIDTH)


def _draw_lines(axis: Axes, some: list[Wheel], name: str) -> None:
    """Draw a feature over one field, a line for each wheel."""
    _, chart = some[0]
    path = str(chart[name].dims[0])
    x, x_label = _read(chart, path)
    values = np.stack([one[name].values for _, one in some])
    factor, unit = in_unit(values, chart[name].attrs.get("units", ""))
    for (called, _), line in zip(some, factor * values, strict=True):
        axis.plot(x, line, label=called or None)
    axis.set(xlabel=x_label, ylabel=with_unit(words(name), unit))
    masked = np.all([_is_masked(one, name) for _, one in some], axis=0)
    for number, value in enumerate(x[masked]):
        axis.axvline(value, color="0.85", linewidth=2, zorder=0, label=None if number else WITHOUT)
    if masked.any() or len(some) > 1:
        legend_above(axis, 4)


def _sampled_fields(chart: xr.Dataset) -> list[str]:
    return [str(coordinate) for coordinate in chart.coords if chart[coordinate].dims == ("cell",)]


def _fields_alone(chart: xr.Dataset, name: str) -> list[str]:
    """Return the fields of which each has a panel of its own: those of samples of more than two; else "" for all."""
    fields = _sampled_fields(chart) if "cell" in chart[name].dims else []
    return fields if len(fields) > 2 else [""]


def _draw_cloud(axis: Axes, chart: xr.Dataset, name: str, paths: list[str]) -> None:
    """Draw a feature of samples over one field, or by its colour over two."""
    values, label = _read(chart, name)
    x, x_label = _read(chart, paths[0])
    if len(paths) == 1:
        axis.plot(x, values, ".")
        axis.set(xlabel=x_label, ylabel=label)
        return
    y, y_label = _read(chart, paths[1])
    dots = axis.scatter(x, y, c=values, s=8)
    axis.figure.colorbar(dots, ax=axis, label=label)
    axis.set(xlabel=x_label, ylabel=y_label)


def draw_border(figure: Figure, chart: xr.Dataset, border: xr.Dataset) -> None:
    """Draw the curves of a border over the maps of a chart."""
    dimensions = [str(name) for name in chart[features_of(chart)[0]].dims if name not in ("wheelset", "side")]
    if len(dimensions) != 2 or not set(dimensions) <= set(border.data_vars):
        raise InputError("", "border", f"a border over {sorted(map(str, border.data_vars))}", f"one over {dimensions}")
    second, first = dimensions
    x, y = (border[path].values / _scaled_field(chart, path)[1] for path in (second, first))
    for axis in figure.axes:
        for line in np.unique(border.line.values):
            here = border.line.values == line
            axis.plot(x[here], y[here], color="black", linewidth=2.0, zorder=5)
