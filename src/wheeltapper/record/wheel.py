"""A wheelset's march as records see it (`kinds.Kind`): one contact for both wheels, scaled rows, the wheel's motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower import build
from wheeltapper.lower.build import Lowered
from wheeltapper.march import program as contract
from wheeltapper.march import run, telling
from wheeltapper.record import balanced, damper, energy, extent, yielded
from wheeltapper.record.contacts import Contacts
from wheeltapper.record.kinds import Variables
from wheeltapper.record.wheel_store import read as read
from wheeltapper.record.wheel_store import tables as tables

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.march.single import March

FloatArray = NDArray[np.float64]
BEGIN, LENGTH = contract.TIME, contract.LENGTH


def lower(scenario: Scenario, method: str) -> Lowered:
    """Return the program with its units; refuse a duration whose steps cannot fit in memory."""
    extent.check_time(scenario)
    lowered = build.lower(scenario, method)
    extent.check_pieces(scenario, lowered)
    return lowered


def teller(scenario: Scenario, lowered: Lowered) -> Callable[[float], bool]:
    """Return what the march tells of its progress to."""
    return extent.teller("marching", lowered.time, scenario.duration, telling.CHUNK, extent.ROW_BYTES)


def beyond(scenario: Scenario, lowered: Lowered, march: March) -> tuple[Note, ...]:
    """Return a note if the force goes beyond what the plastic law was stated for."""
    return yielded.beyond_law(scenario.contact, lowered, march)


def missing_part(scenario: Scenario, lowered: Lowered, march: March) -> float:
    """Return the missing share of the exchanged energy."""
    return balanced.missing_part(lowered, march)


def contacts(scenario: Scenario, lowered: Lowered) -> Contacts:
    """Return the only contact."""
    return Contacts(np.array([lowered.static_force]), np.zeros(1), np.zeros(1, dtype=np.int64), sides=1)


def end(lowered: Lowered, march: March) -> float:
    """Return the end of the computed time, s."""
    return float(march.state[contract.TIME] * lowered.time)


def free(contacts: Contacts, march: March) -> NDArray[np.bool_]:
    """Return (steps, 1) where there is no contact force."""
    return np.isin(march.steps[:, [contract.PHASE]], (contract.FLIGHT, contract.RELEASED))


def sample_columns(lowered: Lowered) -> int:
    """Return how many numbers a sample takes in memory."""
    return 40


def sample(scenario: Scenario, lowered: Lowered, march: March, times: FloatArray) -> Variables:
    """Return all variables at rising times (s), SI units."""
    from wheeltapper.march import dense

    rows = run.sample(lowered.program, march, times / lowered.time)
    length, force = lowered.length, lowered.force
    speed, acceleration = length / lowered.time, length / lowered.time**2
    motion = {
        "wheel_displacement": rows[:, dense.OUT_WHEEL_Y] * length,
        "wheel_velocity": rows[:, dense.OUT_WHEEL_V] * speed,
        "wheel_acceleration": rows[:, dense.OUT_WHEEL_A] * acceleration,
    }
    touching = {
        "normal_force": rows[:, dense.OUT_FORCE] * force,
        "indentation": rows[:, dense.OUT_DELTA] * length,
        "constraint": rows[:, dense.OUT_PATH_Y] * length,
    }
    beside: dict[str, FloatArray] = {}
    if len(lowered.program.law):
        touching["permanent_indentation"] = yielded.permanent(lowered, rows)
    if lowered.program.numbers[contract.DECK_MASS] > 0.0:
        beside |= {
            "deck_displacement": rows[:, dense.OUT_DECK_Y] * length,
            "deck_velocity": rows[:, dense.OUT_DECK_V] * speed,
            "deck_acceleration": rows[:, dense.OUT_DECK_A] * acceleration,
        }
    if len(lowered.program.damper):
        beside |= damper.columns(lowered, rows)
    out: Variables = {name: (("time",), values) for name, values in motion.items()}
    out |= {name: (("time", "contact"), values[:, None]) for name, values in touching.items()}
    return out | {name: (("time",), values) for name, values in beside.items()}


def axes(lowered: Lowered) -> dict[str, list[str]]:
    """Return no names: there are no other dimensions."""
    return {}


def integrate(scenario: Scenario, lowered: Lowered, march: March) -> tuple[FloatArray, xr.Dataset]:
    """Return the impulse in each step, N s, and the balance of energy."""
    found = energy.integrate(lowered, march)
    return found.impulse[:, None] * lowered.force * lowered.time, energy.balance(lowered, found)
