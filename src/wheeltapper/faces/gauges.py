"""Pictures of wheels to which a model was fitted: what gauges showed of a passage, and how a flat grows over many."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.diagnosis.alarms import PEAKS
from wheeltapper.diagnosis.finding import HEALTHY, NOT_EXPLAINED
from wheeltapper.diagnosis.gauges.design import GaugeDesign
from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.gauges.free_shape import FreeShape
from wheeltapper.diagnosis.gauges.growth import Growth
from wheeltapper.diagnosis.gauges.known import RADIUS
from wheeltapper.diagnosis.gauges.passing import Runs
from wheeltapper.diagnosis.gauges.performance import GaugePerformance
from wheeltapper.diagnosis.gauges.verdicts import INTERVAL
from wheeltapper.faces.panels import BLUE, COLOURS, GREEN, RED, legend_above, panels
from wheeltapper.record.assessment.filtering import low_passed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw_wheel_finding(finding: WheelFinding) -> Figure:
    """Draw what gauges recorded of a wheel, the model, what is left, and the force over the whole passage."""
    from matplotlib.figure import Figure

    figure = Figure()
    draw_wheel(figure, finding)
    return figure


def draw_wheel(figure: Figure, finding: WheelFinding) -> None:
    """Draw the finding of a wheel into a figure."""
    passing, shown, way = finding.passing, finding.sized.shown, finding.direction
    cutoff = Runs(passing, finding.known.scene).highest
    recorded = np.where(passing.used, low_passed(passing.readings, passing.rate, cutoff), np.nan)
    if shown is None:
        figure.set_size_inches(9.0, 2.6)
        axis = figure.subplots()
        axis.plot(way * passing.x, 1e-3 * recorded, color=BLUE, linewidth=0.8)
        axis.set(xlabel="place of the wheel along the track [m]", ylabel="gauges [kN]")
        axis.set_title(str(finding))
        return
    figure.set_size_inches(9.0, 10.0)
    gauges, left, force, later = figure.subplots(4, 1, height_ratios=(2, 1, 2, 1.6))
    for axis in (gauges, left):
        axis.sharex(force)
    model = np.where(passing.used, shown.read, np.nan)
    for number, (one, other) in enumerate(zip(recorded.T, model.T, strict=True)):
        names = ("", "") if number else (f"gauges, below {cutoff:g} Hz", "model")
        gauges.plot(way * passing.x, 1e-3 * one, color=BLUE, linewidth=1.2, label=names[0])
        gauges.plot(way * passing.x, 1e-3 * other, color=RED, linewidth=0.7, label=names[1])
        left.plot(way * passing.x, 1e-3 * (one - other), color=BLUE, linewidth=0.6)
    gauges.set(ylabel="force [kN]")
    left.set(ylabel="difference [kN]")
    rate = passing.rate * (len(shown.force) / len(passing.readings))
    force.plot(
        way * shown.x,
        1e-3 * shown.force,
        color="0.6",
        linewidth=0.7,
        label=f"raw, at most {1e-3 * shown.largest:.0f} kN",
    )
    below = low_passed(shown.force, rate, PEAKS)
    label = f"below {PEAKS:g} Hz, at most {1e-3 * shown.below:.0f} kN"
    force.plot(way * shown.x, 1e-3 * below, color=BLUE, linewidth=0.9, label=label)
    for number, one in enumerate(passing.sensors):
        force.axvspan(
            way * one.x1, way * one.x2, color=RED, alpha=0.12, linewidth=0.0, label="" if number else "between gauges"
        )
    force.set(xlabel="place of the wheel along the track [m]", ylabel="force on the rail, by the model [kN]")
    gauges.set_title(fill(str(finding), 110), fontsize=8, loc="left", pad=22.0)
    legend_above(gauges, 2)
    legend_above(force, 3)
    if finding.free_shape is not None:
        _draw_tread(later, finding.free_shape)
        return
    if finding.verdict == NOT_EXPLAINED:
        later.set_visible(False)
        return
    outlook = finding.outlook()
    for name, colour, words in (("largest_force", "0.4", "raw"), ("largest_below_500", BLUE, f"below {PEAKS:g} Hz")):
        low, median, high = (1e-3 * outlook[name].sel(quantile=one).values[:, 0] for one in ("low", "median", "high"))
        later.plot(outlook.speed, median, color=colour, label=f"{words}, nine of ten within")
        later.fill_between(outlook.speed, low, high, color=colour, alpha=0.2, linewidth=0.0)
    later.set(xlabel="speed [m/s]", ylabel="peak to come [kN]", ylim=(0.0, None))
    legend_above(later, 2)


def _draw_tread(axis: Axes, free: FreeShape) -> None:
    """Draw a tread of free shape over the circumference, with 90 % of each place, and its hollows."""
    arc, middle = free.values[RADIUS] * free.tread.angles, 1e3 * free.tread.deviations
    half = 1e3 * INTERVAL * free.deviations
    axis.plot(arc, middle, color=BLUE, label="tread, nine of ten within")
    axis.fill_between(arc, middle - half, middle + half, color=BLUE, alpha=0.25, linewidth=0.0)
    for number, one in enumerate(free.parts):
        ends = [free.values[RADIUS] * one.angle + by * one.length for by in (-0.5, 0.5)]
        axis.axvspan(*ends, color=RED, alpha=0.12, linewidth=0.0, label="" if number else "told")
    axis.set(xlabel="place on the circumference [m]", ylabel="deviation [mm]", xlim=(0.0, arc[-1]))
    legend_above(axis, 2)


def draw_growth(growth: Growth) -> Figure:
    """Draw lengths of a flat over the passages of its wheel, their lines with 90 % intervals, and renewals."""
    figure, (axis,) = panels(width=9.0, height=4.0)
    flats = [one for one in growth.passages if one.kind != HEALTHY]
    at, lengths = [one.at for one in flats], 1e3 * np.array([one.length for one in flats])
    own = INTERVAL * lengths * np.array([one.own for one in flats])
    axis.errorbar(at, lengths, own, fmt="o", color=BLUE, markersize=3.5, linewidth=0.8, label="length, own error")
    sound = [one for one in growth.passages if one.kind == HEALTHY]
    if sound:
        unseen = [1e3 * one.unseen[0] for one in sound]
        axis.plot([one.at for one in sound], unseen, "v", color=GREEN, markersize=5, label="healthy, or shorter")
    lines = [course for course in growth.courses if course.found > 1]
    for number, course in enumerate(lines):
        along = np.linspace(course.first, course.last, 50)
        line, off = 1e3 * np.array([course.length(one) for one in along.tolist()]).T
        axis.plot(along, line, color=RED, label="" if number else "line, 90 %")
        axis.fill_between(along, line - INTERVAL * off, line + INTERVAL * off, color=RED, alpha=0.2, linewidth=0.0)
    for number, place in enumerate(growth.renewals):
        axis.axvline(place, color="0.4", linestyle="--", linewidth=0.9, label="" if number else "renewed before")
    when = f"time since {growth.time(0.0)}" if growth.start else "when the wheel passed"
    axis.set(xlabel=f"{when} [{growth.unit}]", ylabel="length of the flat [mm]", ylim=(0.0, None))
    axis.set_title(str(growth), fontsize=8, loc="left", pad=22.0)
    legend_above(axis, 4)
    return figure


def draw_gauge_performance(found: GaugePerformance) -> Figure:
    """Draw which flats a site finds, and around a wheel the shortest one and how well its length is known."""
    figure, (chances, shortest, known) = panels(3, 9.0)
    chart, number = found.chart, 0
    for side in chart.side.values:
        for fault in chart.fault.values:
            for speed in chart.speed.values:
                own = chart.sel(side=side, fault=fault, speed=speed).isel(static_force=0)
                colour, label = COLOURS[number % len(COLOURS)], f"{fault}, {side}, {speed:g} m/s"
                number += 1
                asked = own.probability.notnull().all("place")
                own = own.isel(size=asked.values)
                chances.plot(1e3 * own["size"], own.probability.mean("place"), ".-", color=colour, label=label)
                shortest.plot(own.place, 1e3 * own.smallest, ".-", color=colour)
                known.plot(own.place, 1e3 * own.deviation.isel(size=-1), ".-", color=colour)
    chances.set(xlabel="length of the flat [mm]", ylabel="probability of detection", ylim=(-0.02, 1.02))
    shortest.set(xlabel="place on the wheel [share of a turn]", ylabel="shortest found with 90 % [mm]")
    known.set(xlabel="place on the wheel [share of a turn]", ylabel="sd of the longest [mm]", ylim=(0.0, None))
    legend_above(chances, 2)
    figure.suptitle(f"flats before gauges, {1e-3 * float(chart.static_force[0]):g} kN", x=0.02, ha="left", fontsize=9)
    return figure


def draw_gauge_design(design: GaugeDesign) -> Figure:
    """Draw which cribs have a pair, how well a length is known around the wheel, and the criterion over the number."""
    figure, (pairs, around, numbers) = panels(3, 9.0)
    shown = [design.best, *design.even]
    for row, one in enumerate(shown):
        pairs.plot(one.cribs, [row] * len(one.cribs), "s", color=COLOURS[row], label=one.kind)
        deviation = np.sqrt((one.deviations**2).mean(axis=0))
        places = np.arange(len(deviation)) / len(deviation)
        around.plot(places, 1e3 * deviation, ".-", color=COLOURS[row])
    cribs = design.chart().crib.values
    pairs.set(
        xlabel="crib [bays from the first pair]", xlim=(cribs[0] - 0.5, cribs[-1] + 0.5), ylim=(len(shown) - 0.5, -0.5)
    )
    pairs.yaxis.set_visible(False)
    around.set(xlabel="place on the wheel [share of a turn]", ylabel="sd of the length [mm]", ylim=(0.0, None))
    tried = [(len(one.cribs), 1e3 * one.value) for one in design.candidates]
    numbers.plot(*np.array(tried).T, ".", color="0.75", label="tried")
    found = design.front or (design.best,)
    numbers.plot([len(one.cribs) for one in found], [1e3 * one.value for one in found], "*-", color=RED, label="best")
    most = max(len(one.cribs) for one in design.candidates)
    numbers.set(xlabel="pairs [number]", xlim=(0.5, most + 0.5), ylabel=f"{design.criterion} [mm]")
    numbers.xaxis.get_major_locator().set_params(integer=True)
    legend_above(pairs)
    legend_above(numbers)
    figure.suptitle(str(design).partition(":")[0], x=0.02, ha="left", fontsize=9)
    return figure
