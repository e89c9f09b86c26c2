"""Frequency weightings of whole-body vibration, analogue and digital.

A weighting is a band limit, a transition from acceleration to velocity, and an upward step; ISO 8041-1:2017 writes all
three with corner frequencies f1 to f6 and quality factors Q1 to Q6. The digital filter here has the sampled analogue
poles and zeros, and a short correction that restores modulus and phase up to a quarter of the rate.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.ground.arguments import as_quantity, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.record.arrays import as_array

__all__ = ["WEIGHTINGS", "as_rate", "weighted", "weighting"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
SLOWEST = 250.0
"""Lowest admissible sample rate, samples per second. At a lower one the upper band limit, 100 Hz, would lie above 0.4
of the rate."""
HIGHEST = 1e50
"""Of a frequency, Hz: powers of it stay within the numbers that there are."""
FASTEST = 1e6
"""Highest admissible rate: above, rounding moves the filter's poles, which lie ever closer to 1."""
BAND, BUTTERWORTH = (0.4, 100.0), 0.5**0.5
"""Corner frequencies f1 and f2 of the band limit, Hz, and its quality factors Q1 = Q2, in every edition."""
TAPS, FITTED_UP_TO, FITTED_AT = 6, 0.27, 400
"""The filter that corrects the digital weighting: its number of coefficients, the frequency up to which it is fitted
(over the sample rate), and the number of frequencies of the fit."""


class Weighting(NamedTuple):
    """A weighting: f3, f4 (Hz), Q4; f5, Q5, f6, Q6 of its step, or None; K, without (f5/f6)^2; their source."""

    transition: tuple[float, float, float]
    step: tuple[float, float, float, float] | None
    gain: float
    source: str


# EN 12299 and BS 6841 number the quality factors otherwise (Q2, Q3, Q4 are Q4, Q5, Q6 here) and write the step without
# (f5/f6)^2 but with K = 0.4, which is 1.024 (2.5/4)^2.
WEIGHTINGS = {
    "Wk": Weighting((12.5, 12.5, 0.63), (2.37, 0.91, 3.35, 0.91), 1.0, "ISO 2631-1:1997, Table A.1"),
    "Wd": Weighting((2.0, 2.0, 0.63), None, 1.0, "ISO 2631-1:1997, Table A.1"),
    "Wb": Weighting((16.0, 16.0, 0.55), (2.5, 0.9, 4.0, 0.95), 1.024, "ISO 8041-1:2017, Table 3"),
    "Wb EN 12299:2009": Weighting((16.0, 16.0, 0.63), (2.5, 0.8, 4.0, 0.8), 1.024, "programs for EN 12299:2009"),
}
"""By name: "Wk" (vertical), "Wd" (horizontal), "Wb" (vertical, for railways), and the form of Wb that programs for EN
12299:2009 use."""


def weighting(name: str, frequency: ArrayLike) -> ComplexArray:
    """Return the complex response of an analogue frequency weighting; its modulus is the weighting factor.

    Source: ISO 8041-1:2017, Formulae (1) to (5). "Wk" and "Wd" are those of ISO 2631-1:1997, Annex A. "Wb" is that of
    ISO 8041-1:2017, which is ISO 2631-4:2001 and BS 6841:1987 with Q1 unrounded. Public programs for EN 12299:2009 have
    other quality factors, "Wb EN 12299:2009": 13 % more at 16 Hz, 8 % less at 4 Hz. The standard itself, and its
    edition of 2024, could not be consulted.

    Parameters
    ----------
    name
        "Wk", "Wd", "Wb" or "Wb EN 12299:2009".
    frequency
        Hz, of any shape.

    Returns
    -------
    numpy.ndarray
        Complex, of the shape of `frequency`; no unit.

    Raises
    ------
    InputError
        For an unknown name.
    """
    held = _weighting_named(name)
    allowed = f"frequencies in Hz up to {HIGHEST:g}"
    frequencies = as_array(frequency, "frequency", allowed, "frequency")
    if not (np.abs(frequencies) <= HIGHEST).all():
        raise InputError("", "frequency", value_text(frequency), allowed)
    p = 1j * frequencies
    (f1, f2), (f3, f4, q4) = BAND, held.transition
    band = (p / f1) ** 2 / _quadratic(p, f1, BUTTERWORTH) / _quadratic(p, f2, BUTTERWORTH)
    out = held.gain * band * (1.0 + p / f3) / _quadratic(p, f4, q4)
    if held.step is None:
        return out
    f5, q5, f6, q6 = held.step
    return out * _quadratic(p, f5, q5) / _quadratic(p, f6, q6) * (f5 / f6) ** 2


