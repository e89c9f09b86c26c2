"""The common part of creep laws: the coefficient of friction, and the model of the wheelsets' spin."""

from __future__ import annotations

from typing import ClassVar, Literal

from wheeltapper.describe.noun import Friction, Noun


class CreepLaw(Noun):
    """Tangential forces of rolling contacts, from creepages and spin.

    Parameters
    ----------
    friction
        μ.
    wheel_spin
        "quasi-static": each wheelset rotates so that the longitudinal forces of its two treads have no moment about the
        axle. This is fast; normal and lateral forces agree with those of the full spin within 1e-4, longitudinal ones
        do not. "full": the spin has an equation of motion.
    """

    spin_range: ClassVar[float | None] = None
    """Largest ratio of the linear spin force alone to the friction limit for which the law holds; None: any."""
    friction: Friction = 0.4
    wheel_spin: Literal["quasi-static", "full"] = "quasi-static"
