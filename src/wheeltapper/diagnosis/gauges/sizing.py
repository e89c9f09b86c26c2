"""The flat of one wheel: found, sized, and told fresh from rounded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import ceil, floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from wheeltapper.describe.paths import value_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.alarms import PEAKS
from wheeltapper.diagnosis.faults.out_of_round import OutOfRoundWheel
from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.gauges.fit import TRACK_STEP, Anchor, Fit, Problem, fitted, moved, told_readings
from wheeltapper.diagnosis.gauges.free_shape import FreeShape, free_shape, refined, started
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS, RADIUS, Known
from wheeltapper.diagnosis.gauges.passing import ADVANCE, FORCE, LENGTH, POSITION, SPEED, Passing, Runs, Shape, Values
from wheeltapper.diagnosis.gauges.responses import Responses, responses_of
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness, rough_columns, rough_force, rough_of_others
from wheeltapper.diagnosis.gauges.scan import NEEDED, SCREENED, Candidate, Scan, Seen
from wheeltapper.diagnosis.gauges.transfer import Transfer
from wheeltapper.diagnosis.gauges.verdicts import EXPLAINED, NAMES, alike_of
from wheeltapper.diagnosis.gauges.weighing import Band, Weights, band_of
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.record.assessment.filtering import low_passed

FloatArray = NDArray[np.float64]
FIRST_WAVE, FIRST = 0.035, (200.0, 600.0)
"""First, readings are compared up to the frequency at which a wave of this length is passed, m, within these limits."""
FARTHER, ENOUGH = 1.5, 0.9
"""By how much this rises from fit to fit, up to that part of the highest one: far shorter waves mislead a fit."""
FIRST_NOISE = 250.0
"""Standard deviation of the readings then, N: coarse, as values are."""
ALSO, SHARE = 40.0, 0.35
"""Places of a flat are fitted if what they explain of χ² is less than the best by at most this much, or this share."""
OPEN = 30.0
"""Of flats at several places all are fitted below a higher frequency that leave at most so much more than the best."""
MODEL_ERROR, SMOOTHED = 0.04, 0.004
"""This part of a flat's own readings, averaged over so many seconds, is error of the model."""
OWN_LENGTH = 0.01
"""Standard deviation of a length that is error of the model, over the length."""
UNSETTLED = 1.2
"""A fit whose χ² is more than this times the number of readings is made once more, from where it has come to."""
ROUNDS = 2
"""So often a tread is fitted, with weights that belong to it."""
FINER = 4
"""Forces that are shown are so many to a sample."""
SMALLEST = 0.015
"""A flat is at least so long, m: else a wheel counts as healthy."""
ASKED, ODD, LIKELY, BETTER = 1.3, 1.3, 200.0, 0.25
"""A tread of free shape is asked for if χ² of a reading is more than the first with the best flat, or without one more
than the second. It is told if its first evidence exceeds that of flats and waves by so much, of wheels without a flaw
it is at most 62, and if it explains this part of χ² more than a flat that leaves less than EXPLAINED."""
HOPELESS, EXPLAINS = (600.0, 150.0), 1.05
"""A shape whose χ² exceeds the other's by so much, over the reduced χ², is not fitted by all values, nor once more;
unless the other leaves more than this of a reading: flats drawn, and found, left 0.7 to 1.02."""
PROMISING = 50.0
"""Flats that lower χ² by less, fitted by the values that come first, are not fitted further."""
OTHERWISE = 0.05
"""Answers of the track are linear in its values' logarithms as long as these change by less than this."""
FASTER = 1e-3
"""Runs at another speed are the same, but for when places are passed, as long as it differs by less than this share."""
APART = 0.05
"""A wheel is where it was measured up to so many m."""
CYCLES, STRIKES, NEW_PLACE = (-2, -1, 1, 2), (0, 1), 0.01
"""Where a flat that explains too little is sought once more: a strike is so many waves of the highest compared
frequency away, the other one of these two where it was; and by how much another place differs, m."""
LENGTHS = (1.1, 1.6)
"""A flat is fitted from so many times the length that the scan tells: its force below a low frequency grows less than
with the square of its length, and hardly more with a light wheel that flies over it, so that two lengths explain it."""
AS_LONG = 0.25
"""Lengths of one flat, fitted from two, differ by less than this share."""
LONGER = {"fresh": 1.0, "rounded": 1.3}
"""Length of a flat over that of the fresh one that is most like it."""


