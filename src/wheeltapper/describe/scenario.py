"""The scenario: everything that a simulation needs, and nothing computed."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Tag, model_validator
from pydantic_core import PydanticSerializationError

from wheeltapper.describe.choice import OneOf
from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.contact.elastic import ElasticContact
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.creep.base import CreepLaw
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.noun import Duration, Length, Noun, Speed
from wheeltapper.describe.paths import changed_values
from wheeltapper.describe.placement import Placement, check_places
from wheeltapper.describe.profile.named import NAMES
from wheeltapper.describe.profile.wheel_rail import Profiles, WheelRail
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.track.stiff import StiffTrack
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.wagon import Wagon, wagon_for
from wheeltapper.ground.arguments import as_path
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import (
    ALONE,
    BOGIE,
    FLEXIBLE_TRACK,
    IRREGULARITY,
    MEMORY,
    NOTHING,
    OWN_LAW,
    POINT,
    PROFILES,
    SEVERAL_BODIES,
    START,
    WHEELSETS,
    YIELDING,
    Need,
)
from wheeltapper.march import run

FORMAT = 1
"""Version of the TOML files' layout."""
AnyIrregularity = Annotated[Any, OneOf(Irregularity)]


class Start(Noun):
    """Position and velocity of the wheel at time zero; on a vehicle with several wheelsets, of each wheelset.

    Everything else, such as a bogie's frame, a deck and the track, starts from the static state.

    Parameters
    ----------
    displacement
        Displacement of the wheel's centre, upwards from the height of first touch, m.
    velocity
        Velocity, upwards, m/s.
    """

    displacement: Length = 0.0
    velocity: Speed = 0.0

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: a start of its own."""
        return frozenset({START})


def _as_tuple(value: Any) -> Any:
    if value is None:
        return ()
    if isinstance(value, dict) and "type" not in value:
        return {where: _as_tuple(items) for where, items in value.items()}
    return value if isinstance(value, list | tuple) else [value]


def _irregularity_form(value: Any) -> str:
    return "places" if isinstance(value, dict) else "all"


class Scenario(Noun):
    """A vehicle that runs over a track at constant speed, x = V·t.

    Parameters
    ----------
    vehicle
        A `Wheelset`, or a vehicle with several wheelsets; x is then the position of the leading one.
    track
        `StiffTrack`, `FloatingDeck`, or rails on sleepers of `wheeltapper.tracks`.
    contact
        `Hertz`, `Linear`, or another law of `wheeltapper.contact`: one that yields, or one of your own.
    creep
        On a wagon, a law of `wheeltapper.creep`. None: no tangential force (the core models have none).
    profiles
        On a wagon: `WheelRail` or `Cones` of `wheeltapper.profiles`.
    irregularity
        None, one, or several, which are summed; all wheels meet all of them. Or a table of them by place: under several
        wheelsets "both", "wheelset 4" and the like, on a wagon "left", "right", "wheelset 4 right" and the like.
    rolling
        "circle": the wheel rolls as a circle (the paper, equation 2.2); "point": its centre follows the irregularity.
    speed
        V, m/s.
    duration
        s.
    start
        "equilibrium": static indentation on the path at x = 0, velocity zero; or displacement and velocity.
    """

    _needs_type = False

    vehicle: Annotated[Any, OneOf(Vehicle), AfterValidator(wagon_for)]
    track: Annotated[Any, OneOf(Track)] = StiffTrack()
    contact: Annotated[Any, OneOf(Contact)] = Hertz()
    creep: Annotated[CreepLaw, OneOf(CreepLaw)] | None = None
    profiles: Annotated[Any, OneOf(Profiles)] = WheelRail()
    irregularity: Annotated[
        Annotated[tuple[AnyIrregularity, ...], Tag("all")]
        | Annotated[dict[str, tuple[AnyIrregularity, ...]], AfterValidator(Placement), Tag("places")],
        Discriminator(_irregularity_form),
        BeforeValidator(_as_tuple),
    ] = ()
    rolling: Literal["circle", "point"] = "circle"
    speed: Speed
    duration: Duration
    start: Literal["equilibrium"] | Start = "equilibrium"

    @model_validator(mode="after")
    def _check_combination(self) -> Scenario:
        if self.speed < 0:
            raise InputError("", "speed", f"{self.speed:g} m/s", "0 m/s or more")
        if self.speed == 0 and self.irregularity:
            raise InputError("", "speed", "0 m/s together with an irregularity", "more than 0 m/s (0 is a drop test)")
        if self.rolling == "circle" and any(item.filters for item in self.irregularities):
            found = 'a filter by the patch of contact, besides rolling = "circle", which leaves out short waves itself'
            raise InputError("", "irregularity", found, 'rolling = "point", or no patch')
        run.choose(run.SIMULATE, self.needs)
        if isinstance(self.track, SupportedRail):
            self._check_rails()
        if isinstance(self.vehicle, Wagon):
            self._check_wagon(self.vehicle)
            return self
        wheelsets = len(getattr(self.vehicle, "positions", (0.0,)))
        self._check_deck(wheelsets)
        check_places(self.irregularity, wheelsets, sides=False)
        if isinstance(self.contact, Hertz) and self.contact.idle:
            raise self.contact.idle.within("contact")
        return self

    def _check_rails(self) -> None:
        wheels = getattr(self.vehicle, "wheels", 2)
        if wheels > 2:
            raise InputError("", "vehicle.wheels", str(wheels), "2, half on each of two rails, or 1, on one rail")

    def _check_deck(self, wheelsets: int) -> None:
        under = getattr(self.track, "wheelset", None)
        if under is not None and under > wheelsets:
            raise InputError("", "track.wheelset", str(under), f"1 to {wheelsets}" if wheelsets > 1 else "1, or none")

    def _check_wagon(self, wagon: Wagon) -> None:
        self._check_deck(len(wagon.axles))
        check_places(self.irregularity, len(wagon.axles))
        if isinstance(self.contact, ElasticContact) and self.contact.constant is not None:
            raise InputError(
                "", "contact.constant", f"{self.contact.constant:g}, of a wheelset, on a Wagon",
                "constant_per_wheel, or none to take it from the profiles",
            )  # fmt: skip
        if self.creep is not None and self.speed == 0:
            raise InputError("", "speed", "0 m/s with creep forces", "more than 0 m/s")

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: what each part of the scenario needs, and what they need together."""
        parts = (self.vehicle, self.track, self.contact, self.creep, self.irregularity, self.start)
        found = NOTHING.union(*(getattr(part, "needs", NOTHING) for part in (*parts, *self.irregularities)))
        usual = type(self).model_fields["profiles"].default
        also = {
            PROFILES: self.profiles is not usual and self.profiles != usual,
            IRREGULARITY: bool(self.irregularity),
            POINT: self.rolling == "point",
            MEMORY: YIELDING in found and self.speed == 0.0,
            ALONE: YIELDING in found and not found & {FLEXIBLE_TRACK, WHEELSETS, BOGIE, SEVERAL_BODIES},
        }
        return found.union(need for need, there in also.items() if there)

    @property
    def irregularities(self) -> tuple[Any, ...]:
        """The irregularities at all places, always as a tuple."""
        if isinstance(self.irregularity, Placement):
            return tuple(item for items in self.irregularity.values() for item in items)
        return tuple(self.irregularity)

    def irregularities_on(self, wheelset: int, side: str) -> tuple[Any, ...]:
        """Return the irregularities that one wheel of a wagon meets; wheelsets count from 1."""
        here = self.irregularity
        items = here.on(wheelset, side) if isinstance(here, Placement) else tuple(here)
        return tuple(item.on_rail(side) for item in items)

    def check_extent(self, end: float | None = None) -> None:
        """Refuse a run (to x = `end`, m, if given) in which an irregularity cannot be met as it is described."""
        end = float(self.speed * self.duration) if end is None else end
        for i, item in enumerate(self.irregularities):
            try:
                item.check_run(end)
            except InputError as error:
                raise error.within(f"irregularity.{i}") from None

    def replaced(self, changes: dict[str, Any]) -> Scenario:
        """Return a changed copy; keys are paths such as "vehicle.mass" or "irregularity.0.height"."""
        return Scenario.model_validate(changed_values(self, changes))

    @classmethod
    def from_toml(cls, path: str | Path) -> Scenario:
        """Read a scenario from a TOML file; paths in it are relative to the folder of this file."""
        path = as_path(path, "path", "the path of a TOML file with a scenario")
        data = toml_table(path, "a scenario")
        if not data:
            raise InputError(str(path), "", "an empty file", "a TOML file with a scenario")
        return cls.of(relative_paths(data, path.parent), str(path))

    @classmethod
    def of(cls, data: dict[str, Any], source: str = "") -> Scenario:
        """Return the scenario that a table (a dict) describes; errors name `source`."""
        try:
            return cls.model_validate(data)
        except InputError as error:
            raise error.at(source) from None

    def to_toml(self, path: str | Path) -> None:
        """Write the scenario as TOML."""
        write_toml(self, path)


