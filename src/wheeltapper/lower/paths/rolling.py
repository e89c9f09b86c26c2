"""Circle rolling: the path of the centre of a wheel of radius R over a profile (the paper, equation 2.2).

    y_k(x0) = max over s of  p(s) + sqrt(R² - u²) - R,   u = s - x0

The profile is smooth between borders. The wheel touches either inside a smooth cell, where p'(s) = u/sqrt(R² - u²), or
at a convex corner. While the point of contact moves continuously, the path is smooth. Where it jumps to another place,
the wheel touches at two points, and the path has a kink.

    1. Find branches of continuous contact, and the highest one over each part of the path (branches.py).

2. Between two runs there is either a smooth change, whose place is known, or a kink, which is a root.

3. Fit the runs by pieces whose slope is that of the contact (the envelope theorem).
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course, Harmonic, Polynomials
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, first_places
from wheeltapper.lower.paths.branches import BranchRun, Envelope
from wheeltapper.lower.paths.fit import Factor, SampledFunction, fit
from wheeltapper.lower.paths.point import course_cells, sum_function, without_wave_period
from wheeltapper.lower.paths.surface import RolledProfile, value_at
from wheeltapper.lower.paths.table import PathTable, assemble, blank_rows, polynomial_rows, set_factor
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


ROUNDING = 1e-15
"""Length of a run over its position below which it is rounding. Where a wheel spans a hollow between two corners, it
touches the bottom in one point only, which is no run."""


def _branch_crossings(
    envelope: Envelope, pairs: list[tuple[int, int]], left: FloatArray, right: FloatArray
) -> FloatArray:
    """Return the place at which the first branch of each pair ceases to be the higher one: Newton's method, bracketed.

    The brackets come from samples of rough height, within the range that both branches cover. If they contain no change
    of sign, the whole common range on that side is searched.
    """
    first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T

    def height_difference(x: FloatArray, which: IntArray) -> tuple[FloatArray, FloatArray]:
        a, b = first[which], second[which]
        sa, sb = envelope.contact_points(x, a), envelope.contact_points(x, b)
        lean = envelope.profile.circle_slope
        return envelope.centre_height(x, sa, a) - envelope.centre_height(x, sb, b), lean(sa - x) - lean(sb - x)

    everyone = np.arange(len(first))
    reach = np.array([(b.x[0], b.x[-1]) for b in envelope.branches])
    start, end = np.maximum(reach[first, 0], reach[second, 0]), np.minimum(reach[first, 1], reach[second, 1])
    left, right = np.clip(left, start, end), np.clip(right, start, end)
    early, late = height_difference(left, everyone)[0] <= 0.0, height_difference(right, everyone)[0] >= 0.0
    left, right = (
        np.where(early, start, np.where(late, right, left)),
        np.where(late, end, np.where(early, left, right)),
    )
    x = 0.5 * (left + right)
    early, late = height_difference(left, everyone)[0] <= 0.0, height_difference(right, everyone)[0] >= 0.0
    x[late], x[early] = right[late], left[early]
    active, has_left = np.flatnonzero(~early & ~late), np.zeros(len(x), dtype=bool)
    while len(active):
        here = x[active]
        height, slope = height_difference(here, active)
        left[active] = np.where(height > 0.0, here, left[active])
        right[active] = np.where(height > 0.0, right[active], here)
        new = here - height / np.where(slope == 0.0, -1.0, slope)
        settled = np.abs(new - here) <= 4e-15 * np.abs(here)
        outside = ~((new > left[active]) & (new < right[active])) & ~settled
        nearest, middle = np.clip(new, left[active], right[active]), 0.5 * (left[active] + right[active])
        tried = has_left[active] | (nearest == here)  # otherwise a root at an end is approached from there
        new[outside] = np.where(tried, middle, nearest)[outside]
        has_left[active] |= outside
        settled |= outside & (new == here)
        x[active] = np.where(settled, here, new)
        active = active[~settled]
    return x


def _soft_change(envelope: Envelope, a: BranchRun, b: BranchRun) -> tuple[float, float] | None:
    """Return the range in which the wheel rolls about the border of two runs; None if the contact jumps there."""
    profile = envelope.profile
    before, after = envelope.branches[a.branch], envelope.branches[b.branch]
    if before.corner < 0 and after.corner < 0:
        border = before.cell if after.cell == before.cell + 1 else -1
    elif before.corner < 0:
        border = after.corner if after.corner == before.cell else -1
    else:
        border = before.corner if after.corner < 0 and after.cell == before.corner + 1 else -1
    if border < 0:
        return None
    corner = profile.corners[border]
    left, right = (corner.position - profile.touch_offset(slope) for slope in (corner.before, corner.after))
    if after.corner >= 0:
        right = left
    elif before.corner >= 0:
        left = right
    elif corner.after - corner.before > 1e-12:  # a concave corner: the wheel touches both sides at once
        return None
    elif not corner.juts_out:
        right = left
    room = 1e-12 * (1.0 + abs(corner.position))
    return (left, right) if a.last - room <= left <= right <= b.first + room else None


def _join_runs(envelope: Envelope) -> list[float]:
    """Set the ends of all runs; return the places of two-point contact. Arcs too short for the samples are inserted."""
    arcs = {b.corner: i for i, b in enumerate(envelope.branches) if b.corner >= 0}
    runs = [envelope.runs[0]]
    leaps: list[int] = []
    for b in envelope.runs[1:]:
        a = runs[-1]
        change = _soft_change(envelope, a, b)
        if change is None:
            leaps.append(len(runs))
        else:
            a.end, b.start = change
            if b.start > a.end:
                arc = arcs[envelope.branches[a.branch].cell]
                runs.append(BranchRun(arc, a.end, b.start, a.end, b.start))
        runs.append(b)
    if leaps:
        sides = [(runs[i - 1], runs[i]) for i in leaps]
        left, right = np.array([(a.last, b.first) for a, b in sides]).T
        kinks = _branch_crossings(envelope, [(a.branch, b.branch) for a, b in sides], left, right)
        for (a, b), x in zip(sides, kinks.tolist(), strict=True):
            a.end = b.start = x
    for dot, after in zip(runs[1:-1], runs[2:], strict=True):
        if dot.end - dot.start <= ROUNDING * abs(dot.end):
            dot.end = after.start = dot.start
    envelope.runs = runs
    return [runs[i].start for i in leaps]


def _knot_images(envelope: Envelope, run: BranchRun, start: float, end: float) -> FloatArray:
    """Return the wheel's places at which the contact passes a knot of a piecewise profile."""
    branch, profile = envelope.branches[run.branch], envelope.profile
    if branch.corner >= 0 or not len(profile.cells[branch.cell].knots):
        return np.empty(0)
    cell = profile.cells[branch.cell]
    first, last = np.searchsorted(cell.knots, [branch.s[0], branch.s[-1]], side="right")
    knots = cell.knots[first:last]
    slope = cell.slope(knots)
    x = knots - profile.radius * slope / np.sqrt(1.0 + slope**2)
    x = x[(x > start) & (x < end)]
    return x[np.diff(x, prepend=-inf) > 0.0]


