"""Derivatives of the pieces of a table with respect to a field of the scenario, on the same pieces.

At a fixed place of the wheel the derivative of the path is that of the profile at the point of contact (the envelope
theorem). Difference quotients are therefore taken of the heights of the irregularities only, at the nodes of each
piece, and never of a whole lowering. Kinks move so that both sides still meet.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.base import PLACES
from wheeltapper.describe.irregularity.course import Course
from wheeltapper.describe.paths import keys_of, with_value
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.first_order import WEIGHTS
from wheeltapper.lower.laws import ellipse
from wheeltapper.lower.laws.ellipse import FactorSlopes
from wheeltapper.lower.paths.fit import DEGREE, FROM_LOBATTO, LOBATTO
from wheeltapper.lower.paths.point import PlacedStretch, common_harmonics, course_cells, harmonic_row
from wheeltapper.lower.paths.rolling import RolledPath
from wheeltapper.lower.paths.surface import value_at
from wheeltapper.lower.paths.table import PathTable, row_slopes, row_tangents
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]
STEP, PLACE_STEP = 2e-4, 2e-5
"""Step of difference quotients with respect to a field of an irregularity, over the field; and of its place, m. What a
place moves has a length of its own, wherever that is."""
REACH = 3.0
"""Length of a path, m, from which on the step falls with it: the phase of its waves changes with their number."""


class Courses:
    """The courses of a scenario (`base`, if they exist already) and of neighbours that differ in one field.

    They are asked for places up to `end`, m.
    """

    def __init__(
        self, scenario: Scenario, path: str, end: float, base: list[Course] | None = None, ahead: float = 0.0
    ) -> None:
        self.path, held = path, float(Fields(scenario)(path))
        relative = STEP * REACH / max(end, REACH)
        self.step = PLACE_STEP if path.rpartition(".")[2] in PLACES else relative * (abs(held) or 1e-2)
        radius = float(scenario.vehicle.radius)
        self._near: dict[int, list[Course]] = {}
        for k in (-3, -2, -1, 1, 2, 3):
            value = held + k * self.step
            items = scenario.irregularities
            if path.startswith("irregularity."):
                items = with_value(items, keys_of(scenario, path)[1:], value)
            near = value if path == "vehicle.radius" else radius
            self._near[k] = [_moved(item.course(near), ahead) for item in items]
        self.base = base or [_moved(item.course(radius), ahead) for item in scenario.irregularities]
        self._place = {id(s): (i, j) for i, course in enumerate(self.base) for j, s in enumerate(course.stretches)}

    def stretch_away(self, placed: PlacedStretch, k: int) -> PlacedStretch:
        """Return a stretch of the scenario that is k steps away; its course may begin some periods earlier or later."""
        i, j = self._place[id(placed.stretch)]
        period, near = self.base[i].period, self._near[k][i]
        stretch, away = near.stretches[j], placed.shift
        if isfinite(stretch.start):
            away += placed.stretch.start - stretch.start
        shift = round(away / period) * (near.period or 0.0) if period else 0.0
        return PlacedStretch(stretch, shift, stretch.start + shift, stretch.end + shift)

    def central_difference(self, of: Callable[[int], Any]) -> Any:
        """Return the derivative of a function that is given at some steps."""
        return sum(weight * (of(k) - of(-k)) for k, weight in WEIGHTS.items()) / self.step

    def tangent_of_sum(self, present: list[PlacedStretch], which: str, x: FloatArray) -> FloatArray:
        """Return the derivative of the sum of some stretches, at fixed x."""

        def stretch_tangent(placed: PlacedStretch) -> FloatArray:
            return np.asarray(self.central_difference(lambda k: getattr(self.stretch_away(placed, k), which)(x)))

        return np.asarray(sum((stretch_tangent(p) for p in present if self._border_jumps(p)), np.zeros_like(x)))

    def _border_jumps(self, placed: PlacedStretch) -> bool:
        i, _ = self._place[id(placed.stretch)]
        return bool(self._near[1][i] != self.base[i])

    def border_tangent(self, present: list[PlacedStretch], x: float) -> float:
        """Return the derivative of the border at x, at which one of these stretches begins."""
        for p in present:
            if isfinite(p.stretch.start) and abs(p.stretch.start + p.shift - x) < 1e-9 * (1.0 + abs(x)):
                return self._start_tangent(p)
        return 0.0

    def _start_tangent(self, placed: PlacedStretch) -> float:
        return float(self.central_difference(lambda k: self.stretch_away(placed, k).start))

    def period_tangent(self) -> float:
        """Return the derivative of the period of the only repeating course."""
        i = next(i for i, course in enumerate(self.base) if course.period is not None)
        return float(self.central_difference(lambda k: self._near[k][i].period))


def _moved(course: Course, ahead: float) -> Course:
    return course.moved(ahead) if ahead else course


def _tangent_nodes(rows: FloatArray) -> FloatArray:
    """Return (rows, nodes): the places at which the tangent of each piece is computed."""
    start = rows[:, contract.START]
    stop = np.where(np.isfinite(rows[:, contract.STOP]), rows[:, contract.STOP], start + 1e-3)
    return 0.5 * (start + stop)[:, None] + 0.5 * (stop - start)[:, None] * LOBATTO


def _write_polynomials(rows: FloatArray, nodes: FloatArray, values: FloatArray, source: int, out: FloatArray) -> None:
    """Write polynomials through the nodes, in the variable of each row."""
    ends = nodes[:, [-1, 0]]
    middle, half = ends.mean(axis=1), 0.5 * (ends[:, 1] - ends[:, 0])
    coefficients = values @ FROM_LOBATTO.T
    level = rows[:, contract.DEGREE if source == contract.COEFFICIENT else contract.FACTOR_DEGREE] == 0
    out[level, source] = values[level].mean(axis=1)
    same = (
        ~level
        & (np.abs(middle - rows[:, contract.CENTRE]) <= 1e-12 * half)
        & (np.abs(half / rows[:, contract.SCALE] - 1.0) < 1e-12)
    )
    out[same, source : source + DEGREE + 1] = coefficients[same]
    for i in np.flatnonzero(~same & ~level):
        line = np.polynomial.Polynomial(coefficients[i], domain=[middle[i] - half[i], middle[i] + half[i]])
        own = [rows[i, contract.CENTRE] - rows[i, contract.SCALE], rows[i, contract.CENTRE] + rows[i, contract.SCALE]]
        out[i, source : source + DEGREE + 1] = line.convert(domain=own, window=[-1, 1]).coef[: DEGREE + 1]


def table_tangent(scenario: Scenario, path: str, table: PathTable, ahead: float = 0.0) -> FloatArray:
    """Return the derivatives of a table's pieces with respect to a field that shapes the path.

    Parameters
    ----------
    scenario
        The scenario of the table.
    path
        Path of the field.
    table
        Table of the path of the wheel.
    ahead
        How far the irregularities are moved forward in the table, m.
    """
    rolled = table.origin
    factor_slopes = ellipse.factor_slopes(scenario.contact, scenario.vehicle, path)
    rows = table.rows
    out = np.zeros_like(rows)
    nodes = _tangent_nodes(rows)
    changing = Courses(scenario, path, float(nodes.max()), rolled.all if rolled else None, ahead)
    if rolled is None:
        _bend_point(changing, rows, nodes, factor_slopes, out)
    else:
        _bend_circle(scenario, path, changing, rolled, rows, nodes, factor_slopes, out)
    _move_kinks(rows, out)
    if table.loop < len(rows):
        out[-1, contract.STOP] = out[table.loop, contract.START] + changing.period_tangent()
    return out


def _bend_point(
    changing: Courses, rows: FloatArray, nodes: FloatArray, factor_slopes: FactorSlopes | None, out: FloatArray
) -> None:
    middle = nodes[:, len(LOBATTO) // 2]
    last = float(nodes.max())
    for a, b, present in course_cells(changing.base, 0.0, last):
        mine = np.flatnonzero((middle >= a) & (middle < b))
        if not len(mine):
            continue
        if rows[mine[0], contract.JOIN] == contract.JUMP:
            out[mine[0], contract.START] = changing.border_tangent(present, a)
        exact = common_harmonics(present)
        if exact is not None and len(mine) == 1 and factor_slopes is None:
            _bend_wave(changing, rows[mine[0]], present, out[mine[0]])
            continue
        x = nodes[mine].ravel()
        values = changing.tangent_of_sum(present, "value", x).reshape(nodes[mine].shape)
        part = out[mine]
        _write_polynomials(rows[mine], nodes[mine], values, contract.COEFFICIENT, part)
        if factor_slopes is not None:
            bends = changing.tangent_of_sum(present, "curvature", x)
            curvature = sum((p.curvature(x) for p in present), np.zeros_like(x))
            along, direct = factor_slopes(curvature)
            values = (along * bends + direct).reshape(nodes[mine].shape)
            _write_polynomials(rows[mine], nodes[mine], values, contract.FACTOR, part)
        out[mine] = part


def _bend_wave(changing: Courses, row: FloatArray, present: list[PlacedStretch], out: FloatArray) -> None:
    """Write the derivatives of an exact wave: offset, amplitudes and wavenumber, about a fixed centre."""
    columns = [contract.COEFFICIENT, contract.SINE, contract.COSINE, contract.WAVENUMBER]

    def derivative_of(k: int) -> FloatArray:
        form = common_harmonics([changing.stretch_away(p, k) for p in present])
        if form is None:  # the piece is one wave, and its derivative would be two
            found = "the length of one of two waves that are equal and at the same place"
            raise InputError("", changing.path, found, "lengths that differ, by a millionth say")
        return np.asarray(harmonic_row(row[contract.CENTRE], row[contract.STOP], *form)[0, columns])

    out[columns] = changing.central_difference(derivative_of)


def _bend_circle(
    scenario: Scenario, path: str, changing: Courses, rolled: RolledPath, rows: FloatArray, nodes: FloatArray,
    factor_slopes: FactorSlopes | None, out: FloatArray,
) -> None:  # fmt: skip
    radius = float(scenario.vehicle.radius)
    envelope, profile = rolled.envelope, rolled.envelope.profile
    present = [placed for _, _, placed in course_cells(rolled.courses, profile.start, profile.end)]
    middle = nodes[:, len(LOBATTO) // 2]
    starts = np.array([run.start for run in envelope.runs])
    run_of = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, len(starts) - 1)
    owner = np.array([run.branch for run in envelope.runs])[run_of]
    x = nodes.ravel()
    owners = np.repeat(owner, nodes.shape[1])
    s = envelope.contact_points(x, owners)
    values = np.zeros_like(x)
    factors = np.zeros_like(x)
    for branch in np.unique(owner):
        mine = np.flatnonzero(owners == branch)
        held = envelope.branches[branch]
        if held.corner >= 0:
            values[mine] = _corner_tangent(changing, profile, present, held.corner, x[mine])
            continue
        stretches = present[held.cell]
        values[mine] = changing.tangent_of_sum(stretches, "value", s[mine])
        if factor_slopes is not None:
            factors[mine] = _factor_tangent(
                changing, profile, stretches, held.cell, s[mine], x[mine], factor_slopes, path
            )
    if path == "vehicle.radius":
        u = s - x
        values += radius / np.sqrt(radius**2 - u**2) - 1.0
    for a, b, direct in rolled.raised:
        inside = (x >= a) & (x < b)
        values[inside] += changing.tangent_of_sum(direct, "value", np.full(np.count_nonzero(inside), 0.5 * (a + b)))
        at_start = np.flatnonzero((rows[:, contract.START] == a) & (rows[:, contract.JOIN] == contract.JUMP))
        out[at_start, contract.START] = changing.border_tangent(direct, a)
    _write_polynomials(rows, nodes, values.reshape(nodes.shape), contract.COEFFICIENT, out)
    if factor_slopes is not None:
        bent = rows[:, contract.FACTOR_DEGREE] >= 0
        part = out[bent]
        _write_polynomials(rows[bent], nodes[bent], factors.reshape(nodes.shape)[bent], contract.FACTOR, part)
        out[bent] = part


def _corner_tangent(
    changing: Courses, profile: Any, present: list[list[PlacedStretch]], corner: int, x: FloatArray
) -> FloatArray:
    """Return the derivative of the path of a wheel that rolls about a corner, which may move."""
    held = profile.corners[corner]
    left, right = present[corner], present[corner + 1]
    at = np.array([held.position])
    side = max((left, right), key=lambda part: sum(value_at(p.value, held.position) for p in part))
    moves = changing.border_tangent(right, held.position)
    rises = float(changing.tangent_of_sum(side, "value", at)[0]) + moves * sum(
        value_at(p.slope, held.position) for p in side
    )
    return np.asarray(rises - moves * profile.circle_slope(held.position - x))


def _factor_tangent(
    changing: Courses, profile: Any, present: list[PlacedStretch], cell: int, s: FloatArray, x: FloatArray,
    factor_slopes: FactorSlopes, path: str,
) -> FloatArray:  # fmt: skip
    """Return the derivative of the factor at a fixed place of the wheel, whose point of contact moves."""
    u = s - x
    root = np.sqrt(profile.radius**2 - u**2)
    curvature = profile.cells[cell].curvature(s)
    push = changing.tangent_of_sum(present, "slope", s)
    if path == "vehicle.radius":
        push = push + u * profile.radius / root**3
    wander = push / (profile.radius**2 / root**3 - curvature)
    near = 1e-5
    sharper = (profile.cells[cell].curvature(s + near) - profile.cells[cell].curvature(s - near)) / (2 * near)
    along, direct = factor_slopes(curvature)
    return np.asarray(along * (changing.tangent_of_sum(present, "curvature", s) + sharper * wander) + direct)


def _move_kinks(rows: FloatArray, out: FloatArray) -> None:
    """Set the derivatives of the kinks, at which both sides still meet, and close the borders of the pieces."""
    for i in np.flatnonzero(rows[:, contract.JOIN] == contract.KINK):
        if i == 0:
            continue
        x = rows[i, contract.START]
        both = rows[[i - 1, i]]
        before, after = row_slopes(both, np.full(2, x))
        rise = row_tangents(both, out[[i - 1, i]], np.full(2, x), contract.COEFFICIENT)
        if abs(after - before) > 1e-9:
            out[i, contract.START] = -(rise[1] - rise[0]) / (after - before)
    out[:-1, contract.STOP] = out[1:, contract.START]
