"""The search behind a design: how layouts are judged, and how the best one is found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.inference.information import Information, Plan, information
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.diagnosis.site.layout import Family, Layout, RailFeature, laid_out
from wheeltapper.ground.errors import ComputationError, InputError
from wheeltapper.ground.progress import report

FloatArray = NDArray[np.float64]
Criterion = Literal["determinant", "worst interval"]

SEARCHED = 27.8
"""Samples in a contact period during the search. Contacts last half of it: a higher rate changes the information by
less than 1 % and costs more time."""
SHARES = {"single": 0.15, "repeated": 0.03, "alike": 0.22, "designed": 0.6}
"""Share of the budget of layouts that each search gets. The designed layout has the most coordinates."""
PARTS, SAMPLED = 0.1, 0.3
"""Shares of the budget of one search. PARTS is spent on single features. SAMPLED is spent on layouts that are drawn,
three in four of which combine the best single features. The rest is for the simplex search."""
CLIMBS = (12, 4, 1)
"""Numbers of layouts from which the simplex search of Nelder and Mead (1965) starts, in three rounds of equal cost.
Each round keeps the best results of the one before."""
SIMPLEX, FINE = 0.05, 1e-3
"""Edge of the first simplex and the size at which the search ends, in coordinates from 0 to 1. FINE is also the change
of the logarithm of the criterion at which it ends."""
JUDGED = 3
"""Number of the best layouts that are judged again at the rate of the sensor. The order of the very best may change
there."""
EASED, TRIES = 0.99, 8
"""If the force exceeds its limit, a feature is lowered until the force is the share EASED of the limit. After TRIES
evaluations the layout counts as refused."""
REFUSED = 1e3
"""Cost of a layout whose force exceeds the limit; the ratio of force and limit is added, so that the search is led
back. Layouts that are allowed cost less than 200, or half of this if nothing is determined."""


class Candidate(NamedTuple):
    """A judged layout. If the force is too large, the criteria are not computed and NaN."""

    kind: str  # "designed", "part", or of the comparison: "single", "repeated", "alike"
    layout: Layout
    determinant: float
    worst: float
    largest_force: float  # N, at any of the speeds
    total_length: float  # m


def cost(one: Candidate, criterion: Criterion) -> float:
    """Return the logarithm of the quantity that is minimised."""
    with np.errstate(divide="ignore"):
        return float(-np.log(one.determinant) if criterion == "determinant" else np.log(one.worst))


@dataclass(frozen=True)
class Judge:
    """The criteria of layouts, see `design_site`; no height is below `lowest`, m; recordings last `duration`, s."""

    site: Site
    parameters: tuple[str, ...]
    speeds: tuple[float, ...] | None
    criterion: Criterion
    largest_force: float
    one_gauge: bool
    trigger: float
    lowest: float
    duration: float

    def site_of(self, layout: Layout) -> Site:
        """Return the site with a layout."""
        return laid_out(self.site, layout, self.duration)

    def gauge_groups(self, layout: Layout) -> list[list[str]]:
        """Return the groups of heights that share an error."""
        heights = [f"irregularity.{i}.height" for i in range(len(layout.features))]
        return [heights] if self.one_gauge and "irregularity.0.height" in self.site.uncertainty else []

    def information(self, layout: Layout) -> Information:
        """Return the information of a layout, at the sensor's rate."""
        return information(
            self.site_of(layout), self.parameters, self.speeds, together=self.gauge_groups(layout), trigger=self.trigger
        )

    def judged_layout(self, kind: str, layout: Layout, rate: float | None = None) -> Candidate:
        """Return the judged layout, at some sample rate; its criteria are NaN if its force is too large."""
        return self._judged_with_place(kind, layout, rate)[0]

    def lowered_to_limit(self, kind: str, layout: Layout, rate: float, alike: bool) -> Candidate:
        """Return the judged layout after lowering it until its force is allowed.

        Each time, the feature at the largest force is lowered, or all features if they have to be equal.
        """
        vehicle = self.site.passage.vehicle
        static, aim = float(vehicle.weight), EASED * self.largest_force
        for _ in range(TRIES):
            found, hardest = self._judged_with_place(kind, layout, rate)
            if np.isfinite(found.worst):
                break
            share = float(np.clip((aim - static) / (found.largest_force - static), 0.3, 0.97))
            layout = layout.lowered(hardest, share, self.lowest, alike)
        return found

    def _judged_with_place(self, kind: str, layout: Layout, rate: float | None) -> tuple[Candidate, float]:
        """Return the judged layout, and the position of the largest force, m."""
        site = self.site_of(layout)
        plan = Plan.checked_plan(site, self.parameters, self.gauge_groups(layout), self.trigger, None, rate)
        with np.errstate(invalid="ignore"):  # a search may ask for places beyond the circle
            passages = plan.plan_passages(site.passage, self.speeds or (float(site.passage.speed),))
            force = float(passages.largest_forces.max())
            if force > self.largest_force:
                return Candidate(
                    kind, layout, np.nan, np.nan, force, layout.total_length
                ), passages.place_of_largest_force
            found = plan.information_of(site, passages)
        return Candidate(
            kind, layout, found.determinant, found.worst, force, layout.total_length
        ), passages.place_of_largest_force

    @property
    def search_rate(self) -> float:
        """Samples per second that suffice to rank layouts."""
        sensor = self.site.sensor
        least = SEARCHED / Scale(self.site.passage).period
        return float(min(sensor.rate, max(least, 2.5 * (sensor.cutoff or 0.0))))


