"""A load cell under a sleeper, or a sleeper that weighs."""

from __future__ import annotations

from typing import Literal

import numpy as np

from wheeltapper.describe.sensor.along import AtSeat
from wheeltapper.describe.sensor.base import FloatArray, Seen


class SleeperForce(AtSeat):
    """The force of a half sleeper on the ballast, or of a load cell under it, N, compression positive."""

    kind: Literal["sleeper force"] = "sleeper force"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the force under the half sleeper, N."""
        (values,) = seen.at_places("ballast_force")
        return np.asarray(values)
