"""A weld of the rail: a cosine, or a shape measured with a straightedge."""

from __future__ import annotations

from functools import cached_property
from math import inf, pi
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from wheeltapper.describe.irregularity import samples, spline
from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Course, Harmonic, Polynomials, harmonic, level
from wheeltapper.describe.noun import Length, PositiveLength, check_idle
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]


class Weld(Irregularity):
    """y_r = height/2·(1 + cos(2π·X/length)) for |X| ≤ length/2, X = x - position; or a measured shape.

    A measured shape is a spline through samples. Its heights count from the straight line through the first and the
    last sample, as a straightedge there shows them. Its middle is at `position`; before and behind it the rail is level
    at zero.

    Parameters
    ----------
    height
        Height of the middle, m; < 0 is a dip.
    length
        m.
    position
        Position of the middle, m.
    path
        Instead of height and length: text file with columns position and height, in m or with units in the header.
    positions, heights
        The samples themselves, m, instead of a file.
    columns
        Names or numbers (from 0) of the two columns, if the file has more.
    noise
        Standard deviation of the noise of the samples, m.
    turned
        True: the measured shape is turned upside down, so that a peak becomes a dip.
    """

    example: ClassVar[dict[str, Any]] = {"height": -2e-4, "length": 0.1, "position": 0.2}
    height: Length | None = None
    length: PositiveLength | None = None
    position: Length
    path: Path | None = None
    positions: tuple[Length, ...] | None = None
    heights: tuple[Length, ...] | None = None
    columns: tuple[str | int, str | int] | None = None
    noise: PositiveLength | None = None
    turned: bool = False

    @model_validator(mode="after")
    def _one_shape(self) -> Weld:
        pairs = {"height and length": ("height", "length"), "positions and heights": ("positions", "heights")}
        given = [names for names, fields in pairs.items() if all(getattr(self, name) is not None for name in fields)]
        given += ["path"] if self.path is not None else []
        parts = sum(getattr(self, name) is not None for fields in pairs.values() for name in fields)
        if len(given) != 1 or parts != 2 * (self.path is None):
            found = "more than " + given[0] if given else "no whole shape"
            raise InputError("", "", found, f"one of: {', '.join(pairs)}, path")
        if given == ["height and length"]:
            check_idle(self, ("columns", "noise", "turned"), "beside height and length")
        elif self.path is None:
            check_idle(self, ("columns",), "without a path")
        return self

    @cached_property
    def samples(self) -> tuple[FloatArray, FloatArray]:
        """Checked places from the middle of the samples, and heights over the line through their ends, m."""
        x, y = samples.checked_columns(self.path, self.columns, (self.positions, self.heights), allow_gaps=False)
        x = x - 0.5 * (x[0] + x[-1])
        over = y - np.interp(x, x[[0, -1]], y[[0, -1]])
        return x, -over if self.turned else over

    @cached_property
    def form(self) -> Polynomials:
        """The spline through the samples, or near them, about the middle."""
        x, y = self.samples
        return spline.smoothing_spline(x, y, self.noise) if self.noise else spline.interpolating_spline(x, y)

    @property
    def shortest_run(self) -> float:
        """Length of the weld, m."""
        return float(np.ptp(self.samples[0])) if self.length is None else float(self.length)

    def similarity(self) -> Similarity:
        """Return which fields scale or move it."""
        if self.height is None:
            return {"position": "offset"}
        return {"height": "lift", "length": "rate", "position": "offset"}

    def shortest_wave(self, radius: float) -> float | None:
        """Return the length of a cosine, one wave; for a measured shape it is not known."""
        return None if self.length is None else float(self.length)

    def span_given(self, end: float) -> float | None:
        """Return the span of the samples' heights."""
        return None if self.height is not None else float(np.ptp(self.samples[1]))

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        if self.height is not None and self.length is not None:
            start, end = self.position - 0.5 * self.length, self.position + 0.5 * self.length
            half = 0.5 * self.height
            wave = Harmonic(half, 0.0, half, 2 * pi / self.length, self.position)
            return Course((level(-inf, start), harmonic(start, end, wave), level(end, inf)), abs(self.height))
        part = spline.spline_stretch(self.form.moved(self.position))
        ends = self.form.derivative(self.form.breaks[[0, -1]], 0)
        parts = (level(-inf, part.start, float(ends[0])), part, level(part.end, inf, float(ends[1])))
        return Course(parts, float(np.ptp(self.samples[1])) or 1e-9)
