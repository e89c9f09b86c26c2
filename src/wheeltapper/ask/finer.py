"""Runs finer than strict ones, whose features are smooth in every field: what happens in them, and how changes grow."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.door import lowered_scenario
from wheeltapper.march import run
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]


class FinerRun(NamedTuple):
    """What is read of a run.

    Attributes
    ----------
    values
        What was asked of its record.
    happened
        The same where the same happens in the same order.
    lowered, march
        The run itself.
    """

    values: FloatArray
    happened: bytes
    lowered: Any
    march: Any


def finer_run(scenario: Scenario, read: Callable[[Record], FloatArray]) -> FinerRun:
    """Make a finer run than a strict one, and read its record."""
    lowered = lowered_scenario(scenario, "strict").finer()
    march = run.march(lowered.program)
    record = Record(lowered, "strict", march)
    happened = [np.array([march.status]), *march.happened()]
    return FinerRun(
        read(record), b"|".join(np.ascontiguousarray(part).tobytes() for part in happened), lowered, march,
    )  # fmt: skip


def gentlest_and_growth(made: FinerRun) -> tuple[float, float]:
    """Return the smallest rate of indentation at an event, scaled, and how much a small change of the start grows.

    The change is one of all wheels' heights alike, or of their velocities.
    """
    lowered, growth = made.lowered, 0.0
    for in_velocity in (False, True):
        near, size = lowered.perturbed(made.march, in_velocity)
        change = near.scaled_end(run.march(near.program)) - lowered.scaled_end(made.march)
        growth = max(growth, float(np.linalg.norm(change)) / size)
    return lowered.gentlest(made.march), growth
