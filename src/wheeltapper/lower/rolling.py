"""Circle rolling: the path of the centre of a wheel of radius R over a profile (the paper, equation 2.2).

    y_k(x0) = max over s of  p(s) + sqrt(R² - u²) - R,   u = s - x0

The profile is smooth between borders. The wheel touches either inside a smooth cell, where p'(s) = u/sqrt(R² - u²), or
at a corner that juts out. While the point of contact moves on steadily the path is smooth; where it leaps to another
place, the wheel touches at two points and the path has a kink.

    1. dilate samples of the profile by the circle: for each x0 roughly where it is touched
    2. sharpen each contact by Newton's method, decide corner or smooth from the slopes on both sides
    3. runs of steady contact; between two runs, either a soft change (slope known) or a kink (a root)
    4. fit each run by pieces whose slope is that of the contact (the envelope theorem)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.fit import Function, fit
from wheeltapper.lower.point import cells, total
from wheeltapper.lower.surface import Profile, value_at
from wheeltapper.lower.table import Table, assemble, blank, polynomial_rows, set_factor
from wheeltapper.march import program as contract

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

FINEST = 2.5e-4
MOST_SAMPLES = 8_000_000


@dataclass
class Run:
    """A stretch of the path on which contact moves steadily: in one cell, or about one corner."""

    cell: int  # -1 for a corner
    corner: int  # -1 for a cell
    x: FloatArray
    s: FloatArray
    start: float = 0.0
    end: float = 0.0


def _resolution(profile: Profile, window: float) -> float:
    finest = min(FINEST, max(window, 1e-6) / 25)
    for cell in profile.cells:
        if not cell.flat and np.isfinite(cell.end - cell.start):
            finest = min(finest, (cell.end - cell.start) / 16)
    return max(finest, 1e-5, (profile.end - profile.start) / MOST_SAMPLES)


def _touched(profile: Profile, grid: FloatArray, heights: FloatArray, reach: int) -> IntArray:
    """Return for each sample as the wheel's place the sample that it touches."""
    n, step = len(grid), grid[1] - grid[0]
    best = heights.copy()
    at = np.arange(n)
    for j in range(1, reach + 1):
        drop = float(profile.drop(np.array(j * step)))
        for near, far in ((slice(0, n - j), slice(j, n)), (slice(j, n), slice(0, n - j))):
            candidate = heights[far] + drop
            higher = candidate > best[near]
            best[near][higher] = candidate[higher]
            at[near][higher] = np.arange(n)[far][higher]
    return at


