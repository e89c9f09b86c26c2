"""A task for the general march, and what comes of it in the columns that all records share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march import program as contract
from wheeltapper.march.general.contract import Method, System
from wheeltapper.march.general.march import Found, Prepared, march, prepare
from wheeltapper.march.program import FloatArray


class Task(NamedTuple):
    """A system, how it is marched, and for how long, s."""

    system: System
    method: Method
    duration: float


SPAN_BEGIN, SPAN_LENGTH = range(2)
"""Columns of the rows of `Marched.steps`."""


class Marched(NamedTuple):
    """A march of a task.

    Attributes
    ----------
    status
        Why it ended.
    steps
        Spans between two events of any contact: time and length, s, (spans, 2).
    free
        (spans, contacts): where a contact has no force.
    events, peaks
        As in `wheeltapper.march.program`, in SI units.
    end
        Time at the end, s.
    found
        The march itself.
    """

    status: int
    steps: FloatArray
    free: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    events: FloatArray
    peaks: FloatArray
    end: float
    found: Found


def marched(task: Task, prepared: Prepared | None = None) -> Marched:
    """March a task."""
    found = march(prepared or prepare(task.system, task.method), task.duration)
    end = min(found.time, task.duration)
    contacts = len(task.system.contacts)
    times = found.events[:, contract.EVENT_TIME]
    begins = np.concatenate([[0.0], times])
    free = np.zeros((len(begins), contacts), dtype=bool)
    for contact in range(contacts):
        own = np.flatnonzero(found.events[:, contract.EVENT_CONTACT] == contact)
        losses = found.events[own, contract.EVENT_KIND] == contract.LOSS
        changes = np.zeros(len(begins), dtype=np.int64)
        changes[own + 1] = np.where(losses, 1, -1)
        starts_free = len(own) > 0 and not losses[0]
        free[:, contact] = np.cumsum(changes) + starts_free > 0
    peaks = np.zeros((len(found.peaks), contract.PEAK_COLUMNS))
    peaks[:, [contract.PEAK_TIME, contract.PEAK_FORCE, contract.PEAK_CONTACT]] = found.peaks
    steps = np.column_stack([begins, np.diff(begins, append=end)])
    return Marched(found.status, steps, free, found.events, peaks, end, found)
