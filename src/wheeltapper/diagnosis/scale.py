"""The scale of a passage: the times and lengths of its own in which the constants of the diagnosis are stated.

period   A wheel on its contact, linearised at the static load: T = 2π·√(m/k), k = dN/dδ; 5.56 ms at the example's site.
         Impacts last about half of it, and the trains of impacts that a diagnosis reads are made of it.
indentation
         Of the wheel at rest on its contact; 83 um at the example's site.
height   The highest irregularity of the site: so far the wheel is thrown, and so far the end of its damper moves.
radius   Of the wheel, which alone says how a flat of some length lies on a rail.

See docs/theory/diagnosis.rst, section 8.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi, sqrt

from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.build import courses_of
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.numbers import static_stiffness, units_of


@dataclass(frozen=True)
class Scale:
    """The scale of a passage, usually that of the site's healthy wheelset as stated."""

    passage: Scenario

    @cached_property
    def period(self) -> float:
        """Period of the wheel on its contact, s."""
        return 2.0 * pi * sqrt(float(self.passage.vehicle.mass) / static_stiffness(Fields(self.passage)).item())

    @cached_property
    def indentation(self) -> float:
        """Indentation of the contact under the static load, m."""
        return float(units_of(Fields(self.passage)).length.item())

    @cached_property
    def height(self) -> float:
        """Height of the highest irregularity, m; zero on a level rail."""
        return max((course.height for course in courses_of(self.passage)), default=0.0)

    @property
    def radius(self) -> float:
        """Radius of the wheel, m."""
        return float(self.passage.vehicle.radius)
