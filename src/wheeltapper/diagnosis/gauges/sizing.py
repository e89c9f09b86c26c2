"""The flat of one wheel: found, sized, and told fresh from rounded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from wheeltapper.describe.paths import value_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.rounded_flat import RoundedFlat
from wheeltapper.diagnosis.faults.wheel_flat import FreshFlat
from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.gauges.changes import Changes
from wheeltapper.diagnosis.gauges.fit import Fit, Problem, fitted
from wheeltapper.diagnosis.gauges.passing import ADVANCE, FORCE, LENGTH, POSITION, SPEED, Passing, Runs
from wheeltapper.diagnosis.gauges.responses import Responses, responses_of
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness, rough_columns
from wheeltapper.diagnosis.gauges.scan import Candidate, candidates
from wheeltapper.diagnosis.gauges.weighing import Weights, band_of
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common.blocks import algebra_on_one_thread

FloatArray = NDArray[np.float64]
NAMES = {flat.shape: flat.name for flat in (FreshFlat, RoundedFlat)}
"""Of the faults, by the shapes of flats."""
CONTACT = "contact.constant_per_wheel"
MASS, RADIUS = "vehicle.mass", "vehicle.radius"
HIGHEST = 800.0
"""Readings are compared up to this frequency, Hz."""
FIRST_WAVE, FIRST = 0.05, (200.0, 600.0)
"""At first they are compared up to the frequency at which a wave of this length is passed, m, within these limits."""
FIRST_NOISE = 400.0
"""Standard deviation of the readings then, N: coarse, as values are."""
CANDIDATES, ALSO, SHARE = 3, 40.0, 0.35
"""So many places of a flat are fitted, if what they explain of χ² is less than the best by at most this much, and this
share."""
MODEL_ERROR, SMOOTHED = 0.04, 0.004
"""This part of a flat's own readings, averaged over so many seconds, is error of the model."""
OWN_LENGTH = 0.025
"""Standard deviation of a length that is error of the model, over the length."""
ROUNDS, UNSETTLED = 2, 1.2
"""A fit whose χ² is more than this times the number of readings is made once more, from where it has come to."""
SCREENED = 25.0
"""A wheel of which no flat lowers χ² by so much at first has none: of eight without a flaw the largest was 14."""
NEEDED, SMALLEST = 100.0, 0.015
"""A flat lowers χ² by so much at least, and is so long, m: else a wheel counts as healthy."""
TOLD = 60.0
"""Fresh and rounded flats are told from each other where χ² differs by so much, over the reduced χ² of the better one.
Of a fresh flat of 29 mm at 30 m/s, with roughness, the rounded one was better by 37."""
LONGER = 1.3
"""Length of a rounded flat over that of the fresh one that is most like it."""


class Known(NamedTuple):
    """What is known of a site's track and its wheels.

    Attributes
    ----------
    scene
        One wheel without a flaw on the site's track; its x is that of the site.
    spread
        Standard deviations over values, by their paths in `scene`.
    """

    scene: Scenario
    spread: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Sized:
    """What was found of a wheel.

    Attributes
    ----------
    fits
        Of flats by shape, "fresh" and "rounded"; none where nothing speaks for a flat.
    gain
        By how much the best of them lowers χ² of a wheel without a flaw.
    candidates
        Where the flat was looked for.
    runs
        How many runs it took.
    """

    fits: Mapping[str, Fit]
    gain: float
    candidates: tuple[Candidate, ...]
    runs: int

    @property
    def best(self) -> Fit | None:
        """The flat that explains most; None where the wheel counts as healthy."""
        best = min(self.fits.values(), key=lambda one: one.misfit, default=None)
        return None if best is None or self.gain < NEEDED or best.values[LENGTH] < SMALLEST else best

    @property
    def verdict(self) -> str:
        """The name of the fault in the catalogue, or "healthy"."""
        return HEALTHY if self.best is None else NAMES[self.best.shape]

    @property
    def alike(self) -> tuple[str, ...]:
        """Other verdicts that the readings do not exclude."""
        best = self.best
        if best is None:
            return ()
        most = best.misfit + TOLD * max(1.0, best.chi / best.readings)
        return tuple(NAMES[one.shape] for one in self.fits.values() if best.misfit < one.misfit < most)

    def deviation(self, shape: str) -> float:
        """Return the standard deviation of a flat's length, m, with the error of the model."""
        fit = self.fits[shape]
        left = max(1.0, fit.chi / fit.readings)
        return fit.values[LENGTH] * float(np.sqrt(left * fit.deviation(LENGTH) ** 2 + OWN_LENGTH**2))


