"""How a run changes along fields of its scenario: records that tell derivatives at fixed times in place of values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import has_no_tangents
from wheeltapper.ask.trajectory import Trajectory, is_derivable, trajectory
from wheeltapper.lower.lowered.base import LoweredScenario, Variables
from wheeltapper.lower.plane_turns import turn_along
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    from wheeltapper.lower.contacts import Contacts

FloatArray = NDArray[np.float64]


def changes_of(record: Record, paths: list[str]) -> dict[str, Record]:
    """Return how a run changes along those of some fields by which its march has tangents.

    Of such a record `at` tells derivatives of forces and accelerations, `track` and `recordings` those of all that they
    tell, where the march knows them; elsewhere they are NaN.
    """
    scenario, lowered = record.scenario, record._lowered
    plane: Any = lowered  # no others than wheels alone and vehicles in a plane have tangents
    known = [path for path in paths if not has_no_tangents(scenario, [path], [], ())]
    if is_derivable(scenario):
        return {path: Record(_OfWheel(lowered, path, record.method), record.method, record._march) for path in known}
    if not known:
        return {}
    marches = record._march.changed([turn_along(scenario, path, plane) for path in known])
    return {path: Record(lowered, record.method, march) for path, march in zip(known, marches, strict=True)}


class _OfWheel(LoweredScenario):
    """A lowered wheel that tells derivatives by a field."""

    def __init__(self, lowered: LoweredScenario, path: str, method: str) -> None:
        self.scenario, self.time, self.notes = lowered.scenario, lowered.time, ()
        self._lowered, self._path, self._method = lowered, path, method

    @property
    def contacts(self) -> Contacts:
        """The contacts of the vehicle."""
        return self._lowered.contacts

    def variables(self, march: Any, times: FloatArray) -> Variables:
        """Return derivatives at rising times, s."""
        last = np.nextafter(march.end * self.time, 0.0)
        found: Trajectory = trajectory(self.scenario, (self._path,), np.minimum(times, last), self._method)
        return {
            "normal_force": (("time", "contact"), found.of_force.T),
            "deck_acceleration": (("time",), found.of_deck_acceleration[0]),
            "wheel_acceleration": (("time",), found.of_wheel_acceleration[0]),
        }
