"""How readings change with the deviations of a wheel's tread, to first order, also where contact is weak or lost.

A small deviation changes the force through the contact, whose stiffness at each instant is that of the force there, and
through all that the rail and the wheel give way to forces before.

Theory: docs/theory/gauges.rst, section 16.13.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import lu_factor, lu_solve

from wheeltapper.diagnosis.gauges.fit import Problem
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS
from wheeltapper.diagnosis.gauges.passing import SPEED, Tread, Values
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness
from wheeltapper.diagnosis.gauges.transfer import AFTER

FloatArray = NDArray[np.float64]
GRID, REACH = 8192, 0.06
"""Places of a turn at which it is known which of the tread touches the rail, and how far from there it may be, m."""


class Answers:
    """What small deviations of a tread add to readings.

    Parameters
    ----------
    problem
        The wheel's readings; its anchor is near these values.
    values
        Of the wheel and the track.
    tread
        Of the wheel.
    """

    def __init__(self, problem: Problem, values: Values, tread: Tread) -> None:
        self._problem, self._tread, values = problem, tread, problem.anchored(values)
        runs, passing, rate = problem.runs, problem.band.passing, problem.band.passing.rate
        count = passing.lead + len(passing.readings)
        force = np.maximum(runs.fine_forces(values, tread), 0.0)
        self._off_rail, self._speed = float((force == 0.0).mean()), values[SPEED]
        stiffness = contact_stiffness(values[CONTACT], 1.0) * np.cbrt(force)
        self._stiffness = np.maximum(runs.sampled(stiffness), 0.0)
        self._x = np.asarray(runs.start(values) + values[SPEED] * np.arange(count) / rate, dtype=float)
        frequencies = np.fft.rfftfreq(count + AFTER, 1.0 / rate).astype(np.float64)
        giving = problem.responses.giving_at_all(frequencies, values[MASS])
        kernels = np.fft.irfft(giving, count + AFTER, axis=0)
        lower, share = problem.responses.between_places(self._x)
        lag = (np.arange(count)[:, None] - np.arange(count)) % (count + AFTER)
        closed = (1.0 - share)[:, None] * kernels[lag, lower[:, None]] + share[:, None] * kernels[
            lag, lower[:, None] + 1
        ]
        closed *= self._stiffness[:, None]
        closed[np.arange(count), np.arange(count)] += 1.0
        self._closed = lu_factor(closed, overwrite_a=True, check_finite=False)

    @property
    def off_rail(self) -> float:
        """Share of the time at which the wheel does not touch the rail."""
        return self._off_rail

    def columns(self, radius: float) -> FloatArray:
        """Return how compared readings change with deviations, on a wheel of a radius, m: N/m, (readings, places)."""
        places = len(self._tread.deviations)
        ends = np.linspace(0.0, 2.0 * pi, places + 1)
        each = CubicSpline(ends, np.eye(places + 1, places) + np.eye(places + 1, places, -places), bc_type="periodic")
        height = each(touching(self._tread, radius, (self._x - self._tread.place) / radius))
        force = lu_solve(self._closed, self._stiffness[:, None] * height, check_finite=False)
        transfer = self._problem.anchor.transfer
        return transfer.of_spectra(transfer.spectra(force))


def touching(tread: Tread, radius: float, below: FloatArray) -> FloatArray:
    """Return at which angles, rad, a tread touches the rail while the angles `below` are over it.

    It is where the tread reaches lowest: a circle rolls over a hollow and does not reach into it.
    """
    step = 2.0 * pi / GRID
    reach = int(REACH / (radius * step))
    beside = np.arange(-reach, reach + 1)
    ends, around = np.linspace(0.0, 2.0 * pi, len(tread.deviations) + 1), np.arange(GRID)
    heights = CubicSpline(ends, np.append(tread.deviations, tread.deviations[0]), bc_type="periodic")(around * step)
    lowest = np.argmax(heights[(around[:, None] + beside) % GRID] - 0.5 * radius * (beside * step) ** 2, axis=1)
    ahead = np.append(beside[lowest], beside[lowest[0]]) * step
    angles = np.mod(below, 2.0 * pi)
    return np.asarray(np.mod(angles + np.interp(angles, np.arange(GRID + 1) * step, ahead), 2.0 * pi))
