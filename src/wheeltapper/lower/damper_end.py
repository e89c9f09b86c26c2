"""Dampers whose ends can move, as numbers for the kernels: free play, a bush in series, or both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.fields import Fields
from wheeltapper.lower.numbers import Units
from wheeltapper.march import program as contract

FloatArray = NDArray[np.float64]


def dampers_with_ends(value: Fields, numbers: FloatArray, units: Units) -> FloatArray:
    """Return the dampers of cells (cells, DAMPER_ENTRIES); their numbers (cells, NUMBERS) lose their DAMPING."""
    out, bush = np.zeros((len(numbers), contract.DAMPER_ENTRIES)), value("vehicle.bush_stiffness")
    out[:, contract.DAMPER_DAMPING] = numbers[:, contract.DAMPING]
    out[:, contract.DAMPER_PLAY] = value("vehicle.damper_play") / units.length
    out[:, contract.DAMPER_START] = value("vehicle.damper_play_start")
    out[:, contract.DAMPER_BUSH] = 0.0 if bush is None else bush * units.time**2 / value("vehicle.mass")
    numbers[:, contract.DAMPING] = 0.0
    return out
