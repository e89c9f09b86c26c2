"""States of the motion at phase zero, wave after wave: diagrams of bifurcations, hysteresis, and ramps of a field."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import Axis
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.progress import Progress, progress_counter, progress_shown
from wheeltapper.lower.section import Section, SectionCells
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import core_count
from wheeltapper.march.wheel.ensemble import Cells
from wheeltapper.march.wheel.orbits import LARGEST_FORCE, LOSSES, STATE_SIZE, Returned, sections
from wheeltapper.orbits.asked import START, axes_of, given_start, has_deck, section_of
from wheeltapper.orbits.orbit import find
from wheeltapper.record.arguments import as_scenario

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Carry = Literal["up", "down"]


def all_cells(axes: list[Axis]) -> tuple[tuple[int, ...], dict[str, FloatArray]]:
    """Return the shape of a grid, and the value of each varied field in all its cells."""
    shape = tuple(len(axis.values) for axis in axes)
    places = np.unravel_index(np.arange(int(np.prod(shape))), shape)
    return shape, {axis.path: axis.values[place] for axis, place in zip(axes, places, strict=True)}


def start_states(found: SectionCells) -> FloatArray:
    """Return the states at which cells start by themselves, (cells, STATE_SIZE)."""
    states = np.zeros((len(found.period), STATE_SIZE))
    states[:, :2] = found.cells.numbers[:, [contract.START_HEIGHT, contract.START_VELOCITY]]
    return states


def returns(
    scenario: Scenario | str | Path, over: Mapping[str, Any], skip: int = 300, keep: int = 200,
    carry: Carry | None = None, *, method: str = "default", threads: int | None = None, progress: Progress = True,
) -> xr.Dataset:  # fmt: skip
    """Return the states at phase zero of each wave: a diagram of bifurcations.

    Parameters
    ----------
    scenario
        As for `find`; each motion begins at its start, at phase zero of the irregularity.
    over
        By path, the values of fields that vary; "start.displacement" and "start.velocity" too. The cells are all
        combinations.
    skip
        Number of waves before the first state that is kept.
    keep
        Number of states that are kept.
    carry
        "up": along the first field, in order of its values, each motion begins where the one before has ended; "down":
        in the opposite order. The difference is hysteresis.
    method
        "default" or "strict".
    threads
        Number of threads; by default one per core. The result does not depend on it.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        Over the fields and `return`: `displacement` and `velocity` at the end of each kept wave, and the `losses` of
        contact and the `largest_force` in it. NaN where a motion could not be computed to its end. `carry` is kept as
        an attribute.

    Raises
    ------
    InputError
        If the scenario has no orbits, or a path names no continuous field.
    """
    skip, keep = as_count(skip, "skip", 0), as_count(keep, "keep")
    if carry is not None:
        check_choice(carry, "carry", ("up", "down"))
    scenario, axes = axes_of(as_scenario(scenario), over)
    section = section_of(scenario, method)
    shape, changed = all_cells(axes)
    total = int(np.prod(shape))
    check_room("over", f"{total:.4g} cells with {keep} states", 96.0 * total * keep, "fewer cells or states")
    held = core_count() if threads is None else as_count(threads, "threads")
    with progress_shown(progress, "cells"):
        count = progress_counter("cells", total)
        found = section.cells(changed)
        states = start_states(found)
        if carry is None:
            kept = sections(found.cells, states, skip, keep, held, count=count)
        else:
            kept = _carried(found.cells, states, axes[0], shape, skip, keep, carry)
            count(total)
    diagram = _diagram(section, axes, shape, found, kept)
    return diagram if carry is None else diagram.assign_attrs(carry=carry)


def _carried(
    cells: Cells, states: FloatArray, axis: Axis, shape: tuple[int, ...], skip: int, keep: int, carry: Carry
) -> Returned:
    """March cells one after the other along the first axis, each from where the one before has ended."""
    order = np.argsort(axis.values, kind="stable")
    numbers = np.arange(len(states)).reshape(shape[0], -1)[order if carry == "up" else order[::-1]]
    kept = np.empty((len(states), keep, STATE_SIZE))
    out = Returned(kept, np.empty((len(states), keep, 2)), np.zeros(len(states), dtype=np.int64))
    for column in numbers.T:
        own = Cells(cells.pieces, cells.first[column], cells.many[column], cells.numbers[column])
        for part, of in zip(out, sections(own, states[column], skip, keep, chained=True), strict=True):
            part[column] = of
    return out


def _in_si(found: SectionCells, kept: FloatArray) -> FloatArray:
    """Return states (cells, waves, STATE_SIZE) in SI units."""
    length, time = found.units.length, found.units.time
    return np.asarray(kept * np.column_stack([length, length / time] * 2)[:, None, :])


def _diagram(
    section: Section, axes: list[Axis], shape: tuple[int, ...], found: SectionCells, kept: Returned
) -> xr.Dataset:
    import xarray as xr

    dimensions = (*(axis.path for axis in axes), "return")
    data = state_variables(section, found, kept, dimensions, (*shape, kept.kept.shape[1]))
    named = {axis.path: (axis.path, axis.values, {"units": axis.unit}) for axis in axes}
    static = float(found.units.static_force[0])
    return xr.Dataset(data, named, {"title": "wheeltapper returns", "method": section.method, "static_force": static})


def state_variables(
    section: Section, found: SectionCells, kept: Returned, dimensions: tuple[str, ...], shape: tuple[int, ...]
) -> dict[str, Any]:
    """Return states and what is told of the waves as variables."""
    states = _in_si(found, kept.kept)
    names = [*START][: 4 if has_deck(section) else 2]
    data: dict[str, Any] = {
        name: (
            dimensions, states[..., i].reshape(shape),
            {"units": START[name], "long_name": f"{name} at phase zero".replace("_", " ")},
        )
        for i, name in enumerate(names)
    }  # fmt: skip
    force = kept.told[..., LARGEST_FORCE] * found.units.force[:, None]
    data["losses"] = dimensions, kept.told[..., LOSSES].reshape(shape), {"long_name": "losses of contact in the wave"}
    data["largest_force"] = dimensions, force.reshape(shape), {"units": "N", "long_name": "largest force in the wave"}
    return data


def ramp(
    scenario: Scenario | str | Path, over: Mapping[str, Any], per_wave: float, start: Mapping[str, Any] | None = None,
    *, method: str = "default",
) -> xr.Dataset:  # fmt: skip
    """Return the motion while one field changes slowly: it is constant in each wave, and a little larger in the next.

    Parameters
    ----------
    scenario
        As for `find`.
    over
        One field with its first and last value, as {"speed": (6.5, 7.0)}; from a larger to a smaller one it falls.
    per_wave
        By how much the field changes from wave to wave, in its SI unit.
    start
        State at phase zero of the first wave, as for `find`; None: the orbit of one wave on which the motion from rest
        settles at the first value.
    method
        "default" or "strict".

    Returns
    -------
    xarray.Dataset
        Over `wave`: the field by its path, `displacement` and `velocity` at the end of the wave, and the `losses` of
        contact and the `largest_force` in it.

    Raises
    ------
    InputError
        If the scenario has no orbits, or the values are no ramp.
    """
    import xarray as xr

    scenario, axes = axes_of(as_scenario(scenario), over)
    (axis,) = axes if len(axes) == 1 else (None,)
    if axis is None or len(axis.values) != 2 or axis.values[0] == axis.values[1] or axis.path.startswith("start."):
        allowed = 'one field with its first and last value, as {"speed": (6, 7)}'
        raise InputError("", "over", value_text(dict(over)), allowed)
    if isinstance(per_wave, bool) or not isinstance(per_wave, int | float) or not 0.0 < per_wave < np.inf:
        raise InputError("", "per_wave", value_text(per_wave), "a positive change from wave to wave")
    first, last = axis.values
    many = int(np.floor(abs(last - first) / per_wave * (1.0 + 1e-12))) + 1
    check_room("per_wave", f"{many:.4g} waves", 600.0 * many, "larger changes from wave to wave")
    values = first + np.sign(last - first) * per_wave * np.arange(many)
    section = section_of(scenario, method)
    found = section.cells({axis.path: values})
    given = start if start is not None else find(scenario.replaced({axis.path: float(first)}), method=method).start
    states = np.zeros((many, STATE_SIZE))
    length, time = found.units.length[0], found.units.time[0]
    states[0] = given_start(given, has_deck(section)) / np.array([length, length / time] * 2)
    kept = sections(found.cells, states, 0, 1, chained=True)
    data = state_variables(section, found, kept, ("wave",), (many,))
    data[axis.path] = ("wave", values, {"units": axis.unit})
    named = {"wave": ("wave", np.arange(many), {"long_name": "number of the wave"})}
    static = float(found.units.static_force[0])
    title = {"title": "wheeltapper ramp", "parameter": axis.path, "per_wave": float(per_wave), "static_force": static}
    return xr.Dataset(data, named, title | {"method": method})
