"""A strain gauge on the underside of the rail's foot."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.along import AtPlace
from wheeltapper.describe.sensor.base import FloatArray, Seen


class RailStrain(AtPlace):
    """The longitudinal strain of the rail's foot at its underside, in bending, positive in tension."""

    quantity: ClassVar[Quantity] = "strain"
    kind: Literal["rail strain"] = "rail strain"

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the strain, a plain number."""
        (values,) = seen.at_places("rail_strain")
        return np.asarray(values)
