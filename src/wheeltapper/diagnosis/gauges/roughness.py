"""What roughness of wheel and rail adds to readings, by what is known of it: its level.

It is a sum of waves with independent amplitudes, whose variance the level gives. Each wave gives two columns of
readings, as a wheel that keeps contact answers to it. The columns R add R·Rᵀ to the covariance of the readings.

Theory: docs/theory/gauges.rst, section 16.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.density import published_density
from wheeltapper.diagnosis.gauges.passing import Passing
from wheeltapper.diagnosis.gauges.responses import Responses
from wheeltapper.diagnosis.gauges.weighing import Band

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
LEVEL = "ISO 3095:2013"
"""The roughness is taken to be at this limit; longer waves than its table has go on with the density of its longest."""
LONGEST, SHORTEST = 0.9, 0.022
"""Wavelengths, m. Longer ones give forces that a slope of the zero line takes up; shorter ones are in no reading."""
PIVOT = 0.1
"""Wavelength at which a tilt of the spectrum changes nothing, m."""
BEYOND = 1.05
"""Waves are of interest up to this times the highest frequency that is read."""


def rough_columns(
    band: Band, responses: Responses, stiffness: float, mass: float, added: float = 0.0, tilt: float = 0.0
) -> FloatArray:
    """Return readings of waves of roughness with the amplitudes of the level, N, (readings, columns).

    Parameters
    ----------
    band
        Readings that are compared.
    responses
        Of the track.
    stiffness, mass
        Of the contact about the static force, N/m, and of the wheel, kg.
    added
        To the level, dB.
    tilt
        The power is that of the level times this power of the wavelength over PIVOT.
    """
    number, amplitudes = _waves(band, added, tilt)
    return np.asarray(wave_columns(band, responses, stiffness, mass, number) * np.tile(amplitudes, 2))


def rough_of_others(band: Band, rough: FloatArray) -> FloatArray:
    """Return the standard deviations of what the roughness below other wheels adds to readings, N.

    `rough` are the columns of the wheel itself. At each place other wheels give as much as it does.
    """
    passing, ends = band.passing, np.cumsum(band.counts)[:-1]
    out = []
    for own, picked in zip(np.split((rough**2).sum(axis=1), ends), band.picked.T, strict=True):
        x = passing.x[picked]
        out.append(sum((np.interp(x + by, x, own, left=0.0, right=0.0) for by in passing.others), 0.0 * own))
    return np.asarray(np.sqrt(np.concatenate(out)))


def rough_force(
    band: Band, responses: Responses, stiffness: float, mass: float, factors: FloatArray, x: FloatArray
) -> FloatArray:
    """Return the contact's force of waves of roughness at places, m, by the `factors` of `rough_columns`, N."""
    number, amplitudes = _waves(band)
    cosines, sines = np.split(factors * np.tile(amplitudes, 2), 2)
    force = _wave_force(band.passing, responses, stiffness, mass, number, x)
    return np.asarray(cosines @ force.real + sines @ force.imag)


def _waves(band: Band, added: float = 0.0, tilt: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return the waves that count, 1/m, and the standard deviations of their amplitudes, m."""
    passing = band.passing
    width = 1.0 / float(passing.x[-1] - passing.x[0])
    below = np.arange(1.0 / LONGEST, min(BEYOND * band.cutoff / passing.speed, 1.0 / SHORTEST), width)
    middle = below + 0.5 * width
    return middle, usual_amplitudes(below, width, added) * (PIVOT * middle) ** (-0.5 * tilt)


def usual_amplitudes(number: FloatArray, width: float, added: float = 0.0) -> FloatArray:
    """Return the standard deviations of amplitudes of waves at the level, m.

    `number` are waves per m at which bands of `width` begin, both 1/m, `added` is a level, dB.
    """
    density = published_density(LEVEL)
    assert density.known is not None
    known = np.maximum(number, 1.0 / density.known[1])
    return np.asarray(np.sqrt(density.variance_between(known, known + width) * 10.0 ** (0.1 * added)))


def wave_columns(band: Band, responses: Responses, stiffness: float, mass: float, number: FloatArray) -> FloatArray:
    """Return readings of waves of 1 m below a wheel, as cosines and then as sines from the first sample's place.

    `number` are waves per m; the rest is as in `rough_columns`. Returned are (readings, 2 * waves), N/m.
    """
    x = band.passing.x[band.rows]
    frequencies = number * band.passing.speed
    force = _wave_force(band.passing, responses, stiffness, mass, number, x)
    force *= (band.gain(frequencies) * band.passing.recorded_share(frequencies))[:, None]
    read = responses.readings(frequencies, x) * force
    return band.taken_of_rows(np.concatenate([read.real, read.imag], axis=1))


def _wave_force(
    passing: Passing, responses: Responses, stiffness: float, mass: float, number: FloatArray, x: FloatArray
) -> ComplexArray:
    """Return the contact's force of waves of 1 m at places, N/m, (waves, places)."""
    answer = responses.at_places(responses.contact(number * passing.speed, stiffness, mass), x)
    return np.asarray(answer * np.exp(2j * np.pi * number[:, None] * (x - passing.place)))


def contact_stiffness(constant: float, force: float) -> float:
    """Return the slope of N = C·δ^1.5 at a force, N/m."""
    return float(1.5 * constant ** (2.0 / 3.0) * force ** (1.0 / 3.0))
