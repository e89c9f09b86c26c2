"""The general march of a task, and what comes of it in the columns that all records share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.common.telling import Tell, report_nothing
from wheeltapper.march.general import march as general
from wheeltapper.march.general.contract import Task
from wheeltapper.march.general.integrals import impulses
from wheeltapper.march.general.march import Found

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
        Of the wheels, as in `wheeltapper.march.common.program`, in SI units.
    end
        Time at the end, s.
    found
        The march itself.
    seat_events
        Of the contacts that stay where they are, as `events`; the last column is the number of the contact among these.
    """

    status: int
    steps: FloatArray
    free: NDArray[np.bool_]
    events: FloatArray
    peaks: FloatArray
    end: float
    found: Found
    seat_events: FloatArray

    @property
    def state(self) -> FloatArray:
        """The bodies' state at the start of the last macro step."""
        return self.found.logs.bodies[-1]


def march(task: Task, tell: Tell = report_nothing) -> Marched:
    """March a task."""
    return marched_of(task, general.march_task(task, tell))


def marched_of(task: Task, found: Found) -> Marched:
    """Return a march in the columns of records."""
    end, wheels = min(found.time, task.duration), len(task.system.wheels)
    moves = found.events[:, contract.EVENT_CONTACT] < wheels
    events, seated = found.events[moves], found.events[~moves]
    seated[:, contract.EVENT_CONTACT] -= wheels
    begins = np.concatenate([[0.0], events[:, contract.EVENT_TIME]])
    free = np.stack([_free(events, contact) for contact in range(wheels)], axis=1)
    tops = found.peaks[found.peaks[:, 2] < wheels]
    peaks = np.zeros((len(tops), contract.PEAK_COLUMNS))
    peaks[:, [contract.PEAK_TIME, contract.PEAK_FORCE, contract.PEAK_CONTACT, contract.PEAK_CORNER]] = tops
    steps = np.column_stack([begins, np.diff(begins, append=end)])
    return Marched(found.status, steps, free, events, peaks, end, found, seated)


def _free(events: FloatArray, contact: int) -> NDArray[np.bool_]:
    """Return for the spans between all events where a contact has no force."""
    changing = events[:, contract.EVENT_KIND] != contract.YIELD
    own = np.flatnonzero((events[:, contract.EVENT_CONTACT] == contact) & changing)
    losses = events[own, contract.EVENT_KIND] == contract.LOSS
    changes = np.zeros(len(events) + 1, dtype=np.int64)
    changes[own + 1] = np.where(losses, 1, -1)
    changes[0] = len(own) > 0 and not losses[0]
    return np.cumsum(changes) > 0


def impulses_of(found: Marched) -> FloatArray:
    """Return the impulse of each contact in each span, (spans, contacts), N s."""
    contacts = range(found.free.shape[1])
    begins = found.steps[:, SPAN_BEGIN]
    return np.stack([impulses(found.found, contact, begins, found.end) for contact in contacts], axis=1)
