"""Curves of special points as a second field of the scenario varies: borders between kinds of motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import unit_of
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.section import Section
from wheeltapper.orbits.asked import START, axes_of
from wheeltapper.orbits.orbit import Orbit
from wheeltapper.orbits.section_map import SectionMap
from wheeltapper.orbits.special import nearest_special
from wheeltapper.orbits.walk import Branch

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
RANGE = 1.3
"""The special point is looked for within this ratio of the first field to its last value."""
HALVINGS = 10
"""How often the way from one value of the second field to the next is halved, where nothing is found."""
FAR, CLOSE = 0.2, 0.02
"""Largest distance of a special point from the last one, in the branch's own measure; it may lie off where it is
expected by half of the way from the last one, or by the smaller of these."""


class _Tracer:
    """Special points of one kind, found one from another."""

    def __init__(self, orbit: Orbit, path: str, second: str, kind: str, place: FloatArray) -> None:
        self.orbit, self.path, self.second, self.kind = orbit, path, second, kind
        self.known = [(float(Fields(orbit.scenario)(second)), place)]

    def _expected(self, value: float) -> FloatArray:
        """Return where the special point should be, from the last two."""
        if len(self.known) < 2:
            return self.known[-1][1]
        (one, before), (two, after) = self.known[-2:]
        return after + (after - before) * (value - two) / (two - one)

    def _branch_at(self, value: float, place: FloatArray) -> Branch:
        scenario = self.orbit.scenario.replaced({self.second: value})
        each = SectionMap(Section(scenario, self.orbit.method), self.orbit.waves, (self.path,))
        near = float(np.exp(place[-1]))
        return Branch(each, near / RANGE, near * RANGE)

    def find(self, value: float) -> FloatArray | None:
        """Return the place of the special point at a value of the second field; None if there is none near."""
        expected = self._expected(value)
        branch = self._branch_at(value, expected)
        special = nearest_special(branch, expected, self.kind)
        if special is None:
            return None
        away, off = (float(np.linalg.norm(special.place - place)) for place in (self.known[-1][1], expected))
        if away > FAR or off > max(CLOSE, 0.5 * away):
            return None  # another one, perhaps
        self.known = [(one, place) for one, place in self.known if one != value] + [(value, special.place)]
        return special.place

    def reach(self, value: float, halvings: int = HALVINGS) -> FloatArray | None:
        """Return the same, by way of values in between where the step is too long."""
        found = self.find(value)
        if found is not None or halvings == 0:
            return found
        middle = 0.5 * (self.known[-1][0] + value)
        return None if self.reach(middle, halvings - 1) is None else self.reach(value, halvings - 1)


def trace(orbit: Orbit, special: xr.Dataset, over: Mapping[str, Any], *, progress: Progress = True) -> xr.Dataset:
    """Trace a special point of a branch while a second field varies: a border in the plane of two fields.

    Parameters
    ----------
    orbit
        The orbit from which the branch was followed.
    special
        One special point of it, as `branch.isel(special=3)`.
    over
        The second field and its values, in the order in which they are reached, as {"irregularity.0.amplitude": [4e-5,
        3e-5]}; the first one near the orbit's own value.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        Over `point`: both fields by their paths, `displacement` and `velocity` at phase zero. NaN from the value on at
        which the special point is not found any more. The attributes say its `kind`.

    Raises
    ------
    InputError
        If it is no special point of a branch, or the second field is the first one.
    """
    import xarray as xr

    if not isinstance(orbit, Orbit):
        raise InputError("", "orbit", value_text(orbit), "an orbit that `wheeltapper.orbits.find` returns")
    if not isinstance(special, xr.Dataset) or "kind" not in special.coords or special.kind.ndim:
        raise InputError("", "special", value_text(special), "one special point of a branch, `branch.isel(special=0)`")
    path = str(special.attrs["parameter"])
    _, axes = axes_of(orbit.scenario, over)
    if len(axes) != 1 or axes[0].path == path or axes[0].path.startswith("start."):
        raise InputError("", "over", value_text(dict(over)), f"one field other than {path}, with its values")
    if not float(special.parameter) > 0.0:
        raise InputError("", path, f"{float(special.parameter):g}", "more than 0")
    (axis,) = axes
    each = SectionMap(orbit._section, orbit.waves, (path,))
    names = [*START][: each.size]
    state = np.array([float(special[f"special_{name}"]) for name in names]) / each.scale
    place = np.append(state, np.log(float(special.parameter)))
    tracer = _Tracer(orbit, path, axis.path, str(special.kind.values), place)
    places = np.full((len(axis.values), each.size + 1), np.nan)
    with progress_shown(progress, "tracing"):
        for i, value in enumerate(axis.values.tolist()):
            found = tracer.reach(value)
            if found is None:
                break
            places[i] = found
            report("tracing", i + 1, len(places))
    data: dict[str, Any] = {
        axis.path: ("point", axis.values, {"units": axis.unit}),
        path: ("point", np.exp(places[:, -1]), {"units": unit_of(orbit.scenario, path)}),
    }
    data |= {name: ("point", places[:, i] * each.scale[i], {"units": START[name]}) for i, name in enumerate(names)}
    title = {"title": "wheeltapper trace", "kind": tracer.kind, "parameter": path, "second": axis.path}
    return xr.Dataset(data, attrs=title | {"waves": orbit.waves, "method": orbit.method})
