"""Corrugation: a sinusoidal irregularity that begins with a corner (the paper, section 5)."""

from __future__ import annotations

from math import inf, pi, sin
from typing import Any, ClassVar

from pydantic import model_validator

from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Course, Harmonic, harmonic, level
from wheeltapper.describe.noun import Length, PositiveLength
from wheeltapper.ground.errors import InputError


class Corrugation(Irregularity):
    """y_r = +a·sin(2π·X/wavelength) for X = x - start ≥ 0, and zero before.

    Parameters
    ----------
    amplitude
        Amplitude a, m; in the paper it is negative, so that the rail falls first.
    wavelength
        m.
    start
        Position of the start, m; the corner there is exact.
    end
        Position of the end, m; behind it the rail is level at the height reached. None: without end.
    """

    example: ClassVar[dict[str, Any]] = {"amplitude": 5e-5, "wavelength": 0.05, "start": 0.1}
    amplitude: Length
    wavelength: PositiveLength
    start: Length
    end: Length | None = None

    @model_validator(mode="after")
    def _ends_behind_its_start(self) -> Corrugation:
        if self.end is not None and self.end <= self.start:
            raise InputError("", "", f"end {self.end:g} m", f"more than start {self.start:g} m")
        return self

    def similarity(self) -> Similarity:
        """Return which fields scale or move it; a corrugation with a given end is not a scaled copy of another."""
        if self.end is None:
            return {"amplitude": "lift", "wavelength": "rate", "start": "offset"}
        return {"amplitude": "lift"}

    def shortest_wave(self, radius: float) -> float | None:
        """Return the wavelength."""
        return float(self.wavelength)

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        k = 2 * pi / self.wavelength
        wave = Harmonic(0.0, self.amplitude, 0.0, k, self.start)
        if self.end is None:
            return Course(
                (level(-inf, self.start), harmonic(self.start, inf, wave)),
                abs(self.amplitude),
                self.wavelength,
                self.start,
            )
        rest = self.amplitude * sin(k * (self.end - self.start))
        stretches = (level(-inf, self.start), harmonic(self.start, self.end, wave), level(self.end, inf, rest))
        return Course(stretches, abs(self.amplitude))
