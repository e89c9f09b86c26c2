"""Arguments that are scenarios or recordings, or the paths of their files; and the method."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_list, as_path
from wheeltapper.ground.errors import InputError, shown, suggested
from wheeltapper.lower.numbers import METHODS
from wheeltapper.record.recording import Recording


def as_scenario(given: Any) -> Scenario:
    """Return a scenario; for a path, the one that the TOML file describes."""
    if isinstance(given, Scenario):
        return given
    return Scenario.from_toml(as_path(given, "scenario", "a Scenario, or the path of its TOML file"))


def as_scenarios(given: Any) -> list[Scenario]:
    """Return scenarios from a list of scenarios and paths."""
    if isinstance(given, dict) or not isinstance(given, Iterable) or hasattr(given, "model_fields_set"):
        raise InputError("", "scenario", shown(given), "a Scenario, the path of its TOML file, or several of them")
    out = []
    for i, one in enumerate(given):
        try:
            out.append(as_scenario(one))
        except InputError as error:
            raise error if error.source else InputError("", f"scenario.{i}", error.found, error.allowed) from None
    return out


def as_recording(given: Any) -> Recording:
    """Return a recording; for a path, the one in the file."""
    if isinstance(given, Recording):
        return given
    from wheeltapper.record.read_recording import read_recording

    return read_recording(as_path(given, "recording", "a Recording, or the path of its file"))


def as_recordings(given: Any) -> list[Recording]:
    """Return one or more recordings from a list of recordings and paths."""
    several = as_list(given, "recordings", "a list of Recordings, or of paths of their files")
    if not several:
        raise InputError("", "recordings", "none", "one for each wheelset of the train")
    out = []
    for i, one in enumerate(several):
        try:
            out.append(as_recording(one))
        except InputError as error:
            raise error if error.source else InputError("", f"recordings.{i}", error.found, error.allowed) from None
    return out


def check_method(method: Any) -> None:
    """Refuse a method that does not exist."""
    if not isinstance(method, str) or method not in METHODS:
        raise InputError("", "method", shown(method), suggested(str(method), METHODS, " or ".join(map(repr, METHODS))))
