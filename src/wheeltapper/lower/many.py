"""From a scenario, and fields that differ from cell to cell, to cells that share tables.

There are three kinds of fields. Some enter the numbers only, such as a mass. Some scale, stretch or move the whole
path, such as the height of a bump. Some shape the path, such as the same height under a rolling circle; only these need
a table for each of their values.

Derivatives follow the same three ways. Those of the numbers and of the placing are imaginary parts. A field that shapes
the path changes the pieces of its table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.needs import YIELDING
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.lower.build import SHARP_DIP, courses_of, curvature_range, sharp_dip, table_of
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.laws.ellipse import factor_function
from wheeltapper.lower.laws.plastic import yielding_programs
from wheeltapper.lower.numbers import METHODS, Method, Placing, Units, numbers_of
from wheeltapper.lower.paths.bends import table_tangent
from wheeltapper.lower.paths.table import PathTable, used_degree
from wheeltapper.lower.plausible import implausible_cells
from wheeltapper.lower.unmet import deck_acting, irregularities_acting, unmet_cells
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.general.at_rest import Numbers
from wheeltapper.march.wheel.ensemble import Cells

if TYPE_CHECKING:
    from wheeltapper.march.wheel.gradients import CellTangents

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Tabled = Callable[[Scenario, float, Method], tuple[PathTable, list[Note]]]
EPSILON = 1e-30
"""Imaginary step of complex-step derivatives. It is so small that its square vanishes beside any real part."""


def shapes_the_path(scenario: Scenario, path: str) -> bool:
    """Return True if a field may change the path of the wheel's centre, or the factor on the contact force along it."""
    if path.startswith("irregularity."):
        return True
    follows = factor_function(scenario.contact, scenario.vehicle) is not None
    if path == "vehicle.radius":
        borne = any(item.borne == "wheel" for item in scenario.irregularities)
        return bool(scenario.irregularity) and (scenario.rolling == "circle" or borne or follows)
    return path == "contact.rail_radius" and follows


@dataclass(frozen=True)
class _TabledScenario:
    """A table, and its scenario."""

    scenario: Scenario
    table: PathTable


@dataclass(frozen=True)
class Direction:
    """Derivatives of cells with respect to one field.

    Attributes
    ----------
    numbers
        (cells, NUMBERS) derivatives of the numbers.
    units
        Each unit plus i·EPSILON times its derivative.
    bend
        (pieces, PIECE_COLUMNS) derivatives of the pieces of all tables; None if the pieces do not change.
    """

    numbers: FloatArray
    units: Units
    bend: FloatArray | None


