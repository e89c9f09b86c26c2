"""A step of the rail."""

from __future__ import annotations

from math import inf
from typing import Any, ClassVar

from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Course, level
from wheeltapper.describe.noun import Length


class Step(Irregularity):
    """A sudden change of the rail's height: y_r = 0 for x < position, height for x ≥ position (the paper, Fig. 4).

    The centre of a wheel that rolls as a circle follows an arc of length sqrt(2·R·h - h²): before a step up, behind a
    step down.

    Parameters
    ----------
    height
        m; > 0 up, < 0 down.
    position
        Position of the corner, m.
    ideal
        True: the wheel's centre jumps with the rail (the limit R → 0), however the wheel rolls.
    """

    example: ClassVar[dict[str, Any]] = {"height": 1e-4, "position": 0.1}
    height: Length
    position: Length
    ideal: bool = False

    def similarity(self) -> Similarity:
        """Return which fields scale or move it."""
        return {"height": "lift", "position": "offset"}

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        levels = (level(-inf, self.position), level(self.position, inf, self.height))
        return Course(levels, abs(self.height), followed=self.ideal)
