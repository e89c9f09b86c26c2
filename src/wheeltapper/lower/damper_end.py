"""A damper whose end can move, as numbers for the kernels: free play, a bush in series, or both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    from wheeltapper.lower.numbers import Units


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
