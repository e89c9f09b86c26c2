"""Hollows of a tread and what is built up on it: depth, length and place, with intervals.

Theory: docs/theory/gauges.rst, section 16.13.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import label

from wheeltapper.diagnosis.gauges.answers import REACH
from wheeltapper.diagnosis.gauges.verdicts import INTERVAL

FloatArray = NDArray[np.float64]
EDGE = 0.25
"""A hollow reaches as far as the tread deviates by more than this part of its depth."""
SHOWN, SURE, MOST = 0.4, 4.0, 3
"""What deviates by this part of the largest deviation, and by so many standard deviations, is told, too; so many."""
OWN_DEPTH = 0.1
"""Standard deviation of a depth and of a length that is error of the model, over them."""
DRAWN, FINELY = 400, 1500
"""Treads that are drawn for intervals, and places at which they are looked at."""


class Part(NamedTuple):
    """A hollow of a tread, or a built-up place on it.

    Attributes
    ----------
    size
        Its largest deviation from the tread's median, m, as far as a rail reaches; missing material is negative.
    length
        Length over which it deviates by more than `EDGE` of its size, m.
    angle
        Angle of its middle, rad, counted from the point that meets the rail at `Tread.place`.
    size_interval, length_interval
        The 90 % intervals of size and length, m.
    """

    size: float
    length: float
    angle: float
    size_interval: tuple[float, float] = (0.0, 0.0)
    length_interval: tuple[float, float] = (0.0, 0.0)


def parts_of(deviations: FloatArray, spread: FloatArray, radius: float) -> tuple[Part, ...]:
    """Return hollows of a tread and what is built up, the largest first, as far as a rail reaches into them.

    `spread` is as in `Estimate`.
    """
    rng = np.random.default_rng(0)
    each = np.column_stack([deviations, deviations[:, None] + spread @ rng.standard_normal((spread.shape[1], DRAWN))])
    ends = np.linspace(0.0, 2.0 * pi, len(each) + 1)
    finely = CubicSpline(ends, np.vstack([each, each[:1]]), bc_type="periodic")(2.0 * pi * np.arange(FINELY) / FINELY)
    shown = reached(finely, radius)
    shown -= np.median(shown, axis=0)
    own, drawn = shown[:, 0], shown[:, 1:]
    left, sure, parts = own.copy(), SURE * drawn.std(axis=1), list[Part]()
    while len(parts) < MOST:
        middle = int(np.argmax(np.abs(left)))
        if parts and np.abs(left[middle]) < max(SHOWN * abs(parts[0].size), sure[middle]):
            break
        by = FINELY // 2 - middle
        part, inside = _part(np.roll(own, by), radius)
        others = [_part(one, radius, inside)[0] for one in np.roll(drawn, by, axis=0).T]
        off = np.array([(one.size - part.size, one.length - part.length) for one in others])
        half = INTERVAL * np.sqrt((off**2).mean(axis=0) + (OWN_DEPTH * np.array([part.size, part.length])) ** 2)
        size, length = ((v - h, v + h) for v, h in zip((part.size, part.length), half.tolist(), strict=True))
        angle = (part.angle - 2.0 * pi * by / FINELY) % (2.0 * pi)
        parts.append(Part(part.size, part.length, angle, size, length))
        left[np.roll(inside, -by)] = 0.0
    return tuple(parts)


def reached(heights: FloatArray, radius: float) -> FloatArray:
    """Return treads as far as a flat rail reaches into them: over what it does not touch, as if it just did.

    `heights` are deviations at equal angles, m, (places, treads).
    """
    step = 2.0 * pi * radius / len(heights)
    beside = np.arange(-int(REACH / step), int(REACH / step) + 1)
    path, out = np.full_like(heights, -np.inf), np.full_like(heights, np.inf)
    for by in beside.tolist():  # the centre of the wheel, and the lowest that it leaves of the tread
        np.maximum(path, np.roll(heights, by, axis=0) - 0.5 * (by * step) ** 2 / radius, out=path)
    for by in beside.tolist():
        np.minimum(out, np.roll(path, by, axis=0) + 0.5 * (by * step) ** 2 / radius, out=out)
    return out


def _part(
    deviations: FloatArray, radius: float, within: NDArray[np.bool_] | None = None
) -> tuple[Part, NDArray[np.bool_]]:
    """Return the largest deviation, and where it is; `within` says where it is sought, by default in the middle."""
    middle = len(deviations) // 2
    if within is not None:
        middle = int(np.argmax(np.where(within, np.abs(deviations), -1.0)))
    size = float(deviations[middle])
    above = deviations * np.sign(size) - EDGE * abs(size)
    groups, _ = label(above > 0.0)
    inside = np.flatnonzero(groups == groups[middle])
    first, last = int(inside[0]), int(inside[-1])
    begin = first - (above[first] / (above[first] - above[first - 1]) if first > 0 else 0.0)
    end = last + (above[last] / (above[last] - above[last + 1]) if last + 1 < len(above) else 0.0)
    step = 2.0 * pi / len(deviations)
    part = Part(size, float(end - begin) * step * radius, 0.5 * float(begin + end) * step)
    return part, np.isin(np.arange(len(deviations)), np.arange(first - 1, last + 2))
