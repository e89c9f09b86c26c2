"""A soft bush at the end of a damper."""

from __future__ import annotations

from math import pi
from typing import ClassVar

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import DAMPING, MASS, Fault
from wheeltapper.diagnosis.inference.problem import Prior
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.lower.fields import Fields

BUSH = "vehicle.bush_stiffness"
CORNERS = (0.0177, 0.0707, 0.283, 1.06)
"""Frequencies k/(2π·c) up to which the damper acts that are tried, times the contact period: above the last one the
bush is too stiff to be felt while the wheel bounces, below the first one the damper is lost."""

LOST, SOFT = 0.1, (0.0125, 0.025, 0.05, 0.1)
"""Share of the healthy damping below which a damper seems lost, and frequencies, as above, of bushes that make it seem
so."""


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

    def mistaken(self, healthy: Scenario, found: Scenario) -> list[Scenario]:
        """Return passages with bushes so soft that the damper seems lost."""
        if float(found.vehicle.damping) > LOST * float(healthy.vehicle.damping):
            return []
        model = found.replaced({path: float(Fields(healthy)(path)) for path in (MASS, DAMPING)})
        return self._with_corners(model, Scale(healthy), SOFT)

    def tried(self, model: Scenario, scale: Scale) -> list[Scenario]:
        """Return passages with several stiffnesses."""
        return self._with_corners(model, scale, CORNERS)

    def _with_corners(self, model: Scenario, scale: Scale, corners: tuple[float, ...]) -> list[Scenario]:
        unit = 2.0 * pi * float(scale.passage.vehicle.damping) / scale.period
        return [self.made(model, corner * unit, 0.5) for corner in corners if unit > 0.0]
