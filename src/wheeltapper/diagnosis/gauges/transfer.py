"""What sensors read of a force that moves with its wheel: a linear operator, from forces to readings.

A force F at the place x(τ) of the wheel gives the readings ∫ h(x(τ), t - τ) F(τ) dτ, where h is the track's answer to
an impulse, from its responses to harmonic forces. A run's forces thus give its readings in some milliseconds.

Theory: docs/theory/gauges.rst, section 16.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly
from scipy.sparse import dia_array, vstack

from wheeltapper.diagnosis.gauges.passing import ADVANCE, PASSED, SPEED, Values
from wheeltapper.diagnosis.gauges.responses import Responses
from wheeltapper.diagnosis.gauges.weighing import Band
from wheeltapper.record.assessment.filtering import low_passed

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
SAMPLES = 2.1
"""Forces are taken at so many times that frequency, a second, at least."""
EARLIER = 4.0
"""A low-pass without phase has an answer from so many periods of its cut-off before an impulse."""
AFTER = 256
"""Samples without force behind a run, so that its end is not felt at its beginning."""


class Transfer:
    """Readings in a band of the force of a wheel.

    Parameters
    ----------
    band
        Readings that are compared.
    responses
        Of the track.
    values
        Of the wheel: its speed and where it is.
    """

    def __init__(self, band: Band, responses: Responses, values: Values) -> None:
        passing, cutoff = band.passing, band.cutoff
        self.band, self._advance, self._speed = band, values[ADVANCE], values[SPEED]
        self._every = every = _divisor(band.every, passing.rate / (SAMPLES * PASSED * cutoff))
        self._lead, rows = passing.lead // every, len(range(0, len(passing.readings), every))
        step = every / passing.rate
        frequencies = responses.frequencies[responses.frequencies <= PASSED * cutoff]
        times = np.asarray(np.arange(-self._lead, rows) * step, dtype=float)
        x = passing.place + self._advance + self._speed * times
        read = responses.readings(frequencies, x, 0.5 * step * self._speed)
        size: FloatArray = (
            band.gain(frequencies) * np.where(frequencies > 0.0, 2.0, 1.0) * responses.frequencies[1] * step
        )
        count = int(1.0 / (responses.frequencies[1] * step))
        lags = np.arange(count) - min(count // 4, int(EARLIER / (cutoff * step)))
        turn = np.exp(2j * np.pi * frequencies[:, None] * lags * step) * size[:, None]
        answers = np.concatenate([read.real, -read.imag], axis=1).transpose(0, 2, 1) @ np.vstack([turn.real, turn.imag])
        shape = rows, len(times)
        self._parts = [dia_array((one.T, self._lead - lags), shape=shape) for one in answers]
        self._count = passing.lead + len(passing.readings) + AFTER
        whole = np.fft.rfftfreq(self._count, 1.0 / passing.rate)
        self.frequencies = whole[whole < PASSED * cutoff]

    def of(self, forces: FloatArray) -> FloatArray:
        """Return the readings after the low-pass, N, (samples, sensors), of forces at the samples of a run, N."""
        passing, every = self.band.passing, self._every
        taken = self._taken(forces if every == 1 else low_passed(forces, passing.rate, 0.45 * passing.rate / every, 8))
        rows = np.stack([part @ taken for part in self._parts], axis=1)
        return rows if every == 1 else resample_poly(rows, every, 1)[: len(passing.readings)]

    def retimed(self, readings: FloatArray, values: Values) -> FloatArray:
        """Return readings of a wheel that passes the same places at a slightly other speed, or earlier."""
        ahead, speed = values[ADVANCE] - self._advance, values[SPEED]
        if ahead == 0.0 and speed == self._speed:
            return readings
        seconds = self.band.passing.seconds
        at = np.clip((ahead + speed * seconds) / self._speed, seconds[0], seconds[-1])
        return np.asarray(CubicSpline(seconds, readings)(at))

    def spectra(self, forces: FloatArray) -> ComplexArray:
        """Return what `of_spectra` takes, (frequencies, ...), of forces at the samples of a run, N, (samples, ...)."""
        return np.asarray(np.fft.rfft(forces, self._count, axis=0)[: len(self.frequencies)])

    def of_spectra(self, spectra: ComplexArray) -> FloatArray:
        """Return the compared readings, N, (readings, columns)."""
        taken = self._taken(np.fft.irfft(spectra, self._count, axis=0))
        picked = self.band.picked[:: self._every].T
        parts: Any = vstack([part.tocsr()[own] for part, own in zip(self._parts, picked, strict=True)], format="csr")
        return np.asarray(parts @ taken)

    def _taken(self, smooth: FloatArray) -> FloatArray:
        """Return forces without high frequencies at the times at which they are taken."""
        first = self.band.passing.lead - self._lead * self._every
        return np.asarray(smooth[first :: self._every][: self._parts[0].shape[1]])


def _divisor(number: int, most: float) -> int:
    """Return the largest divisor of a number that is not larger than another number, or 1."""
    return max(one for one in range(1, number + 1) if number % one == 0 and one <= max(1.0, most))
