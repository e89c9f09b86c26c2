"""The verb: simulate a scenario."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from typing import Literal

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.build import lower
from wheeltapper.lower.numbers import METHODS
from wheeltapper.record.record import Record


class ModelWarning(UserWarning):
    """The scenario is valid, but its result may not mean what the user thinks."""


def say_that_it_compiles() -> None:
    """Tell the user why nothing happens for some seconds."""
    print("wheeltapper: compiling its kernels for this machine, once; this takes some seconds", file=sys.stderr)


def warn_of(notes: Iterable[str]) -> None:
    """Warn the caller's caller of those notes that put a result's meaning in doubt."""
    for note in notes:
        if "cannot follow" in note:
            warnings.warn(note, ModelWarning, stacklevel=3)


def simulate(scenario: Scenario, method: Literal["default", "strict"] = "default") -> Record:
    """Simulate a scenario: every loss of contact, every impact and every force maximum, located exactly.

    Parameters
    ----------
    scenario
        What to simulate.
    method
        "default": Taylor series of order 12; "strict": order 20 with a thousand times smaller step tolerance.

    Returns
    -------
    Record
        Also where the computation could not finish: its `outcome` says why, and what was computed is kept.

    Raises
    ------
    InputError
        If the scenario cannot be simulated.
    """
    if method not in METHODS:
        raise InputError("", "method", repr(method), " or ".join(repr(name) for name in METHODS))
    scenario.check_extent()
    if isinstance(scenario.vehicle, Wagon):
        return _simulate_wagon(scenario, method)
    lowered = lower(scenario, method)
    warn_of(lowered.notes)
    from wheeltapper.march.single import is_ready, march

    if not is_ready(lowered.program):
        say_that_it_compiles()
    return Record(scenario, method, lowered, march(lowered.program))


def _simulate_wagon(scenario: Scenario, method: str) -> Record:
    from wheeltapper.lower.wagon import lower_wagon
    from wheeltapper.march import multibody
    from wheeltapper.record.wagon_record import WagonRecord

    if not multibody.kernels_are_ready():
        say_that_it_compiles()
    lowered = lower_wagon(scenario, method)
    warn_of(lowered.notes)
    return WagonRecord(scenario, method, lowered, multibody.march(lowered.assembly))
