"""Time ratios at matched accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, log
from typing import NamedTuple


class Point(NamedTuple):
    """What a code at one setting costs, and how large its error is."""

    error: float
    time: float  # s


@dataclass(frozen=True)
class Match:
    """A peer's time at our accuracy, over our time.

    `bound` is "" where the peer's curve covers our accuracy; ">" where the peer is not so accurate at any setting, so
    that its most accurate setting stands in; "<" where it is more accurate at every setting.
    """

    method: str
    peer: str
    ratio: float
    bound: str

    def __str__(self) -> str:
        return f"{self.peer:18} / {self.method:20}{self.bound or ' ':>3} {self.ratio:.3g}"


def best_of(points: Sequence[Point]) -> list[Point]:
    """Return the points that no other one beats in both time and error, the least accurate one first."""
    kept: list[Point] = []
    for point in sorted(points):
        if not kept or point.time < kept[-1].time:
            kept.append(point)
    return kept[::-1]


def match(method: str, own: Point, peer: str, points: Sequence[Point]) -> Match:
    """Compare at our error, on the peer's curve of log time over log error."""
    curve = [(log(p.error), log(p.time)) for p in best_of(points)]
    at = log(own.error)
    if at >= curve[0][0] or at <= curve[-1][0]:
        bound, (_, height) = ("<", curve[0]) if at >= curve[0][0] else (">", curve[-1])
        return Match(method, peer, exp(height) / own.time, bound)
    (x0, y0), (x1, y1) = next((a, b) for a, b in pairwise(curve) if b[0] < at)
    height = y0 + (y1 - y0) * (at - x0) / (x1 - x0)
    return Match(method, peer, exp(height) / own.time, "")
