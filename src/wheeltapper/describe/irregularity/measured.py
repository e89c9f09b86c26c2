"""A measured profile of the rail."""

from __future__ import annotations

from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from wheeltapper.describe.irregularity import samples, spline
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Polynomials, level
from wheeltapper.describe.noun import Length, PositiveLength, check_idle
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]


class Measured(Irregularity):
    """The height of the rail from samples, joined by a spline.

    Before the first sample the rail is level at the first height, so that there is no jump. `beyond` says what lies
    behind the last sample. Without noise the spline is cubic and passes through every sample.

    Parameters
    ----------
    path
        Text file with columns position and height, in m or with units in the header. It is read when it is first
        needed; a new object reads it again.
    positions, heights
        The samples themselves, m, instead of a file.
    columns
        Names or numbers (from 0) of the two columns, if the file has more.
    start
        Position of the first sample, m; by default that in the file.
    beyond
        "flat": level at the last height. "repeat": repeated without end; the last height must equal the first. None:
        the run must end before the samples do.
    noise
        Standard deviation of the noise of the heights, m. A smoothing spline is then used, whose rms distance from the
        samples equals it.
    allow_gaps
        Whether the spline may bridge a gap (20 times the median spacing).
    """

    example: ClassVar[dict[str, Any]] = {
        "positions": (0.0, 0.08, 0.15, 0.24, 0.32, 0.4, 0.5),
        "heights": (0.0, 1e-4, 2e-5, 1e-4, 0.0, 1e-4, 3e-5),
        "beyond": "flat",
    }
    path: Path | None = None
    positions: tuple[float, ...] | None = None
    heights: tuple[float, ...] | None = None
    columns: tuple[str | int, str | int] | None = None
    start: Length | None = None
    beyond: Literal["flat", "repeat"] | None = None
    noise: PositiveLength | None = None
    allow_gaps: bool = False

    @model_validator(mode="after")
    def _one_source(self) -> Measured:
        arrays = self.positions is not None and self.heights is not None
        if (self.path is not None) == arrays or (self.positions is None) != (self.heights is None):
            raise InputError(
                "", "", "neither or both of path and positions with heights", "a path, or positions and heights"
            )
        if self.path is None:
            check_idle(self, ("columns",), "without a path")
        return self

    @cached_property
    def samples(self) -> tuple[FloatArray, FloatArray]:
        """Checked positions and heights in m."""
        given = self.positions, self.heights
        x, y = samples.checked_columns(self.path, self.columns, given, allow_gaps=self.allow_gaps)
        return (x if self.start is None else x - x[0] + self.start), y

    @cached_property
    def form(self) -> Polynomials:
        """The spline through the samples, or near them."""
        x, y = self.samples
        return spline.smoothing_spline(x, y, self.noise) if self.noise else spline.interpolating_spline(x, y)

    def moved(self, distance: float) -> Measured:
        """Return the same measurement farther along the rail (m)."""
        given = {name: getattr(self, name) for name in type(self).model_fields}  # a copy would keep the old samples
        return Measured(**given | {"start": float(self.samples[0][0]) + distance})

    def _with_data(self) -> Measured:
        """Return the same with the samples in place of the file."""
        if self.path is None:
            return self
        x, y = (tuple(column.tolist()) for column in self.samples)
        return self.model_copy(update={"path": None, "columns": None, "start": None, "positions": x, "heights": y})

    def span_given(self, end: float) -> float:
        """Return the span of the samples' heights."""
        return float(np.ptp(self.samples[1]))

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        _, y = self.samples
        form = self.form
        part = spline.spline_stretch(form)
        ends = form.derivative(form.breaks[[0, -1]], 0)
        height = float(np.ptp(y)) or 1e-9
        parts = (level(-inf, part.start, float(ends[0])), part, level(part.end, inf, float(ends[1])))
        if self.beyond == "repeat":
            return Course(parts, height, part.end - part.start, part.start)
        return Course(parts, height)

    def check_run(self, end: float) -> None:
        """Refuse a run to x = end behind the last sample, unless `beyond` says what lies there."""
        last = float(self.samples[0][-1])
        if self.beyond is None and end > last:
            raise InputError(
                "", "", f"samples up to {last:.6g} m for a run to {end:.6g} m",
                'a run within the samples, or what lies beyond them: beyond = "flat" or "repeat"',
            )  # fmt: skip
