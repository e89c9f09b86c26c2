"""The common part of creep laws: the coefficient of friction, and the model of the wheelsets' spin."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from wheeltapper.describe.noun import Friction, Noun
from wheeltapper.ground.needs import CREEP, Need


class CreepLaw(Noun, abstract=True):
    """Tangential forces of rolling contacts, from creepages and spin.

    Parameters
    ----------
    friction
        Coefficient of friction μ.
    wheel_spin
        "quasi-static": each wheelset rotates so that the longitudinal forces of its two treads have no moment about the
        axle. This is fast; normal and lateral forces agree with those of the full spin within 1e-4, longitudinal ones
        do not. "full": the spin has an equation of motion.
    """

    example: ClassVar[dict[str, Any]] = {}
    """Fields of an example, which the conformance tests make."""
    spin_range: ClassVar[float | None] = None
    """Largest ratio of the linear force of spin alone to the friction limit for which the law holds; None: any."""
    friction: Friction = 0.4
    wheel_spin: Literal["quasi-static", "full"] = "quasi-static"

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: tangential forces."""
        return frozenset({CREEP})