def toml_text(noun: Noun) -> str:
    """Return a scenario, or a site, as TOML that is read back as it is.

    Raises
    ------
    InputError
        If it holds a Python function, which no TOML can.
    """
    import tomli_w

    try:
        return tomli_w.dumps({"format": FORMAT} | noun.model_dump(mode="json"))
    except PydanticSerializationError as error:
        field, kind, instead = _held_function(noun)
        raise InputError("", field, f"a {kind}, which holds a Python function", instead) from error


def write_toml(noun: Noun, path: str | Path) -> None:
    """Write a scenario, or a site, as TOML that is read back as it is."""
    path = as_path(path, "path", "the path of the TOML file to write")
    try:
        path.write_text(toml_text(noun), encoding="utf-8")
    except InputError as error:
        raise error.at(str(path)) from error
    except OSError as error:
        raise InputError(
            str(path), "", f"a place that cannot be written ({error.strerror or error})", "a writable path"
        ) from error


def _held_function(noun: Noun) -> tuple[str, str, str]:
    """Return which field holds a Python function, the noun there, and what could stand there instead."""
    scenario: Any = getattr(noun, "passage", noun)
    if OWN_LAW in scenario.contact.needs:
        return "contact", type(scenario.contact).__name__, "a law that needs no function"
    return "irregularity", "Profile", "samples of it in a `Measured`"


