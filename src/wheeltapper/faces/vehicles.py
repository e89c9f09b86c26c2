"""Pictures of vehicles, and of their modes: roots, damping over speed, and shapes over the vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.describe.vehicle.wagon import TREADS_APART, Wagon
from wheeltapper.faces.panels import BLUE, GREEN, RED, legend_above
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.text import Text

FloatArray = NDArray[np.float64]
X, Y, Z = range(3)
SIDE, PLAN, END = (X, Z), (X, Y), (Y, Z)
"""The two axes of each view."""
VIEWS = {"side": SIDE, "plan": PLAN, "end": END}
AXES = ("x, forward [m]", "y, left [m]", "z, up [m]")
TYRE = 0.135
"""Width of a wheel, m."""
MARKS, COLOURS = "osD^vP*X", (RED, GREEN, "#d68910", "black")
"""Marks and colours of the kinds of elements."""
CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
TURN = np.linspace(0.0, 2.0 * np.pi, 61)
CIRCLE = 0.5 * np.column_stack([np.cos(TURN), np.sin(TURN)])
FAR, ROOM = 0.025, 0.03
"""Largest displacement of a drawn shape, and the room around the vehicle, over its length."""
NEAR, ROUNDING = 0.1, 1e-9
"""Roots nearer than this share of their size have one label, and a damping ratio below this is written as zero."""
SHAPES, NAMED = 4, 5
"""Most shapes in one picture, and most modes with a name over speed: those that decay most slowly."""


def _is_wheelset(body: str) -> bool:
    return body.startswith("wheelset ")


def _outline(body: str, centre: FloatArray, edges: FloatArray, view: tuple[int, int]) -> FloatArray:
    """Return (points, 3) on the outline of a body in a view, m."""
    points = np.tile(centre, (len(CIRCLE), 1)) if _is_wheelset(body) and view == SIDE else np.tile(centre, (4, 1))
    unit = CIRCLE if len(points) == len(CIRCLE) else CORNERS
    points[:, view] += unit * edges[list(view)]
    return points


# -- the vehicle ------------------------------------------------------------------------------------------------------


def draw_vehicle(wagon: Wagon) -> Figure:
    """Draw side view, end view and plan of a wagon, with all elements by name."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    boxes = {name: (np.array(centre), np.array(edges)) for name, (centre, edges) in wagon.boxes.items()}
    places = _places(wagon)
    kinds = list(dict.fromkeys(type(element).__name__ for element in wagon.elements))
    low, high = _limits([*boxes.values()], np.array([*places, (0.0, 0.0, 0.0)]))
    long, wide, tall = high - low
    columns = 3 if len(places) > 40 else 2 if len(places) > 6 else 1
    height = 12.0 * (tall + wide) / (long + wide)
    figure = Figure(figsize=(14.0, 2.2 + height + 0.17 * -(-len(places) // columns)))
    grid = figure.add_gridspec(2, 2, width_ratios=(long, wide), height_ratios=(tall, wide))
    views = {"side": grid[0, 0], "end": grid[0, 1], "plan": grid[1, 0]}
    for name, place in views.items():
        axis = figure.add_subplot(place)
        _set_view(axis, VIEWS[name], low, high)
        axis.set_title({"side": "side view", "end": "end view", "plan": "plan"}[name])
        for body, (centre, edges) in boxes.items():
            _draw_body(axis, body, centre, edges, VIEWS[name])
        _mark_elements(axis, wagon, kinds, VIEWS[name])
        if name == "plan":
            plan, numbers = axis, _number_places(axis, places)
        if name == "side":
            axis.axhline(0.0, color="0.4", linewidth=1.5)
        if name == "side" and kinds:
            legend_above(axis, len(kinds))
    if places:
        named = [f"{number}  {', '.join(elements)}" for number, elements in enumerate(places.values(), 1)]
        figure.legend([Line2D([], [], linestyle="None")] * len(named), named, loc="outside lower left", ncols=columns,
                      fontsize=7, title="elements", handlelength=0.0, handletextpad=0.0)  # fmt: skip
    figure.suptitle(
        f"wagon of {len(wagon.bodies)} bodies and {len(wagon.axles)} wheelsets, {wagon.mass / 1e3:.4g} t; bodies as "
        "homogeneous boxes of their mass and moments of inertia"
    )
    hidden = _hide_overlapping(figure, numbers)
    if hidden:
        plan.set_title(f"plan; no room for {hidden} of the list's numbers")
    return figure


def draw_view(axis: Axes, wagon: Wagon, name: str) -> None:
    """Draw the bodies of a wagon, to scale, in the "side", "plan" or "end" view."""
    boxes = {body: (np.array(centre), np.array(edges)) for body, (centre, edges) in wagon.boxes.items()}
    low, high = _limits([*boxes.values()], np.zeros((1, 3)))
    _set_view(axis, VIEWS[name], low, high)
    for body, (centre, edges) in boxes.items():
        _draw_body(axis, body, centre, edges, VIEWS[name])
    axis.axhline(0.0, color="0.4", linewidth=1.5)
    axis.set_title(f"{name} view")


def _places(wagon: Wagon) -> dict[tuple[float, ...], list[str]]:
    """Return the names of the elements at each place, in their order."""
    found: dict[tuple[float, ...], list[str]] = {}
    for element in wagon.elements:
        found.setdefault(tuple(map(float, element.at)), []).append(element.name)
    return found


def _limits(boxes: list[tuple[FloatArray, FloatArray]], places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest x, y, z of all that is drawn, with room for a shape, m."""
    low = np.min([*(centre - edges / 2 for centre, edges in boxes), *places], axis=0)
    high = np.max([*(centre + edges / 2 for centre, edges in boxes), *places], axis=0)
    room = ROOM * float((high - low).max())
    return low - room, high + room


def _set_view(axis: Axes, view: tuple[int, int], low: FloatArray, high: FloatArray) -> None:
    across, up = view
    axis.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]), xlabel=AXES[across], ylabel=AXES[up])
    axis.set_aspect("equal")
    if across == Y:
        axis.invert_xaxis()  # as seen from behind: left is left


def _draw_body(axis: Axes, body: str, centre: FloatArray, edges: FloatArray, view: tuple[int, int]) -> None:
    """Draw a body to scale: a box, or wheels on their axle; its name is in the side view."""
    from matplotlib.patches import Polygon

    if _is_wheelset(body) and view != SIDE:
        wheel, axle = np.array([edges[X], TYRE, edges[Z]]), np.array([0.15, edges[Y], 0.15])
        outlines = [
            _outline("", centre + np.array((0.0, y, 0.0)), wheel, view) for y in (-TREADS_APART / 2, TREADS_APART / 2)
        ]
        outlines.append(_outline("", centre, axle, view))
    else:
        outlines = [_outline(body, centre, edges, view)]
    colour = "0.35" if _is_wheelset(body) else BLUE
    for points in outlines:
        axis.add_patch(Polygon(points[:, view], facecolor=colour, edgecolor=colour, alpha=0.18))
        axis.add_patch(Polygon(points[:, view], fill=False, edgecolor=colour, linewidth=0.8))
    if view == SIDE:
        text, height = (body, centre[Z] + edges[Z] / 2) if not _is_wheelset(body) else (body.split()[-1], 0.0)
        up = "bottom" if height else "top"
        axis.annotate(text, (centre[X], height), (0.0, 3.0 if height else -3.0), ha="center", va=up, fontsize=7,
                      textcoords="offset points")  # fmt: skip


def _mark_elements(axis: Axes, wagon: Wagon, kinds: list[str], view: tuple[int, int]) -> None:
    """Mark the elements by their kind, beside each other where there are several."""
    from matplotlib.transforms import offset_copy

    figure: Any = axis.figure
    for number, kind in enumerate(kinds):
        at = np.array([element.at for element in wagon.elements if type(element).__name__ == kind], dtype=float)
        beside = offset_copy(axis.transData, figure, x=5.0 * (number - (len(kinds) - 1) / 2), units="points")
        across, up = at[:, view].T
        colour, mark = COLOURS[number % len(COLOURS)], MARKS[number % len(MARKS)]
        axis.plot(across, up, mark, color=colour, markersize=3.5, transform=beside, label=kind.lower())


def _number_places(axis: Axes, places: dict[tuple[float, ...], list[str]]) -> dict[Text, int]:
    """Write the numbers of the places of elements into a plan, those above each other together.

    Returns the texts, and how many numbers each holds.
    """
    seen: dict[tuple[float, float], list[int]] = {}
    for number, (x, y, _) in enumerate(places, 1):
        seen.setdefault((x, y), []).append(number)
    out: dict[Text, int] = {}
    for where, numbers in seen.items():
        written = ", ".join(map(str, numbers))
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.3}
        text = axis.annotate(written, where, (0.0, 4.0), textcoords="offset points", ha="center", fontsize=7, bbox=box)
        out[text] = len(numbers)
    return out


def _hide_overlapping(figure: Figure, numbers: dict[Text, int]) -> int:
    """Hide texts that would overlap earlier ones; return how many numbers they hold."""
    figure.draw_without_rendering()  # places are known only then
    shown: list[Any] = []
    hidden = 0
    for text, count in numbers.items():
        box = text.get_window_extent()
        if any(box.overlaps(one) for one in shown):
            text.set_visible(False)
            hidden += count
        else:
            shown.append(box)
    return hidden


# -- modes ------------------------------------------------------------------------------------------------------------


def roots_of(modes: xr.Dataset) -> NDArray[np.complex128]:
    """Return the root of each mode with no negative imaginary part, 1/s."""
    size, ratio = 2.0 * np.pi * modes.frequency.values, modes.damping_ratio.values
    return np.asarray(size * (-ratio + 1j * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))))


def draw_modes(modes: xr.Dataset) -> Figure:
    """Draw frequency and damping ratio of each mode by its name, the roots, and the shapes that last longest."""
    from matplotlib.figure import Figure

    modes = modes if "mode" in modes.dims else modes.expand_dims("mode")
    count = modes.sizes["mode"]
    roots = roots_of(modes)
    shown = np.sort(np.argsort(-roots.real, kind="stable")[:SHAPES])
    figure = Figure(figsize=(15.0, max(1.5 + 0.2 * count, 3.5 + 1.3 * len(shown))))
    halves: Any = figure.subfigures(1, 2)
    _draw_names(halves[0], modes)
    upper, lower = halves[1].subfigures(2, 1, height_ratios=(3.0, 1.3 * len(shown)))
    axis = upper.subplots()
    _draw_roots(axis, [modes], RED)
    for near in _groups_of_near(roots[shown]):
        first = roots[shown[near[0]]]
        text = ", ".join(str(int(modes.mode[shown[one]])) for one in near)
        axis.annotate(text, (first.real, first.imag / (2.0 * np.pi)), (4.0, 2.0), textcoords="offset points",
                      fontsize=7)  # fmt: skip
    axis.set_title("roots, and the numbers of the modes drawn below")
    _draw_shapes(lower, modes.isel(mode=shown))
    figure.suptitle(f"modes at {float(modes.attrs['speed']):g} m/s")
    return figure


def _groups_of_near(roots: NDArray[np.complex128]) -> list[list[int]]:
    """Return the numbers of roots in groups of those so near to each other that their names would overlap."""
    groups: list[list[int]] = []
    for number, root in enumerate(roots):
        group = next((one for one in groups if abs(roots[one[0]] - root) < NEAR * abs(root)), None)
        if group is None:
            groups.append([number])
        else:
            group.append(number)
    return groups


def _draw_names(figure: SubFigure, modes: xr.Dataset) -> None:
    """Draw frequency and damping ratio of each mode, by its number and name."""
    count = modes.sizes["mode"]
    frequencies, ratios = figure.subplots(1, 2, sharey=True)
    rows = np.arange(count)
    names = [f"{name}  {int(mode)}" for mode, name in zip(modes.mode.values, modes.name.values, strict=True)]
    frequencies.plot(modes.frequency, rows, "o", color=BLUE, markersize=4)
    frequencies.set_yticks(rows, names, fontsize=7)
    frequencies.set(xscale="log", xlabel="frequency [Hz]", ylim=(count - 0.5, -0.5))
    ratios.plot(100.0 * modes.damping_ratio, rows, "o", color=RED, markersize=4)
    ratios.axvline(0.0, color="0.5", linewidth=0.8)
    ratios.set(xlabel="damping ratio [%]")


def _draw_roots(axis: Axes, several: Sequence[xr.Dataset], colour: str | None = None) -> Any:
    """Draw roots in the plane, coloured by speed unless a colour is given; return what has the colours."""
    roots = [roots_of(modes) for modes in several]
    every = np.concatenate(roots)
    speeds = np.concatenate([np.full(len(r), m.attrs["speed"]) for r, m in zip(roots, several, strict=True)])
    how = {"c": speeds, "cmap": "viridis"} if colour is None else {"color": colour}
    points = axis.scatter(every.real, every.imag / (2.0 * np.pi), s=12, **how)  # type: ignore[arg-type]
    axis.axvline(0.0, color="0.5", linewidth=0.8)
    axis.set_xscale("symlog", linthresh=1.0)
    axis.set_yscale("symlog", linthresh=1.0)
    axis.set(xlabel="real part of the root [1/s]", ylabel="imaginary part over 2π [Hz]")
    axis.set_xlim(1.5 * min(every.real.min(), -1.0), max(1.5 * every.real.max(), 0.3))
    axis.set_ylim(-0.1, 1.5 * max(every.imag.max() / (2.0 * np.pi), 1.0))
    return points


def _draw_shapes(figure: SubFigure, modes: xr.Dataset) -> None:
    """Draw shapes in three views over the vehicle at rest: where most moves, and a quarter of a period later."""
    from matplotlib.patches import Polygon

    centres, edges, bodies = modes.centre.values, modes.edges.values, [str(body) for body in modes.body.values]
    low, high = _limits([*zip(centres, edges, strict=True)], np.zeros((1, 3)))
    long, wide, _ = high - low
    figure.suptitle("solid: where most moves; dotted: a quarter of a period later; grey: at rest", fontsize=8)
    axes = figure.subplots(modes.sizes["mode"], 3, width_ratios=(long, long, wide), squeeze=False, sharex="col")
    for mode, row in enumerate(axes):
        one = modes.isel(mode=mode)
        moved = [_moved(one.shape.values, centres, edges, bodies, view) for view in VIEWS.values()]
        far = max(np.abs(np.concatenate(points) - np.concatenate(rest)).max() for rest, points in moved)
        scale = FAR * float(high[X] - low[X]) / max(far, 1e-300)
        for axis, view, (rest, points) in zip(row, VIEWS.values(), moved, strict=True):
            _set_view(axis, view, low, high)
            for still, gone in zip(rest, points, strict=True):
                axis.add_patch(Polygon(still[:, view], fill=False, edgecolor="0.7", linewidth=0.6))
                for part, style in ((np.real, "-"), (np.imag, ":")):
                    at = still + scale * part(gone - still)
                    axis.add_patch(Polygon(at[:, view], fill=False, edgecolor=BLUE, linewidth=0.9, linestyle=style))
            axis.tick_params(labelsize=6)
            axis.xaxis.label.set_size(7)
            axis.yaxis.label.set_size(7)
            axis.set_xlabel(axis.get_xlabel() if mode == len(axes) - 1 else "")
        row[0].set_title(
            f"{int(one.mode)}: {one.name.values}, {float(one.frequency):.3g} Hz, "
            f"{_per_cent(float(one.damping_ratio))} %", fontsize=8,
        )  # fmt: skip


def _per_cent(ratio: float) -> str:
    """Return a damping ratio in per cent; what is only rounding is zero."""
    return "0" if abs(ratio) < ROUNDING else f"{100.0 * ratio:.3g}"


def _moved(
    shape: NDArray[np.complex128], centres: FloatArray, edges: FloatArray, bodies: list[str], view: tuple[int, int]
) -> tuple[list[FloatArray], list[NDArray[np.complex128]]]:
    """Return the outlines of all bodies at rest, and displaced by a shape (bodies, motions): d + θ × r."""
    rest, moved = [], []
    for body, centre, size, motion in zip(bodies, centres, edges, shape, strict=True):
        points = _outline(body, centre, size, view)
        shifted, turned = motion[: len(MOTIONS) // 2], motion[len(MOTIONS) // 2 :]
        rest.append(points)
        moved.append(points + shifted + np.cross(turned, points - centre))
    return rest, moved


def draw_modes_over_speed(several: Sequence[xr.Dataset]) -> Figure:
    """Draw the roots at several speeds, and the damping ratio of each mode over speed, by name where it is least."""
    from matplotlib.figure import Figure

    speeds = np.array([float(modes.attrs["speed"]) for modes in several])
    if len(several) < 2 or not (np.diff(speeds) > 0.0).all():
        raise InputError("", "what", f"modes at {', '.join(f'{v:g}' for v in speeds)} m/s", "two or more rising speeds")
    figure = Figure(figsize=(12.0, 6.0))
    plane, ratios = figure.subplots(1, 2)
    figure.colorbar(_draw_roots(plane, several), ax=plane, pad=0.02).ax.set_title("m/s")
    plane.set_title("roots, by speed")
    followed = _followed(several)
    slowest = np.nanmax([roots.real for roots in followed], axis=0)
    order = np.argsort(-slowest, kind="stable")
    damping = -100.0 * followed.real / np.abs(followed)
    for mode in order[NAMED:]:
        ratios.plot(speeds, damping[:, mode], ".-", color="0.8", linewidth=0.8)
    for number, mode in enumerate(order[:NAMED]):
        width = 1.0 + 0.8 * (NAMED - number)  # lines that coincide are seen
        name = f"{several[-1].name.values[mode]}, {abs(followed[-1, mode]) / (2.0 * np.pi):.3g} Hz"
        ratios.plot(speeds, damping[:, mode], ".-", color=f"C{number}", linewidth=width, label=name)
    ratios.axhline(0.0, color="0.5", linewidth=0.8)
    ratios.set(xlabel="speed [m/s]", ylabel="damping ratio [%]")
    legend_above(ratios, 2)
    return figure


def _followed(several: Sequence[xr.Dataset]) -> FloatArray:
    """Return roots (speeds, modes of the last speed); a mode goes on as that of the most similar shape (MAC)."""
    from scipy.optimize import linear_sum_assignment

    def unit_shapes(modes: xr.Dataset) -> NDArray[np.complex128]:
        flat = modes.shape.values.reshape(modes.sizes["mode"], -1)
        return np.asarray(flat / np.linalg.norm(flat, axis=1, keepdims=True))

    out = np.full((len(several), several[-1].sizes["mode"]), np.nan + 0j)
    here = np.arange(out.shape[1])
    out[-1] = roots_of(several[-1])
    for number in range(len(several) - 2, -1, -1):
        alike = np.abs(unit_shapes(several[number + 1]).conj() @ unit_shapes(several[number]).T) ** 2
        rows, columns = linear_sum_assignment(-alike)
        before = np.full(len(alike), -1)
        before[rows] = columns
        here = np.where(here >= 0, before[here], -1)
        out[number] = np.where(here >= 0, roots_of(several[number])[here], np.nan)
    return out


def draw_limit_cycles(found: xr.Dataset) -> Figure:
    """Draw the amplitude of hunting over speed."""
    return draw_several_limit_cycles([found], [""])


def draw_several_limit_cycles(found: Sequence[xr.Dataset], names: Sequence[str]) -> Figure:
    """Draw the amplitudes of several wagons that hunt over speed; the smallest disturbances that grow are dashed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5))
    axis = figure.subplots()
    for number, (one, name) in enumerate(zip(found, names, strict=True)):
        colour = COLOURS[number % len(COLOURS)]
        largest = 1e3 * one["amplitude"].max("wheelset")
        axis.plot(one["speed"], largest, ".-", color=colour, label=f"{name} limit cycle")
        if "unstable_amplitude" in one:
            least = 1e3 * one["unstable_amplitude"]
            axis.plot(one["speed"], least, "--", color=colour, label=f"{name} least that grows")
        end = one.attrs["nonlinear_critical_speed"]
        if np.isfinite(end):
            axis.axvline(end, color=colour, linewidth=0.8, label=f"{name} ends at {end:.4g} m/s")
    axis.set(xlabel="speed [m/s]", ylabel="lateral amplitude of the wheelset that moves most [mm]", ylim=(0.0, None))
    legend_above(axis, 1)
    return figure
