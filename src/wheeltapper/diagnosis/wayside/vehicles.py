"""Vehicles and bogies of a train, by the distances of its axles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf

BOGIE = (1.0, 3.4)
"""Distances of neighbouring axles of a bogie, m."""
BETWEEN = 3.6
"""Least distance of neighbouring axles of two bogies of a vehicle, m."""
ALONE = (3.5, 13.0)
"""Distances of the two axles of a vehicle without bogies, m."""
LINKED = (1.8, 9.0)
"""Distances of the last axle of a vehicle and the first of the next, m."""
EQUAL = 0.02
"""Largest difference of two bogies' wheelbases, over them: those of one vehicle are equal."""
MOST = 16
"""Largest number of axles of a vehicle."""
COSTS = {"bogies": 0.0, "shared bogies": 1.2, "axles": 0.6, "alone": 3.0}
"""What each kind of vehicle costs, for each vehicle; the cheapest division of a train is the likely one."""
UNEQUAL = 0.3
"""What it costs that a vehicle is followed by one of other distances, and that the way to the next is shorter than the
wheelbase of a bogie."""


@dataclass(frozen=True)
class Vehicle:
    """A vehicle of a train: its axles, from 0, in groups, each a bogie or a single axle; `kind` is a key of `COSTS`."""

    kind: str
    bogies: tuple[tuple[int, ...], ...]

    @property
    def axles(self) -> tuple[int, ...]:
        """Its axles, from 0."""
        return tuple(axle for bogie in self.bogies for axle in bogie)


def vehicles_of(places: Sequence[float]) -> list[Vehicle]:
    """Return the vehicles of a train whose axles lie at these distances behind the leading one, m.

    A vehicle has two equal bogies of two or three axles, two single axles, or several cars share its bogies. What fits
    none is an axle alone.
    """
    gaps = [b - a for a, b in zip(places[:-1], places[1:], strict=True)]
    count = len(places)
    best: list[tuple[float, list[Vehicle]]] = [(0.0, []), *[(inf, list[Vehicle]())] * count]
    for begin in range(count):
        before, vehicles = best[begin]
        for found in _vehicles_from(begin, gaps):
            end = found.axles[-1] + 1
            cost = before + COSTS[found.kind] + _step_cost(vehicles, found, gaps)
            if cost < best[end][0]:
                best[end] = cost, [*vehicles, found]
    return best[count][1]


def _vehicles_from(first: int, gaps: Sequence[float]) -> Iterator[Vehicle]:
    """Yield the vehicles that an axle may lead."""
    yield Vehicle("alone", ((first,),))
    if first == len(gaps) or (first and not LINKED[0] <= gaps[first - 1] <= LINKED[1]):
        return
    if ALONE[0] <= gaps[first] <= ALONE[1]:
        yield Vehicle("axles", ((first,), (first + 1,)))
    bogies: list[tuple[int, ...]] = []
    current = [first]
    for axle in range(first + 1, min(first + MOST, len(gaps) + 1)):
        if gaps[axle - 1] >= BETWEEN:
            if len(current) not in (2, 3) or (bogies and len(current) != len(bogies[0])):
                return
            bogies.append(tuple(current))
            current = []
        elif not BOGIE[0] <= gaps[axle - 1] <= BOGIE[1]:
            return
        current.append(axle)
        if bogies and len(current) == len(bogies[0]):
            kind = _kind_of([*bogies, tuple(current)], gaps)
            if kind is not None:
                yield Vehicle(kind, (*bogies, tuple(current)))


def _kind_of(bogies: Sequence[tuple[int, ...]], gaps: Sequence[float]) -> str | None:
    """Return the kind of a vehicle with such bogies, of equally many axles; None, if there is none."""
    ends = [gaps[axle] for axle in reversed(bogies[-1][:-1])]
    if any(abs(gaps[axle] - other) > EQUAL * gaps[axle] for axle, other in zip(bogies[0][:-1], ends, strict=True)):
        return None
    if len(bogies) == 2:
        return "bogies"
    between = [gaps[bogie[-1]] for bogie in bogies[:-1]]
    alike = max(between) < 1.5 * min(between)  # cars that share bogies are about as long as each other
    return "shared bogies" if alike and len(bogies[0]) == 2 else None


def _step_cost(before: list[Vehicle], vehicle: Vehicle, gaps: Sequence[float]) -> float:
    """Return what a vehicle costs behind the others, beyond its own cost."""
    if not before:
        return 0.0
    last = before[-1]
    link = gaps[vehicle.axles[0] - 1]
    own, other = (_distances(one, gaps) for one in (vehicle, last))
    alike = len(own) == len(other) and all(abs(a - b) <= 2 * EQUAL * a for a, b in zip(own, other, strict=True))
    shortest = max(
        (min(one) for kind, one in ((vehicle.kind, own), (last.kind, other)) if "bogies" in kind), default=0.0
    )
    return (0.0 if alike else UNEQUAL) + (UNEQUAL if link < shortest else 0.0)


def _distances(vehicle: Vehicle, gaps: Sequence[float]) -> list[float]:
    axles = vehicle.axles
    return list(gaps[axles[0] : axles[-1]])
