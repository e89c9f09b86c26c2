"""From a scenario to cells that begin at phase zero of its irregularity, and end one period later.

The section is the place from which on all irregularities repeat. It is moved to x = 0; what lies behind it is continued
backwards by whole periods, so that a rolling circle meets the same rail in the first period as in every other.
"""

from __future__ import annotations

from functools import cached_property
from math import ceil, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import courses_of, path_table
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.laws.ellipse import factor_function
from wheeltapper.lower.many import LoweredCells
from wheeltapper.lower.numbers import METHODS, Method, Units
from wheeltapper.lower.paths.table import PathTable, assemble
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.wheel.ensemble import Cells

FloatArray = NDArray[np.float64]
MOST_PERIODS = 1000
"""Largest number of its longest period that a sum of irregularities may need until it repeats."""
COMMENSURATE = 1e-9
"""Largest distance from a whole number of a ratio of periods that counts as whole."""


def period_of(scenario: Scenario) -> float:
    """Return the period of a scenario's irregularities, m.

    Raises
    ------
    InputError
        If one of them does not repeat without end, or they have no common period.
    """
    return _common_period(courses_of(scenario))


def _common_period(courses: list[Course]) -> float:
    periods = []
    for i, course in enumerate(courses):
        if course.period is None:
            raise InputError(
                "", f"irregularity.{i}", "an irregularity that does not repeat without end",
                "one that does: a Corrugation without end, a Repeated without count, what is on the wheel",
            )  # fmt: skip
        periods.append(course.period)
    longest = max(periods)
    for many in range(1, MOST_PERIODS + 1):
        ratios = many * longest / np.array(periods)
        if np.all(np.abs(ratios - np.round(ratios)) <= COMMENSURATE * ratios):
            return many * longest
    listed = " and ".join(f"{period:.6g} m" for period in periods)
    raise InputError(
        "", "irregularity", f"periods of {listed}, which have no common multiple up to {MOST_PERIODS:g} of the longest",
        "periods that have one",
    )  # fmt: skip


def section_place(scenario: Scenario) -> float:
    """Return where the irregularities of a scenario begin to repeat, m; zero if they always have."""
    return max((c.repeats_from for c in courses_of(scenario) if isfinite(c.repeats_from)), default=0.0)


def periodic_table(scenario: Scenario, method: Method) -> tuple[PathTable, list[Note]]:
    """Return the path of the wheel's centre from the section on, as a table that repeats, and notes on it."""
    courses, place = courses_of(scenario), section_place(scenario)
    period, radius = _common_period(courses), scenario.vehicle.radius
    moved = [course.moved(-place - _behind(scenario, course.period or period)) for course in courses]
    factor = factor_function(scenario.contact, scenario.vehicle)
    if len(moved) == 1:
        return path_table(moved, 3.0 * period, method, scenario.rolling, radius, factor)
    table, notes = path_table(moved, period, method, scenario.rolling, radius, factor)
    rows = table.rows[table.rows[:, contract.START] < period]
    rows[-1, contract.STOP] = period
    return assemble(rows, sum(course.height for course in moved), 0), notes


def _behind(scenario: Scenario, period: float) -> float:
    """Return how far an irregularity has to begin behind the section, in whole periods: as far as a wheel reaches."""
    return ceil(scenario.vehicle.radius / period) * period if scenario.rolling == "circle" else 0.0


class SectionCells(NamedTuple):
    """Cells that begin at the section and end one period later, their units, and the time of that period, s."""

    cells: Cells
    units: Units
    period: FloatArray  # (cells,)

    def program(self, cell: int) -> Program:
        """Return the program of one cell."""
        first, many = int(self.cells.first[cell]), int(self.cells.many[cell])
        return Program(self.cells.pieces[first : first + many], self.cells.numbers[cell])


