"""Branches of orbits: one parameter varies, and the orbit with it, round folds.

Points are found by a walk along it (walk.py). Between two points special ones are located by what changes its sign
there, or, for a loss of contact, by its number (special.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import unit_of
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.progress import Progress, progress_shown
from wheeltapper.lower.fields import Fields
from wheeltapper.orbits.asked import START, is_undamped, range_of
from wheeltapper.orbits.orbit import Orbit, multipliers_of
from wheeltapper.orbits.section_map import SectionMap
from wheeltapper.orbits.special import Special, special_points
from wheeltapper.orbits.walk import CLOSED_BRANCH, Branch, Point, Walk, walk
from wheeltapper.record.labels import BRANCH_TITLE

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


def follow(orbit: Orbit, over: Mapping[str, Any], *, progress: Progress = True) -> xr.Dataset:
    """Follow an orbit while one field of its scenario varies, in both directions and round folds.

    Parameters
    ----------
    orbit
        Where to begin, from `find`.
    over
        The field and its range, as {"speed": (1, 60)}; the orbit's own value lies in it.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        Over `point`, from one end of the branch to the other: the field by its path, `displacement` and `velocity` at
        phase zero, `multiplier_real` and `multiplier_imag`, `stable`, `losses`, `largest_force`. Over `special`, the
        special points in the same order: `kind` ("fold", "doubling", "grazing", "torus"), `parameter`, its value,
        `after`, the number of the point before it, and the state there. The attributes say why the branch ends. An
        orbit of several waves that comes from a doubling ends there.

    Raises
    ------
    InputError
        If it is no orbit, or no range around it.
    """
    if not isinstance(orbit, Orbit):
        raise InputError("", "orbit", value_text(orbit), "an orbit that `wheeltapper.orbits.find` returns")
    path, low, high = range_of(orbit.scenario, over)
    with progress_shown(progress, "following"):
        grown = Grown.begun(orbit, path, (low, high))
        grown.grow()
        return grown.dataset(special_points(grown.branch, grown.points))


@dataclass
class Grown:
    """A branch while it grows: points in both directions from the first, and why there are no more ("": not known)."""

    orbit: Orbit
    branch: Branch
    down: Walk
    up: Walk

    @staticmethod
    def begun(orbit: Orbit, path: str, bounds: tuple[float, float]) -> Grown:
        """Return a branch of one point, the orbit."""
        branch = Branch(SectionMap(orbit._section, orbit.waves, (path,)), *bounds)
        first = _first_point(branch, orbit, float(Fields(orbit.scenario)(path)))
        return Grown(orbit, branch, Walk([first.turned()], ""), Walk([first], ""))

    @property
    def points(self) -> list[Point]:
        """All points from one end to the other."""
        return [*(point.turned() for point in reversed(self.down.points[1:])), *self.up.points]

    def grow(self, keep: Callable[[], object] | None = None) -> None:
        """Let it grow to both ends; `keep` is called now and then."""

        def kept(name: str) -> Callable[[list[Point]], None] | None:
            def hold(points: list[Point]) -> None:
                setattr(self, name, Walk(points, ""))
                keep()  # type: ignore[misc]

            return None if keep is None else hold

        if not self.down.ended:
            self.down = walk(self.branch, self.down.points, keep=kept("down"))
        if not self.up.ended:
            closed = self.down.ended == CLOSED_BRANCH
            self.up = (
                Walk(self.up.points, CLOSED_BRANCH) if closed else walk(self.branch, self.up.points, keep=kept("up"))
            )

    def dataset(self, special: list[Special]) -> xr.Dataset:
        """Return the branch, as far as it has grown, with its special points."""
        return _dataset(self.branch, self.orbit, self.points, special, (self.down.ended, self.up.ended))


def _first_point(branch: Branch, orbit: Orbit, held: float) -> Point:
    """Return an orbit as a point, whose tangent goes up."""
    like = np.eye(branch.each.size + 1)[-1]
    place = np.append(orbit.state / branch.each.scale, branch.measure(held))
    point = branch.corrected(place, like, like)
    if point is None:
        found = f"an orbit that closes to {orbit.closure:.2g} only, or that is at a fold"
        raise InputError("", "orbit", found, "another one of its branch")
    return point


def _dataset(
    branch: Branch, orbit: Orbit, points: list[Point], special: list[Special], ended: tuple[str, str]
) -> xr.Dataset:
    """Return a branch as a dataset."""
    import xarray as xr

    (path,) = branch.each.paths
    unit, scale = unit_of(orbit.scenario, path), branch.each.scale
    multipliers = np.array([multipliers_of(point.image.slopes) for point in points])
    stable = np.abs(multipliers).max(axis=1) < 1.0
    along = "point"
    states = np.array([point.place[:-1] * scale for point in points])
    data: dict[str, Any] = {path: (along, [branch.value(point.place) for point in points], {"units": unit})}
    data |= {
        name: (along, column, {"units": START[name], "long_name": f"{name} at phase zero".replace("_", " ")})
        for name, column in zip(START, states.T, strict=False)
    }
    each = (along, "multiplier")
    data |= {
        "multiplier_real": (each, multipliers.real, {"units": "", "long_name": "multipliers, real parts"}),
        "multiplier_imag": (each, multipliers.imag, {"units": "", "long_name": "multipliers, imaginary parts"}),
        "stable": (along, stable & (not is_undamped(branch.each.section))),
        "losses": (along, [point.image.losses for point in points], {"long_name": "losses of contact in one period"}),
        "largest_force": (
            along, [point.image.largest_force for point in points], {"units": "N", "long_name": "largest force"},
        ),
    }  # fmt: skip
    places = np.array([one.place for one in special]).reshape(-1, branch.each.size + 1)
    coordinates: dict[str, Any] = {
        "special": ("special", np.arange(len(special))),
        "kind": ("special", np.array([one.kind for one in special], dtype=str)),
        "parameter": ("special", np.array([branch.value(place) for place in places]), {"units": unit}),
        "after": ("special", np.array([one.after for one in special], dtype=np.int64)),
    }
    coordinates |= {
        f"special_{name}": ("special", column, {"units": START[name]})
        for name, column in zip(START, (places[:, :-1] * scale).T, strict=False)
    }
    attributes = {
        "title": BRANCH_TITLE, "parameter": path, "waves": orbit.waves, "method": orbit.method,
        "static_force": branch.each.static_force, "begins": ended[0], "ends": ended[1],
    }  # fmt: skip
    return xr.Dataset(data, coordinates, attributes)
