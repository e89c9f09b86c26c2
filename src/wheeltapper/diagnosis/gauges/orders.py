"""A wheel that is out of round: waves that fit its circumference a whole number of times.

Readings are linear in the waves' amplitudes while the wheel keeps contact.

Theory: docs/theory/gauges.rst, section 16.5.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.gauges.fit import Problem
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS
from wheeltapper.diagnosis.gauges.passing import FORCE
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness, wave_columns
from wheeltapper.diagnosis.gauges.weighing import Freed

FloatArray = NDArray[np.float64]
HIGHEST = 20
"""The highest order."""
USUAL = 5e-4
"""Standard deviation of the first order's amplitude before anything was recorded, m; that of others is this over their
order."""
KNOWN = 0.25
"""Standard deviation of an amplitude that is known, over it."""


class OutOfRound(NamedTuple):
    """How much a wheel is out of round.

    Attributes
    ----------
    gain
        By how much the waves lower χ², less what as many waves would explain by chance.
    amplitudes, deviations
        Amplitudes of the orders 1, 2, ..., and their standard deviations, m.
    phases
        Phases of the orders, rad: the deviation is Σ amplitude·cos(order·θ + phase), θ = (x - place)/R.
    place
        Where the wheel's angle is zero, m along the track.
    """

    gain: float
    amplitudes: FloatArray
    deviations: FloatArray
    phases: FloatArray
    place: float

    @property
    def largest(self) -> int:
        """The order whose amplitude is largest over its standard deviation."""
        return int(np.argmax(self.amplitudes / self.deviations)) + 1

    @property
    def known(self) -> list[int]:
        """Orders whose amplitudes are known to within a quarter of their values."""
        return [int(one) + 1 for one in np.flatnonzero(self.deviations < KNOWN * self.amplitudes)]

    @property
    def unknown(self) -> list[int]:
        """Orders that the readings hardly determine: less than twice as well as they were known before."""
        orders = np.arange(1, len(self.deviations) + 1)
        return [int(one) for one in orders[self.deviations > 0.5 * USUAL / orders]]

    def rows(self) -> list[dict[str, float]]:
        """Return each order with its amplitude, its deviation, m, and its phase, rad."""
        columns = zip(self.amplitudes.tolist(), self.deviations.tolist(), self.phases.tolist(), strict=True)
        names = ("order", "amplitude", "deviation", "phase")
        return [dict(zip(names, (order, *values), strict=True)) for order, values in enumerate(columns, 1)]


class Orders:
    """What waves of the circumference add to a wheel's readings.

    Parameters
    ----------
    problem
        The wheel's readings.
    freed
        Their weights.
    radius
        Of the wheel, m.
    """

    def __init__(self, problem: Problem, freed: Freed, radius: float) -> None:
        known = problem.known
        number = np.arange(1, HIGHEST + 1) / (2.0 * pi * radius)
        columns = wave_columns(
            problem.band, problem.responses, contact_stiffness(known[CONTACT], known[FORCE]), known[MASS], number
        )
        self._before = np.tile(USUAL / np.arange(1, HIGHEST + 1), 2)
        columns = problem.weights.over(columns * self._before)
        self._weighed, self._place = freed.weighed(columns), problem.band.passing.place
        self._covariance: FloatArray = np.asarray(
            np.linalg.inv(columns.T @ self._weighed + np.eye(2 * HIGHEST)), dtype=np.float64
        )

    def found(self, left: FloatArray) -> OutOfRound:
        """Return the waves that explain what is left of readings, over their deviations."""
        return waves_found(self._weighed.T @ left, self._covariance, self._before, self._place)


def waves_found(along: FloatArray, covariance: FloatArray, before: FloatArray, place: float) -> OutOfRound:
    """Return the orders that explain readings best.

    Parameters
    ----------
    along
        What the waves, cosines and then sines, have in common with the readings, weighed, (2 * orders,).
    covariance
        Of the waves' amplitudes over `before`, after the readings.
    before
        Standard deviations of amplitudes before, m.
    place
        Where the wheel's angle is zero, m along the track.
    """
    best = covariance @ along
    gain = float(along @ best + np.linalg.slogdet(covariance)[1])
    cosine, sine = (before * best).reshape(2, -1)
    amplitude, many = np.hypot(cosine, sine), len(cosine)
    whole = covariance * np.outer(before, before)
    turn = np.stack([np.diag(cosine / amplitude), np.diag(sine / amplitude)], axis=1).reshape(many, -1)
    deviation = np.sqrt(np.diag(turn @ whole @ turn.T))
    return OutOfRound(gain, amplitude, deviation, np.arctan2(-sine, cosine), place)
