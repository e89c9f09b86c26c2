"""Arguments that are scenarios or recordings, or the paths of their files; and the method."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_list, as_path, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.lower.numbers import METHODS
from wheeltapper.record.recording import Recording

T = TypeVar("T")


def as_scenario(given: Any) -> Scenario:
    """Return a scenario; for a path, the one that the TOML file describes."""
    if isinstance(given, Scenario):
        return given
    return Scenario.from_toml(as_path(given, "scenario", "a Scenario, or the path of its TOML file"))


def as_scenarios(given: Any) -> list[Scenario]:
    """Return scenarios from a list of scenarios and paths."""
    if isinstance(given, dict) or not isinstance(given, Iterable) or hasattr(given, "model_fields_set"):
        raise InputError("", "scenario", value_text(given), "a Scenario, the path of its TOML file, or several of them")
    return _value_of_each(given, "scenario", as_scenario)


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
    return _value_of_each(several, "recordings", as_recording)


def _value_of_each(several: Iterable[Any], field: str, as_one: Callable[[Any], T]) -> list[T]:
    """Return what each of several stands for; of what is none of a kind, the message names the place."""
    out = []
    for i, one in enumerate(several):
        try:
            out.append(as_one(one))
        except InputError as error:
            raise error if error.source else InputError("", f"{field}.{i}", error.found, error.allowed) from None
    return out


def check_method(method: Any) -> None:
    """Refuse a method that does not exist."""
    check_choice(method, "method", METHODS)