class ModelPassage(NamedTuple):
    """What a fitted wheel does while it passes the sensors.

    Attributes
    ----------
    x, force
        Places of the wheel, m, and the contact's force there, N, FINER times a sample. It holds that of the likeliest
        waves of roughness in what the model leaves of the readings.
    largest
        Force of its largest maximum, N.
    below
        Largest force below PEAKS, N.
    read
        What the sensors would have recorded of the flaw alone, N, (samples, sensors), up to the highest frequency at
        which readings are compared.
    """

    x: FloatArray
    force: FloatArray
    largest: float
    below: float
    read: FloatArray


@dataclass(frozen=True, eq=False)
class Sized:
    """What was found of a wheel.

    Attributes
    ----------
    fits
        Fits of flats by shape, "fresh" and "rounded"; empty without evidence of a flat.
    gain
        By how much the best fit lowers the χ² of a wheel without a flaw; without a fit, the scan's value of it.
    seen
        What the wheel's readings show before a fit.
    runs
        Number of runs that it took.
    shown
        Motion and forces of the model with the best flat, or with the tread of free shape; None for a wheel that counts
        as healthy.
    free
        The tread of free shape, if neither a flat nor waves explain the readings; otherwise None.
    least
        What lowers χ² by less may be error in what was subtracted from the readings.
    """

    fits: Mapping[str, Fit]
    gain: float
    seen: Seen
    runs: int
    shown: ModelPassage | None = None
    free: FreeShape | None = None
    least: float = 0.0

    @property
    def nearest(self) -> Fit | None:
        """The fitted flat that explains most, whether the wheel has one or not; None if none was fitted."""
        return min(self.fits.values(), key=lambda one: one.misfit, default=None)

    @property
    def best(self) -> Fit | None:
        """The flat that explains most; None if the wheel counts as healthy."""
        best = self.nearest
        return None if best is None or self.gain < NEEDED or best.values[LENGTH] < SMALLEST else best

    @property
    def is_doubtful(self) -> bool:
        """Whether the best flat may be error in what was subtracted from the readings."""
        return self.best is not None and self.gain < self.least

    @property
    def verdict(self) -> str:
        """The name of the fault in the catalogue, or "healthy"."""
        if not self.fits and not self.seen.is_round:
            return OutOfRoundWheel.name
        return HEALTHY if self.best is None else NAMES[self.best.shape]

    @property
    def flaw(self) -> Fit | FreeShape | None:
        """What is reported: the tread of free shape if there is one, or the best flat."""
        return self.free or self.best

    @property
    def leaves_much(self) -> bool:
        """Whether it is worth fitting a tread of free shape."""
        if self.best is not None:
            return not self.is_doubtful and self.best.chi > ASKED * self.best.readings
        if self.nearest is not None:
            return self.nearest.chi + self.gain > self.nearest.readings + max(LIKELY, self.least)
        return self.least == 0.0 and (self.seen.gain > SCREENED or self.seen.reduced > ODD)

    @property
    def alike(self) -> tuple[str, ...]:
        """Other verdicts that the readings do not exclude."""
        return tuple(NAMES[one.shape] for one in self.not_excluded)

    @property
    def not_excluded(self) -> tuple[Fit, ...]:
        """Flats of other shapes than the best one that the readings do not exclude."""
        return () if self.best is None else alike_of(self.fits.values(), self.best)

    def deviation(self, shape: str) -> float:
        """Return the standard deviation of a flat's length, m, with the error of the model."""
        fit = self.fits[shape]
        left = max(1.0, fit.chi / fit.readings)
        return fit.values[LENGTH] * float(np.sqrt(left * fit.deviation(LENGTH) ** 2 + OWN_LENGTH**2))