def sized_flat(passing: Passing, known: Known, gain_spread: FloatArray) -> Sized:
    """Return the flat that explains a wheel's readings best, as fresh and as rounded.

    Parameters
    ----------
    passing
        What was recorded.
    known
        Of track and wheels.
    gain_spread
        Standard deviation of each sensor's gain.
    """
    with algebra_on_one_thread():
        return _sized(passing, known, gain_spread)


def _sized(passing: Passing, known: Known, gain_spread: FloatArray) -> Sized:
    runs, scene = Runs(passing, known.scene), known.scene
    paths = dict.fromkeys([MASS, RADIUS, CONTACT, *known.spread])
    values: dict[str, float] = {path: float(value_at(scene, path)) for path in paths}
    values |= {SPEED: passing.speed, FORCE: passing.static_force, ADVANCE: 0.0}
    track = [path for path in known.spread if path.startswith("track.")]
    own = [path for path in paths if path not in track]
    first_cutoff = float(np.clip(passing.speed / FIRST_WAVE, *FIRST))
    coarse = _problem(runs, values, known.spread, gain_spread, first_cutoff, FIRST_NOISE)
    places = candidates(runs, values, coarse.band, coarse.changes, coarse.weights, CANDIDATES)
    if places[0].gain < SCREENED:
        return Sized({}, places[0].gain, tuple(places), runs.count)
    worth = [one for one in places if one.gain > places[0].gain - max(ALSO, SHARE * places[0].gain)]
    first = (LENGTH, POSITION, RADIUS, FORCE, ADVANCE, SPEED)
    tried = [fitted(coarse, _with_flat(values, one), "fresh", first, steps=5) for one in worth]
    start = min(tried, key=lambda one: one.chi).values
    fine = _problem(runs, values, known.spread, gain_spread, HIGHEST)
    fits: dict[str, Fit] = {}
    every, of_track = (*first, *[path for path in own if path != RADIUS]), None
    for shape, longer in (("fresh", 1.0), ("rounded", LONGER)):
        begin = {**start, LENGTH: longer * start[LENGTH]}
        fit = fitted(_weighed(fine, values, begin, shape), begin, shape, first, steps=5)
        for _ in range(ROUNDS):
            fit = fitted(_weighed(fine, values, fit.values, shape), fit.values, shape, every, track, known=of_track)
            of_track = fit.track
            if fit.chi < UNSETTLED * fit.readings:
                break
            of_track = None
        fits[shape], of_track = fit, fit.track
    best = min(fits.values(), key=lambda one: one.misfit)
    flawless = fitted(_weighed(fine, values, best.values, best.shape), values, best.shape, (FORCE, ADVANCE, SPEED))
    return Sized(fits, flawless.chi - best.chi, tuple(places), runs.count)


def _with_flat(values: Mapping[str, float], one: Candidate) -> dict[str, float]:
    """Return values with a flat that may be there; it is longer than its readings below a low frequency say."""
    return {
        **values, LENGTH: 1.1 * one.length, POSITION: one.position, RADIUS: one.radius * values[RADIUS],
    }  # fmt: skip


def _problem(
    runs: Runs, values: dict[str, float], spread: Mapping[str, float], gain_spread: FloatArray, cutoff: float,
    deviation: float | None = None,
) -> Problem:  # fmt: skip
    """Return a wheel's readings up to a frequency, Hz; their deviation is that of the noise where none is stated, N."""
    passing, scene = runs.passing, runs.scene
    band, responses = band_of(passing, cutoff), _responses(passing, scene)
    stiffness = contact_stiffness(values[CONTACT], values[FORCE])
    rough = rough_columns(band, responses, stiffness, values[MASS])
    weights = Weights(np.full(band.counts.sum(), deviation or band.noise), rough)
    return Problem(runs, band, Changes(band, responses), weights, rough, values, spread, gain_spread)


def _responses(passing: Passing, scene: Scenario) -> Responses:
    """Return the responses of the track around the sensors."""
    seat = float(scene.track.first_sleeper)
    places = tuple((float(one.x1) - seat, float(one.x2) - seat) for one in passing.sensors)
    first, last = float(passing.x[0]) - seat, float(passing.x[-1]) - seat
    return responses_of(section_of(scene.track), places, first, last)._replace(seat=seat)


def _weighed(problem: Problem, flawless: Mapping[str, float], values: Mapping[str, float], shape: str) -> Problem:
    """Return a problem with weights that allow for error of the model where a flat has readings of its own."""
    band, runs = problem.band, problem.runs
    own = np.abs(band.smooth(runs.readings(values, shape) - runs.readings(flawless, "fresh")))
    width = max(3, round(SMOOTHED * band.passing.rate))
    error = MODEL_ERROR * band.taken(uniform_filter1d(own, width, axis=0))
    return problem._replace(weights=Weights(np.hypot(band.noise, error), problem.rough))
