"""Designed irregularities: the rail on which a passage gives most information on some fields, under limits.

These are the paper's "specially designed irregularities". A layout is judged by the information of passages at each
speed on the named fields (`information`), each passage by itself; all that the site is uncertain of is unknown too:

determinant     The mean over the speeds of the determinant of the marginal information. The determinant is inversely
                proportional to the square of the area of the confidence ellipse of the fields' logarithms.
worst interval  The largest standard deviation of any of these logarithms at any speed.

The criterion is discontinuous, because the number of impacts changes it abruptly. Therefore the search first samples
layouts, most of which combine single features that are good by themselves. It then improves the best ones by the
simplex method of Nelder and Mead (1965). If the force is too large, the feature that causes it is lowered until the
force is allowed. The search uses a low sample rate at the same noise density. Its best layouts are judged again at the
rate of the sensor.

See docs/theory/diagnosis.rst, section 8.10.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from wheeltapper.describe.scenario import write_toml
from wheeltapper.describe.site import Site, as_any_site, as_site
from wheeltapper.diagnosis.gauges.design import GaugeDesign, design_of_gauges
from wheeltapper.diagnosis.inference.information import NAMED, Information, as_speeds, as_trigger
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.diagnosis.site.design_search import Candidate, Criterion, Judge, Search, cost
from wheeltapper.diagnosis.site.layout import FIRST, LISTENING, Bounds, Family
from wheeltapper.ground.arguments import (
    as_count,
    as_names,
    as_quantity,
    as_table,
    check_choice,
    check_flag,
)
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.ground.progress import Progress, progress_shown
from wheeltapper.ground.shown import Shown
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.plausible import site_notes

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Design(Shown):
    """The best rail, and the layouts with which it was compared.

    Attributes
    ----------
    site
        The site with that rail.
    information
        Information from passages over it, at the sensor's rate.
    criterion
        "determinant" or "worst interval".
    best, single, repeated, alike
        The layout found; the best single feature; that feature repeated at the best distance, as often as the design
        has features; the best layout of equal features. All at the sensor's rate, in recordings of the same length.
    candidates
        All layouts that the search has judged, at the rate of the search.
    """

    site: Site
    information: Information
    criterion: Criterion
    best: Candidate
    single: Candidate
    repeated: Candidate
    alike: Candidate
    candidates: tuple[Candidate, ...]

    @property
    def gains(self) -> dict[str, float]:
        """Ratio of the criterion to that of each layout of the comparison."""
        here = cost(self.best, self.criterion)
        others = (self.single, self.repeated, self.alike)
        return {one.kind: float(np.exp(cost(one, self.criterion) - here)) for one in others}

    def front(self, over: Literal["largest_force", "total_length"] = "largest_force") -> tuple[Candidate, ...]:
        """Return the Pareto front of the designed layouts, over the criterion and the force or the length.

        The search looks for the best layout within the limits. Layouts far below the limits are by-products, and better
        ones may exist.
        """
        check_choice(over, "over", ("largest_force", "total_length"))
        out: list[Candidate] = []
        told = [one for one in self.candidates if one.kind == "designed" and np.isfinite(one.determinant)]
        for one in sorted(told, key=lambda one: (getattr(one, over), cost(one, self.criterion))):
            if not out or cost(one, self.criterion) < cost(out[-1], self.criterion):
                out.append(one)
        return tuple(out)

    def chart(self) -> xr.Dataset:
        """Return all judged layouts as a labelled dataset over "candidate" and "feature"."""
        import xarray as xr

        most = max(len(one.layout.features) for one in self.candidates)
        features = np.full((len(self.candidates), most, 3), np.nan)
        for i, one in enumerate(self.candidates):
            for j, feature in enumerate(one.layout.features):
                features[i, j] = feature.signed_height, feature.length, feature.start
        plain = [(one.determinant, one.worst, one.largest_force, one.total_length) for one in self.candidates]
        data: dict[str, Any] = {
            name: ("candidate", column, {"units": unit, "long_name": meaning})
            for (name, unit, meaning), column in zip(COLUMNS, np.array(plain).T, strict=True)
        }
        named = zip(("height", "length", "start"), np.moveaxis(features, 2, 0), strict=True)
        data |= {name: (("candidate", "feature"), held, {"units": "m"}) for name, held in named}
        kinds = np.array([one.kind for one in self.candidates])
        return xr.Dataset(data, {"kind": ("candidate", kinds)}, {"title": "wheeltapper design"})

    def to_toml(self, path: str | Path) -> None:
        """Write the site with the designed rail."""
        write_toml(self.site, path)

    def __str__(self) -> str:
        features = "; ".join(
            f"{one.shape} {1e3 * one.height:.3g} mm" + (f" x {1e3 * one.length:.3g} mm" if one.length else "")
            + f" at {one.start:.4g} m" for one in self.best.layout.features
        )  # fmt: skip
        named = self.information.paths[: self.information.named]
        told = ", ".join(f"{path} {100.0 * self.information.deviation(path).max():.2g} %" for path in named)
        gains = ", ".join(f"{gain:.3g} x {kind}" for kind, gain in self.gains.items())
        return f"{features}: {told} at worst; {self.criterion} {gains}; {self.best.largest_force / 1e3:.0f} kN"


COLUMNS = (
    ("determinant", "", "mean determinant of the marginal information"),
    ("worst_interval", "", "largest standard deviation of a named field over its value"),
    ("largest_force", "N", "largest contact force at any speed"),
    ("total_length", "m", "from the first feature's start to the last one's end"),
)
"""Variables of a design's chart: name, unit and meaning."""


