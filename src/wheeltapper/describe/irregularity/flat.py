"""A wheel flat, fresh or rounded."""

from __future__ import annotations

from math import inf, pi, sqrt
from typing import Any, ClassVar, Literal

from pydantic import model_validator

from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Chord, Course, Harmonic, Stretch, chord, harmonic, level
from wheeltapper.describe.noun import Length, PositiveLength
from wheeltapper.ground.errors import InputError


class WheelFlat(Irregularity):
    """A flat on the wheel: a chord of sagitta d (fresh), or a haversine after wear (rounded).

    Fresh: at the angle φ the radius is smaller by R - (R - d)/cos φ; half-length L = sqrt(2·R·d - d²), d ≈ l²/(8·R).
    Rounded: (d/2)·(1 + cos(2π·X/l)) for |X| < l/2, d = l²/(16·R) unless both are given.

    Parameters
    ----------
    depth, length
        Depth d and length l, m: one of them (both only for a rounded flat).
    position
        Position at which its middle first meets the rail, m.
    repeat
        Whether it meets the rail at every revolution, 2π·R.
    shape
        "fresh" or "rounded".
    """

    borne: ClassVar[Literal["rail", "wheel"]] = "wheel"
    example: ClassVar[dict[str, Any]] = {"depth": 1e-4, "position": 0.3}
    depth: PositiveLength | None = None
    length: PositiveLength | None = None
    position: Length
    repeat: bool = True
    shape: Literal["fresh", "rounded"] = "fresh"

    @model_validator(mode="after")
    def _one_size(self) -> WheelFlat:
        if self.depth is None and self.length is None:
            raise InputError("", "", "neither depth nor length", "one of them")
        if self.depth is not None and self.length is not None and self.shape == "fresh":
            raise InputError(
                "", "", "both depth and length", "one of them, since a chord's depth follows from its length"
            )
        return self

    def size(self, radius: float) -> tuple[float, float]:
        """Return depth and length in m on a wheel of this radius (m)."""
        if self.shape == "rounded":
            length = self.length if self.length is not None else 4.0 * sqrt(radius * (self.depth or 0.0))
            return self.depth if self.depth is not None else length**2 / (16.0 * radius), length
        half = 0.5 * (self.length or 0.0)
        if not half < radius or not (self.depth or 0.0) < radius:
            name, value = ("length", self.length) if self.depth is None else ("depth", self.depth)
            allowed = f"less than {2.0 * radius if self.depth is None else radius:g} m, for a chord of the wheel"
            raise InputError("", name, f"{value:g} m on a wheel of the radius {radius:g} m", allowed)
        if self.depth is not None:
            return self.depth, 2.0 * sqrt(2.0 * radius * self.depth - self.depth**2)
        return half**2 / (radius + sqrt(radius**2 - half**2)), 2.0 * half

    def limited(self, radius: float) -> dict[str, float]:
        """Return the flat's length, m."""
        return {"flat_length": self.size(radius)[1]}

    def similarity(self) -> Similarity:
        """Return which fields scale or move it."""
        return {"position": "offset"}

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        depth, length = self.size(radius)
        start, end = self.position - 0.5 * length, self.position + 0.5 * length
        middle = chord(Chord(start, end, radius)) if self.shape == "fresh" else _haversine(start, end, depth)
        if not self.repeat:
            return Course((level(-inf, start), middle, level(end, inf)), depth)
        turn = 2.0 * pi * radius
        stretches = (level(-inf, start), middle, level(end, inf))
        return Course(stretches, depth, turn, self.position - 0.5 * turn)


def _haversine(start: float, end: float, depth: float) -> Stretch:
    return harmonic(start, end, Harmonic(-0.5 * depth, 0.0, 0.5 * depth, 2 * pi / (end - start), start))
