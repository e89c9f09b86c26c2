"""What is asked about orbits: scenarios, parameters and their ranges, starts; wrong ones are refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import Axis, study_axis
from wheeltapper.describe.scenario import Scenario, Start
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.section import Section, moving_fields
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.record.arguments import as_scenario, check_method

FloatArray = NDArray[np.float64]
START = {"displacement": "m", "velocity": "m/s", "deck_displacement": "m", "deck_velocity": "m/s"}
"""Entries of a state at a section, with their units; the last two only where there is a deck."""


def section_of(scenario: Scenario | str | Path, method: str = "default") -> Section:
    """Return a scenario, lowered from section to section.

    Raises
    ------
    InputError
        If it has no orbits: its irregularity does not repeat, its deck ends, or no march takes it.
    """
    scenario = as_scenario(scenario)
    check_method(method)
    run.choose(run.ORBITS, scenario.needs)
    section = Section(scenario, method)
    warn_of(section.notes)
    return section


def has_deck(section: Section) -> bool:
    """Return True where a state contains the deck's motion."""
    return bool(section.cells({}).cells.numbers[0, contract.DECK_MASS] > 0.0)


def is_undamped(section: Section) -> bool:
    """Return True where nothing takes energy away, so that no orbit attracts."""
    damping = (contract.DAMPING, contract.HYSTERESIS, contract.DECK_DAMPING)
    return not np.any(section.cells({}).cells.numbers[0, damping])


def check_parameter(scenario: Scenario, path: str) -> None:
    """Refuse a field that does not change the orbits, or whose value follows from others."""
    if path in moving_fields(scenario):
        raise InputError("", path, "a field that moves the irregularity only", "a field that changes the orbits")
    if path == "duration":
        raise InputError("", path, "the duration, which orbits do not have", "a field that changes the orbits")


def axes_of(scenario: Scenario, over: Any) -> tuple[Scenario, list[Axis]]:
    """Return the varied fields with their values; where the start varies, what of it does not is that of rest."""
    run.choose(run.ORBITS, scenario.needs)
    if not isinstance(over, Mapping) or not over:
        found = "nothing" if isinstance(over, Mapping) else value_text(over)
        raise InputError("", "over", found, 'at least one field with its values, as {"speed": [5, 6]}')
    if scenario.start == "equilibrium" and any(str(path).startswith("start.") for path in over):
        scenario = scenario.model_copy(update={"start": Start(displacement=_equilibrium(scenario))})
    axes = []
    for path, values in over.items():
        axes.append(study_axis(run.ORBITS, scenario, path, values))
        check_parameter(scenario, path)
        if path == "speed" and np.any(axes[-1].values <= 0.0):
            raise InputError("", path, f"{axes[-1].values.min():g} m/s", "more than 0 m/s")
    return scenario, axes


def _equilibrium(scenario: Scenario) -> float:
    """Return the displacement at rest at the section, m."""
    found = Section(scenario).cells({})
    return float(found.cells.numbers[0, contract.START_HEIGHT] * found.units.length[0])


def range_of(scenario: Scenario, over: Any) -> tuple[str, float, float]:
    """Return the one varied field, and its lowest and highest value; the scenario's own one lies between them."""
    if not isinstance(over, Mapping) or len(over) != 1:
        raise InputError("", "over", value_text(over), 'one field with its range, as {"speed": (1, 60)}')
    (path,) = over
    if str(path).startswith("start."):
        raise InputError("", str(path), "a start, which no orbit depends on", "a field that changes the orbits")
    _, (axis,) = axes_of(scenario, over)
    if len(axis.values) != 2 or not axis.values[0] < axis.values[1]:
        found = value_text(over[path])
        raise InputError("", path, found, "lowest and highest value, two different ones in order")
    low, high = axis.values.tolist()
    held = float(Fields(scenario)(path))
    if not low <= held <= high:
        raise InputError("", path, f"a range without {held:g}, where the orbit is", "a range around it")
    return path, low, high


def given_start(start: Any, deck: bool) -> FloatArray:
    """Return a start at a section in SI units, (STATE_SIZE,)."""
    names = [*START][: 4 if deck else 2]
    allowed = f'None, or a table of {" and ".join(names)}, as {{"displacement": 1e-4, "velocity": 0.1}}'
    if not isinstance(start, Mapping) or not set(start) <= set(names):
        raise InputError("", "start", value_text(start), allowed)
    out = np.zeros(len(START))
    checked = Start.model_validate({name: start[name] for name in names[:2] if name in start})
    out[:2] = checked.displacement, checked.velocity
    for i, name in enumerate(names[2:], 2):
        kind = Start.model_validate({names[i - 2]: start.get(name, 0.0)})
        out[i] = getattr(kind, names[i - 2])
    return out
