"""A wheel's flat by least squares: Gauss's and Newton's steps, with exact runs as values.

Readings follow from the forces of runs by `Transfer`. Runs are made on one track and at one speed, of an `Anchor`, so
that they share what they need of the track. Readings are linear in the logarithms of the track's values near these.

Theory: docs/theory/gauges.rst, section 16.4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.gauges.known import RADIUS
from wheeltapper.diagnosis.gauges.passing import (
    ADVANCE,
    FORCE,
    LENGTH,
    PLACES,
    POSITION,
    SPEED,
    Runs,
    Shape,
    Tread,
    Values,
)
from wheeltapper.diagnosis.gauges.responses import Responses
from wheeltapper.diagnosis.gauges.transfer import Transfer
from wheeltapper.diagnosis.gauges.weighing import Band, Weights

FloatArray = NDArray[np.float64]
ARRIVAL, MEASURED_SPEED, MEASURED_FORCE = 0.01, 0.002, 0.08
"""Standard deviations of where the wheel is at the first sample, m, of its speed and of its static force as measured
without a model, over these."""
STEPS = {LENGTH: 2e-3, POSITION: 1e-3, FORCE: 1e-3, RADIUS: 1e-3}
"""Of differences: of positions in m, of all others over the value; 2e-3 where a value is not named."""
TRACK_STEP = 1e-2
"""The same for values of the track: nothing jumps with them."""
LONGEST_STEP, FARTHEST = 0.3, 0.03
"""A step changes the logarithm of a value by this at most, that of an uncertain one by its standard deviation; and a
place by so many m."""
FEWEST, MOST = 0.004, 0.2
"""Of the length of a flat, m: where steps lead beyond, they are shortened."""
SURER = 2.0
"""Variances of what was known before are taken to be so many times smaller than stated: errors of the model are alike
in many readings, and would move loads, gains, mass and contact together."""
DONE = SURER
"""A fit ends where χ² falls, or would fall, by less than this: what is known to one standard deviation is as exact."""
AT_ONCE = (ADVANCE, SPEED)
"""Values of which derivatives cost no run."""
DAMPED, HELD, MORE, TRIES = 1e-5, 1e-3, 16.0, 4
"""Levenberg's and Marquardt's damping at the start, the least one after a step that led no further, the factor on it,
and how many steps are tried."""


class Fit(NamedTuple):
    """A flat that was fitted.

    Attributes
    ----------
    shape
        "fresh" or "rounded".
    values
        All values of the wheel and the track.
    names
        Of those that were free.
    covariance
        Of their logarithms (places: m), then of gains, zero lines in N, and their slopes.
    inverse
        Of the curvature of χ²/2: it would be the covariance if nothing were taken to be surer than stated.
    chi
        χ² with the deviations from what was known before.
    readings
        How many.
    gains, zeros
        Of the sensors; zero lines in N, then their slopes.
    columns
        Derivatives of compared readings by values of the wheel and of the track, N, by name.
    logarithm
        Of the determinant of the readings' covariance.
    """

    shape: str
    values: dict[str, float]
    names: tuple[str, ...]
    covariance: FloatArray
    inverse: FloatArray
    chi: float
    readings: int
    gains: FloatArray
    zeros: FloatArray
    columns: Mapping[str, FloatArray]
    logarithm: float

    @property
    def misfit(self) -> float:
        """χ² and the logarithm of the determinant of the covariance: what fits of the same readings differ in."""
        return self.chi + self.logarithm

    def deviation(self, name: str) -> float:
        """Return the standard deviation of a free value; of a place in m, of others over the value."""
        return float(np.sqrt(self.covariance[self.names.index(name), self.names.index(name)]))

    def interval(self, name: str, deviations: float) -> tuple[float, float]:
        """Return a free value less and more so many of its standard deviations."""
        by = deviations * self.deviation(name)
        return moved(self.values, name, -by)[name], moved(self.values, name, by)[name]


class Anchor(NamedTuple):
    """A track, and how a wheel moves along it, for which readings follow from runs; others near it are linear.

    Attributes
    ----------
    at
        Its values.
    transfer, slopes
        From forces to readings there, and how that changes with the logarithms of the track's values, by name.
    kept
        How readings change with these, with the forces of the first run for which it was asked: by name and by the
        kind of the wheel.
    """

    at: Mapping[str, float]
    transfer: Transfer
    slopes: Callable[[], Mapping[str, Transfer]]
    kept: dict[tuple[str, str], FloatArray]


class Problem(NamedTuple):
    """A wheel's readings in a band, and what is known before.

    Attributes
    ----------
    runs, band, responses, anchor, weights, rough
        Of the wheel and the track; what roughness adds to readings, as in `Weights`.
    beside
        Standard deviations of what that below other wheels adds, N.
    known
        Values before, by name.
    spread
        Their standard deviations, over the values.
    gain_spread
        Standard deviation of each sensor's gain.
    """

    runs: Runs
    band: Band
    responses: Responses
    anchor: Anchor
    weights: Weights
    rough: FloatArray
    beside: FloatArray
    known: dict[str, float]
    spread: Mapping[str, float]
    gain_spread: FloatArray

    def precision(self, names: Sequence[str]) -> FloatArray:
        """Return one over the variances of what is free: values, gains, zero lines and their slopes."""
        own = {**self.spread, SPEED: MEASURED_SPEED, FORCE: MEASURED_FORCE, ADVANCE: ARRIVAL}
        zero = np.full(2 * len(self.gain_spread), 1e-12)
        values = np.array([1.0 / own[n] ** 2 if n in own else 0.0 for n in names])
        return np.concatenate([SURER * values, SURER * self.gain_spread**-2.0, zero])

    def read(self, values: Values, shape: Shape) -> FloatArray:
        """Return what sensors would have recorded of a run, after the low-pass, N, (samples, sensors)."""
        transfer = self.anchor.transfer
        read = transfer.of(self.runs.forces(self.anchored(values), shape))
        for name, by in self.away(values).items():
            read = read + by * self.slope(values, shape, name)
        return transfer.retimed(read, values)

    def anchored(self, values: Values) -> dict[str, float]:
        """Return the values of the run from which the readings of a wheel follow."""
        return {**values, **{name: self.anchor.at[name] for name in (*self.track, *AT_ONCE)}}

    def away(self, values: Values) -> dict[str, float]:
        """Return how far the track's values are from those of the runs, as logarithms, by name; only where they are."""
        away = {name: float(np.log(values[name] / self.anchor.at[name])) for name in self.track}
        return {name: by for name, by in away.items() if by != 0.0}

    def slope(self, values: Values, shape: Shape, name: str) -> FloatArray:
        """Return how the readings of an anchored run change with the logarithm of a value of the track, N."""
        kind = "tread" if isinstance(shape, Tread) else shape if values.get(LENGTH, 0.0) > 0.0 else "round"
        transfer, kept = self.anchor.transfer, self.anchor.kept
        if (name, kind) not in kept:
            own = self.anchored(values)
            force, changed = (self.runs.forces(one, shape) for one in (own, moved(own, name, TRACK_STEP)))
            by_force = transfer.of((changed - force) / TRACK_STEP)
            kept[name, kind] = by_force + self.anchor.slopes()[name].of(force)
        return kept[name, kind]

    @property
    def track(self) -> list[str]:
        """The uncertain values of the track."""
        return [name for name in self.spread if name.startswith("track.")]

    def apart(self, name: str, value: float) -> float:
        """Return how far a value is from what was known before; 0 where nothing was."""
        if name == ADVANCE:
            return value
        return float(np.log(value / self.known[name])) if name in (*self.spread, SPEED, FORCE) else 0.0


