"""From a scenario and fields that differ from cell to cell to cells that share tables.

A field either enters the numbers alone (a mass), or scales, stretches or moves the path as a whole (the height of a
bump), or shapes it (the same height under a rolling circle). Only the last needs a table for each of its values.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.build import table_of
from wheeltapper.lower.ellipse import factor_function
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.numbers import METHODS, Method, Placing, Units, numbers_of
from wheeltapper.lower.table import Table
from wheeltapper.march import program as contract
from wheeltapper.march.ensemble import Cells

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Many:
    """Cells to march, what turns their numbers into SI units, and what the user should know."""

    cells: Cells
    units: Units
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Similar:
    """How cells use one table: y(x) = lift·table(rate·x + offset), and the scenario that the table belongs to."""

    scenario: Scenario
    lift: FloatArray
    rate: FloatArray
    offset: FloatArray


def _shapes_the_path(scenario: Scenario, path: str) -> bool:
    """Return True where a field may change the path of the wheel's centre or the contact's factor along it."""
    if path.startswith("irregularity."):
        return True
    follows = factor_function(scenario.contact, scenario.vehicle) is not None
    if path == "vehicle.radius":
        borne = any(item.borne == "wheel" for item in scenario.irregularities)
        return bool(scenario.irregularity) and (scenario.rolling == "circle" or borne or follows)
    return path == "contact.rail_radius" and follows


def _similar(scenario: Scenario, changed: dict[str, FloatArray]) -> tuple[_Similar, set[str]]:
    """Return how far the cells' paths are scaled copies of one, and the fields that this takes care of."""
    one = len(scenario.irregularity) == 1
    fields: dict[str, str] = dict(scenario.irregularities[0].similarity()) if one else {}
    plain = scenario.rolling == "point" and factor_function(scenario.contact, scenario.vehicle) is None
    kinds = {
        f"irregularity.0.{name}": kind
        for name, kind in fields.items()
        if f"irregularity.0.{name}" in changed and (kind == "offset" or plain)
    }
    cells = max((len(values) for values in changed.values()), default=1)
    lift, rate, offset = np.ones(cells), np.ones(cells), np.zeros(cells)
    value = Fields(scenario)
    reference: dict[str, Any] = {}
    for path, kind in kinds.items():
        if kind == "lift" and np.any(changed[path]):
            reference[path] = float(np.abs(changed[path]).max())
            lift = changed[path] / reference[path]
        elif kind == "rate":
            reference[path] = float(changed[path][0])
            rate = reference[path] / changed[path]
    place = next((f"irregularity.0.{name}" for name, kind in fields.items() if kind == "offset"), None)
    if place is not None and (place in kinds or np.any(rate != 1.0)):
        start = np.broadcast_to(changed.get(place, np.asarray(value(place))), (cells,))
        reference[place] = float((start * rate).max())
        offset = reference[place] - start * rate
    elif "rate" in kinds.values():  # stretched about x = 0
        reference = {path: held for path, held in reference.items() if kinds[path] != "rate"}
        rate = np.ones(cells)
    handled = {path for path in kinds if path in reference}
    return _Similar(scenario.replaced(reference) if reference else scenario, lift, rate, offset), handled


def lower_many(scenario: Scenario, changed: dict[str, FloatArray], method: str = "default") -> Many:
    """Lower a scenario once for many cells.

    Parameters
    ----------
    scenario
        What all cells have in common.
    changed
        By path, one number per cell in SI units.
    method
        "default" or "strict".
    """
    chosen = METHODS[method]
    value = Fields(scenario, changed)
    similar, handled = _similar(scenario, changed)
    shaping = [path for path in changed if path not in handled and _shapes_the_path(scenario, path)]
    ends = np.broadcast_to(np.asarray(value("speed") * value("duration")) * similar.rate + similar.offset, value.cells)
    variants, owner = _variants(changed, shaping, value.cells)
    tables, notes = [], []
    height, factor = np.zeros(value.cells), np.ones(value.cells)
    for index, variant in enumerate(variants):
        mine = np.flatnonzero(owner == index)
        shaped = similar.scenario.replaced(dict(zip(shaping, variant.tolist(), strict=True)))
        table, said = _table(shaped, float(ends[mine].max()), chosen)
        height[mine], factor[mine] = table.height(similar.offset[mine]), table.factor(similar.offset[mine])
        tables.append(table)
        notes += said
    placing = Placing(similar.lift, similar.rate, similar.offset, height, factor)
    numbers, units = numbers_of(value, placing, chosen)
    first = np.cumsum([0, *(len(table.rows) for table in tables)])
    numbers[:, contract.LOOP] = np.array([table.loop for table in tables])[owner]
    numbers[:, contract.LOOP_JOIN] = np.array([table.loop_join for table in tables])[owner]
    many = np.diff(first)[owner]
    cells = Cells(np.vstack([table.rows for table in tables]), first[:-1][owner], many, numbers)
    whole = replace(units, **{name: np.broadcast_to(held, value.cells) for name, held in vars(units).items()})
    return Many(cells, whole, tuple(dict.fromkeys(notes)))


def _variants(changed: dict[str, FloatArray], shaping: list[str], cells: int) -> tuple[FloatArray, IntArray]:
    """Return the different values of the shaping fields, and which of them each cell has."""
    if not shaping:
        return np.zeros((1, 0)), np.zeros(cells, dtype=np.int64)
    rows, owner = np.unique(np.column_stack([changed[path] for path in shaping]), axis=0, return_inverse=True)
    return rows, owner.ravel()


def _table(scenario: Scenario, end: float, method: Method) -> tuple[Table, list[str]]:
    scenario.check_extent(end)
    return table_of(scenario, end, method)
