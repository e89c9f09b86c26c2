"""The contacts of a vehicle: the axis `contact` of all tables of a record, and what it is in public."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common.program import EVENT_CONTACT

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
SIDES = ("left", "right", "both")
"""Names of the sides: a wheelset without sides has one contact for both of its wheels."""
SURFACES = ("tread", "flange")
"""Names of the parts of a wheel that touch."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """The contacts of a vehicle: first the treads, wheel after wheel, then the flanges in the same order.

    Attributes
    ----------
    static_force
        (wheels,) static normal force, N.
    position, radius
        (wheels,) x at time zero, and of the wheels, m.
    lanes
        (contacts,) number of each contact in the rows of its march.
    sides
        Number of wheels of a wheelset that have contacts of their own: 1 or 2.
    """

    static_force: FloatArray
    position: FloatArray
    radius: FloatArray
    lanes: IntArray
    sides: int

    @property
    def has_several(self) -> bool:
        """Whether tables name the contact in public."""
        return len(self.position) > 1

    @property
    def has_sides(self) -> bool:
        """Whether every wheel has contacts of its own."""
        return self.sides > 1

    @property
    def wheelsets(self) -> int:
        """Number of wheelsets."""
        return len(self.position) // self.sides

    @property
    def labels(self) -> dict[str, NDArray[Any]]:
        """Wheelset, from 1, side and surface of each contact."""
        surface, wheel = np.divmod(np.arange(len(self.lanes)), len(self.static_force))
        names = SIDES if self.has_sides else SIDES[-1:]
        return {
            "wheelset": wheel // self.sides + 1,
            "side": np.array(names)[wheel % self.sides],
            "surface": np.array(SURFACES)[surface],
        }

    @property
    def public_labels(self) -> dict[str, NDArray[Any]]:
        """What tells contacts apart: nothing, the wheelset, or wheelset, side and surface."""
        if self.has_sides:
            return self.labels
        return {"wheelset": self.labels["wheelset"]} if self.has_several else {}

    @property
    def axis_names(self) -> dict[str, list[Any]]:
        """Names of wheelsets and sides where there are several."""
        sides = {"side": [*SIDES[: self.sides]]} if self.has_sides else {}
        return {"wheelset": [*range(1, self.wheelsets + 1)], **sides} if self.has_several else {}

    def contact_of_rows(self, rows: FloatArray) -> IntArray:
        """Return the contact of each event or maximum of a march."""
        if len(self.lanes) == 1:  # then that column holds something else
            return np.zeros(len(rows), dtype=np.int64)
        order = np.argsort(self.lanes)
        return order[np.searchsorted(self.lanes[order], rows[:, EVENT_CONTACT])]

    def by_wheel(self, values: FloatArray) -> tuple[tuple[str, ...], FloatArray]:
        """Return values over the wheels (..., wheels) with the dimensions that they have in public."""
        if not self.has_several:
            return (), values[..., 0]
        if not self.has_sides:
            return ("wheelset",), values
        return ("wheelset", "side"), values.reshape(*values.shape[:-1], self.wheelsets, self.sides)
