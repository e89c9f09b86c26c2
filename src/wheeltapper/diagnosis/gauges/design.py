"""Where pairs of gauges should be: places of pairs from which the length of a flat is known best.

A layout is judged by the standard deviations of the length that `Foreseen.deviation` tells, at places all around the
wheel. The inverse of the readings' covariance is made of sums over cribs, so that many layouts share their parts.

Theory: docs/theory/gauges.rst, section 16.12.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import floor
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from wheeltapper.describe.sensor.rail_shear_force import RailShearForce
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.faults.wheel_flat import FreshFlat
from wheeltapper.diagnosis.gauges.fit import covariance_of
from wheeltapper.diagnosis.gauges.foreseen import Flat, Foreseen
from wheeltapper.diagnosis.gauges.passing import BEYOND
from wheeltapper.diagnosis.gauges.performance import (
    FORCE,
    NOISE,
    PLACES,
    SHAPES,
    SPEED,
    foreseen_of,
    lengths_of_flats,
    pairs_by_side,
)
from wheeltapper.diagnosis.gauges.sizing import OWN_LENGTH
from wheeltapper.ground.arguments import as_count, as_list, as_quantities, as_quantity, as_table, check_choice
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.shown import Shown
from wheeltapper.march.common.blocks import algebra_on_one_thread

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
GAUGES: dict[str, Any] = {
    "number": 6, "cribs": 12, "flats": {FreshFlat.name: 0.03}, "static_force": FORCE, "noise": NOISE,
    "criterion": "root mean square", "front": (), "rates": (),
}  # fmt: skip
"""What pairs of gauges may be on the rail, if nothing else is said: see `design_site`."""
CRITERIA: dict[str, Callable[[FloatArray], float]] = {
    "root mean square": lambda values: float(np.sqrt((values**2).mean())),
    "90 % quantile": lambda values: float(np.quantile(values, 0.9)),
}
"""Of the standard deviations of lengths."""
EVEN = {"every crib": 1, "every second crib": 2, "every third crib": 3}
"""Layouts of the comparison, and how many bays their pairs are apart."""
MOST, FARTHEST = 16, 1000
"""Cribs lie within so many bays, and so many from the first pair at most."""
ALIKE = 0.9
"""A flat's error of the model counts in readings whose weight it makes smaller than this, over that by noise: others
would change the criterion by 0.1 %."""
KEPT = 48
"""Parts of sums that are kept."""


class GaugeLayout(NamedTuple):
    """Cribs with a pair each, and how well the length of a flat is known by them.

    Attributes
    ----------
    kind
        "designed", "tried", or that of the comparison: "every crib", "every second crib", "every third crib".
    cribs
        Numbers of bays; that of the site's first pair is 0.
    deviations
        Standard deviations of the length, m, (wheels, places); wheels are flats at each speed.
    value, with_model
        The criterion, m, of these deviations: without and with the error of the model, 1 % of the length.
    """

    kind: str
    cribs: tuple[int, ...]
    deviations: FloatArray
    value: float
    with_model: float


@dataclass(frozen=True, eq=False)
class GaugeDesign(Shown):
    """The best places of pairs of gauges, and those with which they were compared.

    Attributes
    ----------
    site
        The site with these pairs.
    criterion
        "root mean square" or "90 % quantile".
    best
        The layout found.
    even
        Layouts with the same number of pairs at equal distances.
    front
        The layouts found for each number of pairs.
    rates
        The criterion of the best layout at other sample rates, m, without and with the error of the model; by the rate,
        Hz.
    candidates
        All layouts that were judged.
    """

    site: Site
    criterion: str
    best: GaugeLayout
    even: tuple[GaugeLayout, ...]
    front: tuple[GaugeLayout, ...]
    rates: Mapping[float, tuple[float, float]]
    candidates: tuple[GaugeLayout, ...]

    @property
    def gains(self) -> dict[str, float]:
        """Ratio of the criterion of each layout of the comparison to that of the best, without error of the model."""
        return {one.kind: one.value / self.best.value for one in self.even}

    @property
    def gains_with_model(self) -> dict[str, float]:
        """The same with the error of the model."""
        return {one.kind: one.with_model / self.best.with_model for one in self.even}

    def chart(self) -> xr.Dataset:
        """Return all judged layouts as a labelled dataset over "candidate" and "crib"."""
        import xarray as xr

        cribs = sorted({crib for one in self.candidates for crib in one.cribs})
        held = np.array([[crib in one.cribs for crib in cribs] for one in self.candidates])
        data = {
            "instrumented": (("candidate", "crib"), held),
            "value": ("candidate", [one.value for one in self.candidates], {"units": "m"}),
            "with_model": ("candidate", [one.with_model for one in self.candidates], {"units": "m"}),
        }
        own = {"crib": cribs, "kind": ("candidate", [one.kind for one in self.candidates])}
        return xr.Dataset(data, own, {"title": "wheeltapper gauge design"})

    def to_toml(self, path: str | Path) -> None:
        """Write the site with the designed pairs."""
        self.site.to_toml(path)

    def __str__(self) -> str:
        def row(name: str, value: float, with_model: float) -> str:
            return f"{name:26} {1e3 * value:8.3f} {1e3 * with_model:18.3f}"

        lines = [
            f"{'sd mm, ' + self.criterion:26} {'gauges':>8} {'with model error':>18}",
            row(f"designed, {len(self.best.cribs)} pairs", self.best.value, self.best.with_model),
            *(row(one.kind, one.value, one.with_model) for one in self.even),
        ]
        lines += [row(f"{len(one.cribs)} pairs", one.value, one.with_model) for one in self.front]
        lines += [row(f"read at {rate:g} Hz", *values) for rate, values in self.rates.items()]
        gains = ", ".join(
            f"{gain:.3f} x {kind} ({self.gains_with_model[kind]:.3f} with model error)"
            for kind, gain in self.gains.items()
        )
        return "\n".join([f"pairs in cribs {', '.join(map(str, self.best.cribs))}: {gains}", *lines])


def design_of_gauges(
    site: Site, speeds: Sequence[float] | None, rail: Mapping[str, Any] | None, progress: Progress
) -> GaugeDesign:
    """Return the best places of a site's pairs of gauges; see `design_site`."""
    asked = _Asked(site, speeds, rail)
    with progress_shown(progress, "layouts"), algebra_on_one_thread():
        judge, front = _Judge(asked), dict[int, GaugeLayout]()
        for number in sorted({asked.number, *asked.front}):
            smaller = front[max(front)] if front else None
            front[number] = judge.best_layout(number, smaller)._replace(kind="designed")
        best = front[asked.number]
        even = tuple(judge.layout(cribs, kind) for kind, cribs in asked.even(asked.number).items())
        rates = {rate: judge.at_rate(best.cribs, rate) for rate in asked.rates}
    kinds = {one.cribs: one.kind for one in (*even, *front.values())}
    tried = tuple(one._replace(kind=kinds.get(one.cribs, one.kind)) for one in judge.layouts.values())
    designs = tuple(front.values()) if asked.front else ()
    return GaugeDesign(asked.site_with(best.cribs), asked.criterion, best, even, designs, rates, tried)


