"""The motion of a wheelset at given times and nothing else, quickly: what a fit of recordings asks for."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from functools import lru_cache
from math import ceil
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.build import lower, table_of
from wheeltapper.lower.numbers import METHODS, Method
from wheeltapper.lower.table import Table
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program
from wheeltapper.record.damper import sampled

if TYPE_CHECKING:
    from wheeltapper.march.single import March

FloatArray = NDArray[np.float64]
REACH = 0.25
"""The path of the wheel's centre is computed up to a multiple of this, m. Passages at other speeds, which end a little
earlier or later, then use the same path."""


class Motion(NamedTuple):
    """What was computed, in SI units: NaN beyond the end of the march."""

    status: int
    force: FloatArray  # (times,) N
    deck_acceleration: FloatArray  # (times,) m/s^2; zero on a stiff track


class _Same:
    """A thing that equals only itself: a file that it names may have changed under an equal one."""

    def __init__(self, of: object) -> None:
        self.of = of

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.of is other.of

    def __hash__(self) -> int:
        return id(self.of)


class _Path:
    """A scenario, equal to others whose wheel's centre goes the same way."""

    def __init__(self, scenario: Scenario, end: float, method: Method) -> None:
        self.scenario, self.end, self.method = scenario, REACH * ceil(end / REACH), method
        contact = scenario.contact if getattr(scenario.contact, "follows_curvature", False) else None
        items = tuple(_Same(item) for item in scenario.irregularities)
        self._key: Hashable = (items, scenario.rolling, scenario.vehicle.radius, contact, self.end, method)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Path) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=8)
def _table(path: _Path) -> tuple[Table, list[str]]:
    return table_of(path.scenario, path.end, path.method)


def table_at_hand(scenario: Scenario, end: float, method: Method) -> tuple[Table, list[str]]:
    """Return the path of the wheel's centre to x = end (m) or farther, as lately where the wheel goes the same way."""
    return _table(_Path(scenario, end, method))


def motion_at(scenario: Scenario, times: FloatArray, method: str = "default") -> Motion:
    """Return normal force and deck acceleration of a wheelset, on whatever contact and with whatever damper it has.

    Nothing but the numbers is computed, no farther than to the last of the times, and the path of the wheel's centre
    only where it is another one than lately: some milliseconds for 0.3 s. The result is as smooth in the scenario's
    numbers as the motion itself, down to the method's rounding, so that it may be differenced.

    Parameters
    ----------
    scenario
        With a wheelset.
    times
        Rising times, s.
    method
        "default" or "strict".

    Raises
    ------
    InputError
        If the vehicle is a wagon, or the contact does not go with a damper that has an end of its own.
    """
    from wheeltapper.march import dense

    check_wheelset(scenario)
    path = table_at_hand(scenario, float(scenario.speed * scenario.duration), METHODS[method])
    lowered = lower(scenario, method, path)
    scaled = times / lowered.time
    lowered.program.numbers[contract.END] = min(lowered.program.numbers[contract.END], scaled.max(initial=0.0))
    march, program = _marched(lowered.program)
    within = scaled <= march.state[contract.TIME] * (1.0 + 1e-12)
    found = np.full((2, len(times)), np.nan)
    rows = sampled(replace(lowered, program=program), march, scaled[within])
    found[0, within] = rows[:, dense.FORCE] * lowered.force
    found[1, within] = rows[:, dense.OUT_DECK_A] * (lowered.length / lowered.time**2)
    return Motion(march.status, found[0], found[1])


def check_wheelset(scenario: Scenario) -> None:
    """Refuse a wagon, whose motion is computed by `simulate` only."""
    if not isinstance(scenario.vehicle, Wheelset):
        raise InputError("", "vehicle", "a Wagon", "a Wheelset; a Wagon's motion is computed by `simulate`")


def _marched(program: Program) -> tuple[March, Program]:
    """March a program by the marcher of its contact and damper; return also the pieces that a yielding spot adds."""
    from wheeltapper.march import damper_end, single, yielding

    if len(program.law):
        march, pieces = yielding.march(program)
        return march, program._replace(pieces=pieces)
    if len(program.damper):
        return damper_end.march(program)[0], program
    return single.march(program), program
