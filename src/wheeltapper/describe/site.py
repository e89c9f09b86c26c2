"""A site: sensors along a track, or a deck with an irregularity and its sensor; and the uncertainties of all of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    SerializeAsAny,
    field_serializer,
    field_validator,
    model_validator,
)

from wheeltapper.describe.choice import OneOf
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.noun import Mass, Noun, PositiveForce, PositiveLength, Share, Spread
from wheeltapper.describe.paths import changed_values, value_at
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.scenario import Scenario, relative_paths, toml_table, write_toml
from wheeltapper.describe.sensor.along import AlongTrack, AtSeat
from wheeltapper.describe.sensor.base import DECK, Sensor
from wheeltapper.describe.sensor.deck_acceleration import DeckAcceleration
from wheeltapper.describe.track.base import Track
from wheeltapper.ground.arguments import as_path
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import ANOMALY, FLEXIBLE_TRACK
from wheeltapper.march import run

NO_TRIGGER = "none"
"""What a file says where there is no trigger: TOML has no word for None."""
OF_WHEELS = ("unsprung_mass", "radius", "static_force", "contact.constant_per_wheel")
"""Paths of what a site with a track may know with an uncertainty, besides values of the track."""
OF_TRACK = ("unsprung_mass", "static_force", "contact")
"""Fields that say nothing without a track."""


def _none_or_given(value: Any) -> Any:
    return None if value == NO_TRIGGER else value


def _complete_schema(schema: dict[str, Any]) -> None:
    """Say in the schema what a file may hold: sensors in a list, and either a passage or sensors."""
    one, several = schema["properties"]["sensor"], schema["properties"]["sensors"]
    deck = {"$ref": one["$ref"]}
    schema["properties"]["sensor"] = {
        "anyOf": [deck, {"type": "array", "items": {"anyOf": [deck, several["items"]]}}]
    } | ({"description": one["description"]} if "description" in one else {})
    schema["anyOf"] = [{"required": [name]} for name in ("passage", "sensor", "sensors", "static_force")]


def _is_of_deck(sensor: Any) -> bool:
    """Return whether a sensor, made or in a table, is that of a deck, as one is of which nothing else is said."""
    if not isinstance(sensor, dict):
        return not isinstance(sensor, AlongTrack)
    called = sensor.get("type", Sensor.__name__)
    named = sensor.get("kind", DECK) == DECK
    return bool(called == DeckAcceleration.__name__ or (called == Sensor.__name__ and named))


def _kind_elsewhere(sensor: Any) -> str | None:
    """Return the kind of a sensor, made or in a table, that is neither along a track nor on a deck; None of others."""
    if isinstance(sensor, Sensor):
        return None if isinstance(sensor, AlongTrack | DeckAcceleration) else sensor.kind
    if not isinstance(sensor, dict):
        return None
    others = [kind for kind in makeable_nouns(Sensor) if not issubclass(kind, AlongTrack | DeckAcceleration)]
    kinds = {kind.__name__: str(kind.model_fields["kind"].default) for kind in others}
    named = kinds.get(str(sensor.get("type")), sensor.get("kind"))
    return named if named in kinds.values() else None


class Site(Noun):
    """A floating deck in the track that weighs wheelsets as they bounce, or a track with sensors, or both.

    Parameters
    ----------
    passage
        A healthy wheelset's passage: vehicle, deck, irregularity, contact, speed; time zero is the trigger, at x = 0.
        Without it and without a `track` the site has no model: forces are those of its `sensors`.
    sensor
        Sensor on the deck.
    sensors
        Sensors along the track, each with the name of its column. In a file every sensor is a table `[[sensor]]`; a
        single `[sensor]` is the one on the deck.
    spacing
        Distance between seats, m.
    radius
        Radius of the wheels, m, if it is known; by default that of the passage. Strikes then repeat with the wheel's
        circumference.
    track
        The track below the sensors; its fields say where its seats lie in the site's x. A model of a wheel on this
        track then explains what gauges record. This needs `radius` and `unsprung_mass`.
    unsprung_mass
        Mass of one wheel and what moves with it (half a wheelset), kg.
    static_force
        Static force of one wheel on level rail, N, which the acceleration of an axle box does not show. With it, and
        with a `track`, a site needs no sensors.
    contact
        Contact of one wheel, with a constant as `constant_per_wheel`; None: that of the radius and usual steel.
    uncertainty
        Relative standard deviation of stated values, by path ("contact.constant", "irregularity.0.height", "speed",
        "track.mass"). They are normally distributed. Fields that are not named are known exactly, except those that a
        diagnosis estimates. Paths are those of the passage; with a `track` those of the site ("track.pad_stiffness",
        "unsprung_mass", "radius", "static_force", "contact.constant_per_wheel").
    misfit
        Rms of the part of healthy recordings that the model of one wheelset leaves unexplained, over the rms of these
        recordings. It is measured with known wheelsets. A diagnosis adds it to the noise.
    trigger
        Standard deviation of the trigger's time, s; 0 if time zero of a recording is exactly at x = 0. None (in a file
        "none"): there is no trigger, and the passage is found in the recording.
    name
        Name of the site.
    """

    _needs_type = False

    model_config = ConfigDict(json_schema_extra=_complete_schema)

    if TYPE_CHECKING:
        passage: Scenario  # `as_site` refuses a site without it, so that only `as_any_site` returns such
    else:
        passage: Scenario | None = None
    sensor: DeckAcceleration = DeckAcceleration()
    sensors: tuple[SerializeAsAny[AlongTrack], ...] = ()
    spacing: PositiveLength | None = None
    radius: PositiveLength | None = None
    track: Annotated[Any, OneOf(Track)] | None = None
    unsprung_mass: Mass | None = None
    static_force: PositiveForce | None = None
    contact: Hertz | None = None
    uncertainty: dict[str, Share] = Field(default_factory=dict)
    misfit: Share = 0.0
    trigger: Annotated[Spread | None, BeforeValidator(_none_or_given)] = 0.0
    name: str = ""

    @model_validator(mode="before")
    @classmethod
    def _sort_sensors(cls, data: Any) -> Any:
        """Tell the deck's sensor from those of the track, where a file lists them together."""
        if not isinstance(data, dict):
            return data
        along = data.get("sensors")
        if isinstance(along, Sensor):
            raise InputError("", "sensors", f"a {type(along).__name__}", "a list")
        for field in ("sensor", "sensors"):
            for number, one in enumerate(data[field] if isinstance(data.get(field), list | tuple) else ()):
                if (kind := _kind_elsewhere(one)) is not None:
                    allowed = "a kind along the track; `Record.recordings` takes one on a vehicle by itself"
                    raise InputError("", f"{field}.{number}.kind", repr(kind), allowed)
        for number, one in enumerate(along if isinstance(along, list | tuple) else ()):
            if isinstance(one, dict | Sensor) and _is_of_deck(one):
                unsaid = isinstance(one, dict) and not {"kind", "type"} & {*one}
                allowed = "a kind along the track; the deck's sensor is `sensor`"
                raise InputError("", f"sensors.{number}.kind", "nothing" if unsaid else repr(DECK), allowed)
        if not isinstance(data.get("sensor"), list | tuple):
            return data
        if along:
            raise InputError("", "sensors", "more sensors besides a list of them in `sensor`", "one list")
        decks = [one for one in data["sensor"] if _is_of_deck(one)]
        if len(decks) > 1:
            raise InputError("", "sensor", f"{len(decks)} sensors of the kind {DECK!r}", "one, on the deck")
        others = [one for one in data["sensor"] if not _is_of_deck(one)]
        rest = {name: value for name, value in data.items() if name != "sensor"}
        return rest | {"sensors": others} | ({"sensor": decks[0]} if decks else {})

    @field_validator("uncertainty", mode="after")
    @classmethod
    def _sorted_uncertainty(cls, value: dict[str, float]) -> dict[str, float]:
        return dict(sorted(value.items()))

    @field_serializer("trigger")
    def _trigger_in_words(self, value: float | None) -> float | str:
        return NO_TRIGGER if value is None else value

    @model_validator(mode="after")
    def _check_sensors(self) -> Site:
        names = [one.name for one in self.sensors]
        for number, one in enumerate(self.sensors):
            if isinstance(one, AtSeat) and one.seat is not None and self.spacing is None:
                raise InputError("", "spacing", f"none, with a sensor at seat {one.seat}", "the distance of the seats")
            if not one.name or names.count(one.name) > 1:
                found = f"{names.count(one.name)} sensors with the name {one.name!r}" if one.name else "no name"
                raise InputError("", f"sensors.{number}.name", found, "the name of its column, which no other has")
        return self

    @model_validator(mode="after")
    def _check_passage(self) -> Site:
        if self.passage is None:
            of_the_model = {"misfit": self.misfit, "trigger": self.trigger != 0.0}
            if self.track is None:
                of_the_model = {"uncertainty": self.uncertainty} | of_the_model
            given = [name for name, value in of_the_model.items() if value]
            if given or not (self.sensors or (self.track is not None and self.static_force is not None)):
                allowed = "a healthy wheelset's passage over the deck" + ("" if given else ", or sensors of the track")
                raise InputError("", "passage", "none" + (f", with {given[0]} of its model" if given else ""), allowed)
            return self
        try:
            run.choose(run.DIAGNOSE, self.passage.needs)
        except InputError as error:
            raise error.within("passage") from None
        self._check_uncertainty(self.passage, tuple(self.uncertainty), "the passage")
        return self

    @model_validator(mode="after")
    def _check_track(self) -> Site:
        if self.track is None:
            given = next((name for name in OF_TRACK if getattr(self, name) is not None), None)
            if given:
                raise InputError("", given, "given, without a track", "it with the `track` on which wheels roll")
            return self
        if self.passage is not None:
            raise InputError("", "track", "one besides a passage", "either a deck's passage, or a track below sensors")
        if FLEXIBLE_TRACK not in self.track.needs or ANOMALY in self.track.needs:
            found = f"a {type(self.track).__name__}" + (" with anomalies" if ANOMALY in self.track.needs else "")
            raise InputError("", "track", found, "a track whose rails bend on equal seats")
        if self.spacing is not None and self.spacing != self.track.spacing:
            found = f"{self.spacing:g} m, on a track with {self.track.spacing:g} m"
            raise InputError("", "spacing", found, "the track's, or none")
        for name in ("unsprung_mass", "radius"):
            if getattr(self, name) is None:
                raise InputError("", name, "none, with a track", "that of the wheels on it")
        if self.contact is not None and self.contact.constant is not None:
            raise InputError("", "contact.constant", "a wheelset's constant", "that of one wheel, `constant_per_wheel`")
        for path in self.uncertainty:
            if path not in OF_WHEELS and not path.startswith("track."):
                raise InputError("", "uncertainty", repr(path), f"values of the track, {', '.join(OF_WHEELS)}")
        self._check_uncertainty(self, tuple(one for one in self.uncertainty if one not in OF_WHEELS), "the site")
        return self

    def _check_uncertainty(self, noun: Noun, paths: tuple[str, ...], where: str) -> None:
        """Refuse uncertain values that a noun does not have."""
        for path in paths:
            try:
                held = value_at(noun, path)
            except InputError as error:
                allowed = f"paths of numbers in {where}; there: {error.allowed}"
                raise InputError("", "uncertainty", repr(path), allowed) from error
            if isinstance(held, bool) or not isinstance(held, int | float):
                raise InputError("", "uncertainty", f"{path!r}, where there is no number", "paths of numbers")

    @property
    def all_sensors(self) -> tuple[Sensor, ...]:
        """That of the deck, where there is one, and those along the track."""
        return (*((self.sensor,) if self.passage is not None else ()), *self.sensors)

    @property
    def wheel_radius(self) -> float | None:
        """The radius of the wheels, m, as the site or else its passage states it; None if neither does."""
        own = self.radius if self.radius is not None or self.passage is None else self.passage.vehicle.radius
        return None if own is None else float(own)

    def __hash__(self) -> int:
        own = (self.passage, self.sensor, self.sensors, self.spacing, self.radius, self.track, self.unsprung_mass)
        beside = (self.static_force, self.contact)
        return hash((*own, *beside, tuple(self.uncertainty.items()), self.misfit, self.trigger, self.name))

    def replaced(self, changes: dict[str, Any]) -> Site:
        """Return a changed copy; keys are paths such as "spacing", "sensors.0.gain" or "sensors.left 1.gain"."""
        return Site.model_validate(changed_values(self, changes))

    def to_toml(self, path: str | Path) -> None:
        """Write the site as TOML, which `from_toml` and the commands read without change."""
        write_toml(self, path)

    @classmethod
    def from_toml(cls, path: str | Path) -> Site:
        """Read a site from a TOML file; paths in it are relative to the folder of this file."""
        path = as_path(path, "path", "the path of a TOML file with a site")
        data = toml_table(path, "a site")
        return cls.of(relative_paths(data, path.parent), str(path))

    @classmethod
    def of(cls, data: dict[str, Any], source: str = "") -> Site:
        """Return the site that a table (a dict) describes; errors name `source`."""
        try:
            return cls.model_validate(data)
        except InputError as error:
            raise error.at(source) from None


def as_site(given: Any) -> Site:
    """Return a site with a deck and its model; for a path, the one that the TOML file describes."""
    site, source = as_any_site(given), "" if isinstance(given, Site) else str(given)
    if site.passage is None:
        allowed = "a site with the passage of a healthy wheelset over a deck; sensors alone are for `measure_trains`, "
        allowed += "a track alone for `diagnose_axle_box`"
        raise InputError(source, "passage", "none", allowed)
    return site


def as_any_site(given: Any) -> Site:
    """Return a site, be it without a model; for a path, the one that the TOML file describes."""
    if isinstance(given, Site):
        return given
    return Site.from_toml(as_path(given, "site", "a Site, or the path of its TOML file"))
