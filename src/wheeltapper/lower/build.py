"""From a scenario to a program: here units and names are removed, and kept for the results."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course, level
from wheeltapper.ground.needs import MEMORY, YIELDING
from wheeltapper.ground.notes import Note
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.laws import ellipse
from wheeltapper.lower.laws.plastic import yielding_programs
from wheeltapper.lower.lowered.wheel import Lowered
from wheeltapper.lower.numbers import METHODS, Method, Placing, numbers_of
from wheeltapper.lower.paths.fit import Factor
from wheeltapper.lower.paths.point import point_table
from wheeltapper.lower.paths.rolling import circle_table
from wheeltapper.lower.paths.sampled import over_the_run, pieces_note
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.plausible import doubts
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]


SHARP_DIP = "sharp dip"
"""Cause of the note on a dip that is more curved than the wheel, so that the wheel bridges it."""


def courses_of(scenario: Scenario) -> list[Course]:
    """Return the courses of all irregularities of a scenario."""
    return [item.course(scenario.vehicle.radius) for item in scenario.irregularities]


def table_of(scenario: Scenario, end: float, method: Method) -> tuple[PathTable, list[Note]]:
    """Return the path of the wheel's centre up to x = end (m), and notes on it for the user."""
    of = ellipse.factor_function(scenario.contact, scenario.vehicle)
    return path_table(courses_of(scenario), end, method, scenario.rolling, scenario.vehicle.radius, of)


def path_table(
    courses: list[Course], end: float, method: Method, rolling: str, radius: float,
    factor: Callable[[FloatArray], FloatArray] | None,
) -> tuple[PathTable, list[Note]]:  # fmt: skip
    """Return the path of a wheel's centre over the sum of the courses up to x = end (m), and notes on it.

    `factor` gives the factor on the contact force from the second derivative of the irregularity.
    """
    courses = courses or [Course((level(-inf, inf),), 0.0)]
    ahead = radius if rolling == "circle" else 0.0
    courses = [over_the_run(course, -ahead, end + ahead) for course in courses]
    height = sum(course.height for course in courses)
    followed = None if factor is None else Factor(factor, _curvature_noise(courses, end))
    if rolling == "point":
        table = point_table(courses, end, height, method.fit, followed)
        notes = sharp_dip(*curvature_range(courses, end)[1], radius)
    else:
        table, notes = circle_table(courses, end, height, method.fit, radius, followed)
    halves = table.rows[:, contract.SCALE]
    return table, notes + pieces_note(courses, table.rows[:, contract.START], halves)


def _curvature_noise(courses: list[Course], end: float) -> float:
    """Return the scatter (1/m) of curvatures that are no exact forms; a fit must not follow it."""
    near = 1e-9  # m; over this length no curvature changes
    total = 0.0
    for course in courses:
        scatter = [0.0]
        for stretch in course.stretches:
            first, last = max(stretch.start, 0.0) + near, min(stretch.end, end) - near
            if stretch.exact is None and first < last:
                x = np.linspace(first, last, 1001)
                if stretch.scatter is not None:
                    scatter.append(float(stretch.scatter(x).max()))
                    continue
                bends = stretch.curvature(x - near) - 2.0 * stretch.curvature(x) + stretch.curvature(x + near)
                scatter.append(float(np.abs(bends).max()))
        total += 2.0 * max(scatter)
    return total


def curvature_range(courses: list[Course], end: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return lowest and highest curvature (1/m) of the courses' sum up to x = end, each with its place, m."""
    x = np.linspace(0.0, end, 20_001)
    curvature = sum((course.curvature(x) for course in courses), np.zeros_like(x))
    least, most = int(np.argmin(curvature)), int(np.argmax(curvature))
    return (float(curvature[least]), float(x[least])), (float(curvature[most]), float(x[most]))


def sharp_dip(curvature: float, x: float, radius: float) -> list[Note]:
    """Return a warning if the irregularity is concave with a smaller radius than that of the wheel."""
    if curvature * radius <= 1.0:
        return []
    text = (
        f"the irregularity is more sharply hollow (radius {1e3 / curvature:.4g} mm at x = {x:.6g} m) than the wheel is "
        f"round (radius {1e3 * radius:.4g} mm): a wheel cannot follow it, but here it does, as a point would; use "
        'rolling="circle"'
    )
    return [Note(text, SHARP_DIP, curvature * radius, doubtful=True)]


def lower(scenario: Scenario, method: str = "default", path: tuple[PathTable, list[Note]] | None = None) -> Lowered:
    """Lower a scenario with one wheelset to a program.

    Parameters
    ----------
    scenario
        The scenario.
    method
        "default" or "strict".
    path
        Result of `table_of` for the scenario, if it is known already.
    """
    needs, chosen = scenario.needs, METHODS[method]
    table, notes = path or table_of(scenario, float(scenario.speed * scenario.duration), chosen)
    here = np.zeros(1)
    placing = Placing(np.ones(1), np.ones(1), np.zeros(1), table.height_at(here), table.factor_at(here))
    value = Fields(scenario)
    numbers, units = numbers_of(value, placing, chosen)
    numbers[:, contract.LOOP] = table.loop
    numbers[:, contract.LOOP_JOIN] = table.loop_join
    program = Program(table.rows, numbers[0])
    static_force = units.static_force.item()
    if YIELDING in needs:
        (program,), (static_force,) = yielding_programs(value, [table.rows], numbers, units, placing.height)
        if MEMORY in needs and scenario.contact.warning:
            notes = [*notes, Note(scenario.contact.warning, doubtful=True)]
    return Lowered(
        scenario,
        program,
        table,
        length=units.length.item(),
        time=units.time.item(),
        force=units.force.item(),
        static_force=static_force,
        contact_constant=units.contact_constant.item(),
        notes=(*doubts(scenario), *notes),
    )
