"""A wheel that is out of round, with one harmonic of its circumference."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.out_of_round import OutOfRound
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import Fault, with_item
from wheeltapper.diagnosis.inference.fitting import keeps_step, rms
from wheeltapper.diagnosis.inference.problem import SURE, FitProblem, Prior
from wheeltapper.diagnosis.inference.search import near, ranked
from wheeltapper.diagnosis.inference.timing import TIME_ZERO, zero_of

FloatArray = NDArray[np.float64]

ORDER = 12
"""Number of waves around the circumference, if none is given."""
ORDERS = range(1, 31)
"""Orders that are tried."""
SMALL = 0.01
"""Amplitude at which the linear effect of an order is computed, over the static indentation."""
WAVES, PHASES = 8, 12
"""Waves of the highest order before the site's irregularity from which a spectrum is taken, and number of phases that
are tried."""
AVERAGED = 2.0
"""Contact periods over which the difference between model and recording is averaged where the contact's own frequency
is not to count."""
CONSTANT, FREQUENCIES, RINGING = "contact.constant", 15, 7.2
"""Field on which that frequency depends, number of its values that are tried, and contact periods after the onset in
which models with these are compared with the recording: five impacts at the example's site."""
SEEN = 12.0
"""Smallest square of an order's spectrum over its mean in noise alone; it is exceeded once in 5000 recordings by one of
the orders, exp(-SEEN) each."""
NEAREST = 4
"""Number of pairs of amplitude and phase that are fitted."""
AMPLITUDES = (0.1, 0.2, 0.4, 0.55, 0.75, 1.0)
"""Amplitudes that are tried, over the height of the site's irregularity, or over the indentation if that is more."""
WEIGHED, HARMONICS = 3, 6
"""Number of the best orders whose neighbours are tried, too, and number of orders that are fitted."""


class OutOfRoundWheel(Fault):
    """A wheel with one harmonic of its circumference."""

    name, part, rank = "out of round", "wheel", 100.0
    meaning = f"a wheel is out of round with order {ORDER} or another one"
    size, unit, usual, path = "amplitude", "m", 1e-4, "irregularity.-1.amplitudes.0"
    alone = True
    alarms: ClassVar[dict[str, float]] = {"out_of_roundness": 2.0}

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the passage with a harmonic of order 12."""
        return out_of_round(passage, size, place)

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the priors of amplitude and place."""
        own = f"irregularity.{len(passage.irregularity)}"
        half = pi * passage.vehicle.radius
        return {f"{own}.amplitudes.0": Prior(1e-4, 1.0, "lognormal"), f"{own}.position": Prior(half, half, "uniform")}

    def seen(self, problem: FitProblem, begins: float) -> bool:
        """Return True if the recording shows a harmonic before its onset, below the noise of its samples."""
        since, bump = _free_of_bump(problem.start, begins)
        return _order_in(problem, problem.start, since, min(bump, begins)) is not None

    def starts(self, problem: FitProblem, begins: float) -> list[Scenario]:
        """Return passages with harmonics of several orders."""
        return [*_starts_before(problem, begins), *harmonic_starts(problem, begins)]


def _wave_time(passage: Scenario, order: int) -> float:
    """Return how long one wave of a wheel lasts, s."""
    return 2.0 * pi * float(passage.vehicle.radius) / order / float(passage.speed)


def _first_place(passage: Scenario) -> float:
    """Return where the site's irregularity begins, m; zero where one has no beginning."""
    return min((float(getattr(item, "start", 0.0) or 0.0) for item in passage.irregularities), default=0.0)


def _entering(problem: FitProblem, begins: float) -> Scenario:
    """Return the healthy model with which the wheel enters the deck at the onset, if that is plausible.

    The time by which it is late is divided between speed and time zero by their variances.
    """
    model, priors = problem.start, dict(zip(problem.paths, problem.priors, strict=True))
    speed, trigger = priors.get("speed"), priors[TIME_ZERO].deviation if TIME_ZERO in priors else 0.0
    way = float(model.track.start or 0.0)
    if speed is None or way <= 0.0 or not np.isfinite(trigger):
        return model
    late, by_speed = begins - way / speed.centre, speed.deviation * way / speed.centre
    spread = float(np.hypot(by_speed, trigger))
    if begins <= 0.0 or abs(late) > SURE * spread:
        return model
    zero = late * (trigger / spread) ** 2
    return model.replaced({"speed": way / (begins - zero)} | ({TIME_ZERO: zero} if trigger else {}))


def _free_of_bump(model: Scenario, begins: float) -> tuple[float, float]:
    """Return from when on the deck carries the wheel, or moves, and when the site's irregularity begins to act, s."""
    places = float(model.track.start or 0.0), _first_place(model)
    entry, bump = (zero_of(model) + place / float(model.speed) for place in places)
    return min(begins, max(entry, 0.0)), bump


def _order_in(problem: FitProblem, model: Scenario, since: float, until: float) -> int | None:
    """Return the order that a part of the recording shows; None if it shows only noise, or is too short."""
    if until - since < WAVES * _wave_time(model, ORDERS[-1]):
        return None
    first, last = np.searchsorted(problem.times, [since, until]).tolist()
    times, samples, weight = problem.times[first:last], problem.samples[first:last], np.hanning(last - first)
    power = {n: abs(np.exp(-2j * pi / _wave_time(model, n) * times) @ (weight * samples)) for n in ORDERS}
    order = max(power, key=power.__getitem__)
    return order if power[order] ** 2 > SEEN * problem.noise**2 * float(weight @ weight) else None


