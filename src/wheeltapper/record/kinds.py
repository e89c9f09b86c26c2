"""What a record must know of the march behind it, as data: `wheel`, `wagon` and `on_rails` each state it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.outcome import Outcome
from wheeltapper.march.common import program as contract
from wheeltapper.march.general import layout
from wheeltapper.march.wagon import assembly
from wheeltapper.record import balanced
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.elements import suspension

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
    layout.CHATTERS: Outcome.CHATTERING,
    layout.UNSOLVED: Outcome.UNSOLVED,
}
"""Outcome of each status of a march."""


def _no_stops(lowered: Any, march: Any) -> tuple[FloatArray, NDArray[np.int64]]:
    return contract.NO_STOPS, np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Kind:
    """What a record must know of the march behind it; functions take the lowered scenario and the march that it made.

    Attributes
    ----------
    lower
        From a scenario and a method to the program with its units; a record that cannot fit in memory is refused.
    chunk, row_bytes
        Steps that the march makes before it tells of its progress, and from a scenario to the memory that each takes.
    missing_part
        The missing share of the exchanged energy.
    contacts
        The contacts of a lowered scenario.
    sample
        All variables at rising times (s), in SI units; those of the wheels have the dimension `contact` last.
    integrate
        Impulse of each contact in each step, (steps, contacts), N s, and what returns the balance of energy.
    stops
        The table of the stops that dampers' ends meet (`common.program`), in the march's unit of time, and
        the wheelset of each, from zero.
    element_events
        The events of what is not linear in the suspensions.
    seat_events
        Events at seats of the track: time in s, kind, seat, position in m, rate in m/s; None where there are none.
    balance_is_dear
        Whether the balance takes longer than the march, so that only who asks for it waits for it.
    """

    lower: Callable[[Scenario, str], Any]
    chunk: int
    row_bytes: Callable[[Scenario], float]
    missing_part: Callable[[Scenario, Any, Any], float]
    contacts: Callable[[Scenario, Any], Contacts]
    sample: Callable[[Scenario, Any, Any, FloatArray], Variables]
    integrate: Callable[[Scenario, Any, Any], tuple[FloatArray, Callable[[], xr.Dataset]]]
    stops: Callable[[Any, Any], tuple[FloatArray, NDArray[np.int64]]] = _no_stops
    element_events: Callable[[Scenario, Any, Any], xr.Dataset] = lambda scenario, lowered, march: suspension.no_events()
    seat_events: Callable[[Scenario, Any, Any], dict[str, NDArray[Any]] | None] = lambda scenario, lowered, march: None
    balance_is_dear: bool = False
