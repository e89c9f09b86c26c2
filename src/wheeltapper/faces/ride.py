"""Pictures of a record's tables: histories, events, impacts, energy, readings of the track, and guiding forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.faces.panels import BLUE, COLOURS, RED, in_unit, legend_above, panels
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Y_LABELS = {
    "guiding_force": "Y [kN]",
    "wheel_force": "Q [kN]",
    "derailment_quotient": "Y/Q, ratio",
    "unloading": "ΔQ/Q₀, ratio",
    "sum_of_guiding_forces": "ΣY [kN]",
    "t_gamma": "T-gamma [N]",
}
"""What is drawn of `guidance`."""
LINES = {"left": "-", "right": "--"}
LARGEST = 3.0
"""Largest quotient or unloading that is drawn; a lifted wheel has an infinite one."""
ROUNDING = 1e-9
"""A sum of lateral forces over the vertical one that is only rounding."""
MARKS = "ovsd^x+"
POINTS = 60
MOST_LINES = 8


def _shown(values: Any, unit: str) -> tuple[NDArray[Any], str]:
    """Return values in a unit in which the largest reads well, and that unit."""
    held = np.asarray(values, dtype=float)
    factor, unit = in_unit(np.nanmax(np.abs(held), keepdims=True, initial=0.0), unit.replace("^2", "²"))
    return factor * held, unit


# -- over time --------------------------------------------------------------------------------------------------------


def draw_history(history: xr.Dataset) -> Figure:
    """Draw each variable of a history in a panel of its own; of several wheels, a line for each."""
    names = [
        str(name) for name in history.data_vars if "time" in history[name].dims and "body" not in history[name].dims
    ]
    return _draw_over_time(history, names, "history")


def draw_readings(readings: xr.Dataset) -> Figure:
    """Draw what rail and seats do over time, a line for each place."""
    return _draw_over_time(readings, [str(name) for name in readings.data_vars], "readings of the track")


def _draw_over_time(table: xr.Dataset, names: list[str], title: str) -> Figure:
    if table.sizes["time"] < 2:
        raise InputError("", "what", f"{table.sizes['time']} time", "two times or more")
    figure, axes = panels(len(names), 1.0 + 1.5 * len(names), 10.0, sharex=True)
    told: list[list[str]] = []  # what legends say of lines, once for all panels that have such lines
    for axis, name in zip(axes, names, strict=True):
        values = table[name].transpose("time", ...)
        over = [str(dimension) for dimension in values.dims[1:]]
        lines = values.values.reshape(values.sizes["time"], -1)
        shown, unit = _shown(lines, values.attrs.get("units", ""))
        for number, line in enumerate(shown.T[:MOST_LINES]):
            at = np.unravel_index(number, values.shape[1:]) if over else ()
            label = " ".join(_place(table, where, int(i)) for where, i in zip(over, at, strict=True))
            axis.plot(1e3 * table.time, line, color=COLOURS[number], linewidth=0.9, label=label or None)
        left_out = shown.shape[1] - MOST_LINES
        axis.set_title(f"{name.replace('_', ' ')}{f', without {left_out} more lines' if left_out > 0 else ''}")
        axis.set_ylabel(f"[{unit or '1'}]")
        axis.ticklabel_format(useOffset=False)
        if over and over not in told:
            legend_above(axis, 8)
            told.append(over)
    axes[-1].set_xlabel("time [ms]")
    figure.align_ylabels(axes.tolist())
    figure.suptitle(title, x=0.02, ha="left")
    return figure


def _place(table: xr.Dataset, where: str, number: int) -> str:
    value = table[where].values[number]
    short = {"rail": f"x = {value} m", "side": str(value)[:1].upper(), "wheelset": str(value)}
    return short.get(where, f"{where} {value}")


# -- tables of events -------------------------------------------------------------------------------------------------


def draw_events(events: xr.Dataset) -> Figure:
    """Draw how fast the surfaces meet or part at each event, by its kind."""
    figure, (axis,) = panels()
    for number, kind in enumerate(dict.fromkeys(events.kind.values.tolist())):
        here = events.kind.values == kind
        axis.plot(
            1e3 * events.time.values[here], events.indentation_rate.values[here], MARKS[number % len(MARKS)],
            color=COLOURS[number], markersize=4, label=f"{kind} ({int(here.sum())})",
        )  # fmt: skip
    axis.axhline(0.0, color="0.5", linewidth=0.8)
    axis.set(xlabel="time [ms]", ylabel="rate of the indentation [m/s]")
    _legend_if_any(axis)
    figure.suptitle(_counted(events.sizes["event"], "event"), x=0.02, ha="left")
    return figure


def draw_peaks(peaks: xr.Dataset) -> Figure:
    """Draw the maxima of the force over time."""
    figure, (axis,) = panels()
    for label, here, mark in (
        ("of the motion", ~peaks.corner.values.astype(bool), "o"),
        ("at a kink of the input", peaks.corner.values.astype(bool), "x"),
    ):
        if here.any():
            _draw_stems(axis, 1e3 * peaks.time.values[here], peaks.normal_force.values[here] / 1e3, mark, label)
    axis.set(xlabel="time [ms]", ylabel="normal force [kN]", ylim=(0.0, None))
    _legend_if_any(axis)
    figure.suptitle(_counted(peaks.sizes["peak"], "maximum", "maxima") + " of the force", x=0.02, ha="left")
    return figure


def _draw_stems(axis: Axes, x: NDArray[Any], y: NDArray[Any], mark: str, label: str) -> None:
    axis.vlines(x, 0.0, y, color=BLUE if mark == "o" else RED, linewidth=0.7, alpha=0.5)
    axis.plot(x, y, mark, color=BLUE if mark == "o" else RED, markersize=4, label=label)


def draw_impacts(impacts: xr.Dataset) -> Figure:
    """Draw the largest force after each impact, its closing speed, and the interval to the next."""
    figure, axes = panels(3, 7.5, sharex=True)
    rows = (("peak_force", 1e3, "largest force until the next [kN]"), ("closing_speed", 1.0, "closing speed [m/s]"),
            ("interval", 1e-3, "interval to the next [ms]"))  # fmt: skip
    for axis, (name, unit, label) in zip(axes, rows, strict=True):
        _draw_stems(axis, 1e3 * impacts.time.values, impacts[name].values / unit, "o", "")
        axis.set(ylabel=label, ylim=(0.0, None))
    axes[-1].set_xlabel("time [ms]")
    figure.suptitle(_counted(impacts.sizes["impact"], "impact"), x=0.02, ha="left")
    return figure


def draw_suspension_events(events: xr.Dataset) -> Figure:
    """Draw when each element that is not linear sticks, slips, meets, leaves or changes."""
    return _draw_timeline(events, events.element.values.astype(str), "event", "of the suspensions")


def draw_damper_events(events: xr.Dataset) -> Figure:
    """Draw when a damper's end reaches and leaves its stops."""
    return _draw_timeline(events, events.side.values.astype(str), "event", "of the damper's end; stops by their sides")


