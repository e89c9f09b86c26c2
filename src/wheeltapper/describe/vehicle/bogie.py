"""A bogie in the vertical plane: two wheelsets under a rigid frame."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from wheeltapper.describe.noun import (
    Damping,
    Inertia,
    Length,
    Mass,
    PositiveForce,
    PositiveLength,
    PositiveStiffness,
    SlidingForce,
    Stiffness,
)
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.kinks import Suspension, kinks_of
from wheeltapper.describe.vehicle.plane import FloatArray, PlaneVehicle
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.needs import BOGIE, Need


class Bogie(Vehicle):
    """Two wheelsets under a rigid frame that bounces and pitches; all numbers are those of the whole bogie.

    The primary suspension is between each wheelset and the frame, at half the wheelbase from its centre. The secondary
    suspension is between the frame's centre and a fixed point. The wheelsets are numbered from the leading one, 1, at
    x = 0; the other one is at -wheelbase. Displacements count from the static state, in which all springs carry their
    static loads.

    Parameters
    ----------
    wheelset_mass
        Mass of each wheelset, kg.
    frame_mass
        kg.
    pitch_inertia
        Moment of inertia of the frame about its centre of gravity, kg·m².
    wheelbase
        m.
    primary_stiffness, primary_damping
        Per wheelset, N/m and N·s/m.
    secondary_stiffness, secondary_damping
        N/m and N·s/m.
    primary_friction, primary_friction_stiffness, primary_bumpstop_gap, primary_rebound_gap
        Per wheelset, as the fields of :class:`~wheeltapper.Wheelset` that are called the same without "primary".
    primary_bumpstop_stiffness, primary_spring_corners, primary_blow_off_force, primary_blow_off_damping
        The same.
    secondary_friction, secondary_friction_stiffness, secondary_bumpstop_gap, secondary_rebound_gap
        The same of the secondary suspension, between the frame's centre and a fixed point.
    secondary_bumpstop_stiffness, secondary_spring_corners, secondary_blow_off_force, secondary_blow_off_damping
        The same.
    wheel_load
        Static contact force per wheelset, with all weights, N.
    radius
        Of the wheels, m.
    wheels
        Number of wheels of each wheelset: 2, half of everything on each of two equal rails; or 1, everything on one.
    """

    example: ClassVar[dict[str, Any]] = {
        "wheelset_mass": 1200.0, "frame_mass": 2600.0, "pitch_inertia": 1500.0, "wheelbase": 2.56,
        "primary_stiffness": 2.4e6, "primary_damping": 3e4, "secondary_stiffness": 8e5, "secondary_damping": 4e4,
        "wheel_load": 1e5,
    }  # fmt: skip
    wheelset_mass: Mass
    frame_mass: Mass
    pitch_inertia: Inertia
    wheelbase: PositiveLength
    primary_stiffness: Stiffness
    primary_damping: Damping
    secondary_stiffness: Stiffness = 0.0
    secondary_damping: Damping = 0.0
    wheel_load: PositiveForce
    radius: PositiveLength = 0.46
    wheels: int = Field(default=2, ge=1)
    primary_friction: SlidingForce = 0.0
    primary_friction_stiffness: PositiveStiffness | None = None
    primary_bumpstop_gap: PositiveLength | None = None
    primary_rebound_gap: PositiveLength | None = None
    primary_bumpstop_stiffness: PositiveStiffness | None = None
    primary_spring_corners: tuple[tuple[Length, Stiffness], ...] = ()
    primary_blow_off_force: PositiveForce | None = None
    primary_blow_off_damping: Damping = 0.0
    secondary_friction: SlidingForce = 0.0
    secondary_friction_stiffness: PositiveStiffness | None = None
    secondary_bumpstop_gap: PositiveLength | None = None
    secondary_rebound_gap: PositiveLength | None = None
    secondary_bumpstop_stiffness: PositiveStiffness | None = None
    secondary_spring_corners: tuple[tuple[Length, Stiffness], ...] = ()
    secondary_blow_off_force: PositiveForce | None = None
    secondary_blow_off_damping: Damping = 0.0

    @model_validator(mode="after")
    def _kinks_of_the_suspensions(self) -> Bogie:
        frame = min(float(self.frame_mass), float(self.pitch_inertia) / (0.5 * float(self.wheelbase)) ** 2)
        kinks_of(self, "primary_").check(
            min(float(self.wheelset_mass), frame), self.primary_stiffness, self.primary_damping
        )
        kinks_of(self, "secondary_").check(self.frame_mass, self.secondary_stiffness, self.secondary_damping)
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: the bogie, and what is not linear in its suspensions."""
        return frozenset({BOGIE}) | kinks_of(self, "primary_").needs | kinks_of(self, "secondary_").needs

    @property
    def positions(self) -> tuple[float, ...]:
        """The x of each wheelset from the leading one, m."""
        return 0.0, -self.wheelbase

    @property
    def loads(self) -> dict[str, float]:
        """The loads that its wheelsets carry, N, by the path of the field that states each."""
        return {"wheel_load": float(self.wheel_load)}

    @property
    def suspensions(self) -> tuple[Suspension, ...]:
        """The primary and the secondary suspension."""
        return (
            Suspension("primary", self, "primary_", float(self.primary_stiffness), float(self.primary_damping)),
            Suspension("secondary", self, "secondary_", float(self.secondary_stiffness), float(self.secondary_damping)),
        )

    @property
    def words(self) -> str:
        """The bogie in words."""
        static = f"static force {float(self.wheel_load) / 1e3:.4g} kN per wheelset"
        masses = f"wheelsets of {self.wheelset_mass:g} kg, frame of {self.frame_mass:g} kg"
        return f"bogie, wheelbase {self.wheelbase:g} m: {masses}, {static}"

    @property
    def plane(self) -> PlaneVehicle:
        """The bogie as matrices, for a track that deforms; a positive pitch lifts the front of the frame."""
        half = 0.5 * float(self.wheelbase)
        primary = np.array([[1.0, 0.0, -1.0, -half], [0.0, 1.0, -1.0, half]])
        secondary = np.array([0.0, 0.0, 1.0, 0.0])

        def joined(first: float, second: float) -> FloatArray:
            return np.asarray(first * primary.T @ primary + second * np.outer(secondary, secondary))

        mass = np.diag([float(self.wheelset_mass)] * 2 + [float(self.frame_mass), float(self.pitch_inertia)])
        damping = joined(self.primary_damping, self.secondary_damping)
        stiffness = joined(self.primary_stiffness, self.secondary_stiffness)
        alone = Wheelset(
            mass=self.wheelset_mass, load=self.wheel_load, gravity=0.0, radius=self.radius, wheels=self.wheels
        )
        names = ("wheelset 1", "wheelset 2", "frame", "frame pitch")
        elements = [
            element
            for prefix, name, row in (
                ("primary_", "primary {} 1", primary[0]), ("primary_", "primary {} 2", primary[1]),
                ("secondary_", "secondary {}", secondary),
            )
            for element in kinks_of(self, prefix).elements(
                name, row, getattr(self, prefix + "stiffness"), getattr(self, prefix + "damping")
            )
        ]  # fmt: skip
        return PlaneVehicle(
            names, mass, damping, stiffness, self.positions, (alone, alone), tuple(elements), np.zeros(2)
        )
