"""An accelerometer on the rail."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.along import AtPlace
from wheeltapper.describe.sensor.base import FloatArray, Seen


class RailAcceleration(AtPlace):
    """The vertical acceleration of the rail at a place, m/s², upwards."""

    quantity: ClassVar[Quantity] = "vertical acceleration"
    kind: Literal["rail acceleration"] = "rail acceleration"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the acceleration of the rail, m/s²."""
        (values,) = seen.at_places("rail_acceleration")
        return np.asarray(values)