def _draw_timeline(events: xr.Dataset, rows: NDArray[Any], what: str, of: str) -> Figure:
    names = list(dict.fromkeys(rows.tolist())) or ["none"]
    figure, (axis,) = panels(1, 1.8 + 0.35 * len(names))
    place = np.array([names.index(row) for row in rows.tolist()], dtype=float)
    for number, kind in enumerate(dict.fromkeys(events.kind.values.tolist())):
        here = events.kind.values == kind
        axis.plot(
            1e3 * events.time.values[here], place[here], MARKS[number % len(MARKS)], color=COLOURS[number],
            markersize=4, label=f"{kind} ({int(here.sum())})",
        )  # fmt: skip
    axis.set_yticks(range(len(names)), names)
    axis.set(xlabel="time [ms]", ylim=(len(names) - 0.5, -0.5))
    _legend_if_any(axis, 6)
    figure.suptitle(f"{_counted(len(rows), what)} {of}", x=0.02, ha="left")
    return figure


def _legend_if_any(axis: Axes, columns: int = 4) -> None:
    if axis.get_legend_handles_labels()[0]:
        legend_above(axis, columns)


def _counted(number: int, what: str, several: str = "") -> str:
    return f"{number} {what if number == 1 else several or what + 's'}"


def draw_energy(energy: xr.Dataset) -> Figure:
    """Draw the balance of energy as bars; the imbalance is told."""
    parts = {
        str(name).replace("_", " "): float(energy[name])
        for name in energy.data_vars
        if energy[name].ndim == 0 and name not in ("imbalance", "relative_imbalance", "truncation")
    }
    figure, (axis,) = panels(1, 1.2 + 0.28 * len(parts))
    values, unit = _shown(list(parts.values()), "J")
    rows = np.arange(len(parts))
    axis.barh(rows, values, color=[BLUE if value >= 0.0 else RED for value in values], height=0.6)
    axis.axvline(0.0, color="0.4", linewidth=0.8)
    axis.set_yticks(rows, list(parts))
    axis.set(xlabel=f"energy at the end, or over the run [{unit}]", ylim=(len(parts) - 0.5, -0.5))
    off = float(energy.relative_imbalance)
    figure.suptitle(f"balance of energy: {off:.1e} of it is missing", x=0.02, ha="left")
    return figure


