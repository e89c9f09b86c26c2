"""Faults that scale one field of the vehicle."""

from __future__ import annotations

from typing import ClassVar

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import Fault
from wheeltapper.diagnosis.inference.problem import Prior


class Scaled(Fault, abstract=True):
    """A plain fault whose size is the value of a field over the healthy one's.

    Attributes
    ----------
    centre, deviation
        Centre of the lognormal prior of the size, and standard deviation of its logarithm.
    """

    acts = "plain"
    centre: ClassVar[float] = 1.0
    deviation: ClassVar[float]

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the passage with the scaled field."""
        return passage.replaced({self.path: size * self._held(passage)})

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the prior of the field."""
        return {self.path: Prior(self.centre * self._held(passage), self.deviation, "lognormal")}

    def size_of(self, value: float, healthy: float) -> float:
        """Return the ratio of the values."""
        return value / healthy

    def _held(self, passage: Scenario) -> float:
        return float(getattr(passage.vehicle, self.path.rpartition(".")[2]))