def sized_flat(
    passing: Passing,
    known: Known,
    gain_spread: FloatArray,
    seen: Seen | None = None,
    before: Sized | None = None,
    least: float = 0.0,
) -> Sized:
    """Return the flat that explains a wheel's readings best, as fresh and as rounded; none of a wheel out of round.

    Parameters
    ----------
    passing
        What was recorded.
    known
        Of track and wheels.
    gain_spread
        Standard deviation of each sensor's gain.
    seen
        What its readings show, if a scan for wheels alike has told it.
    before
        What was found of the wheel with other readings, as of neighbours that were not known: fits begin there.
    least
        As in `Sized`.
    """
    with algebra_on_one_thread():
        return _sized(passing, known, gain_spread, seen, before, least)


def scan_of(passing: Passing, known: Known) -> Scan:
    """Return what a flat would add to the readings of a wheel like this one."""
    with algebra_on_one_thread():
        runs, values = Runs(passing, known.scene), values_of(passing, known)
        return Scan(coarse_problem(runs, values, known.spread, np.ones(len(passing.sensors))), values)


def values_of(passing: Passing, known: Known) -> dict[str, float]:
    """Return the values of a wheel without a flaw, as they are known before."""
    paths = dict.fromkeys([MASS, RADIUS, CONTACT, *known.spread])
    own = {path: float(value_at(known.scene, path)) for path in paths}
    return own | {SPEED: passing.speed, FORCE: passing.static_force, ADVANCE: 0.0}


def coarse_problem(
    runs: Runs, values: dict[str, float], spread: Mapping[str, float], gain_spread: FloatArray
) -> Problem:
    """Return a wheel's readings up to the frequency at which a flat is looked for."""
    cutoff = min(float(np.clip(values[SPEED] / FIRST_WAVE, *FIRST)), runs.passing.highest)
    return problem_of(runs, values, spread, gain_spread, cutoff, deviation=FIRST_NOISE)


def _sized(
    passing: Passing, known: Known, gain_spread: FloatArray, seen: Seen | None, before: Sized | None, least: float
) -> Sized:  # fmt: skip
    runs, values = Runs(passing, known.scene), values_of(passing, known)
    coarse = cache(lambda: coarse_problem(runs, values, known.spread, gain_spread))  # none where nothing is fitted
    if seen is None:
        seen = Scan(coarse(), values).seen(passing.readings, passing.used)
    sized = Sized({}, seen.gain, seen, runs.count, least=least)
    if seen.candidates[0].gain >= SCREENED and seen.is_round:
        problem = coarse()
        if before is None or not before.fits:
            begun = _starts_by_shape(problem, _found(problem, seen))
        else:
            begun = {shape: fit.values for shape, fit in before.fits.items()}
        sized = _flats_of(problem, sized, begun)
        if sized.best is not None and sized.leaves_much and RADIUS in problem.spread:
            elsewhere = _of_another_radius(problem, begun["fresh"])
            other = _flats_of(problem, sized, _starts_by_shape(problem, elsewhere)) if elsewhere else sized
            if other.best is not None and other.best.misfit < sized.best.misfit:
                sized = other
    try:
        return _with_free_shape(coarse(), sized) if sized.leaves_much else sized
    except InputError:  # a tread that no circle rolls over explains nothing
        return replace(sized, runs=runs.count)