def moved(values: Values, name: str, by: float) -> dict[str, float]:
    """Return values of which one is changed by a step: of its logarithm, or, of a place, in m."""
    held = values[name]
    return {**values, name: held + by if name in PLACES else held * float(np.exp(by))}


def fitted(
    problem: Problem, values: Values, shape: str, names: Sequence[str], steps: int = 10,
    known: Mapping[str, FloatArray] | None = None, to_the_end: bool = False,
) -> Fit:  # fmt: skip
    """Return a flat fitted to readings.

    Parameters
    ----------
    problem
        Readings, and what is known.
    values
        From which it starts.
    shape
        "fresh" or "rounded".
    names
        Values that are free.
    steps
        Most of them.
    known
        Derivatives by values, if they are known from another fit of the wheel near these values.
    to_the_end
        Whether it goes on, with new derivatives, where those that were corrected step by step lead no further.
    """
    search = Search(problem, shape, tuple(names))
    now = search.at(dict(values), np.ones(len(problem.gain_spread)), np.zeros(2 * len(problem.gain_spread)))
    columns = dict(known or {})
    damping, renewed = DAMPED, [name for name in names if name not in columns]
    for _ in range(steps):
        columns |= {name: search.change(now, name) for name in {*renewed, *AT_ONCE}.intersection(names)}
        jacobian, is_new = search.jacobian(now, columns), renewed == [*names]
        curvature, downhill = search.normal(now, jacobian)
        if not renewed and float(downhill @ np.linalg.solve(curvature, downhill)) < DONE:
            if not to_the_end:
                break
            renewed = [*names]
            continue
        for _ in range(TRIES):
            change = np.asarray(np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), downhill))
            after = search.stepped(now, change)
            if after is not None and after.chi < now.chi:
                break
            damping = max(damping * MORE, HELD)
        else:
            if is_new:
                break
            renewed = [*names]  # what was corrected step by step leads no further
            continue
        columns, renewed = search.corrected(columns, now, after), []
        fell, now, damping = now.chi - after.chi, after, max(damping / MORE, 1e-8)
        if fell < DONE:
            if is_new or not to_the_end:
                break
            renewed = [*names]
    inverse, covariance = covariance_of(curvature, search.precision)
    count = int(problem.band.counts.sum())
    return Fit(
        shape, now.values, search.names, covariance, inverse, now.chi, count, now.gains, now.zeros, columns,
        problem.weights.logarithm,
    )  # fmt: skip


