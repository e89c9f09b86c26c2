"""What a record must know of the march behind it: `wheel` and `wagon` each say it, for all others to ask."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.ground.outcome import Outcome
from wheeltapper.march import assembly, run
from wheeltapper.march import program as contract
from wheeltapper.record import balanced
from wheeltapper.record.contacts import Contacts

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Variables = dict[str, tuple[tuple[str, ...], Any]]
"""Variables of a table by name: their dimensions and their values."""

OUTCOMES = {
    contract.DONE: Outcome.COMPLETED,
    contract.FULL: Outcome.OUT_OF_MEMORY,
    balanced.UNBALANCED: Outcome.UNBALANCED,
    contract.TOO_MANY_EVENTS: Outcome.EVENT_LIMIT,
    contract.NOT_FINITE: Outcome.NOT_FINITE,
    contract.STALLED: Outcome.STALLED,
    contract.END_OF_PATH: Outcome.END_OF_PATH,
    assembly.DERAILED: Outcome.DERAILED,
}
"""Outcome of each status of a march."""


class Kind(Protocol):
    """A module for what one march writes; `lowered` and `march` are of the kind that it makes itself."""

    BEGIN: int
    LENGTH: int
    """Columns of a row of steps: its time and its length, in the march's unit."""

    def lower(self, scenario: Scenario, method: str) -> Any:
        """Return a scenario's program with its units; refuse a scenario whose record cannot fit in memory."""

    def teller(self, scenario: Scenario, lowered: Any) -> Callable[[float], bool]:
        """Return what a march tells of its progress to."""

    def beyond(self, scenario: Scenario, lowered: Any, march: Any) -> tuple[Note, ...]:
        """Return notes on a march that left the range of the scenario's laws."""

    def missing_part(self, scenario: Scenario, lowered: Any, march: Any) -> float:
        """Return the missing share of the exchanged energy."""

    def contacts(self, scenario: Scenario, lowered: Any) -> Contacts:
        """Return the contacts of the vehicle."""

    def end(self, lowered: Any, march: Any) -> float:
        """Return the end of the computed time, s."""

    def free(self, contacts: Contacts, march: Any) -> NDArray[np.bool_]:
        """Return (steps, contacts) where there is no contact force."""

    def sample_columns(self, lowered: Any) -> int:
        """Return how many numbers a sample of the dense solution takes in memory."""

    def sample(self, scenario: Scenario, lowered: Any, march: Any, times: FloatArray) -> Variables:
        """Return all variables at rising times (s), SI units; those of the wheels have the dimension `contact` last."""

    def axes(self, lowered: Any) -> dict[str, list[str]]:
        """Return the names along the dimensions of the samples that are neither time nor contact."""

    def integrate(self, scenario: Scenario, lowered: Any, march: Any) -> tuple[FloatArray, xr.Dataset]:
        """Return the impulse of each contact in each step (steps, contacts), N s, and the balance of energy."""

    def tables(self, lowered: Any, march: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the tables and attributes of a file that contain the program and the rest of the march."""

    def read(self, scenario: Scenario, data: xr.Dataset) -> tuple[Any, Any]:
        """Return both from a file's contents; refuse what no march can have written."""


def kind_of(scenario: Scenario) -> Kind:
    """Return the module for the march that simulates a scenario."""
    if run.choose(run.SIMULATE, scenario.needs) is run.WAGON:
        from wheeltapper.record import wagon

        return wagon
    from wheeltapper.record import wheel

    return wheel
