"""Time zero: when the wheel is at x = 0, as the clock of a recording counts.

A trigger starts the clock. It errs, and then x = V·(t - t0) in the time t of the recording: everything that the wheel
meets, entry and exit of the deck too, is t0 later than the trigger says.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.registry import unregister
from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]

TIME_ZERO = "time_zero"
"""Path of the time zero of a passage."""


class TimedPassage(Scenario):
    """A passage with its time zero; all that is made from it has the same one.

    Parameters
    ----------
    time_zero
        When the wheel is at x = 0, s after the trigger.
    """

    time_zero: float = 0.0

    def replaced(self, changes: dict[str, Any]) -> Scenario:
        """Return a changed copy, as of a scenario; the path `TIME_ZERO` is one more."""
        fields = {path: value for path, value in changes.items() if path != TIME_ZERO}
        return timed(untimed(self).replaced(fields), changes.get(TIME_ZERO, self.time_zero))


unregister(TimedPassage)  # no file may name it


def timed(passage: Scenario, zero: float) -> Scenario:
    """Return a passage whose time zero is `zero`, s after the trigger."""
    return TimedPassage.model_construct(**_own_fields(passage), time_zero=float(zero))


def untimed(passage: Scenario) -> Scenario:
    """Return the scenario alone, whose own clock is at zero when the wheel is at x = 0."""
    return Scenario.model_construct(**_own_fields(passage)) if isinstance(passage, TimedPassage) else passage


def zero_of(passage: Scenario) -> float:
    """Return the time zero of a passage, s after the trigger."""
    return float(getattr(passage, TIME_ZERO, 0.0))


def _own_fields(passage: Scenario) -> dict[str, Any]:
    return {name: getattr(passage, name) for name in Scenario.model_fields}
