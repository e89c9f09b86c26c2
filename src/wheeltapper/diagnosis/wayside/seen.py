"""Which share of a wheel's turn a site's sensors see: a flat that strikes elsewhere is not measured."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi
from pathlib import Path
from typing import NamedTuple

from wheeltapper.describe.site import Site, as_any_site
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError

EDGE = 0.1
"""What lies closer than this to a gauge, m, does not count for peaks, but at most a quarter of the length on either
side."""
BEFORE_GAUGE = 1e-3
"""Peaks closer than this to a gauge in time, s, do not count."""


class Blind(NamedTuple):
    """Shares of a wheel's turn that the sensors of a rail do not see.

    Attributes
    ----------
    side
        The rail: "left", "right" or None.
    strikes
        Share that meets the rail beside all sensors. Its strikes are not reported, unless a sensor feels them from
        there.
    peaks
        Share on which no peak counts. It is larger, since peaks near the gauges do not count either.
    """

    side: str | None
    strikes: float
    peaks: float


def edge_of(length: float, pace: float) -> float:
    """Return how far from a gauge peaks count, m, in a sensor of this length, m, at this pace, s/m."""
    return min(max(min(EDGE, 0.25 * length), BEFORE_GAUGE / pace), 0.4 * length)


def seen_share(windows: Iterable[tuple[float, float]], turn: float) -> float:
    """Return which share of a turn, m, meets the rail within windows, m, whatever the wheel's position on it is."""
    pieces = []
    for begin, end in windows:
        if end - begin >= turn:
            return 1.0
        first = begin % turn
        last = first + max(end - begin, 0.0)
        pieces += [(first, min(last, turn)), (0.0, last - turn)]
    seen, reached = 0.0, 0.0
    for begin, end in sorted(pieces):
        seen += max(end - max(begin, reached), 0.0)
        reached = max(reached, end)
    return seen / turn


def blind_shares(site: Site | str | Path, speed: float | str, radius: float | str | None = None) -> tuple[Blind, ...]:
    """Return the share of a wheel's turn that a site does not see, for each rail; no recording is needed.

    A flat on that share strikes where no sensor measures the wheel. The share changes with the length of the row of
    sensors and with their distances: a place that is between the sensors in one turn may be on one in the next.

    Parameters
    ----------
    site
        The site with its sensors, or the path of its TOML file.
    speed
        Speed of the train, m/s.
    radius
        Radius of the wheels, m; None: that of the site.

    Raises
    ------
    InputError
        If the site has no sensors between gauges, or no radius is stated.
    """
    site, speed = as_any_site(site), as_quantity(speed, "speed", "speed")
    if speed <= 0.0:
        raise InputError("", "speed", f"{speed:g} m/s", "a positive speed")
    held = site.wheel_radius if radius is None else as_quantity(radius, "radius", "length")
    if held is None or held <= 0.0:
        raise InputError("", "radius", "none" if held is None else f"{held:g} m", "the radius of the wheels, m")
    pairs = [(one.side, one.ends) for one in site.sensors if one.ends is not None]
    if not pairs:
        raise InputError("", "sensor", "none between gauges", "sensors that weigh a piece of rail, with x1 and x2")
    sides = [side for side in ("left", "right", None) if any(one == side for one, _ in pairs)]
    out = []
    for side in sides:
        ends = [each for one, each in pairs if one == side]
        counted = [(x1 + edge, x2 - edge) for x1, x2 in ends for edge in [edge_of(x2 - x1, 1.0 / speed)]]
        turn = 2.0 * pi * held
        out.append(Blind(side, 1.0 - seen_share(ends, turn), 1.0 - seen_share(counted, turn)))
    return tuple(out)