def _starts_by_shape(coarse: Problem, starts: Sequence[Mapping[str, float]]) -> dict[str, Mapping[str, float]]:
    """Return where fits begin, by shape: the best of some fresh flats, fitted below higher and higher frequencies.

    All values are free: a wheel and a track that are far from what is known would else lead flats to other places.
    """
    cutoff, names = coarse.band.cutoff, (*_first(coarse), *_later(coarse))
    while (cutoff := FARTHER * cutoff) < ENOUGH * coarse.runs.highest:
        starts = _ahead([_refitted(_up_to(cutoff, coarse, one), one, "fresh", names) for one in starts])
    start = starts[0]
    return {shape: {**start, LENGTH: longer * start[LENGTH]} for shape, longer in LONGER.items()}


def _flats_of(problem: Problem, sized: Sized, begun: Mapping[str, Mapping[str, float]]) -> Sized:
    """Return a wheel with the flats that explain its readings best; their fits begin at values by shape."""
    runs, first = problem.runs, _first(problem)
    fine = _fine(problem, begun["fresh"])
    fits = {shape: _refitted(fine, values, shape, first) for shape, values in begun.items()}
    best, gain = _best_with_gain(fine, fits)
    if gain > PROMISING:
        fits = _fits(fine, fits, first, _later(problem))
        best, gain = _best_with_gain(fine, fits)
    sized = replace(sized, fits=fits, gain=gain, runs=runs.count, shown=None)
    if sized.best is None:
        return sized
    return replace(sized, shown=_shown(_weighed(near(fine, best.values), best.values, best.shape), best))


def _with_free_shape(coarse: Problem, sized: Sized) -> Sized:
    """Return a wheel with the tread of free shape that explains it, or as it is where that explains no more."""
    runs, best = coarse.runs, sized.best
    begun = started(coarse, coarse.known, runs.highest)
    if begun.estimate.evidence < max(sized.seen.gain, 0.0) + LIKELY:
        return sized
    worn = [path for path in coarse.spread if path == RADIUS]
    names = [*worn, FORCE, ADVANCE, SPEED, *(path for path in coarse.spread if path not in worn)]
    flat = best if best is not None and best.chi < EXPLAINED * best.readings else None
    for _ in range(ROUNDS):  # weights belong to the tread
        fine = _weighed(_fine(coarse, begun.values), begun.values, begun.tread)
        found = refined(fine, begun, names)
        if flat is not None and found.now.chi > (1.0 - BETTER) * flat.chi:
            return replace(sized, runs=runs.count)
        begun = begun._replace(values=found.now.values, tread=found.tread, estimate=found.estimate)
    free = free_shape(fine, found, _flawless(fine, begun.values))
    if flat is not None and free.misfit > flat.misfit - BETTER * flat.chi:
        return replace(sized, runs=runs.count)
    return replace(sized, free=free, runs=runs.count, shown=_shown(fine, free))


def _fine(coarse: Problem, at: Mapping[str, float]) -> Problem:
    """Return readings up to the highest frequency, of a wheel that is known to be near some values."""
    return _up_to(coarse.runs.highest, coarse, at)


def _up_to(cutoff: float, coarse: Problem, at: Mapping[str, float]) -> Problem:
    return problem_of(coarse.runs, coarse.known, coarse.spread, coarse.gain_spread, cutoff, at=at)


def _flawless(problem: Problem, values: Mapping[str, float]) -> Fit:
    """Return the fit of a wheel without a flaw, near some values."""
    own = {name: value for name, value in values.items() if name not in (LENGTH, POSITION)}
    return fitted(problem, own, "fresh", (FORCE, ADVANCE, SPEED), steps=2)


def _first(problem: Problem) -> tuple[str, ...]:
    """Return the values by which a flat is fitted first."""
    return (LENGTH, POSITION, *(path for path in problem.spread if path == RADIUS), FORCE, ADVANCE, SPEED)


def _later(problem: Problem) -> tuple[str, ...]:
    """Return the values by which it is fitted besides, once it is near."""
    return tuple(path for path in problem.spread if path not in _first(problem))