def _locate(profile: Profile, x0: FloatArray, rough: FloatArray, step: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Return for each place of the wheel the cell (-1 for a corner), the corner (-1 for a cell) and the contact."""
    cell = np.searchsorted(profile.borders, rough, side="right")
    corner = np.full(len(x0), -1)
    if len(profile.borders):
        near = (
            np.clip(np.searchsorted(profile.borders, rough), 1, len(profile.borders) - 1)
            if len(profile.borders) > 1
            else np.zeros(len(rough), int)
        )
        if len(profile.borders) > 1:
            near = near - (np.abs(profile.borders[near - 1] - rough) <= np.abs(profile.borders[near] - rough))
        close = np.abs(profile.borders[near] - rough) <= 1.5 * step
        before = np.array([c.before for c in profile.corners])[near]
        after = np.array([c.after for c in profile.corners])[near]
        u = np.clip(profile.borders[near] - x0, -0.999 * profile.radius, 0.999 * profile.radius)
        lean = profile.lean(u)
        right, left = after > lean, before < lean
        cell = np.where(close & right & ~left, near + 1, np.where(close & left & ~right, near, cell))
        corner = np.where(close & ~left & ~right, near, -1)
    starts = np.array([c.start for c in profile.cells])
    ends = np.array([c.end for c in profile.cells])
    s = np.where(corner >= 0, profile.borders[corner] if len(profile.borders) else 0.0, rough)
    smooth = np.flatnonzero(corner < 0)
    if len(smooth):
        k = cell[smooth]
        lo = np.maximum(starts[k], rough[smooth] - 2 * step)
        hi = np.minimum(ends[k], rough[smooth] + 2 * step)
        s[smooth] = profile.sharpen(x0[smooth], rough[smooth], lo, np.maximum(hi, lo), k)
    return np.where(corner >= 0, -1, cell), corner, s


def _steady(profile: Profile, cell: IntArray, corner: IntArray, s: FloatArray) -> BoolArray:
    """Return for each pair of neighbours whether the contact moves from one to the other without a leap."""
    same = (cell[:-1] == cell[1:]) & (corner[:-1] == corner[1:])
    inside = np.flatnonzero(same & (corner[:-1] < 0))
    if len(inside):
        a, b = s[inside], s[inside + 1]
        hollow = np.zeros(len(inside), dtype=bool)
        far = b - a > 0
        for part in (0.1, 0.3, 0.5, 0.7, 0.9):
            bend = profile.each(a + part * (b - a), cell[inside], "curvature")
            hollow |= bend * profile.radius > 1.0
        same[inside] = ~(hollow & far)
    return np.asarray(same)


def _runs(profile: Profile, x0: FloatArray, rough: FloatArray, step: float) -> list[Run]:
    cell, corner, s = _locate(profile, x0, rough, step)
    cuts = np.flatnonzero(~_steady(profile, cell, corner, s)) + 1
    groups = np.split(np.arange(len(x0)), cuts)
    return [Run(int(cell[g[0]]), int(corner[g[0]]), x0[g], s[g]) for g in groups]


def _path(profile: Profile, run: Run, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return height, slope and contact of a run's own branch at x."""
    if run.corner >= 0:
        corner = profile.corners[run.corner]
        u = corner.position - x
        return corner.height + profile.drop(u), profile.lean(u), np.full_like(x, corner.position)
    cell = profile.cells[run.cell]
    if cell.flat:
        return cell.value(x), np.zeros_like(x), x
    guess = np.interp(x, run.x, run.s) + np.where(x < run.x[0], x - run.x[0], np.where(x > run.x[-1], x - run.x[-1], 0))
    k = np.full(len(x), run.cell)
    margin = 4 * (run.x[-1] - run.x[0] if len(run.x) < 3 else np.diff(run.s).max(initial=0.0)) + 1e-3
    lo = np.maximum(cell.start, guess - margin)
    hi = np.minimum(cell.end, guess + margin)
    s = profile.sharpen(x, guess, np.minimum(lo, hi), hi, k)
    u = s - x
    return cell.value(s) + profile.drop(u), profile.lean(u), s


def _meeting(profile: Profile, a: Run, b: Run) -> float:
    """Return where two branches are equally high: contact at two points. Newton's method, kept inside a bracket."""
    left, right = float(a.x[-1]), float(b.x[0])

    def above(x: float) -> tuple[float, float]:
        (ya, slope_a, _), (yb, slope_b, _) = (_path(profile, run, np.array([x])) for run in (a, b))
        return float(ya[0] - yb[0]), float(slope_a[0] - slope_b[0])

    if above(left)[0] <= 0.0:
        return left
    if above(right)[0] >= 0.0:
        return right
    x = 0.5 * (left + right)
    while True:
        height, slope = above(x)
        left, right = (x, right) if height > 0.0 else (left, x)
        new = x - height / slope if slope != 0.0 else left
        if abs(new - x) <= 4e-16 * abs(x):
            return x
        if not left < new < right:
            new = 0.5 * (left + right)
            if new in (left, right):
                return x
        x = new


def _joined(profile: Profile, runs: list[Run]) -> tuple[list[Run], list[float]]:
    """Return the runs with their ends, tiny arcs about corners put in, and the positions of two-point contact."""
    out = [runs[0]]
    kinks: list[float] = []
    for b in runs[1:]:
        a = out[-1]
        border = _shared_border(a, b)
        corner = profile.corners[border] if border >= 0 else None
        wall = corner is not None and (
            (b.corner >= 0 and corner.before == inf) or (a.corner >= 0 and corner.after == -inf)
        )
        if corner is None or wall:
            a.end = b.start = _meeting(profile, a, b)
            kinks.append(a.end)
        elif a.corner >= 0:  # from the corner on to the cell behind it
            a.end = b.start = corner.position - profile.offset(corner.after)
        elif b.corner >= 0:  # from the cell up to its corner
            a.end = b.start = corner.position - profile.offset(corner.before)
        elif corner.juts_out:  # an arc shorter than the sampling
            arc = Run(-1, border, np.empty(0), np.empty(0))
            a.end = arc.start = corner.position - profile.offset(corner.before)
            arc.end = b.start = corner.position - profile.offset(corner.after)
            out.append(arc)
        elif corner.after - corner.before > 1e-12:
            a.end = b.start = _meeting(profile, a, b)
            kinks.append(a.end)
        else:
            a.end = b.start = corner.position - profile.offset(corner.before)
        out.append(b)
    return out, kinks


def _shared_border(a: Run, b: Run) -> int:
    """Return the border that two neighbouring runs share with finite slope there, or -1 where contact leaps."""
    if a.corner < 0 and b.corner < 0:
        return a.cell if b.cell == a.cell + 1 else -1
    if a.corner < 0:
        return b.corner if b.corner == a.cell else -1
    if b.corner < 0:
        return a.corner if b.cell == a.corner + 1 else -1
    return -1


def _run_rows(
    profile: Profile, run: Run, start: float, end: float, tolerance: float, height: float, factor: Function | None
) -> FloatArray:
    """Return the pieces of one run on [start, end]."""
    if run.corner < 0 and profile.cells[run.cell].flat:
        row = blank(1)
        level = value_at(profile.cells[run.cell].value, 0.5 * (max(start, -1e6) + min(end, 1e6)))
        row[0, [contract.START, contract.STOP, contract.CENTRE, contract.COEFFICIENT]] = start, end, start, level
        return row

    def value(x: FloatArray) -> FloatArray:
        return _path(profile, run, x)[0]

    def slope(x: FloatArray) -> FloatArray:
        return _path(profile, run, x)[1]

    functions: list[tuple[Function, Function | None]] = [(value, slope)]
    tolerances = [tolerance * height]
    bent = factor is not None and run.corner < 0
    if factor is not None and bent:
        curvature = profile.cells[run.cell].curvature
        functions.append((lambda x: factor(curvature(_path(profile, run, x)[2])), None))
        tolerances.append(tolerance)
    breaks, fitted = fit(functions, start, end, tolerances, _knot_images(profile, run, start, end))
    rows = polynomial_rows(breaks, fitted[0], 1e-18 * height)
    if bent:
        set_factor(rows, fitted[1])
    return rows


def _knot_images(profile: Profile, run: Run, start: float, end: float) -> FloatArray:
    """Return the wheel's places at which the contact passes a knot of a piecewise profile."""
    if run.corner >= 0 or not len(profile.cells[run.cell].knots):
        return np.empty(0)
    cell = profile.cells[run.cell]
    slope = cell.slope(cell.knots)
    x = cell.knots - profile.radius * slope / np.sqrt(1 + slope**2)
    steady = cell.curvature(cell.knots) * profile.radius < 1.0
    x = x[steady]
    return np.unique(x[(x > start) & (x < end)])


def circle_table(
    courses: list[Course], end: float, height: float, tolerance: float, radius: float, factor: Function | None = None
) -> tuple[Table, list[str]]:
    """Return the path of the centre of a rolling circle from x = 0 to x = end, and notes on two-point contact.

    Parameters
    ----------
    courses
        Irregularities of rail and wheel, all over the rolled distance; `followed` ones are added to the path itself.
    end
        Position at the end of the run, m.
    height, tolerance
        The fit keeps within tolerance·height.
    radius
        Of the wheel, m.
    factor
        From the profile's curvature at the contact to the factor on the contact force; None for one.
    """
    rolled = [course for course in courses if not course.followed]
    direct = [course for course in courses if course.followed]
    if not rolled or height == 0.0:
        from wheeltapper.lower.point import point_table

        return point_table(courses, end, height, tolerance, factor), []
    window = _window(rolled, end, radius)
    stop, loop = _repetition(courses, end, window)
    profile = Profile(rolled, -2 * window, stop + 2 * window, radius, height)
    step = _resolution(profile, window)
    grid = np.arange(profile.start, profile.end + step, step)
    touched = _touched(profile, grid, _heights(profile, grid), int(np.ceil(window / step)) + 1)
    keep = (grid >= -window) & (grid <= stop + window)
    runs, kinks = _joined(profile, _runs(profile, grid[keep], grid[touched[keep]], step))
    runs[0].start, runs[-1].end = -inf, inf
    parts = []
    spans = [(0.0, stop)] if not loop else [(0.0, loop), (loop, stop)]
    for first, last in spans:
        for run in runs:
            a, b = max(run.start, first), min(run.end, last)
            if b > a:
                parts += _lifted(profile, run, a, b, tolerance, height, factor, direct)
    rows = np.vstack(parts)
    notes = _notes(profile, runs, [k for k in kinks if 0.0 <= k <= stop], factor is not None, stop)
    if loop is None:
        rows[-1, contract.STOP] = inf if rows[-1, contract.DEGREE] == 0 else stop * (1 + 1e-9) + 1e-9
        return assemble(rows, height), notes
    index = int(np.flatnonzero(rows[:, contract.START] == loop)[0])
    return assemble(rows, height, index), notes


def _lifted(
    profile: Profile, run: Run, start: float, end: float, tolerance: float, height: float,
    factor: Function | None, direct: list[Course],
) -> list[FloatArray]:  # fmt: skip
    """Return the pieces of a run, cut at and raised by the courses that the centre follows directly."""
    if not direct:
        return [_run_rows(profile, run, start, end, tolerance, height, factor)]
    parts = []
    for a, b, present in cells(direct, start, end):
        rows = _run_rows(profile, run, a, b, tolerance, height, factor)
        rows[:, contract.COEFFICIENT] += value_at(total(present, "value"), 0.5 * (a + b))
        parts.append(rows)
    return parts


def _window(courses: list[Course], end: float, radius: float) -> float:
    """Return how far ahead the wheel can touch: half the chord at the profile's whole range of heights."""
    lowest, highest = np.inf, -np.inf
    for course in [courses]:
        x = np.linspace(-0.1, min(end, 200.0) + 0.1, 200_001)
        p = sum((c.value(x) for c in course), np.zeros_like(x))
        lowest, highest = min(lowest, float(p.min())), max(highest, float(p.max()))
    depth = 1.05 * (highest - lowest) + 1e-3 * sum(c.height for c in courses)
    if depth >= 0.5 * radius:
        raise InputError(
            "", "irregularity", f"heights that differ by {depth:.3g} m", f"less than half the wheel's radius {radius} m"
        )
    return sqrt(2 * radius * depth - depth**2)


def _repetition(courses: list[Course], end: float, window: float) -> tuple[float, float | None]:
    """Return up to where the path must be found, and from where on it repeats (None if it does not)."""
    if len(courses) != 1 or courses[0].period is None:
        return end, None
    period = courses[0].period
    origin = max(courses[0].repeats_from + window, 0.0)
    if origin + period >= end:
        return end, None
    return origin + period, origin


def _heights(profile: Profile, grid: FloatArray) -> FloatArray:
    cell = np.searchsorted(profile.borders, grid, side="right")
    return profile.each(grid, cell, "value")


def _notes(profile: Profile, runs: list[Run], kinks: list[float], varies: bool, stop: float) -> list[str]:
    notes = []
    if kinks:
        first = ", ".join(f"{k:.6g}" for k in kinks[:3])
        more = f" and {len(kinks) - 3} more" if len(kinks) > 3 else ""
        notes.append(
            f"the wheel touches at two points at once at x = {first}{more} m"
            f" ({len(kinks)} in {stop:.6g} m): kinks of the path"
        )
    edges = [run for run in runs if run.corner >= 0 and run.end > 0 and run.start < stop]
    if edges and varies:
        where = ", ".join(f"{profile.corners[run.corner].position:.6g}" for run in edges[:3])
        notes.append(f"at {len(edges)} edges (x = {where} …m) the smooth surface's contact constant holds")
    return notes
