"""Branches of contact: on each of them the point of contact moves continuously with the wheel.

A circle that touches the profile at s has its centre above x0 = s - R·p'/sqrt(1 + p'²). Where x0 rises with s, the
height of the circle is a local maximum. Where it falls, the height is a minimum, and s is never the point of contact. A
convex corner is a further branch: an arc. The path is the upper envelope of all branches.

    sample x0(s) in every smooth cell, cut it at its folds       -> branches
    where several branches lie above each other, sample their heights and keep the highest     -> runs
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.lower.paths.surface import RolledProfile
from wheeltapper.march.wagon import contact_points

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FINEST = 2.5e-4
"""Largest spacing of the samples of a profile whose smoothness is unknown, m."""
MOST_SAMPLES = 8_000_000
"""Largest number of samples of a profile; the spacing grows if more were needed."""
HALVINGS = 26
"""Number of bisections that find a fold, where the place of the wheel as a function of the point of contact has an
extremum. There the place hardly changes with the point of contact, so that half the digits suffice."""
MARGIN = 1.2
"""Ratio of the length up to which an arc about a corner is followed to that of the window."""
TRIED = np.array([0.0, 0.2317, 0.5161, 0.8079, 1.0])
"""Where an interval of samples is tried, as parts of it: unlike waves, these have no common length."""
UNRESOLVED = 0.01
"""Samples h apart are too few where heights are off a cubic by more than this part of h²/R, or of that and the bow."""
NARROWEST = 1e-7
"""Width in m of samples beyond which none are added: beside a kink no width is enough."""
MOST_ADDED = 300_000
MOST_PAIRS = 20_000_000
"""Heights of branches above each other that are compared: more take minutes."""
SMOOTHER = 'longer waves, a shorter run, or rolling = "point"'


@dataclass(frozen=True)
class Branch:
    """Samples of the wheel's place x and of the point of contact s, both rising; on an arc s is the corner."""

    cell: int  # -1 for a corner
    corner: int  # -1 for a cell
    x: FloatArray
    s: FloatArray


@dataclass
class BranchRun:
    """A part of the path that lies on one branch."""

    branch: int
    first: float  # the first and the last sample at which this branch is the highest
    last: float
    start: float = -np.inf
    end: float = np.inf


def _sample_spacing(profile: RolledProfile, window: float, length: float) -> float:
    wanted = min(FINEST, max(window, 1e-6) / 25, length / 16)
    return max(wanted, min(1e-5, length / 16), (profile.end - profile.start) / MOST_SAMPLES)


def _cell_samples(profile: RolledProfile, index: int, window: float) -> FloatArray:
    cell = profile.cells[index]
    start, end = max(cell.start, profile.start), min(cell.end, profile.end)
    if cell.flat:
        return np.array([start, end])
    if len(cell.knots):
        knots = np.concatenate([[start], cell.knots[(cell.knots > start) & (cell.knots < end)], [end]])
        return np.append((knots[:-1, None] + np.diff(knots)[:, None] * np.arange(4) / 4).ravel(), end)
    return np.linspace(start, end, int(np.ceil((end - start) / _sample_spacing(profile, window, end - start))) + 1)


def _with_folds(profile: RolledProfile, s: FloatArray, cell: IntArray) -> tuple[FloatArray, IntArray, list[slice]]:
    """Return samples and their cells with the folds of x0(s) put in, and the parts of them in which x0 rises."""
    rises, inside = profile.is_outer(s, cell), cell[1:] == cell[:-1]
    turns = np.flatnonzero((rises[1:] != rises[:-1]) & inside)
    if len(turns):
        here = cell[turns]
        up, down = np.where(rises[turns], s[[turns, turns + 1]], s[[turns + 1, turns]])
        for _ in range(HALVINGS):
            middle = 0.5 * (up + down)
            outer = profile.is_outer(middle, here)
            up, down = np.where(outer, middle, up), np.where(outer, down, middle)
        s, cell = np.insert(s, turns + 1, up), np.insert(cell, turns + 1, here)
        rises = np.insert(rises, turns + 1, True)
        inside = cell[1:] == cell[:-1]
    borders = [0, *(np.flatnonzero((rises[1:] != rises[:-1]) | ~inside) + 1).tolist(), len(s)]
    return s, cell, [slice(a, b) for a, b in zip(borders[:-1], borders[1:], strict=True) if rises[a]]