RAIL: dict[str, Any] = {
    "number": 2, "shapes": ("bump", "dip"), "heights": (2e-5, 5e-3), "lengths": (0.02, 0.4), "spacing": (0.02, 2.0),
    "total_length": 2.0, "largest_force": 400e3,
}  # fmt: skip
"""What a rail that is to be designed may have on it, if nothing else is said: see `design_site`."""
SPEEDS = (6.0, 9.0, 12.0)
"""Over a deck, if none are named, m/s."""
OF_DECK: dict[str, Any] = {
    "parameters": NAMED, "vary": None, "criterion": "determinant", "one_gauge": False, "trigger": 0.0,
    "budget": 2000, "seed": 0,
}  # fmt: skip
"""Arguments of `design_site` that say nothing of gauges, and what they are if they are not given."""


def design_site(
    site: Site | str | Path,
    parameters: Sequence[str] = NAMED,
    speeds: Sequence[float] | None = SPEEDS,
    *,
    rail: Mapping[str, Any] | None = None,
    vary: Mapping[str, Bounds] | None = None,
    criterion: Criterion = "determinant",
    one_gauge: bool = False,
    trigger: float = 0.0,
    budget: int = 2000,
    seed: int = 0,
    progress: Progress = True,
) -> Design | GaugeDesign:
    """Design the rail over a deck for most information on some fields, or find the best places of gauges.

    At a site with pairs of shear gauges on a `track`, the places of the pairs are found from which the length of a flat
    is known best, in the mean over the wheel's circumference.

    Parameters
    ----------
    site
        The site, or the path of its TOML file. Deck, sensor, vehicle and uncertainties are kept; the rail is replaced.
        Each feature has the uncertainty of the site's first one ("irregularity.0.height" and so on). All recordings
        last 36 contact periods longer than the slowest passage over the total length, or as long as the site's if that
        is longer. At a site with gauges the pairs are replaced by copies of the first one, in other bays of the track.
    parameters
        Paths of the fields in question; they have no prior.
    speeds
        Speeds, m/s. None: the speed of the passage, or the "speed" that `vary` bounds. With gauges, by default 20 m/s.
    rail
        What may be on the rail; what is not given is as in RAIL. "number": how many features there are. "shapes": which
        of "bump", "dip", "step up" and "step down" each feature may be. "heights", "lengths", "spacing": bounds, m, of
        magnitudes, and of the distance from one start to the next; over features longer than 0.4 m the bogie, whose
        inertia the wheelset's model leaves out, begins to move. "total_length", "largest_force": limits, m and N; that
        of the force holds at every speed.
        At a site with gauges, the pairs that may be on the rail; what is not given is as in `gauges.design.GAUGES`.
        "number": how many pairs there are. "cribs": bays of the track that may have a pair, either how many from the
        first pair's bay on, or a list in which the first pair's bay is 0; they lie within 16 bays. "flats": as the
        `faults` of `wheeltapper.diagnosis.assess`. "static_force", "noise": of a wheel and of a sample, N. "criterion":
        "root mean square" or "90 % quantile" of the standard deviations of the length, over 24 places of the
        circumference, all speeds and all flats. "front": other numbers of pairs for which places are found, too.
        "rates": other sample rates, Hz, at which the pairs found are judged, with the same noise of a sample. Other
        arguments than this and `speeds` are for decks.
    vary
        By path, bounds of other fields that are chosen, too, such as "track.mass". They are also chosen for the layouts
        of the comparison.
    criterion
        "determinant" or "worst interval".
    one_gauge
        True if all heights share one relative error. Otherwise each height has an error of its own, and several
        features average it.
    trigger
        Standard deviation of the trigger's time, s, as in `information`.
    budget, seed
        Approximate number of layouts that are judged, and the seed of the random numbers: the same seed finds the same
        layout.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    Design or GaugeDesign
        GaugeDesign for a site with gauges on a track.

    Raises
    ------
    InputError
        If an argument is wrong, or the site's motion has no exact derivatives.
    Interrupted
        At Ctrl-C, with the best rail of a deck so far.
    """
    place = as_any_site(site)
    if place.track is not None:
        of_deck = (parameters, vary, criterion, one_gauge, trigger, budget, seed)
        unfit = [name for (name, usual), one in zip(OF_DECK.items(), of_deck, strict=True) if one != usual]
        for name in unfit:
            raise InputError("", name, "given, with a site that has a track", "none of it")
        warn_of(site_notes(place))
        try:
            return design_of_gauges(place, None if speeds is SPEEDS else speeds, rail, progress)
        except KeyboardInterrupt as stop:
            raise Interrupted(None) from stop
    site, budget, seed = as_site(site), as_count(budget, "budget"), as_count(seed, "seed", 0)
    warn_of(site_notes(site))  # other rails are tried: what the passage never meets now does not matter
    check_choice(criterion, "criterion", ("determinant", "worst interval"))
    check_flag(one_gauge, "one_gauge")
    passing = None if speeds is None else tuple(as_speeds(speeds))
    parameters = as_names(parameters, "parameters", "paths of fields")
    varied = as_table(vary, "vary", "bounds by path, or None")
    shaping = [path for path in (*parameters, *varied) if path.startswith("irregularity.")]
    if shaping:
        raise InputError("", shaping[0], "a field of the rail, which is to be designed", "fields of what rolls over it")
    stated = as_table(rail, "rail", f"a table over {', '.join(RAIL)}")
    given: dict[str, Any] = RAIL | stated
    for name in given:
        if name not in RAIL:
            raise InputError("", f"rail.{name}", f"the unknown name {name!r}", with_suggestion(name, RAIL))
    given["shapes"] = as_names(given["shapes"], "shapes", "shapes of features")
    largest_force = as_quantity(given.pop("largest_force"), "largest_force", "force")
    first = FIRST * float(site.passage.vehicle.radius)
    family = Family(**given, fields=varied, first=first).checked_family()
    plain = ("bump",) if "bump" in family.shapes else family.shapes[:1]
    slowest = min(passing) if passing else family.fields.get("speed", (float(site.passage.speed),))[0]
    duration = family.passage_duration(slowest) + LISTENING * Scale(site.passage).period
    judge = Judge(
        site, parameters, passing, criterion, largest_force, one_gauge,
        as_trigger(trigger), family.heights[0], duration,
    )  # fmt: skip
    search = Search(judge, budget)
    try:
        with progress_shown(progress, "layouts"):
            return _design_of(search, family, plain, seed)
    except KeyboardInterrupt as stop:
        raise Interrupted(search.site_so_far) from stop


class Interrupted(KeyboardInterrupt):
    """A stopped search. `site` has the best rail so far, judged at the rate of the search; None if there is none."""

    def __init__(self, site: Site | None) -> None:
        super().__init__()
        self.site = site


def _design_of(search: Search, family: Family, plain: tuple[str, ...], seed: int) -> Design:
    """Return the best of all layouts and those of the comparison, which have the shape `plain`."""
    judge = search.judge
    single = search.best_layout("single", replace(family, number=1, shapes=plain), [], [seed, 0])
    bumps, bump = replace(family, shapes=plain, alike=True), single.layout.features[0]
    same = replace(bumps, heights=(bump.height, bump.height), lengths=(bump.length, bump.length))
    repeated = search.best_layout("repeated", same, [single.layout], [seed, 1])
    alike = search.best_layout("alike", bumps, [single.layout, repeated.layout], [seed, 2])
    best = search.best_layout("designed", family, [one.layout for one in (single, repeated, alike)], [seed, 3])
    return Design(
        judge.site_of(best.layout), judge.information(best.layout), judge.criterion, best, single, repeated, alike,
        tuple(search.candidates),
    )  # fmt: skip
