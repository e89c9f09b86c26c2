"""The description of a data set: a scenario, what is drawn in it, faults, sensors, and how many passages."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import ConfigDict, Field, SerializeAsAny, field_validator, model_validator

from wheeltapper.ask.spec import file_digests, flattened_tables, scenario_in
from wheeltapper.ask.study import field_at, unit_of, value_in_si
from wheeltapper.describe.noun import Length, Noun, PositiveLength, Share
from wheeltapper.describe.scenario import Scenario, toml_table
from wheeltapper.describe.sensitivity import QUANTITIES
from wheeltapper.describe.sensor.along import AlongTrack
from wheeltapper.describe.sensor.base import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.dataset.draw import Draw, draw_of
from wheeltapper.diagnosis.faults.base import Fault, fault_named
from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.site.neighbours import Condition, ends_of
from wheeltapper.ground.arguments import as_path, as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.record.arguments import check_method
from wheeltapper.record.features import Feature, named

OWN = "vehicle."
"""First part of the paths that are drawn for each vehicle; all others are drawn once for a passage."""
OF_SENSORS = "sensors."
"""First part of the paths of sensors: "sensors.left 1.gain"."""
RESERVED = ("passage", "vehicle", "time", "part", "fault", "size", "place", "distance", "status", "wheelset", "side")
"""Names of variables that every data set may have; no sensor and no feature may have one of them."""
PARTS = {"train": 0.8, "validation": 0.1, "test": 0.1}
"""Shares of the parts of a data set, unless others are given."""


def _complete_schema(schema: dict[str, Any]) -> None:
    """Say in the schema what a file may hold: tables of sensors or the path of a site, and the path of a scenario."""
    fields = schema["properties"]
    del fields["contents"]
    one = fields["sensors"]["items"]
    fields["scenario"] = {"anyOf": [fields["scenario"], {"type": "string"}]}
    fields["sensor"] = {"anyOf": [one, {"type": "array", "items": one}], "description": "A sensor, or several."}
    fields["sensors"] = {"anyOf": [{"type": "array", "items": one}, {"type": "string"}]}
    schema["required"].remove("sensors")
    schema["anyOf"] = [{"required": ["sensor"]}, {"required": ["sensors"]}]


class FaultShare(Noun):
    """How often a fault is drawn, and how large it is.

    Parameters
    ----------
    share
        How often it is drawn, compared with the shares of the other faults.
    size
        One size, or a range (low, high) in which it is drawn uniformly; lengths may have a unit. None: the usual size.
    place
        Place on the wheel's circumference, 0 to 1; None: drawn uniformly.
    """

    _needs_type = False

    share: Annotated[float, Field(gt=0.0)] = 1.0
    size: Any = None
    place: Share | None = None


class Row(NamedTuple):
    """A variable of a data set that is drawn: the path of its field, from what, its unit, and whether per vehicle."""

    path: str
    draw: Draw
    unit: str
    per_vehicle: bool


class DatasetPlan(Noun):
    """What a data set of labelled passages holds.

    Parameters
    ----------
    scenario
        Any vehicle on any track; in a file also the path of a scenario.
    sensors
        Sensors that the run shows; in a file tables `[[sensor]]`, or the path of a site, whose sensors they are.
    faults
        Faults by name, with how often and how large they are; "healthy" is none. Faults that are irregularities of a
        tread are on a drawn wheel of a vehicle that has several; others need a vehicle with one wheelset.
    count
        Number of passages. Passage n does not depend on it.
    vary
        Fields by path, and from what their values are drawn: a list of values, {from, to, spacing} (uniform, or
        uniform in the logarithm), or {mean, deviation} (normal, cut at 4 deviations). "sensors.NAME.gain" and the like
        are fields of a sensor. Fields of the vehicle are drawn for each vehicle.
    vehicles
        Distances of vehicles behind the first one, m: a train. Each is simulated alone, and readings are superposed.
        This holds for sensors along rails; distances are rounded to what a vehicle runs in one sample.
    way
        The run ends when the vehicle has run this far, m, instead of at the scenario's `duration`.
    noise
        Standard deviation of the white noise of each sample, by the name of a sensor along the track, in its unit.
    features
        Features of the run that become labels.
    parts
        Shares of the parts; each passage is drawn into one of them.
    seed, method
        Seed of all random numbers, and the method of the runs.
    chunk
        Passages in a chunk, which is written at once; by default some seconds of work.
    name, creator, licence
        For the card and the attributes.
    contents
        Digests of the files that the scenario names, so that a changed file is noticed; written by `from_toml`.
    """

    _needs_type = False

    model_config = ConfigDict(json_schema_extra=_complete_schema)

    scenario: Scenario
    sensors: tuple[SerializeAsAny[Sensor], ...]
    faults: dict[str, FaultShare]
    count: Annotated[int, Field(ge=1)] = 1000
    vary: dict[str, Any] = Field(default_factory=dict)
    vehicles: tuple[Length, ...] = (0.0,)
    way: PositiveLength | None = None
    noise: dict[str, Any] = Field(default_factory=dict)
    features: tuple[Any, ...] = ("largest_force", "number_of_impacts")
    parts: dict[str, Annotated[float, Field(gt=0.0)]] = Field(default_factory=lambda: dict(PARTS))
    seed: Annotated[int, Field(ge=0)] = 0
    method: str = "default"
    chunk: Annotated[int, Field(ge=1)] | None = None
    name: str = ""
    creator: str = ""
    licence: str = "CC-BY-4.0"
    contents: dict[str, str] = Field(default_factory=dict)

    @field_validator("vary", mode="before")
    @classmethod
    def _flatten(cls, value: Any) -> Any:
        return flattened_tables(value, ("from", "mean")) if isinstance(value, dict) else value

    @model_validator(mode="after")
    def _check(self) -> DatasetPlan:
        check_method(self.method)
        names = [one.channel for one in self.sensors]
        if not names:
            raise InputError("", "sensor", "none", "at least one sensor")
        for name in names:
            if names.count(name) > 1:
                raise InputError("", "sensor", f"{names.count(name)} with the name {name!r}", "names that differ")
        if not self.faults:
            raise InputError("", "faults", "none", '"healthy", or at least one fault')
        if not self.parts:
            raise InputError("", "parts", "none", "at least one part with its share")
        self._check_row()
        self._check_names(names)
        _ = self.noises, self.conditions  # which refuse what is wrong
        self._check_ends()
        return self

    def _check_names(self, sensors: list[str]) -> None:
        """Refuse two variables of one name."""
        taken = set(RESERVED)
        named = [("sensor", name) for name in sensors]
        named += [("features", one.name) for one in self.labels]
        named += [("vary", row.path) for row in self.rows]
        for field, name in named:
            if name in taken:
                raise InputError("", field, f"the name {name!r}, which another variable has", "another name")
            taken.add(name)

    def _check_row(self) -> None:
        """Refuse distances that are none, and sensors that do not read a sum of vehicles."""
        away = [float(one) for one in self.vehicles]
        if not away or away[0] != 0.0 or any(b <= a for a, b in zip(away, away[1:], strict=False)):
            raise InputError("", "vehicles", value_text(self.vehicles), "distances in m that rise from 0")
        if len(away) == 1:
            return
        other = next((one for one in self.sensors if not isinstance(one, AlongTrack)), None)
        if other is not None:
            found = f"{len(away)} vehicles with a sensor of the kind {other.kind!r}"
            raise InputError("", "vehicles", found, "one vehicle, or sensors along the track")
        if len({float(one.rate) for one in self.sensors}) > 1:
            raise InputError("", "sensor", "different rates under several vehicles", "one rate")

    def _check_ends(self) -> None:
        """Refuse values that a scenario or a sensor cannot have."""
        if not self.slowest > 0.0 and (self.way is not None or len(self.vehicles) > 1):
            raise InputError("", "speed", f"{self.slowest:g} m/s", "more than 0 with `way` or with several vehicles")
        for row in self.rows:
            for end in row.draw.ends:
                try:
                    if row.path.startswith(OF_SENSORS):
                        self.changed_sensors({row.path: end})
                    else:
                        self.scenario.replaced({row.path: end})
                except InputError as error:
                    raise InputError("", f"vary.{row.path}", f"{end:g}", error.allowed) from error

    @property
    def slowest(self) -> float:
        """The lowest speed of a passage, m/s."""
        ends = [row.draw.ends[0] for row in self.rows if row.path == "speed"]
        return ends[0] if ends else float(self.scenario.speed)

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """What is drawn, beside faults."""
        return tuple(self._row(path, given) for path, given in sorted(self.vary.items()))

    def _row(self, path: str, given: Any) -> Row:
        where = f"vary.{path}"
        try:
            if path.startswith(OF_SENSORS):
                unit, holder, field = "", *self._sensor_field(path)
                return Row(path, draw_of(given, where, lambda value: _field_value(holder, field, value)), unit, False)
            field_at(self.scenario, path)
        except InputError as error:
            raise InputError("", where, error.found, error.allowed) from error
        draw = draw_of(given, where, lambda value: value_in_si(self.scenario, path, value))
        return Row(path, draw, unit_of(self.scenario, path), path.startswith(OWN))

    def _sensor_field(self, path: str) -> tuple[Sensor, str]:
        """Return the sensor and the name of its field in a path."""
        name, _, field = path.removeprefix(OF_SENSORS).rpartition(".")
        known = {one.channel: one for one in self.sensors}
        if name not in known:
            raise InputError("", path, f"no sensor {name!r}", ", ".join(known))
        sensor = known[name]
        value = getattr(sensor, field, None) if field in type(sensor).model_fields else None
        if isinstance(value, bool) or not isinstance(value, float) or field == "rate":
            fields = [one for one in type(sensor).model_fields if isinstance(getattr(sensor, one), float)]
            raise InputError("", path, f"{field!r}", ", ".join(one for one in fields if one != "rate"))
        return sensor, field

    def changed_sensors(self, drawn: dict[str, float]) -> tuple[Sensor, ...]:
        """Return the sensors with drawn values of their fields."""
        changes: dict[str, dict[str, float]] = {}
        for path, value in drawn.items():
            if path.startswith(OF_SENSORS):
                sensor, field = self._sensor_field(path)
                changes.setdefault(sensor.channel, {})[field] = value
        return tuple(
            type(one).model_validate(one.model_dump(mode="json") | changes[one.channel])
            if one.channel in changes
            else one
            for one in self.sensors
        )

    @cached_property
    def noises(self) -> dict[str, float]:
        """Standard deviations of the noise of samples, by sensor, in SI units."""
        known = {one.channel: one for one in self.sensors if isinstance(one, AlongTrack)}
        for name in self.noise:
            if name not in known:
                raise InputError("", "noise", f"{name!r}", ", ".join(known) or "no noise: these sensors have their own")
        return {
            name: as_quantity(value, f"noise.{name}", QUANTITIES[known[name].quantity], positive=False)
            for name, value in self.noise.items()
        }

    @cached_property
    def labels(self) -> tuple[Feature, ...]:
        """The features that become labels."""
        return tuple(named(one) for one in self.features)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """What a vehicle may have; the first is healthy, even if none is."""
        found = [Condition()]
        for name, given in self.faults.items():
            if name == HEALTHY:
                if given.size is not None or given.place is not None:
                    raise InputError("", f"faults.{HEALTHY}", "a size or a place", "its share alone")
                continue
            fault = fault_named(name)
            try:
                size = _size(given.size, fault)
            except InputError as error:
                raise error.within(f"faults.{name}") from None
            found.append(Condition(name, size, given.place))
        return tuple(found)

    @property
    def part_shares(self) -> tuple[float, ...]:
        """How often a passage is drawn into each of `parts`; their sum is 1."""
        return tuple(share / sum(self.parts.values()) for share in self.parts.values())

    @property
    def shares(self) -> tuple[float, ...]:
        """How often each of `conditions` is drawn; their sum is 1."""
        given = [self.faults.get(one.label) for one in self.conditions]
        shares = [0.0 if one is None else float(one.share) for one in given]
        return tuple(share / sum(shares) for share in shares)

    @classmethod
    def from_toml(cls, path: str | Path) -> DatasetPlan:
        """Read the description of a data set from a TOML file; paths in it are relative to the folder of this file."""
        path = as_path(path, "path", "the path of a TOML file with a data set")
        data = dict(toml_table(path, "a data set"))
        try:
            if "scenario" in data:
                data["scenario"] = scenario_in(data["scenario"], path)
                data["contents"] = file_digests(data["scenario"])
            if "sensor" in data:
                given = data.pop("sensor")
                data["sensors"] = given if isinstance(given, list) else [given]
            elif isinstance(data.get("sensors"), str):
                data["sensors"] = Site.from_toml(path.parent / data["sensors"]).all_sensors
            return cls.model_validate(data)
        except InputError as error:
            raise error.at(str(path)) from None


def _field_value(sensor: Sensor, field: str, value: Any) -> float:
    """Return a value of a sensor's field in SI units."""
    table = sensor.model_dump(mode="json") | {field: value}
    return float(getattr(type(sensor).model_validate(table), field))


def _size(given: Any, fault: Fault) -> float | tuple[float, float] | None:
    """Return a size, or a range of sizes, in the unit of a fault."""
    dimension = "length" if fault.unit == "m" else "number"
    if given is None:
        return None
    sizes = [to_si(one, dimension, "size") for one in (given if isinstance(given, list | tuple) else [given])]
    low, high = ends_of(sizes if len(sizes) > 1 else sizes[0])
    return low if low == high else (low, high)