def _off_cubic() -> FloatArray:
    """Return weights of the values at TRIED: their sum is how far the middle one is off the cubic of the others."""
    others = np.delete(TRIED, 2)
    weights = [-np.prod([(TRIED[2] - b) / (a - b) for b in others if b != a]) for a in others]
    return np.insert(weights, 2, 1.0)


OFF_CUBIC = _off_cubic()


def _may_touch_within(ahead: FloatArray, beyond: FloatArray, window: float) -> NDArray[np.bool_]:
    """Return between which neighbours, by how far the contact is ahead of the wheel, it may be inside the window."""
    return (np.minimum(np.abs(ahead), np.abs(beyond)) <= MARGIN * window) | (ahead * beyond < 0.0)


def _refined_samples(
    profile: RolledProfile, s: FloatArray, cell: IntArray, window: float
) -> tuple[FloatArray, IntArray]:
    """Return samples with more of them where the profile varies faster than they tell.

    Where the wheel cannot touch it is enough to see its waves.

    Raises
    ------
    InputError
        If no affordable number of them is enough.
    """
    inside = cell[1:] == cell[:-1]
    left, right, owner = s[:-1][inside], s[1:][inside], cell[1:][inside]
    added, owners, count = [s], [cell], 0
    while len(left):
        at = left[:, None] + (right - left)[:, None] * TRIED
        heights = profile.property_at(at.ravel(), np.repeat(owner, len(TRIED)), "value").reshape(at.shape)
        off, sagitta = np.abs(heights @ OFF_CUBIC), (right - left) ** 2 / profile.radius
        coarse = np.flatnonzero((off > UNRESOLVED * sagitta) & (right - left > NARROWEST))
        bow = np.abs(heights - heights[:, :1] - np.diff(heights[:, [0, -1]]) * TRIED)[coarse].max(axis=1, initial=0.0)
        ahead, beyond = (end - profile.wheel_places(end, owner[coarse]) for end in (left[coarse], right[coarse]))
        coarse = coarse[(off[coarse] > UNRESOLVED * (sagitta[coarse] + bow)) | _may_touch_within(ahead, beyond, window)]
        edges = np.linspace(left[coarse], right[coarse], 5, axis=1)
        left, right, owner = edges[:, :-1].ravel(), edges[:, 1:].ravel(), np.repeat(owner[coarse], 4)
        added.append(edges[:, 1:-1].ravel())
        owners.append(np.repeat(owner[::4], 3))
        count += len(added[-1])
        if count > MOST_ADDED:
            found = (
                f"heights with kinks or crests within {right[0] - left[0]:.2g} m of each other at x = {left[0]:.6g} m"
            )
            raise InputError("", "irregularity", found, SMOOTHER)
    s, cell = np.concatenate(added), np.concatenate(owners)
    order = np.lexsort((s, cell))
    return s[order], cell[order]


def find_branches(profile: RolledProfile, window: float) -> list[Branch]:
    """Return all branches of a profile."""
    bent = [i for i, cell in enumerate(profile.cells) if cell.chord != profile.radius]  # else touched all at once
    each = [_cell_samples(profile, index, window) for index in bent]
    s, cell = _refined_samples(
        profile, np.concatenate(each), np.repeat(bent, [len(samples) for samples in each]), window
    )
    s, cell, rising = _with_folds(profile, s, cell)
    x = profile.wheel_places(s, cell)
    near = _may_touch_within((s - x)[:-1], (s - x)[1:], window)  # elsewhere the wheel would lie in the profile
    out = []
    for part in rising:
        reach = part.start + np.flatnonzero(near[part.start : part.stop - 1])
        if not len(reach):
            continue
        part = slice(reach[0], reach[-1] + 2)
        forward = part.start + np.flatnonzero(np.diff(x[part], prepend=-np.inf) > 0.0)
        if len(forward) > 1:
            out.append(Branch(int(cell[part.start]), -1, x[forward], s[forward]))
    for index, corner in enumerate(profile.corners):
        if corner.juts_out:
            reach = min(MARGIN * window, 0.999 * profile.radius)
            u = np.linspace(
                min(profile.touch_offset(corner.before), reach), max(profile.touch_offset(corner.after), -reach), 33
            )
            out.append(Branch(-1, index, corner.position - u, np.full(len(u), corner.position)))
    return out


