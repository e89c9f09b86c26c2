"""Elements of freight wagons: springs that only press, and friction that follows the load.

The forces of links and wedges are those of their statics. On all of these: S. Iwnicki, S. Stichel, A. Orlova, M. Hecht,
"Dynamics of railway freight vehicles", Vehicle System Dynamics 53 (2015), 995-1033.

Theory: docs/theory/wagon.rst, section 7.10.
"""

from __future__ import annotations

from math import cos, pi, sin, tan
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from wheeltapper.describe.noun import Coefficient, Force, Length, PositiveAngle, PositiveForce, PositiveLength
from wheeltapper.describe.vehicle.element import Direction, Element, Pair, Sliding, check_corners
from wheeltapper.ground.errors import InputError


class CompressionSpring(Element):
    """A spring, or a nest of springs, that can only press its two ends apart, in one direction.

    It is pressed where its first end comes down on its second one, against `along`: `between` names the upper body
    first. Where it parts and touches, and where a further spring of a nest engages, is located exactly, and told in
    `Record.suspension_events`.

    How far it is pressed under the static load is found with all other springs: all are free at the same time, as when
    the vehicle is assembled without weight. `preload` or `gap` state it instead, as of a side bearer that is adjusted.

    Parameters
    ----------
    along
        The direction.
    compression, force
        Corners of its force over the way by which it is pressed from where it is free, m and N, beginning with (0, 0)
        and rising; beyond the last one it continues straight. Nested springs have a corner where the next one engages.
    preload
        Its force under the static load, N.
    gap
        Its distance from touching under the static load, m.
    """

    example: ClassVar[dict[str, Any]] = {
        "along": "z", "compression": (0.0, 0.02, 0.05), "force": (0.0, 3e4, 9e4), "preload": 1e4,
    }  # fmt: skip
    along: Literal["x", "y", "z"]
    compression: tuple[Length, ...] = Field(min_length=2)
    force: tuple[Force, ...] = Field(min_length=2)
    preload: PositiveForce | None = None
    gap: PositiveLength | None = None

    @model_validator(mode="after")
    def _check_rising(self) -> CompressionSpring:
        check_corners("compression", self.compression, self.force)
        if self.compression[0] != 0.0 or self.force[0] != 0.0:
            raise InputError("", "", "a characteristic that does not begin at zero", "compression 0 and force 0 first")
        if any(b <= a for a, b in zip(self.force[:-1], self.force[1:], strict=True)):
            raise InputError("", "force", "numbers that do not rise", "strictly rising ones")
        if self.preload is not None and self.gap is not None:
            raise InputError("", "gap", "a gap beside preload", "one of them")
        return self


class LoadFriction(Sliding, abstract=True):
    """The common part of friction that a spring's force presses.

    Parameters
    ----------
    load
        Name of the spring: of a `Spring`, whose vertical force presses, or of a `CompressionSpring`.
    friction
        Coefficient of friction of the faces.
    """

    load: str = Field(min_length=1)
    friction: Coefficient

    @property
    def factors(self) -> Pair:
        """Forces of friction, back and forth, over the force of the spring."""
        raise NotImplementedError

    @property
    def bounds(self) -> tuple[Pair, Pair]:
        """As of all that slides."""
        return self.factors, self.factors


class LenoirLink(LoadFriction):
    """The friction of an axle box with a Lenoir link, as in the Y25 bogie.

    The link is inclined and carries the spring's force F: it presses a pusher against the box, and the box against its
    guide, with H = F·tan α each. Friction resists vertical motion with 2·μ·H.

    Parameters
    ----------
    angle
        Inclination of the link from the vertical, α, rad, or as "24 deg".
    faces
        Number of faces that rub: those at the pusher and at the guide.
    """

    example: ClassVar[dict[str, Any]] = {"load": "spring", "friction": 0.01, "angle": 0.4}
    angle: PositiveAngle = Field(lt=0.5 * pi)
    faces: Literal[1, 2] = 2

    @property
    def direction(self) -> Direction:
        """The vertical one."""
        return "z"

    @property
    def factors(self) -> Pair:
        """2·μ·tan α to both sides."""
        both = self.faces * self.friction * tan(self.angle)
        return both, both


