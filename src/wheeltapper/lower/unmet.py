"""What a run never meets: irregularities, anomalies and decks that lie beyond the way of all wheels they are under.

A wheel that stands on another level than others, as where a step is between them, or than its spring's guide, has met
what is between them: it is in the static state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course
from wheeltapper.describe.irregularity.measured import Measured
from wheeltapper.describe.placement import Placement, parsed_place
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.element import GROUND
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.track.section import section_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Acting(NamedTuple):
    """The places at which a part of a scenario acts.

    Attributes
    ----------
    path, kind
        The part's path and the name of its noun.
    starts, ends
        First and last x of each place, m, (places, 1) or (1, cells); of a part that repeats, those of one period.
    wheels
        Positions of the wheelsets that may meet it, at time zero, m.
    period
        Distance after which the places come again, m; None: never.
    begins
        Whether there is nothing before the first period.
    before, behind
        How far before its place, and behind it, it is met already, m; of all places, or shaped as `starts`.
    hint
        How to move it.
    stood_on
        From x of the leading wheelset at time zero, m, an array, to whether what wheels stand on there changes the
        static state; None where nothing can be stood on.
    """

    path: str
    kind: str
    starts: FloatArray
    ends: FloatArray
    wheels: tuple[float, ...]
    period: float | None = None
    begins: bool = True
    before: FloatArray | float = 0.0
    behind: FloatArray | float = 0.0
    hint: str = ""
    stood_on: Callable[[FloatArray], NDArray[np.bool_]] | None = None

    def missed_by(self, first: Any, last: Any) -> FloatArray:
        """Return how far it is from what wheels pass, m; 0 where it is met.

        The leading wheelset goes from x = `first` to `last`, m, numbers or arrays.
        """
        gaps = [self._gap(first + wheel, last + wheel).min(axis=0) for wheel in self.wheels]
        missed = np.asarray(np.min(gaps, axis=0))
        if self.stood_on is None or not missed.any():
            return missed
        return np.where(self.stood_on(np.broadcast_to(first, missed.shape)), 0.0, missed)

    def _gap(self, first: Any, last: Any) -> FloatArray:
        starts, ends = self.starts - self.before, self.ends + self.behind
        if self.period is None:
            return np.asarray(np.maximum(np.maximum(starts - last, first - ends), 0.0))
        turns = np.ceil((first - ends) / self.period)  # so many periods later it does not end before `first`
        turns = np.maximum(turns, 0.0) if self.begins else turns
        return np.asarray(np.maximum(starts + turns * self.period - last, 0.0))

    def note(self, way: float) -> Note | None:
        """Return a note if it is not met while the vehicle goes so far, m."""
        missed = self.missed_by(0.0, way).item()
        if not missed > 0.0:
            return None
        start, end = float(self.starts.min()), float(self.ends.max())
        where = f"from x = {start:.6g} to {end:.6g} m" if end < inf else f"from x = {start:.6g} m on"
        where = f"at x = {start:.6g} m" if start == end else where
        again = f" and every {self.period:.6g} m" if self.period is not None and end < inf else ""
        passed = " and ".join(f"{one:.6g} to {other:.6g}" for one, other in _merged(self.wheels, way))
        text = f"{self.path}, a {self.kind} {where}{again}, is never met: wheels pass x = {passed} m only{self.hint}"
        return Note(text, never_met(self.path), missed, doubtful=True)


def never_met(path: str) -> str:
    """Return the cause of the note on a part that is never met."""
    return f"never met {path}"


def _merged(wheels: Iterable[float], way: float) -> list[list[float]]:
    """Return the stretches of x that wheels pass on their way, m, as few as possible."""
    out: list[list[float]] = []
    for begin in sorted(wheels):
        if out and begin <= out[-1][1]:
            out[-1][1] = begin + way
        else:
            out.append([begin, begin + way])
    return out


def unmet_notes(scenario: Scenario, way: float | None = None) -> tuple[Note, ...]:
    """Return one note for each part of a scenario that no wheel meets, on its whole way or on the given one, m."""
    way = float(scenario.speed * scenario.duration) if way is None else way
    return tuple(note for one in acting_in(scenario) if (note := one.note(way)) is not None)


def unmet_cells(
    groups: Iterable[tuple[Iterable[Acting], IntArray, Any, Any]], scenario_of: Callable[[int], Scenario]
) -> list[Shared]:
    """Return the same notes for cells: for each part that of the cell which is farthest from it.

    Parameters
    ----------
    groups
        Parts, the numbers of cells that have them, and first and last x of these cells' leading wheelsets, m.
    scenario_of
        From the number of a cell to its scenario.
    """
    missed: dict[str, list[tuple[float, int]]] = {}
    for acting, cells, first, last in groups:
        for one in acting:
            gaps = np.broadcast_to(one.missed_by(first, last), len(cells))
            far = np.flatnonzero(gaps > 0.0)
            missed.setdefault(one.path, []).extend(zip(gaps[far].tolist(), cells[far].tolist(), strict=True))
    worst = [(path, max(found)[1], len(found)) for path, found in missed.items() if found]
    return [
        Shared(note, many)
        for path, cell, many in worst
        for note in unmet_notes(scenario_of(cell))
        if note.cause == never_met(path)
    ]


def acting_in(scenario: Scenario) -> tuple[Acting, ...]:
    """Return where the parts of a scenario act; what acts everywhere is left out, or has no ends."""
    return (*irregularities_acting(scenario), *deck_acting(Fields(scenario)), *_anomalies_acting(scenario))


def irregularities_acting(scenario: Scenario) -> Iterator[Acting]:
    """Return where the irregularities of a scenario act."""
    given, wheelsets = scenario.irregularity, _wheelsets(scenario.vehicle)
    for place, items in given.items() if isinstance(given, Placement) else [("", given)]:
        number, side = parsed_place(place) if place else (None, "both")
        below = slice(None) if number is None else slice(number - 1, number)
        everywhere = side == "both" and len(wheelsets[below]) == len(wheelsets)
        stands = _Stands(_free_heights(scenario)[below], isinstance(scenario.vehicle, Wagon), everywhere)
        for i, item in enumerate(items):
            path = ".".join(part for part in ("irregularity", place, str(i)) if part)
            yield _irregularity_acting(path, item, wheelsets[below], scenario.rolling, stands)


class _Stands(NamedTuple):
    """How wheelsets stand on a part of a scenario.

    Attributes
    ----------
    free
        (wheelsets, 2): between which heights, m, nothing against a fixed guide feels how high each stands.
    coupled
        Whether springs between bodies feel heights that differ.
    all_of_them
        Whether all wheels of the vehicle stand on it; others stand at zero.
    """

    free: FloatArray
    coupled: bool
    all_of_them: bool

    def feel(self, heights: FloatArray) -> NDArray[np.bool_]:
        """Return whether it changes the static state that they stand so high, (wheelsets, cells)."""
        outside = ((heights < self.free[:, :1]) | (heights > self.free[:, 1:])).any(axis=0)
        others = heights[:1] if self.all_of_them else 0.0
        return np.asarray(outside | (self.coupled & (heights != others).any(axis=0)))


def _irregularity_acting(
    path: str, item: Irregularity, wheels: list[tuple[float, float]], rolling: str, stands: _Stands
) -> Acting:
    radius = max(radius for _, radius in wheels)
    course = item.on_rail("left").course(radius)
    positions = tuple(position for position, _ in wheels)
    before, behind = _reach_of_circle(course, radius) if rolling == "circle" else (0.0, 0.0)
    starts, ends = (np.array(places)[:, None] for places in zip(*course.uneven, strict=True))
    hint = "; its field start moves the first sample" if isinstance(item, Measured) and item.start is None else ""

    def stood_on(first: FloatArray) -> NDArray[np.bool_]:
        return stands.feel(np.array([course.value(first + position) for position in positions]))

    return Acting(
        path, type(item).__name__, starts, ends, positions, course.period, course.repeats_from > -inf, before, behind,
        hint, stood_on,
    )  # fmt: skip


def _reach_of_circle(course: Course, radius: float) -> tuple[FloatArray | float, FloatArray | float]:
    """Return how far before and behind its uneven places a circle touches them, m.

    It meets a step up before its corner, and one down behind it; the wheel's centre jumps at an ideal one.
    """
    if course.followed or not course.height:
        return 0.0, 0.0
    around = sqrt(2.0 * radius * course.height)
    before, behind = (np.full((len(course.uneven), 1), around) for _ in range(2))
    for row, (a, b) in enumerate(
        zip(course.stretches[:-1], course.stretches[1:], strict=True), -len(course.stretches) + 1
    ):
        place = np.array([b.start])
        rise = float(b.value(place)[0] - a.value(place)[0])
        before[row], behind[row] = sqrt(2.0 * radius * max(rise, 0.0)), sqrt(2.0 * radius * max(-rise, 0.0))
    return before, behind


def deck_acting(value: Fields) -> Iterator[Acting]:
    """Return where the deck of a scenario, or of its cells, acts."""
    deck, wheels = value.scenario.track, tuple(position for position, _ in _wheelsets(value.scenario.vehicle))
    if isinstance(deck, FloatingDeck) and deck.start is not None:
        start = np.atleast_1d(value("track.start"))
        end = start + (inf if deck.length is None else value("track.length"))
        carried = wheels if deck.wheelset is None else wheels[deck.wheelset - 1 : deck.wheelset]
        yield Acting("track", type(deck).__name__, start[None], end[None], carried)


def _anomalies_acting(scenario: Scenario) -> Iterator[Acting]:
    """Return where the anomalies of a track act: at the seats, and as far as a wheel bends the rail down.

    On Winkler's foundation of the same stiffness per metre k that is 3π/4·(4·EI/k)^¼ (docs/theory/track.rst, section
    13.2).
    """
    track = scenario.track
    if not isinstance(track, SupportedRail):
        return
    section = section_of(track)
    beside = 0.75 * pi * (4.0 * section.bending * section.spacing / section.seat) ** 0.25
    for i, item in enumerate(track.anomalies):
        if item.places:
            seats = track.first_sleeper + track.spacing * np.array(item.places, dtype=float)[:, None]
            wheels = tuple(position for position, _ in _wheelsets(scenario.vehicle))
            yield Acting(
                f"track.anomalies.{i}", type(item).__name__, seats, seats, wheels, before=beside, behind=beside
            )


def _wheelsets(vehicle: Any) -> list[tuple[float, float]]:
    """Return the position at time zero of each wheelset and its radius, m."""
    if isinstance(vehicle, Wagon):
        return [(float(axle.position), float(axle.radius)) for axle in vehicle.axles]
    plane = vehicle.plane
    return [(float(x), float(one.radius)) for x, one in zip(plane.positions, plane.wheelsets, strict=True)]


def _free_heights(scenario: Scenario) -> FloatArray:
    """Return between which heights, m, nothing against a fixed guide feels how high wheelsets stand, (wheelsets, 2).

    On rails that bend springs have no force in the static state, however high the wheels stand.
    """
    vehicle = scenario.vehicle
    if isinstance(vehicle, Wagon):
        held = any(GROUND in element.between for element in vehicle.elements)
        return np.tile(0.0 if held else [-inf, inf], (len(vehicle.axles), 2 if held else 1))
    plane = vehicle.plane
    free = np.tile([-inf, inf], (len(plane.wheelsets), 1))
    if isinstance(scenario.track, SupportedRail):
        return free
    free[np.diag(plane.follows.T @ plane.stiffness @ plane.follows) > 0.0] = 0.0
    for element in plane.elements:
        if element.by_rate or not len(element.corners[0]):
            continue
        corners = np.asarray(element.corners[0])
        below, above = corners[corners < 0.0].max(initial=-inf), corners[corners > 0.0].min(initial=inf)
        on = np.flatnonzero(element.compression[: len(free)])
        free[on] = np.column_stack([np.maximum(free[on, 0], below), np.minimum(free[on, 1], above)])
    return free