def weighted(acceleration: ArrayLike, rate: float | str, name: str) -> FloatArray:
    """Return weighted accelerations: the samples after a causal filter that starts from rest.

    The acceleration is zero before the first sample. If it does not begin at zero, this is a jump for the filter, whose
    effect lasts some 2 s because of the band limit at 0.4 Hz. Gravity should not be among the samples.

    Parameters
    ----------
    acceleration
        m/s^2, time along the last axis, uniformly sampled and free of content above half the rate.
    rate
        Samples per second, 250 to 1e6, Hz or as "1 kHz". Up to a quarter of it the response is accurate to 0.2 % and
        0.002 rad.
    name
        Name of the weighting, as for `weighting`.

    Returns
    -------
    numpy.ndarray
        m/s^2, of the shape of `acceleration`.

    Raises
    ------
    InputError
        For a rate out of this range, an unknown name, or samples that are not finite.
    """
    from scipy import signal

    allowed = "an array of finite samples, time last"
    samples = as_array(acceleration, "acceleration", allowed, "acceleration")
    if samples.ndim == 0 or not np.isfinite(samples).all():
        raise InputError("", "acceleration", "no finite samples over time", allowed)
    check_choice(name, "name", WEIGHTINGS)
    sections, correction = _digital_filter(name, as_rate(rate))
    if samples.size == 0:
        return samples.copy()
    return np.asarray(signal.lfilter(correction, [1.0], signal.sosfilt(sections, samples)), dtype=np.float64)


@cache
def _digital_filter(name: str, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return the second-order sections and the correction's coefficients of a weighting at a rate.

    Poles and zeros s become exp(s/rate), so that the two zeros at s = 0 stay exact. The remaining error is smooth up to
    half the rate. A few coefficients, fitted by least squares of the relative error, correct it.
    """
    from scipy import signal

    zeros, poles = _zeros_and_poles(_weighting_named(name))
    sections = signal.zpk2sos(np.exp(zeros / rate), np.exp(poles / rate), 1.0)
    frequency = rate * np.linspace(1e-3, FITTED_UP_TO, FITTED_AT)
    response = signal.freqz_sos(sections, worN=frequency, fs=rate)[1]
    delays = np.exp(-2j * np.pi * np.outer(frequency / rate, np.arange(TAPS)))
    relative = delays * (response / weighting(name, frequency))[:, None]
    system, wanted = np.concatenate([relative.real, relative.imag]), np.repeat([1.0, 0.0], FITTED_AT)
    return np.asarray(sections), np.asarray(np.linalg.lstsq(system, wanted, rcond=None)[0])


def _zeros_and_poles(held: Weighting) -> tuple[ComplexArray, ComplexArray]:
    """Return the analogue zeros and poles, rad/s."""
    (f1, f2), (f3, f4, q4) = BAND, held.transition
    zeros = [0j, 0j, complex(-2.0 * np.pi * f3)]
    poles = [*_quadratic_roots(f1, BUTTERWORTH), *_quadratic_roots(f2, BUTTERWORTH), *_quadratic_roots(f4, q4)]
    if held.step is not None:
        zeros += _quadratic_roots(*held.step[:2])
        poles += _quadratic_roots(*held.step[2:])
    return np.array(zeros), np.array(poles)


def _quadratic_roots(corner: float, quality: float) -> list[complex]:
    """Return the two roots, rad/s, of a quadratic with a corner frequency (Hz) and a quality factor above 1/2."""
    damping = 0.5 / quality
    root = 2.0 * np.pi * corner * complex(-damping, np.sqrt(1.0 - damping**2))
    return [root, root.conjugate()]


def _quadratic(p: ComplexArray, corner: float, quality: float) -> ComplexArray:
    return np.asarray(1.0 + p / (quality * corner) + (p / corner) ** 2)


def _weighting_named(name: str) -> Weighting:
    check_choice(name, "weighting", WEIGHTINGS)
    return WEIGHTINGS[name]


def as_rate(given: Any) -> float:
    """Return a rate, samples per second, at which the weightings are right."""
    rate = as_quantity(given, "rate", "frequency")
    if not SLOWEST <= rate <= FASTEST:
        allowed = f"{SLOWEST:g} to {FASTEST:g}, for a band up to 100 Hz"
        raise InputError("", "rate", f"{rate:g} samples per second", allowed)
    return rate
