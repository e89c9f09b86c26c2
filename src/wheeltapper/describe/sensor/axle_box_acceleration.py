"""An accelerometer on an axle box."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.base import FilteredSensor, FloatArray, Seen

LAST = 1_000_000
"""Largest number of a wheelset."""


class AxleBoxAcceleration(FilteredSensor):
    """The vertical acceleration of a wheelset at its axle box, m/s², upwards.

    It is the acceleration of the motion; gravity, which some accelerometers show, is not included. The sensor belongs
    to the vehicle of a run, not to a site.

    Parameters
    ----------
    wheelset
        Number of the wheelset, from the leading one, which is 1.
    side
        "left" or "right", facing forward: the side of the axle box. It is needed on a wagon, whose wheelsets roll.
        None: on other vehicles, whose sides are alike.
    """

    quantity: ClassVar[Quantity] = "vertical acceleration"
    place_words: ClassVar[str] = "wheelset"
    kind: Literal["axle box acceleration"] = "axle box acceleration"
    wheelset: int = Field(default=1, ge=1, le=LAST)
    side: Literal["left", "right"] | None = None

    def samples(self, seen: Seen) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return the samples that it would record of a run, m/s²; no sample is clipped."""
        values = seen.behind_filter(lambda one: one.axle_box_acceleration(self.wheelset), self.cutoff(self.rate))
        return values, np.zeros(len(values), dtype=bool)
