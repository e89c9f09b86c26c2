"""A dipped rail joint: two bent rail ends that meet at an angle."""

from __future__ import annotations

from math import inf
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Course, Polynomials, level
from wheeltapper.describe.irregularity.spline import spline_stretch
from wheeltapper.describe.noun import Length, PositiveAngle, PositiveLength
from wheeltapper.ground.errors import InputError


class DippedJoint(Irregularity):
    """y_r = -depth·(1 - 2·|X|/length)² for |X| < length/2, X = x - position, and zero elsewhere.

    Two parabolas, each of which joins the level rail without a kink. They meet at the angle 2α = 8·depth/length, the
    total change of slope that turns the wheel upwards (Jenkins et al., *Railway Engineering Journal* 3 (1974) 2-16).

    Parameters
    ----------
    depth, angle
        Depth of the middle, m, or the total change of slope 2α, rad: one of them.
    length
        Length of both dipped ends together, m.
    position
        Position of the joint, m.
    """

    example: ClassVar[dict[str, Any]] = {"depth": 2e-4, "length": 0.2, "position": 0.2}
    depth: PositiveLength | None = None
    angle: PositiveAngle | None = None
    length: PositiveLength
    position: Length

    @model_validator(mode="after")
    def _one_size(self) -> DippedJoint:
        if (self.depth is None) == (self.angle is None):
            found = "neither depth nor angle" if self.depth is None else "both depth and angle"
            raise InputError("", "", found, "one of them, since angle = 8·depth/length")
        return self

    @property
    def lowest(self) -> float:
        """The depth of the middle, m."""
        return float(self.angle * self.length / 8.0 if self.depth is None else self.depth)

    @property
    def shortest_run(self) -> float:
        """Length of the joint, m."""
        return float(self.length)

    def similarity(self) -> Similarity:
        """Return which fields scale or move it; at a given angle, a longer joint is also deeper."""
        if self.depth is None:
            return {"angle": "lift", "position": "offset"}
        return {"depth": "lift", "length": "rate", "position": "offset"}

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        depth, half = self.lowest, 0.5 * self.length
        start, middle, end = self.position - half, self.position, self.position + half
        bend = -depth / half**2
        falling = Polynomials(np.array([start, middle]), np.array([[0.0, 0.0, bend]]))
        rising = Polynomials(np.array([middle, end]), np.array([[-depth, 2.0 * depth / half, bend]]))
        ends = spline_stretch(falling), spline_stretch(rising)
        return Course((level(-inf, start), *ends, level(end, inf)), depth)
