"""Elements that connect the bodies of a vehicle: springs, dampers, stops and links between two points.

Each of the two ends of an element is fixed to a body. In the undeformed vehicle both ends are at the same place.
`between` names two bodies, or a body and "ground", which moves steadily with the vehicle.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from wheeltapper.describe.noun import AngularStiffness, Damping, Force, Length, Noun, PositiveStiffness, Stiffness
from wheeltapper.ground.errors import InputError

GROUND = "ground"


class Element(Noun, abstract=True):
    """The common part of elements: a name, two ends, and their place.

    Parameters
    ----------
    name
        Name in faults and changes; it differs from all other names of elements and bodies.
    between
        What it connects: names of two bodies ("wheelset 1" is a wheelset), or of a body and "ground".
    at
        Place of both ends in the undeformed vehicle: x from the leading wheelset (forward; negative behind it), y to
        the left, z above the rail, m.
    """

    example: ClassVar[dict[str, Any]]
    """Fields of one of them, beside those that all have; the conformance tests try it."""
    name: str = Field(min_length=1)
    between: tuple[str, str]
    at: tuple[Length, Length, Length]

    @model_validator(mode="after")
    def _two_ends(self) -> Element:
        if self.between[0] == self.between[1]:
            raise InputError("", "between", f"{self.between[0]!r} twice", f"two bodies, or a body and {GROUND!r}")
        return self


class Spring(Element):
    """A spring in three directions and about three axes: F = K·(relative displacement), M = K·(relative rotation).

    Parameters
    ----------
    stiffness
        Along x, y and z, N/m.
    bending
        About x (roll), y (pitch) and z (yaw), N·m/rad.
    """

    example: ClassVar[dict[str, Any]] = {"stiffness": (0.0, 0.0, 1e6)}
    stiffness: tuple[Stiffness, Stiffness, Stiffness] = (0.0, 0.0, 0.0)
    bending: tuple[AngularStiffness, AngularStiffness, AngularStiffness] = (0.0, 0.0, 0.0)


class Damper(Element):
    """A damper in three directions, each optionally in series with a spring (the bush at its end).

    Parameters
    ----------
    damping
        Along x, y and z, N·s/m.
    series_stiffness
        Stiffness of the spring in series with each direction, N/m; None: rigid.
    free_play
        Free play of the worn end at that spring, in all directions, m, from one side to the other; within it the force
        is zero.
    """

    example: ClassVar[dict[str, Any]] = {"damping": (0.0, 0.0, 2e4)}
    damping: tuple[Damping, Damping, Damping]
    series_stiffness: PositiveStiffness | None = None
    free_play: Length = Field(default=0.0, ge=0)

    @model_validator(mode="after")
    def _play_needs_a_spring(self) -> Damper:
        if self.free_play > 0.0 and self.series_stiffness is None:
            found = f"{self.free_play:g} m at a rigid end"
            raise InputError("", "free_play", found, "with series_stiffness, the spring that it leads to")
        return self


class Stop(Element):
    """A force that is a piecewise linear function of the relative displacement in one direction, odd in it.

    Parameters
    ----------
    along
        The direction.
    deflection, force
        Its corners for positive deflections, m and N, beginning with (0, 0); beyond the last one it continues straight.
    """

    example: ClassVar[dict[str, Any]] = {"along": "z", "deflection": (0.0, 1e-4, 3e-4), "force": (0.0, 100.0, 500.0)}
    along: Literal["x", "y", "z"]
    deflection: tuple[Length, ...] = Field(min_length=2)
    force: tuple[Force, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _check_rising(self) -> Stop:
        if len(self.deflection) != len(self.force):
            raise InputError(
                "", "", f"{len(self.deflection)} deflections and {len(self.force)} forces", "as many of both"
            )
        if self.deflection[0] != 0.0 or self.force[0] != 0.0:
            raise InputError("", "", "a characteristic that does not begin at zero", "deflection 0 and force 0 first")
        if any(b <= a for a, b in pairwise(self.deflection)):
            raise InputError("", "deflection", "numbers that do not rise", "strictly rising ones")
        return self


class Link(Element):
    """A rigid connection in some directions, such as a broken spring that rests on itself.

    Parameters
    ----------
    along
        The directions in which both ends move together.
    """

    example: ClassVar[dict[str, Any]] = {"along": ("z",)}
    along: tuple[Literal["x", "y", "z"], ...] = Field(min_length=1)
