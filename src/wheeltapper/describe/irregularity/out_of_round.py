"""A wheel that is out of round."""

from __future__ import annotations

from functools import cached_property
from math import cos, inf, pi, sin
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from wheeltapper.describe.irregularity import samples, spline
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Harmonic, Polynomials, Stretch, harmonic, level
from wheeltapper.describe.noun import Angle, Length, PositiveLength, check_idle
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]


class OutOfRound(Irregularity):
    """The radius deviation of a wheel over its circumference, periodic in 2π·R.

    It is given by harmonics, Δr = Σ amplitude·cos(order·θ + phase) with θ = (x - position)/R, or by measured samples
    over the angle (rad, deg) or the arc (m). Samples form a closed ring; a last one that repeats the first is left out.

    Parameters
    ----------
    orders, amplitudes, phases
        Harmonics of the circumference; amplitudes in m, phases in rad (zero by default).
    path
        Text file with columns angle or arc, and deviation (missing material negative). It is read when it is first
        needed; a new object reads it again.
    places, deviations
        The samples themselves instead of a file: arcs in m or angles in rad, and deviations in m.
    columns
        Names or numbers (from 0) of the two columns, if the file has more.
    over
        Kind of the first column: "arc" in m or "angle" in rad (after conversion from the unit in the header).
    noise
        Standard deviation of the samples' noise, m.
    position
        Position at which the point of the wheel at angle zero meets the rail, m.
    """

    borne: ClassVar[Literal["rail", "wheel"]] = "wheel"
    example: ClassVar[dict[str, Any]] = {"orders": (1, 5), "amplitudes": (1e-4, 2e-5), "phases": (0.3, 0.1)}
    orders: tuple[int, ...] = ()
    amplitudes: tuple[Length, ...] = ()
    phases: tuple[Angle, ...] | None = None
    path: Path | None = None
    places: tuple[float, ...] | None = None
    deviations: tuple[float, ...] | None = None
    columns: tuple[str | int, str | int] | None = None
    over: Literal["arc", "angle"] = "arc"
    noise: PositiveLength | None = None
    position: Length = 0.0

    @model_validator(mode="after")
    def _one_source(self) -> OutOfRound:
        if (self.places is None) != (self.deviations is None):
            raise InputError("", "", "one of places and deviations", "both, or neither")
        given = [bool(self.orders), self.path is not None, self.places is not None]
        if sum(given) != 1:
            raise InputError("", "", f"{sum(given)} of orders, path, and places with deviations", "one of them")
        if len(self.orders) != len(self.amplitudes):
            raise InputError("", "", f"{len(self.amplitudes)} amplitudes for {len(self.orders)} orders", "one for each")
        if self.phases is not None and len(self.phases) != len(self.orders):
            raise InputError("", "", f"{len(self.phases)} phases for {len(self.orders)} orders", "one for each")
        if any(order < 1 for order in self.orders):
            raise InputError("", "", f"orders {self.orders}", "1, 2, 3 …")
        if self.orders:
            check_idle(self, ("columns", "over", "noise"), "beside orders")
        elif self.path is None:
            check_idle(self, ("columns",), "without a path")
        return self

    @cached_property
    def samples(self) -> tuple[FloatArray, FloatArray]:
        """Checked arc or angle, and deviation in m."""
        place = "angle" if self.over == "angle" else "length"
        return samples.checked_columns(
            self.path, self.columns, (self.places, self.deviations), place=place, allow_gaps=True
        )

    @cached_property
    def forms(self) -> dict[float, Polynomials]:
        """The spline near the samples, for each radius in use."""
        return {}

    def _with_data(self) -> OutOfRound:
        """Return the same with the samples in place of the file."""
        if self.path is None:
            return self
        x, y = (tuple(column.tolist()) for column in self.samples)
        return self.model_copy(update={"path": None, "columns": None, "places": x, "deviations": y})

    def shortest_wave(self, radius: float) -> float | None:
        """Return the wave of the highest order; for measured deviations the shortest wave is not known."""
        return 2.0 * pi * radius / max(self.orders) if self.orders else None

    def span_given(self, end: float) -> float | None:
        """Return the span of the samples' deviations."""
        return None if self.orders else float(np.ptp(self.samples[1]))

    def limited(self, radius: float) -> dict[str, float]:
        """Return the largest less the smallest radius, m."""
        if not self.orders:
            return {"out_of_roundness": float(np.ptp(self.samples[1]))}
        arc = np.linspace(0.0, 2.0 * pi * radius, 200 * max(self.orders), endpoint=False)
        return {"out_of_roundness": float(np.ptp(self._harmonic_sum(radius, 0)(arc)))}

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        turn = 2.0 * pi * radius
        if not self.orders:
            return self._measured_course(radius, turn)
        if len(self.orders) == 1:
            order, amplitude, phase = self.orders[0], self.amplitudes[0], (self.phases or (0.0,))[0]
            form = Harmonic(0.0, -amplitude * sin(phase), amplitude * cos(phase), order / radius, self.position)
            return Course((harmonic(-inf, inf, form),), abs(amplitude), turn / order)
        parts = Stretch(
            -inf, inf, self._harmonic_sum(radius, 0), self._harmonic_sum(radius, 1), self._harmonic_sum(radius, 2)
        )
        return Course((parts,), sum(abs(a) for a in self.amplitudes), turn)

    def _harmonic_sum(self, radius: float, derivative: int) -> Any:
        phases = self.phases or (0.0,) * len(self.orders)

        def summed_at(x: NDArray[Any]) -> NDArray[Any]:
            out = np.zeros_like(np.asarray(x), dtype=np.result_type(x, float))
            for order, amplitude, phase in zip(self.orders, self.amplitudes, phases, strict=True):
                k = order / radius
                argument = k * (x - self.position) + phase + 0.5 * pi * derivative
                out = out + amplitude * k**derivative * np.cos(argument)
            return out

        return summed_at

    def _open_ring(self, turn: float) -> tuple[FloatArray, FloatArray]:
        """Return the samples without a last one that is the first again, as measuring machines write it."""
        x, y = self.samples
        beyond, apart = x[-1] - x[0] - turn, float(np.median(np.diff(x)))
        if beyond > 0.5 * apart:
            found = f"samples over {x[-1] - x[0]:.6g} {self._unit}"
            raise InputError("", "irregularity", found, f"at most one revolution, {turn:.6g} {self._unit}")
        if beyond < -0.5 * apart:
            return x, y
        gap, allowed = abs(y[-1] - y[0]), max(6.0 * (self.noise or 0.0), float(np.abs(np.diff(y)).max()))
        if gap > allowed:
            found = f"samples that end after one revolution {gap:.3g} m beside where they began"
            raise InputError("", "irregularity", found, f"the first sample again, within {allowed:.3g} m")
        return x[:-1], y[:-1]

    @property
    def _unit(self) -> str:
        return "rad" if self.over == "angle" else "m"

    def _measured_course(self, radius: float, turn: float) -> Course:
        arc, y = self._open_ring(turn / radius if self.over == "angle" else turn)
        arc = arc * radius if self.over == "angle" else arc
        closed = np.append(arc, arc[0] + turn) + self.position
        heights = np.append(y, y[0])
        if radius not in self.forms:
            self.forms[radius] = (
                spline.smoothing_spline(closed, heights, self.noise, True)
                if self.noise
                else spline.interpolating_spline(closed, heights, True)
            )
        part = spline.spline_stretch(self.forms[radius])
        part = part.moved(-turn * float(np.ceil((part.start + turn) / turn)))  # at least a whole turn before the run
        return Course((level(-inf, part.start), part, level(part.end, inf)), float(np.ptp(y)), turn, part.start)
