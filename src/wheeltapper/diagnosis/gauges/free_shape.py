"""A tread of free shape: what explains the readings of a wheel that no flat explains.

The tread's deviations at equal angles are estimated with a Gaussian prior. They are alike over a short way, and their
level may differ from place to place: both are told by the evidence of the readings. The first estimate is that about
a round wheel; steps of Gauss and Newton with exact runs follow.

Theory: docs/theory/gauges.rst, section 16.13.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from wheeltapper.diagnosis.gauges.answers import Answers
from wheeltapper.diagnosis.gauges.fit import AT_ONCE, Fit, Now, Problem, Search, moved
from wheeltapper.diagnosis.gauges.known import RADIUS
from wheeltapper.diagnosis.gauges.passing import SPEED, Tread, Values
from wheeltapper.diagnosis.gauges.scan import free_columns
from wheeltapper.diagnosis.gauges.tread_parts import Part, parts_of
from wheeltapper.diagnosis.gauges.weighing import Freed

FloatArray = NDArray[np.float64]
SHORTEST = 0.022
"""Shorter waves are not in a tread, m."""
ALIKE = (0.02, 0.03, 0.04)
"""Lengths over which deviations are alike, m."""
AROUND = 0.03
"""The level of deviations at a place is that of so much around it, m (standard deviation of a Gauss curve)."""
BEGUN, RENEWED, WIDER = 5e-5, 25, 2.0
"""Level at which estimates begin, m, how often it is renewed at most, and by what it is more for what is told: the
likeliest level makes deviations too small by a tenth."""
RADII = (-0.012, -0.008, -0.004, 0.0, 0.004, 0.008, 0.012)
"""Of the wheel, less the stated one, over that."""
STEPS, SHORTER, DONE = 6, (1.0, 0.5, 0.25, 0.1), 10.0
"""Most steps with exact runs, by what a step is shortened that leads no further, and the fall of χ² that ends them."""


class Prior(NamedTuple):
    """Deviations before the readings are level·Σ alike·z at each place, with z independent and of variance 1.

    `level`, m, is (places,), `alike` (places, waves).
    """

    level: FloatArray
    alike: FloatArray


class Estimate(NamedTuple):
    """Deviations after readings.

    Attributes
    ----------
    evidence
        Twice the logarithm of how much likelier they are than a round wheel.
    penalty
        What a comparison with another model adds to their χ²: how unlikely they were, and how much was free.
    deviations
        m, (places,).
    spread
        Their covariance is spread times its transpose, m, (places, waves).
    prior
        Theirs.
    """

    evidence: float
    penalty: float
    deviations: FloatArray
    spread: FloatArray
    prior: Prior

    @property
    def variances(self) -> FloatArray:
        """Of each deviation, m²."""
        return np.asarray((self.spread**2).sum(axis=1))


class Start(NamedTuple):
    """A first estimate, with the values to which it belongs, among them the radius."""

    values: dict[str, float]
    tread: Tread
    estimate: Estimate


class FreeShape(NamedTuple):
    """A tread of free shape that was fitted.

    Attributes
    ----------
    tread
        The estimated tread.
    deviations
        Standard deviations of the estimate at its places, m.
    values
        Values of the wheel and the track.
    parts
        Its hollows and built-up places, the largest first.
    chi, readings
        χ², including deviations from what was known before, and the number of readings.
    flawless
        χ² of a wheel without a flaw.
    misfit
        Measure by which fits of the same readings are compared: the smaller, the better.
    gains, zeros
        Gains and zero lines of the sensors, as in a `Fit`.
    off_rail
        Share of the time at which the wheel does not touch the rail.
    """

    tread: Tread
    deviations: FloatArray
    values: dict[str, float]
    parts: tuple[Part, ...]
    chi: float
    readings: int
    flawless: float
    misfit: float
    gains: FloatArray
    zeros: FloatArray
    off_rail: float

    @property
    def shape(self) -> Tread:
        """The tread, under the name that a fitted flat has for its shape."""
        return self.tread

    @property
    def reduced(self) -> float:
        """χ² per reading that it leaves."""
        return self.chi / self.readings

    @property
    def explained(self) -> float:
        """The share of χ² of a wheel without a flaw that it explains."""
        return 1.0 - self.chi / self.flawless

    def place(self, part: Part) -> float:
        """Return where the middle of a part meets the rail first, m along the track."""
        return float(self.tread.place + part.angle * self.values[RADIUS])

    def words(self, direction: int) -> str:
        """Return its parts with their intervals, and what it explains; places are those of x towards a direction."""
        said = ", ".join(self._part_words(one, direction) for one in self.parts)
        part, left, lost = 100.0 * self.explained, self.reduced, 100.0 * self.off_rail
        said = f"a tread with {said} explains {part:.0f} % of χ², and leaves {left:.2g} per reading"
        if self.off_rail > 0.0:
            said += f"; the wheel is off the rail for {lost:.1f} % of the time, and what is there is not seen"
        return said

    def _part_words(self, one: Part, direction: int) -> str:
        kind = "a hollow" if one.size < 0.0 else "a built-up place"
        low, high = sorted(1e3 * float(np.sign(one.size)) * end for end in one.size_interval)
        ends = [1e3 * end for end in one.length_interval]
        said = f"{kind} of {abs(1e3 * one.size):.2f} mm (90 %: {low:.2f} to {high:.2f})"
        said += f", {1e3 * one.length:.0f} mm long ({ends[0]:.0f} to {ends[1]:.0f})"
        return f"{said}, at x = {direction * self.place(one):.2f} m"

    def to_dict(self, direction: int) -> dict[str, Any]:
        """Return everything, in SI units; places are those of x towards a direction."""
        parts = [
            {
                "size": one.size, "size_interval": list(one.size_interval), "length": one.length,
                "length_interval": list(one.length_interval), "place": direction * self.place(one),
            }
            for one in self.parts
        ]  # fmt: skip
        return {
            "parts": parts,
            "explained": self.explained,
            "chi_squared_reduced": self.reduced,
            "off_rail": self.off_rail,
            "radius": self.values[RADIUS],
            "place": direction * self.tread.place,
            "angles": self.tread.angles.tolist(),
            "deviations": self.tread.deviations.tolist(),
            "standard_deviations": self.deviations.tolist(),
        }


def alike_over(length: float, radius: float, count: int) -> FloatArray:
    """Return waves whose sum with independent factors is alike over a length, m, at so many places of a tread."""
    order = np.arange(1, (count - 1) // 2 + 1)
    size = np.exp(-0.25 * (order * length / radius) ** 2)
    turn = 2.0 * pi * np.arange(count)[:, None] / count * order
    return np.asarray(np.concatenate([np.cos(turn) * size, np.sin(turn) * size], axis=1) / np.sqrt((size**2).sum()))


def estimated(curvature: FloatArray, along: FloatArray, prior: Prior) -> Estimate:
    """Return deviations after readings, with the `curvature` of χ²/2 by them and its slope `along` them at zero."""
    factor = prior.level[:, None] * prior.alike
    strength, ways = np.linalg.eigh(factor.T @ curvature @ factor)
    strength, ways = 1.0 + np.maximum(strength, 0.0), factor @ ways
    found, free = (ways.T @ along) / strength, float(np.log(strength).sum())
    evidence, penalty = float((found**2 * strength).sum()) - free, float((found**2).sum()) + free
    return Estimate(evidence, penalty, ways @ found, ways / np.sqrt(strength), prior)


def settled(curvature: FloatArray, along: FloatArray, level: FloatArray, radius: float) -> Estimate:
    """Return the likeliest estimate: over lengths, and over levels that are renewed from the one given."""
    count = len(along)
    apart, found = 2.0 * pi * radius / count, list[Estimate]()
    for length in ALIKE:
        best = now = estimated(curvature, along, Prior(level, alike_over(length, radius, count)))
        for _ in range(RENEWED):
            around = gaussian_filter1d(now.deviations**2 + now.variances, AROUND / apart, mode="wrap")
            now = estimated(curvature, along, now.prior._replace(level=np.sqrt(around)))
            if now.evidence < best.evidence + 0.5:
                break
            best = now
        found.append(best)
    return max(found, key=lambda one: one.evidence)


def started(problem: Problem, values: Values, cutoff: float) -> Start:
    """Return the first estimate of a tread that is read up to a frequency, Hz, later."""
    band, weights = problem.band, problem.weights
    count = 2 * int(2.0 * pi * values[RADIUS] / max(SHORTEST, values[SPEED] / cutoff)) + 1
    level = problem.read(values, "fresh")
    left = weights.over(band.taken(band.smooth(band.passing.readings) - level))
    freed = Freed(weights, weights.over(free_columns(band, level, values[SPEED])))
    tied, begun, place = freed.weighed(left), np.full(count, BEGUN), band.passing.place
    answers = Answers(problem, values, Tread(0.0 * begun, place))
    prior = Prior(begun, alike_over(ALIKE[1], values[RADIUS], count))
    tried = []
    for more in RADII if RADIUS in problem.spread else (0.0,):
        radius = values[RADIUS] * (1.0 + more)
        columns = weights.over(answers.columns(radius))
        curvature, along = columns.T @ freed.weighed(columns), columns.T @ tied
        tried.append((estimated(curvature, along, prior).evidence, radius, curvature, along))
    _, radius, curvature, along = max(tried, key=lambda one: one[0])
    best = settled(curvature, along, begun, radius)
    return Start({**values, RADIUS: radius}, Tread(best.deviations, place), best)


class Refined(NamedTuple):
    """Where steps with exact runs have come to: the tread, what belongs to it, and the estimate about it.

    `off_rail` is as in `FreeShape`.
    """

    tread: Tread
    now: Now
    estimate: Estimate
    off_rail: float


def refined(problem: Problem, begun: Start, names: Sequence[str]) -> Refined:
    """Return a tread fitted by exact runs, together with values, gains and zero lines."""
    sensors = len(problem.gain_spread)
    tread, level = begun.tread, begun.estimate.prior.level
    now = Search(problem, tread, tuple(names)).at(begun.values, np.ones(sensors), np.zeros(2 * sensors))
    columns = dict[str, FloatArray]()
    for _ in range(STEPS):
        search = Search(problem, tread, tuple(names))
        columns |= {name: search.change(now, name) for name in names if name not in columns or name in AT_ONCE}
        answers, radius = Answers(problem, now.values, tread), now.values[RADIUS]
        beside = search.jacobian(now, columns)
        own = problem.weights.over(answers.columns(radius) * np.repeat(now.gains, problem.band.counts)[:, None])
        known = search.deviations(now.values, now.gains, now.zeros)
        left = now.left + own @ tread.deviations + beside @ known  # of a round wheel with what was known, linearly
        freed = Freed(problem.weights, beside, search.precision)
        weighed = freed.weighed(np.column_stack([own, left]))
        curvature, along = own.T @ weighed[:, :-1], own.T @ weighed[:, -1]
        best = settled(curvature, along, level, radius)
        told = estimated(curvature, along, best.prior._replace(level=WIDER * best.prior.level))
        for share in SHORTER:
            factors = freed.factors(left - own @ best.deviations)
            after, tried = _stepped(search, now, tread, best.deviations, factors, share)
            if after.chi < now.chi:
                break
        else:
            break
        fell, now, tread, level = now.chi - after.chi, after, tried, best.prior.level
        if fell < DONE:
            break
    last, tried = _stepped(search, now, tread, told.deviations, freed.factors(left - own @ told.deviations), 1.0)
    if last.chi < now.chi + DONE:
        now, tread = last, tried
    return Refined(tread, now, told, answers.off_rail)


def _stepped(
    search: Search, now: Now, tread: Tread, deviations: FloatArray, factors: FloatArray, share: float
) -> tuple[Now, Tread]:
    """Return where a share of the way to deviations, m, and to factors of values, gains and zero lines leads."""
    change = share * (factors - search.deviations(now.values, now.gains, now.zeros))
    free, sensors = len(search.names), len(now.gains)
    values = now.values
    for name, by in zip(search.names, np.clip(change[:free], -search.limits, search.limits).tolist(), strict=True):
        values = moved(values, name, by)
    after = Tread(tread.deviations + share * (deviations - tread.deviations), tread.place)
    gains, zeros = now.gains + change[free : free + sensors], now.zeros + change[free + sensors :]
    return Search(search.problem, after, search.names).at(values, gains, zeros), after


def free_shape(problem: Problem, found: Refined, flawless: Fit) -> FreeShape:
    """Return what is told of a refined tread; `flawless` is the fit of a wheel without a flaw."""
    now, told = found.now, found.estimate
    readings = int(problem.band.counts.sum())
    wider = max(1.0, np.sqrt(now.chi / readings))
    spread = wider * told.spread
    tread = Tread(found.tread.deviations - np.median(found.tread.deviations), found.tread.place)
    return FreeShape(
        tread, np.sqrt((spread**2).sum(axis=1)), now.values, parts_of(tread.deviations, spread, now.values[RADIUS]),
        now.chi, readings, flawless.chi, now.chi + told.penalty + problem.weights.logarithm, now.gains, now.zeros,
        found.off_rail,
    )  # fmt: skip
