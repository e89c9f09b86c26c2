"""What the average turn of a wheel shows: a flat, its length, and how much the wheel is out of round.

Theory: docs/theory/gauges.rst, section 16.11.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, circulant, solve_triangular
from scipy.optimize import least_squares

from wheeltapper.diagnosis.axle_box.turns import Turns, average_of
from wheeltapper.diagnosis.gauges.fit import FEWEST, MOST
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS, RADIUS, Known
from wheeltapper.diagnosis.gauges.orders import HIGHEST as ORDERS
from wheeltapper.diagnosis.gauges.orders import USUAL, OutOfRound, waves_found
from wheeltapper.diagnosis.gauges.passing import FORCE, LENGTH, POSITION, SPEED, Passing, Runs, Values
from wheeltapper.diagnosis.gauges.responses import Responses, bare_responses
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness, usual_amplitudes
from wheeltapper.diagnosis.gauges.scan import NEEDED, SCREENED
from wheeltapper.diagnosis.gauges.sizing import LONGER, MODEL_ERROR, SMALLEST, size_of, values_of
from wheeltapper.diagnosis.gauges.weighing import ORDER
from wheeltapper.lower.track.section import section_of
from wheeltapper.record.assessment.filtering import low_passed, passed_share

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
SAMPLED = 20.0
"""A model's accelerations are computed at so many times the cut-off frequency, a second: strikes are short."""
MODEL_TURNS = 5
"""Turns of a model that are averaged: in so many, strikes are all over a bay. One more runs before."""
LENGTHS = (0.012, 0.016, 0.022, 0.03, 0.042, 0.06, 0.085)
"""Of the flats that are looked for, m."""
FINER = 4
"""A model's turns have so many places to a bin, and flats are tried at each: what the low-pass leaves of a flat above
half the rate of bins, a tenth, is folded back in these, and does not move with it."""
OWN_LENGTH = 0.025
"""Standard deviation of a length that is error of the model, over the length: more than before gauges, since nobody on
board knows where seats are."""
GAIN, GAIN_SPREAD = "gain", 0.03
"""Of the accelerometer, and its standard deviation over it."""
SHIFT, ARRIVAL = "shift", 5e-3
"""Of a flat along the average turn, s, and what it may be off from where it was looked for."""
MIDDLE = 0.5
"""Where in its turns a model's flat strikes."""
BEYOND = 1.05
"""Orders count up to this times the cut-off frequency."""
STEP, SHIFT_STEP = 0.02, 2e-5
"""Of differences: of logarithms, and of the shift, s."""
EVALUATIONS, ENDS, ROUNDS = 7, 0.01, 2
"""Most steps of a fit, by what part χ² falls in each at least, and how often it is made, each time with new weights."""


class Flat(NamedTuple):
    """A flat that was fitted to the average turn.

    Attributes
    ----------
    shape
        "fresh" or "rounded".
    values
        Values of the wheel and the track, by path.
    names
        Names of the free values.
    deviations
        Standard deviations of the logarithms of the free values; that of the shift is in s.
    shift
        When the flat strikes, s after the beginning of the turn.
    chi, logarithm
        χ², including deviations from what was known before, and the logarithm of the determinant of the covariance.
    readings
        Number of accelerations that were compared.
    flawless
        χ² of a wheel without a flat, with the same weights.
    average
        The model's average turn, m/s².
    """

    shape: str
    values: dict[str, float]
    names: tuple[str, ...]
    deviations: FloatArray
    shift: float
    chi: float
    logarithm: float
    readings: int
    flawless: float
    average: FloatArray

    @property
    def misfit(self) -> float:
        """Measure by which fits of the same average are compared: the smaller, the better."""
        return self.chi + self.logarithm

    @property
    def length(self) -> float:
        """Length of the flat, m."""
        return self.values[LENGTH]

    @property
    def deviation(self) -> float:
        """Standard deviation of its length, m, with the error of the model."""
        left = max(1.0, self.chi / self.readings)
        return self.length * float(np.sqrt(left * self.deviations[self.names.index(LENGTH)] ** 2 + OWN_LENGTH**2))


class WheelSeen(NamedTuple):
    """What the average turn shows.

    Attributes
    ----------
    flats
        Fitted flats, the better one first; empty without evidence of a flat.
    gain
        By how much the best flat lowers χ²; without a fit, by how much the nearest of the tried flats does.
    orders
        Out-of-roundness of the wheel, besides the flat.
    lengths
        Lengths of fresh flats that would be found on half and on nine tenths of the circumference, m.
    """

    flats: tuple[Flat, ...]
    gain: float
    orders: OutOfRound
    lengths: tuple[float, float]

    @property
    def best(self) -> Flat | None:
        """The best flat; None if the wheel has none."""
        found = self.flats and self.gain >= NEEDED and self.flats[0].length >= SMALLEST
        return self.flats[0] if found else None


