"""The motion of a wheelset at given times only, computed quickly, for fits to recordings."""

from __future__ import annotations

from collections.abc import Hashable
from functools import lru_cache
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import lower, table_of
from wheeltapper.lower.numbers import METHODS, Method
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]
REACH = 0.25
"""The path of the wheel's centre is computed up to a multiple of this, m. Passages at other speeds, which end a little
earlier or later, then use the same path."""


class Motion(NamedTuple):
    """Results in SI units; NaN beyond the end of the march."""

    status: int
    force: FloatArray  # (times,) N
    deck_acceleration: FloatArray  # (times,) m/s^2; zero on a stiff track


class _IdentityKey:
    """An object that equals only itself: the file that it names may have changed since an equal object was used."""

    def __init__(self, of: object) -> None:
        self.of = of

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _IdentityKey) and self.of is other.of

    def __hash__(self) -> int:
        return id(self.of)


class _PathKey:
    """A scenario as a key; two of them are equal if the path of the wheel's centre is the same."""

    def __init__(self, scenario: Scenario, end: float, method: Method) -> None:
        self.scenario, self.end, self.method = scenario, REACH * ceil(end / REACH), method
        contact = scenario.contact if getattr(scenario.contact, "follows_curvature", False) else None
        items = tuple(_IdentityKey(item) for item in scenario.irregularities)
        self._key: Hashable = (items, scenario.rolling, scenario.vehicle.radius, contact, self.end, method)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _PathKey) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=8)
def _table(path: _PathKey) -> tuple[PathTable, list[Note]]:
    return table_of(path.scenario, path.end, path.method)


def table_at_hand(scenario: Scenario, end: float, method: Method) -> tuple[PathTable, list[Note]]:
    """Return the path of the wheel's centre to x = end (m) or farther, from the cache if it is the same."""
    return _table(_PathKey(scenario, end, method))


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