def _found(coarse: Problem, seen: Seen) -> list[dict[str, float]]:
    """Return the fresh flats that explain a wheel's readings best below a low frequency."""
    most, names = seen.candidates[0].gain, _first(coarse)
    worth = [one for one in seen.candidates if one.gain > most - max(ALSO, SHARE * most)]
    starts = [_with_flat(coarse.known, one, RADIUS in names) for one in worth]
    return _best_of(coarse, [{**one, LENGTH: by * one[LENGTH]} for one in starts for by in LENGTHS])


def _of_another_radius(coarse: Problem, begun: Mapping[str, float]) -> list[dict[str, float]]:
    """Return other fresh flats that explain readings below a low frequency as well or better.

    If only one of a flat's strikes is well seen, the other one may be a wave off: with a radius of its own.
    """
    here = _best_of(coarse, [{**coarse.known, **{name: begun[name] for name in _first(coarse)}}])[0]
    grown = here[SPEED] / coarse.band.cutoff / (2.0 * np.pi)
    others = [
        {**here, RADIUS: here[RADIUS] + by * grown, POSITION: here[POSITION] - strike * 2.0 * np.pi * by * grown}
        for by in CYCLES
        for strike in STRIKES
    ]
    return [one for one in _best_of(coarse, [here, *others]) if _strikes_elsewhere(one, here)]


def _strikes_elsewhere(one: Values, other: Values) -> bool:
    """Return whether two flats strike at other places."""
    moved, widened = one[POSITION] - other[POSITION], 2.0 * np.pi * (one[RADIUS] - other[RADIUS])
    return max(abs(moved + strike * widened) for strike in STRIKES) > NEW_PLACE


def _is_same(one: Values, other: Values) -> bool:
    """Return whether two flats strike at the same places and are about as long."""
    return not _strikes_elsewhere(one, other) and abs(np.log(one[LENGTH] / other[LENGTH])) < AS_LONG


def _ahead(fits: Sequence[Fit]) -> list[dict[str, float]]:
    """Return the values of those of several flats that explain nearly as much as the best one, which comes first."""
    ranked = sorted(fits, key=lambda one: one.misfit)
    ahead = list[dict[str, float]]()
    for one in ranked:
        if one.misfit < ranked[0].misfit + OPEN and all(_strikes_elsewhere(one.values, other) for other in ahead):
            ahead.append(one.values)
    return ahead


def _best_of(coarse: Problem, starts: Sequence[dict[str, float]]) -> list[dict[str, float]]:
    """Return the fresh flats that explain most of those fitted from some values.

    What is far behind after one step is not fitted on, nor what has come to where a better one is.
    """
    names = _first(coarse)
    begun = sorted((fitted(coarse, start, "fresh", names, steps=1) for start in starts), key=lambda one: one.chi)
    worth = list[Fit]()
    for one in begun:
        if one.chi <= begun[0].chi + ALSO and not any(_is_same(one.values, other.values) for other in worth):
            worth.append(one)
    return _ahead([fitted(coarse, one.values, "fresh", names, 5, one.columns) for one in worth])


def _best_with_gain(fine: Problem, fits: Mapping[str, Fit]) -> tuple[Fit, float]:
    """Return the better flat, and by how much it lowers χ² of a wheel without a flaw."""
    best = min(fits.values(), key=lambda one: one.misfit)
    return best, _flawless(_weighed(fine, best.values, best.shape), best.values).chi - best.chi


def _fits(fine: Problem, starts: Mapping[str, Fit], first: Sequence[str], more: Sequence[str]) -> dict[str, Fit]:
    """Return flats of both shapes, fitted by all values; they start where the values that come `first` have led."""
    fits = dict[str, Fit]()
    for shape, fit in sorted(starts.items(), key=lambda one: one[1].misfit):
        for one in fits.values():  # the other shape begins where the better one has come to
            like = {**one.values, LENGTH: one.values[LENGTH] * LONGER[shape] / LONGER[one.shape]}
            fine = near(fine, like)
            fit = _refitted(fine, like, shape, first)
        columns = fit.columns
        for hopeless in HOPELESS:
            if any(_is_hopeless(fit, one, hopeless) for one in fits.values()):
                break
            fine = near(fine, fit.values)
            fit = _refitted(fine, fit.values, shape, (*first, *more), 10, columns, to_the_end=True)
            if fit.chi < UNSETTLED * fit.readings and near(fine, fit.values) is fine:
                break
            columns = {name: fit.columns[name] for name in more}  # readings are nearly linear in these
        fits[shape] = fit
    return fits


