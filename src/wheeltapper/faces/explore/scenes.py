"""Scenes as they are kept, copied and brought back: as tables, as TOML, as Python."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from wheeltapper.describe.noun import Noun
from wheeltapper.describe.placement import Placement
from wheeltapper.describe.scenario import Scenario, toml_text
from wheeltapper.ground.errors import InputError

ROOMS = ("vehicles", "tracks", "contact", "creep", "profiles", "irregularities")
"""Rooms in which a noun is looked for that is not at the front door."""
STEP = "    "


@cache
def start_scene() -> Scenario:
    """Return the scene that a page begins with when nothing else is given: a wheelset over a bump of 0.2 mm."""
    return Scenario.of(
        {
            "vehicle": {
                "type": "Wheelset", "mass": 1500.0, "load": 91307.0, "stiffness": 2.44e6, "damping": 5e4,
                "radius": 0.46,
            },
            "track": {"type": "StiffTrack"},
            "contact": {"type": "Hertz", "constant": 1.405e11},
            "irregularity": [{"type": "CosineBump", "height": 2e-4, "length": 0.05, "start": 0.009}],
            "rolling": "point", "speed": 9.0, "duration": 0.12,
        }
    )  # fmt: skip


def table_of(scenario: Scenario) -> dict[str, Any] | None:
    """Return a scene as a table of plain values, or None if it holds a Python function, which no table can."""
    try:
        return scenario.model_dump(mode="json")
    except ValueError:
        return None


def toml_of(scenario: Scenario) -> str:
    """Return the scene as TOML; one with a Python function as a remark that says so."""
    try:
        return toml_text(scenario)
    except InputError as error:
        return f"# {error}\n"


def python_of(scenario: Scenario) -> str:
    """Return a program that makes the scene and simulates it."""
    try:
        made = _written(scenario, "")
    except InputError as error:
        return f"# {error}\n"
    return f"import wheeltapper as wt\n\nscenario = {made}\nrecord = wt.simulate(scenario)\nprint(record)\n"


def _written(value: Any, indent: str) -> str:
    """Return Python text that makes a value."""
    inner = indent + STEP
    if isinstance(value, Noun):
        name = _public_name(type(value))
        given = {held: getattr(value, held) for held in type(value).model_fields if _is_told(value, held)}
        if name is None:
            parts = [f'"type": "{type(value).__name__}"', *(f'"{k}": {_written(v, inner)}' for k, v in given.items())]
            return _joined("{", parts, "}", indent)
        return _joined(f"{name}(", [f"{held}={_written(one, inner)}" for held, one in given.items()], ")", indent)
    if isinstance(value, Placement | dict):
        return _joined("{", [f"{where!r}: {_written(one, inner)}" for where, one in value.items()], "}", indent)
    if isinstance(value, tuple | list):
        return _joined("[", [_written(one, inner) for one in value], "]", indent)
    if isinstance(value, Path):
        return repr(str(value))
    if value is None or isinstance(value, str | bool | int | float):
        return repr(value)
    raise InputError("", "", f"a {type(value).__name__}, which holds a Python function", "a scene without functions")


def _is_told(noun: Noun, name: str) -> bool:
    field = type(noun).model_fields[name]
    return name in noun.model_fields_set and (field.is_required() or getattr(noun, name) != field.default)


def _joined(begin: str, parts: list[str], end: str, indent: str) -> str:
    flat = f"{begin}{', '.join(parts)}{end}"
    if len(flat) + len(indent) <= 100 and "\n" not in flat:
        return flat
    inner = f",\n{indent}{STEP}".join(parts)
    return f"{begin}\n{indent}{STEP}{inner},\n{indent}{end}"


@cache
def _public_name(kind: type[Noun]) -> str | None:
    """Return how a noun's class is called after `import wheeltapper as wt`."""
    import wheeltapper as wt

    name = kind.__name__
    if name in wt.__all__ and getattr(wt, name) is kind:
        return f"wt.{name}"
    for room in ROOMS:
        if getattr(getattr(wt, room), name, None) is kind:
            return f"wt.{room}.{name}"
    return None
