"""Derivatives of what sensors read of a run, over time, with respect to fields of the scenario and of the sensors.

Readings are linear in what a run shows. Where its march has tangents, their derivatives are the readings of the run's
change; elsewhere they are differences of runs. The reading of a pair of gauges jumps where a wheel passes one of them.
Its derivative there is an impulse, which two samples share, before the recorder's filter if there is one.

Theory: docs/theory/maps.rst, section 9.7.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.changes import changes_of
from wheeltapper.ask.differences import Slope, slope_at
from wheeltapper.ask.finer import FinerRun, finer_run
from wheeltapper.ask.gradient_by_differences import CORNER, OTHER_ORDER
from wheeltapper.ask.study import check_differentiable, field_unit, unit_of
from wheeltapper.describe.paths import held_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensitivity import QUANTITIES
from wheeltapper.describe.sensor.along import AtSeat, BetweenPlaces
from wheeltapper.describe.sensor.base import FilteredSensor, Sensor
from wheeltapper.describe.site import Site
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.warned import warn_caller
from wheeltapper.lower.fields import Fields
from wheeltapper.march.common.blocks import core_count
from wheeltapper.record.arguments import check_method
from wheeltapper.record.assessment.filtering import oversampled, recorded
from wheeltapper.record.record import Record
from wheeltapper.record.recordings.simulated import listed_sensors, recordings, wheel_forces
from wheeltapper.record.simulate import side_by_side, simulated_scenario

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
OF_SENSORS = "sensors."
"""Before the name of a sensor in a path of one of its fields."""
NEAR = 0.02
"""Sensors are moved by parts of this length, m, to differentiate with respect to their places."""
SI_UNITS = {"force": "N", "acceleration": "m/s^2", "length": "m", "strain": ""}
TAKEN = ("time", "parameter", "value")
"""Names that no variable of a reading may have."""
Sensors = Site | Sensor | Sequence[Sensor]


def are_sensors(given: Any) -> bool:
    """Return whether sensors, or a site with sensors, are given."""
    return isinstance(given, Site | Sensor) or (
        isinstance(given, Sequence) and not isinstance(given, str) and any(isinstance(one, Sensor) for one in given)
    )


class _Passing(NamedTuple):
    """A wheel at an end of a sensor: when, s, by how much the reading rises, and which end and wheel."""

    time: float
    rise: float
    end: str
    wheel: int


class _Readings:
    """Readings of a run and, filled in by and by, their derivatives and the errors of these."""

    def __init__(self, record: Record, given: Sensors, parameters: Sequence[str]) -> None:
        listed, spacing = listed_sensors(record, given)
        found = recordings(record, given)
        self.record, self.parameters = record, list(parameters)
        self.sensors = {name: _by_its_place(sensor, spacing) for name, sensor in listed.items()}
        self.samples = np.array([one.samples for one in found.values()])
        self.clipped = np.array([one.clipped for one in found.values()])
        self.rate = float(next(iter(listed.values())).rate)
        self.units = [SI_UNITS[QUANTITIES[one.quantity]] for one in found.values()]
        shape = len(self.parameters), *self.samples.shape
        self.slopes, self.errors = np.full(shape, np.nan), np.zeros(shape)

    @property
    def linear(self) -> list[Sensor]:
        """The sensors, named, without what is not linear."""
        return [sensor.linear.model_copy(update={"name": name}) for name, sensor in self.sensors.items()]

    def missing(self, number: int) -> NDArray[np.bool_]:
        """Return which sensors have readings without a derivative by a parameter."""
        return np.asarray((np.isnan(self.slopes[number]) & np.isfinite(self.samples)).any(axis=1))

    def passings(self, sensor: Sensor) -> Iterator[_Passing]:
        """Return when wheels pass the ends of a sensor."""
        speed, contacts = float(self.record.scenario.speed), self.record._contacts
        if not isinstance(sensor, BetweenPlaces) or speed == 0.0:
            return
        for end, sign in (("x1", 1.0), ("x2", -1.0)):
            for wheel, x in enumerate(contacts.position[:: contacts.sides].tolist()):
                time = (float(getattr(sensor, end)) - x) / speed
                if 0.0 < time < self.record.end:
                    forces = wheel_forces(self.record, np.array([time]))
                    own = forces.sel(side=sensor.side) if "side" in forces.dims else forces
                    yield _Passing(time, sign * sensor.gain * float(np.ravel(own)[wheel]), end, wheel)

    def add_impulse(self, number: int, row: int, passing: _Passing, later: float) -> None:
        """Add what a reading's jump adds to its derivative: it comes `later`, s, by a parameter's unit."""
        sensor = [*self.sensors.values()][row]
        cutoff = sensor.cutoff(self.rate) if isinstance(sensor, FilteredSensor) else None
        finer = 1 if cutoff is None else oversampled(self.rate)
        impulse = np.zeros(finer * self.samples.shape[1] + 1)
        place = passing.time * self.rate * finer
        first = int(place)
        impulse[first : first + 2] = np.array([first + 1.0 - place, place - first]) * self.rate * finer
        found = impulse[:-1] if cutoff is None else recorded(impulse[:-1], self.rate, cutoff, finer)
        self.slopes[number, row] -= passing.rise * later * found


def reading_gradients(scenario: Scenario, given: Sensors, parameters: Sequence[str], method: str) -> xr.Dataset:
    """Return readings of a run and their derivatives, as `wheeltapper.gradient` does for sensors."""
    check_method(method)
    of_scenario = [path for path in parameters if not path.startswith(OF_SENSORS)]
    for path in of_scenario:
        check_differentiable(scenario, path)
        if path == "duration":
            raise InputError("", path, "it, on which no reading at a given time depends", "another field")
    record = simulated_scenario(scenario, method)
    rates = {float(one.rate) for one in listed_sensors(record, given)[0].values()}
    if len(rates) > 1:
        raise InputError("", "rate", f"sensors of {len(rates)} rates", "one rate for all of them")
    readings = _Readings(record, given, parameters)
    if taken := [name for name in readings.sensors if name in TAKEN]:
        raise InputError("", "name", repr(taken[0]), f"another name than {', '.join(TAKEN)}")
    for path, change in changes_of(record, of_scenario).items():
        found = recordings(change, readings.linear)
        readings.slopes[_at(readings, path)] = [one.samples for one in found.values()]
    for number, path in enumerate(readings.parameters):
        if path not in of_scenario:
            _differentiate_sensor(readings, number)
    moved = _differentiate_runs(readings, [path for path in of_scenario if readings.missing(_at(readings, path)).any()])
    readings.slopes[:, readings.clipped] = 0.0
    for path in of_scenario:
        _add_impulses(readings, path, moved.get(path))
    return _dataset(readings)


def _at(readings: _Readings, path: str) -> int:
    return readings.parameters.index(path)


def _by_its_place(sensor: Sensor, spacing: float | None) -> Sensor:
    """Return a sensor of a site, which counts seats from x = 0, by its place; any other as it is."""
    if spacing is None or not isinstance(sensor, AtSeat) or sensor.seat is None:
        return sensor
    return sensor.model_copy(update={"x": sensor.extent(spacing)[0], "seat": None})


# -- fields of sensors ------------------------------------------------------------------------------------------------


def _of_sensor(readings: _Readings, path: str) -> tuple[int, str, float] | None:
    """Return a sensor's number, its field and what stands there; None for a path of the scenario's own."""
    if not path.startswith(OF_SENSORS):
        return None
    rest = path.removeprefix(OF_SENSORS)
    for row, (name, sensor) in enumerate(readings.sensors.items()):
        field = rest.removeprefix(f"{name}.")
        if field == rest:
            continue
        try:
            _, _, value = held_at(sensor, field)
        except InputError as error:
            raise error.within(f"{OF_SENSORS}{name}") from None
        if isinstance(value, bool) or not isinstance(value, float):
            raise InputError("", path, value_text(value), "a field that holds a quantity")
        return row, field, value
    raise InputError("", path, "no such sensor", with_suggestion(rest.partition(".")[0], readings.sensors))


def _differentiate_sensor(readings: _Readings, number: int) -> None:
    """Differentiate readings with respect to a field of a sensor: only its own depend on it, and no run is made."""
    path = readings.parameters[number]
    asked = _of_sensor(readings, path)
    assert asked is not None
    row, field, value = asked
    sensor = [*readings.sensors.values()][row]
    if field == "rate":
        raise InputError("", path, "the rate, with which the times of readings change", "another field")
    if isinstance(sensor, AtSeat) and field == "x":
        raise InputError("", path, "the place of a seat, which stays where it is", "another field")
    begin = value - NEAR if field in sensor.place_words.split() else 0.0

    def beside(number: float) -> FloatArray:
        changed = type(sensor).model_validate(sensor.model_dump() | {field: begin + number})
        return next(iter(recordings(readings.record, changed).values())).samples

    slope = slope_at(beside, readings.samples[row], value - begin, rows=True)
    if slope.refusal:
        raise InputError("", path, f"a field that cannot be changed: {slope.refusal}", "another field")
    readings.slopes[number] = np.where(np.isnan(readings.samples), np.nan, 0.0)
    readings.slopes[number, row], readings.errors[number, row] = slope.value, slope.error
    for passing in readings.passings(sensor):
        if passing.end == field:
            readings.add_impulse(number, row, passing, 1.0 / float(readings.record.scenario.speed))


# -- differences of runs ----------------------------------------------------------------------------------------------


def _differentiate_runs(readings: _Readings, paths: list[str]) -> dict[str, FloatArray]:
    """Differentiate, by runs, readings of which no tangents tell it; return how wheels move along the track, m.

    These are the derivatives of their positions.
    """
    if not paths:
        return {}
    scenario, linear = readings.record.scenario, readings.linear

    def read(record: Record) -> FloatArray:
        return np.array([one.samples for one in recordings(record, linear).values()])

    base = finer_run(scenario, read)

    def differentiate(path: str) -> tuple[Slope, FloatArray]:
        at, places = float(Fields(scenario)(path)), dict[float, FloatArray]()

        def beside(value: float) -> FloatArray | None:
            found = finer_run(scenario.replaced({path: value}), read)
            places[value] = found.lowered.contacts.position
            return found.values if _continues(found, base) else None

        slope = slope_at(beside, base.values, at, rows=True)
        most, least = max(places, default=at), min(places, default=at)
        moves = (places[most] - places[least]) / (most - least) if most > least else np.zeros(1)
        return slope, moves

    moved = dict[str, FloatArray]()
    for path, (slope, moves) in zip(
        paths, side_by_side(differentiate, paths, min(core_count(), len(paths)), lambda: None), strict=True
    ):
        number = _at(readings, path)
        missing = readings.missing(number)
        readings.slopes[number, missing], readings.errors[number, missing] = slope.value[missing], slope.error[missing]
        moved[path] = moves
        if np.isnan(slope.value[missing]).all():
            why = f"it cannot be changed: {slope.refusal}" if slope.refusal else OTHER_ORDER
            why = CORNER if slope.at_corner.all() else why
            warn_caller(f"readings have no derivative by {path} (NaN): {why}")
    return moved


def _continues(found: FinerRun, base: FinerRun) -> bool:
    return found.happened == base.happened and found.values.shape == base.values.shape


def _add_impulses(readings: _Readings, path: str, moved: FloatArray | None) -> None:
    """Add what jumps of readings add to their derivatives by a field that moves them in time."""
    if path != "speed" and (moved is None or not moved.any()):
        return
    speed = float(readings.record.scenario.speed)
    sides = readings.record._contacts.sides
    for row, sensor in enumerate(readings.sensors.values()):
        for passing in readings.passings(sensor):
            later = -passing.time / speed if path == "speed" else 0.0
            if moved is not None and moved.any():
                later -= float(moved[::sides][passing.wheel]) / speed
            readings.add_impulse(_at(readings, path), row, passing, later)


# -- as a dataset -----------------------------------------------------------------------------------------------------


def _dataset(readings: _Readings) -> xr.Dataset:
    import xarray as xr

    scenario, parameters = readings.record.scenario, readings.parameters
    held, units = [], []
    for path in parameters:
        asked = _of_sensor(readings, path)
        if asked is None:
            held.append(float(Fields(scenario)(path)))
            units.append(unit_of(scenario, path))
        else:
            row, field, value = asked
            held.append(value)
            units.append(field_unit(type([*readings.sensors.values()][row]), field))
    times = np.arange(readings.samples.shape[1]) / readings.rate
    data: dict[str, Any] = {}
    for row, (name, sensor) in enumerate(readings.sensors.items()):
        of = {"units": readings.units[row], "long_name": f"reading of a sensor: {sensor.kind}"}
        per = {"units": readings.units[row], "parameter_units": json.dumps(units)}
        data[name] = "time", readings.samples[row], of
        along = "parameter", "time"
        data[f"{name}_gradient"] = (
            along, readings.slopes[:, row], per | {"long_name": f"derivative of {name}; per unit of the parameter"}
        )  # fmt: skip
        data[f"{name}_gradient_error"] = (
            along, readings.errors[:, row], per | {"long_name": f"probable error of {name}_gradient; 0 if it is exact"}
        )  # fmt: skip
    return xr.Dataset(
        data, {"time": ("time", times, {"units": "s"}), "parameter": parameters, "value": ("parameter", held)}
    )  # fmt: skip