@dataclass(eq=False)
class Wheel:
    """A wheel on a track: what its axle box shows of heights, and of flats, in the average turn.

    Attributes
    ----------
    known
        Of the wheel and the track.
    static_force, force_spread
        N, and its standard deviation over it.
    turns
        Of the recording.
    speed
        m/s.
    cutoff
        Up to which accelerations are compared, Hz.
    """

    known: Known
    static_force: float
    force_spread: float
    turns: Turns
    speed: float
    cutoff: float
    period: float = field(init=False)
    runs: Runs = field(init=False, repr=False)
    responses: Responses = field(init=False, repr=False)
    values: dict[str, float] = field(init=False, repr=False)
    spread: dict[str, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.period = self.turns.mean
        rate = SAMPLED * self.cutoff
        count = ceil((MODEL_TURNS + 1.1) * self.period * rate)
        nothing, none = np.zeros((count, 1)), np.zeros((count, 1), dtype=bool)
        passing = Passing((), rate, nothing, none, 0.0, self.speed, self.static_force, 0.0)
        self.runs = Runs(passing, self.known.scene)
        self.responses = bare_responses(section_of(self.known.scene.track))
        self.values = values_of(passing, self.known)
        own = {FORCE: self.force_spread, **self.known.spread, GAIN: GAIN_SPREAD}
        self.spread = {name: share for name, share in own.items() if share > 0.0}

    def answer(self, frequencies: FloatArray) -> ComplexArray:
        """Return the acceleration per height below the wheel, in the mean over a bay, 1/s²."""
        stiffness, mass = contact_stiffness(self.values[CONTACT], self.static_force), self.values[MASS]
        passed = passed_share(frequencies, self.runs.passing.rate, self.cutoff, ORDER)
        return np.asarray(self.responses.contact(frequencies, stiffness, mass)[:, :-1].mean(axis=1) * passed / mass)

    def waves(self, orders: FloatArray) -> FloatArray:
        """Return the average turn of orders of 1 m, as cosines and then as sines, (bins, 2 * orders), 1/s²."""
        along = 2j * np.pi * np.arange(self.turns.bins)[:, None] / self.turns.bins
        columns = self.answer(orders / self.period) * np.exp(along * orders)
        return np.concatenate([columns.real, columns.imag], axis=1)

    def model(self, values: Values, shape: str) -> FloatArray:
        """Return the average turn of a flat that strikes at its begin, (FINER * bins,), m/s²."""
        turning = {**values, SPEED: 2.0 * pi * values[RADIUS] / self.period}
        turning[POSITION] = MIDDLE * self.period * turning[SPEED]
        passing = self.runs.passing
        forces = low_passed(self.runs.forces(turning, shape), passing.rate, self.cutoff, ORDER)
        turns = Turns(self.period, 0.0, MODEL_TURNS + 1, FINER * self.turns.bins)
        average, _ = average_of(turns.folded(forces[passing.lead :], passing.rate)[1:])
        return moved(average / values[MASS], -MIDDLE)

    def usual(self, wide: bool) -> FloatArray:
        """Return the average turn of the roughness that wheels may have, and if `wide` of all out-of-roundness."""
        orders = np.arange(1.0, 1.0 + int(BEYOND * self.cutoff * self.period))
        turn = self.period * self.speed
        size = usual_amplitudes((orders - 0.5) / turn, 1.0 / turn)
        if wide:
            size = np.hypot(size, np.where(orders <= ORDERS, USUAL / orders, 0.0))
        return np.asarray(self.waves(orders) * np.tile(size, 2))


class Weights:
    """The inverse of a covariance σ² + R·Rᵀ of average turns, as what makes them independent, of unit variance."""

    def __init__(self, deviations: FloatArray, rough: FloatArray) -> None:
        self._lower = cholesky(np.diag(deviations**2) + rough @ rough.T, lower=True)

    def white(self, average: FloatArray) -> FloatArray:
        """Return average turns, (bins, ...), made independent."""
        return np.asarray(solve_triangular(self._lower, average, lower=True))

    @property
    def logarithm(self) -> float:
        """Logarithm of the determinant of the covariance."""
        return float(2.0 * np.log(np.diag(self._lower)).sum())


def moved(average: FloatArray, turns: float) -> FloatArray:
    """Return an average turn later by a part of a turn."""
    lines = np.fft.rfft(average)
    return np.fft.irfft(lines * np.exp(-2j * np.pi * np.arange(len(lines)) * turns), len(average))


def seen_of(wheel: Wheel, average: FloatArray, error: FloatArray) -> WheelSeen:
    """Return what an average turn, m/s², with its standard errors shows of a wheel."""
    wide = wheel.usual(True)
    flawless = wheel.model({**wheel.values, LENGTH: 0.0}, "fresh")
    tried = [wheel.model({**wheel.values, LENGTH: length}, "fresh") - flawless for length in LENGTHS]
    gains, norms = _scanned(Weights(error, wide), average, tried)
    best = int(np.argmax(gains.max(axis=1)))
    place = int(np.argmax(gains[best]))
    lengths = _found_from(norms)
    if gains[best, place] < SCREENED:
        return WheelSeen((), float(gains[best, place]), _orders(wheel, average, error), lengths)
    start = {**wheel.values, LENGTH: LENGTHS[best], SHIFT: place / (FINER * len(average)) * wheel.period, GAIN: 1.0}
    fits: list[Flat] = []
    for shape in LONGER:
        before = fits[0].values if fits else start
        begin = {**before, LENGTH: before[LENGTH] * LONGER[shape]}
        for _ in range(ROUNDS):
            fit = _fitted(wheel, average, error, wide, begin, shape)
            begin = fit.values
        fits.append(fit)
    fits.sort(key=lambda one: one.misfit)
    first = fits[0]
    seen = WheelSeen(tuple(fits), first.flawless - first.chi, _orders(wheel, average, error), lengths)
    if seen.best is None:
        return seen
    wider = np.hypot(error, _own_error(wheel, first.average))
    return seen._replace(orders=_orders(wheel, average - first.average, wider))


def _scanned(weights: Weights, average: FloatArray, tried: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return by how much flats lower χ², (lengths, places), and by how much they would if they were there.

    Places are FINER to a bin.
    """
    left, gains, norms = weights.white(average), [], []
    for one in tried:
        between = [circulant(np.roll(one, step)[::FINER]) for step in range(FINER)]
        columns = weights.white(np.stack(between, axis=2).reshape(len(average), -1))
        norms.append(np.sum(columns**2, axis=0))
        gains.append(2.0 * columns.T @ left - norms[-1])
    return np.array(gains), np.array(norms)


def _found_from(norms: FloatArray) -> tuple[float, float]:
    """Return the lengths from which on flats are found on half of the circumference, and on nine tenths of it."""
    smallest = [
        np.exp(np.interp(np.log(NEEDED), np.log(np.maximum.accumulate(one)), np.log(LENGTHS))) for one in norms.T
    ]
    half, most = np.quantile(np.maximum(smallest, SMALLEST), [0.5, 0.9])
    return float(half), float(most)


def _own_error(wheel: Wheel, average: FloatArray) -> FloatArray:
    """Return the error of a model's own average turn, m/s²."""
    three = np.tile(average, 3)[:, None]
    sized = size_of(three, wheel.turns.bins / wheel.period)[:, 0]
    return MODEL_ERROR * sized[len(average) : 2 * len(average)]


def _orders(wheel: Wheel, average: FloatArray, error: FloatArray) -> OutOfRound:
    """Return the orders that explain an average turn."""
    orders = np.arange(1.0, ORDERS + 1.0)
    before = np.tile(USUAL / orders, 2)
    weights = Weights(error, wheel.usual(False))
    columns = weights.white(wheel.waves(orders) * before)
    covariance = np.asarray(np.linalg.inv(columns.T @ columns + np.eye(len(before))), dtype=np.float64)
    return waves_found(columns.T @ weights.white(average), covariance, before, 0.0)


def _fitted(
    wheel: Wheel, average: FloatArray, error: FloatArray, wide: FloatArray, begin: Values, shape: str
) -> Flat:  # fmt: skip
    """Return a flat fitted to an average turn, from values where it begins."""
    names = (LENGTH, SHIFT, *wheel.spread)
    centre = {**begin, **wheel.values, GAIN: 1.0}
    spread = np.array([wheel.spread.get(name, np.inf) for name in names])
    scale = np.where(np.isfinite(spread), spread, [ARRIVAL if name == SHIFT else 0.2 for name in names])

    def values_at(x: FloatArray) -> dict[str, float]:
        by = dict(zip(names, x.tolist(), strict=True))
        out = {**centre, **{name: centre[name] * float(np.exp(one)) for name, one in by.items()}}
        return out | {LENGTH: min(max(out[LENGTH], FEWEST), MOST), SHIFT: centre[SHIFT] + by[SHIFT]}

    def told(x: FloatArray) -> FloatArray:
        values = values_at(x)
        run = {name: value for name, value in values.items() if name not in (SHIFT, GAIN)}
        return values[GAIN] * moved(wheel.model(run, shape), values[SHIFT] / wheel.period)[::FINER]

    x = np.array([0.0 if name in (LENGTH, SHIFT) else np.log(begin[name] / centre[name]) for name in names])
    weights = Weights(np.hypot(error, _own_error(wheel, told(x))), wide)

    def left(x: FloatArray) -> FloatArray:
        return np.concatenate([weights.white(told(x) - average), x / spread])

    def slopes(x: FloatArray) -> FloatArray:
        now = told(x)
        steps = np.diag([SHIFT_STEP if name == SHIFT else STEP for name in names])
        columns = np.stack([(told(x + step) - now) / step.sum() for step in steps], axis=1)
        return np.concatenate([weights.white(columns), np.diag(1.0 / spread)])

    found = least_squares(left, x, slopes, x_scale=scale, max_nfev=EVALUATIONS, ftol=ENDS)
    values, jacobian = values_at(found.x), np.asarray(found.jac)
    deviations = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    flawless = float(np.sum(weights.white(average) ** 2))
    return Flat(
        shape, values, names, deviations, values[SHIFT], 2.0 * float(found.cost), weights.logarithm, len(average),
        flawless, told(found.x),
    )  # fmt: skip