def _run_pieces(
    envelope: Envelope, cuts: FloatArray, tolerance: float, height: float, factor: Factor | None
) -> FloatArray:
    """Return the pieces of all runs between the first and the last cut; no piece crosses a cut."""
    level: list[FloatArray] = []
    intervals: dict[bool, list[tuple[FloatArray, int]]] = {True: [], False: []}  # in a cell, about a corner
    for run in envelope.runs:
        branch = envelope.branches[run.branch]
        start, end = max(run.start, cuts[0]), min(run.end, cuts[-1])
        if end <= start:
            continue
        edges = np.concatenate([[start], cuts[(cuts > start) & (cuts < end)], [end]])
        if branch.corner < 0 and envelope.profile.cells[branch.cell].flat:
            row = blank_rows(len(edges) - 1)
            row[:, contract.START], row[:, contract.STOP] = edges[:-1], edges[1:]
            row[:, contract.CENTRE] = edges[:-1]
            row[:, contract.COEFFICIENT] = value_at(envelope.profile.cells[branch.cell].value, 0.5 * (start + end))
            level.append(row)
            continue
        edges = np.union1d(edges, _knot_images(envelope, run, start, end))
        intervals[branch.corner < 0].append((edges, run.branch))

    def sample(x: FloatArray, owner: IntArray, bent: bool) -> list[SampledFunction]:
        s = envelope.contact_points(x, owner)
        path = [SampledFunction(envelope.centre_height(x, s, owner), envelope.profile.circle_slope(s - x))]
        if factor is None or not bent:
            return path
        return [*path, factor.sampled_factor(envelope.profile.property_at(s, envelope.cells[owner], "curvature"))]

    out = level
    for in_cell, listed in intervals.items():
        if not listed:
            continue
        bent = in_cell and factor is not None
        ends = np.vstack([np.column_stack([edges[:-1], edges[1:]]) for edges, _ in listed])
        owner = np.concatenate([np.full(len(edges) - 1, branch) for edges, branch in listed])
        tolerances = [tolerance * height, tolerance] if bent else [tolerance * height]
        left, right, fitted = fit(lambda x, o, bent=bent: sample(x, o, bent), ends, owner, tolerances)  # type: ignore[misc]
        rows = polynomial_rows(left, right, fitted[0], 1e-18 * height)
        if bent:
            set_factor(rows, fitted[1])
        out.append(rows)
    rows = np.vstack(out)
    return rows[np.argsort(rows[:, contract.START], kind="stable")]


class RolledPath:
    """A circle that has rolled over courses up to x = `end`.

    Attributes
    ----------
    all, courses
        All courses, and those over which the circle rolls. The others, `followed` ones, are in `raised`: cells with the
        stretches that are added.
    stop, loop
        End of the known path, and the place from which on it repeats (None if it does not).
    envelope, kinks
        The path, and the places of contact at two points.
    """

    def __init__(self, courses: list[Course], end: float, radius: float, height: float) -> None:
        self.all = courses
        rolled = [course for course in courses if not course.followed]
        window = _touch_range(rolled, end, radius)
        self.stop, self.loop = _known_end_and_loop(courses, end, window)
        self.courses = rolled if self.loop is not None else [without_wave_period(course) for course in rolled]
        profile = RolledProfile(self.courses, -2 * window, self.stop + 2 * window, radius, height)
        self.envelope = Envelope(profile, window)
        self.kinks = _join_runs(self.envelope)
        direct = [course for course in courses if course.followed]
        self.raised = course_cells(direct, 0.0, self.stop) if direct else []