TABLES = {
    "a site": ("passage", "`wheeltapper diagnose`, `assess` or `design`"),
    "a study": ("over", "`wheeltapper sweep`"),
    "a data set": ("faults", "`wheeltapper dataset`"),
    "a scenario": ("vehicle", "`wheeltapper run` or `wear`"),
}
"""What a TOML file may describe: for each kind a field that only such a file has at its top, and the commands that take
it."""


def toml_table(path: Path, what: str) -> dict[str, Any]:
    """Return the contents of a TOML file without its `format`; refuse a file that is not `what`."""
    allowed = f"a TOML file with {what}"
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(str(path), "", f"no readable file ({error.strerror})", allowed) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(str(path), "", f"text that is not TOML: {error}", allowed) from error
    if what in TABLES and TABLES[what][0] not in data:
        for other, (field, command) in TABLES.items():
            if field in data:
                raise InputError(str(path), "", f"{other}: use {command} with it", allowed)
    version = data.pop("format", FORMAT)
    if version != FORMAT:
        raise InputError(str(path), "format", repr(version), f"{FORMAT}; a newer file needs a newer wheeltapper")
    return data


def names_a_file(table: dict[str, Any], key: str, value: str) -> bool:
    """Return True where the text in a noun's table is the path of a file."""
    if table.get("type") == "WheelRail":
        return key in ("wheel", "rail") and value not in NAMES
    return key == "path"


def relative_paths(data: Any, folder: Path) -> Any:
    """Return a scenario's table; paths of files in it become relative to a folder."""
    if isinstance(data, dict):
        return {
            k: str(folder / v) if isinstance(v, str) and names_a_file(data, k, v) else relative_paths(v, folder)
            for k, v in data.items()
        }
    if isinstance(data, list):
        return [relative_paths(item, folder) for item in data]
    return data