class FrictionWedge(LoadFriction):
    """The friction of a wedge between bolster and side frame of a three-piece bogie.

    The wedge has no mass, a spring below it with the force F, a slope without friction against the bolster, and a
    vertical face against the column of the side frame, which presses it by N = F/(tan α + μ) while the bolster rises
    and by N = F/(tan α - μ) while it sinks; friction is μ·N. `between` names the bolster first.

    Parameters
    ----------
    angle
        Of the slope from the vertical, α, rad, or as "36.3 deg". Its tangent has to exceed μ: else the wedge locks.
    """

    example: ClassVar[dict[str, Any]] = {"load": "spring", "friction": 0.02, "angle": 0.63}
    angle: PositiveAngle = Field(lt=0.5 * pi)

    @model_validator(mode="after")
    def _check_locking(self) -> FrictionWedge:
        if tan(self.angle) <= self.friction:
            found = f"{self.angle:g} rad, a slope of {tan(self.angle):.4g}"
            raise InputError("", "angle", found, f"a slope above friction, {self.friction:g}: else the wedge locks")
        return self

    @property
    def direction(self) -> Direction:
        """The vertical one."""
        return "z"

    @property
    def factors(self) -> Pair:
        """μ/(tan α - μ) where the bolster sinks, μ/(tan α + μ) where it rises."""
        slope = tan(self.angle)
        return self.friction / (slope - self.friction), self.friction / (slope + self.friction)


class CentreBowl(LoadFriction):
    """The friction of a centre bowl, or centre plate, against yaw of the bogie below the body: μ·r·N.

    Parameters
    ----------
    shape
        "flat": a new flat ring, r = 2/3·(R³ - r³)/(R² - r²); "worn": one with even wear, r = (R + r)/2; "sphere": with
        a pressure as the cosine, r = R·sin³β/(1 - cos³β).
    radius
        Outer radius R of the ring, or that of the sphere, m.
    inner_radius
        Inner radius r of a ring, m.
    half_angle
        β of a sphere, rad, or as "45 deg".
    """

    example: ClassVar[dict[str, Any]] = {"load": "spring", "friction": 0.25, "radius": 0.15}
    shape: Literal["flat", "worn", "sphere"] = "flat"
    radius: PositiveLength
    inner_radius: Length = Field(default=0.0, ge=0.0)
    half_angle: PositiveAngle | None = Field(default=None, le=0.5 * pi)

    @model_validator(mode="after")
    def _check_shape(self) -> CentreBowl:
        if (self.shape == "sphere") != (self.half_angle is not None):
            raise InputError("", "half_angle", f"{self.half_angle!r} of a {self.shape} bowl", "one of a sphere alone")
        if self.inner_radius >= self.radius or (self.shape == "sphere" and self.inner_radius > 0.0):
            allowed = "none" if self.shape == "sphere" else f"below radius, {self.radius:g} m"
            raise InputError("", "inner_radius", f"{self.inner_radius:g} m", allowed)
        return self

    @property
    def direction(self) -> Direction:
        """About the vertical axis."""
        return "yaw"

    @property
    def arm(self) -> float:
        """Radius at which the friction force acts, r, m."""
        outer, inner = float(self.radius), float(self.inner_radius)
        if self.half_angle is not None:
            return float(outer * sin(self.half_angle) ** 3 / (1.0 - cos(self.half_angle) ** 3))
        if self.shape == "worn":
            return 0.5 * (outer + inner)
        return 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2)

    @property
    def factors(self) -> Pair:
        """μ·r to both sides, m."""
        return self.friction * self.arm, self.friction * self.arm