class LoweredCells:
    """Cells of a scenario, lowered together.

    Parameters
    ----------
    scenario
        The scenario that all cells share.
    changed
        By path, one number per cell in SI units.
    method
        "default" or "strict".
    tabled
        A function from a scenario, the end of its path (m) and the method to the table, if tables exist already.
    """

    def __init__(
        self, scenario: Scenario, changed: dict[str, FloatArray], method: str = "default", tabled: Tabled = table_of
    ) -> None:
        self.scenario, self.changed, self._tabled = scenario, changed, tabled
        self.method, self._method = method, METHODS[method]
        self._kinds, self._reference = self._similar_fields()
        self._shaping = [path for path in changed if path not in self._kinds and shapes_the_path(scenario, path)]
        self._shaped, self._owner, self._said = self._lowered_tables()
        tables = [shaped.table for shaped in self._shaped]
        placing = self._cell_placing(self._field_value)
        numbers, units = numbers_of(self._field_value, placing, self._method)
        self._first = np.cumsum([0, *(len(table.rows) for table in tables)])
        numbers[:, contract.LOOP] = np.array([table.loop for table in tables])[self._owner]
        numbers[:, contract.LOOP_JOIN] = np.array([table.loop_join for table in tables])[self._owner]
        rows = np.vstack([table.rows for table in tables])
        self.cells = Cells(rows, self._first[:-1][self._owner], np.diff(self._first)[self._owner], numbers)
        self.units = self._spread_units(units)
        self._programs = self._marched_alone(placing.height) if YIELDING in scenario.needs else ()

    def _marched_alone(self, heights: FloatArray) -> tuple[Program, ...]:
        """Return the programs of cells whose contacts yield."""
        cells = self.cells
        pieces = [cells.pieces[first : first + many] for first, many in zip(cells.first, cells.many, strict=True)]
        programs, static = yielding_programs(self._field_value, pieces, cells.numbers, self.units, heights)
        self.units = replace(self.units, static_force=static)
        return programs

    @property
    def to_march(self) -> Cells | tuple[Program, ...]:
        """The cells as their march takes them: all that share one march in lanes, or each by itself."""
        return self._programs or self.cells

    def program(self, cell: int) -> Program:
        """Return the program of one cell."""
        if self._programs:
            return self._programs[cell]
        first, many = int(self.cells.first[cell]), int(self.cells.many[cell])
        return Program(self.cells.pieces[first : first + many], self.cells.numbers[cell])

    @cached_property
    def _field_value(self) -> Fields:
        return Fields(self.scenario, self.changed)

    def _spread_units(self, units: Units) -> Units:
        return Units(**{name: np.broadcast_to(held, self._field_value.cells) for name, held in vars(units).items()})

    def _similar_fields(self) -> tuple[dict[str, str], dict[str, float]]:
        """Return the changed fields that scale, stretch or move the whole path, and their values in the table."""
        scenario, changed = self.scenario, self.changed
        fields: dict[str, str] = (
            dict(scenario.irregularities[0].similarity()) if len(scenario.irregularity) == 1 else {}
        )
        plain = scenario.rolling == "point" and factor_function(scenario.contact, scenario.vehicle) is None
        plain = plain and YIELDING not in scenario.needs  # what a surface has borne is no part of its height
        kinds = {f"irregularity.0.{name}": kind for name, kind in fields.items() if kind == "offset" or plain}
        place = next((path for path, kind in kinds.items() if kind == "offset"), None)
        reference: dict[str, float] = {}
        for path, kind in kinds.items():
            if kind == "lift" and path in changed and np.any(changed[path]):
                reference[path] = float(np.abs(changed[path]).max())
            elif kind == "rate" and path in changed and place is not None:
                reference[path] = float(changed[path][0])
        if place is not None and (place in changed or any(kinds[path] == "rate" for path in reference)):
            _, rate, _ = self._scaled_use(kinds, reference, Fields(scenario, changed))
            reference[place] = float(np.max(Fields(scenario, changed)(place) * rate))
        return {path: kinds[path] for path in reference}, reference

    @staticmethod
    def _scaled_use(
        kinds: dict[str, str], reference: dict[str, float], value: Fields
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return lift, rate and offset of each cell's use of the table: y(x) = lift·table(rate·x + offset)."""
        lift, rate, offset = np.ones(value.cells), np.ones(value.cells), np.zeros(value.cells)
        for path, held in reference.items():
            if kinds[path] == "lift":
                lift = value(path) / held
            elif kinds[path] == "rate":
                rate = held / value(path)
        for path, held in reference.items():
            if kinds[path] == "offset":
                offset = held - value(path) * rate
        return lift, rate, offset

    @cached_property
    def _run_ends(self) -> FloatArray:
        """Where each cell's run ends on its table, m."""
        value = self._field_value
        _, rate, offset = self._scaled_use(self._kinds, self._reference, value)
        return np.broadcast_to(np.asarray(value("speed") * value("duration")) * rate + offset, value.cells)

    def _lowered_tables(self) -> tuple[list[_TabledScenario], IntArray, list[list[Note]]]:
        scenario = self.scenario
        variants, owner = self._field_value.variants(self._shaping)
        made, notes = list[_TabledScenario](), list[list[Note]]()
        for index, variant in enumerate(variants):
            values, held = self._reference | variant, Fields(scenario)
            changes: dict[str, Any] = {path: value for path, value in values.items() if value != held(path)}
            shaped = scenario.replaced(changes) if changes else scenario
            end = float(self._run_ends[owner == index].max())
            shaped.check_extent(end)
            table, said = self._tabled(shaped, end, self._method)
            made.append(_TabledScenario(shaped, table))
            notes.append(said)
        return made, owner, notes

    @cached_property
    def notes(self) -> tuple[Shared, ...]:
        """What the user should know, one note for each cause."""
        counts = np.bincount(self._owner, minlength=len(self._shaped))
        notes = [Shared(note, int(cells)) for said, cells in zip(self._said, counts, strict=True) for note in said]
        told = [note for note in notes if note.note.cause != SHARP_DIP] + self._sharp_dips() + self._unmet()
        still = int((self.cells.numbers[:, contract.MEMORY] != 0.0).sum())
        if still and self.scenario.contact.warning:
            told.append(Shared(Note(self.scenario.contact.warning, doubtful=True), still))
        return shared_notes((*implausible_cells(self.scenario, self.changed, self._field_value.cells), *told))

    def _unmet(self) -> list[Shared]:
        """Return notes on what cells never meet; irregularities are where they are on the cells' tables."""
        value, cells = self._field_value, np.arange(self._field_value.cells)
        way = np.broadcast_to(value("speed") * value("duration"), value.cells)
        offset = np.broadcast_to(self._scaled_use(self._kinds, self._reference, value)[2], value.cells)
        stiffness = np.broadcast_to(value("vehicle.stiffness"), value.cells)
        tables = (
            (irregularities_acting(one.scenario.replaced({"vehicle.stiffness": float(stiffness[mine[0]])})), mine)
            for i, one in enumerate(self._shaped)
            for held in (True, False)  # without a spring no wheel feels how high it stands
            if len(mine := cells[(self._owner == i) & ((stiffness > 0.0) == held)])
        )
        on_tables = ((acting, mine, offset[mine], self._run_ends[mine]) for acting, mine in tables)
        return unmet_cells([*on_tables, (deck_acting(value), cells, 0.0, way)], self._scenario_of)

    def _scenario_of(self, cell: int) -> Scenario:
        return self.scenario.replaced({path: values[cell].item() for path, values in self.changed.items()})

    def _sharp_dips(self) -> list[Shared]:
        """Return notes on dips that no wheel can follow; cells with the same table may differ in them."""
        if self.scenario.rolling != "point":
            return []
        value = self._field_value
        lift, rate, offset = (
            np.broadcast_to(held, value.cells) for held in self._scaled_use(self._kinds, self._reference, value)
        )
        found = np.array(
            [
                curvature_range(courses_of(shaped.scenario), float(self._run_ends[self._owner == index].max()))
                for index, shaped in enumerate(self._shaped)
            ]
        )[self._owner, (lift > 0.0).astype(int)]  # a negative lift turns crests into dips
        curvature, radius = found[:, 0] * lift * rate**2, np.broadcast_to(value("vehicle.radius"), value.cells)
        worst = int(np.argmax(curvature * radius))
        place = (found[worst, 1] - offset[worst]) / rate[worst]
        met = int((curvature * radius > 1.0).sum())
        return [Shared(note, met) for note in sharp_dip(float(curvature[worst]), float(place), float(radius[worst]))]

    def _cell_placing(self, value: Fields) -> Placing:
        lift, rate, offset = self._scaled_use(self._kinds, self._reference, value)
        height, factor = np.zeros(value.cells, dtype=offset.dtype), np.ones(value.cells, dtype=offset.dtype)
        for index, shaped in enumerate(self._shaped):
            mine = np.flatnonzero(self._owner == index)
            x = offset[mine].real
            x = x[:1] if np.all(x == x[0]) else x
            height[mine], factor[mine] = shaped.table.height_at(x), shaped.table.factor_at(x)
            if np.iscomplexobj(offset):
                height[mine] += 1j * shaped.table.slope_at(x) * offset[mine].imag
        return Placing(lift, rate, offset, height, factor)

    def _bent_placing(self, placing: Placing, bends: list[FloatArray]) -> Placing:
        """Return the placing, with the effect of changed tables on height and factor at x = 0."""
        height, factor = placing.height + 0j, placing.factor + 0j
        for index, (shaped, bent) in enumerate(zip(self._shaped, bends, strict=True)):
            mine = np.flatnonzero(self._owner == index)
            x = np.real(placing.offset[mine])
            height[mine] += 1j * EPSILON * shaped.table.tangent_at(bent, x, contract.COEFFICIENT)
            factor[mine] += 1j * EPSILON * shaped.table.tangent_at(bent, x, contract.FACTOR)
        return replace(placing, height=height, factor=factor)

    def turned(self, directions: list[Direction]) -> tuple[Cells, CellTangents]:
        """Return the cells, and their derivatives along some directions."""
        from wheeltapper.march.steps.tangent_path import LANES
        from wheeltapper.march.wheel.gradients import CellTangents

        numbers = np.zeros((self._field_value.cells, contract.NUMBERS, LANES))
        table = np.full(LANES, -1, dtype=np.int64)
        bends: list[FloatArray] = []
        pieces = self.cells.pieces.copy()
        for lane, direction in enumerate(directions):
            numbers[:, :, lane] = direction.numbers
            if direction.bend is not None:
                table[lane] = len(bends)
                bends.append(direction.bend)
        for bent in bends:  # a kernel knows a piece's tangent up to the piece's own degree
            for degree, source in ((contract.DEGREE, contract.COEFFICIENT), (contract.FACTOR_DEGREE, contract.FACTOR)):
                held = bent[:, source : source + contract.TERMS]
                used = used_degree(held, 1e-15 * float(np.abs(held).max()))
                pieces[:, degree] = np.where(pieces[:, degree] < 0, -1, np.maximum(pieces[:, degree], used))
        bent_all = np.array(bends) if bends else np.zeros((1, 1, contract.PIECE_COLUMNS))
        return self.cells._replace(pieces=pieces), CellTangents(numbers, bent_all, table)

    def direction_along(self, path: str) -> Direction:
        """Return the derivatives of the cells with respect to one of the changed fields."""
        value = Fields(self.scenario, self.changed | {path: self.changed[path] + 1j * EPSILON})
        placing = self._cell_placing(value)
        bent = None
        if path in self._shaping:
            each = [table_tangent(shaped.scenario, path, shaped.table) for shaped in self._shaped]
            placing = self._bent_placing(placing, each)
            bent = np.vstack(each)
        numbers, units = numbers_of(value, placing, self._method)
        return Direction(numbers.imag / EPSILON, self._spread_units(units), bent)
