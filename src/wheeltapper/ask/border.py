"""Curves in a plane of two fields at which a further loss of contact begins."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.questions import BORDER
from wheeltapper.ask.study import needs_over, study_of, unit_of
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import Need
from wheeltapper.ground.progress import Progress, progress_shown
from wheeltapper.ground.warned import warn_caller
from wheeltapper.march import run
from wheeltapper.march.common.blocks import core_count
from wheeltapper.record.arguments import as_scenario
from wheeltapper.record.cells.door import cells_of
from wheeltapper.record.features import first_loss

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


def border(
    scenario: Scenario | str | Path,
    over: Mapping[str, Any],
    *,
    losses: int = 1,
    resolution: int = 40,
    method: str = "default",
    threads: int | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Find the curves in a plane of two fields at which contact begins to be lost.

    The curves are the roots of a margin, which is exact. The margin is the smallest indentation if contact is kept, and
    minus the largest clearance if contact is lost. With material damping the force may end while the wheel is still
    indented. The factor 1 + χ·rate, times a length, therefore counts as well. With several wheels, the wheel that is
    nearest to a loss counts. The roots are found on the lines of a grid, to 1e-9 of a segment of the line. The grid
    only decides which curves are found. Each margin of a wagon takes a run by `method`: a grid of 40 by 40 segments
    takes some 2000 runs.

    Parameters
    ----------
    scenario
        The scenario that all points share; or the path of its TOML file.
    over
        The paths of two fields, with the lowest and the highest value of each: numbers in SI units or strings with a
        unit.
    losses
        1: the curves at which contact begins to be lost. n: the curves at which an n-th loss appears, and with it an
        n-th impact.
    resolution
        Number of the grid's segments along each axis.
    method, threads, progress
        As for `sweep`.

    Returns
    -------
    xarray.Dataset
        Over dimension "point": both fields, `line` (the number of the curve; its points in order) and `margin` (m, the
        remaining margin, zero up to the accuracy, except where a new loss comes before earlier ones).

    Raises
    ------
    InputError
        If there are not two continuous fields with two values each.
    """
    scenario = as_scenario(scenario)
    if not isinstance(over, Mapping) or len(over) != 2:
        found = f"{len(over)} fields" if isinstance(over, Mapping) else value_text(over)
        raise InputError("", "over", found, "two fields, each with lowest and highest value")
    losses, resolution = as_count(losses, "losses"), as_count(resolution, "resolution", 2)
    held = core_count() if threads is None else as_count(threads, "threads")
    ends = study_of(scenario, over, [first_loss()], zipped=True, method=method, question=BORDER).axes
    for axis in ends:
        if len(axis.values) != 2 or not axis.values[0] < axis.values[1]:
            raise InputError("", axis.path, f"{len(axis.values)} values", "lowest and highest value")
    plane = _Plane(scenario, (ends[0].path, ends[1].path), losses, method, held, needs_over(scenario, ends))
    x, y = (np.linspace(axis.values[0], axis.values[1], resolution + 1) for axis in ends)
    with progress_shown(progress):
        return plane.curves_dataset(plane.border_curves(x, y))


class _Plane:
    """Two fields of a scenario, and the margin over them."""

    def __init__(
        self, scenario: Scenario, paths: tuple[str, str], losses: int, method: str, threads: int,
        needs: frozenset[Need] | None = None,
    ) -> None:  # fmt: skip
        self.scenario, self.paths = scenario, paths
        self.losses, self.method, self.threads = losses, method, threads
        self.cells = cells_of(run.choose(BORDER, scenario.needs if needs is None else needs))

    def margin(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the margin in m at each pair of values."""
        changed = {self.paths[0]: x.ravel(), self.paths[1]: y.ravel()}
        found = self.cells(self.scenario, changed, self.method).margins(self.losses, self.threads)
        broken = int(np.isnan(found).sum())
        if broken:
            warn_caller(f"{broken} of {len(found)} runs broke off: near them the border is missing")
        return found.reshape(x.shape)

    def border_curves(self, x: FloatArray, y: FloatArray) -> list[FloatArray]:
        """Return the curves as arrays (points, 2): those of the grid, each point moved to the root on its line."""
        import contourpy

        values = self.margin(*np.meshgrid(x, y))
        held = np.where(np.isfinite(values), values, 1.0)
        generator = contourpy.contour_generator(x, y, held, line_type=contourpy.LineType.Separate)
        rough: Any = generator.lines(0.0)
        if not rough:
            return []
        exact = self._roots_on_lines(np.vstack(rough), x, y)
        lines = np.split(exact, np.cumsum([len(line) for line in rough])[:-1])
        known = [line[np.isfinite(line).all(axis=1)] for line in lines]  # not where margins of rounding have no sign
        return [line for line in known if len(line)]

    def _roots_on_lines(self, points: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the root on the segment of a grid line on which each point lies."""
        from scipy.optimize import elementwise

        near = np.abs(points[:, :1] - x).argmin(axis=1)
        along_y = np.abs(points[:, 0] - x[near]) <= 1e-12 * np.abs(x).max()
        low, high = points.copy(), points.copy()
        for column, line, chosen in ((1, y, along_y), (0, x, ~along_y)):
            place = np.clip(np.searchsorted(line, points[chosen, column], side="right") - 1, 0, len(line) - 2)
            low[chosen, column], high[chosen, column] = line[place], line[place + 1]
            other = 1 - column
            grid = x if other == 0 else y
            nearest = np.abs(points[chosen, other][:, None] - grid).argmin(axis=1)
            low[chosen, other] = high[chosen, other] = grid[nearest]

        def points_at(t: FloatArray, x0: FloatArray, y0: FloatArray, x1: FloatArray, y1: FloatArray) -> FloatArray:
            return self.margin(x0 + t * (x1 - x0), y0 + t * (y1 - y0))

        segments = (low[:, 0], low[:, 1], high[:, 0], high[:, 1])
        found = elementwise.find_root(
            points_at, (np.zeros(len(points)), np.ones(len(points))), args=segments,
            tolerances={"xatol": 1e-9, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0},
        )  # fmt: skip
        return np.asarray(low + np.asarray(found.x)[:, None] * (high - low))

    def curves_dataset(self, curves: list[FloatArray]) -> xr.Dataset:
        """Return curves as a dataset."""
        import xarray as xr

        points = np.vstack(curves) if curves else np.empty((0, 2))
        line = np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])
        data: dict[str, Any] = {
            path: ("point", points[:, i], {"units": unit_of(self.scenario, path)}) for i, path in enumerate(self.paths)
        }
        data["line"] = ("point", line, {"long_name": "number of the curve"})
        left = self.margin(points[:, 0], points[:, 1]) if len(points) else np.empty(0)
        data["margin"] = ("point", left, {"units": "m", "long_name": "what is left of the margin"})
        return xr.Dataset(data, attrs={"title": "wheeltapper border", "losses": self.losses})
