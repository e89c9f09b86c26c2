"""Pictures of vehicles in the vertical plane: wheelsets, bogies, and what of their suspensions is not linear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.bogie import Bogie
from wheeltapper.describe.vehicle.kinks import kinks_of
from wheeltapper.describe.vehicle.wagon import Wagon, wagon_for
from wheeltapper.describe.vehicle.wheelsets import Wheelsets
from wheeltapper.faces.panels import BLUE, COLOURS, RED, legend_above, panels
from wheeltapper.faces.vehicles import draw_vehicle
from wheeltapper.ground.errors import InputError, value_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
COILS, TALL, FRAME = 5, 0.45, 0.22
"""Coils of a drawn spring, its height, and the thickness of a drawn frame, m."""
STROKE, PACE = 0.02, 0.5
"""Compression, m, and rate, m/s, to which suspensions are drawn at least."""
POINTS = 400


class Suspension(NamedTuple):
    """A suspension: what it is called, its spring and damper, and the prefix of its fields in the noun."""

    name: str
    of: Any
    prefix: str
    stiffness: float
    damping: float


def suspensions_of(vehicle: Any) -> Iterator[Suspension]:
    """Yield the suspensions of a vehicle in the plane, each kind once."""
    if isinstance(vehicle, Bogie):
        for prefix in ("primary_", "secondary_"):
            held = (float(getattr(vehicle, prefix + name)) for name in ("stiffness", "damping"))
            yield Suspension(prefix.strip("_"), vehicle, prefix, *held)
        return
    wheelsets = getattr(vehicle, "wheelsets", (vehicle,))
    for number, wheelset in enumerate(wheelsets, 1):
        if wheelset not in wheelsets[: number - 1]:
            name = "suspension" if len(set(wheelsets)) == 1 else f"wheelset {number}"
            yield Suspension(name, wheelset, "", float(wheelset.stiffness), float(wheelset.damping))


def draw_any_vehicle(vehicle: Vehicle) -> Figure:
    """Draw a vehicle: a wagon in three views, others from the side beside the forces of their suspensions."""
    wagon = wagon_for(vehicle)
    if isinstance(wagon, Wagon):
        return draw_vehicle(wagon)
    if not hasattr(vehicle, "plane"):
        raise InputError("", "what", value_text(vehicle), "a vehicle whose bodies are known")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.5))
    side, spring, damper = figure.subplots(1, 3, width_ratios=(1.2, 1.0, 1.0))
    draw_side(side, vehicle)
    for number, suspension in enumerate(suspensions_of(vehicle)):
        _draw_forces(spring, damper, suspension, COLOURS[number])
    spring.set(xlabel="compression from rest [mm]", ylabel="force on the wheel, downwards [kN]")
    damper.set(xlabel="rate of compression [m/s]", ylabel="force of the damper [kN]")
    for axis, name in ((spring, "springs"), (damper, "dampers")):
        axis.axhline(0.0, color="0.5", linewidth=0.8, zorder=0)
        axis.set_title(name)
        legend_above(axis, 2)
    figure.suptitle(vehicle_words(vehicle), x=0.02, ha="left", fontsize=9)
    return figure


def vehicle_words(vehicle: Any) -> str:
    """Return a vehicle in words: how many wheelsets, what they weigh."""
    if isinstance(vehicle, Bogie):
        static = f"static force {float(vehicle.wheel_load) / 1e3:.4g} kN per wheelset"
        masses = f"wheelsets of {vehicle.wheelset_mass:g} kg, frame of {vehicle.frame_mass:g} kg"
        return f"bogie, wheelbase {vehicle.wheelbase:g} m: {masses}, {static}"
    several = getattr(vehicle, "wheelsets", (vehicle,))
    first: Any = several[0]
    static = f"{float(first.mass):g} kg, static force {float(first.weight) / 1e3:.4g} kN"
    return f"wheelset of {static}" if len(several) == 1 else f"{len(several)} wheelsets, the first of {static}"


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
    if isinstance(vehicle, Wheelsets):
        return [(float(x), float(one.radius)) for x, one in zip(vehicle.positions, vehicle.wheelsets, strict=True)]
    positions: Sequence[float] = getattr(vehicle, "positions", (0.0,))
    return [(float(x), float(vehicle.radius)) for x in positions]


def draw_side(axis: Axes, vehicle: Any) -> None:
    """Draw wheels, springs and a frame, or the points that the springs hang on, from the side, to scale."""
    from matplotlib.patches import Circle

    wheels = wheels_of(vehicle)
    for number, (x, radius) in enumerate(wheels, 1):
        for face, alpha in ((True, 0.15), (False, 1.0)):
            axis.add_patch(Circle((x, radius), radius, fill=face, color="0.3", alpha=alpha))
        axis.plot([x], [radius], "o", color="0.3", markersize=3)
        axis.annotate(str(number), (x, 0.0), (0, -4), textcoords="offset points", ha="center", va="top", fontsize=7)
        _draw_spring(axis, x, radius + 0.08, radius + 0.08 + TALL)
    top = max(radius for _, radius in wheels) + 0.08 + TALL
    if isinstance(vehicle, Bogie):
        low, high = min(x for x, _ in wheels) - 0.3, max(x for x, _ in wheels) + 0.3
        axis.fill([low, high, high, low], [top, top, top + FRAME, top + FRAME], facecolor=BLUE, alpha=0.25)
        middle = 0.5 * (low + high)
        axis.annotate("frame", (middle, top + FRAME / 2), ha="center", va="center", fontsize=8)
        _draw_spring(axis, middle, top + FRAME, top + FRAME + TALL)
        _draw_hold(axis, middle, top + FRAME + TALL)
    else:
        for x, _ in wheels:
            _draw_hold(axis, x, top)
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
