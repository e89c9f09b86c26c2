"""An instrumented length of rail: the forces of the wheels on it."""

from __future__ import annotations

from typing import Literal

from wheeltapper.describe.sensor.along import BetweenPlaces
from wheeltapper.describe.sensor.base import FloatArray, Seen


class ContactForce(BetweenPlaces):
    """The force of the wheels on an instrumented length of one rail, N."""

    kind: Literal["contact force"] = "contact force"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the sum of the forces of the wheels on it, N."""
        return seen.force_between(float(self.x1), float(self.x2))
