"""The train seen from above, as places in an SVG: vehicles, axles, and a disc for every wheel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

SCALE = 14.0
"""Pixels for each metre along the track."""
WIDTH = 1040.0
"""Width of a row, pixels; a longer train takes several rows."""
BEYOND = 1.6
"""How far a vehicle goes beyond its outer axles, m, or half of the way to the next if that is less."""
MARGIN = 10.0
HEIGHT, RAILS, ALONE = 92.0, (30.0, 66.0), 48.0
"""Height of a row, and where the two rails are in it, or the only one, from its top, pixels."""


class Disc(NamedTuple):
    """A wheel: where it is, pixels, and its row of the train's table."""

    x: float
    y: float
    row: Mapping[str, Any]


class Body(NamedTuple):
    """A vehicle: ends, pixels, top of its row, its number, and its wheels."""

    first: float
    last: float
    top: float
    number: int
    discs: tuple[Disc, ...]


class Drawing(NamedTuple):
    """A train from above; it runs to the left."""

    width: float
    height: float
    bodies: tuple[Body, ...]
    rails: tuple[tuple[str, float], ...]  # name, and place from the top of each row
    tops: tuple[float, ...]


def drawing_of(
    axles: Sequence[Mapping[str, Any]], vehicles: Sequence[Mapping[str, Any]], wheels: Sequence[Mapping[str, Any]]
) -> Drawing:
    """Return the drawing of a train.

    Parameters
    ----------
    axles, vehicles
        Those of a `TrainFinding`.
    wheels
        The rows of its table.
    """
    places = [axle["place"] for axle in axles]
    sides = {row["side"] for row in wheels}
    forwards = axles[0]["direction"] > 0  # it runs to the left on the page, so that its left side is below
    order: list[Any] = ["right", "left"] if forwards else ["left", "right"]
    rails = dict(zip(order, RAILS, strict=True)) if None not in sides else {None: ALONE}
    own: dict[int, list[Mapping[str, Any]]] = {}
    for row in wheels:
        own.setdefault(row["axle"], []).append(row)
    bodies, top, start = [], 0.0, None
    for vehicle in vehicles:
        first, last = vehicle["first_axle"] - 1, vehicle["last_axle"] - 1
        before = min(BEYOND, 0.45 * (places[first] - places[first - 1])) if first else BEYOND
        behind = min(BEYOND, 0.45 * (places[last + 1] - places[last])) if last + 1 < len(places) else BEYOND
        a, b = places[first] - before, places[last] + behind
        if start is None:
            start = a
        elif (b - start) * SCALE > WIDTH - 2.0 * MARGIN:
            start, top = a, top + HEIGHT
        at = MARGIN - SCALE * start
        discs = tuple(
            Disc(at + SCALE * places[axle], top + rails[row["side"]], row)
            for axle in range(first, last + 1) for row in own.get(axle + 1, ())
        )  # fmt: skip
        bodies.append(Body(at + SCALE * a, at + SCALE * b, top, vehicle["vehicle"], discs))
    told = tuple((f"{name} rail" if name else "rail", y) for name, y in rails.items() if name in sides)
    tops = tuple(sorted({body.top for body in bodies}))
    return Drawing(WIDTH, top + HEIGHT, tuple(bodies), told, tops)
