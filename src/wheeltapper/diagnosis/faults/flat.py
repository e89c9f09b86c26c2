"""Wheel flats: what they change, and passages with a flat about the time at which one has struck."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import pi
from typing import ClassVar

import numpy as np

from wheeltapper.describe.irregularity.flat import WheelFlat
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import Fault, with_item
from wheeltapper.diagnosis.inference.problem import FitProblem, Prior
from wheeltapper.diagnosis.inference.search import ranked
from wheeltapper.diagnosis.inference.timing import untimed, zero_of
from wheeltapper.record.simulate import simulated_quietly

STEP = 1.0 / 460.0
"""Unit of lengths of flats, over the radius of the wheel: a millimetre at 460 mm."""
LENGTHS = (
    (8, 12, 17, 24, 33, 45, 62, 86),
    (7, 10, 14, 18, 23, 28, 34, 40, 47, 54, 62, 70, 79, 88, 98),
)
"""Lengths of fresh flats that are tried, in STEPs of the radius: in the first round, and finer in the second. The
ratio of neighbours is 1.4 and 1.2: a fit of a flat reaches its neighbours."""
EDGES = ((0, 2, 5), (0, 1, 2, 3.5, 5, 7))
"""Distances from the edge of the flat to the place of the strike, in STEPs of the radius, in the first and in the
second round. They are used where the wheel has rolled onto the flat, so that the strike is near its edge."""
LANDED, LANDING = ((0.15, 0.5, 0.85), (0.02, 0.3, 0.4, 0.6, 0.7, 0.98)), 0.18
"""The same distances over the length of the flat, where the wheel has landed on it. It has landed if its last impact
began at most LANDING contact periods before the strike, so that the two are one."""
TRIED = 6
"""Largest number of starting values from one ranking that are fitted."""
ABOUT = (-0.36, 0.72)
"""Starting values are ranked by the recording from shortly before a strike to the end of its impact, in contact periods
after the strike. With 3.6 periods instead of these 1.08, four of 24 flats were not found (decision 15)."""


class Flat(Fault, abstract=True):
    """A flat of one tread. All kinds of flats are fitted together, about the strike that a recording shows.

    Attributes
    ----------
    shape
        That of the `WheelFlat`.
    like
        Length of the fresh flat whose effect is most similar, over the length of the flat itself.
    """

    part, size, unit, path = "wheel", "length", "m", "irregularity.-1.length"
    acts = "at a strike"
    alarms: ClassVar[dict[str, float]] = {"flat_length": 1.0}
    shape: ClassVar[str]
    like: ClassVar[float]

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the passage with a flat on the wheel."""
        where = place * 2.0 * pi * passage.vehicle.radius
        return with_item(passage, WheelFlat(length=size, position=where, shape=self.shape))

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the priors of length and place."""
        own = f"irregularity.{len(passage.irregularity)}"
        half = pi * passage.vehicle.radius
        return {f"{own}.length": Prior(0.04, 0.7, "lognormal"), f"{own}.position": Prior(half, half, "uniform")}

    def model(self, healthy: Scenario, values: Mapping[str, float]) -> Scenario | None:
        """Return the passage with these values, which are all that a flat has."""
        return self.passage(healthy).replaced(dict(values))

    def at_edge(self, model: Scenario, struck: float, length: float, edge: float) -> Scenario:
        """Return a passage whose flat acts like a fresh one of this length, struck at a distance from its edge."""
        own, turn = length / self.like, 2.0 * pi * model.vehicle.radius
        place = float(model.speed) * (struck - zero_of(model))
        return self.made(model, own, ((place - edge + 0.5 * own) % turn) / turn)

    def instead(self, flat: Scenario, length: float, place: float) -> Scenario:
        """Return a passage whose flat, its last irregularity, is replaced: another length and another middle, m."""
        without = flat.replaced({"irregularity": flat.irregularities[:-1]})
        turn = 2.0 * pi * flat.vehicle.radius
        return self.made(without, length, (place % turn) / turn)

    def resembling(self, flat: Scenario, other: Flat) -> Scenario:
        """Return the passage with this kind of flat that is most similar to one with another kind."""
        item = flat.irregularities[-1]
        return self.instead(flat, item.length * other.like / self.like, item.position)


def flat_starts(
    problem: FitProblem, models: Sequence[Scenario], struck: float, flats: Sequence[Flat], round_: int
) -> Iterator[tuple[Flat, Scenario]]:
    """Yield flats and models with them, in the order of their misfit about a strike; round 1 is finer."""
    own = max(struck - zero_of(models[0]), 1.0 / problem.recording.rate)
    since = own - simulated_quietly(untimed(models[0]).replaced({"duration": own})).impacts.time.values
    landed = bool(np.any(since < LANDING * problem.scale.period))
    offsets = (LANDED if landed else EDGES)[round_]
    lengths, step = LENGTHS[round_] if len(models) == 1 else LENGTHS[round_][1::2], STEP * problem.scale.radius
    edges = [(step * length, edge * step * (length if landed else 1.0)) for length in lengths for edge in offsets]
    kinds = {flat.at_edge(model, struck, *edge): flat for flat in flats for model in models for edge in edges}
    for start in _nearest(problem, kinds, struck):
        yield kinds[start], start


def same_edge_starts(problem: FitProblem, found: Scenario, flat: Flat, struck: float) -> Iterator[Scenario]:
    """Yield passages whose flat shares one edge with the one found, in the order of their misfit about a strike.

    A wheel that lands near one edge of a flat does not reveal the other edge before its next turn.
    """
    item = found.irregularities[-1]
    longer = [STEP * problem.scale.radius * length / flat.like - item.length for length in LENGTHS[1]]
    sides = [(more, 0.5 * side * more) for more in longer for side in (-1, 1)]
    tried = [flat.instead(found, item.length + more, item.position + aside) for more, aside in sides]
    yield from _nearest(problem, tried, struck)


def _nearest(problem: FitProblem, models: Iterable[Scenario], struck: float) -> list[Scenario]:
    """Return the models that are most similar to the recording about a strike."""
    return ranked(problem, models, *(struck + periods * problem.scale.period for periods in ABOUT))[:TRIED]
