"""A study as text: the contents of STUDY.toml, and the study that they describe."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper.ask.study import Study, study_of, value_in_si
from wheeltapper.describe.profile.named import NAMES
from wheeltapper.describe.profile.wheel_rail import WheelRail
from wheeltapper.describe.scenario import Scenario, relative_paths, toml_table
from wheeltapper.describe.table.content import digest
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.ground.memory import check_room
from wheeltapper.record.features import named

FIELDS = (
    "scenario", "over", "features", "gradient", "zipped", "samples", "sampling", "seed", "method", "chaos_limit",
    "chunk",
)  # fmt: skip
"""Names that a study's file may have at its top."""
KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "scenario": (lambda x: isinstance(x, dict) or (isinstance(x, str) and x != ""), "a file, or a scenario's table"),
    "over": (lambda x: isinstance(x, dict), "a table of fields with their values"),
    "features": (lambda x: isinstance(x, str | list | dict), "names of features, or tables with their type"),
    "chunk": (lambda x: _is_whole(x) and x >= 1, "a number of cells, at least 1"),
}
"""Fields of a study that are no options of `sweep`: a test of the value, and a description of allowed values."""
NOT_OPTIONS = (*KINDS, "contents")
"""Fields of a study that are not passed on to `sweep` as options."""
SPACING: dict[str, Callable[..., Any]] = {"linear": np.linspace, "log": np.geomspace}
"""Ways to space values between two ends, by name."""


def read_study(path: Path) -> dict[str, Any]:
    """Read a study's file; a scenario that it names is read too, relative to it."""
    data = toml_table(path, "a study")
    unknown = [name for name in data if name not in FIELDS]
    if unknown:
        raise InputError(str(path), unknown[0], f"the unknown name {unknown[0]!r}", with_suggestion(unknown[0], FIELDS))
    for name in ("scenario", "over", "features"):
        if name not in data:
            raise InputError(str(path), name, "nothing", "a value, which is required here")
    for name, (fits, allowed) in KINDS.items():
        if name in data and not fits(data[name]):
            raise InputError(str(path), name, repr(data[name]), allowed)
    scenario = scenario_in(data["scenario"], path)
    held = {"contents": found} if (found := file_digests(scenario)) else {}
    return data | {"scenario": scenario.model_dump(mode="json")} | held


def scenario_in(given: Any, path: Path) -> Scenario:
    """Return the scenario in a file of something else: its table, or the name of its own file beside this one."""
    if isinstance(given, str):
        return Scenario.from_toml(path.parent / given)
    return Scenario.of(relative_paths(given, path.parent), str(path))


def file_digests(scenario: Scenario) -> dict[str, str]:
    """Return digests of the files that a scenario names; kept results are valid only while these do not change."""
    items = [getattr(item, "of", item) for item in scenario.irregularities]
    names = [item.path for item in items if getattr(item, "path", None) is not None]
    if isinstance(scenario.profiles, WheelRail):
        given = [scenario.profiles.wheel, scenario.profiles.rail]
        names += [name for name in given if isinstance(name, str) and name not in NAMES]
    return {str(name): digest(Path(name)) for name in names}


def described_study(spec: dict[str, Any]) -> Study:
    """Return the study that a specification describes."""
    options = {name: value for name, value in spec.items() if name not in NOT_OPTIONS}
    features = spec["features"] if isinstance(spec["features"], list) else [spec["features"]]
    scenario = Scenario.of(spec["scenario"])
    over = {path: _listed_values(scenario, path, values) for path, values in flattened_tables(spec["over"]).items()}
    return study_of(scenario, over, [named(what) for what in features], **options)


def flattened_tables(table: Any, leaves: tuple[str, ...] = ("from",), prefix: str = "") -> dict[str, Any]:
    """Return nested tables as paths: vehicle.mass may be quoted or not; a table with one of `leaves` is a value."""
    out: dict[str, Any] = {}
    for name, value in table.items():
        path = f"{prefix}{name}"
        if isinstance(value, dict) and not any(leaf in value for leaf in leaves):
            out |= flattened_tables(value, leaves, f"{path}.")
        else:
            out[path] = value
    return out


def _listed_values(scenario: Scenario, path: str, values: Any) -> Any:
    """Return a list as it is, and a range {from, to, count, spacing} as its values."""
    if isinstance(values, list):
        return values
    names = {"from", "to", "count"}
    if not isinstance(values, dict) or not names <= set(values) <= names | {"spacing"}:
        raise InputError(
            "", f"over.{path}", repr(values), 'a list, or { from = a, to = b, count = n, spacing = "log" }'
        )
    first, last, count, spacing = values["from"], values["to"], values["count"], values.get("spacing", "linear")
    if not (isinstance(spacing, str) and spacing in SPACING and _is_whole(count) and count >= 1):
        raise InputError("", f"over.{path}", repr(values), 'a count of at least 1, and spacing "linear" or "log"')
    if isinstance(first, str) or isinstance(last, str):
        first, last = (value_in_si(scenario, path, end) for end in (first, last))
    if not (_is_number(first) and _is_number(last)):
        allowed = "finite numbers in SI units, or strings with a unit"
        raise InputError("", f"over.{path}", repr(values), allowed)
    if spacing == "log" and not first * last > 0:
        raise InputError("", f"over.{path}", repr(values), "ends of one sign, not zero, for spacing in logarithms")
    check_room(f"over.{path}", f"{count:.4g} values", 24.0 * count, "a smaller count")
    return SPACING[spacing](float(first), float(last), count)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