def covariance_of(curvature: FloatArray, precision: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the inverse of a curvature, and the covariance of a fit that takes what is known to be surer than it is.

    `precision` is that of what was known, as it is taken.
    """
    inverse = np.asarray(np.linalg.inv(curvature))
    return inverse, inverse @ (curvature + (SURER - 1.0) * np.diag(precision)) @ inverse


def told_readings(readings: FloatArray, gains: FloatArray, zeros: FloatArray) -> FloatArray:
    """Return what sensors with gains and zero lines make of readings, N, (samples, sensors)."""
    count = len(gains)
    return readings * gains + zeros[:count] + _along(len(readings)) * zeros[count:]


def _along(samples: int) -> FloatArray:
    """Return by what a zero line's slope counts at samples."""
    return np.linspace(-1.0, 1.0, samples)[:, None]


class Now(NamedTuple):
    """Where a search is: values, gains, zero lines, smooth readings of the model, what is left, and χ²."""

    values: dict[str, float]
    gains: FloatArray
    zeros: FloatArray
    smooth: FloatArray
    left: FloatArray
    chi: float


class Search:
    """A search for the values that explain readings best."""

    def __init__(self, problem: Problem, shape: Shape, names: tuple[str, ...]) -> None:
        self.problem, self.shape, self.names = problem, shape, names
        self.recorded = problem.band.smooth(problem.band.passing.readings)
        self.along = _along(len(self.recorded))
        self.precision = problem.precision(names)
        self.limits = np.array([problem.spread.get(name, LONGEST_STEP) for name in names])
        self.limits[[name in PLACES for name in names]] = FARTHEST

    def at(self, values: dict[str, float], gains: FloatArray, zeros: FloatArray) -> Now:
        """Return what is left of the readings with these values."""
        problem = self.problem
        smooth = problem.read(values, self.shape)
        left = problem.weights.over(problem.band.taken(self.recorded - told_readings(smooth, gains, zeros)))
        known = self.deviations(values, gains, zeros)
        chi = problem.weights.square(left) + float((known**2 * self.precision).sum())
        return Now(values, gains, zeros, smooth, left, chi)

    def deviations(self, values: Values, gains: FloatArray, zeros: FloatArray) -> FloatArray:
        """Return how far all that is free is from what was known before."""
        return np.concatenate([[self.problem.apart(name, values[name]) for name in self.names], gains - 1.0, zeros])

    def change(self, now: Now, name: str) -> FloatArray:
        """Return how compared readings change with a value, N."""
        problem, passing = self.problem, self.problem.band.passing
        if name in (ADVANCE, SPEED):  # the same readings, earlier
            by = 1.0 / now.values[SPEED] if name == ADVANCE else passing.seconds[:, None]
            return problem.band.taken(passing.rates(now.smooth) * by)
        if name in problem.track:
            slope = problem.slope(now.values, self.shape, name)
            return problem.band.taken(problem.anchor.transfer.retimed(slope, now.values))
        step = STEPS.get(name, 2e-3)
        changed, beside = moved(now.values, name, step), self.in_time(now.values, name, step)
        for other, by in beside.items():
            changed = moved(changed, other, by)
        change = problem.band.taken((problem.read(changed, self.shape) - now.smooth) / step)
        return change - sum(by / step * self.change(now, other) for other, by in beside.items())

    def in_time(self, values: Values, name: str, step: float) -> dict[str, float]:
        """Return steps of how the wheel moves beside a step of a value, with which its flaw strikes at the same times.

        Readings are far from linear in these times: a wave of the highest frequency passes in the millisecond.
        """
        if name == POSITION:
            return {ADVANCE: step}
        if name == RADIUS:
            place = self.shape.place if isinstance(self.shape, Tread) else values[POSITION]
            ahead = place - self.problem.band.passing.place - values[ADVANCE]
            return {SPEED: step, ADVANCE: -float(np.expm1(step)) * ahead}
        return {}

    def corrected(self, columns: Mapping[str, FloatArray], now: Now, after: Now) -> dict[str, FloatArray]:
        """Return derivatives that explain how readings changed by a step, changed as little as that takes (Broyden).

        Those in which readings are linear stay as they are.
        """
        linear = (*self.problem.track, *AT_ONCE)
        pairs = [(after.values[name], now.values[name], name in PLACES) for name in self.names]
        step = np.array([new - old if place else np.log(new / old) for new, old, place in pairs])
        changed = self.problem.band.taken(after.smooth - now.smooth)
        missed = changed - sum(columns[name] * by for name, by in zip(self.names, step.tolist(), strict=True))
        over = np.where([name in linear for name in self.names], 0.0, step / self.limits)
        share = over / self.limits / max(float((over**2).sum()), 1e-30)
        return {**columns, **{name: columns[name] + missed * by for name, by in zip(self.names, share, strict=True)}}

    def jacobian(self, now: Now, columns: Mapping[str, FloatArray]) -> FloatArray:
        """Return the derivatives of the model's readings, over their deviations."""
        band = self.problem.band
        gains = np.repeat(now.gains, band.counts)
        one = np.ones_like(now.smooth)
        beside = [band.of_each(values) for values in (now.smooth, one, self.along * one)]
        of_values = np.stack([columns[name] * gains for name in self.names], axis=1)
        return self.problem.weights.over(np.concatenate([of_values, *beside], axis=1))

    def normal(self, now: Now, jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the curvature of χ²/2, and its slope downhill."""
        weighed = self.problem.weights.weighed(np.column_stack([jacobian, now.left]))
        curvature = jacobian.T @ weighed[:, :-1] + np.diag(self.precision)
        known = self.deviations(now.values, now.gains, now.zeros)
        return curvature, jacobian.T @ weighed[:, -1] - self.precision * known

    def stepped(self, now: Now, change: FloatArray) -> Now | None:
        """Return where a step leads; None where there is no such wheel."""
        free, count = len(self.names), len(now.gains)
        values = now.values
        for name, by in zip(self.names, np.clip(change[:free], -self.limits, self.limits).tolist(), strict=True):
            values = moved(values, name, by)
        if not FEWEST < values.get(LENGTH, 0.5 * MOST) < MOST:
            return None
        return self.at(values, now.gains + change[free : free + count], now.zeros + change[free + count :])