# -- guiding forces ---------------------------------------------------------------------------------------------------


def draw_guidance(found: xr.Dataset) -> Figure:
    """Draw Y, Q, Y/Q, ΔQ/Q₀, ΣY and T-gamma of all wheels over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 8.5))
    axes = figure.subplots(3, 2, sharex=True)
    for axis, (name, label) in zip(axes.T.flat, Y_LABELS.items(), strict=True):
        values = found[name].sum("surface", skipna=False) if name == "t_gamma" else found[name]
        for number, wheelset in enumerate(found.wheelset.values):
            for side in found.side.values if "side" in values.dims else [None]:
                one = values.sel(wheelset=wheelset) if side is None else values.sel(wheelset=wheelset, side=side)
                held = one.values / 1e3 if "kN" in label else np.minimum(one.values, LARGEST) if "ratio" in label else (
                    one.values
                )  # fmt: skip
                named = "" if side is None or name != "guiding_force" else f"{wheelset} {side}"
                axis.plot(
                    1e3 * found.time, held, LINES.get(str(side), "-"), color=COLOURS[number % len(COLOURS)],
                    linewidth=0.8, label=named or None,
                )  # fmt: skip
        axis.set_ylabel(label)
    _steady_sum(axes[1, 1], found)
    legend_above(axes[0, 0], 4)
    for axis in axes[-1]:
        axis.set_xlabel("time [ms]")
    cutoff = found.attrs["cutoff"]
    filtered = f"below {cutoff:g} Hz" if np.isfinite(cutoff) else "unfiltered"
    figure.suptitle(f"guiding forces by wheelset and side, {filtered}, means over {found.attrs['window']:g} m of way",
                    x=0.02, ha="left", fontsize=9)  # fmt: skip
    return figure


def _steady_sum(axis: Axes, found: xr.Dataset) -> None:
    """Let ΣY that is only rounding, such as that of a vehicle that runs straight, lie on zero."""
    largest = np.nanmax(np.abs(found.sum_of_guiding_forces.values), initial=0.0)
    if largest < ROUNDING * np.nanmax(found.wheel_force.values, initial=0.0):
        axis.set_ylim(-1.0, 1.0)


def draw_running_safety(found: xr.Dataset) -> Figure:
    """Draw the range of each quantity by wheel: from least to largest, with its percentiles and its mean."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 8.5))
    axes = figure.subplots(3, 2)
    wheels = [f"{wheelset}{str(side)[0].upper()}" for wheelset in found.wheelset.values for side in found.side.values]
    for axis, (name, label) in zip(axes.T.flat, Y_LABELS.items(), strict=True):
        values = found[name].sum("surface", skipna=False) if name == "t_gamma" else found[name]
        scale = 1e-3 if "kN" in label else 1.0
        rows = values.transpose("statistic", ...).values.reshape(values.sizes["statistic"], -1) * scale
        rows = np.minimum(rows, LARGEST) if "ratio" in label else rows
        kinds = [str(one) for one in found.statistic.values]
        x = np.arange(rows.shape[1])
        axis.vlines(x, rows[kinds.index("least")], rows[kinds.index("largest")], color="0.6", linewidth=1.0)
        low, high = (rows[kinds.index(one)] for one in ("0.15 %", "99.85 %"))
        axis.vlines(x, low, high, color=BLUE, linewidth=5.0, alpha=0.5, label="0.15 to 99.85 %")
        axis.plot(x, rows[kinds.index("50 %")], "_", color="black", markersize=10, label="50 %")
        axis.plot(x, rows[kinds.index("mean")], "o", color=RED, markersize=3, label="mean")
        axis.set_xticks(x, wheels if len(x) == len(wheels) else [str(one) for one in found.wheelset.values])
        axis.set(ylabel=label, xlabel="wheel [wheelset and side]" if len(x) == len(wheels) else "wheelset [number]")
    legend_above(axes[0, 0])
    figure.suptitle("running safety: grey from the least to the largest value", x=0.02, ha="left", fontsize=9)
    return figure
