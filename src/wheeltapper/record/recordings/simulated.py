"""What sensors would have recorded of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensor.along import FARTHEST_SEAT, AlongTrack, AtSeat
from wheeltapper.describe.sensor.base import FilteredSensor, Seen, Sensor
from wheeltapper.describe.site import Site, as_any_site
from wheeltapper.describe.vehicle.element import Element, Spring
from wheeltapper.ground.arguments import as_count, as_list
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import DECK, FLEXIBLE_TRACK
from wheeltapper.lower import extent
from wheeltapper.record.assessment.filtering import oversampled, recorded
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.track import track

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
SAME_PLACE = 1e-6
"""Largest distance between a stated place and a seat of the run's track, m."""
COLUMNS = 16
"""Numbers in memory for each sample, at least."""
ACCELERATIONS = "rail_acceleration", "sleeper_acceleration"
"""Variables of `Record.track` that cost more than the others."""
ON_WHEELS = ("vertical_force", "normal_force", "wheel_acceleration", "acceleration")
"""Variables of `Record.at` that sensors read; the others are not kept."""


def recordings(record: Record, sensors: Any, seed: int | None = None) -> dict[str, Recording]:
    """Return what sensors would have recorded of a run; see `Record.recordings`."""
    listed, spacing = listed_sensors(record, sensors)
    seed = None if seed is None else as_count(seed, "seed", 0)
    track = record.scenario.track
    if spacing is not None and FLEXIBLE_TRACK in record.scenario.needs and abs(spacing - track.spacing) > SAME_PLACE:
        raise InputError("", "spacing", f"{spacing:g} m", f"{track.spacing:g} m, the distance of the run's seats")
    out: dict[str, Recording] = {}
    for rate in dict.fromkeys(sensor.rate for sensor in listed.values()):
        own = {name: sensor for name, sensor in listed.items() if sensor.rate == rate}
        along = [sensor for sensor in own.values() if isinstance(sensor, AlongTrack)]
        filtered = any(isinstance(sensor, FilteredSensor) and sensor.anti_alias for sensor in own.values())
        most = oversampled(rate) * rate if filtered else rate
        extent.check_samples("rate", f"{rate:g} per second", record.end * most + 1.0, COLUMNS)
        run = _Run(record, float(rate), along, spacing)
        for name, sensor in own.items():
            with _named(name, len(listed) > 1):
                run.check_seat(sensor)
        for name, sensor in own.items():
            with _named(name, len(listed) > 1):
                samples, clipped = sensor.samples(_SeenBy(run, sensor, _random(name, seed)))
            out[name] = Recording(
                samples, float(rate), sensor.quantity, clipped=clipped, speed=float(record.scenario.speed),
                source=f"simulated: {name}",
            )  # fmt: skip
    return {name: out[name] for name in listed}


@contextmanager
def _named(name: str, several: bool) -> Iterator[None]:
    """Let a refusal say which of several sensors it is about."""
    try:
        yield
    except InputError as error:
        raise error.within(f"sensors.{name}") if several else error from None


def _random(name: str, seed: int | None) -> np.random.Generator | None:
    """Return what draws a sensor's noise, which is the same whatever other sensors there are."""
    return None if seed is None else np.random.default_rng([seed, crc32(name.encode())])


def listed_sensors(record: Record, sensors: Any) -> tuple[dict[str, Sensor], float | None]:
    """Return sensors by the names of their recordings, and the distance of a site's seats, m.

    Of a site those along the track; that of the deck, where there is one, in front.
    """
    spacing = None
    if isinstance(sensors, str | Path):
        sensors = as_any_site(sensors)
    if isinstance(sensors, Site):
        shown = sensors.all_sensors
        given = [one for one in shown if DECK in record.scenario.needs or isinstance(one, AlongTrack)]
        spacing = sensors.spacing
    else:
        given = [sensors] if isinstance(sensors, Sensor) else as_list(sensors, "sensors", "a Site or sensors")
    out: dict[str, Sensor] = {}
    for number, one in enumerate(given):
        if not isinstance(one, Sensor):
            raise InputError("", f"sensors.{number}", value_text(one), "a sensor, as wt.sensors.PadForce(seat=3)")
        name = one.channel
        if name in out:
            raise InputError("", f"sensors.{number}.name", f"a second {name!r}", "names that differ")
        out[name] = one
    if not out:
        raise InputError("", "sensors", "none", "a Site with sensors, or one or more sensors")
    return out, spacing