def _starts_before(problem: FitProblem, begins: float) -> list[Scenario]:
    """Return models of a wheel that the recording shows before the site's irregularity acts, the nearest first.

    A wheel that comes bouncing onto the deck may lose contact, so that nothing is linear in its amplitude. The spectrum
    shows the order; amplitude and phase come from a grid. They are compared without what rings at the contact's
    frequency, because that frequency is uncertain: it comes from a second grid.
    """
    model, (since, bump) = _entering(problem, begins), _free_of_bump(problem.start, begins)
    order = _order_in(problem, model, since, bump)
    if order is None:
        return []
    high = max(problem.scale.height, problem.scale.indentation)
    tried = [
        out_of_round(model, share * high, order // 2 + phase / PHASES, order)
        for share in AMPLITUDES
        for phase in range(PHASES)
    ]
    nearest = ranked(problem, tried, since, bump, over=AVERAGED * problem.scale.period)[:NEAREST]
    end = begins + RINGING * problem.scale.period
    return [ranked(problem, _at_frequencies(problem, start), begins, end)[0] for start in nearest]


def _at_frequencies(problem: FitProblem, start: Scenario) -> list[Scenario]:
    """Return models whose contact is softer or stiffer, as far as that is plausible; the frequency is as C^(1/3)."""
    prior = dict(zip(problem.paths, problem.priors, strict=True)).get(CONSTANT)
    if prior is None or prior.is_flat:
        return [start]
    factors = 1.0 + SURE * prior.deviation * np.linspace(-1.0, 1.0, FREQUENCIES)
    return [start.replaced({CONSTANT: prior.centre * factor}) for factor in factors.tolist() if factor > 0.0]


def out_of_round(passage: Scenario, amplitude: float, place: float, order: int = ORDER) -> Scenario:
    """Return a passage of a wheel with one harmonic of its circumference, m."""
    position = place * 2.0 * pi * passage.vehicle.radius / order
    return with_item(passage, OutOfRound(orders=(order,), amplitudes=(amplitude,), position=position))


def harmonic_starts(problem: FitProblem, begins: float) -> Iterator[Scenario]:
    """Yield models of a wheel out of round in the order of what they explain to first order, the best first.

    `problem` is that of the healthy wheelset. The whole recording is used if its model is similar to it all along, and
    otherwise the beginning. Neighbouring orders hardly differ there. Therefore only every second order is tried, and
    then the neighbours of the best ones.
    """
    if keeps_step(problem, begins):
        at, count = np.zeros(len(problem.paths)), len(problem.times)
    else:
        at, count = near(problem, begins)
    found = problem.residuals(at, count)
    if found is None:
        return
    noise = max(rms(found), problem.noise)
    healthy = problem.weighted_residuals(at, count, noise), problem.jacobian(at, count, noise)
    if healthy[0] is None or healthy[1] is None:
        return
    model, weighed = problem.model_at(at), _Linear(healthy[0], healthy[1], noise)
    tried = {order: _harmonic(problem, model, order, count, weighed) for order in ORDERS[::2]}
    best = sorted(tried, key=lambda order: tried[order][0])[:WEIGHED]
    for beside in sorted({order + side for order in best for side in (-1, 1)} & {*ORDERS}):
        tried[beside] = _harmonic(problem, model, beside, count, weighed)
    for order in sorted(tried, key=lambda order: tried[order][0])[:HARMONICS]:
        if np.isfinite(tried[order][0]):
            yield tried[order][1]


class _Linear(NamedTuple):
    """Weighted residuals of a healthy model, their derivatives, and the noise by which samples are divided."""

    residual: FloatArray
    jacobian: FloatArray
    noise: float


def _harmonic(problem: FitProblem, model: Scenario, order: int, count: int, healthy: _Linear) -> tuple[float, Scenario]:
    """Return the sum of squares that one order leaves to first order, and the model with amplitude and phase."""
    own, radius = len(model.irregularities), float(model.vehicle.radius)
    paths = (f"irregularity.{own}.amplitudes.0", f"irregularity.{own}.position")
    small = SMALL * problem.scale.indentation
    start = out_of_round(model, small, order // 2 + 0.5, order)
    place, half = float(start.irregularities[-1].position), pi * radius
    unknown = {paths[0]: Prior(small), paths[1]: Prior(place, half, "uniform")}
    family = FitProblem(problem.recording, problem.sensor, problem.noise, start, unknown)
    slopes = family.residual_slopes(np.zeros(2), count)
    if slopes is None or not np.all(np.isfinite(slopes)):
        return np.inf, start
    rows = np.zeros((len(healthy.residual), 2))
    rows[:count] = slopes / healthy.noise
    jacobian = np.column_stack([healthy.jacobian, rows])
    step = np.linalg.lstsq(jacobian, -healthy.residual, rcond=None)[0]
    left = float(((healthy.residual + jacobian @ step) ** 2).sum())
    along, across = step[-2], order / radius * step[-1] * half
    amplitude, turned = small * float(np.hypot(along, across)), float(np.arctan2(across, along))
    return left, start.replaced({paths[0]: amplitude, paths[1]: place + turned * radius / order})
