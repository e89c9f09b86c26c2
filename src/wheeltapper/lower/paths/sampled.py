"""A user's function over the length of a run: the range of its height, and a check that it does not jump.

samples   Their spacing is at most SPACING, or there are MOST of them.
suspects  The intervals between samples whose rise differs most from that of their neighbours.
halving   Each suspect is halved repeatedly, towards the larger rise. The rise of a smooth function falls with the
          width; that of a jump stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.course import Course, Stretch
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note, first_places
from wheeltapper.lower.paths.fit import NARROWEST

FloatArray = NDArray[np.float64]
SPACING = 1e-3
"""Largest spacing of the samples, m."""
MOST = 100_000
"""Largest number of samples."""
SUSPECTS = 256
"""Number of intervals that are searched for a jump: those whose rise differs most from that of their neighbours."""
JUMP = 1e-9
"""A rise that is smaller than this share of the function's height is no jump."""
WIDE = 1e-4
"""Width of an interval, m. A rise is a jump if half of the rise over this width remains over the width
`fit.NARROWEST`."""
PLACED = 1e-11
"""Width of the interval, m, to which a jump is located."""


def over_the_run(course: Course, start: float, end: float) -> Course:
    """Return a user's function with the range of its height from start to end, m.

    Raises
    ------
    InputError
        If it jumps at a place without a breakpoint.
    """
    if not course.sampled:
        return course
    parts = []
    for stretch in course.stretches:
        first, last = max(stretch.start, start), min(stretch.end, end)
        if first < last and stretch.exact is None:
            x = np.linspace(first, last, int(np.clip((last - first) / SPACING, 64, MOST)) + 1)
            parts.append((stretch, x, np.asarray(stretch.value(x), dtype=float)))
    heights = np.concatenate([values for _, _, values in parts] or [np.zeros(1)])
    height = float(np.ptp(heights)) or float(np.abs(heights).max()) or 1e-6
    for stretch, x, values in parts:
        _check_smooth(stretch, x, values, JUMP * height)
    return replace(course, height=height)


def _check_smooth(stretch: Stretch, x: FloatArray, values: FloatArray, largest: float) -> None:
    rise = np.diff(values)
    around = np.concatenate([rise[:1], rise, rise[-1:]])
    odd = np.abs(rise - 0.5 * (around[:-2] + around[2:]))
    suspects = np.argsort(odd)[-SUSPECTS:]
    left, right, low, high = x[suspects], x[suspects + 1], values[suspects], values[suspects + 1]
    wide = np.full(len(left), np.inf)
    while len(left) and np.max(right - left) > PLACED:
        middle = 0.5 * (left + right)
        value = np.asarray(stretch.value(middle), dtype=float)
        first = np.abs(value - low) >= np.abs(high - value)
        left, low = np.where(first, left, middle), np.where(first, low, value)
        right, high = np.where(first, middle, right), np.where(first, value, high)
        wide = np.where(right - left > WIDE, np.abs(high - low), wide)
        kept = np.abs(high - low) > largest
        if np.max(right - left) < NARROWEST:
            kept &= np.abs(high - low) > 0.5 * wide
        left, right, low, high, wide = (part[kept] for part in (left, right, low, high, wide))
    if len(left):
        worst = int(np.argmin(right))
        place = f"{right[worst]:.10g}"
        raise InputError(
            "", "irregularity",
            f"a function that jumps by {1e3 * (high[worst] - low[worst]):.4g} mm at x = {place} m",
            f"smooth functions between breakpoints (breakpoints=[{place}])",
        )  # fmt: skip


def pieces_note(courses: list[Course], starts: FloatArray, halves: FloatArray) -> list[Note]:
    """Return a note on places where a fit to users' functions needed very short pieces."""
    cut = np.unique(np.round(starts[halves < NARROWEST], 6))
    if not len(cut) or not any(course.sampled for course in courses):
        return []
    where = f"at x = {first_places(cut.tolist())} m"
    return [
        Note(
            f"the irregularity's function is not smooth {where}, where its path takes many short pieces; state these "
            "places as `breakpoints`"
        )
    ]
