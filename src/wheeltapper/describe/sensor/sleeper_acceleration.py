"""An accelerometer on a sleeper."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.along import AtSeat
from wheeltapper.describe.sensor.base import FloatArray, Seen


class SleeperAcceleration(AtSeat):
    """The vertical acceleration of a sleeper, m/s², upwards."""

    quantity: ClassVar[Quantity] = "vertical acceleration"
    kind: Literal["sleeper acceleration"] = "sleeper acceleration"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the acceleration of the sleeper, m/s²."""
        (values,) = seen.at_places("sleeper_acceleration")
        return np.asarray(values)
