"""A load cell in a rail pad."""

from __future__ import annotations

from typing import Literal

import numpy as np

from wheeltapper.describe.sensor.along import AtSeat
from wheeltapper.describe.sensor.base import FloatArray, Seen


class PadForce(AtSeat):
    """The force in the pad of a seat, N, compression positive."""

    kind: Literal["pad force"] = "pad force"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the force in the pad, N."""
        (values,) = seen.at_places("pad_force")
        return np.asarray(values)
