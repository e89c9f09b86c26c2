"""A bogie in the vertical plane: two wheelsets under a rigid frame."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from wheeltapper.describe.noun import Damping, Inertia, Mass, PositiveForce, PositiveLength, Stiffness
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.ground.needs import BOGIE, Need


class Bogie(Vehicle):
    """Two wheelsets under a rigid frame that bounces and pitches; all numbers are those of the whole bogie.

    The primary suspension is between each wheelset and the frame, at half the wheelbase from its centre. The secondary
    suspension is between the frame's centre and a fixed point. The wheelsets are numbered from the leading one, 1, at
    x = 0; the other one is at -wheelbase. Displacements count from the static state, in which all springs carry what
    they have to.

    Parameters
    ----------
    wheelset_mass
        Of each wheelset, kg.
    frame_mass
        kg.
    pitch_inertia
        Of the frame about its centre of gravity, kg·m².
    wheelbase
        m.
    primary_stiffness, primary_damping
        Per wheelset, N/m and N·s/m.
    secondary_stiffness, secondary_damping
        N/m and N·s/m.
    wheel_load
        Static contact force per wheelset, with all weights, N.
    radius
        Of the wheels, m.
    wheels
        Of each wheelset: 2, half of everything on each of two equal rails; or 1, everything on one.
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

    @property
    def needs(self) -> frozenset[Need]:
        """The bogie."""
        return frozenset({BOGIE})

    @property
    def positions(self) -> tuple[float, ...]:
        """The x of each wheelset from the leading one, m."""
        return 0.0, -self.wheelbase
