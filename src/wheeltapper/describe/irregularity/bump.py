"""A single irregularity of cosine shape (the paper, section 3)."""

from __future__ import annotations

from math import inf, pi
from typing import Any, ClassVar

from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Course, Harmonic, harmonic, level
from wheeltapper.describe.noun import Length, PositiveLength


class CosineBump(Irregularity):
    """y_r = h/2·(1 - cos(2π·X/length)) on 0 ≤ X ≤ length, X = x - start, and zero elsewhere.

    Parameters
    ----------
    height
        Height h, m; < 0 is a dip.
    length
        m.
    start
        Start of the irregularity, m.
    """

    example: ClassVar[dict[str, Any]] = {"height": -1e-4, "length": 0.05, "start": 0.1}
    height: Length
    length: PositiveLength
    start: Length

    def similarity(self) -> Similarity:
        """Return which fields scale or move it."""
        return {"height": "lift", "length": "rate", "start": "offset"}

    def shortest_wave(self, radius: float) -> float | None:
        """Return the length of the bump, one wave."""
        return float(self.length)

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        end = self.start + self.length
        wave = Harmonic(0.5 * self.height, 0.0, -0.5 * self.height, 2 * pi / self.length, self.start)
        return Course((level(-inf, self.start), harmonic(self.start, end, wave), level(end, inf)), abs(self.height))