class _Run:
    """A run as sensors of one rate see it: what the track does is read once, for all of them."""

    def __init__(self, record: Record, rate: float, along: Sequence[AlongTrack], spacing: float | None) -> None:
        self.record, self.rate, self.along, self.spacing = record, rate, along, spacing
        self._tracks: dict[bool, xr.Dataset] = {}

    @cached_property
    def times(self) -> FloatArray:
        """Of the samples, s."""
        return np.arange(int(np.floor(self.record.end * self.rate * (1.0 + 1e-12))) + 1) / self.rate

    @cached_property
    def finer(self) -> _Run:
        """The same run as a recorder's filter takes it."""
        return _Run(self.record, oversampled(self.rate) * self.rate, self.along, self.spacing)

    def seat_of(self, sensor: AtSeat) -> int:
        """Return the number of the seat at which a sensor is; a site counts seats from x = 0, a run from its first."""
        if sensor.seat is not None and self.spacing is None:
            return sensor.seat
        track, (x, _) = self.record.scenario.track, sensor.extent(self.spacing)
        seat = round((x - float(track.first_sleeper)) / float(track.spacing))
        nearest = float(track.first_sleeper) + seat * float(track.spacing)
        field, found = ("x", f"{x:.9g} m") if sensor.seat is None else ("seat", f"{sensor.seat}, at {x:.9g} m")
        if not abs(nearest - x) <= SAME_PLACE or abs(seat) > FARTHEST_SEAT:
            raise InputError("", field, f"{found}, where no seat is", f"a seat's place; the nearest is {nearest:.9g} m")
        return seat

    def check_seat(self, sensor: Sensor) -> None:
        """Refuse a place at which the run's track has no seat."""
        if isinstance(sensor, AtSeat) and FLEXIBLE_TRACK in self.record.scenario.needs:
            self.seat_of(sensor)

    def track(self, accelerations: bool) -> xr.Dataset:
        """Return what the track does at the places of all sensors, at least without accelerations."""
        if FLEXIBLE_TRACK not in self.record.scenario.needs:
            kind = type(self.record.scenario.track).__name__
            raise InputError("", "track", f"a {kind}, of which nothing is read", "rails on sleepers or on a slab")
        if True not in self._tracks and accelerations not in self._tracks:
            places = {x for sensor in self.along for x in sensor.rail_places}
            seats = {self.seat_of(sensor) for sensor in self.along if isinstance(sensor, AtSeat)}
            self._tracks[accelerations] = track(self.record, self.rate, sorted(places), sorted(seats), accelerations)
        return self._tracks[True in self._tracks]

    @cached_property
    def wheels(self) -> xr.Dataset:
        """Forces and accelerations of the wheels, N and m/s²; of a wagon the accelerations of all bodies."""
        found = self.record.at(self.times)
        return found[[name for name in ON_WHEELS if name in found]]

    @cached_property
    def forces(self) -> xr.DataArray:
        """Vertical forces of the wheels of one rail, N."""
        both = self.record._contacts.has_sides
        return self.wheels["vertical_force"] if both else wheel_forces(self.record, self.times)

    def axle_box_acceleration(self, wheelset: int, side: str | None) -> FloatArray:
        """Return a wheelset's vertical acceleration at an axle box, m/s² upwards; of a wagon z̈ + y·φ̈ (small roll φ)."""
        count = self.record._contacts.wheelsets
        if wheelset > count:
            allowed = f"1 to {count}, the wheelsets of the run" if count > 1 else "1, the only wheelset of the run"
            raise InputError("", "wheelset", str(wheelset), allowed)
        if "wheel_acceleration" in self.wheels:
            found = self.wheels["wheel_acceleration"]
            return np.asarray(found.sel(wheelset=wheelset) if "wheelset" in found.dims else found)
        if side is None:
            raise InputError("", "side", "none, of a run in which the sides differ", '"left" or "right"')
        name = f"wheelset {wheelset}"
        found = self.wheels["acceleration"].sel(body=name)
        y = _axle_box_place(self.record.scenario.vehicle.elements, name, side)
        return np.asarray(found.sel(motion="z") + y * found.sel(motion="roll"))