def circle_table(
    courses: list[Course], end: float, height: float, tolerance: float, radius: float, factor: Factor | None = None
) -> tuple[PathTable, list[Note]]:
    """Return the path of the centre of a rolling circle from x = 0 to x = end, and notes on two-point contact.

    Parameters
    ----------
    courses
        Irregularities of rail and wheel, all over the rolled distance; `followed` ones are added to the path.
    end
        Position at the end of the run, m.
    height, tolerance
        The error of the fit is at most tolerance·height.
    radius
        Radius of the wheel, m.
    factor
        The factor on the contact force; None for one.
    """
    if height == 0.0 or all(course.followed for course in courses):
        from wheeltapper.lower.paths.point import point_table

        return point_table(courses, end, height, tolerance, factor), []
    rolled = RolledPath(courses, end, radius, height)
    envelope, stop, loop = rolled.envelope, rolled.stop, rolled.loop
    cuts = np.unique([0.0, *([loop] if loop is not None else []), *(a for a, _, _ in rolled.raised), stop])
    rows = _run_pieces(envelope, cuts, tolerance, height, factor)
    for a, b, present in rolled.raised:
        inside = (rows[:, contract.START] >= a) & (rows[:, contract.START] < b)
        rows[inside, contract.COEFFICIENT] += value_at(sum_function(present, "value"), 0.5 * (a + b))
    notes = _two_point_notes(envelope, [k for k in rolled.kinks if 0.0 <= k <= stop], factor is not None, stop)
    if loop is None:
        rows[-1, contract.STOP] = inf if rows[-1, contract.DEGREE] == 0 else stop * (1 + 1e-9) + 1e-9
        return replace(assemble(rows, height), origin=rolled), notes
    index = int(np.flatnonzero(rows[:, contract.START] == loop)[0])
    return replace(assemble(rows, height, index), origin=rolled), notes


def _height_range(course: Course, start: float, end: float) -> float:
    """Return the range of the heights of a course between two places, slightly overestimated."""
    values = []
    for stretch in course.stretches:
        a, b = max(stretch.start, start), min(stretch.end, end)
        form = stretch.exact
        if b <= a:
            continue
        if isinstance(form, Harmonic):
            size = float(np.hypot(form.sine, form.cosine))
            values += [form.offset - size, form.offset + size]
            continue
        x = np.linspace(a, b, 257 if np.isfinite(stretch.end - stretch.start) else 20_001)
        if isinstance(form, Polynomials):
            x = np.union1d(x, form.breaks[(form.breaks > a) & (form.breaks < b)])
        found = stretch.value(x)
        values += [float(found.min()), float(found.max())]
    return max(values) - min(values)


def _touch_range(courses: list[Course], end: float, radius: float) -> float:
    """Return how far ahead the wheel can touch: half the chord at the depth of the profile's range of heights."""
    depth = 0.0
    for course in courses:
        first, last = -radius, end + radius
        if course.period is not None:
            origin = course.repeats_from if np.isfinite(course.repeats_from) else 0.0
            first, last = min(origin, 0.0), max(origin, 0.0) + course.period
        depth += 1.05 * _height_range(course, first, last)
        depth += 1e-3 * course.height
    if depth >= 0.5 * radius:
        raise InputError(
            "", "irregularity", f"heights that differ by {depth:.3g} m", f"less than half the wheel's radius {radius} m"
        )
    return sqrt(2 * radius * depth - depth**2)


def _known_end_and_loop(courses: list[Course], end: float, window: float) -> tuple[float, float | None]:
    """Return the necessary end of the path, and the place from which on it repeats (None if it does not)."""
    if len(courses) != 1 or courses[0].period is None:
        return end, None
    period = courses[0].period
    origin = max(courses[0].repeats_from + window, 0.0)
    if origin + period >= end:
        return end, None
    return origin + period, origin


def _two_point_notes(envelope: Envelope, kinks: list[float], varies: bool, stop: float) -> list[Note]:
    notes: list[Note] = []
    if kinks:
        where = f"at x = {first_places(kinks)} m ({len(kinks)} in {stop:.6g} m)"
        text = f"the wheel touches at two points at once {where}: its centre's path has kinks there"
        notes.append(Note(text, "two points", len(kinks)))
    corners = {envelope.branches[r.branch].corner for r in envelope.runs if r.end > 0 and r.start < stop} - {-1}
    edges = sorted(envelope.profile.corners[corner].position for corner in corners)
    if edges and varies:
        text = (
            f"where the wheel rests on an edge (x = {first_places(edges)} m), the contact constant is that of the "
            "smooth surface: forces there are approximate"
        )
        notes.append(Note(text, "edges", len(edges)))
    return notes
