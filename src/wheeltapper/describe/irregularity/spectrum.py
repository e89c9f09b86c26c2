"""Random irregularity of the rails with a given spectrum."""

from __future__ import annotations

from functools import lru_cache
from math import ceil, inf, log, pi, sqrt
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from wheeltapper.describe.irregularity.base import Irregularity, Similarity
from wheeltapper.describe.irregularity.course import Course, Polynomials, level
from wheeltapper.describe.irregularity.density import (
    Density,
    density_of_levels,
    density_of_table,
    filter_of_patch,
    published_densities,
    published_density,
)
from wheeltapper.describe.irregularity.spline import spline_stretch
from wheeltapper.describe.noun import Length, PositiveLength, Share, check_idle
from wheeltapper.ground.errors import InputError, value_text, with_suggestion

FloatArray = NDArray[np.float64]
Rows = tuple[tuple[PositiveLength, float], ...]

PIECES_PER_WAVE = 2.5
"""Pieces of the path in the shortest wave at least; what they differ from the sum of waves is 2e-4 of that wave."""
GRID = 2.0**-40
"""Borders of pieces are multiples of this, m: exact numbers wherever they are moved to, so that nothing jumps there."""
USUAL_PERIOD = 200.0
"""Shortest period that is chosen by itself, m."""
LONGEST_WAVES = 40
"""Longest waves in the period that is chosen by itself."""
MOST_PIECES = 4_000_000
AHEAD = 1000.0
"""How far before x = 0 the irregularity reaches at least, m: trains are not longer."""


