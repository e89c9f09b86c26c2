"""A wheelset on its primary suspension: the rolling body of the core model (the paper, Fig. 1a)."""

from __future__ import annotations

from pydantic import Field, model_validator

from wheeltapper.describe.noun import Acceleration, Damping, Force, Mass, Noun, PositiveLength, Stiffness


class Wheelset(Noun):
    """A wheelset of mass m under a load P, on a suspension k-c whose other end moves steadily.

    The equation of motion is m·ÿ = -P - m·g - k·y - c·ẏ + N (the paper, equation 2.3), y the displacement upwards;
    the spring is unstretched at y = 0. All values are per wheelset.

    Parameters
    ----------
    mass
        m, kg.
    load
        P, N, without the wheelset's own weight.
    stiffness
        k of the primary suspension, N/m.
    damping
        c of the primary suspension, N·s/m.
    radius
        R of the wheel, m.
    wheels
        Number of wheels that share the contact force.
    gravity
        g, m/s².
    """

    mass: Mass
    load: Force = 0.0
    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    radius: PositiveLength = 0.46
    wheels: int = Field(default=2, ge=1)
    gravity: Acceleration = 9.81

    @model_validator(mode="after")
    def _pressed_on_the_rail(self) -> Wheelset:
        if self.weight <= 0.0:
            raise ValueError(
                f"found load + mass·gravity = {self.weight:g} N; allowed: more than 0 N, to hold it on the rail"
            )
        return self

    @property
    def weight(self) -> float:
        """P + m·g in N."""
        return float(self.load + self.mass * self.gravity)
