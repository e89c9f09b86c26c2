"""Pictures of orbits: branches, diagrams, basins, ramps and borders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.faces.panels import BLUE, COLOURS, GREEN, RED, in_unit, legend_above, with_unit, words
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wheeltapper.orbits.orbit import Orbit

MARKS = {"fold": ("o", RED), "doubling": ("s", GREEN), "grazing": ("d", "0.35"), "torus": ("^", "tab:purple")}
"""Shape and colour of the mark of each kind of special point."""
LINES = ("-", "--", ":", "-.")
"""Lines of several borders of one kind."""
DOT: dict[str, Any] = {"marker": ".", "linestyle": "none", "markersize": 2}
UNSETTLED = "0.85"
MOST_COLOURS = 10


def _shown(data: xr.Dataset, name: str) -> tuple[NDArray[Any], str]:
    """Return a field's values in a unit that reads well, and its label."""
    values = np.asarray(data[name].values, dtype=float)
    factor, unit = in_unit(values, data[name].attrs.get("units", ""))
    return factor * values, with_unit(words(name), unit)


def _over_static(data: xr.Dataset) -> NDArray[Any]:
    return np.asarray(data.largest_force.values / data.attrs["static_force"])


def draw_branch(branch: xr.Dataset) -> Figure:
    """Draw the largest force and the largest multiplier along a branch, with its special points."""
    return draw_branches([branch])


def draw_branches(branches: Sequence[xr.Dataset], names: Sequence[str] = ()) -> Figure:
    """Draw the largest forces and the largest multipliers along branches over the same field."""
    from matplotlib.figure import Figure

    path, factor, label = _field_of_all(branches, [str(one.attrs["parameter"]) for one in branches])
    figure = Figure(figsize=(8.0, 7.0))
    force, multiplier = figure.subplots(2, 1, sharex=True)
    called = _called(names, ["branch"] * len(branches))
    top = 0.0
    marked: set[str] = set()
    for branch, name, colour in zip(branches, called, COLOURS, strict=False):
        labels = ("stable", "unstable") if len(branches) == 1 else (name, "")
        x, sizes = factor * branch[path].values, _sizes(branch)
        top = max(top, float(sizes.max()))
        special, after, kinds = (branch[name].values for name in ("parameter", "after", "kind"))
        along = np.insert(x, after + 1, factor * special)
        is_special = np.insert(np.zeros(len(x), dtype=bool), after + 1, np.ones(len(after), dtype=bool))
        stable = np.insert(branch.stable.values, after + 1, np.ones(len(after), dtype=bool))
        for axis, values in ((force, _over_static(branch)), (multiplier, sizes)):
            heights = np.array([_between(values, int(i)) for i in after])
            if axis is multiplier:
                heights[kinds != "grazing"] = 1.0  # by what these are
            _draw_stability(axis, along, np.insert(values, after + 1, heights), stable, is_special, colour, labels)
            for kind, (shape, mark) in MARKS.items():
                at = kinds == kind
                if at.any():
                    once = None if axis is force and kind in marked else kind
                    axis.plot(factor * special[at], heights[at], shape, color=mark, markersize=5, label=once)
                    marked.add(kind)
    force.set_ylabel("largest force over static")
    multiplier.set(ylabel="largest modulus of a multiplier", xlabel=label)
    multiplier.axhline(1.0, color="0.5", linewidth=0.8)
    multiplier.set_ylim(0.0, min(3.0, 1.05 * top))
    legend_above(force, columns=6 if len(branches) == 1 else 4)
    if len(branches) > 1:
        figure.suptitle(f"{len(branches)} branches; dotted: unstable", x=0.02, ha="left")
    return figure


def _sizes(branch: xr.Dataset) -> NDArray[Any]:
    """Return the largest modulus of a multiplier along a branch."""
    return np.asarray(np.hypot(branch.multiplier_real, branch.multiplier_imag).max("multiplier").values)


def _field_of_all(several: Sequence[xr.Dataset], paths: Sequence[str]) -> tuple[str, float, str]:
    """Return the field over which all are, the factor of a unit in which it reads well, and its label."""
    if len(several) > len(COLOURS):
        raise InputError("", "what", f"a list of {len(several)}", f"1 to {len(COLOURS)}")
    if len(set(paths)) > 1:
        raise InputError("", "what", f"orbits over different fields: {', '.join(dict.fromkeys(paths))}", "one field")
    return paths[0], *_unit_of_all(several, paths[0])


def _called(names: Sequence[str], own: Sequence[str]) -> list[str]:
    """Return the names that several were given, or else their own, with a number where these are alike."""
    if names:
        return [*map(str, names)]
    return [*own] if len(set(own)) == len(own) else [f"{number}: {name}" for number, name in enumerate(own, 1)]


