"""Readings of a change of a wheel's force, without a run: by the track's responses to a force as it moves.

Theory: docs/theory/gauges.rst, section 16.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.gauges.responses import Responses
from wheeltapper.diagnosis.gauges.weighing import Band

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
AFTER = 256
"""Samples without force behind a run, so that its end is not felt at its beginning."""
PASSED = 1.3
"""Forces count up to this times the cut-off of the readings."""


class Changes:
    """Readings in a band of changes of a wheel's force.

    Parameters
    ----------
    band
        Readings that are compared.
    responses
        Of the track.
    """

    def __init__(self, band: Band, responses: Responses) -> None:
        passing = band.passing
        self._count = passing.lead + len(passing.readings) + AFTER
        frequencies = np.fft.rfftfreq(self._count, 1.0 / passing.rate)
        self._own = frequencies < min(PASSED * band.cutoff, responses.frequencies[-1])
        self.frequencies = frequencies[self._own]
        rows = band.rows
        turn = np.exp(2j * np.pi * self.frequencies[:, None] * (passing.lead + rows) / passing.rate)
        size = band.gain(self.frequencies) * np.where(self.frequencies > 0.0, 2.0, 1.0) / self._count
        read = responses.readings(self.frequencies, passing.x[rows]) * (turn * size[:, None])
        self._read = band.taken_of_rows(read)

    def spectra(self, forces: FloatArray) -> ComplexArray:
        """Return what `of_spectra` takes, (frequencies, ...), of forces at the samples of a run, N, (samples, ...)."""
        return np.asarray(np.fft.rfft(forces, self._count, axis=0)[self._own])

    def of_spectra(self, spectra: ComplexArray) -> FloatArray:
        """Return the readings, N, (readings, ...)."""
        return np.asarray(np.real(self._read @ spectra))

    def of(self, forces: FloatArray) -> FloatArray:
        """Return the readings of forces at the samples of a run, N, (readings, ...)."""
        return self.of_spectra(self.spectra(forces))
