"""What all sensors state; a table's `kind` says which of them it describes."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Annotated, Any, ClassVar, Final, Protocol, Self, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, ModelWrapValidatorHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from wheeltapper.describe.choice import union_of_nouns
from wheeltapper.describe.noun import Frequency, Noun
from wheeltapper.describe.registry import is_abstract, makeable_nouns
from wheeltapper.describe.sensitivity import QUANTITIES, Quantity
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.quantities import to_si

FloatArray = NDArray[np.float64]
DECK: Final = "deck acceleration"
ANTI_ALIAS = 0.4
"""Cut-off of a recorder's filter over its rate, where it is not stated: usual converters keep what is below 0.4 to 0.45
of it."""


class Seen(Protocol):
    """What a run shows to one sensor, on its rail, at the times of its samples."""

    @property
    def times(self) -> FloatArray:
        """Of the samples, s."""
        ...

    def at_places(self, name: str) -> FloatArray:
        """Return a variable of `Record.track` at the sensor's `rail_places`, or at its seat, (places, times)."""
        ...

    def force_between(self, x1: float, x2: float) -> FloatArray:
        """Return the forces of the wheels that are between two places, N, (times,)."""
        ...

    def deck_acceleration(self, times: FloatArray) -> FloatArray:
        """Return the deck's acceleration, m/s² upwards, at times."""
        ...

    def axle_box_acceleration(self, wheelset: int) -> FloatArray:
        """Return a wheelset's acceleration at its axle box on the sensor's side, m/s² upwards, (times,)."""
        ...

    def white_noise(self, count: int) -> FloatArray:
        """Return samples of white noise of unit variance; zeros if none is wanted."""
        ...

    def behind_filter(self, read: Callable[[Seen], FloatArray], cutoff: float | None) -> FloatArray:
        """Return what `read` gives of a run, (times,), behind the filter of a recorder with this cut-off, Hz.

        `read` is asked for more than the samples, and what it is given has the `times` of these. Without a cut-off its
        values are the samples.
        """
        ...