class Envelope:
    """The upper envelope of the branches."""

    def __init__(self, profile: RolledProfile, window: float) -> None:
        self.profile = profile
        self.branches = find_branches(profile, window)
        self._x, self._s = (np.concatenate(part) for part in zip(*((b.x, b.s) for b in self.branches), strict=True))
        self._first = np.cumsum([0, *(len(b.x) for b in self.branches)])
        self.cells = np.array([b.cell for b in self.branches])
        self.corners = np.array([b.corner for b in self.branches])
        self._flat = np.array([b.corner < 0 and profile.cells[b.cell].flat for b in self.branches])
        self.runs = self._highest_runs(self._grid_places(window))

    def contact_points(self, x: FloatArray, owner: IntArray) -> FloatArray:
        """Return the contact for each place of the wheel on the given branch; beyond it, the branch's nearer end."""
        s, lo, hi = np.empty_like(x), np.empty_like(x), np.empty_like(x)
        contact_points.bracket_contacts(self._x, self._s, self._first, owner, x, s, lo, hi)
        bent = np.flatnonzero((self.corners[owner] < 0) & ~self._flat[owner])
        if len(bent):
            s[bent] = self.profile.sharpened_contact(x[bent], s[bent], lo[bent], hi[bent], self.cells[owner[bent]])
        return s

    def centre_height(self, x: FloatArray, s: FloatArray, owner: IntArray) -> FloatArray:
        """Return the height of the wheel's centre, less its radius, at x if it touches at s."""
        out = self.profile.circle_drop(s - x)
        corner = self.corners[owner]
        smooth = np.flatnonzero(corner < 0)
        out[smooth] += self.profile.property_at(s[smooth], self.cells[owner[smooth]], "value")
        about = np.flatnonzero(corner >= 0)
        if len(about):
            out[about] += np.array([c.height for c in self.profile.corners])[corner[about]]
        return out

    def _grid_places(self, window: float) -> FloatArray:
        """Return places that lie in every interval between ends of branches, densely where branches overlap."""
        starts = np.sort([b.x[0] for b in self.branches])
        ends = np.sort([b.x[-1] for b in self.branches])
        edges = np.unique(np.concatenate([starts, ends]))
        middle = 0.5 * (edges[:-1] + edges[1:])
        covered = np.searchsorted(starts, middle) - np.searchsorted(ends, middle)
        parts = [middle]
        for a, b in zip(edges[:-1][covered > 1], edges[1:][covered > 1], strict=True):
            count = int(np.ceil((b - a) / _sample_spacing(self.profile, window, b - a)))
            parts.append(a + (b - a) * (np.arange(count) + 0.5) / count)
        return np.unique(np.concatenate(parts))

    def _highest_runs(self, grid: FloatArray) -> list[BranchRun]:
        """Return the runs: the highest branch over each part of the path, as the grid shows it.

        Raises
        ------
        InputError
            If too many branches lie above each other.
        """
        ends = np.array([(b.x[0], b.x[-1]) for b in self.branches])
        spans = np.searchsorted(grid, ends)
        if np.diff(spans, axis=1).sum() > MOST_PAIRS:
            found = f"{len(self.branches)} crests and edges in {grid[-1] - grid[0]:.4g} m, too many near each other"
            raise InputError("", "irregularity", found, SMOOTHER)
        best = np.full(len(grid), -np.inf)
        winner = np.full(len(grid), -1)
        for index, (branch, (first, last)) in enumerate(zip(self.branches, spans.tolist(), strict=True)):
            if first == last:
                continue
            x = grid[first:last]
            height = self.centre_height(x, np.interp(x, branch.x, branch.s), np.full(len(x), index))
            higher = height > best[first:last]
            best[first:last][higher] = height[higher]
            winner[first:last][higher] = index
        touched = np.flatnonzero(winner >= 0)
        parts = np.split(touched, np.flatnonzero(np.diff(winner[touched])) + 1)
        return [BranchRun(int(winner[p[0]]), float(grid[p[0]]), float(grid[p[-1]])) for p in parts]