def wheel_forces(record: Record, times: FloatArray) -> xr.DataArray:
    """Return the vertical forces of the wheels of one rail at rising times, N; of a wagon those of both, over side."""
    import xarray as xr

    if record._contacts.has_sides:
        return record.at(times)["vertical_force"]
    found = record._lowered.forces(record._march, times)
    return xr.DataArray(found / float(record.scenario.vehicle.plane.rails), dims=("time", "contact"))


def _axle_box_place(elements: Sequence[Element], wheelset: str, side: str) -> float:
    """Return how far left of the middle a wheelset's axle box is, m: where springs hold it, in the mean."""
    springs = [one for one in elements if isinstance(one, Spring) and wheelset in one.between]
    places = [float(one.at[1]) for one in springs if (one.at[1] > 0.0 if side == "left" else one.at[1] < 0.0)]
    if not places:
        raise InputError(
            "", "side", f"{side!r}, where no spring holds {wheelset}", "a side with a spring at the axle box"
        )
    return float(np.mean(places))


class _SeenBy:
    """What a run shows to one sensor (`describe.sensor.base.Seen`)."""

    def __init__(self, run: _Run, sensor: Sensor, random: np.random.Generator | None) -> None:
        self._run, self._sensor, self._random = run, sensor, random

    @property
    def times(self) -> FloatArray:
        """Of the samples, s."""
        return self._run.times

    def _of_its_rail(self, found: xr.DataArray) -> xr.DataArray:
        """Return what is of the sensor's rail, where a run tells the rails apart."""
        if "side" not in found.dims:
            return found
        side = getattr(self._sensor, "side", None)
        if side is None:
            raise InputError("", "side", "none, of a run in which the rails differ", '"left" or "right"')
        return found.sel(side=side)

    def at_places(self, name: str) -> FloatArray:
        """Return a variable of `Record.track` at the sensor's `rail_places`, or at its seat, (places, times)."""
        track = self._run.track(name in ACCELERATIONS)
        if name not in track:
            found = f"{self._sensor.kind!r} on a {type(self._run.record.scenario.track).__name__}"
            raise InputError("", "kind", found, f"a kind that its track shows, which has no {name}")
        read, sensor = self._of_its_rail(track[name]), self._sensor
        if isinstance(sensor, AtSeat):
            read = read.sel(seat=[self._run.seat_of(sensor)])
        elif isinstance(sensor, AlongTrack):
            read = read.sel(rail=list(sensor.rail_places))
        return np.asarray(read.transpose(..., "time"))

    def force_between(self, x1: float, x2: float) -> FloatArray:
        """Return the forces of the wheels that are between two places, N, (times,)."""
        forces, scenario = self._of_its_rail(self._run.forces), self._run.record.scenario
        each = np.asarray(forces).reshape(len(self.times), -1)
        contacts = self._run.record._contacts
        x = np.add.outer(float(scenario.speed) * self.times, contacts.position[:: contacts.sides])
        return np.asarray(np.where((x1 <= x) & (x <= x2), each, 0.0).sum(axis=1))

    def deck_acceleration(self, times: FloatArray) -> FloatArray:
        """Return the deck's acceleration, m/s² upwards, at times."""
        if DECK not in self._run.record.scenario.needs:
            kind = type(self._run.record.scenario.track).__name__
            raise InputError("", "kind", f"{self._sensor.kind!r} on a {kind}", "sensors along the track")
        return np.asarray(self._run.record._variables_at(times)["deck_acceleration"][1])

    def axle_box_acceleration(self, wheelset: int) -> FloatArray:
        """Return a wheelset's acceleration at its axle box on the sensor's side, m/s² upwards, (times,)."""
        return self._run.axle_box_acceleration(wheelset, getattr(self._sensor, "side", None))

    def white_noise(self, count: int) -> FloatArray:
        """Return samples of white noise of unit variance; zeros without a seed."""
        return np.zeros(count) if self._random is None else self._random.standard_normal(count)

    def behind_filter(self, read: Callable[[Seen], FloatArray], cutoff: float | None) -> FloatArray:
        """Return what `read` gives of a run, (times,), behind the filter of a recorder with this cut-off, Hz."""
        if cutoff is None:
            return np.asarray(read(self), dtype=float)
        fine = read(_SeenBy(self._run.finer, self._sensor, self._random))
        return recorded(np.asarray(fine, dtype=float), self._run.rate, cutoff, oversampled(self._run.rate))