def _draw_stability(
    axis: Axes, x: NDArray[Any], values: NDArray[Any], stable: NDArray[np.bool_], is_special: NDArray[np.bool_],
    colour: str, labels: tuple[str, str],
) -> None:  # fmt: skip
    """Draw a line that is dotted between points of which one is unstable; special points belong to both sides."""
    between = stable[:-1] & stable[1:] & ~(is_special[:-1] & is_special[1:])
    for kind, line, name in ((True, "-", labels[0]), (False, ":", labels[1])):
        chosen = between == kind
        drawn = np.append(chosen, False) | np.insert(chosen, 0, False)
        ends = np.flatnonzero(drawn[:-1] & drawn[1:] & ~chosen) + 1  # both points belong to other parts of the line
        both = (np.insert(np.where(drawn, one, np.nan), ends, np.nan) for one in (x, values))
        axis.plot(*both, line, color=colour, label=name or None)


def _between(values: NDArray[Any], after: int) -> float:
    """Return what a quantity is at a special point, between the points beside it."""
    return float(0.5 * (values[after] + values[min(after + 1, len(values) - 1)]))


def draw_returns(diagram: xr.Dataset) -> Figure:
    """Draw where the wheel is at phase zero, and the largest force, wave after wave, over one field."""
    return draw_several_returns([diagram])


def draw_several_returns(diagrams: Sequence[xr.Dataset], names: Sequence[str] = ()) -> Figure:
    """Draw diagrams over the same field over each other, such as those that were carried up and down."""
    from matplotlib.figure import Figure

    fields = [_only_field(diagram, diagram.displacement.dims[:-1]) for diagram in diagrams]
    path, factor, label = _field_of_all(diagrams, fields)
    figure = Figure(figsize=(8.0, 7.0))
    place, force = figure.subplots(2, 1, sharex=True)
    called = _called(names, [str(diagram.attrs.get("carry", "returns")) for diagram in diagrams])
    for number, (diagram, name) in enumerate(zip(diagrams, called, strict=True)):
        each = np.repeat(factor * diagram[path].values, diagram.sizes["return"])
        dot = DOT | {"color": COLOURS[number], "markersize": 2 + 2 * (len(diagrams) - 1 - number)}
        place.plot(each, 1e6 * diagram.displacement.values.ravel(), **dot, label=name)
        force.plot(each, _over_static(diagram).ravel(), **dot)
    place.set_ylabel("displacement at phase zero [µm]")
    force.set(ylabel="largest force in a wave over static", xlabel=label)
    if len(diagrams) > 1:
        legend_above(place)
    return figure


def _only_field(data: xr.Dataset, fields: tuple[Any, ...]) -> str:
    if len(fields) != 1:
        raise InputError("", "what", f"{len(fields)} varied fields", "one; choose a slice with diagram.isel")
    return str(fields[0])


def draw_fates(fates: xr.Dataset) -> Figure:
    """Draw on which kind of orbit motions end, and after how many waves: over one field, or in the plane of two."""
    from matplotlib.figure import Figure

    fields = tuple(str(name) for name in fates.orbit.dims)
    if len(fields) > 2:
        raise InputError("", "what", f"{len(fields)} varied fields", "one or two; choose a slice with fates.isel")
    kinds, names = _kinds_of(fates)
    figure = Figure(figsize=(10.0, 4.6) if len(fields) == 2 else (8.0, 7.0))
    if len(fields) == 2:
        _draw_basin(figure, fates, fields, kinds, names)
        return figure
    (path,), (force, waves) = fields, figure.subplots(2, 1, sharex=True)
    x, label = _shown(fates, path)
    for kind, name in enumerate(names):
        force.plot(x[kinds == kind], _over_static(fates)[kinds == kind], "o", markersize=3, label=name)
        waves.plot(x[kinds == kind], fates.waves.values[kinds == kind], "o", markersize=3)
    waves.plot(x[kinds < 0], fates.waves.values[kinds < 0], "x", color="0.4", markersize=4, label="unsettled")
    force.set_ylabel("largest force over static")
    waves.set(ylabel="waves until settled", xlabel=label)
    legend_above(force)
    if np.any(kinds < 0):
        legend_above(waves)
    return figure


def _kinds_of(fates: xr.Dataset) -> tuple[NDArray[np.int64], list[str]]:
    """Return the kind of each cell's orbit (-1: unsettled), by waves and losses, and the names of the kinds."""
    table = np.column_stack([fates.orbit_waves.values, fates.orbit_losses.values]).reshape(-1, 2)
    each, kind = np.unique(table, axis=0, return_inverse=True)
    names = [f"{int(losses)} loss{'' if losses == 1 else 'es'} in {int(waves)} wave{'' if waves == 1 else 's'}"
             for waves, losses in each]  # fmt: skip
    if len(names) > MOST_COLOURS - 1:
        kind, names = np.minimum(kind, MOST_COLOURS - 1), [*names[: MOST_COLOURS - 1], "others"]
    return np.append(kind.ravel(), -1)[fates.orbit.values], names


