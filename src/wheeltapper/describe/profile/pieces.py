"""Profiles of lines, arcs and splines: heights at lateral positions."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Line(NamedTuple):
    """A straight piece through two points, mm."""

    begin: tuple[float, float]
    end: tuple[float, float]

    @property
    def ends(self) -> tuple[float, float]:
        """Lateral positions of its ends, mm."""
        return self.begin[0], self.end[0]

    def height(self, y: FloatArray) -> FloatArray:
        """Return the height, mm."""
        (y0, z0), (y1, z1) = self
        return np.asarray(z0 + (z1 - z0) / (y1 - y0) * (y - y0))


class Arc(NamedTuple):
    """A piece of a circle between two lateral positions, mm: above its centre (`side` 1), or below it (-1)."""

    ends: tuple[float, float]
    radius: float
    centre: tuple[float, float]
    side: float

    def height(self, y: FloatArray) -> FloatArray:
        """Return the height, mm."""
        across, middle = self.centre
        return np.asarray(middle + self.side * np.sqrt(np.maximum(self.radius**2 - (y - across) ** 2, 0.0)))


class Curve(NamedTuple):
    """A cubic spline through points, mm, whose slopes at both ends are given."""

    points: tuple[tuple[float, float], ...]
    slopes: tuple[float, float]

    @property
    def ends(self) -> tuple[float, float]:
        """Lateral positions of its ends, mm."""
        return self.points[0][0], self.points[-1][0]

    def height(self, y: FloatArray) -> FloatArray:
        """Return the height, mm."""
        x, z = np.array(self.points).T
        steps, rises = np.diff(x), np.diff(z) / np.diff(x)
        system = np.diag(np.append(0.0, np.append(2.0 * (steps[:-1] + steps[1:]), 0.0)))
        system += np.diag(np.append(steps[1:], 0.0), -1) + np.diag(np.append(0.0, steps[:-1]), 1)
        system[[0, -1]] = np.eye(len(x))[[0, -1]]
        within = 3.0 * (rises[:-1] * steps[1:] + rises[1:] * steps[:-1])
        slopes = np.linalg.solve(system, np.concatenate([self.slopes[:1], within, self.slopes[1:]]))
        k = np.clip(np.searchsorted(x, y, side="right") - 1, 0, len(x) - 2)
        t = (y - x[k]) / steps[k]
        bent = (slopes[k] - rises[k]) * (1.0 - t) - (slopes[k + 1] - rises[k]) * t
        return np.asarray(z[k] + rises[k] * (y - x[k]) + steps[k] * t * (1.0 - t) * bent)


Piece = Line | Arc | Curve


def height_of(pieces: Iterable[Piece], y: FloatArray) -> FloatArray:
    """Return heights in mm at lateral positions in mm; NaN where there is no piece."""
    y = np.asarray(y, dtype=float)
    z = np.full(y.shape, np.nan)
    for piece in pieces:
        begin, end = piece.ends
        here = (y >= begin) & (y <= end)
        z[here] = piece.height(y[here])
    return z


def rows_of(file: Path) -> list[list[str]]:
    """Return the rows of a table without its notes."""
    with file.open(encoding="utf-8", newline="") as opened:
        return [row for row in csv.reader(opened) if row and not row[0].startswith("#")]
