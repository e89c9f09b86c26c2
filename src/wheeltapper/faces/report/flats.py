"""Flats of wheels over their passages: how they grow, and a small picture of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.gauges.growth import Growth, wheel_growth
from wheeltapper.diagnosis.gauges.verdicts import INTERVAL

MOST = 100
"""So many of a wheel's latest passages count."""
PICTURE = (220.0, 60.0, 5.0)
"""Width, height and margin of a picture, pixels."""
MONTH = 30.0
"""Growth is told for so many days."""
Points = Sequence[tuple[float, float]]


class Flat(NamedTuple):
    """A wheel that has, or had, a flat.

    Attributes
    ----------
    identity, page, passed
        Of the wheel, and of its last passage.
    growth
        Of its flat.
    dots, healthy
        Places in the picture, pixels: lengths, and passages without a flat.
    lines, bands, renewals
        Lines and their 90 % intervals as points, and where the wheel was renewed.
    """

    identity: str
    page: str
    passed: str
    growth: Growth
    dots: Points
    healthy: Points
    lines: Sequence[str]
    bands: Sequence[str]
    renewals: Sequence[float]

    @property
    def now(self) -> str:
        """The length at the last passage, mm, with half of its interval."""
        return _with_half(self.growth.length, self.growth.length_interval, 1e3)

    @property
    def monthly(self) -> str:
        """Its growth in 30 days, mm."""
        return _with_half(self.growth.rate, self.growth.rate_interval, 1e3 * MONTH)


def flats_of(passages: Sequence[Mapping[str, Any]]) -> list[Flat]:
    """Return the wheels with a flat at more than one passage, those first that are longest now.

    `passages` are rows of wheels with an identity, in the order of the identities and then of time.
    """
    out = []
    for identity, rows in groupby(passages, key=itemgetter("identity")):
        own = [row for row in rows if row["told"]][-MOST:]
        if sum(row["told"]["verdict"] != HEALTHY for row in own) > 1:
            growth = wheel_growth([row["told"] for row in own], [row["passed"] for row in own])
            out.append(_drawn(identity, own[-1], growth))
    return sorted(out, key=lambda one: -(one.growth.length or 0.0))


def _drawn(identity: str, last: Mapping[str, Any], growth: Growth) -> Flat:
    width, height, margin = PICTURE
    begin, end = growth.passages[0].at, growth.passages[-1].at
    longest = 1.2 * max(one.length for one in growth.passages if one.kind != HEALTHY)

    def at(place: float, length: float) -> tuple[float, float]:
        x = margin + (width - 2 * margin) * (place - begin) / ((end - begin) or 1.0)
        return round(x, 1), round(height - margin - (height - 2 * margin) * min(max(length / longest, 0.0), 1.0), 1)

    lines, bands = [], []
    for course in growth.courses:
        if course.found > 1:
            ends = [(place, *course.length(place)) for place in (course.first, course.last)]
            lines.append(_text([at(place, length) for place, length, _ in ends]))
            low, high = ([at(place, length + by * INTERVAL * off) for place, length, off in ends] for by in (-1, 1))
            bands.append(_text([*low, *high[::-1]]))
    return Flat(
        identity, last["page"], last["passed"], growth,
        [at(one.at, one.length) for one in growth.passages if one.kind != HEALTHY],
        [at(one.at, 0.0) for one in growth.passages if one.kind == HEALTHY], lines, bands,
        [at(place, 0.0)[0] for place in growth.renewals],
    )  # fmt: skip


def _text(points: Points) -> str:
    return " ".join(f"{x},{y}" for x, y in points)


def _with_half(value: float | None, interval: tuple[float, float] | None, factor: float) -> str:
    if value is None or interval is None:
        return "-"
    return f"{factor * value:.1f} \u00b1 {0.5 * factor * (interval[1] - interval[0]):.1f}"
