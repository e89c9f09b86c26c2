"""The search behind a design: how a layout is judged, and how the best one is looked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.diagnosis.information import Information, Plan, information
from wheeltapper.ask.diagnosis.layout import Family, Feature, Layout, laid_out
from wheeltapper.describe.site import Site
from wheeltapper.ground.errors import ComputationError, InputError

FloatArray = NDArray[np.float64]
Criterion = Literal["determinant", "worst interval"]
Progress = Callable[[int, int, float], None]
"""Told how many layouts were judged, the budget, and the best criterion so far."""

SEARCH_RATE = 5e3
"""Samples per second of the search: more of them tell the same within 1 %, as contacts last a millisecond or more."""
SHARES = {"single": 0.1, "repeated": 0.2, "designed": 0.7}
"""Of the budget."""
POPULATION = 8
"""Layouts per coordinate in each generation."""
PARTS = 0.1
"""Share of a search for several features that goes into single ones, of which half of the first layouts are made."""
REFINED = 0.2
"""Share of a search that goes into its end, by Nelder's and Mead's simplex from the best layout."""
SIMPLEX = 0.02
"""Size of its first simplex."""
JUDGED = 3
"""How many of the best are judged again at the sensor's rate."""
EASED, TRIES = 0.99, 8
"""Share of the largest force to which features are lowered, and how often that is tried."""
REFUSED = 1e3
"""Cost of a layout that exceeds a limit, before what it exceeds it by; others cost less than 200."""


class Candidate(NamedTuple):
    """A layout that was judged. Not a number: what was not computed, as the force is too large."""

    kind: str  # "designed", its "part", or one of those to compare with: "single", "repeated"
    layout: Layout
    determinant: float
    worst: float
    largest_force: float  # N, at any of the speeds
    total_length: float  # m


def cost(one: Candidate, criterion: Criterion) -> float:
    """Return the logarithm of what is to be small."""
    with np.errstate(divide="ignore"):
        return float(-np.log(one.determinant) if criterion == "determinant" else np.log(one.worst))


@dataclass(frozen=True)
class Judge:
    """What layouts are judged by: see `design_site`; recordings last `duration`, s."""

    site: Site
    parameters: tuple[str, ...]
    speeds: tuple[float, ...] | None
    criterion: Criterion
    largest_force: float
    one_gauge: bool
    trigger: float
    duration: float

    def site_of(self, layout: Layout) -> Site:
        """Return the site with a layout."""
        return laid_out(self.site, layout, self.duration)

    def together(self, layout: Layout) -> list[list[str]]:
        """Return the heights that share an error."""
        heights = [f"irregularity.{i}.height" for i in range(len(layout.features))]
        return [heights] if self.one_gauge and "irregularity.0.height" in self.site.uncertainty else []

    def information(self, layout: Layout) -> Information:
        """Return what a layout tells, at the sensor's rate."""
        return information(
            self.site_of(layout), self.parameters, self.speeds, together=self.together(layout), trigger=self.trigger
        )

    def judged(self, kind: str, layout: Layout, rate: float | None = None, alike: bool | None = None) -> Candidate:
        """Return what a layout is worth, at some rate; nothing is told where its force is too large.

        With `alike`, features whose force is too large are lowered first: all of them, or the one alone.
        """
        vehicle = self.site.passage.vehicle
        static, aim = float(vehicle.weight), EASED * self.largest_force
        for left in range(0 if alike is None else TRIES, -1, -1):
            layout = layout if alike is None else layout.clear(float(vehicle.radius))
            site = self.site_of(layout)
            plan = Plan.of(site, self.parameters, self.together(layout), self.trigger, None, rate)
            passages = plan.passages(site.passage, self.speeds or (float(site.passage.speed),))
            force = float(passages.largest_forces.max())
            if force <= self.largest_force:
                found = plan.information(site, passages)
                return Candidate(kind, layout, found.determinant, found.worst, force, layout.total_length)
            if left:
                share = float(np.clip((aim - static) / (force - static), 0.3, 0.97))
                layout = layout.lowered(passages.hardest, share, bool(alike))
        return Candidate(kind, layout, np.nan, np.nan, force, layout.total_length)

    @property
    def search_rate(self) -> float:
        """Samples per second that suffice to rank layouts."""
        sensor = self.site.sensor
        return float(min(sensor.rate, max(SEARCH_RATE, 2.5 * (sensor.cutoff or 0.0))))


