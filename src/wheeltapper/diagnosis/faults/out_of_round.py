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
from wheeltapper.diagnosis.inference.fitting import rms
from wheeltapper.diagnosis.inference.problem import FitProblem, Prior
from wheeltapper.diagnosis.inference.search import near

FloatArray = NDArray[np.float64]

ORDER = 12
"""Number of waves around the circumference, if none is given."""
ORDERS = range(1, 31)
"""Orders that are tried."""
SMALL = 1e-6
"""Amplitude, m, at which the linear effect of an order is computed: small against an indentation."""
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

    def starts(self, problem: FitProblem, begins: float) -> list[Scenario]:
        """Return passages with harmonics of several orders."""
        return [*harmonic_starts(problem, begins)]


def out_of_round(passage: Scenario, amplitude: float, place: float, order: int = ORDER) -> Scenario:
    """Return a passage of a wheel with one harmonic of its circumference, m."""
    position = place * 2.0 * pi * passage.vehicle.radius / order
    return with_item(passage, OutOfRound(orders=(order,), amplitudes=(amplitude,), position=position))


def harmonic_starts(problem: FitProblem, begins: float) -> Iterator[Scenario]:
    """Yield models of a wheel out of round in the order of what they explain to first order, the best first.

    `problem` is that of the healthy wheelset. Neighbouring orders hardly differ at the beginning of a recording.
    Therefore only every second order is tried, and then the neighbours of the best ones.
    """
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
    start = out_of_round(model, SMALL, 0.5, order)
    place, half = float(start.irregularities[-1].position), pi * radius
    unknown = {paths[0]: Prior(SMALL), paths[1]: Prior(place, half, "uniform")}
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
    amplitude, turned = SMALL * float(np.hypot(along, across)), float(np.arctan2(across, along))
    return left, start.replaced({paths[0]: amplitude, paths[1]: (place + turned * radius / order) % (2.0 * half)})
