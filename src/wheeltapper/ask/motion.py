"""The motion of a wheelset at given times only, computed quickly, for fits to recordings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.at_hand import table_at_hand
from wheeltapper.lower.build import lower
from wheeltapper.lower.numbers import METHODS
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]


class Motion(NamedTuple):
    """Results in SI units; NaN beyond the end of the march."""

    status: int
    force: FloatArray  # (times,) N
    deck_acceleration: FloatArray  # (times,) m/s^2; zero on a stiff track


def motion_at(scenario: Scenario, times: FloatArray, method: str = "default") -> Motion:
    """Return normal force and deck acceleration of a wheelset, for every contact law and damper.

    The march ends at the last of the times. The path of the wheel's centre is computed only if it differs from those of
    recent calls. This takes some milliseconds for 0.3 s. As a function of the scenario's numbers the result is as
    smooth as the motion itself, down to the rounding of the method, so that difference quotients may be taken.

    Parameters
    ----------
    scenario
        A scenario with a wheelset.
    times
        Rising times, s.
    method
        "default" or "strict".

    Raises
    ------
    InputError
        If no march of one wheelset takes the scenario.
    """
    from wheeltapper.march.wheel import dense

    run.choose(run.MOTION_AT, scenario.needs)
    path = table_at_hand(scenario, float(scenario.speed * scenario.duration), METHODS[method])
    lowered = lower(scenario, method, path)
    scaled = times / lowered.time
    lowered.program.numbers[contract.END] = min(lowered.program.numbers[contract.END], scaled.max(initial=0.0))
    march = run.march(lowered.program)
    within = scaled <= march.state[contract.TIME] * (1.0 + 1e-12)
    found = np.full((2, len(times)), np.nan)
    rows = march.at(scaled[within])
    found[0, within] = rows[:, dense.OUT_FORCE] * lowered.force
    found[1, within] = rows[:, dense.OUT_DECK_A] * (lowered.length / lowered.time**2)
    return Motion(march.status, found[0], found[1])