@dataclass
class Search:
    """The layouts that were judged so far.

    Attributes
    ----------
    judge, budget, progress
        As `design_site` has them.
    candidates
        In the order in which they were judged.
    """

    judge: Judge
    budget: int
    progress: Progress | None
    candidates: list[Candidate] = field(default_factory=list)

    def best(self, kind: str, family: Family, known: Sequence[Layout], seed: list[int]) -> Candidate:
        """Return the best layout of a family, at the sensor's rate; the search begins with the known ones, too."""
        random = np.random.default_rng(seed)
        budget = max(int(SHARES[kind] * self.budget), 1)
        mark = len(self.candidates)
        parts = [] if family.alike or family.number == 1 else self._parts(family, int(PARTS * budget), random)
        many = int(np.clip(budget // 4, 5, POPULATION * family.size))
        first = _spread(many, family.size, random)
        for i in range(many // 2 if parts else 0):
            first[i] = family.joined([parts[j] for j in random.integers(len(parts), size=family.number)], first[i])
        for i, layout in enumerate(known):
            first[-1 - i] = family.coordinates(layout)
        self._evolved(kind, family, first, budget - (len(self.candidates) - mark), random)
        return self._judged_again([one for one in self.candidates[mark:] if one.kind == kind])

    def _parts(self, family: Family, budget: int, random: np.random.Generator) -> list[Feature]:
        """Return the best single features, one of each shape and of about each length."""
        alone = replace(family, number=1)
        mark = len(self.candidates)
        for at in _spread(max(budget, 1), alone.size, random):
            self._price("part", alone.layout(at), False)
        best: dict[tuple[str, int], Candidate] = {}
        for one in self.candidates[mark:]:
            (part,) = one.layout.features
            octave = (part.shape, int(np.floor(np.log2(part.length / family.lengths[0]))) if part.length else 0)
            if np.isfinite(one.worst) and (octave not in best or self._cost(one) < self._cost(best[octave])):
                best[octave] = one
        return [one.layout.features[0] for one in best.values()]

    def _evolved(
        self, kind: str, family: Family, first: FloatArray, budget: int, random: np.random.Generator
    ) -> None:  # fmt: skip
        """Judge about as many layouts as the budget allows: an evolution from the first ones, and a simplex."""
        from scipy.optimize import Bounds, differential_evolution, minimize

        def price(at: FloatArray) -> float:
            return self._price(kind, family.layout(at), family.alike)

        mark = len(self.candidates)
        generations = max(int((1.0 - REFINED) * budget) // len(first) - 1, 0)
        box = Bounds(np.zeros(family.size), np.ones(family.size))
        evolved = differential_evolution(
            price, box, init=first, maxiter=generations, rng=random, polish=False, tol=0.0
        )  # fmt: skip
        rest = budget - (len(self.candidates) - mark)
        if rest > family.size:
            simplex = evolved.x + np.vstack([np.zeros(family.size), np.diag(_inwards(evolved.x))])
            minimize(price, evolved.x, method="Nelder-Mead", options={"maxfev": rest, "initial_simplex": simplex})

    def _cost(self, one: Candidate) -> float:
        return cost(one, self.judge.criterion)

    def _price(self, kind: str, layout: Layout, alike: bool) -> float:
        try:
            found = self.judge.judged(kind, layout, self.judge.search_rate, alike)
        except ComputationError:
            return 2.0 * REFUSED
        self.candidates.append(found)
        if self.progress is not None:
            told = [one for one in self.candidates if np.isfinite(one.worst)]
            best = min(told, key=lambda one: self._cost(one), default=found)
            value = best.determinant if self.judge.criterion == "determinant" else best.worst
            self.progress(len(self.candidates), self.budget, value)
        excess = found.largest_force / self.judge.largest_force - 1.0
        return REFUSED + excess if excess > 0.0 else min(self._cost(found), 0.5 * REFUSED)

    def _judged_again(self, found: Sequence[Candidate]) -> Candidate:
        told = [one for one in found if np.isfinite(one.worst)]
        if not told:
            limit = f"{self.judge.largest_force:g} N, which none of {len(found)} layouts keeps"
            raise InputError("", "largest_force", limit, "a larger one, lower heights, or a larger budget")
        ranked = sorted(told, key=lambda one: self._cost(one))[:JUDGED]
        again = [self.judge.judged(one.kind, one.layout) for one in ranked]
        return min(again, key=lambda one: self._cost(one))


def _spread(many: int, size: int, random: np.random.Generator) -> FloatArray:
    """Return a Latin hypercube: each coordinate's range is cut in so many parts, each of which is met once."""
    parts = np.column_stack([random.permutation(many) for _ in range(size)])
    return np.asarray((parts + random.random((many, size))) / many)


def _inwards(at: FloatArray) -> FloatArray:
    return np.where(at < 0.5, SIMPLEX, -SIMPLEX)
