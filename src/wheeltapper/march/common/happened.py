"""What happened in a march, as rows that say whether the same happened in the same order in another one."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray


def by_contact(rows: FloatArray, *columns: int) -> FloatArray:
    """Return some columns of events, those of each contact together in their order."""
    order = np.argsort(rows[:, contract.EVENT_CONTACT], kind="stable")
    return np.asarray(rows[order][:, [contract.EVENT_CONTACT, *columns]])


def without_repeats(rows: FloatArray) -> FloatArray:
    """Return rows without those that repeat the one before."""
    return np.asarray(rows[np.append(True, (rows[1:] != rows[:-1]).any(axis=1))])


def slowest(events: FloatArray) -> float:
    """Return the smallest rate of indentation at an event; infinity without any."""
    return float(np.abs(events[:, contract.EVENT_RATE]).min(initial=np.inf))
