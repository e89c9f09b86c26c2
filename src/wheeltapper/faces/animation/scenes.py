"""From a record to its film: a wheel close up, wheels on a rail that gives way, or a wagon from the side."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.faces.animation.film import ASPECT, Disc, Film, Shape, in_words
from wheeltapper.faces.scenarios import heights_of, irregularities_by_place, places_along, wheel_at
from wheeltapper.ground.needs import BOGIE, DECK, FLEXIBLE_TRACK, POINT, SEVERAL_BODIES, WHEELSETS
from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
SAMPLES = 1600
"""Samples of a drawn force; every event and peak is among them."""
ARC, SURFACE = 121, 900
"""Points of a wheel's arc, and of a rail."""
PLACES, SEATS = 160, 60
"""Most places of a rail that gives way, and most seats, that are read."""
AHEAD, BAYS = 2.5, 3.0
"""What is seen of a track beside the vehicle: bays, and of a wagon's way m."""
SWING = 0.12
"""How far the largest displacement of a track or a wagon is drawn by default, m on the scale of lengths."""
RULER = 0.25
"""Most of the panel's height that the bar beside displacements takes."""
SLEEPER = 0.26
"""Width of a sleeper, m."""


class Interval:
    """The part of a run that is shown: its frames, and the history at them and at each sample of the force."""

    def __init__(self, record: Record, times: FloatArray, seconds: float, frames_per_second: float) -> None:
        self.record, self.scenario, self.times = record, record.scenario, times
        self.speed = float(record.scenario.speed)
        self.frames_per_second = frames_per_second
        start, stop = float(times[0]), float(times[-1])
        self.slowness = seconds / (stop - start)
        tables = (record.events.time.values, record.peaks.time.values)
        kinks = [table[(table >= start) & (table <= stop)] for table in tables]
        self.samples = np.unique(np.concatenate([np.linspace(start, stop, SAMPLES), *kinks]))
        self.shown = record.at(times)
        self.sampled = record.at(self.samples)

    @property
    def x(self) -> FloatArray:
        """Position of the leading wheelset in each frame, m."""
        return self.speed * self.times

    def losses(self) -> FloatArray:
        """Return when contact is lost and made again, s, (losses, 2): of several wheels of any of them."""
        start, stop = float(self.times[0]), float(self.times[-1])
        if SEVERAL_BODIES in self.scenario.needs:
            forces = self.sampled.normal_force.values.reshape(len(self.samples), -1)
            edges = np.flatnonzero(np.diff(np.pad((forces <= 0.0).any(axis=1).astype(int), 1)))
            spans = [(self.samples[a], self.samples[b - 1]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        else:
            spans = [span for contact in np.unique(self.record.events.contact) for span in self._losses_of(contact)]
        cut = np.array([(max(a, start), min(b, stop)) for a, b in spans]).reshape(-1, 2)
        return cut[cut[:, 1] > cut[:, 0]]

    def _losses_of(self, contact: int) -> list[tuple[float, float]]:
        """Return when one contact is lost and made again, s."""
        events = self.record.events
        kinds, times = (events[name].values[events.contact.values == contact] for name in ("kind", "time"))
        lost, met = times[kinds == "loss"].tolist(), times[kinds == "impact"].tolist()
        if met and (not lost or met[0] < lost[0]):
            lost = [0.0, *lost]  # it begins in the air
        return list(zip(lost, [*met, self.record.end][: len(lost)], strict=True))

    def forces(self) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the force of each wheel, (lines, samples), and what it is called."""
        force = self.sampled.normal_force.transpose("time", ...)
        lines = force.values.reshape(len(self.samples), -1).T
        if "side" in force.dims:
            names = [f"{wheelset} {side}" for wheelset in force.wheelset.values for side in force.side.values]
        else:
            names = (
                [f"wheelset {number}" for number in force.wheelset.values] if "wheelset" in force.dims else ["wheel"]
            )
        return lines, tuple(names)

    def film(
        self, shapes: list[Shape], discs: list[Disc], left: FloatArray, width: float, low: float, high: float,
        what: str, displaced: bool = False,
    ) -> Film:  # fmt: skip
        """Return the film of these shapes in this window; of `displaced` bodies only displacements are exaggerated."""
        forces, names = self.forces()
        factor = ASPECT * width / (high - low)
        pace = f"{in_words(self.slowness)} times slower" if self.slowness >= 1.0 else (
            f"{in_words(1.0 / self.slowness)} times faster"
        )  # fmt: skip
        exaggerated = "displacements" if displaced else "heights"
        scale = f"{exaggerated} {in_words(factor)} times larger than lengths" if factor > 1.05 else "true to scale"
        ruler = _round_down(RULER * (high - low)) if displaced else 0.0
        return Film(
            str(self.record), f"{what}: {pace}, {scale}", self.times, tuple(shapes), tuple(discs), left, width, low,
            high, self.samples, forces, names, self.record.static_force, self.losses(), self.frames_per_second, ruler,
        )  # fmt: skip


def film_of(interval: Interval, exaggeration: float | None) -> Film:
    """Return the film of a part of a run."""
    needs = interval.scenario.needs
    if SEVERAL_BODIES in needs:
        return _of_wagon(interval, exaggeration)
    if needs & {FLEXIBLE_TRACK, WHEELSETS, BOGIE}:
        return _of_track(interval, exaggeration)
    return _close_up(interval, exaggeration)


# -- a wheel close up -------------------------------------------------------------------------------------------------


def _close_up(interval: Interval, exaggeration: float | None) -> Film:
    """Return the place of contact, in which heights are far larger than lengths, so that gaps can be seen."""
    scenario, shown = interval.scenario, interval.shown
    (_, radius), x, y = wheel_at(scenario), interval.x, shown.wheel_displacement.values
    by_wheel = [item for item in scenario.irregularities if item.borne == "wheel"]
    by_rail = [item for item in scenario.irregularities if item.borne != "wheel"]
    deck = shown.deck_displacement.values if DECK in scenario.needs else np.zeros(len(x))
    rail_at_wheel = deck + heights_of(scenario, x, by_rail)
    low, high = float(min(y.min(), rail_at_wheel.min())), float(max(y.max(), rail_at_wheel.max()))
    reach = max(high - low, 2.0 * float(np.abs(shown.indentation.values).max()), 1e-6)
    low, high = low - 0.6 * reach, high + 0.9 * reach
    width = 2.0 * np.sqrt(2.0 * radius * (high - low)) / 0.7
    if exaggeration is not None:
        width = exaggeration * (high - low) / ASPECT
    along = places_along(scenario, float(x[0]) - width, float(x[-1]) + width, SURFACE)
    shapes = []
    rail = heights_of(scenario, along, by_rail)
    if DECK in scenario.needs:
        on_deck = _on_deck(scenario.track, along)
        for part, colour in ((on_deck, "deck"), (~on_deck, "rail")):
            shapes += _stretches(along, rail, part, colour, deck if colour == "deck" else None)
    else:
        shapes.append(Shape(along, rail, "rail", "below"))
    discs = []
    turn = x / radius
    if POINT in scenario.needs:
        discs.append(Disc(x, y, 0.16 * width, turn))
    else:
        u = np.linspace(-0.49, 0.49, ARC) * width
        u = u[np.abs(u) < 0.98 * radius]
        angle = np.arcsin(u / radius)
        if by_wheel:
            worn = np.array([heights_of(scenario, place + radius * angle, by_wheel) for place in x])
            arc = radius - (radius + worn) * np.cos(angle)
        else:
            arc = radius * (1.0 - np.cos(angle))
        shapes.append(Shape(u, arc, "wheel", "above", np.column_stack([x, y])))
    if scenario.speed == 0.0:
        x = np.zeros_like(x)
    what = "the wheel on the deck" if DECK in scenario.needs else "the wheel on the rail"
    return interval.film(shapes, discs, x - 0.5 * width, float(width), low, high, what)


def _on_deck(deck: Any, along: FloatArray) -> NDArray[np.bool_]:
    start = -np.inf if deck.start is None else float(deck.start)
    end = np.inf if deck.length is None else start + float(deck.length)
    return np.asarray((along >= start) & (along <= end))


def _stretches(
    along: FloatArray, rail: FloatArray, part: NDArray[np.bool_], colour: str, moved: FloatArray | None
) -> list[Shape]:
    """Return the stretches of a surface that belong to a part, which moves up and down."""
    shift = None if moved is None else np.column_stack([np.zeros_like(moved), moved])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], part, [False]]).astype(int)))
    pieces = zip(edges[::2], edges[1::2], strict=True)
    return [Shape(along[a:b], rail[a:b], colour, "below", shift) for a, b in pieces if b > a + 1]


# -- wheels on a track that gives way ---------------------------------------------------------------------------------


def _of_track(interval: Interval, exaggeration: float | None) -> Film:
    """Return wheels, rail and sleepers from the side; of a stiff track the wheels on a straight rail."""
    scenario, shown = interval.scenario, interval.shown
    positions = [float(place) for place in getattr(scenario.vehicle, "positions", (0.0,))]
    height = shown.wheel_displacement.transpose("time", ...).values.reshape(len(interval.times), -1)
    soft = FLEXIBLE_TRACK in scenario.needs
    beside = BAYS * float(scenario.track.spacing) if soft else AHEAD
    left = interval.x + min(positions) - beside
    width = max(positions) - min(positions) + 2.0 * beside
    largest = float(np.abs(height).max())
    readings = _readings(interval, float(left[0]), float(left[-1]) + width) if soft else None
    if readings is not None:
        largest = max(largest, float(np.nanmax(np.abs(readings.rail_displacement))))
    factor = exaggeration if exaggeration is not None else _round_down(SWING * width / 4.0 / max(largest, 1e-9))
    radii = [wheel_at(scenario, number)[1] for number in range(1, len(positions) + 1)]
    tall = ASPECT * width / factor
    low = -0.32 * tall
    shapes = [Shape(np.array([left[0], left[-1] + width]), np.zeros(2), "rail", "below")]
    if readings is not None:
        shapes = _track_shapes(interval, readings, factor)
    discs = [
        Disc(interval.x + place, height[:, number], radius, interval.x / radius)
        for number, (place, radius) in enumerate(zip(positions, radii, strict=True))
    ]
    what = "wheels, rail and sleepers" if soft else "wheels"
    return interval.film(shapes, discs, left, width, low, low + tall, what, displaced=True)


def _round_down(factor: float) -> float:
    """Return 1, 2 or 5 times a power of ten that is at most a factor."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= factor * (1.0 + 1e-9)))


def _readings(interval: Interval, first: float, last: float) -> Any:
    """Return what the rail and its seats do in each frame, between two places."""
    track, times = interval.scenario.track, interval.times
    spacing, origin = float(track.spacing), float(track.first_sleeper)
    seats = np.arange(np.ceil((first - origin) / spacing), np.floor((last - origin) / spacing) + 1)[:SEATS]
    places = np.linspace(first, last, min(PLACES, max(24, int(8 * (last - first) / spacing))))
    rate = (len(times) - 1) / (times[-1] - times[0])
    found = interval.record.track(rate, rail=places.tolist(), seat=[int(seat) for seat in seats])
    begin = round(float(times[0]) * rate)
    return found.isel(time=slice(begin, begin + len(times)))


def _track_shapes(interval: Interval, readings: Any, factor: float) -> list[Shape]:
    """Return the rail as a band on its sleepers; the heights of both are to the scale of lengths."""
    scenario, track = interval.scenario, interval.scenario.track
    x, rail = readings.rail.values, np.nan_to_num(readings.rail_displacement.values)
    if len(irregularities_by_place(scenario)) == 1:
        rail = rail + heights_of(scenario, x, [item for item in scenario.irregularities if item.borne != "wheel"])
    thick, gap, tall = 0.14 / factor, 0.1 / factor, 0.2 / factor
    band = np.concatenate([rail, rail[:, ::-1] - thick], axis=1)
    out = [Shape(np.concatenate([x, x[::-1]]), band, "rail", "inside")]
    corners = SLEEPER * np.array([-0.5, 0.5, 0.5, -0.5])
    box = -thick - gap - tall * np.array([0.0, 0.0, 1.0, 1.0])
    for number, seat in enumerate(readings.seat.values):
        shift = None
        if track.under_pads:
            moved = np.nan_to_num(readings.sleeper_displacement.isel(seat=number).values)
            shift = np.column_stack([np.zeros_like(moved), moved])
        place = float(track.first_sleeper) + float(track.spacing) * float(seat)
        out.append(Shape(place + corners, box, "sleeper", "inside", shift))
    return out


# -- wagons -----------------------------------------------------------------------------------------------------------


def _of_wagon(interval: Interval, exaggeration: float | None) -> Film:
    """Return a wagon from the side, its bodies displaced from where they stood at first."""
    wagon, shown = interval.scenario.vehicle, interval.shown
    displaced = shown.displacement - shown.displacement.isel(time=0)
    boxes = wagon.boxes
    names = [str(name) for name in shown.body.values]
    moved = {name: displaced.sel(body=name) for name in names}
    largest = max(float(np.abs(one.sel(motion="z")).max()) for one in moved.values())
    low_x = min(centre[0] - edges[0] / 2 for centre, edges in boxes.values()) - 1.0
    high_x = max(centre[0] + edges[0] / 2 for centre, edges in boxes.values()) + 1.0
    width = float(high_x - low_x)
    factor = exaggeration if exaggeration is not None else _round_down(3.0 * SWING / max(largest, 1e-9))
    left = interval.x + low_x
    tall = ASPECT * width / factor
    low = -0.12 * tall
    shapes = [Shape(np.array([left[0], left[-1] + width]), np.zeros(2), "rail", "below")]
    discs = []
    for name, (centre, edges) in boxes.items():
        up, pitch = (moved[name].sel(motion=motion).values for motion in ("z", "pitch"))
        if name.startswith("wheelset "):
            radius = 0.5 * float(edges[0])
            discs.append(Disc(interval.x + centre[0], up, radius, interval.x / radius))
            continue
        across = 0.5 * float(edges[0]) * np.array([-1.0, 1.0, 1.0, -1.0])
        height = (float(centre[2]) + 0.5 * float(edges[2]) * np.array([-1.0, -1.0, 1.0, 1.0])) / factor
        y = height + up[:, None] - pitch[:, None] * across
        x = np.broadcast_to(interval.x[:, None] + centre[0] + across, y.shape)
        shapes.append(Shape(x, y, "body", "inside"))
    return interval.film(shapes, discs, left, width, low, low + tall, "the wagon from the side", displaced=True)