def _is_hopeless(fit: Fit, other: Fit, behind: float) -> bool:
    """Return whether a flat is so far behind another one that explains the readings."""
    reduced = other.chi / other.readings
    return reduced < EXPLAINS and fit.misfit > other.misfit + behind * max(1.0, reduced)


def _refitted(
    problem: Problem, values: Mapping[str, float], shape: str, names: Sequence[str], steps: int = 6,
    known: Mapping[str, FloatArray] | None = None, to_the_end: bool = False,
) -> Fit:  # fmt: skip
    """Return a flat that is fitted from these values, with weights that belong to them."""
    return fitted(_weighed(problem, values, shape), values, shape, names, steps, known, to_the_end)


def _shown(problem: Problem, flaw: Fit | FreeShape) -> ModelPassage:
    """Return what a fitted wheel does, of which a problem has the weights."""
    runs, passing, values = problem.runs, problem.band.passing, flaw.values
    record, rate = runs.record(values, flaw.shape), FINER * passing.rate
    read = told_readings(problem.read(values, flaw.shape), flaw.gains, flaw.zeros)
    first, waves = passing.lead / passing.rate, CubicSpline(passing.seconds, _force_of_waves(problem, read))

    def forces(times: FloatArray, own: FloatArray) -> FloatArray:
        added = waves(np.clip(times - first, 0.0, passing.seconds[-1]))
        return np.where(own > 0.0, np.maximum(own + added, 0.0), own)

    times = np.arange(FINER * (passing.lead + len(passing.readings))) / rate
    times = times[times <= record.end]
    force = forces(times, np.asarray(record.at(times).normal_force))
    peaks = forces(record.peaks.time.values, record.peaks.normal_force.values)[record.peaks.time.values >= first]
    begins = FINER * passing.lead
    window = force[begins:]
    x = np.asarray(passing.place + values[ADVANCE] + values[SPEED] * np.arange(len(window)) / rate)
    largest = max(float(window.max()), float(peaks.max(initial=0.0)))
    below = float(low_passed(force, rate, PEAKS)[begins:].max())
    return ModelPassage(x, window, largest, below, read)


def _force_of_waves(problem: Problem, read: FloatArray) -> FloatArray:
    """Return the force of the likeliest waves of roughness in what a model leaves of readings, N, at the samples."""
    band, known = problem.band, problem.known
    left = problem.weights.over(band.taken(band.smooth(band.passing.readings) - read))
    factors, stiffness = problem.weights.rough_factors(left), contact_stiffness(known[CONTACT], known[FORCE])
    return rough_force(band, problem.responses, stiffness, known[MASS], factors, band.passing.x)


def _with_flat(values: Mapping[str, float], one: Candidate, worn: bool) -> dict[str, float]:
    """Return values with a flat that may be there.

    The radius, too, is that of the candidate if wheels are `worn`.
    """
    radius = values[RADIUS] * (one.radius if worn else 1.0)
    return {**values, LENGTH: one.length, POSITION: one.position, RADIUS: radius}


