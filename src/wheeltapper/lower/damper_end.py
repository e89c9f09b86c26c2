"""A damper with an end of its own, as numbers for the kernels: free play, a bush in series, or both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    from wheeltapper.lower.numbers import Units


def program_with_end(vehicle: Wheelset, program: Program, units: Units) -> Program:
    """Return the program with the wheelset's damper taken out of the numbers and written down on its own.

    Parameters
    ----------
    vehicle
        Whose damper has play or a bush.
    program, units
        With the damper as a plain one, and its units.
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
