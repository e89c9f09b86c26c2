"""A displacement gauge of a sleeper, as of a geophone, a laser or a camera beside the track."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.along import AtSeat
from wheeltapper.describe.sensor.base import FloatArray, Seen


class SleeperDisplacement(AtSeat):
    """The displacement of a sleeper, m, upwards."""

    quantity: ClassVar[Quantity] = "displacement"
    kind: Literal["sleeper displacement"] = "sleeper displacement"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the displacement of the sleeper, m."""
        (values,) = seen.at_places("sleeper_displacement")
        return np.asarray(values)
