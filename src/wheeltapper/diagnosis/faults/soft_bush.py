"""A soft bush at the end of a damper."""

from __future__ import annotations

from typing import ClassVar

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import Fault
from wheeltapper.diagnosis.inference.problem import Prior

BUSH = "vehicle.bush_stiffness"
BUSHES = (1e6, 4e6, 1.6e7, 6e7)
"""Stiffnesses of a bush that are tried, N/m."""


class SoftBush(Fault):
    """A damper in series with a bush."""

    name, part, rank = "soft bush", "damper", 70.0
    meaning = "the damper acts through a soft bush, only below some frequency"
    size, unit, usual, path = "stiffness of the bush", "N/m", 1e7, BUSH
    fields: ClassVar[dict[str, tuple[str, str, float]]] = {BUSH: ("bush", "kN/mm", 1e-6)}

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the passage with the bush."""
        return passage.replaced({BUSH: size})

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the prior of the stiffness."""
        return {BUSH: Prior(1e7, 1.2, "lognormal")}

    def tried(self, model: Scenario) -> list[Scenario]:
        """Return passages with several stiffnesses."""
        return [self.made(model, bush, 0.5) for bush in BUSHES]
