"""The course of a train that does not keep its speed: its way over time, by the pulses of all channels.

A wheel goes the length of a sensor while its pulse lasts, and all axles go the same way. The way is sought that fits
all pulses, as a smooth one: between pulses the speed changes by `CHANGES` per root of a second. Over the way instead of
the time, a train that brakes, stops and starts again is one that keeps its speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.wayside.channels import FloatArray

STEP, MOST = 0.05, 20_000
"""Time between two points of a course, s, and their largest number."""
BEYOND = 1.0
"""How long a course begins before the first pulse, and ends after the last one, s."""
CHANGES = 0.5
"""Standard deviation of the change of speed in a second, m/s."""
EDGE_ERROR = 0.02
"""Standard deviation of the place at which a pulse begins or ends, m; more than `FAR` times this counts less."""
FAR, ROUNDS = 2.0, 8
STILL = 1e-4
"""Standard deviation of the way of a train that would have to go back in a step, and is taken to stand, m."""


@dataclass(frozen=True, eq=False)
class Course:
    """The way of a train over time: both rise."""

    times: FloatArray
    ways: FloatArray

    def way(self, times: FloatArray | float) -> FloatArray:
        """Return the way at times, s, in m; beyond the ends with the speed there."""
        return _interpolated(np.asarray(times, dtype=float), self.times, self.ways)

    def time(self, ways: FloatArray | float) -> FloatArray:
        """Return when the train has gone these ways, m, in s."""
        return _interpolated(np.asarray(ways, dtype=float), self.ways, self.times)

    def speed(self, times: FloatArray | float) -> FloatArray:
        """Return the speed, m/s, over a step around times, s."""
        half = 0.5 * (self.times[1] - self.times[0])
        at = np.asarray(times, dtype=float)
        return np.asarray((self.way(at + half) - self.way(at - half)) / (2.0 * half))

    def shortened(self, begins: float, ends: float, way: float) -> Course:
        """Return the course with another way, m, from and until these times, s."""
        grid = np.union1d(self.times, [begins, ends])
        ways = self.way(grid)
        first, last = self.way(np.array([begins, ends]))
        inside = first + (ways - first) * way / (last - first)
        ways = np.where(grid <= begins, ways, np.where(grid >= ends, ways - (last - first - way), inside))
        return Course(grid, ways + 1e-9 * np.arange(len(grid)))


def _interpolated(at: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    out = np.interp(at, x, y)
    first, last = (y[1] - y[0]) / (x[1] - x[0]), (y[-1] - y[-2]) / (x[-1] - x[-2])
    out = np.where(at < x[0], y[0] + first * (at - x[0]), out)
    return np.asarray(np.where(at > x[-1], y[-1] + last * (at - x[-1]), out))


def by_lengths(begins: FloatArray, ends: FloatArray, lengths: FloatArray) -> Course:
    """Return the course by the lengths, m, of sensors, for each pulse that begins and ends at these times, s."""
    grid = _grid(begins, ends)
    rows = _reading(grid, ends) - _reading(grid, begins)
    return Course(grid, _solved(grid, rows, lengths, 0)[0])


def by_axles(
    begins: FloatArray, ends: FloatArray, first: FloatArray, last: FloatArray, axles: NDArray[np.int64]
) -> tuple[Course, FloatArray]:
    """Return the course, and how far each axle is behind its origin, m.

    Each pulse begins and ends at these times, s, with the axle of this number at the places `first` and `last`, m,
    along the way.
    """
    from scipy import sparse

    grid = _grid(begins, ends)
    count = int(axles.max()) + 1
    each = np.arange(len(axles))
    of_axle = sparse.csr_matrix((np.ones(len(axles)), (each, axles)), shape=(len(axles), count))
    rows = sparse.vstack([sparse.hstack([_reading(grid, at), -of_axle]) for at in (begins, ends)]).tocsr()
    ways, behind = _solved(grid, rows, np.concatenate([first, last]), count)
    return Course(grid, ways), behind


def _grid(begins: FloatArray, ends: FloatArray) -> FloatArray:
    first, last = float(begins.min()) - BEYOND, float(ends.max()) + BEYOND
    return np.linspace(first, last, int(np.clip((last - first) / STEP, 3, MOST)) + 1)


def _reading(grid: FloatArray, times: FloatArray) -> Any:
    """Return the sparse matrix that interpolates from the grid to times."""
    from scipy import sparse

    step = grid[1] - grid[0]
    before = np.clip(((times - grid[0]) / step).astype(int), 0, len(grid) - 2)
    share = (times - grid[before]) / step
    rows = np.arange(len(times))
    return sparse.csr_matrix(
        (np.concatenate([1.0 - share, share]), (np.tile(rows, 2), np.concatenate([before, before + 1]))),
        shape=(len(times), len(grid)),
    )


def _solved(grid: FloatArray, rows: Any, target: FloatArray, more: int) -> tuple[FloatArray, FloatArray]:
    """Return the ways at the grid, from 0, and so many unknowns more, by least squares; what is far off counts less."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    step, count = grid[1] - grid[0], len(grid)
    bends = sparse.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count)) / (step**1.5 * CHANGES)
    smooth = sparse.hstack([bends, sparse.csr_matrix((count - 2, more))]).tocsr()
    origin = sparse.csr_matrix(([1.0 / EDGE_ERROR**2], ([0], [0])), shape=(count + more, count + more))
    held = smooth.T @ smooth + origin
    weights = np.ones(len(target))
    steps = sparse.diags([-1.0, 1.0], [0, 1], shape=(count - 1, count + more)).tocsr()
    back = np.zeros(count - 1, dtype=bool)
    for _ in range(ROUNDS):
        scaled = sparse.diags(weights / EDGE_ERROR**2) @ rows
        still = steps[back] / STILL
        found = spsolve((held + still.T @ still + rows.T @ scaled).tocsc(), scaled.T @ target)
        back |= np.diff(found[:count]) < -STILL
        off = np.abs(rows @ found - target) / EDGE_ERROR
        weights = np.minimum(1.0, FAR / np.maximum(off, 1e-9))
    ways = np.maximum.accumulate(found[:count]) + 1e-9 * np.arange(count)
    return ways, found[count:]
