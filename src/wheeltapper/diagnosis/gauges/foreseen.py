"""What pairs of gauges will show of flats around a wheel, before anything is recorded.

What a flat adds to readings is that of strikes moved to all places of the circumference, as in `scan`.

Theory: docs/theory/gauges.rst, section 16.9.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.stats import norm

from wheeltapper.diagnosis.gauges.fit import TRACK_STEP, Problem, covariance_of, moved
from wheeltapper.diagnosis.gauges.known import RADIUS, Known
from wheeltapper.diagnosis.gauges.passing import ADVANCE, FORCE, LENGTH, POSITION, SPEED, Passing, Runs
from wheeltapper.diagnosis.gauges.scan import SCREENED, Scan, Strikes
from wheeltapper.diagnosis.gauges.sizing import (
    MODEL_ERROR,
    SMOOTHED,
    coarse_problem,
    problem_of,
    values_of,
)
from wheeltapper.diagnosis.gauges.weighing import Weights

FloatArray = NDArray[np.float64]
BEFORE = 0.2
"""Places of the circumference count from so far before the first reading, m."""
STEPS = {LENGTH: 2e-3, POSITION: 1e-4, RADIUS: 5e-5}
"""Of differences: of a place in m, of all others over the value; 1e-3 where a value is not named. Unlike those of a fit
they move strikes in time, and are much shorter than a wave."""
DRAWN = 64
"""Wheels that are drawn for a probability."""
FOUND = 0.9
"""Probability from which on a flat counts as found."""


class Flat(NamedTuple):
    """A flat: its length, m, and its shape, "fresh" or "rounded"."""

    length: float
    shape: str


class Sensitivity(NamedTuple):
    """How compared readings change with a flat and all else that a fit leaves free.

    Attributes
    ----------
    problem
        The readings that are compared.
    readings
        With a flat at each of some places, N, (readings, places).
    changes
        With the logarithm of the length, and then with all other values, N, (readings, values, places).
    deviations
        Standard deviations of readings without roughness, N, (readings, places).
    precision
        One over the variances of values, gains, zero lines and their slopes, as they are known before.
    """

    problem: Problem
    readings: FloatArray
    changes: FloatArray
    deviations: FloatArray
    precision: FloatArray


class Foreseen:
    """A wheel like those to come, and what gauges will show of its flats.

    Parameters
    ----------
    passing
        A wheel without readings.
    known
        Of track and wheels.
    gain_spread
        Standard deviation of each sensor's gain.
    """

    def __init__(self, passing: Passing, known: Known, gain_spread: FloatArray) -> None:
        self.runs, self.known = Runs(passing, known.scene), known
        self.values = values_of(passing, known)
        self._gain_spread = gain_spread

    def places(self, count: int) -> FloatArray:
        """Return places where a flat's middle meets the rail first, m, equally apart over the circumference."""
        turn = 2.0 * np.pi * self.values[RADIUS]
        return np.asarray(self.runs.passing.x[0] - BEFORE + turn * np.arange(count) / count)

    def found(self, flat: Flat, count: int) -> FloatArray:
        """Return the probability that a flat is found at each of so many places.

        It is found where the scan's gain is more than `SCREENED`. The root of the gain is taken to be normally
        distributed, with the mean and the deviation of `DRAWN` wheels.
        """
        added = self.scan.weights.over(self._added(self._coarse, self.values, flat, self.places(count)))
        roots = [np.sqrt(self.scan.gains(one[:, None] + self._drawn)) for one in self.scan.explained(added).T]
        return np.array([norm.sf(np.sqrt(SCREENED), one.mean(), one.std(ddof=1)) for one in roots])

    def deviation(self, flat: Flat, count: int) -> FloatArray:
        """Return the least standard deviation of the length, m, at each of so many places (Cramér and Rao).

        All else is unknown with what is known before, as in a fit; the error of the model's length is not in it.
        """
        problem, told = self._fine, self.sensitivity(flat, count)
        out = []
        for number, deviations in enumerate(told.deviations.T):
            weights = Weights(deviations, problem.rough)
            free = [told.changes[..., number], self._beside(problem, told.readings[:, number])]
            jacobian = weights.over(np.concatenate(free, axis=1))
            curvature = jacobian.T @ weights.weighed(jacobian) + np.diag(told.precision)
            _, covariance = covariance_of(curvature, told.precision)
            out.append(flat.length * float(np.sqrt(covariance[0, 0])))
        return np.array(out)

    def sensitivity(self, flat: Flat, count: int) -> Sensitivity:
        """Return how readings change with all that a fit leaves free, with a flat at each of so many places."""
        problem, places = self._fine, self.places(count)
        names = (LENGTH, POSITION, FORCE, ADVANCE, SPEED, *self.known.spread)
        level = self._level(problem, self.values)
        added = self._added(problem, self.values, flat, places)
        changes = np.stack([self._change(problem, name, flat, places, level, added) for name in names], axis=1)
        error = MODEL_ERROR * np.stack([self._size(problem, one) for one in added.T], axis=1)
        noise = problem.band.deviations(problem.band.noise)[:, None]
        return Sensitivity(problem, level[:, None] + added, changes, np.hypot(noise, error), problem.precision(names))

    def gains_without_a_flaw(self, count: int, seed: int) -> FloatArray:
        """Return by how much a scan lowers χ² of so many wheels without a flaw."""
        return self.scan.gains(self.scan.explained(self._wheels(count, seed)))

    @cached_property
    def _drawn(self) -> FloatArray:
        return self.scan.explained(self._wheels(DRAWN, 0))

    def _wheels(self, count: int, seed: int) -> FloatArray:
        """Return what is left of readings of wheels without a flaw, over their deviations, (readings, count).

        Drawn are noise, roughness, and what the site does not know exactly, each as far as readings are linear in it.
        """
        rng, problem = np.random.default_rng(seed), self._coarse
        wrong = np.stack(self._level_errors(problem), axis=1)
        parts = (problem.rough, wrong)
        noise = problem.band.noise * rng.standard_normal((len(wrong), count))
        drawn = sum((one @ rng.standard_normal((one.shape[1], count)) for one in parts), start=noise)
        return self.scan.weights.over(drawn)

    @cached_property
    def _coarse(self) -> Problem:
        return coarse_problem(self.runs, self.values, self.known.spread, self._gain_spread)

    @cached_property
    def _fine(self) -> Problem:
        return problem_of(self.runs, self.values, self.known.spread, self._gain_spread, self.runs.highest)

    @cached_property
    def scan(self) -> Scan:
        """The scan by which such wheels are looked through."""
        return Scan(self._coarse, self.values)

    def _added(self, problem: Problem, values: dict[str, float], flat: Flat, places: FloatArray) -> FloatArray:
        """Return what a flat at places adds to compared readings, N, (readings, places)."""
        strikes = Strikes(self.runs, values, problem.anchor.transfer, flat.length, flat.shape)
        end, turn = float(self.runs.passing.x[-1]), 2.0 * np.pi * values[RADIUS]
        spectra = np.stack([strikes.at(np.arange(place, end, turn)) for place in places], axis=1)
        added = problem.anchor.transfer.of_spectra(spectra)
        for name, by in problem.away(values).items():
            added = added + by * problem.anchor.slopes()[name].of_spectra(spectra)
        return added

    def _level(self, problem: Problem, values: dict[str, float]) -> FloatArray:
        return problem.band.taken(problem.read(values, "fresh"))

    def _level_errors(self, problem: Problem) -> list[FloatArray]:
        """Return how compared readings of a wheel without a flaw change with a standard deviation of what is known."""
        level = self._level(problem, self.values)
        own = [0.0 * level]
        for name, share in self.known.spread.items():
            own.append(share * (self._level(problem, moved(self.values, name, TRACK_STEP)) - level) / TRACK_STEP)
        return own

    def _change(
        self, problem: Problem, name: str, flat: Flat, places: FloatArray, level: FloatArray, added: FloatArray
    ) -> FloatArray:
        """Return how compared readings change with a value, N, (readings, places)."""
        if name in (ADVANCE, SPEED):
            smooth, passing = problem.read(self.values, "fresh"), self.runs.passing
            by = 1.0 / passing.speed if name == ADVANCE else passing.seconds[:, None]
            slope = problem.band.taken(passing.rates(smooth) * by)
            return np.repeat(slope[:, None], len(places), axis=1)
        step = TRACK_STEP if name.startswith("track.") else STEPS.get(name, 1e-3)
        if name == POSITION:
            return (self._added(problem, self.values, flat, places + step) - added) / step
        if name == LENGTH:
            longer = flat._replace(length=flat.length * np.exp(step))
            return (self._added(problem, self.values, longer, places) - added) / step
        values = moved(self.values, name, step)
        changed = self._level(problem, values) - level
        return (changed[:, None] + self._added(problem, values, flat, places) - added) / step

    def _size(self, problem: Problem, added: FloatArray) -> FloatArray:
        """Return the size of what a flat adds around each compared reading, N."""
        band = problem.band
        whole = np.zeros(band.picked.shape)
        whole.T[band.picked.T] = np.abs(added)
        rows = band.rows
        near = max(3, round(SMOOTHED * band.passing.rate / max(1, int(np.diff(rows).min()))))
        whole[rows] = uniform_filter1d(whole[rows], near, axis=0)
        return band.taken(whole)

    def _beside(self, problem: Problem, total: FloatArray) -> FloatArray:
        """Return how compared readings change with gains, zero lines and their slopes, (readings, 3 * sensors)."""
        band = problem.band
        along = np.repeat(np.linspace(-1.0, 1.0, len(band.picked))[:, None], band.picked.shape[1], axis=1)
        whole = np.zeros(band.picked.shape)
        whole.T[band.picked.T] = total
        return np.concatenate([band.of_each(one) for one in (whole, np.ones_like(whole), along)], axis=1)


def smallest_found(lengths: FloatArray, probabilities: FloatArray) -> FloatArray:
    """Return the length that is found with the probability `FOUND` at each place, m; infinite where none is.

    `probabilities` are those of the lengths, (lengths, places). The shortest length is the answer where it is found.
    """
    rising = np.maximum.accumulate(probabilities, axis=0)
    return np.array([np.interp(FOUND, one, lengths, right=np.inf) for one in rising.T])