class _Asked:
    """What is asked of a design: checked arguments of `design_site`."""

    def __init__(self, site: Site, speeds: Sequence[float] | None, rail: Mapping[str, Any] | None) -> None:
        given = as_table(rail, "rail", f"a table over {', '.join(GAUGES)}")
        for name in given:
            if name not in GAUGES:
                raise InputError("", f"rail.{name}", f"the unknown name {name!r}", with_suggestion(name, GAUGES))
        given = GAUGES | given
        self.sides = {side: pairs[0] for side, pairs in pairs_by_side(site).items()}
        self.site, self.template = site, next(iter(self.sides.values()))
        self.track: Any = site.track  # with seats: `pairs_by_side` has seen to it
        self.speeds = [SPEED] if speeds is None else as_quantities(speeds, "speeds", "speed", "one or more speeds")
        self.cribs = _cribs(given["cribs"])
        most = len(self.cribs)
        self.number = as_count(given["number"], "rail.number", 1, most)
        front = as_list(given["front"], "rail.front", "numbers of pairs")
        self.front = [as_count(one, "rail.front", 1, most) for one in front]
        self.flats = [
            Flat(length, SHAPES[name]) for name, several in lengths_of_flats(given["flats"], "rail.flats").items()
            for length in several
        ]  # fmt: skip
        self.force = as_quantity(given["static_force"], "rail.static_force", "force")
        self.noise = as_quantity(given["noise"], "rail.noise", "force")
        self.criterion: str = given["criterion"]
        check_choice(self.criterion, "rail.criterion", CRITERIA)
        rates = as_list(given["rates"], "rail.rates", "rates, Hz")
        self.rates = as_quantities(rates, "rail.rates", "frequency", "rates, Hz") if rates else []
        self._check_template()

    def _check_template(self) -> None:
        """Refuse first pairs that are not between two seats, or differ from rail to rail."""
        spacing, seat, here = float(self.track.spacing), float(self.track.first_sleeper), self.template
        bay = floor((here.x1 - seat) / spacing)
        if here.x2 > seat + (bay + 1) * spacing:
            found = f"the pair {here.name!r} with a seat between its gauges"
            raise InputError("", "sensors", found, "a first pair between two seats: the others become like it")
        own = ("x1", "x2", "rate", "anti_alias", "gain_uncertainty")
        for other in self.sides.values():
            if any(getattr(other, name) != getattr(here, name) for name in own):
                found = f"first pairs {here.name!r} and {other.name!r} that differ"
                raise InputError("", "sensors", found, f"the same {', '.join(own)} on both rails")

    def pair(self, crib: int, side: str) -> RailShearForce:
        """Return the pair in a crib of a rail."""
        by, like = crib * float(self.track.spacing), self.sides[side]
        name = f"crib {crib}" if like.side is None else f"{like.side} crib {crib}"
        return like.model_copy(update={"name": name, "x1": round(like.x1 + by, 9), "x2": round(like.x2 + by, 9)})

    def pairs(self, cribs: Sequence[int]) -> list[RailShearForce]:
        """Return the pairs in cribs of the first rail."""
        return [self.pair(crib, next(iter(self.sides))) for crib in cribs]

    def site_with(self, cribs: Sequence[int]) -> Site:
        """Return the site with pairs in these cribs of all its rails."""
        others = [one for one in self.site.sensors if not isinstance(one, RailShearForce)]
        return self.site.replaced({"sensors": [*(self.pair(*one) for one in product(cribs, self.sides)), *others]})

    def even(self, number: int) -> dict[str, tuple[int, ...]]:
        """Return layouts of equal distances that are possible, by their kinds."""
        out = {}
        for kind, step in EVEN.items():
            several = [tuple(range(first, first + step * number, step)) for first in self.cribs]
            possible = [one for one in several if set(one) <= set(self.cribs)]
            if possible:
                out[kind] = possible[0]
        return out


