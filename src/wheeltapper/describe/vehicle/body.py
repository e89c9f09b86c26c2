"""Rigid bodies of a vehicle: a car body, a bogie frame, a wheelset."""

from __future__ import annotations

from math import sqrt
from typing import Literal

from pydantic import Field

from wheeltapper.describe.noun import Force, Inertia, Length, Mass, Noun, PositiveLength

Motion = Literal["x", "y", "z", "roll", "pitch", "yaw"]
MOTIONS: tuple[Motion, ...] = ("x", "y", "z", "roll", "pitch", "yaw")


class Body(Noun):
    """A rigid body with six small motions: x forward, y left, z up; roll about x, pitch about y, yaw about z.

    Parameters
    ----------
    name
        Name of the body in elements and results.
    mass
        kg.
    inertia
        Principal moments about the centre of gravity: roll, pitch, yaw, kg·m².
    position
        Centre of gravity: x from the leading wheelset (forward; negative behind it), y, z above the rail, m.
    held
        Motions that are fixed at zero.
    """

    name: str = Field(min_length=1)
    mass: Mass
    inertia: tuple[Inertia, Inertia, Inertia]
    position: tuple[Length, Length, Length]
    held: tuple[Motion, ...] = ()

    @property
    def box(self) -> tuple[float, float, float]:
        """Length, width and height of the homogeneous box of this mass and these moments, m; 0 where there is none."""
        total = sum(self.inertia)
        length, width, height = (sqrt(max(6.0 * (total - 2.0 * own) / self.mass, 0.0)) for own in self.inertia)
        return length, width, height


class Axle(Noun):
    """A wheelset of a vehicle: a rigid body with two wheels. Wheelsets are numbered from the leading one, 1.

    Parameters
    ----------
    mass
        kg, axle boxes included.
    inertia
        Principal moments about the centre of gravity: roll, pitch (the spin), yaw, kg·m².
    position
        x of its centre from the leading wheelset, m; negative behind it.
    radius
        Nominal radius of the wheels, m: the height of its centre above the rail.
    load
        Constant downward force on its centre, in addition to weight and elements, N.
    held
        Motions that are fixed at zero.
    """

    mass: Mass
    inertia: tuple[Inertia, Inertia, Inertia]
    position: Length
    load: Force = 0.0
    radius: PositiveLength = 0.46
    held: tuple[Motion, ...] = ()
