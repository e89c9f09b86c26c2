"""A vehicle in the vertical plane, about its static state, as numbers: what every vehicle on rails states of itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from wheeltapper.describe.vehicle.wheelset import Wheelset

FloatArray = NDArray[np.float64]


class PlaneVehicle(NamedTuple):
    """M·y'' + C·y' + K·y = N - N0, y upwards from the static state; the first freedoms are those of the wheelsets.

    Attributes
    ----------
    freedoms
        Their names.
    mass, damping, stiffness
        (freedoms, freedoms): kg, N·s/m, N/m; of a rotation kg·m² and so on.
    positions
        x of each wheelset at time zero, m.
    wheelsets
        Each as if it stood alone: its weight is the static force on it.
    """

    freedoms: tuple[str, ...]
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    positions: tuple[float, ...]
    wheelsets: tuple[Wheelset, ...]

    @property
    def rails(self) -> int:
        """On how many equal rails the vehicle stands."""
        return self.wheelsets[0].wheels

    @property
    def extent(self) -> float:
        """Distance from the first to the last wheelset, m."""
        return max(self.positions) - min(self.positions)


def side_by_side(wheelsets: tuple[Wheelset, ...], positions: tuple[float, ...]) -> PlaneVehicle:
    """Return wheelsets that share nothing but the track."""
    names = tuple(f"wheelset {i + 1}" for i in range(len(wheelsets)))
    mass, damping, stiffness = (
        np.diag([float(getattr(one, field)) for one in wheelsets]) for field in ("mass", "damping", "stiffness")
    )
    return PlaneVehicle(names, mass, damping, stiffness, positions, wheelsets)