class Sensor(Noun, abstract=True):
    """A sensor on a deck, along the track, or on a vehicle.

    `kind` says which: `Sensor(kind="pad force", seat=3)` is a `PadForce`. Every kind has fields of its own. To add a
    kind, write a subclass of this class, or of those for places along the track in `describe.sensor.along`.

    Parameters
    ----------
    kind
        What it reads; "deck acceleration" by default.
    name
        Name of its column (channel) in the files, or of its file where a file has one column. "left 1" also stands for
        "left_1" and "WILD/left 1", which some formats write instead.
    column
        Number of its column (from 0), or another name, for files in which no column has the sensor's name.
    rate
        Samples per second, Hz.
    """

    _needs_type = False

    written_if_given: ClassVar[tuple[str, ...]] = ("rate",)
    """Fields that are written to files only if they are given; if not, those of a recording hold."""
    quantity: ClassVar[Quantity]
    """The quantity of its readings, as a `Recording` has it."""
    place_words: ClassVar[str] = ""
    """The fields that tell its place, for messages."""
    example: ClassVar[dict[str, Any]] = {}
    """The fields that one cannot be made without, for tests of all kinds."""
    kind: str
    name: str = ""
    column: int | str | None = None
    rate: Frequency = 20_000.0

    @property
    def channel(self) -> str:
        """What its recordings are called: its name, or its kind if it has none."""
        return self.name or self.kind

    @classmethod
    def __pydantic_init_subclass__(cls, *, abstract: bool = False, **options: Any) -> None:
        if not abstract:
            cls._check_kind()
        super().__pydantic_init_subclass__(abstract=abstract, **options)

    @classmethod
    def _check_kind(cls) -> None:
        """Refuse a class whose kind is not one name that no other has, or whose quantity is unknown."""
        field, others = cls.model_fields["kind"], makeable_nouns(Sensor)
        if get_args(field.annotation) != (field.default,):
            allowed = 'one name, as `kind: Literal["pad strain"] = "pad strain"`'
            raise InputError("", "kind", f"no name of a {cls.__name__}", allowed)
        taken = {one.model_fields["kind"].default: one.__name__ for one in others}
        if taken.get(field.default, cls.__name__) != cls.__name__:
            found = f"{field.default!r} of a {cls.__name__}, beside that of a {taken[field.default]}"
            raise InputError("", "kind", found, "a name that is not taken")
        if getattr(cls, "quantity", None) not in QUANTITIES:
            raise InputError(
                "", "quantity", f"{getattr(cls, 'quantity', None)!r} of a {cls.__name__}", ", ".join(QUANTITIES)
            )

    def __new__(cls, *_: Any, **fields: Any) -> Self:
        """Make a sensor of the kind that is stated."""
        return super().__new__(cls._chosen(fields))

    @classmethod
    def _table_type(cls) -> str:
        return Sensor.__name__

    @classmethod
    def _chosen(cls, fields: dict[str, Any]) -> type[Self]:
        """Return which class of this family the `kind` of a table names, or its `type`.

        Raises
        ------
        InputError
            If there is no such kind.
        """
        if not is_abstract(cls):
            return cls
        kinds: dict[str, type[Self]] = {one.model_fields["kind"].default: one for one in makeable_nouns(cls)}
        called = {Sensor.__name__: None, **{one.__name__: one for one in kinds.values()}}
        name = fields.get("type", Sensor.__name__)
        if not isinstance(name, str) or name not in called:
            raise InputError("", "type", value_text(name), with_suggestion(str(name), called))
        if (own := called[name]) is not None or "kind" not in fields:
            return own or kinds.get(DECK, cls)
        kind = fields["kind"]
        if isinstance(kind, str) and kind in kinds:
            return kinds[kind]
        *others, last = map(repr, kinds)
        listed = f"{', '.join(others)} or {last}"
        allowed = with_suggestion(kind, kinds, listed) if isinstance(kind, str) else listed
        raise InputError("", "kind", value_text(kind), allowed)

    @model_validator(mode="wrap")
    @classmethod
    def _of_its_kind(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        chosen = cls._chosen(data) if isinstance(data, dict) else cls
        return handler(data) if chosen is cls else chosen.model_validate(data)

    @model_validator(mode="before")
    @classmethod
    def _without_fields_of_others(cls, data: Any) -> Any:
        """Refuse fields of other kinds, but for their defaults, which older files have."""
        if not isinstance(data, dict):
            return data
        own, kinds = cls.model_fields, makeable_nouns(Sensor)
        kind = own["kind"].default
        defaults = {name: field.default for kind in kinds for name, field in kind.model_fields.items()}
        idle = [name for name in data if name in defaults and name not in own]
        for name in idle if data.get("kind", kind) == kind else ():
            if data[name] not in (None, defaults[name]):
                raise InputError("", name, f"it for a sensor of the kind {kind!r}", cls._field_words())
        return {"kind": kind} | {name: value for name, value in data.items() if name not in idle}

    @classmethod
    def _field_words(cls) -> str:
        """Return its fields, its place first, for messages."""
        others = (field for field in cls.model_fields if field != "kind" and field not in cls.place_words.split())
        return ", ".join([*([cls.place_words] if cls.place_words else []), *others])

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        if not is_abstract(cls):
            return handler(schema)
        words = (cls.__doc__ or "").partition("\n\n")[0]
        return handler(union_of_nouns(makeable_nouns(cls)).core_schema) | {"description": words}

    @property
    def linear(self) -> Sensor:
        """The same sensor without what is not linear in it; by default the sensor itself."""
        return self

    def samples(self, seen: Seen) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return the samples that it would record of a run, in SI units, and which of them are clipped."""
        raise InputError(
            "", "kind", f"{self.kind!r}, of which nobody says what it reads of a run", "a method `samples`"
        )


def _read_filter(value: Any) -> bool | float:
    """Return whether there is a filter, or its cut-off, Hz."""
    if isinstance(value, bool):
        return value
    cutoff = to_si(value, "frequency")
    if not (isfinite(cutoff) and cutoff > 0.0):
        raise InputError("", "", value_text(value), "true, false, or a frequency above 0 Hz")
    return cutoff


class FilteredSensor(Sensor, abstract=True):
    """A sensor whose recorder filters before it samples.

    Parameters
    ----------
    anti_alias
        The filter before the sampling, of order 8 and without delay: true for one with a cut-off (-3 dB) of 0.4 of the
        rate, false for none, or the cut-off, Hz.
    """

    written_if_given: ClassVar[tuple[str, ...]] = ("rate", "anti_alias")
    anti_alias: Annotated[
        bool | float,
        BeforeValidator(_read_filter, json_schema_input_type=bool | float | str),
        Field(json_schema_extra={"description": "true, false, or a frequency: a number in Hz, or with a unit"}),
    ] = True

    @model_validator(mode="after")
    def _check_filter(self) -> Self:
        if not isinstance(self.anti_alias, bool) and not self.anti_alias < self.rate:
            raise InputError("", "anti_alias", f"{self.anti_alias:g} Hz", f"less than its rate, {self.rate:g} Hz")
        return self

    def cutoff(self, rate: float) -> float | None:
        """Return the cut-off of the filter of a recorder with so many samples per second, Hz; None without a filter."""
        if isinstance(self.anti_alias, bool):
            return ANTI_ALIAS * rate if self.anti_alias else None
        return self.anti_alias
