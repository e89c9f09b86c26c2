"""Point rolling: the wheel's centre follows the sum of the irregularities."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course, Harmonic, Polynomials, Stretch
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.paths.fit import Factor, Function, SampledFunction, fit
from wheeltapper.lower.paths.table import PathTable, assemble, blank_rows, polynomial_rows, set_factor
from wheeltapper.march.common import program as contract

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST_BORDERS = 1_000_000
"""Largest number of borders of periods that are written out. More would take minutes; the run is refused."""
SLIVER = 1e-12
"""Distance, m, below which two borders count as one."""


@dataclass(frozen=True)
class PlacedStretch:
    """A stretch of a course, moved by whole periods."""

    stretch: Stretch
    shift: float
    start: float
    end: float

    def value(self, x: FloatArray) -> FloatArray:
        """Return the height at x."""
        return np.asarray(self.stretch.value(x - self.shift))

    def slope(self, x: FloatArray) -> FloatArray:
        """Return the slope at x."""
        return np.asarray(self.stretch.slope(x - self.shift))

    def curvature(self, x: FloatArray) -> FloatArray:
        """Return the second derivative at x."""
        return np.asarray(self.stretch.curvature(x - self.shift))


def unrolled_stretches(course: Course, start: float, end: float) -> list[PlacedStretch]:
    """Return the stretches of a course within [start, end]; its periods are written out."""
    if course.period is None:
        placed = [PlacedStretch(s, 0.0, s.start, s.end) for s in course.stretches]
        return [p for p in placed if p.end > start and p.start < end]
    period, origin = course.period, course.repeats_from
    lead = [PlacedStretch(s, 0.0, s.start, min(s.end, origin)) for s in course.stretches if s.start < origin]
    if np.isneginf(origin):
        lead, origin = [], 0.0
    first = int(np.floor((max(start, origin) - origin) / period)) if start > origin or not lead else 0
    last = int(np.ceil((end - origin) / period))
    inside = [
        (s, max(s.start, origin), min(s.end, origin + period))
        for s in course.stretches
        if s.end > origin and s.start < origin + period
    ]
    if (last - first + 1) * len(inside) > MOST_BORDERS:
        raise InputError(
            "", "duration", f"a run over {(last - first + 1) * len(inside):.2g} borders of an irregularity",
            f"up to {MOST_BORDERS:g} of them: a shorter or slower run",
        )  # fmt: skip
    out = lead + [
        PlacedStretch(s, k * period, a + k * period, b + k * period)
        for k in range(first, last + 1)
        for s, a, b in inside
    ]
    return [p for p in out if p.end > start and p.start < end and p.end > p.start]


def course_cells(courses: list[Course], start: float, end: float) -> list[tuple[float, float, list[PlacedStretch]]]:
    """Return the intervals between all borders in [start, end], each with its stretches."""
    lists = [unrolled_stretches(course, start, end) for course in courses]
    borders = np.unique([b for placed in lists for p in placed for b in (p.start, p.end) if start < b < end])
    inner = borders[(borders - start > SLIVER) & (end - borders > SLIVER)]  # repeated borders agree up to rounding only
    edges = [start, *inner[np.diff(inner, prepend=-inf) > SLIVER].tolist(), end]
    at = [0] * len(lists)
    out = []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        present = []
        for i, placed in enumerate(lists):
            while placed[at[i]].end <= a + SLIVER and at[i] + 1 < len(placed):
                at[i] += 1
            present.append(placed[at[i]])
        out.append((a, b, present))
    return out


def sum_function(present: list[PlacedStretch], which: str) -> Function:
    """Return the sum of one property of the stretches as a function."""
    forms = [p.stretch.exact for p in present]
    uneven = [p for p, form in zip(present, forms, strict=True) if not (isinstance(form, Harmonic) and form.level)]
    level = sum(form.offset for form in forms if isinstance(form, Harmonic) and form.level) if which == "value" else 0.0

    def summed_at(x: FloatArray) -> FloatArray:
        return np.asarray(sum((getattr(p, which)(x) for p in uneven), np.full_like(x, level)))

    return summed_at


def common_harmonics(present: list[PlacedStretch]) -> tuple[float, list[tuple[Harmonic, float]]] | None:
    """Return offset and waves (with their shifts) if all stretches are exact harmonics of at most one wavenumber."""
    offset, waves = 0.0, []
    for p in present:
        form = p.stretch.exact
        if not isinstance(form, Harmonic):
            return None
        offset += form.offset
        if form.wavenumber and (form.sine or form.cosine):
            waves.append((form, p.shift))
    if len({form.wavenumber for form, _ in waves}) > 1:
        return None
    return offset, waves


def harmonic_row(start: float, end: float, offset: float, waves: list[tuple[Harmonic, float]]) -> FloatArray:
    """Return the piece of an offset and waves of one wavenumber."""
    row = blank_rows(1)
    centre = start if np.isfinite(start) else 0.0
    row[0, [contract.START, contract.STOP, contract.CENTRE, contract.COEFFICIENT]] = start, end, centre, offset
    add_waves(row, waves)
    return row


def add_waves(rows: FloatArray, waves: list[tuple[Harmonic, float]]) -> None:
    """Add waves of one wavenumber, with their shifts, to pieces."""
    for form, shift in waves:
        phase = form.wavenumber * (rows[:, contract.CENTRE] - form.origin - shift)
        rows[:, contract.SINE] += form.sine * np.cos(phase) - form.cosine * np.sin(phase)
        rows[:, contract.COSINE] += form.sine * np.sin(phase) + form.cosine * np.cos(phase)
        rows[:, contract.WAVENUMBER] = form.wavenumber


def _knots(present: list[PlacedStretch], start: float, end: float) -> FloatArray:
    """Return the places of [start, end] between which all stretches that are polynomial are one polynomial each."""
    edges = [np.array([start, end])]
    for p in present:
        if isinstance(p.stretch.exact, Polynomials):
            breaks = p.stretch.exact.breaks + p.shift
            edges.append(breaks[(breaks > start + SLIVER) & (breaks < end - SLIVER)])
    found = np.unique(np.concatenate(edges))
    return found[np.diff(found, prepend=-inf) > SLIVER] if len(edges) > 2 else found


def _sum_at(forms: list[tuple[Polynomials, float]], edges: FloatArray) -> FloatArray:
    """Return the coefficients of the sum of polynomials (with their shifts) between edges, from the left ones on."""
    middle = 0.5 * (edges[:-1] + edges[1:])
    out = np.zeros((len(middle), max(form.coefficients.shape[1] for form, _ in forms)))
    for form, shift in forms:
        piece = np.clip(np.searchsorted(form.breaks + shift, middle, side="right") - 1, 0, len(form.breaks) - 2)
        moved, away = form.coefficients[piece].copy(), edges[:-1] - (form.breaks + shift)[piece]
        last = moved.shape[1] - 1
        for low in range(last):  # Taylor's series about the left edge, by Horner's scheme
            for k in range(last - 1, low - 1, -1):
                moved[:, k] += away * moved[:, k + 1]
        out[:, : last + 1] += moved
    return out


def _polynomial_rows(
    present: list[PlacedStretch], start: float, end: float, others: tuple[float, list[tuple[Harmonic, float]]],
    height: float,
) -> FloatArray:  # fmt: skip
    """Return the exact pieces of stretches that are polynomial, cut to [start, end], plus offset and waves."""
    offset, waves = others
    edges = _knots(present, start, end)
    coefficients = _sum_at(
        [(p.stretch.exact, p.shift) for p in present if isinstance(p.stretch.exact, Polynomials)], edges
    )
    coefficients[:, 0] += offset
    scale = np.diff(edges)
    scaled = coefficients * scale[:, None] ** np.arange(coefficients.shape[1])
    rows = polynomial_rows(edges[:-1], edges[1:], scaled, 1e-18 * height)
    rows[:, contract.CENTRE] = edges[:-1]
    rows[:, contract.SCALE] = scale
    add_waves(rows, waves)
    return rows


def _cell_rows(
    cell: tuple[float, float, list[PlacedStretch]], height: float, tolerance: float, factor: Factor | None
) -> FloatArray:
    """Return the pieces of one cell; `factor` gives the factor on the contact force from the profile's curvature."""
    start, end, present = cell
    exact = common_harmonics(present)
    bent = factor is not None and not (exact is not None and not exact[1])
    if exact is not None and not bent:
        return harmonic_row(start, end, *exact)
    others = common_harmonics([p for p in present if not isinstance(p.stretch.exact, Polynomials)])
    if others is not None and not bent:
        return _polynomial_rows(present, start, end, others, height)
    value, slope, curvature = (sum_function(present, name) for name in ("value", "slope", "curvature"))

    def sample(x: FloatArray, _: IntArray) -> list[SampledFunction]:
        path = [SampledFunction(value(x), slope(x))]
        return [*path, factor.sampled_factor(curvature(x))] if bent and factor is not None else path

    tolerances = [tolerance * height, tolerance] if bent else [tolerance * height]
    edges = _knots(present, start, end)
    intervals = np.column_stack([edges[:-1], edges[1:]])
    left, right, fitted = fit(sample, intervals, np.zeros(len(intervals), dtype=np.int64), tolerances)
    rows = polynomial_rows(left, right, fitted[0], 1e-18 * height)
    if bent:
        set_factor(rows, fitted[1])
    return rows


