"""A pair of shear gauges on the rail: what stands between them."""

from __future__ import annotations

from typing import Literal

import numpy as np

from wheeltapper.describe.sensor.along import BetweenPlaces
from wheeltapper.describe.sensor.base import FloatArray, Seen


class RailShearForce(BetweenPlaces):
    """The difference of the rail's shear forces at two gauges, N: the force on the rail between them."""

    kind: Literal["rail shear force"] = "rail shear force"

    @property
    def rail_places(self) -> tuple[float, ...]:
        """Places of both gauges, m."""
        return self.ends

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the difference of the two shear forces, N."""
        behind, ahead = seen.at_places("rail_shear")
        return np.asarray(behind - ahead)
