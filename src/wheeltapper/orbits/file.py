"""A branch in a file that can be continued where it was interrupted."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.ask.wear_files import beside_of, locked_file, unwritable_error
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import Progress, progress_shown
from wheeltapper.orbits.asked import START, range_of, section_of
from wheeltapper.orbits.branch import Grown
from wheeltapper.orbits.orbit import find, orbit_of
from wheeltapper.orbits.section_map import SectionMap
from wheeltapper.orbits.special import special_points
from wheeltapper.orbits.walk import Branch, Walk

if TYPE_CHECKING:
    import xarray as xr


def follow_into(
    file: Path, scenario: Scenario, over: Mapping[str, Any], waves: int = 1, *, resume: bool = False,
    method: str = "default", progress: Progress = True,
) -> xr.Dataset:  # fmt: skip
    """Follow the orbit on which the motion from rest settles, and keep the branch in a file while it grows.

    Parameters
    ----------
    file
        The file (.nc; opens in plain xarray), new unless `resume`.
    scenario, waves, method
        As for `find`.
    over
        As for `follow`.
    resume
        Go on with a file that exists.
    progress
        As for `wheeltapper.simulate`.

    Raises
    ------
    InputError
        If the file is there already, or holds a branch of something else.
    """
    waves = as_count(waves, "waves")
    path, *bounds = range_of(scenario, over)
    asked = {
        "scenario": json.dumps(scenario.model_dump(mode="json")), "parameter": path, "waves": waves, "method": method,
        "bounds": bounds,
    }  # fmt: skip
    with locked_file(file), progress_shown(progress, "following"):
        if file.exists() and not resume:
            raise InputError(
                str(file), "--output", "a file that is there already", "a new name, or --resume to go on with it"
            )
        if file.exists():
            grown = _read(file, scenario, asked)
        else:
            grown = Grown.begun(find(scenario, waves, method=method), path, (bounds[0], bounds[1]))
        grown.grow(lambda: _write(file, grown, asked))
        return _write(file, grown, asked, done=True)


def _write(file: Path, grown: Grown, asked: dict[str, Any], done: bool = False) -> xr.Dataset:
    """Write a branch, with its special points when it is done."""
    data = grown.dataset(special_points(grown.branch, grown.points) if done else [])
    data.attrs |= asked | {"first": len(grown.down.points) - 1}
    beside = beside_of(file)
    try:
        data.to_netcdf(beside, engine="h5netcdf")
        beside.replace(file)
    except OSError as error:
        raise unwritable_error(file, error) from error
    return data


def _read(file: Path, scenario: Scenario, asked: dict[str, Any]) -> Grown:
    """Return the branch in a file, ready to grow on."""
    import xarray as xr

    try:
        with xr.open_dataset(file, engine="h5netcdf") as opened:
            data = opened.load()
        held = {name: data.attrs[name] for name in (*asked, "first", "begins", "ends")}
    except (OSError, KeyError, ValueError) as error:
        raise InputError(str(file), "", "no branch of orbits", "a file that `wheeltapper orbits` wrote") from error
    for name, value in asked.items():
        if not np.array_equal(held[name], value):
            raise InputError(str(file), name, "a branch of something else", "the file's own scenario and options")
    (path, first), (low, high) = (asked["parameter"], int(held["first"])), asked["bounds"]
    section = section_of(scenario, asked["method"])
    branch = Branch(SectionMap(section, asked["waves"], (path,)), low, high)
    each = branch.each
    states = np.column_stack([data[name].values for name in [*START][: each.size]]) / each.scale
    places = np.column_stack([states, [branch.measure(value) for value in data[path].values]])
    ways = np.gradient(places, axis=0) if len(places) > 1 else np.eye(len(places[0]))[-1:]
    points = [branch.point_at(place, way) for place, way in zip(places, ways, strict=True)]
    down = [point.turned() for point in reversed(points[: first + 1])]
    wave = each.wave_at(branch.value(points[first].place))
    orbit = orbit_of(each, wave, each.fixed_point(wave, points[first].place[:-1]))
    return Grown(orbit, branch, Walk(down, str(held["begins"])), Walk(points[first:], str(held["ends"])))