def without_wave_period(course: Course) -> Course:
    """Return a course without its period if it is one endless wave; then it needs no loop and has no borders."""
    last = course.stretches[-1]
    one_wave = isinstance(last.exact, Harmonic) and last.start <= course.repeats_from
    return replace(course, period=None) if one_wave else course


def point_table(
    courses: list[Course], end: float, height: float, tolerance: float, factor: Factor | None = None
) -> PathTable:
    """Return the path of a wheel whose centre follows the courses' sum from x = 0 to x = end.

    Parameters
    ----------
    courses
        The irregularities.
    end
        Position at the end of the run, m.
    height
        Characteristic height, m; the error of the fit is at most tolerance·height.
    factor
        The factor on the contact force; None for one.
    """
    if factor is None:
        courses = [without_wave_period(course) for course in courses]
    repeating = [c for c in courses if c.period is not None]
    loop = None
    stop = end
    if len(courses) == 1 and repeating:
        (course,) = repeating
        origin = max(course.repeats_from, 0.0)
        period = course.period or 0.0
        if origin + 2 * period < end:
            stop, loop = origin + period, origin
    found = [_cell_rows(cell, height, tolerance, factor) for cell in course_cells(courses, 0.0, stop)]
    rows = np.vstack(found)
    if loop is None:
        rows[-1, contract.STOP] = inf
        return assemble(rows, height)
    index = int(np.searchsorted(rows[:, contract.START], loop - 1e-12 * (1.0 + loop)))
    return assemble(rows, height, index)
