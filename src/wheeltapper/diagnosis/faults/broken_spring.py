"""A broken primary spring."""

from __future__ import annotations

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import LOAD, MASS, Fault
from wheeltapper.diagnosis.inference.problem import Prior

ADDED_MASS = 670.0
"""Mass of the bogie, kg, that moves with the wheelset after a primary spring has become a rigid link."""


class BrokenSpring(Fault):
    """A primary spring that has become a rigid link."""

    name, part, rank = "broken spring", "suspension", 10.0
    meaning = "a primary spring is broken and has become a rigid link: part of the bogie bounces with the wheelset"
    size, unit, usual, path = "added mass", "kg", ADDED_MASS, MASS
    acts, assessed, far = "plain", True, True

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the passage with more unsprung mass, whose weight the spring no longer carries."""
        vehicle = passage.vehicle
        return passage.replaced({MASS: vehicle.mass + size, LOAD: vehicle.load - size * vehicle.gravity})

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the prior of the mass."""
        return {MASS: Prior(passage.vehicle.mass + ADDED_MASS, 0.03, "lognormal")}

    def size_of(self, value: float, healthy: float) -> float:
        """Return the added mass."""
        return value - healthy
