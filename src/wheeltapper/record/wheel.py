"""What a record must know of a wheelset's march."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.build import Lowered, lower
from wheeltapper.march import program as contract
from wheeltapper.march import run, telling
from wheeltapper.record import balanced, energy, extent, wheel_store, yielded
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.kinds import Kind, Variables

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.single import March

FloatArray = NDArray[np.float64]


def _lower(scenario: Scenario, method: str) -> Lowered:
    extent.check_time(scenario)
    lowered = lower(scenario, method)
    extent.check_pieces(scenario, lowered)
    return lowered


def _teller(scenario: Scenario, lowered: Lowered) -> Callable[[float], bool]:
    return extent.teller("marching", lowered.time, scenario.duration, telling.CHUNK, extent.ROW_BYTES)


def _sample(scenario: Scenario, lowered: Lowered, march: March, times: FloatArray) -> Variables:
    """Return all variables: those that every wheel has, then those of a law, a deck and a damper's own end."""
    from wheeltapper.march import dense

    rows = run.sample(lowered.program, march, times / lowered.time)
    length, force = lowered.length, lowered.force
    speed, acceleration = length / lowered.time, length / lowered.time**2
    along, touching = ("time",), ("time", "contact")
    out: Variables = {
        "wheel_displacement": (along, rows[:, dense.OUT_WHEEL_Y] * length),
        "wheel_velocity": (along, rows[:, dense.OUT_WHEEL_V] * speed),
        "wheel_acceleration": (along, rows[:, dense.OUT_WHEEL_A] * acceleration),
        "normal_force": (touching, rows[:, [dense.OUT_FORCE]] * force),
        "indentation": (touching, rows[:, [dense.OUT_DELTA]] * length),
        "constraint": (touching, rows[:, [dense.OUT_PATH_Y]] * length),
    }
    if len(lowered.program.law):
        out["permanent_indentation"] = touching, yielded.permanent(lowered, rows)[:, None]
    if lowered.program.numbers[contract.DECK_MASS] > 0.0:
        out["deck_displacement"] = along, rows[:, dense.OUT_DECK_Y] * length
        out["deck_velocity"] = along, rows[:, dense.OUT_DECK_V] * speed
        out["deck_acceleration"] = along, rows[:, dense.OUT_DECK_A] * acceleration
    if len(lowered.program.damper):
        out["damper_end_displacement"] = along, rows[:, dense.OUT_END_Y] * length
        out["damper_force"] = along, rows[:, dense.OUT_DAMPER_FORCE] * force
    return out


def _integrate(scenario: Scenario, lowered: Lowered, march: March) -> tuple[FloatArray, xr.Dataset]:
    found = energy.integrate(lowered, march)
    return found.impulse[:, None] * lowered.force * lowered.time, energy.balance(lowered, found)


WHEEL = Kind(
    begin=contract.TIME,
    length=contract.LENGTH,
    lower=_lower,
    teller=_teller,
    beyond=yielded.beyond_law,
    missing_part=lambda scenario, lowered, march: balanced.missing_part(lowered, march),
    contacts=lambda scenario, lowered: Contacts(
        np.array([lowered.static_force]), np.zeros(1), np.zeros(1, dtype=np.int64), sides=1
    ),
    end=lambda lowered, march: float(march.state[contract.TIME] * lowered.time),
    free=lambda contacts, march: np.isin(march.steps[:, [contract.PHASE]], (contract.FLIGHT, contract.RELEASED)),
    sample=_sample,
    integrate=_integrate,
    tables=wheel_store.tables,
    read=wheel_store.read,
)
"""One contact for both wheels of a wheelset, scaled rows, the motion of the wheel's centre."""