def _draw_basin(
    figure: Figure, fates: xr.Dataset, fields: tuple[str, ...], kinds: NDArray[np.int64], names: list[str]
) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    ends, waves = figure.subplots(1, 2, sharey=True)
    (y, up), (x, along) = (_shown(fates, path) for path in fields)
    colours = [UNSETTLED, BLUE, RED, GREEN, "#c9a227", "#7b4fa3", "#3aa6a6", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22"]
    many = len(names) + 1
    norm = BoundaryNorm(np.arange(-1.5, many - 0.5), many)
    mesh = ends.pcolormesh(x, y, kinds, cmap=ListedColormap(colours[:many]), norm=norm, rasterized=True)
    bar = figure.colorbar(mesh, ax=ends, ticks=np.arange(-1, many - 1))
    bar.ax.set_yticklabels(["unsettled", *names], fontsize=7)
    ends.set(xlabel=along, ylabel=up, title="ends on")
    lives = waves.pcolormesh(x, y, fates.waves.values, cmap="viridis", rasterized=True)
    figure.colorbar(lives, ax=waves, label="waves")
    waves.set(xlabel=along, title="waves until settled")


def draw_ramp(ramp: xr.Dataset) -> Figure:
    """Draw the largest force in each wave while a field changes slowly."""
    return draw_ramps([ramp])


def draw_ramps(ramps: Sequence[xr.Dataset], names: Sequence[str] = ()) -> Figure:
    """Draw the largest forces of ramps of the same field over each other, such as a rising and a falling one."""
    from matplotlib.figure import Figure

    path, factor, label = _field_of_all(ramps, [str(ramp.attrs["parameter"]) for ramp in ramps])
    figure = Figure(figsize=(8.0, 4.0))
    axis = figure.subplots()
    called = _called(names, ["rising" if ramp[path][-1] > ramp[path][0] else "falling" for ramp in ramps])
    for ramp, name, colour in zip(ramps, called, COLOURS, strict=False):
        axis.plot(factor * ramp[path].values, _over_static(ramp), color=colour, linewidth=0.8, label=name)
    axis.set(xlabel=label, ylabel="largest force in a wave over static")
    if len(ramps) > 1:
        legend_above(axis)
    return figure


def draw_trace(curve: xr.Dataset) -> Figure:
    """Draw a border in the plane of two fields."""
    return draw_traces([curve])


def draw_traces(curves: Sequence[xr.Dataset]) -> Figure:
    """Draw borders in the plane of the same two fields; those of one kind differ in their line."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.4))
    axis = figure.subplots()
    fields = [(one.attrs["parameter"], one.attrs["second"]) for one in curves]
    if len(set(fields)) > 1:
        raise InputError("", "what", "borders in the planes of different fields", "borders over the same two fields")
    (across, along), (height, up) = (_unit_of_all(curves, path) for path in fields[0])
    kinds = [str(one.attrs["kind"]) for one in curves]
    for i, (one, kind) in enumerate(zip(curves, kinds, strict=True)):
        (shape, colour), number = MARKS[kind], kinds[:i].count(kind)
        x, y = (factor * one[path].values for factor, path in zip((across, height), fields[0], strict=True))
        name = kind if kinds.count(kind) == 1 else f"{kind} {number + 1}"
        axis.plot(x, y, LINES[number % len(LINES)], marker=shape, color=colour, markersize=3, label=name)
    axis.set(xlabel=along, ylabel=up)
    legend_above(axis)
    return figure


def _unit_of_all(curves: Sequence[xr.Dataset], path: str) -> tuple[float, str]:
    """Return the factor of a unit in which a field of all curves reads well, and its label."""
    factor, unit = in_unit(np.concatenate([one[path].values for one in curves]), curves[0][path].attrs.get("units", ""))
    return factor, with_unit(words(path), unit)


def draw_orbit(orbit: Orbit) -> Figure:
    """Draw one period: path and wheel, the force, and the motion in the plane of displacement and velocity."""
    from matplotlib.figure import Figure

    record = orbit.record
    times = np.linspace(0.0, orbit.period, 400 * orbit.waves + 1)
    found = record.at(times)
    figure = Figure(figsize=(9.0, 6.0))
    grid = figure.add_gridspec(2, 2, width_ratios=(2, 1))
    motion, force, phase = (figure.add_subplot(grid[place]) for place in ((0, 0), (1, 0), (slice(None), 1)))
    _draw_motion(motion, force, found, 1e3 * times, record.static_force)
    phase.plot(1e6 * found.wheel_displacement, found.wheel_velocity)
    phase.plot([1e6 * orbit.start["displacement"]], [orbit.start["velocity"]], "o", color=RED, markersize=4)
    phase.set(xlabel="displacement [µm]", ylabel="velocity [m/s]")
    figure.suptitle(str(orbit), fontsize=9)
    return figure


def _draw_motion(motion: Axes, force: Axes, found: Any, time: NDArray[Any], static: float) -> None:
    motion.plot(time, 1e6 * found.constraint, color="0.5", label="path over the irregularity")
    motion.plot(time, 1e6 * found.wheel_displacement, label="wheel's centre")
    motion.set_ylabel("displacement [µm]")
    legend_above(motion, columns=2)
    force.plot(time, found.normal_force / 1e3)
    force.axhline(static / 1e3, color="0.5", linewidth=0.8, linestyle="--", label="static")
    force.set(xlabel="time [ms]", ylabel="normal force [kN]")
    legend_above(force)
