"""Elements that connect the bodies of a vehicle: springs, dampers, friction, stops and links between two points.

Each of the two ends of an element is fixed to a body. In the undeformed vehicle both ends are at the same place.
`between` names two bodies, or a body and "ground", which moves steadily with the vehicle.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from wheeltapper.describe.noun import (
    AngularStiffness,
    Coefficient,
    Damping,
    Force,
    Length,
    Noun,
    PositiveForce,
    PositiveStiffness,
    SlidingForce,
    Speed,
    Stiffness,
)
from wheeltapper.ground.errors import InputError, value_text

GROUND = "ground"
Direction = Literal["x", "y", "z", "roll", "pitch", "yaw"]
Pair = tuple[float, float]


class Element(Noun, abstract=True):
    """The common part of elements: a name, two ends, and their place.

    Parameters
    ----------
    name
        Name in faults and changes; it has to differ from the names of all other elements and bodies.
    between
        What it connects: names of two bodies ("wheelset 1" is a wheelset), or of a body and "ground".
    at
        Place of both ends in the undeformed vehicle: x from the leading wheelset (forward; negative behind it), y to
        the left, z above the rail, m.
    """

    example: ClassVar[dict[str, Any]]
    """Fields of an example, beside those that all have, which the conformance tests make."""
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
    """A damper in three directions, or a piecewise linear one in one; optionally in series with a spring (its bush).

    Parameters
    ----------
    damping
        Along x, y and z, N·s/m.
    along
        The direction of `rate` and `force`; None if `damping` is given.
    rate, force
        Instead of `damping`, in one direction: the corners of the force over the rate of extension, m/s and N, such as
        those of a blow-off valve. Either they begin with (0, 0), and the force is odd in the rate; or they begin at
        negative rates and pass through (0, 0). Beyond the outermost corners the force continues straight. It must not
        fall with the rate, and must rise where there is a spring in series.
    series_stiffness
        Stiffness of the spring in series with each direction, N/m; None: rigid.
    free_play
        Free play of the worn end at that spring, in all directions, m, from one side to the other; within it the force
        is zero.
    """

    example: ClassVar[dict[str, Any]] = {"damping": (0.0, 0.0, 2e4)}
    damping: tuple[Damping, Damping, Damping] | None = None
    along: Literal["x", "y", "z"] | None = None
    rate: tuple[Speed, ...] = ()
    force: tuple[Force, ...] = ()
    series_stiffness: PositiveStiffness | None = None
    free_play: Length = Field(default=0.0, ge=0)

    @model_validator(mode="after")
    def _play_needs_a_spring(self) -> Damper:
        if self.free_play > 0.0 and self.series_stiffness is None:
            found = f"{self.free_play:g} m at a rigid end"
            raise InputError("", "free_play", found, "with series_stiffness, the spring that it leads to")
        return self

    @model_validator(mode="after")
    def _check_characteristic(self) -> Damper:
        given = self.along is not None and bool(self.rate)
        if given == (self.damping is not None) or given != (self.along is not None or bool(self.rate or self.force)):
            named = ("damping", "along", "rate", "force")
            found = ", ".join(name for name in named if getattr(self, name) not in (None, ())) or "none of them"
            raise InputError("", "damping", found, "damping, or along, rate and force")
        if given:
            check_corners("rate", self.rate, self.force)
            if 0.0 not in self.rate or self.force[self.rate.index(0.0)] != 0.0 or self.rate[-1] == 0.0:
                raise InputError("", "rate", "a characteristic that does not pass through zero", "rate 0 with force 0")
            if any(b < a or (b == a and self.series_stiffness) for a, b in pairwise(self.force)):
                rising = "rising ones beside series_stiffness" if self.series_stiffness else "ones that do not fall"
                raise InputError("", "force", "numbers that do not rise", rising)
        return self

    @property
    def slopes(self) -> tuple[float, float, float]:
        """Damping along x, y and z about rest, N·s/m; of a piecewise linear force the slope at small positive rates."""
        if self.damping is not None:
            return self.damping
        zero = self.rate.index(0.0)
        slope = self.force[zero + 1] / self.rate[zero + 1]
        x, y, z = (slope if axis == self.along else 0.0 for axis in "xyz")
        return x, y, z


class Sliding(Element, abstract=True):
    """The common part of dry friction: it sticks until its force reaches a limit, then slides with a given force.

    With `series_stiffness` it is an elastic slider (a Jenkins element): it sticks as a spring. It sticks again when its
    sliding rate falls through zero. Without, it sticks as a rigid constraint, and the forces of all sticking elements
    are found together. When its sliding rate comes to zero, and no force within its bounds holds it there, it slides
    the other way. If sticking elements hold each other, so that their forces are not determined, they share them as
    equally stiff springs would. Vehicles begin at rest, with all friction sticking without a force.

    Friction acts in one direction. A face that slides in two directions takes two elements: then each has the whole
    force of friction, a box instead of a circle.

    `wt.modes` and `wt.stability` take all friction as sticking: as its spring, or as a rigid connection.

    Parameters
    ----------
    series_stiffness
        Stiffness of the spring in series, N/m, or N·m/rad about an axis; None: rigid.
    """

    series_stiffness: PositiveStiffness | None = None

    @property
    def direction(self) -> Direction:
        """Along, or about, which axis it acts."""
        return str(getattr(self, "along"))  # type: ignore[return-value]  # noqa: B009

    @property
    def pressed_by(self) -> str | None:
        """Name of the spring whose force presses it; None if its own force is constant."""
        return getattr(self, "load", None)

    @property
    def bounds(self) -> tuple[Pair, Pair]:
        """Forces of sliding, back and forth, and those at which it begins to slide, N (N·m about an axis).

        Over the force that presses it where one does.
        """
        raise NotImplementedError


class Friction(Sliding):
    """Dry (Coulomb) friction along or about one axis, with a constant force, or with one that follows a spring's.

    It sticks until its force reaches a limit, then slides with a given one. Where `load` names a spring, both are the
    coefficients times the force that presses in it, and where that ends there is no friction.

    Parameters
    ----------
    along
        The direction; "roll", "pitch" or "yaw": about that axis, with moments.
    force
        Friction force while it slides, N (N·m about an axis).
    static_force
        Force at which it begins to slide, at least `force`; None: `force`.
    load
        Instead of `force`: the name of a `Spring`, whose vertical force presses the faces together, or of a
        `CompressionSpring`.
    coefficient
        With `load`: the force while it slides over that which presses, m about an axis (the arm included). Two numbers:
        where its first end goes forth on its direction, relative to the second one, and back.
    static_coefficient
        The same for the force at which it begins to slide, at least `coefficient`; None: `coefficient`.
    """

    example: ClassVar[dict[str, Any]] = {"along": "z", "force": 500.0}
    along: Direction
    force: SlidingForce | None = None
    static_force: PositiveForce | None = None
    load: str | None = None
    coefficient: Coefficient | tuple[Coefficient, Coefficient] | None = None
    static_coefficient: Coefficient | tuple[Coefficient, Coefficient] | None = None

    @model_validator(mode="after")
    def _check_forces(self) -> Friction:
        if (self.load is None) != (self.coefficient is None) or (self.load is None) == (self.force is None):
            named = ("force", "load", "coefficient")
            found = ", ".join(name for name in named if getattr(self, name) is not None) or "none of them"
            raise InputError("", "force", found, "force, or load and coefficient")
        if self.force == 0.0:
            allowed = "greater than 0, however little; a vehicle without friction has no such element (`without`)"
            raise InputError("", "force", "0 N", allowed)
        other = "static_force" if self.load is not None else "static_coefficient"
        if getattr(self, other) is not None:
            raise InputError("", other, f"{getattr(self, other)!r} beside {'load' if self.load else 'force'}", "none")
        slides, begins = self.bounds
        if self.static_force is not None and self.static_force < slides[0]:
            allowed = f"at least force, {self.force:g} N"
            raise InputError("", "static_force", f"{self.static_force:g} N", allowed)
        if any(limit < force for force, limit in zip(slides, begins, strict=True)):
            found = value_text(self.static_coefficient)
            raise InputError("", "static_coefficient", found, f"at least coefficient, {value_text(self.coefficient)}")
        return self

    @property
    def bounds(self) -> tuple[Pair, Pair]:
        """As of all that slides."""
        if self.force is not None:
            limit = self.force if self.static_force is None else self.static_force
            return (self.force, self.force), (limit, limit)
        slides = _both_ways(self.coefficient)
        return slides, slides if self.static_coefficient is None else _both_ways(self.static_coefficient)


def _both_ways(given: Any) -> Pair:
    """Return numbers back and forth from one for both, or from those forth and back."""
    return (float(given[1]), float(given[0])) if isinstance(given, tuple) else (float(given), float(given))


class Stop(Element):
    """A force that is a piecewise linear function of the relative displacement in one direction, odd in it.

    The displacement counts from the static state, in which the springs carry the vehicle and a stop has no force. A gap
    is the distance that is left under the static load.

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
        check_corners("deflection", self.deflection, self.force)
        if self.deflection[0] != 0.0 or self.force[0] != 0.0:
            raise InputError("", "", "a characteristic that does not begin at zero", "deflection 0 and force 0 first")
        return self


def check_corners(name: str, places: tuple[float, ...], force: tuple[float, ...]) -> None:
    """Refuse corners of a characteristic over `name` that are not pairs, or whose places do not rise."""
    if len(places) != len(force) or len(places) < 2:
        raise InputError("", "", f"{len(places)} {name}s and {len(force)} forces", "as many of both, two at least")
    if any(b <= a for a, b in pairwise(places)):
        raise InputError("", name, "numbers that do not rise", "strictly rising ones")


class Link(Element):
    """A rigid connection in some directions, such as a broken spring that rests on itself.

    Parameters
    ----------
    along
        The directions in which both ends move together.
    """

    example: ClassVar[dict[str, Any]] = {"along": ("z",)}
    along: tuple[Literal["x", "y", "z"], ...] = Field(min_length=1)
