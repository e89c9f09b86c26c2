"""Pictures of how wheels lie on rails: the profiles on each other, and what a lateral shift changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.profile.files import rail_profile, wheel_profile
from wheeltapper.describe.profile.s1002 import FLANGE_BACK
from wheeltapper.describe.profile.wheel_rail import Cones, Profiles, WheelRail
from wheeltapper.faces.panels import BLUE, COLOURS, RED, legend_above
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.lower.laws.geometry import laid_rail, radius_difference
from wheeltapper.lower.laws.patches import geometry_of
from wheeltapper.record.labels import CONICITIES

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RADIUS, CROWN = 0.46, 0.3
"""Of wheel and rail, m."""
SHIFT = 5e-3
"""Largest shift that is drawn, m."""


def draw_profiles(profiles: Profiles) -> Figure:
    """Draw a left wheel on its rail, where they touch, and the difference of the rolling radii, over the shift."""
    from matplotlib.figure import Figure

    if not isinstance(profiles, WheelRail | Cones):
        raise InputError("", "what", value_text(profiles), "WheelRail or Cones")
    figure = Figure(figsize=(11.0, 8.0))
    grid = figure.add_gridspec(2, 2, height_ratios=(1.2, 1.0))
    section, place, difference = (figure.add_subplot(grid[at]) for at in ((0, slice(None)), (1, 0), (1, 1)))
    geometry = geometry_of(profiles, RADIUS, CROWN)
    shifts = np.linspace(-SHIFT, SHIFT, 201)
    differences = [_difference(geometry, float(shift)) for shift in shifts]
    middle = geometry.table_at("place", 0.0)
    touching = np.interp(shifts, geometry.shift, geometry.place)
    place.plot(1e3 * shifts, 1e3 * (touching - middle), color=BLUE)
    place.set(xlabel="lateral shift of the wheelset [mm]", ylabel="place of contact, outwards [mm]")
    place.set_title("contact on the rail")
    difference.plot(1e3 * shifts, 1e3 * np.array(differences), color=BLUE, label="left less right")
    slope = (_difference(geometry, 1e-4) - _difference(geometry, -1e-4)) / 2e-4
    difference.plot(
        1e3 * shifts, 1e3 * slope * shifts, "--", color="0.5", linewidth=0.8,
        label=f"equivalent conicity {abs(slope) / 2.0:.3g} in the middle",
    )  # fmt: skip
    difference.set(xlabel="lateral shift of the wheelset [mm]", ylabel="rolling radii [mm]")
    legend_above(difference, 2)
    if isinstance(profiles, WheelRail):
        _draw_section(section, profiles, middle)
        title = f"{profiles.wheel} on {profiles.rail}, 1:{1 / profiles.inclination:.3g}" if profiles.inclination else (
            f"{profiles.wheel} on {profiles.rail}, upright"
        )  # fmt: skip
    else:
        _draw_cone(section, profiles)
        title = f"cones, 1:{1 / profiles.conicity:.3g}" if profiles.conicity else "cylinders"
    figure.suptitle(f"{title}; wheels of {RADIUS:g} m", x=0.02, ha="left")
    return figure


def draw_conicity(found: xr.Dataset) -> Figure:
    """Draw the conicity of a pair of profiles over the amplitude, and what it follows from."""
    return draw_conicities([found])


def draw_conicities(found: Sequence[xr.Dataset]) -> Figure:
    """Draw the conicities of several pairs of profiles over one another, with the differences of rolling radii."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 7.0))
    figures, radii = figure.subplots(2, 1)
    for number, one in enumerate(found):
        words = f"{one.attrs['profiles']}, {one.attrs['contact']}: {one.attrs['at_3_mm']:.3f} at 3 mm"
        colour = COLOURS[number % len(COLOURS)]
        figures.plot(1e3 * one["amplitude"], one[CONICITIES[one.attrs["contact"]]], color=colour, label=words)
        radii.plot(1e3 * one["lateral_shift"], 1e3 * one["radius_difference"], color=colour)
    figures.axvline(3.0, color="0.7", linewidth=0.8)
    figures.set(xlabel="amplitude of the lateral motion [mm]", ylabel="conicity", ylim=(0.0, None))
    radii.set(xlabel="shift of the wheelset to the left [mm]", ylabel="rolling radii, left less right [mm]")
    farthest = 1e3 * max(float(one["amplitude"].max()) for one in found)
    sizes = [
        np.abs(one["radius_difference"].where(np.abs(one["lateral_shift"]) <= 1e-3 * farthest)).max() for one in found
    ]
    most = 1.1e3 * max(float(size) for size in sizes)
    radii.set(xlim=(-farthest, farthest), ylim=(-most, most) if most > 0.0 else None)
    legend_above(figures, 1)
    return figure


def _difference(geometry: object, shift: float) -> float:
    try:
        return radius_difference(geometry, shift, RADIUS)  # type: ignore[arg-type]
    except InputError:  # beyond the tables
        return float("nan")


def _draw_section(axis: Axes, profiles: WheelRail, touching: float) -> None:
    """Draw the profiles on each other, the wheelset in the middle."""
    place, height = laid_rail(rail_profile(profiles.rail), profiles.inclination, profiles.gauge)
    shape = wheel_profile(profiles.wheel)
    y = np.linspace(-0.07, 0.065, 1200)
    below = -1e-3 * shape(1e3 * y)
    datum = 0.5 * profiles.flange_backs + 1e-3 * FLANGE_BACK
    lifted = float(np.nanmax(np.interp(datum + y, place, height, np.nan, np.nan) - below))
    axis.plot(1e3 * place, 1e3 * height, color="0.4", linewidth=2.0, label="rail")
    axis.plot(1e3 * (datum + y), 1e3 * (below + lifted), color=BLUE, label="wheel")
    axis.plot([1e3 * touching], [1e3 * np.interp(touching, place, height)], "o", color=RED, label="contact")
    axis.set_aspect("equal")
    axis.set(xlabel="from the track's middle [mm]", ylabel="above the rail's crown [mm]")
    axis.set_title("left wheel")
    legend_above(axis)


def _draw_cone(axis: Axes, profiles: Cones) -> None:
    """Draw a cone on the place at which it touches."""
    y = np.linspace(-0.06, 0.06, 60)
    axis.plot(1e3 * (profiles.arm + y), -1e3 * profiles.conicity * -y, color=BLUE, label="wheel")
    axis.plot([1e3 * profiles.arm], [0.0], "o", color=RED, label="contact")
    axis.set(xlabel="from the track's middle [mm]", ylabel="above the contact [mm]", ylim=(-12.0, 12.0))
    axis.set_title("left wheel")
    legend_above(axis)
