"""Tables of pieces: assembly, joints and evaluation of the path that the kernels read."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]


def blank_rows(count: int) -> FloatArray:
    """Return rows for pieces with the height zero and the factor one on the contact force."""
    rows = np.zeros((count, contract.PIECE_COLUMNS))
    rows[:, contract.SCALE] = 1.0
    rows[:, contract.FACTOR_DEGREE] = -1.0
    return rows


def polynomial_rows(left: FloatArray, right: FloatArray, coefficients: FloatArray, negligible: float) -> FloatArray:
    """Return rows for polynomials in ξ = (x - middle)/half-width, without trailing coefficients below `negligible`."""
    rows = blank_rows(len(left))
    rows[:, contract.START] = left
    rows[:, contract.STOP] = right
    rows[:, contract.CENTRE] = 0.5 * (left + right)
    rows[:, contract.SCALE] = 0.5 * (right - left)
    width = coefficients.shape[1]
    rows[:, contract.COEFFICIENT : contract.COEFFICIENT + width] = coefficients
    rows[:, contract.DEGREE] = used_degree(coefficients, negligible)
    return rows


def used_degree(coefficients: FloatArray, negligible: float) -> FloatArray:
    """Return the highest power in each row whose coefficient is larger than `negligible`."""
    large = np.abs(coefficients) > negligible
    large[:, 0] = True
    return np.asarray(coefficients.shape[1] - 1 - np.argmax(large[:, ::-1], axis=1), dtype=float)


def set_factor(rows: FloatArray, coefficients: FloatArray) -> None:
    """Write the factor on the contact force, as polynomials in the ξ of each row."""
    rows[:, contract.FACTOR : contract.FACTOR + coefficients.shape[1]] = coefficients
    rows[:, contract.FACTOR_DEGREE] = used_degree(coefficients, 1e-17)


def _highest_powers(rows: FloatArray, x: FloatArray, first: int) -> FloatArray:
    xi = (x - rows[:, contract.CENTRE]) / rows[:, contract.SCALE]
    total = np.zeros_like(xi)
    for k in range(contract.MAX_DEGREE, -1, -1):
        total = total * xi + rows[:, first + k]
    return total


def row_values(rows: FloatArray, x: FloatArray) -> FloatArray:
    """Return the height, m, of each row's piece at the x of that row."""
    phase = rows[:, contract.WAVENUMBER] * (x - rows[:, contract.CENTRE])
    wave = rows[:, contract.SINE] * np.sin(phase) + rows[:, contract.COSINE] * np.cos(phase)
    return _highest_powers(rows, x, contract.COEFFICIENT) + wave


def row_slopes(rows: FloatArray, x: FloatArray) -> FloatArray:
    """Return the slope of each row's piece at the x of that row."""
    scale = rows[:, contract.SCALE]
    xi = (x - rows[:, contract.CENTRE]) / scale
    total = np.zeros_like(xi)
    for k in range(contract.MAX_DEGREE, 0, -1):
        total = total * xi + k * rows[:, contract.COEFFICIENT + k]
    wavenumber = rows[:, contract.WAVENUMBER]
    phase = wavenumber * (x - rows[:, contract.CENTRE])
    return total / scale + wavenumber * (
        rows[:, contract.SINE] * np.cos(phase) - rows[:, contract.COSINE] * np.sin(phase)
    )


def row_tangents(rows: FloatArray, bent: FloatArray, x: FloatArray, source: int) -> FloatArray:
    """Return the derivative of each row at the x of that row: of the height (`source` COEFFICIENT) or of the factor."""
    away = x - rows[:, contract.CENTRE]
    xi = away / rows[:, contract.SCALE]
    total = np.zeros_like(xi)
    for k in range(contract.MAX_DEGREE, -1, -1):
        total = total * xi + bent[:, source + k]
    if source != contract.COEFFICIENT:
        return total
    phase = rows[:, contract.WAVENUMBER] * away
    sine, cosine = np.sin(phase), np.cos(phase)
    across = rows[:, contract.SINE] * cosine - rows[:, contract.COSINE] * sine
    waves = bent[:, contract.SINE] * sine + bent[:, contract.COSINE] * cosine
    return np.asarray(total + waves + across * bent[:, contract.WAVENUMBER] * away)


def _row_joints(before: FloatArray, after: FloatArray, height: float, steepest: float) -> FloatArray:
    """Return the joint at which each row of `after` follows its row of `before`."""
    end, start = before[:, contract.STOP], after[:, contract.START]
    rounding = 1e-15 * np.where(np.isfinite(start), np.abs(start), 0.0) * steepest
    jump = np.abs(row_values(after, start) - row_values(before, end)) > 1e-12 * height + rounding
    kink = np.abs(row_slopes(after, start) - row_slopes(before, end)) > 1e-11 * steepest
    return np.where(jump, contract.JUMP, np.where(kink, contract.KINK, contract.SOFT)).astype(float)


