"""What a record must know of a wheelset's march."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.build import Lowered, lower
from wheeltapper.march.common import program as contract
from wheeltapper.march.common import telling
from wheeltapper.record import balanced, extent
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.energies import balance as energy
from wheeltapper.record.kinds import Kind, Variables

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.wheel.march import Marched as MarchedWheel

FloatArray = NDArray[np.float64]


def _lower(scenario: Scenario, method: str) -> Lowered:
    extent.check_time(scenario)
    lowered = lower(scenario, method)
    extent.check_pieces(scenario, lowered)
    return lowered


def _sample(scenario: Scenario, lowered: Lowered, march: MarchedWheel, times: FloatArray) -> Variables:
    """Return all variables: those that every wheel has, then those of a law, a deck and a damper's own end."""
    from wheeltapper.march.wheel import dense

    rows = march.at(times / lowered.time)
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
    for law in lowered.plastic_laws:
        left = law.left_over(rows[:, [dense.OUT_DELTA]] * length, rows[:, [dense.OUT_RESIDUAL]] * length)
        out["permanent_indentation"] = touching, left
    if lowered.program.numbers[contract.DECK_MASS] > 0.0:
        out["deck_displacement"] = along, rows[:, dense.OUT_DECK_Y] * length
        out["deck_velocity"] = along, rows[:, dense.OUT_DECK_V] * speed
        out["deck_acceleration"] = along, rows[:, dense.OUT_DECK_A] * acceleration
    if lowered.program.damper_ends:
        out["damper_end_displacement"] = along, rows[:, dense.OUT_END_Y] * length
        out["damper_force"] = along, rows[:, dense.OUT_DAMPER_FORCE] * force
    return out


def _integrate(
    scenario: Scenario, lowered: Lowered, march: MarchedWheel
) -> tuple[FloatArray, Callable[[], xr.Dataset]]:
    found = energy.integrate(lowered, march)
    return found.impulse[:, None] * lowered.force * lowered.time, lambda: energy.balance(lowered, found)


WHEEL = Kind(
    lower=_lower,
    chunk=telling.CHUNK,
    row_bytes=lambda scenario: extent.ROW_BYTES,
    missing_part=lambda scenario, lowered, march: balanced.missing_part(march),
    contacts=lambda scenario, lowered: Contacts(
        np.array([lowered.static_force]),
        np.zeros(1),
        np.array([float(scenario.vehicle.radius)]),
        np.zeros(1, dtype=np.int64),
        sides=1,
    ),
    sample=_sample,
    integrate=_integrate,
    stops=lambda lowered, march: (march.stops, np.zeros(len(march.stops), dtype=np.int64)),
)
"""One contact for both wheels of a wheelset, scaled rows, the motion of the wheel's centre."""