@dataclass
class Search:
    """The layouts that were judged so far.

    Attributes
    ----------
    judge, budget
        As in `design_site`.
    candidates
        All judged layouts, in the order of judging.
    """

    judge: Judge
    budget: int
    candidates: list[Candidate] = field(default_factory=list)

    def best_layout(self, kind: str, family: Family, known: Sequence[Layout], seed: list[int]) -> Candidate:
        """Return the best layout of a family, at the sensor's rate; the known layouts are judged first."""
        random = np.random.default_rng(seed)
        budget = max(int(SHARES[kind] * self.budget), 1)
        mark = len(self.candidates)
        parts = [] if family.alike or family.number == 1 else self._best_features(family, int(PARTS * budget), random)
        for layout in known:
            self._cost_at(kind, family, family.coordinates_of(layout))
        for i, at in enumerate(_latin_hypercube(max(int(SAMPLED * budget), 1), family.coordinate_count, random)):
            mixed = parts and i % 4  # every fourth is not combined
            drawn = random.integers(len(parts), size=family.number) if mixed else ()
            self._cost_at(kind, family, family.with_feature_sizes([parts[j] for j in drawn], at))
        starts = list(self._distinct_layouts(self.candidates[mark:], kind))
        rest = budget - (len(self.candidates) - mark)
        for many in CLIMBS:
            starts = sorted(starts, key=self._cost)[:many]
            each = max(rest // len(CLIMBS) // max(len(starts), 1), 1)
            starts = [self._improved_layout(kind, family, one, each) for one in starts]
        return self._judged_again([one for one in self.candidates[mark:] if one.kind == kind])

    def _best_features(self, family: Family, budget: int, random: np.random.Generator) -> list[RailFeature]:
        """Return the best single features: one for each shape and each class of lengths (a factor of two)."""
        alone = replace(family, number=1)
        mark = len(self.candidates)
        for at in _latin_hypercube(max(budget, 1), alone.coordinate_count, random):
            self._cost_at("part", alone, at)
        return [one.layout.features[0] for one in self._distinct_layouts(self.candidates[mark:], "part")]

    def _distinct_layouts(self, found: Sequence[Candidate], kind: str) -> Iterator[Candidate]:
        """Return the best layouts, best first: one for each sequence of shapes and rounded lengths."""
        seen = set()
        told = [one for one in found if one.kind == kind and np.isfinite(one.worst)]
        for one in sorted(told, key=self._cost):
            sizes = tuple((f.shape, round(np.log2(f.length)) if f.length else 0) for f in one.layout.features)
            if sizes not in seen:
                seen.add(sizes)
                yield one

    def _improved_layout(self, kind: str, family: Family, start: Candidate, budget: int) -> Candidate:
        """Return the best layout that the simplex search finds from one of them."""
        from scipy.optimize import minimize

        mark, at = len(self.candidates), family.coordinates_of(start.layout)
        simplex = at + np.vstack([np.zeros(family.coordinate_count), np.diag(np.where(at < 0.5, SIMPLEX, -SIMPLEX))])
        options: Any = {"maxfev": budget, "initial_simplex": simplex, "xatol": FINE, "fatol": FINE}
        minimize(self._price_of(kind, family), at, method="Nelder-Mead", options=options)
        told = [one for one in self.candidates[mark:] if np.isfinite(one.worst)]
        return min([start, *told], key=self._cost)

    def _price_of(self, kind: str, family: Family) -> Callable[[FloatArray], float]:
        return lambda at: self._cost_at(kind, family, at)

    def _cost_at(self, kind: str, family: Family, at: FloatArray) -> float:
        """Return the cost of a layout, which the search minimises."""
        try:
            found = self.judge.lowered_to_limit(kind, family.layout_at(at), self.judge.search_rate, family.alike)
        except ComputationError:
            return 2.0 * REFUSED
        self.candidates.append(found)
        done = len(self.candidates)
        report("layouts", done, max(done, self.budget))
        if not np.isfinite(found.worst):
            return REFUSED + found.largest_force / self.judge.largest_force
        return min(self._cost(found), 0.5 * REFUSED)

    @property
    def _best_so_far(self) -> Candidate:
        """The best layout that was judged; if none keeps the limit of the force, one that does not."""
        return min(self.candidates, key=lambda one: self._cost(one) if np.isfinite(one.worst) else np.inf)

    @property
    def site_so_far(self) -> Site | None:
        """The site with the best layout that was judged; None if no layout keeps the limits."""
        best = self._best_so_far if self.candidates else None
        return None if best is None or not np.isfinite(best.worst) else self.judge.site_of(best.layout)

    def _cost(self, one: Candidate) -> float:
        return cost(one, self.judge.criterion)

    def _judged_again(self, found: Sequence[Candidate]) -> Candidate:
        told = [one for one in found if np.isfinite(one.worst)]
        if not told:
            limit = f"{self.judge.largest_force:g} N, which none of {len(found)} layouts keeps"
            raise InputError("", "largest_force", limit, "a larger one, lower heights, or a larger budget")
        ranked = sorted(told, key=lambda one: self._cost(one))[:JUDGED]
        again = [self.judge.judged_layout(one.kind, one.layout) for one in ranked]
        return min(again, key=lambda one: self._cost(one))


def _latin_hypercube(many: int, size: int, random: np.random.Generator) -> FloatArray:
    """Return a Latin hypercube: the range of each coordinate has `many` parts, and each part has one point."""
    parts = np.column_stack([random.permutation(many) for _ in range(size)])
    return np.asarray((parts + random.random((many, size))) / many)
