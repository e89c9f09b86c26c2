"""Starting models of the faults that a fit from the healthy passage would not find.

departure  the time at which the recording leaves a model that has explained it so far: the strike of a flat
grids      lengths and places of flats about a strike, orders of a wheel out of round, sizes of play and bushes
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults import Made, out_of_round
from wheeltapper.diagnosis.inference.fitting import INFLATED, STEPS, departure, fitted, rms
from wheeltapper.diagnosis.inference.problem import Prior, Problem
from wheeltapper.record.simulate import simulate

FloatArray = NDArray[np.float64]

FLATS = (
    tuple(1e-3 * length for length in (8, 12, 17, 24, 33, 45, 62, 86)),
    tuple(1e-3 * length for length in (7, 10, 14, 18, 23, 28, 34, 40, 47, 54, 62, 70, 79, 88, 98)),
)
"""Lengths of fresh flats that are tried, m: in the first round, and finer in the second."""
LIKE = {"wheel flat": 1.0, "rounded flat": 0.7}
"""Length of the fresh flat whose effect is most similar, over the length of the flat itself."""
EDGES = ((0.0, 0.002, 0.005), (0.0, 0.001, 0.002, 0.0035, 0.005, 0.007))
"""Distances from the edge of the flat to the place of the strike, m, in the first and in the second round. They are
used where the wheel has rolled onto the flat, so that the strike is near its edge."""
LANDED, LANDING = ((0.15, 0.5, 0.85), (0.02, 0.3, 0.4, 0.6, 0.7, 0.98)), 1e-3
"""The same distances over the length of the flat, where the wheel has landed on it. It has landed if its last impact
was at most LANDING seconds before the strike."""
TRIED = 6
"""Largest number of starting values from one ranking that are fitted."""
BEFORE, AFTER = 0.002, 0.004
"""Starting values are ranked by the recording from BEFORE seconds before a strike to AFTER seconds after it. With 20 ms
instead of these 6 ms, four of 24 flats were not found (decision 15)."""
ORDERS = range(1, 31)
"""Orders of a wheel out of round that are tried."""
SMALL, NEAR = 1e-6, (0.011, 0.022, 0.04)
"""SMALL is the amplitude, m, at which the linear effect of an order is computed: small against an indentation. NEAR are
the ends of the windows, s after the onset, in which the healthy wheelset is fitted before."""
LOOSELY = 2.0
"""Ratio of the noise that this fit assumes to the rms of the residual. It is above one so that the priors hold the
healthy wheelset although it does not explain the recording."""
WEIGHED, HARMONICS, DAMPERS = 3, 6, 4
"""Number of the best orders whose neighbours are tried, too; number of orders that are fitted; number of the nearest
damper ends that are fitted, besides the nearest of each kind."""
PLAYS, PLACES = (1.2e-5, 2.5e-5, 5e-5, 1e-4, 2e-4), (0.2, 0.5, 0.8)
"""Half the free play that is tried, m, and positions of the end between its stops at the start, 0 to 1. With more play
the end does not reach its stops."""
BUSHES = (1e6, 4e6, 1.6e7, 6e7)
"""Stiffnesses of a bush that are tried, N/m."""


def departs_at(problem: Problem, model: Scenario, since: float) -> float:
    """Return the time at which a recording departs from a model, s after the trigger; NaN if it never does."""
    times = problem.times
    found = problem.shown(model, len(times))
    if found is None:
        return since
    off = np.where(problem.there & ~problem.recording.clipped, found - problem.samples, 0.0)
    first = departure(off, problem.noise, problem.recording.rate, int(np.searchsorted(times, since)))
    return float(times[first]) if first < len(times) else np.nan


def misfit(problem: Problem, model: Scenario, start: float, end: float) -> float:
    """Return the mean squared difference between a model and the recording between two times."""
    first, last = np.searchsorted(problem.times, [start, end]).tolist()
    last = min(max(last, first + 1), len(problem.times))
    found = problem.shown(model, last, first)
    if found is None:
        return np.inf
    off = (found - problem.samples[first:last])[problem.there[first:last]]
    return float((off**2).mean())


def ranked(problem: Problem, models: Iterable[Scenario], start: float, end: float) -> list[Scenario]:
    """Return the models in the order of their misfit to the recording between two times, the best first."""
    off = {model: misfit(problem, model, start, end) for model in models}
    return [model for model in sorted(off, key=lambda one: off[one]) if np.isfinite(off[model])]


def flat_starts(
    problem: Problem, models: Sequence[Scenario], struck: float, made: dict[str, Made], round_: int
) -> Iterator[tuple[str, Scenario]]:
    """Yield names of flats and models with them, in the order of their misfit about a strike; round 1 is finer."""
    turn = 2.0 * pi * models[0].vehicle.radius
    since = struck - simulate(models[0].replaced({"duration": struck})).impacts.time.values
    landed = bool(np.any(since < LANDING))
    offsets = (LANDED if landed else EDGES)[round_]
    lengths = FLATS[round_] if len(models) == 1 else FLATS[round_][1::2]
    edges = [(length, edge * length if landed else edge) for length in lengths for edge in offsets]

    def flat(name: str, model: Scenario, length: float, edge: float) -> Scenario:
        own = length / LIKE[name]
        return made[name](model, own, ((float(model.speed) * struck - edge + 0.5 * own) % turn) / turn)

    names = {flat(name, model, *edge): name for name in made for model in models for edge in edges}
    for start in ranked(problem, names, struck - BEFORE, struck + AFTER)[:TRIED]:
        yield names[start], start


def with_flat(flat: Scenario, name: str, made: dict[str, Made], length: float, place: float) -> Scenario:
    """Return a passage whose flat, its last irregularity, is replaced: another length and another middle, both m."""
    without = flat.replaced({"irregularity": flat.irregularities[:-1]})
    turn = 2.0 * pi * flat.vehicle.radius
    return made[name](without, length, (place % turn) / turn)


def resembling(flat: Scenario, of: str, name: str, made: dict[str, Made]) -> Scenario:
    """Return a passage with the flat of kind `name` that is most similar to its flat of kind `of`."""
    item = flat.irregularities[-1]
    return with_flat(flat, name, made, item.length * LIKE[of] / LIKE[name], item.position)


def same_edge_starts(
    problem: Problem, flat: Scenario, name: str, struck: float, made: dict[str, Made]
) -> Iterator[Scenario]:
    """Yield passages whose flat shares one edge with the given one, in the order of their misfit about a strike.

    A wheel that lands near one edge of a flat does not reveal the other edge before its next turn.
    """
    item = flat.irregularities[-1]
    longer = [length / LIKE[name] - item.length for length in FLATS[1]]
    tried = [
        with_flat(flat, name, made, item.length + more, item.position + 0.5 * side * more)
        for more in longer
        for side in (-1, 1)
    ]
    yield from ranked(problem, tried, struck - BEFORE, struck + AFTER)[:TRIED]


def near(problem: Problem, begins: float) -> tuple[FloatArray, int]:
    """Return coordinates at which a model is near the beginning of a recording that it does not explain.

    Also return the length of that beginning, as a number of samples.
    """
    at, count = np.zeros(len(problem.paths)), 0
    for window in NEAR:
        count = int(np.searchsorted(problem.times, begins + window))
        noise = LOOSELY * max(rms(problem.residuals(at, count)), INFLATED * problem.noise)
        at, _ = fitted(problem, at, count, noise, STEPS)
    return at, count


def harmonic_starts(problem: Problem, begins: float) -> Iterator[Scenario]:
    """Yield models of a wheel out of round in the order of what they explain to first order, the best first.

    `problem` is that of the healthy wheelset. Neighbouring orders hardly differ at the beginning of a recording.
    Therefore only every second order is tried, and then the neighbours of the best ones.
    """
    at, count = near(problem, begins)
    found = problem.residuals(at, count)
    if found is None:
        return
    noise = max(rms(found), problem.noise)
    healthy = problem.weighed(at, count, noise), problem.jacobian(at, count, noise)
    if healthy[0] is None or healthy[1] is None:
        return
    model, weighed = problem.scenario(at), _Linear(healthy[0], healthy[1], noise)
    tried = {order: _harmonic(problem, model, order, count, weighed) for order in ORDERS[::2]}
    best = sorted(tried, key=lambda order: tried[order][0])[:WEIGHED]
    for beside in sorted({order + side for order in best for side in (-1, 1)} & {*ORDERS}):
        tried[beside] = _harmonic(problem, model, beside, count, weighed)
    for order in sorted(tried, key=lambda order: tried[order][0])[:HARMONICS]:
        if np.isfinite(tried[order][0]):
            yield tried[order][1]


def damper_starts(
    problem: Problem, model: Scenario, begins: float, made: dict[str, Made]
) -> Iterator[tuple[str, Scenario]]:
    """Yield names and passages with free play or a bush, in the order of their misfit to the recording's beginning.

    The best one of each name comes before all others, because the two faults look similar at the beginning.
    """
    sizes = {"free play": [(play, place) for play in PLAYS for place in PLACES]}
    sizes["soft bush"] = [(bush, 0.5) for bush in BUSHES]
    names = {add(model, *size): name for name, add in made.items() for size in sizes[name]}
    order = ranked(problem, names, begins, begins + NEAR[-1])
    first = [start for i, start in enumerate(order) if names[start] not in {names[nearer] for nearer in order[:i]}]
    for start in [*first, *(start for start in order[:DAMPERS] if start not in first)]:
        yield names[start], start


class _Linear(NamedTuple):
    """Weighted residuals of a healthy model, their derivatives, and the noise by which samples are divided."""

    residual: FloatArray
    jacobian: FloatArray
    noise: float


def _harmonic(problem: Problem, model: Scenario, order: int, count: int, healthy: _Linear) -> tuple[float, Scenario]:
    """Return the sum of squares that one order leaves to first order, and the model with amplitude and phase."""
    own, radius = len(model.irregularities), float(model.vehicle.radius)
    paths = (f"irregularity.{own}.amplitudes.0", f"irregularity.{own}.position")
    start = out_of_round(model, SMALL, 0.5, order)
    place, half = float(start.irregularities[-1].position), pi * radius
    unknown = {paths[0]: Prior(SMALL), paths[1]: Prior(place, half, "uniform")}
    family = Problem(problem.recording, problem.sensor, problem.noise, start, unknown)
    slopes = family.slopes(np.zeros(2), count)
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
