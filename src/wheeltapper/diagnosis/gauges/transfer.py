"""What sensors read of a force that moves with its wheel: a linear operator, from forces to readings.

A force F at the place x(τ) of the wheel gives the readings ∫ h(x(τ), t - τ) F(τ) dτ, where h is the track's answer to
an impulse, from its responses to harmonic forces. A run's forces thus give its readings in some milliseconds.

Theory: docs/theory/gauges.rst, section 16.2.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly
from scipy.sparse import csr_array

from wheeltapper.diagnosis.gauges.passing import ADVANCE, PASSED, SPEED, Values
from wheeltapper.diagnosis.gauges.responses import Responses
from wheeltapper.diagnosis.gauges.weighing import Band
from wheeltapper.record.assessment.filtering import low_passed

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
SAMPLES = 2.05
"""Forces are taken at so many times that frequency, a second, at least."""
BELOW, ORDER = 0.47, 16
"""Cut-off of the low-pass before, over that rate, and its order."""
EARLIER = 4.0
"""A low-pass without phase has an answer from so many periods of its cut-off before an impulse."""
AFTER = 256
"""Samples without force behind a run, so that its end is not felt at its beginning."""
TOGETHER = 32
"""Rows that are made at once, so that what they are made of stays near the processor."""


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
        self._lead, step = passing.lead // every, every / passing.rate
        self._forces = self._lead + len(range(0, len(passing.readings), every))
        frequencies = responses.frequencies[responses.frequencies <= PASSED * cutoff]
        size: FloatArray = (
            band.gain(frequencies) * np.where(frequencies > 0.0, 2.0, 1.0) * responses.frequencies[1] * step
        )
        count = int(1.0 / (responses.frequencies[1] * step))
        lags = np.arange(count)[::-1] - min(count // 4, int(EARLIER / (cutoff * step)))
        turn = np.exp(2j * np.pi * frequencies[:, None] * lags * step) * size[:, None]
        self._first = self._lead - int(lags[0])  # of the forces from which the first row follows
        self._stride, rows = band.every // every, len(range(0, len(passing.readings), band.every))
        read = np.ascontiguousarray(responses.read[: len(frequencies)].transpose(2, 1, 0))
        parts = np.concatenate([read.real, -read.imag], axis=2)
        known = parts @ np.concatenate([turn.real, turn.imag])  # of forces at the places of the responses, by lag
        rising, at_once = np.diff(known, axis=1), turn.real.sum(axis=0)
        times = np.arange(-int(lags[0]), rows * self._stride - int(lags[-1])) * step
        x = np.asarray(passing.place + self._advance + self._speed * times, dtype=float)
        left, beside = responses.beside_places(x)
        between = responses.between_gauges(x, 0.5 * step * self._speed)
        self._answers = np.empty((len(known), rows, count))
        for first in range(0, rows, TOGETHER):
            some = slice(first, first + TOGETHER)
            at = self._stride * np.arange(rows)[some, None] + np.arange(count)
            flat, share = left[at] * count + np.arange(count), beside[at]
            for answers, own, rise, crossed in zip(self._answers, known, rising, between, strict=True):
                answers[some] = own.take(flat) + share * rise.take(flat) + at_once * crossed[at]
        self._count = passing.lead + len(passing.readings) + AFTER
        whole = np.fft.rfftfreq(self._count, 1.0 / passing.rate)
        self.frequencies = whole[whole < PASSED * cutoff]

    def of(self, forces: FloatArray) -> FloatArray:
        """Return the readings after the low-pass, N, (samples, sensors), of forces at the samples of a run, N.

        They follow from the forces where they are compared; between them they are interpolated.
        """
        passing, every = self.band.passing, self.band.every
        taken = self._taken(forces if self._every == 1 else low_passed(
            forces, passing.rate, BELOW * passing.rate / self._every, ORDER
        ))  # fmt: skip
        windows = sliding_window_view(self._padded(taken), self._answers.shape[2])[:: self._stride]
        rows = np.einsum("srl,rl->rs", self._answers, windows[: self._answers.shape[1]])
        if every == 1:
            return np.asarray(rows)
        readings = resample_poly(rows, every, 1, padtype="line")[: len(passing.readings)]
        readings[::every] = rows
        return np.asarray(readings)

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
        return np.asarray(self._compared @ self._padded(self._taken(np.fft.irfft(spectra, self._count, axis=0))))

    @cached_property
    def _compared(self) -> csr_array:
        """The operator from padded forces to the compared readings."""
        _, rows, count = self._answers.shape
        own = self.band.picked[:: self.band.every].T
        answers = np.concatenate([answers[one] for answers, one in zip(self._answers, own, strict=True)])
        first = self._stride * np.concatenate([np.flatnonzero(one) for one in own])
        at = first[:, None] + np.arange(count)
        ends = count * np.arange(len(at) + 1)
        return csr_array((answers.ravel(), at.ravel(), ends), shape=(len(at), rows * self._stride + count))

    def _padded(self, forces: FloatArray) -> FloatArray:
        """Return the forces from which the rows follow, from the first one on, with zeros where there are none."""
        _, rows, count = self._answers.shape
        own = forces[self._first :][: rows * self._stride + count]
        return np.pad(own, [(0, rows * self._stride + count - len(own)), *[(0, 0)] * (own.ndim - 1)])

    def _taken(self, smooth: FloatArray) -> FloatArray:
        """Return forces without high frequencies at the times at which they are taken."""
        first = self.band.passing.lead - self._lead * self._every
        return np.asarray(smooth[first :: self._every][: self._forces])


def _divisor(number: int, most: float) -> int:
    """Return the largest divisor of a number that is not larger than another number, or 1."""
    return max(one for one in range(1, number + 1) if number % one == 0 and one <= max(1.0, most))
