"""Pictures of a scenario before it runs: who runs, what lies ahead, and the law of the contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.kinks import kinks_of
from wheeltapper.faces.laws import curves_of, draw_force_of_contact
from wheeltapper.faces.panels import COLOURS, RED, in_unit, legend_above, spaced
from wheeltapper.faces.plane import draw_side, wheels_of
from wheeltapper.faces.vehicles import draw_view
from wheeltapper.ground.needs import BOGIE, DECK, FLEXIBLE_TRACK, SEVERAL_BODIES, WHEELSETS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
POINTS = 4000
MOST_SEATS = 60
"""Most seats that are marked along a path."""


def draw_scenario(scenario: Scenario) -> Figure:
    """Draw the vehicle from the side, the path ahead of it, and the force of its contact."""
    from matplotlib.figure import Figure

    is_long = SEVERAL_BODIES in scenario.needs
    places = ((0, slice(None)), (1, 1), (1, 0)) if is_long else ((0, 0), (0, 1), (1, slice(None)))
    figure = Figure(figsize=(11.0, 7.5))
    grid = figure.add_gridspec(2, 2, height_ratios=(0.6 if is_long else 1.2, 1.0), width_ratios=(1.4, 1.0))
    side, law, path = (figure.add_subplot(grid[at]) for at in places)
    if is_long:
        draw_view(side, scenario.vehicle, "side")
        vehicle = f"wagon of {len(scenario.vehicle.axles)} wheelsets"
    else:
        draw_side(side, scenario.vehicle)
        vehicle = scenario.vehicle.words
    draw_force_of_contact(law, scenario.contact, per_wheel=is_long)
    law.set_title(f"contact: {type(scenario.contact).__name__}")
    _mark_static(law, scenario)
    draw_path(path, scenario)
    figure.suptitle(
        f"{vehicle}; {spaced(type(scenario.track).__name__)}; {float(scenario.speed):g} m/s for "
        f"{float(scenario.duration):g} s, rolling as a {scenario.rolling}", x=0.02, ha="left", fontsize=9,
    )  # fmt: skip
    return figure


def _mark_static(axis: Axes, scenario: Scenario) -> None:
    """Mark the force at rest on the law, where the vehicle's wheels carry alike."""
    if SEVERAL_BODIES in scenario.needs:
        return
    weight = float(scenario.vehicle.plane.wheelsets[0].weight)
    alone = not scenario.needs & {FLEXIBLE_TRACK, WHEELSETS, BOGIE} and not kinks_of(scenario.vehicle).needs
    stiffness = float(scenario.vehicle.stiffness) if alone else 0.0  # elsewhere springs are stretched at rest
    first = curves_of(scenario.contact)[0]
    carried = first.force + stiffness * first.x
    if carried.min() <= weight <= carried.max():
        x, force = (float(np.interp(weight, carried, values)) for values in (first.x, first.force))
        axis.plot([1e6 * x], [force / 1e3], "o", color=RED, label="at rest")
        legend_above(axis)


def heights_of(scenario: Scenario, x: FloatArray, items: Sequence[Any]) -> FloatArray:
    """Return the sum of irregularities of rail and wheel at places x, m."""
    _, radius = wheel_at(scenario)
    return np.asarray(np.sum([np.zeros_like(x), *(item.course(radius).value(x) for item in items)], axis=0))


def irregularities_by_place(scenario: Scenario) -> dict[str, tuple[Any, ...]]:
    """Return the irregularities under each place that is named, or of all wheels under their own names."""
    if isinstance(scenario.irregularity, dict):
        return dict(scenario.irregularity)
    items = scenario.irregularities
    return {", ".join(sorted({spaced(type(item).__name__) for item in items})) or "level": items}


def wheel_at(scenario: Scenario, wheelset: int = 1) -> tuple[float, float]:
    """Return position and radius of a wheelset, m."""
    if SEVERAL_BODIES in scenario.needs:
        axle = scenario.vehicle.axles[wheelset - 1]
        return float(axle.position), float(axle.radius)
    return wheels_of(scenario.vehicle)[wheelset - 1]


def kinks_within(scenario: Scenario, first: float, last: float) -> FloatArray:
    """Return places of borders of stretches between two places, m, so that steps are drawn as steps."""
    found: list[float] = []
    for item in scenario.irregularities:
        course: Course = item.course(wheel_at(scenario)[1])
        found += [stretch.start for stretch in course.stretches if first < stretch.start < last]
    return np.array(found)


def places_along(scenario: Scenario, first: float, last: float, count: int = POINTS) -> FloatArray:
    """Return places from one to another, with both sides of each kink, m."""
    kinks = kinks_within(scenario, first, last)
    return np.union1d(np.linspace(first, last, count), np.concatenate([kinks, np.nextafter(kinks, -np.inf)]))


def draw_path(axis: Axes, scenario: Scenario) -> None:
    """Draw what lies ahead, along the run; seats are marked, and a deck is shaded."""
    way = float(scenario.speed * scenario.duration)
    first, last = -0.02 * way, way or 1.0
    x = places_along(scenario, first, last)
    heights = {name: heights_of(scenario, x, items) for name, items in irregularities_by_place(scenario).items()}
    factor, unit = in_unit(np.abs([*heights.values()]).max(keepdims=True), "m")
    for (name, height), colour in zip(heights.items(), COLOURS, strict=False):
        axis.plot(x, factor * height, color=colour, label=name)
    track: Any = scenario.track
    if DECK in scenario.needs:
        start = first if track.start is None else float(track.start)
        end = last if track.length is None else start + float(track.length)
        axis.axvspan(max(start, first), min(end, last), color="0.93", zorder=0, label="deck")
    if FLEXIBLE_TRACK in scenario.needs:
        _mark_seats(axis, track, first, last)
    axis.set(xlabel="position of the leading wheelset [m]", ylabel=f"irregularity [{unit}]", xlim=(first, last))
    axis.set_title("the path ahead")
    legend_above(axis)


def _mark_seats(axis: Axes, track: Any, first: float, last: float) -> None:
    spacing, origin = float(track.spacing), float(track.first_sleeper)
    numbers = np.arange(np.ceil((first - origin) / spacing), np.floor((last - origin) / spacing) + 1)
    if len(numbers) <= MOST_SEATS:
        axis.plot(origin + spacing * numbers, np.full(len(numbers), 0.02), "|", color="0.3", markersize=8,
                  transform=axis.get_xaxis_transform(), label="seats")  # fmt: skip