def _best(layouts: Iterable[GaugeLayout]) -> GaugeLayout:
    return min(layouts, key=lambda one: one.value)


class _Judge:
    """The criterion of layouts, and the search for the best one."""

    def __init__(self, asked: _Asked) -> None:
        self.asked = asked
        self.layouts: dict[tuple[int, ...], GaugeLayout] = {}
        pairs = asked.pairs(asked.cribs)
        self._wheels = []
        for speed in asked.speeds:
            seen = foreseen_of(asked.site, pairs, speed, asked.force, asked.noise)
            self._wheels += [_Wheel(seen, flat) for flat in asked.flats]
        self._lengths = [flat.length for _ in asked.speeds for flat in asked.flats]

    def layout(self, cribs: Sequence[int], kind: str = "tried") -> GaugeLayout:
        """Return a layout with its criterion."""
        key = tuple(sorted(cribs))
        if key not in self.layouts:
            numbers = [self.asked.cribs.index(one) for one in key]
            deviations = np.array([wheel.deviations(numbers) for wheel in self._wheels])
            self.layouts[key] = GaugeLayout("tried", key, deviations, *self._criteria(deviations))
            report("layouts", len(self.layouts), 0)
        return self.layouts[key]._replace(kind=kind)

    def best_layout(self, number: int, smaller: GaugeLayout | None) -> GaugeLayout:
        """Return the best layout of so many pairs, by exchange of one pair after the other.

        It begins with the best of those at equal distances and of those with pairs more than a `smaller` one.
        """
        best = _best(self.layout(one) for one in (*self.asked.even(number).values(), self.asked.cribs[:number]))
        if smaller is not None:
            while len(smaller.cribs) < number:
                smaller = _best(self.layout((*smaller.cribs, one)) for one in self._free(smaller.cribs))
            best = _best([best, smaller])
        while True:
            before = best
            for crib in before.cribs:
                if crib in best.cribs:
                    rest = [one for one in best.cribs if one != crib]
                    best = _best([best, *(self.layout((*rest, one)) for one in self._free(best.cribs))])
            if best.cribs == before.cribs:
                return best

    def at_rate(self, cribs: Sequence[int], rate: float) -> tuple[float, float]:
        """Return the criterion of a layout that is read at another rate, without and with the error of the model."""
        pairs = [one.model_copy(update={"rate": rate}) for one in self.asked.pairs(cribs)]
        out = []
        for speed in self.asked.speeds:
            seen = foreseen_of(self.asked.site, pairs, speed, self.asked.force, self.asked.noise)
            out += [seen.deviation(flat, PLACES) for flat in self.asked.flats]
        return self._criteria(np.array(out))

    def _criteria(self, deviations: FloatArray) -> tuple[float, float]:
        of = CRITERIA[self.asked.criterion]
        return of(deviations), of(np.hypot(deviations, OWN_LENGTH * np.array(self._lengths)[:, None]))

    def _free(self, cribs: Sequence[int]) -> list[int]:
        return [one for one in self.asked.cribs if one not in cribs]