@dataclass(frozen=True)
class PathTable:
    """Pieces in order, their joints, and the piece with which the table continues after its end.

    `origin` is the path to which the table was fitted, if it can still be evaluated.
    """

    rows: FloatArray
    loop: int
    loop_join: int
    origin: Any = field(default=None, repr=False, compare=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return PathTable, (self.rows, self.loop, self.loop_join)  # the origin may contain a user's functions

    @property
    def period(self) -> float:
        """Length of the repeated part, m; zero if there is none."""
        if self.loop >= len(self.rows):
            return 0.0
        return float(self.rows[-1, contract.STOP] - self.rows[self.loop, contract.START])

    def moved(self, by: float) -> PathTable:
        """Return the same path some way ahead, m."""
        rows = self.rows.copy()
        rows[:, [contract.START, contract.STOP, contract.CENTRE]] += by
        return PathTable(rows, self.loop, self.loop_join)

    def _located_rows(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        x = np.asarray(x, dtype=float)
        if self.period:
            first = self.rows[self.loop, contract.START]
            x = x - self.period * np.maximum(np.floor((x - first) / self.period), 0.0)
        index = np.clip(np.searchsorted(self.rows[:, contract.START], x, side="right") - 1, 0, len(self.rows) - 1)
        return self.rows[index], x

    def height_at(self, x: FloatArray) -> FloatArray:
        """Return the path's height in m at x."""
        rows, x = self._located_rows(np.ravel(x))
        return row_values(rows, x)

    def slope_at(self, x: FloatArray) -> FloatArray:
        """Return the path's slope at x; at a kink, the slope after it."""
        rows, x = self._located_rows(np.ravel(x))
        return row_slopes(rows, x)

    def factor_at(self, x: FloatArray) -> FloatArray:
        """Return the factor on the contact force at x."""
        rows, x = self._located_rows(np.ravel(x))
        return np.where(rows[:, contract.FACTOR_DEGREE] < 0, 1.0, _highest_powers(rows, x, contract.FACTOR))

    def tangent_at(self, bent: FloatArray, x: FloatArray, source: int) -> FloatArray:
        """Return the derivative at x of the height (source COEFFICIENT) or of the factor, from those of the rows."""
        index = np.clip(np.searchsorted(self.rows[:, contract.START], x, side="right") - 1, 0, len(self.rows) - 1)
        return row_tangents(self.rows[index], bent[index], x, source)

    def going_on(self) -> PathTable:
        """Return a table that goes straight on where this one ends: a march by whole steps comes a little farther."""
        if self.loop < len(self.rows) or np.isinf(self.rows[-1, contract.STOP]):
            return self
        last, more = self.rows[-1:], blank_rows(1)
        end = last[:, contract.STOP]
        more[:, contract.START], more[:, contract.STOP], more[:, contract.CENTRE] = end, np.inf, end
        more[:, contract.DEGREE] = 1.0
        more[:, contract.COEFFICIENT], more[:, contract.COEFFICIENT + 1] = row_values(last, end), row_slopes(last, end)
        if last[0, contract.FACTOR_DEGREE] >= 0.0:
            set_factor(more, _highest_powers(last, end, contract.FACTOR)[:, None])
        return PathTable(np.vstack([self.rows, more]), len(self.rows) + 1, self.loop_join, self.origin)

    def kink_positions(self) -> FloatArray:
        """Return the positions in m of the kinks and jumps of the first round."""
        hard = self.rows[:, contract.JOIN] != contract.SOFT
        return np.asarray(self.rows[hard, contract.START])


def assemble(rows: FloatArray, height: float, loop: int | None = None) -> PathTable:
    """Return the table of these pieces; their joints follow from values and slopes at the borders."""
    rows = rows.copy()
    ends = np.where(np.isinf(rows[:, contract.STOP]), rows[:, contract.START], rows[:, contract.STOP])
    steepest = max(
        float(np.abs(row_slopes(rows, rows[:, contract.START])).max(initial=0.0)),
        float(np.abs(row_slopes(rows, ends)).max(initial=0.0)),
        float(np.abs(rows[:, contract.WAVENUMBER] * np.hypot(rows[:, contract.SINE], rows[:, contract.COSINE])).max()),
        1e-300,
    )
    height = max(height, 1e-300)
    rows[1:, contract.JOIN] = _row_joints(rows[:-1], rows[1:], height, steepest)
    if loop is None:
        return PathTable(rows, len(rows), contract.SOFT)
    return PathTable(rows, loop, int(_row_joints(rows[-1:], rows[loop : loop + 1], height, steepest)[0]))