class Spectrum(Irregularity):
    """A realisation of a spectrum: a sum of waves with the amplitudes of the spectrum and random phases.

    The waves are harmonics of `period`, so that every realisation has exactly the variance of the spectrum in each band
    that is wide compared with 1/period (Shinozuka and Jan, *Journal of Sound and Vibration* 25 (1972) 111-128). The
    realisation depends on the fields alone, not on the run: with the same seed, a longer run meets the same rail.

    Parameters
    ----------
    curve
        A published spectrum: "ISO 3095:2005", "ISO 3095:2013" (limits of roughness), "ERRI B176 low", "ERRI B176 high",
        "FRA 1" to "FRA 6" (densities over rad/m, taken as one-sided).
    levels
        Instead of `curve`: rows of wavelength (m), in order, and level of its third-octave band (dB re 1 µm).
    densities
        Instead of `curve`: rows of wavelength (m), in order, and one-sided density over cycles per metre (m³).
    wavelengths
        Shortest and longest wavelength, m; None: all that the curve or table covers.
    added
        Level that is added to the whole spectrum, dB.
    deviation
        Standard deviation of the waves in `deviation_band`, m, to which the spectrum is scaled.
    deviation_band
        Shortest and longest wavelength for `deviation`, m; by default D1 of EN 13848-1.
    seed
        Seed of the random phases.
    coherence
        Coherence of the two rails, 0 to 1: the squared modulus of the cross-spectrum over the product of the spectra.
    rail
        "left" or "right"; None: the rail on which it is placed. A vehicle in the plane meets that of the left rail.
    patch
        Radius of the contact patch, m, which filters waves that are not long compared with it (Remington 1976). Only
        for rolling="point", as a circle does not follow short waves anyway. None: no filter.
    period
        Length after which the irregularity repeats, m; None: 40 times the longest wave, and at least 200 m.
    position
        How far the realisation is moved along the rail, m.
    """

    stepwise: ClassVar[tuple[str, ...]] = ("wavelengths", "period")
    example: ClassVar[dict[str, Any]] = {"curve": "ISO 3095:2013", "wavelengths": (0.04, 0.4), "added": 20.0, "seed": 1}
    curve: str | None = None
    levels: Rows | None = None
    densities: Rows | None = None
    wavelengths: tuple[PositiveLength, PositiveLength] | None = None
    added: float = Field(default=0.0, ge=-100.0, le=100.0, allow_inf_nan=False)
    deviation: PositiveLength | None = None
    deviation_band: tuple[PositiveLength, PositiveLength] = (3.0, 25.0)
    seed: int = Field(default=0, ge=0)
    coherence: Share = 1.0
    rail: Literal["left", "right"] | None = None
    patch: PositiveLength | None = None
    period: PositiveLength | None = None
    position: Length = 0.0

    @model_validator(mode="after")
    def _checked_spectrum(self) -> Spectrum:
        given = [name for name in ("curve", "levels", "densities") if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError("", "", " and ".join(given) or "no spectrum", "one of curve, levels, densities")
        if self.curve is not None and self.curve not in published_densities():
            raise InputError("", "curve", value_text(self.curve), with_suggestion(self.curve, published_densities()))
        if self.coherence > 1.0:
            raise InputError("", "coherence", f"{self.coherence:g}", "0 to 1")
        if self.deviation is not None and self.added:
            raise InputError(
                "", "added", f"{self.added:g} dB besides a deviation", "one of them, since both set the height"
            )
        _check_rows("levels", self.levels)
        _check_rows("densities", self.densities, positive=True)
        _check_band("wavelengths", self.band, self.density.known)
        if self.deviation is None:
            check_idle(self, ("deviation_band",), "without a deviation")
        else:
            _check_band("deviation_band", self.deviation_band, self.band)
        if self.pieces > MOST_PIECES:
            found = f"waves of {self.band[0]:g} m over a period of {self.length:g} m, in {self.pieces} pieces"
            raise InputError("", "wavelengths", found, f"up to {MOST_PIECES}: no shorter waves, or a shorter period")
        return self

    @property
    def density(self) -> Density:
        """The density before it is scaled."""
        if self.curve is not None:
            return published_density(self.curve)
        if self.levels is not None:
            return density_of_levels(self.levels, "a table")
        return density_of_table(self.densities or ())

    @property
    def band(self) -> tuple[float, float]:
        """Shortest and longest wavelength, m."""
        known = self.density.known
        if self.wavelengths is not None:
            return self.wavelengths
        if known is None:
            raise InputError(
                "", "wavelengths", "nothing", f"shortest and longest wavelength, as {self.curve} has no ends"
            )
        return known

    @property
    def pieces(self) -> int:
        """Number of pieces in a period, even."""
        return 2 * ceil(0.5 * PIECES_PER_WAVE * self._least / self.band[0])

    @property
    def width(self) -> float:
        """Length of a piece, m."""
        return max(round(self._least / self.pieces / GRID), 1) * GRID

    @property
    def length(self) -> float:
        """The period, m."""
        return self.pieces * self.width

    @property
    def _least(self) -> float:
        return max(USUAL_PERIOD, LONGEST_WAVES * self.band[1]) if self.period is None else float(self.period)

    def variances(self) -> tuple[FloatArray, FloatArray]:
        """Return the wavenumbers of the waves, 1/m, and the variance of each, m²."""
        shortest, longest = self.band
        first = max(ceil(self.length / longest - 0.5), 1)
        number = np.arange(first, int(self.length / shortest + 0.5) + 1)
        k = number / self.length
        gain = 10.0 ** (0.1 * self.added)
        if self.deviation is not None:
            gain = self.deviation**2 / self._variance_of(k, self.deviation_band).sum()
        filtered = 1.0 if self.patch is None else filter_of_patch(k, self.patch)
        return k, gain * filtered * self._variance_of(k, self.band)

    def _variance_of(self, k: FloatArray, band: tuple[float, float]) -> FloatArray:
        """Return the variance of each wave, m²: that of the density from half-way to its neighbours, within a band."""
        half = 0.5 / self.length
        low, high = (np.clip(k + side, 1.0 / band[1], 1.0 / band[0]) for side in (-half, half))
        return np.where(high > low, self.density.variance_between(low, np.maximum(high, low * (1 + 1e-12))), 0.0)

    def phases(self, count: int) -> FloatArray:
        """Return the phases of the first harmonics of the period, rad.

        The phases of the right rail differ from those of the left rail by normal deviates ψ of the variance
        -ln(coherence): the mean of exp(iψ) is the root of the coherence.
        """
        left = np.random.default_rng([self.seed, 0]).uniform(0.0, 2.0 * pi, count)
        if self.rail != "right" or self.coherence == 1.0:
            return left
        spread = sqrt(-log(max(self.coherence, 1e-300)))
        return left + spread * np.random.default_rng([self.seed, 1]).standard_normal(count)

    def on_rail(self, side: str) -> Self:
        """Return the realisation on one of the rails."""
        return self if self.rail is not None else self.model_copy(update={"rail": side})

    def similarity(self) -> Similarity:
        """Return which fields scale or move it."""
        return {"position": "offset"} if self.deviation is None else {"deviation": "lift", "position": "offset"}

    def shortest_wave(self, radius: float) -> float | None:
        """Return the shortest wavelength."""
        return float(self.band[0])

    @property
    def filters(self) -> bool:
        """Whether the patch's filter is applied."""
        return self.patch is not None

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        form = _realisation(self)
        place = round(self.position / GRID) * GRID
        part = spline_stretch(form).moved(place - self.length * ceil(1.0 + (AHEAD + place) / self.length))
        start = form.coefficients[0, 0]
        heights = float(np.ptp(form.coefficients[:, 0]))
        parts = (level(-inf, part.start, start), part, level(part.end, inf, start))
        return Course(parts, heights, self.length, part.start)


def _check_rows(field: str, rows: Rows | None, *, positive: bool = False) -> None:
    """Refuse a table with fewer than two rows, out of order, or with densities that are not above zero."""
    if rows is None:
        return
    if len(rows) < 2:
        raise InputError("", field, f"{len(rows)} rows", "at least two")
    waves = [wave for wave, _ in rows]
    falls = waves[1] < waves[0]
    for before, after in zip(waves[:-1], waves[1:], strict=True):
        if before == after or (after < before) != falls:
            raise InputError(
                "", field, f"the wavelength {after:g} m after {before:g} m", "wavelengths in order, each once"
            )
    bad = next((value for _, value in rows if not np.isfinite(value) or (positive and value <= 0.0)), None)
    if bad is not None:
        raise InputError("", field, str(bad), "finite densities above zero" if positive else "finite levels in dB")


def _check_band(field: str, band: tuple[float, float], known: tuple[float, float] | None) -> None:
    """Refuse a band that is empty, or that reaches beyond what is known."""
    if band[0] >= band[1]:
        raise InputError("", field, f"an empty band from {band[0]:g} to {band[1]:g} m", "the shorter wavelength first")
    if known is not None and (band[0] < known[0] * (1 - 1e-9) or band[1] > known[1] * (1 + 1e-9)):
        raise InputError(
            "", field, f"{band[0]:g} to {band[1]:g} m", f"a band within {known[0]:.6g} to {known[1]:.6g} m"
        )


def _hermite_ends() -> FloatArray:
    """Return the matrix from what is missing at the end of a piece, of four derivatives, to its four highest powers."""
    rows = [[float(np.prod(np.arange(power - order + 1, power + 1))) for power in range(4, 8)] for order in range(4)]
    return np.linalg.inv(np.array(rows))


@lru_cache(maxsize=8)
def _realisation(spectrum: Spectrum) -> Polynomials:
    """Return one period: polynomials of degree 7 that meet in the sum's height and three derivatives."""
    pieces, length, width = spectrum.pieces, spectrum.length, spectrum.width
    k, variance = spectrum.variances()
    number = np.rint(k * length).astype(int)
    waves = np.zeros(pieces // 2 + 1, dtype=complex)
    waves[number] = 0.5 * np.sqrt(2.0 * variance) * np.exp(1j * spectrum.phases(int(number[-1]))[number - 1])
    turn = 2j * pi * np.arange(len(waves)) / pieces  # of a wave over one piece
    ends = [np.fft.irfft(waves * turn**order, pieces) * pieces for order in range(4)]
    low = np.column_stack([ends[0], ends[1], ends[2] / 2.0, ends[3] / 6.0])
    missing = np.column_stack([np.roll(one, -1) for one in ends])
    missing -= low @ np.array([[1, 0, 0, 0], [1, 1, 0, 0], [1, 2, 2, 0], [1, 3, 6, 6]])
    coefficients = np.concatenate([low, missing @ _hermite_ends().T], axis=1) / width ** np.arange(8)
    return Polynomials(width * np.arange(pieces + 1.0), coefficients)
