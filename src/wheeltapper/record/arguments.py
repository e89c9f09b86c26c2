"""Arguments that are scenarios, or the paths of their files; and the method."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_path, check_choice, value_of_each
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.lower.numbers import METHODS


def as_scenario(given: Any) -> Scenario:
    """Return a scenario; for a path, the one that the TOML file describes."""
    if isinstance(given, Scenario):
        return given
    return Scenario.from_toml(as_path(given, "scenario", "a Scenario, or the path of its TOML file"))


def as_scenarios(given: Any) -> list[Scenario]:
    """Return scenarios from a list of scenarios and paths."""
    if isinstance(given, dict) or not isinstance(given, Iterable) or hasattr(given, "model_fields_set"):
        raise InputError("", "scenario", value_text(given), "a Scenario, the path of its TOML file, or several of them")
    return value_of_each(given, "scenario", as_scenario)


def check_method(method: Any) -> None:
    """Refuse a method that does not exist."""
    check_choice(method, "method", METHODS)
