"""Voids below sleepers in a record: where they close and open."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.march.common import program as contract
from wheeltapper.record.labels import VOID_OPENS


def events_of_voids(
    scenario: Scenario, rows: NDArray[np.float64], seat: NDArray[np.int64]
) -> dict[str, NDArray[Any]]:  # fmt: skip
    """Return a march's events of voids at seats as columns of a table."""
    return {
        "time": rows[:, contract.EVENT_TIME],
        "kind": rows[:, contract.EVENT_KIND].astype(int) + VOID_OPENS,
        "seat": seat,
        "position": float(scenario.track.first_sleeper) + seat * float(scenario.track.spacing),
        "indentation_rate": rows[:, contract.EVENT_RATE],
    }
