"""Pictures of vehicles in the vertical plane: wheelsets, bogies, and what of their suspensions is not linear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.kinks import Suspension, kinks_of
from wheeltapper.describe.vehicle.wagon import Wagon, wagon_for
from wheeltapper.faces.panels import BLUE, COLOURS, RED, legend_above, panels
from wheeltapper.faces.vehicles import draw_vehicle
from wheeltapper.ground.errors import InputError, value_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
COILS, TALL, FRAME, FRAME_BEYOND = 5, 0.45, 0.22, 0.3
"""Coils of a drawn spring, its height, the thickness of a drawn body, and how far it goes beyond its springs, m."""
STROKE, PACE = 0.02, 0.5
"""Compression, m, and rate, m/s, to which suspensions are drawn at least."""
POINTS = 400


def draw_any_vehicle(vehicle: Vehicle) -> Figure:
    """Draw a vehicle: a wagon in three views, others from the side beside the forces of their suspensions."""
    wagon = wagon_for(vehicle)
    if isinstance(wagon, Wagon):
        return draw_vehicle(wagon)
    if not hasattr(vehicle, "plane"):
        raise InputError("", "what", value_text(vehicle), "a vehicle whose bodies are known")
    from matplotlib.figure import Figure

    if not vehicle.suspensions:
        figure = Figure(figsize=(7.0, 4.5))
        draw_side(figure.subplots(), vehicle)
        figure.suptitle(vehicle.words, x=0.02, ha="left", fontsize=9)
        return figure
    figure = Figure(figsize=(11.0, 4.5))
    side, spring, damper = figure.subplots(1, 3, width_ratios=(1.2, 1.0, 1.0))
    draw_side(side, vehicle)
    for number, suspension in enumerate(vehicle.suspensions):
        _draw_forces(spring, damper, suspension, COLOURS[number])
    spring.set(xlabel="compression from rest [mm]", ylabel="force on the wheel, downwards [kN]")
    damper.set(xlabel="rate of compression [m/s]", ylabel="force of the damper [kN]")
    for axis, name in ((spring, "springs"), (damper, "dampers")):
        axis.axhline(0.0, color="0.5", linewidth=0.8, zorder=0)
        axis.set_title(name)
        legend_above(axis, 2)
    figure.suptitle(vehicle.words, x=0.02, ha="left", fontsize=9)
    return figure


def _draw_forces(spring: Axes, damper: Axes, suspension: Suspension, colour: str) -> None:
    kinks = kinks_of(suspension.of, suspension.prefix)
    parts = list(kinks.elements("{}", np.ones(1), suspension.stiffness, suspension.damping))
    places = [abs(place) for part in parts if not part.by_rate for place in part.corners[0]]
    reach = max(STROKE, 1.5 * max(places, default=0.0))
    u, rate = np.linspace(-reach, reach, POINTS), np.linspace(-PACE, PACE, POINTS)
    bent = [part for part in parts if not part.by_rate and part.slider[0] == 0.0]
    force = suspension.stiffness * u + sum((integrated(part.corners, u) for part in bent), np.zeros(POINTS))
    spring.plot(1e3 * u, force / 1e3, color=colour, label=suspension.name)
    for part in parts:
        if part.slider[0]:
            low, high = (force - part.slider[0]) / 1e3, (force + part.slider[0]) / 1e3
            spring.fill_between(1e3 * u, low, high, color=colour, alpha=0.2, linewidth=0, label="with friction")
    by_rate = suspension.damping * rate
    by_rate = by_rate + sum((integrated(part.corners, rate) for part in parts if part.by_rate), np.zeros(POINTS))
    damper.plot(rate, by_rate / 1e3, color=colour, label=suspension.name)


def integrated(corners: tuple[FloatArray, FloatArray], at: FloatArray) -> FloatArray:
    """Return a piecewise linear force with these corners and slopes that is zero at zero."""
    places, slopes = corners
    nodes = np.union1d(np.append(places, 0.0), at)
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    rises = np.append(0.0, np.cumsum(slopes[np.searchsorted(places, middle)] * np.diff(nodes)))
    return np.asarray(np.interp(at, nodes, rises - np.interp(0.0, nodes, rises)))


# -- the view from the side -------------------------------------------------------------------------------------------


def wheels_of(vehicle: Any) -> list[tuple[float, float]]:
    """Return position and radius of each wheelset, m."""
    plane = vehicle.plane
    return [(float(x), float(one.radius)) for x, one in zip(plane.positions, plane.wheelsets, strict=True)]


def draw_side(axis: Axes, vehicle: Any) -> None:
    """Draw wheels, springs and bodies, and the points that the springs hang on, from the side, to scale."""
    from matplotlib.patches import Circle

    wheels = wheels_of(vehicle)
    for number, (x, radius) in enumerate(wheels, 1):
        for face, alpha in ((True, 0.15), (False, 1.0)):
            axis.add_patch(Circle((x, radius), radius, fill=face, color="0.3", alpha=alpha))
        axis.plot([x], [radius], "o", color="0.3", markersize=3)
        axis.annotate(str(number), (x, 0.0), (0, -4), textcoords="offset points", ha="center", va="top", fontsize=7)
    above = [(x, radius + 0.08) for x, radius in wheels]  # where springs stand, and what they carry
    for body in vehicle.plane.bodies:
        own = [number for number in range(1, len(wheels) + 1) if body.endswith(f" {number}")]
        carriers = [own[0] - 1] if own else range(len(above))
        below = sorted({above[number] for number in carriers})
        top = max(height for _, height in below) + TALL
        for x, height in below:
            _draw_spring(axis, x, height, top)
        low, high = min(x for x, _ in below) - FRAME_BEYOND, max(x for x, _ in below) + FRAME_BEYOND
        axis.fill([low, high, high, low], [top, top, top + FRAME, top + FRAME], facecolor=BLUE, alpha=0.25)
        axis.annotate(body, (0.5 * (low + high), top + FRAME / 2), ha="center", va="center", fontsize=8)
        for number in carriers:
            above[number] = (0.5 * (low + high), top + FRAME)
    for x, height in sorted(set(above)):
        _draw_spring(axis, x, height, height + TALL)
        _draw_hold(axis, x, height + TALL)
    axis.axhline(0.0, color="0.4", linewidth=1.5)
    axis.set_aspect("equal")
    low, high = min(x - radius for x, radius in wheels), max(x + radius for x, radius in wheels)
    axis.set(xlim=(low - 0.4, high + 0.4), xlabel="x, forward [m]", ylabel="above the rail [m]")
    axis.set_title("side view, springs not to scale")


def _draw_spring(axis: Axes, x: float, low: float, high: float) -> None:
    """Draw a spring and a damper beside each other between two heights."""
    ends = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 2 * COILS), 0.85, 1.0])
    swings = np.array([0.0, 0.0, *([1.0, -1.0] * COILS), 0.0, 0.0])
    axis.plot(x - 0.09 + 0.05 * swings, low + (high - low) * ends, color=RED, linewidth=0.9, marker=",")
    tall = high - low
    for xs, ys in (
        ((0.09, 0.09), (0.0, 0.35)), ((0.03, 0.03, 0.15, 0.15), (0.75, 0.35, 0.35, 0.75)), ((0.05, 0.13), (0.55, 0.55)),
        ((0.09, 0.09), (0.55, 1.0)),
    ):  # fmt: skip
        axis.plot(x + np.array(xs), low + tall * np.array(ys), color=RED, linewidth=0.9, marker=",")
    for height in (low, high):
        axis.plot([x - 0.16, x + 0.18], [height, height], color="0.3", linewidth=1.0)


def _draw_hold(axis: Axes, x: float, height: float) -> None:
    """Draw the point, which moves steadily, on which a spring hangs."""
    axis.fill_between([x - 0.25, x + 0.25], height, height + 0.06, facecolor="none", edgecolor="0.4", hatch="////")


# -- parts of a wagon -------------------------------------------------------------------------------------------------


def draw_body(body: Body) -> Figure:
    """Draw a body of a wagon as the homogeneous box of its mass and moments."""
    figure, (axis,) = panels(1, 3.5)
    (x, _, z), (long, _, tall) = body.position, body.box
    axis.fill(x + long * np.array([-0.5, 0.5, 0.5, -0.5]), z + tall * np.array([-0.5, -0.5, 0.5, 0.5]),
              facecolor=BLUE, edgecolor=BLUE, alpha=0.3)  # fmt: skip
    axis.plot([x], [z], "+", color=RED, label="centre of gravity")
    axis.axhline(0.0, color="0.4", linewidth=1.5)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(xlabel="x, forward [m]", ylabel="above the rail [m]")
    legend_above(axis)
    figure.suptitle(
        f"{body.name}, {body.mass / 1e3:.4g} t, as the homogeneous box of its moments of inertia", x=0.02, ha="left"
    )
    return figure


def draw_axle(axle: Axle) -> Figure:
    """Draw a wheelset of a wagon alone."""
    return draw_vehicle(Wagon(bodies=(), axles=(axle.model_copy(update={"position": 0.0}),)))
