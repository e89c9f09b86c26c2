"""A damper whose end can move, as numbers for the kernels: free play, a bush in series, or both."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.errors import InputError
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.lower.numbers import Units

OF_THE_END = ("vehicle.damper_play", "vehicle.damper_play_start", "vehicle.bush_stiffness")
"""Paths of the fields that give the damper a movable end: free play and a bush."""


def check_held(vehicle: Wheelset, changed: Iterable[str] = ()) -> None:
    """Refuse a damper with play or a bush, or their fields, in a computation that knows only plain dampers."""
    field = next((path for path in changed if path in OF_THE_END), "vehicle")
    if vehicle.damper_end or field != "vehicle":
        raise InputError(
            "", field, "a damper with play or a bush, of which there are no maps and gradients",
            "one without them; many such scenarios march with `simulate([...])`",
        )  # fmt: skip


def check_contact(scenario: Scenario) -> None:
    """Refuse contacts that no march combines with a damper with play or a bush."""
    contact = scenario.contact
    if isinstance(contact, Hertz) or (isinstance(contact, Linear) and not contact.bilateral):
        return
    what = "a bilateral Linear" if isinstance(contact, Linear) else type(contact).__name__
    raise InputError("", "contact", f"{what} under a damper with play or a bush", "Hertz, or a Linear that only pushes")


def program_with_end(vehicle: Wheelset, program: Program, units: Units) -> Program:
    """Return the program with the damper of the wheelset as a separate array instead of a number.

    Parameters
    ----------
    vehicle
        A wheelset whose damper has play or a bush.
    program, units
        The program with a plain damper, and its units.
    """
    length, time = units.length.item(), units.time.item()
    damper = np.zeros(contract.DAMPER_ENTRIES)
    damper[contract.DAMPER_DAMPING] = program.numbers[contract.DAMPING]
    damper[contract.DAMPER_PLAY] = vehicle.damper_play / length
    damper[contract.DAMPER_START] = vehicle.damper_play_start
    damper[contract.DAMPER_BUSH] = (vehicle.bush_stiffness or 0.0) * time**2 / vehicle.mass
    numbers = program.numbers.copy()
    numbers[contract.DAMPING] = 0.0
    return program._replace(numbers=numbers, damper=damper)
