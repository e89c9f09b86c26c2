"""A vehicle in the vertical plane, about its static state, as numbers: what every vehicle on rails states of itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.kinks import Element, kinks_of

if TYPE_CHECKING:
    from wheeltapper.describe.vehicle.wheelset import Wheelset

FloatArray = NDArray[np.float64]


class PlaneVehicle(NamedTuple):
    """M·y'' + C·y' + K·y = N - N0, y upwards from the static state; the first freedoms are those of the wheelsets.

    The end of a wheelset's damper that is in a bush is a freedom without mass. What has play is not in the matrices.

    Attributes
    ----------
    freedoms
        Their names; what is called a pitch is a rotation, upwards in front. One whose name ends in the number of a
        wheelset is drawn above this.
    mass, damping, stiffness
        (freedoms, freedoms): kg, N·s/m, N/m; of a rotation kg·m² and so on.
    positions
        x of each wheelset at time zero, m.
    wheelsets
        Each as if it stood alone: its weight is the static force on it.
    elements
        What is not linear, beside the matrices.
    guides
        Stiffness of each wheelset's spring against a fixed guide, N/m; zero where springs are between bodies only.
    """

    freedoms: tuple[str, ...]
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    positions: tuple[float, ...]
    wheelsets: tuple[Wheelset, ...]
    elements: tuple[Element, ...]
    guides: FloatArray

    @property
    def rails(self) -> int:
        """On how many equal rails the vehicle stands."""
        return self.wheelsets[0].wheels

    @property
    def follows(self) -> FloatArray:
        """1 for each freedom that rests where a wheelset does, (freedoms, wheelsets): itself, and its damper's end."""
        along = [(f"wheelset {i + 1}", end_name(i)) for i in range(len(self.wheelsets))]
        return np.array([[float(name in own) for own in along] for name in self.freedoms])

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies above the wheelsets, from the track upwards."""
        ends = [end_name(i) for i in range(len(self.wheelsets))]
        above = self.freedoms[len(self.wheelsets) :]
        return tuple(name for name in above if name not in ends and not name.endswith("pitch"))

    @property
    def extent(self) -> float:
        """Distance from the first to the last wheelset, m."""
        return max(self.positions) - min(self.positions)


def side_by_side(wheelsets: tuple[Wheelset, ...], positions: tuple[float, ...]) -> PlaneVehicle:
    """Return wheelsets that share nothing but the track."""
    names = [f"wheelset {i + 1}" for i in range(len(wheelsets))]
    bushes = [(i, one) for i, one in enumerate(wheelsets) if one.bush_stiffness is not None]
    names += [end_name(i) for i, _ in bushes]
    mass, damping, stiffness = np.zeros((3, len(names), len(names)))
    for i, one in enumerate(wheelsets):
        mass[i, i], stiffness[i, i] = one.mass, one.stiffness
        damping[i, i] = 0.0 if one.damper_end else one.damping
    for end, (i, one) in enumerate(bushes, len(wheelsets)):
        damping[end, end] = one.damping
        if not one.damper_play:
            spring = np.zeros(len(names))
            spring[[i, end]] = 1.0, -1.0
            stiffness += float(one.bush_stiffness or 0.0) * np.outer(spring, spring)
    elements = [
        element
        for i, one in enumerate(wheelsets)
        for element in kinks_of(one).elements(
            f"primary {{}} {i + 1}", np.eye(len(names))[i], one.stiffness, one.damping
        )
    ]
    guides = np.array([one.stiffness for one in wheelsets])
    return PlaneVehicle(tuple(names), mass, damping, stiffness, positions, wheelsets, tuple(elements), guides)


def end_name(wheelset: int) -> str:
    """Return the name of the freedom of a damper's end, of a wheelset counted from zero."""
    return f"damper end {wheelset + 1}"