def problem_of(
    runs: Runs, values: dict[str, float], spread: Mapping[str, float], gain_spread: FloatArray, cutoff: float,
    at: Mapping[str, float] | None = None, deviation: float | None = None,
) -> Problem:  # fmt: skip
    """Return a wheel's readings up to a frequency, Hz.

    Where and how fast it is, `at` says if it is known better than by `values`; then its track may differ, too. The
    deviation of readings is that of the noise where none is stated, N.
    """
    passing, scene = runs.passing, runs.scene
    band, responses = band_of(passing, cutoff), responses_around(passing, scene)
    stiffness = contact_stiffness(values[CONTACT], values[FORCE])
    rough = rough_columns(band, responses, stiffness, values[MASS])
    beside = rough_of_others(band, rough)
    weights = Weights(np.hypot(band.deviations(deviation or band.noise), beside), rough)
    anchor = _anchor(runs, band, at or values, spread)
    return Problem(runs, band, responses, anchor, weights, rough, beside, values, spread, gain_spread)


def near(problem: Problem, values: Mapping[str, float]) -> Problem:
    """Return a problem whose readings hold near other values of the track and another speed: itself, if they do."""
    apart = {SPEED: abs(np.log(values[SPEED] / problem.anchor.at[SPEED])), **problem.away(values)}
    if all(abs(by) < (FASTER if name == SPEED else OTHERWISE) for name, by in apart.items()):
        return problem
    return problem._replace(anchor=_anchor(problem.runs, problem.band, values, problem.spread))


def _anchor(runs: Runs, band: Band, values: Mapping[str, float], spread: Mapping[str, float]) -> Anchor:
    """Return where runs are made: on a track and at a speed of these values."""
    names = [name for name in spread if name.startswith("track.")]
    responses = _responses_at(runs, values, names)

    @cache
    def slopes() -> dict[str, Transfer]:
        out = {}
        for name in names:
            other = _responses_at(runs, moved(values, name, TRACK_STEP), names)
            out[name] = Transfer(band, responses.change_to(other, TRACK_STEP), values)
        return out

    return Anchor(values, Transfer(band, responses, values), slopes, {})


def read_of_flaw(runs: Runs, flaw: Fit | FreeShape) -> FloatArray:
    """Return what a flaw adds to what sensors record, up to the highest frequency, N, (samples, sensors)."""
    names = [name for name in flaw.values if name.startswith("track.")]
    transfer = Transfer(band_of(runs.passing, runs.highest), _responses_at(runs, flaw.values, names), flaw.values)
    flawless = runs.forces({**flaw.values, LENGTH: 0.0}, "fresh")
    return transfer.of(runs.forces(flaw.values, flaw.shape) - flawless) * flaw.gains


def _responses_at(runs: Runs, values: Mapping[str, float], names: Sequence[str]) -> Responses:
    """Return the responses of a track some of whose values are other ones."""
    return responses_around(runs.passing, runs.scene.replaced({name: values[name] for name in names}))


def responses_around(passing: Passing, scene: Scenario) -> Responses:
    """Return the responses of the scene's track around the sensors of a passing."""
    seat = float(scene.track.first_sleeper)
    places = tuple((float(one.x1) - seat, float(one.x2) - seat) for one in passing.sensors)
    spacing = float(scene.track.spacing)  # whole bays, so that other wheels find them computed
    ends = passing.x[0] - passing.speed * passing.lead / passing.rate - APART, passing.x[-1] + APART
    first, last = floor((ends[0] - seat) / spacing) * spacing, ceil((ends[1] - seat) / spacing) * spacing
    return responses_of(section_of(scene.track), places, first, last)._replace(seat=seat)


def _weighed(problem: Problem, values: Mapping[str, float], shape: Shape) -> Problem:
    """Return a problem with weights that allow for error of the model where a flaw has readings of its own."""
    band = problem.band
    own = problem.read(values, shape) - problem.read({**values, LENGTH: 0.0}, "fresh")
    error = np.hypot(MODEL_ERROR * band.taken(size_of(own, band.passing.rate)), problem.beside)
    return problem._replace(weights=Weights(np.hypot(band.deviations(band.noise), error), problem.rough))


def size_of(readings: FloatArray, rate: float) -> FloatArray:
    """Return the size of readings around each sample, N, (samples, sensors)."""
    return np.asarray(uniform_filter1d(np.abs(readings), max(3, round(SMOOTHED * rate)), axis=0))
