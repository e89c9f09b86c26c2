"""From a scenario to a program: the one place where units and names are stripped, and where they are kept to return."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.irregularity.course import Course, level
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.lower import ellipse
from wheeltapper.lower.fit import Factor
from wheeltapper.lower.point import point_table
from wheeltapper.lower.rolling import circle_table
from wheeltapper.lower.table import Table
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Method:
    """Order of the series, tolerance of its steps, and tolerance of the path relative to its height."""

    order: int
    tolerance: float
    fit: float


METHODS = {"default": Method(12, 1e-7, 1e-11), "strict": Method(20, 1e-10, 1e-13)}
EVENT_LIMIT = 10_000_000


@dataclass(frozen=True)
class Lowered:
    """A program with what turns its numbers back into SI units.

    Attributes
    ----------
    length, time, force
        Units of the program in m, s and N.
    table
        The path of the wheel's centre.
    notes
        What the user should know about this lowering: contact at two points, edges, warnings with numbers.
    """

    program: Program
    table: Table
    length: float
    time: float
    force: float
    static_force: float
    contact_constant: float
    notes: tuple[str, ...]


def static_indentation(weight: float, stiffness: float, contact_force: tuple[float, float], height: float) -> float:
    """Return the static indentation in scaled units on a path at `height`: weight + K·(height - δ) = N(δ)."""
    quadratic, cubic = contact_force
    u = 1.0
    for _ in range(100):
        gap = quadratic * u**2 + cubic * u**3 + stiffness * (u**2 - height) - weight
        step = gap / (2 * quadratic * u + 3 * cubic * u**2 + 2 * stiffness * u)
        u -= step
        if abs(step) < 1e-16 * u:
            break
    return u * u


def courses_of(scenario: Scenario) -> list[Course]:
    """Return the courses of all irregularities of a scenario."""
    return [item.course(scenario.vehicle.radius) for item in scenario.irregularities]


def _table(scenario: Scenario, courses: list[Course], method: Method) -> tuple[Table, list[str]]:
    end = scenario.speed * scenario.duration
    if not courses:
        courses = [Course((level(-inf, inf),), 0.0)]
    height = sum(course.height for course in courses)
    of = ellipse.factor_function(scenario.contact, scenario.vehicle)
    factor = None if of is None else Factor(of, _curvature_noise(courses, end))
    if scenario.rolling == "point":
        return point_table(courses, end, height, method.fit, factor), _sharp_dip_notes(scenario, courses, end)
    return circle_table(courses, end, height, method.fit, scenario.vehicle.radius, factor)


def _curvature_noise(courses: list[Course], end: float) -> float:
    """Return the scatter (1/m) of curvatures that come from differences; a fit must not follow it."""
    near = 1e-9  # m, on which no curvature changes
    total = 0.0
    for course in courses:
        scatter = [0.0]
        for stretch in course.stretches:
            first, last = max(stretch.start, 0.0) + near, min(stretch.end, end) - near
            if stretch.exact is None and first < last:
                x = np.linspace(first, last, 1001)
                bends = stretch.curvature(x - near) - 2.0 * stretch.curvature(x) + stretch.curvature(x + near)
                scatter.append(float(np.abs(bends).max()))
        total += 2.0 * max(scatter)
    return total


def _sharp_dip_notes(scenario: Scenario, courses: list[Course], end: float) -> list[str]:
    """Return a warning where the irregularity is more sharply hollow than the wheel is round."""
    x = np.linspace(0.0, end, 20_001)
    curvature = sum((course.curvature(x) for course in courses), np.zeros_like(x))
    radius = scenario.vehicle.radius
    worst = int(np.argmax(curvature))
    if curvature[worst] * radius <= 1.0:
        return []
    return [
        f"the irregularity is more sharply hollow (radius {1e3 / curvature[worst]:.4g} mm at x = {x[worst]:.6g} m) "
        f'than the wheel is round (radius {1e3 * radius:.4g} mm): a wheel cannot follow it; rolling="circle" is exact'
    ]


def lower(scenario: Scenario, method: str = "default") -> Lowered:
    """Lower a scenario with one wheelset to a program.

    Parameters
    ----------
    scenario
        What to simulate.
    method
        "default" or "strict".
    """
    chosen = METHODS[method]
    vehicle, contact = scenario.vehicle, scenario.contact
    weight = vehicle.load + vehicle.mass * vehicle.gravity
    linear = isinstance(contact, Linear)
    constant = contact.stiffness if isinstance(contact, Linear) else ellipse.constant(contact, vehicle)
    length = weight / constant if linear else (weight / constant) ** (2 / 3)
    time = sqrt(vehicle.mass * length / weight)
    table, notes = _table(scenario, courses_of(scenario), chosen)
    numbers = np.zeros(contract.NUMBERS)
    numbers[contract.PACE] = scenario.speed * time
    numbers[contract.LIFT] = 1.0 / length
    numbers[contract.STIFFNESS] = vehicle.stiffness * time**2 / vehicle.mass
    numbers[contract.DAMPING] = vehicle.damping * time / vehicle.mass
    numbers[contract.QUADRATIC if linear else contract.CUBIC] = 1.0
    if isinstance(contact, Linear):
        numbers[contract.BILATERAL] = float(contact.bilateral)
    else:
        numbers[contract.HYSTERESIS] = contact.hysteresis_factor * length / time
    numbers[contract.DECK_FROM] = numbers[contract.DECK_TO] = inf
    law = (numbers[contract.QUADRATIC], numbers[contract.CUBIC])
    static = static_indentation(1.0, numbers[contract.STIFFNESS], law, 0.0)
    prestress = law[0] * static + law[1] * static**1.5
    if isinstance(scenario.track, FloatingDeck):
        _set_deck(numbers, scenario.track, scenario, time)
        numbers[contract.PRESTRESS] = prestress
    _set_start(numbers, scenario, table, length, time, law)
    numbers[contract.END] = scenario.duration / time
    numbers[contract.ORDER] = chosen.order
    numbers[contract.TOLERANCE] = chosen.tolerance
    numbers[contract.EVENT_LIMIT] = EVENT_LIMIT
    numbers[contract.LOOP] = table.loop
    numbers[contract.LOOP_JOIN] = table.loop_join
    return Lowered(
        Program(table.rows, numbers), table, length, time, weight, prestress * weight, constant, tuple(notes)
    )


def _set_deck(numbers: FloatArray, deck: FloatingDeck, scenario: Scenario, time: float) -> None:
    mass = scenario.vehicle.mass
    numbers[contract.DECK_MASS] = deck.mass / mass
    numbers[contract.DECK_STIFFNESS] = deck.stiffness * time**2 / mass
    numbers[contract.DECK_DAMPING] = deck.damping * time / mass
    entry = -inf if deck.start is None else deck.start
    leave = inf if deck.length is None else entry + deck.length
    for place, position in ((contract.DECK_FROM, entry), (contract.DECK_TO, leave)):
        still = inf if position > 0 else -inf
        numbers[place] = position / (scenario.speed * time) if scenario.speed and np.isfinite(position) else still


def _set_start(
    numbers: FloatArray, scenario: Scenario, table: Table, length: float, time: float, law: tuple[float, float]
) -> None:
    start = scenario.start
    if start == "equilibrium":
        x = np.zeros(1)
        height = float(table.height(x)[0]) / length
        factor = float(table.factor(x)[0])
        scaled = (law[0] * factor, law[1] * factor)
        numbers[contract.START_HEIGHT] = height - static_indentation(1.0, numbers[contract.STIFFNESS], scaled, height)
        return
    numbers[contract.START_HEIGHT] = start.displacement / length
    numbers[contract.START_VELOCITY] = start.velocity * time / length