class _Part(NamedTuple):
    """What readings of one crib add to sums: of roughness R and derivatives J over the noise, with weights w."""

    rows: slice  # of the crib's readings
    rough: FloatArray  # Rᵀ·R, (waves, waves)
    tied: FloatArray  # Rᵀ·w·J, (waves, places, columns)
    own: FloatArray  # Jᵀ·w·J, (places, columns, columns)


class _Wheel:
    """A wheel with a flat that passes pairs in all cribs, and how well pairs in some of them tell its length."""

    def __init__(self, seen: Foreseen, flat: Flat) -> None:
        told, self._length = seen.sensitivity(flat, PLACES), flat.length
        band = told.problem.band
        ends = np.cumsum(band.counts)[:-1]
        slope = np.broadcast_to(np.linspace(-1.0, 1.0, len(band.picked))[:, None], band.picked.shape)
        slopes = np.broadcast_to(band.taken(slope)[:, None], told.readings.shape)
        beside = np.stack([told.readings, np.ones_like(told.readings), slopes], axis=1)
        free = np.concatenate([told.changes, beside], axis=1) / band.noise
        self._values = told.changes.shape[1]
        weights = (band.noise / told.deviations) ** 2
        self._weights = np.split(np.where(weights > ALIKE, 1.0, weights), ends)
        self._free = np.split(np.moveaxis(free, 1, 2), ends)
        self._rough = np.split(told.problem.rough / band.noise, ends)
        passing = band.passing
        self._x = [passing.x[own] for own in band.picked.T]
        beyond = BEYOND - band.unknown / passing.rate * passing.speed
        self._ends = [(one.x1 - beyond, one.x2 + beyond) for one in passing.sensors]
        self._precision = told.precision
        self._parts: dict[tuple[int, float, float], _Part] = {}

    def deviations(self, cribs: Sequence[int]) -> FloatArray:
        """Return the standard deviation of the length, m, at each place, with pairs in these of the cribs.

        Readings count while the wheel is near these pairs, as in a fit.
        """
        ends = [self._ends[one] for one in cribs]
        parts = [self._part(one, min(ends)[0], max(ends)[1]) for one in cribs]
        lower = cholesky(np.eye(len(parts[0].rough)) + sum(one.rough for one in parts), lower=True)
        values = self._values
        order = np.concatenate([np.arange(values), *(values + len(self._rough) * np.arange(3) + one for one in cribs)])
        precision = self._precision[order]
        out = []
        for place in range(PLACES):
            tied = np.zeros((len(lower), len(order)))
            own = np.zeros((len(order), len(order)))
            for number, part in enumerate(parts):
                columns = np.r_[0:values, values + 3 * number : values + 3 * number + 3]
                tied[:, columns] += part.tied[:, place]
                own[np.ix_(columns, columns)] += part.own[place]
            less = np.concatenate([self._lighter(*one, place) for one in zip(cribs, parts, strict=True)])
            solved = solve_triangular(lower, np.concatenate([less.T, tied], axis=1), lower=True, check_finite=False)
            left, right = solved[:, : len(less)], solved[:, len(less) :]
            across = left.T @ right
            held = cho_factor(np.eye(len(less)) - left.T @ left, lower=True)
            curvature = own - right.T @ right - across.T @ cho_solve(held, across) + np.diag(precision)
            out.append(self._length * float(np.sqrt(covariance_of(curvature, precision)[1][0, 0])))
        return np.array(out)

    def _lighter(self, crib: int, part: _Part, place: int) -> FloatArray:
        """Return rows √(1 - w)·R of the readings whose weight w is less than one with a flat at a place."""
        weights = self._weights[crib][part.rows, place]
        lighter = weights < 1.0
        return np.asarray(np.sqrt(1.0 - weights[lighter])[:, None] * self._rough[crib][part.rows][lighter])

    def _part(self, crib: int, first: float, last: float) -> _Part:
        """Return what a crib adds to sums where readings count while the wheel is between two places, m."""
        key = crib, first, last
        if key not in self._parts:
            rows = slice(*np.searchsorted(self._x[crib], (first, last)))
            rough, free = self._rough[crib][rows], self._free[crib][rows]
            weighed = self._weights[crib][rows, :, None] * free
            tied = (rough.T @ weighed.reshape(len(rough), -1)).reshape(-1, *free.shape[1:])
            own = np.einsum("rpi,rpj->pij", free, weighed, optimize=True)
            self._parts[key] = _Part(rows, rough.T @ rough, tied, own)
            while len(self._parts) > KEPT:
                self._parts.pop(next(iter(self._parts)))
        return self._parts[key]


def _cribs(given: Any) -> tuple[int, ...]:
    """Return the cribs that may have a pair, rising."""
    what = f"a number of bays, or different numbers of bays within {MOST}"
    if isinstance(given, Integral):
        return tuple(range(as_count(given, "rail.cribs", 1, MOST)))
    found = sorted(as_count(one, "rail.cribs", -FARTHEST, FARTHEST) for one in as_list(given, "rail.cribs", what))
    if not found or len(set(found)) < len(found) or found[-1] - found[0] >= MOST:
        raise InputError("", "rail.cribs", value_text(given), what)
    return tuple(found)
