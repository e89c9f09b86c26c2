"""A course: the height of an irregularity over the whole line, as smooth stretches. Lowering starts from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Chord", "Course", "Harmonic", "Stretch", "chord", "harmonic", "level"]

FloatArray = NDArray[np.float64]
Function = Callable[[NDArray[Any]], NDArray[Any]]


@dataclass(frozen=True)
class Harmonic:
    """The exact form offset + sine·sin(wavenumber·(x - origin)) + cosine·cos(wavenumber·(x - origin)), in m."""

    offset: float
    sine: float
    cosine: float
    wavenumber: float
    origin: float

    @property
    def level(self) -> bool:
        """True if there is no wave."""
        return not (self.sine or self.cosine)

    def moved(self, distance: float) -> Harmonic:
        """Return the form, moved forward."""
        return replace(self, origin=self.origin + distance)


@dataclass(frozen=True)
class Polynomials:
    """Polynomial pieces: on [breaks[i], breaks[i+1]] the height is the sum of coefficients[i, k]·(x - breaks[i])^k."""

    breaks: FloatArray
    coefficients: FloatArray

    def derivative(self, x: NDArray[Any], order: int) -> NDArray[Any]:
        """Return the derivative of the given order (0 for the value) at x."""
        piece = np.clip(np.searchsorted(self.breaks, x.real, side="right") - 1, 0, len(self.breaks) - 2)
        local = x - self.breaks[piece]
        total = np.zeros_like(local)
        for k in range(self.coefficients.shape[1] - 1, order - 1, -1):
            falling = float(np.prod(np.arange(k - order + 1, k + 1)))
            total = total * local + falling * self.coefficients[piece, k]
        return total

    def moved(self, distance: float) -> Polynomials:
        """Return the pieces, moved forward."""
        return Polynomials(self.breaks + distance, self.coefficients)


@dataclass(frozen=True)
class Chord:
    """The exact form sqrt(R² - L²) - sqrt(R² - X²), in m: a chord of half-length L in a circle, X from its middle."""

    start: float
    end: float
    radius: float

    @property
    def below(self) -> float:
        """Distance of the chord from the circle's centre, m."""
        return sqrt(self.radius**2 - (0.5 * (self.end - self.start)) ** 2)

    def moved(self, distance: float) -> Chord:
        """Return the form, moved forward."""
        return Chord(self.start + distance, self.end + distance, self.radius)


@dataclass(frozen=True)
class Stretch:
    """One smooth stretch: value, slope and curvature (second derivative) are vectorised functions of x.

    `scatter` gives the jumps of the curvature near x if it comes from interpolants; None if it does not.
    """

    start: float
    end: float
    value: Function
    slope: Function
    curvature: Function
    exact: Harmonic | Polynomials | Chord | None = None
    scatter: Function | None = None

    @property
    def level(self) -> bool:
        """True if it is known to be level."""
        return isinstance(self.exact, Harmonic) and self.exact.level

    def moved(self, distance: float) -> Stretch:
        """Return the stretch, moved forward."""

        def shifted(function: Function) -> Function:
            return lambda x: function(x - distance)

        exact = None if self.exact is None else self.exact.moved(distance)
        bounds = self.start + distance, self.end + distance
        scatter = None if self.scatter is None else shifted(self.scatter)
        return Stretch(*bounds, shifted(self.value), shifted(self.slope), shifted(self.curvature), exact, scatter)


