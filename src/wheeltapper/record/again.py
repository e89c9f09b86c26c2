"""A loaded record's march: whether its log fits what this version makes of the scenario; else it is marched again."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.notes import Note
from wheeltapper.lower.lowered.base import LoweredScenario
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.march import March

FloatArray = NDArray[np.float64]
WITNESSES = 33
"""Times over a run at which a file keeps the contact forces."""
SAME = 1e-7
"""Largest difference of these forces, over the largest one: other processors round in other ways."""


def witness(lowered: LoweredScenario, march: March) -> FloatArray:
    """Return contact forces over the run, (times, wheels), N: what a log fits to shows the same again."""
    shares = (np.arange(WITNESSES) + 0.381966) / WITNESSES  # where nothing round happens
    with np.errstate(over="ignore", invalid="ignore"):  # of a motion that left the range of numbers
        found = lowered.variables(march, shares * march.end * lowered.time)
    return np.asarray(found["normal_force"][1], dtype=float)


def fits(kept: FloatArray, found: FloatArray) -> bool:
    """Return whether two witnesses show the same."""
    scale = max(float(np.nanmax(np.abs(kept), initial=0.0)), 1e-300)
    return kept.shape == found.shape and bool(np.allclose(found, kept, rtol=0.0, atol=SAME * scale, equal_nan=True))


def marched_again(lowered: LoweredScenario, events: FloatArray, made_by: str) -> tuple[Any, Note]:
    """March a program again whose kept march does not fit it; say how far its events are from those of the file."""
    again = run.march(lowered.program)
    before, after = (rows[:, [contract.EVENT_TIME, contract.EVENT_KIND]] for rows in (events, again.events))
    if len(before) != len(after) or (before[:, 1] != after[:, 1]).any():
        difference = f"it has {len(after)} events where the file has {len(before)}"
    else:
        most = float(np.abs(after[:, 0] - before[:, 0]).max(initial=0.0)) * lowered.time
        difference = f"the largest difference to the stored events is {most:.2g} s"
    text = (
        f"the motion in the file ({made_by}) is not what this version computes, so that the run was computed again: "
        f"{difference}"
    )
    return again, Note(text, "marched again", doubtful=True)