class Section:
    """A scenario over a periodic irregularity, lowered from section to section.

    Parameters
    ----------
    scenario
        Its duration does not matter.
    method
        "default" or "strict".

    Attributes
    ----------
    given
        The scenario as it was given.
    scenario
        The same scenario; its irregularity, if it is the only one and can be moved, begins at x = 0, so that all cells
        share a table.
    length
        Period of the irregularities, m.
    notes
        What the user should know of the scenario.
    """

    def __init__(self, scenario: Scenario, method: str = "default") -> None:
        self.length = period_of(scenario)
        self.given, self.method = scenario, method
        moves = moving_fields(scenario)
        self.scenario = scenario.replaced(dict.fromkeys(moves, 0.0)) if moves else scenario
        self._table: tuple[PathTable, list[Note]] | None = None
        self._one, self.notes = self._lowered({})

    def cells(self, changed: dict[str, FloatArray]) -> SectionCells:
        """Return cells; `changed` holds, by path, one number per cell in SI units."""
        return self._rescaled(changed) if set(changed) <= {"speed"} else self._lowered(changed)[0]

    def cells_to_start(self, changed: dict[str, FloatArray]) -> SectionCells:
        """Return the same for marches that begin at states of their own: the cells' starts mean nothing."""
        known = {"speed", *self._heights}
        return self._rescaled(changed) if set(changed) <= known else self._lowered(changed)[0]

    def _lowered(self, changed: dict[str, FloatArray]) -> tuple[SectionCells, tuple[Note, ...]]:
        count = max((len(values) for values in changed.values()), default=1)
        speed = np.asarray(changed.get("speed", np.full(count, self.scenario.speed)), dtype=float)
        period = self._lengths(changed, count) / speed
        many = LoweredCells(self.scenario, changed | {"duration": period}, self.method, self._tabled)
        return SectionCells(many.cells, many.units, period), tuple(note.sentence_of(count) for note in many.notes)

    @cached_property
    def _heights(self) -> dict[str, float]:
        """Fields that scale the height of the whole path, with their values."""
        scenario = self.scenario
        plain = scenario.rolling == "point" and factor_function(scenario.contact, scenario.vehicle) is None
        if len(scenario.irregularities) != 1 or not plain:
            return {}
        (item,) = scenario.irregularities
        paths = (f"irregularity.0.{name}" for name, kind in item.similarity().items() if kind == "lift")
        return {path: value for path in paths if (value := float(Fields(scenario)(path)))}

    def _rescaled(self, changed: dict[str, FloatArray]) -> SectionCells:
        """Return cells that differ in their speed and in the height of their path only: three of their numbers."""
        count = max((len(values) for values in changed.values()), default=1)
        ratio = np.ones(count)
        held, numbers = self._one, np.repeat(self._one.cells.numbers, count, axis=0)
        for path, values in changed.items():
            if path == "speed":
                ratio = np.asarray(values, dtype=float) / self.scenario.speed
            else:
                numbers[:, contract.LIFT] *= np.asarray(values, dtype=float) / self._heights[path]
        numbers[:, contract.PACE] *= ratio
        numbers[:, contract.END] /= ratio
        cells, same = held.cells, np.zeros(count, dtype=np.int64)
        cells = Cells(cells.pieces, cells.first[same], cells.many[same], numbers)
        units = held.units if count == 1 else Units(**{name: values[same] for name, values in vars(held.units).items()})
        return SectionCells(cells, units, held.period / ratio)

    def table(self) -> tuple[PathTable, list[Note]]:
        """Return the path of the wheel's centre from the section on, and notes on it."""
        if self._table is None:
            self._table = periodic_table(self.scenario, METHODS[self.method])
        return self._table

    def public(self) -> Scenario:
        """Return the scenario in which the section is at x = 0; what cannot be moved stays where it is."""
        place, moved = section_place(self.given), []
        for item, course in zip(self.given.irregularities, courses_of(self.given), strict=True):
            moves = isfinite(course.repeats_from)
            moved.append(item.moved(-place - _behind(self.given, course.period or 0.0)) if moves else item)
        return self.given.model_copy(update={"irregularity": tuple(moved)})

    def _tabled(self, scenario: Scenario, _: float, method: Method) -> tuple[PathTable, list[Note]]:
        return self.table() if scenario is self.scenario else periodic_table(scenario, method)

    def _lengths(self, changed: dict[str, FloatArray], count: int) -> FloatArray:
        """Return the period of each cell's irregularities, m."""
        shaping = [path for path in changed if path.startswith("irregularity.") or path == "vehicle.radius"]
        if not shaping:
            return np.full(count, self.length)
        variants, owner = Fields(self.scenario, changed).variants(shaping)
        return np.array([period_of(self.scenario.replaced(variant)) for variant in variants])[owner]


def moving_fields(scenario: Scenario) -> list[str]:
    """Return the paths of the fields that only move the irregularity along the rail; of several none does."""
    if len(scenario.irregularities) != 1:
        return []
    fields = scenario.irregularities[0].similarity()
    return [f"irregularity.0.{name}" for name, kind in fields.items() if kind == "offset"]