@dataclass(frozen=True)
class Course:
    """The height of an irregularity over the whole line.

    Attributes
    ----------
    stretches
        Contiguous smooth stretches; the first starts at -inf, the last ends at +inf.
    height
        Characteristic height in m, the scale of the fit's tolerance.
    period
        If given, the course repeats with this period (m) from `repeats_from` on, without end.
    followed
        True if the wheel's centre follows the course even if the wheel rolls as a circle (an ideal step).
    sampled
        True for a user's function: its range, and whether it jumps, are known only from samples.
    """

    stretches: tuple[Stretch, ...]
    height: float
    period: float | None = None
    repeats_from: float = -inf
    followed: bool = False
    sampled: bool = False

    @property
    def uneven(self) -> tuple[tuple[float, float], ...]:
        """Where it is not level: first and last x of each place, m; within one period if the course repeats."""
        if not self.height:
            return ((-inf, inf),)
        within = [(one.start, one.end) for one in self.stretches if not one.level]
        return (*within, *((one.end, one.end) for one in self.stretches[:-1]))

    def value(self, x: NDArray[Any]) -> NDArray[Any]:
        """Return the height in m at x."""
        return np.asarray(self._from_stretches(x, "value"))

    def slope(self, x: NDArray[Any]) -> NDArray[Any]:
        """Return the slope at x; at a border, that of the stretch which begins there."""
        return np.asarray(self._from_stretches(x, "slope"))

    def curvature(self, x: NDArray[Any]) -> NDArray[Any]:
        """Return the second derivative in 1/m at x."""
        return np.asarray(self._from_stretches(x, "curvature"))

    def folded(self, x: NDArray[Any]) -> NDArray[Any]:
        """Return x moved by whole periods into the first period."""
        if self.period is None:
            return x
        if np.isneginf(self.repeats_from):
            return x - self.period * np.floor(x.real / self.period)
        return x - self.period * np.maximum(np.floor((x.real - self.repeats_from) / self.period), 0.0)

    def moved(self, distance: float) -> Course:
        """Return the course, moved forward."""
        stretches = tuple(stretch.moved(distance) for stretch in self.stretches)
        return replace(self, stretches=stretches, repeats_from=self.repeats_from + distance)

    def _from_stretches(self, x: NDArray[Any], which: str) -> NDArray[Any]:
        x = self.folded(np.asarray(x))
        starts = np.array([stretch.start for stretch in self.stretches])
        index = np.searchsorted(starts, x.real, side="right") - 1
        out = np.zeros(x.shape, dtype=x.dtype if np.iscomplexobj(x) else np.float64)
        for i in np.unique(index):
            inside = index == i
            out[inside] = getattr(self.stretches[i], which)(x[inside])
        return out


def level(start: float, end: float, height: float = 0.0) -> Stretch:
    """Return a stretch of constant height."""

    def value(x: NDArray[Any]) -> NDArray[Any]:
        return np.zeros_like(x) + height

    return Stretch(start, end, value, np.zeros_like, np.zeros_like, Harmonic(height, 0.0, 0.0, 0.0, 0.0))


def chord(form: Chord) -> Stretch:
    """Return a stretch that is exactly one chord."""
    middle, below = 0.5 * (form.start + form.end), form.below

    def half_chord_height(x: NDArray[Any]) -> NDArray[Any]:
        return np.sqrt(form.radius**2 - (x - middle) ** 2)

    def value(x: NDArray[Any]) -> NDArray[Any]:
        return (
            (x - form.start) * (x - form.end) / (below + half_chord_height(x))
        )  # not as a difference of roots, because d is small

    def slope(x: NDArray[Any]) -> NDArray[Any]:
        return np.asarray((x - middle) / half_chord_height(x))

    def curvature(x: NDArray[Any]) -> NDArray[Any]:
        return form.radius**2 / half_chord_height(x) ** 3

    return Stretch(form.start, form.end, value, slope, curvature, form)


def harmonic(start: float, end: float, form: Harmonic) -> Stretch:
    """Return a stretch that is exactly one harmonic."""
    k = form.wavenumber

    def phase(x: NDArray[Any]) -> NDArray[Any]:
        return k * (x - form.origin)

    def value(x: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(form.offset + form.sine * np.sin(phase(x)) + form.cosine * np.cos(phase(x)))

    def slope(x: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(k * (form.sine * np.cos(phase(x)) - form.cosine * np.sin(phase(x))))

    def curvature(x: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(-k * k * (form.sine * np.sin(phase(x)) + form.cosine * np.cos(phase(x))))

    return Stretch(start, end, value, slope, curvature, form)
