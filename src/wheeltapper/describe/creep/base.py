"""What all creep laws share: the coefficient of friction, and how the wheelsets' spin follows."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from wheeltapper.describe.noun import Friction, Noun
from wheeltapper.ground.needs import CREEP, Need


class CreepLaw(Noun, abstract=True):
    """Tangential forces of rolling contacts, from creepages and spin.

    Parameters
    ----------
    friction
        μ.
    wheel_spin
        "quasi-static": each wheelset turns so that the longitudinal forces of its two treads have no moment about the
        axle (fast; normal and lateral forces are those of the full spin within 1e-4, longitudinal ones are not);
        "full": with its own equation of motion.
    """

    example: ClassVar[dict[str, Any]] = {}
    """Fields of one of them; the conformance tests try it."""
    spin_range: ClassVar[float | None] = None
    """So much of the friction limit may the linear spin force by itself use, for the law to hold; None: any."""
    friction: Friction = 0.4
    wheel_spin: Literal["quasi-static", "full"] = "quasi-static"

    @property
    def needs(self) -> frozenset[Need]:
        """Tangential forces."""
        return frozenset({CREEP})
