"""The base of all nouns: frozen, strict about names, with units in strings."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Signature
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_serializer, model_validator

from wheeltapper.describe.complaint import one_line_error
from wheeltapper.describe.manual import completed_docstring, readable_signature
from wheeltapper.describe.registry import all_registered, register, room_of
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import NOTHING, Need
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)  # pydantic does not export it


class NounMeta(ModelMetaclass):
    """The metaclass of nouns: their errors have one line, and nothing of pydantic's internals is shown.

    Errors are worded here, and not in `__init__`, because pydantic makes inner nouns without calling their classes.
    Therefore the outermost noun raises the error, with the whole path of the wrong field.
    """

    def __call__(cls, *nameless: Any, **fields: Any) -> Any:  # noqa: N805 - of a metaclass
        """Make a noun."""
        leading = cls._leading[: len(nameless)]  # type: ignore[attr-defined]
        fields |= {name: value for name, value in zip(leading, nameless, strict=False) if name not in fields}
        nameless = nameless[len(leading) :]
        if nameless:
            names = ", ".join(cls.model_fields) or "none"  # type: ignore[attr-defined]
            raise InputError("", "", f"{value_text(nameless[0])} without a name", f"values with names: {names}")
        try:
            return super().__call__(**fields)
        except ValidationError as error:
            raise one_line_error(error, cls, nouns_by_name()) from None

    def __dir__(cls) -> list[str]:  # noqa: N805
        return sorted(name for name in {*super().__dir__()} - {*vars(BaseModel)} if not name.startswith("_"))


def nouns_by_name() -> dict[str, type[Noun]]:
    """Return all nouns by name."""
    return {name: kind for name, kind in all_registered().items() if isinstance(kind, type) and issubclass(kind, Noun)}


class _Signature:
    """A noun's signature, made when it is asked for: what a field takes may be registered later than the noun."""

    def __get__(self, noun: Any, kind: type[Noun]) -> Signature:
        return readable_signature(kind)


class Noun(BaseModel, Shown, metaclass=NounMeta):
    """A frozen description: equal by value, hashable, picklable, printable; unknown names are refused.

    A class statement registers a kind of noun. With `abstract=True` it is a family, of which others are made.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, validate_default=False)
    _leading: ClassVar[tuple[str, ...]] = ()
    """Names of the fields that may be given without a name, in this order."""
    _needs_type: ClassVar[bool] = True
    """Whether a table needs its `type`: not where nothing else may stand in its place."""

    def __init_subclass__(cls, *, abstract: bool = False, **options: Any) -> None:
        super().__init_subclass__(**options)

    @classmethod
    def __pydantic_init_subclass__(cls, *, abstract: bool = False, **options: Any) -> None:
        cls.__signature__ = _Signature()  # type: ignore[assignment]
        cls.__doc__ = completed_docstring(cls)
        register(cls, room_of(cls), abstract=abstract)

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """Return the noun that a table describes."""
        try:
            return super().model_validate(obj, **options)
        except ValidationError as error:
            raise one_line_error(error, cls, nouns_by_name()) from None

    if not TYPE_CHECKING:  # type checkers know from `frozen` that no field may be set

        def __setattr__(self, name: str, value: Any) -> None:
            what = f"a new value for {name!r} of a {type(self).__name__}, which never changes"
            raise InputError("", name, what, 'a changed copy: Scenario.replaced({"vehicle.mass": 1600}) and the like')

    def __dir__(self) -> list[str]:
        return [*type(self).model_fields, *dir(type(self))]

    @model_validator(mode="before")
    @classmethod
    def _take_type(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        if "type" in data and "type" not in cls.model_fields:
            if data["type"] not in (cls.__name__, cls._table_type()):
                raise InputError("", "type", repr(data["type"]), repr(cls._table_type()))
            data = {name: value for name, value in data.items() if name != "type"}
        return cls._taken_by_name(data) if "name" in data and "name" not in cls.model_fields else data

    @classmethod
    def _table_type(cls) -> str:
        """Return what is written as the `type` of a table of this kind; its own name is read as well."""
        return cls.__name__

    @classmethod
    def _taken_by_name(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Return the fields of a published noun of this kind, as those beside its name overrule them."""
        named = getattr(cls, "named", None)
        if named is None:
            return data
        try:
            found = named(data["name"], **{field: value for field, value in data.items() if field != "name"})
        except InputError as error:
            raise error if error.field else error.within("name") from None
        return {field: getattr(found, field) for field in found.model_fields_set}

    @model_serializer(mode="wrap")
    def _give_type(self, handler: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        silent = {*getattr(self, "written_if_given", ())} - self.model_fields_set
        plain = {name: value for name, value in handler(self).items() if value is not None and name not in silent}
        return {"type": self._table_type()} | plain

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle for this, beyond what every march can do."""
        return NOTHING

    def _with_data(self) -> Self:
        """Return the same with the contents of the files that it names in place of their paths.

        What reads a file says here what it has read; all others ask what they hold.
        """
        held = {name: getattr(self, name) for name in type(self).model_fields}
        changed = {name: new for name, value in held.items() if (new := _data_of(value)) is not value}
        return self.model_copy(update=changed) if changed else self

    def __eq__(self, other: object) -> bool:
        # Fields only: what a noun has computed once (a spline, say) is kept beside them and says nothing new.
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)


def _data_of(value: Any) -> Any:
    """Return a field's value with the contents of files; the same object where it names none."""
    if isinstance(value, Noun):
        return value._with_data()
    if not isinstance(value, tuple | list | dict):
        return value
    old = [*value.values()] if isinstance(value, dict) else [*value]
    new = [_data_of(one) for one in old] if any(isinstance(one, Noun | tuple) for one in old) else old
    if all(one is before for one, before in zip(new, old, strict=True)):
        return value
    return type(value)(zip(value, new, strict=True) if isinstance(value, dict) else new)


def check_idle(noun: Noun, names: tuple[str, ...], where: str) -> None:
    """Refuse fields that are set where they do nothing: "beside orders", "without a deviation"."""
    for name in names:
        value = getattr(noun, name)
        if value != type(noun).model_fields[name].default:
            raise InputError("", name, f"{value_text(value)}, which does nothing {where}", f"no {name}")


def _quantity_reader(dimension: str) -> Callable[[Any], float]:
    def read_quantity(value: Any) -> float:
        number = to_si(value, dimension)
        if not isfinite(number):
            raise InputError("", "", value_text(value), f"a finite {dimension}")
        return number

    return read_quantity


def quantity_type(dimension: str, **bounds: Any) -> Any:
    """Return the annotated type of a quantity: a float in SI units, or a string with a unit."""
    schema: dict[str, Any] = {
        "type": ["number", "string"],
        "description": f"{dimension}: a number in SI units, or with a unit",
    }
    return Annotated[
        float,
        BeforeValidator(_quantity_reader(dimension), json_schema_input_type=float | str),
        Field(json_schema_extra=schema, **bounds),
    ]


Length = quantity_type("length")
PositiveLength = quantity_type("length", gt=0)
Gap = quantity_type("length", ge=0)
Mass = quantity_type("mass", gt=0)
Force = quantity_type("force")
PositiveForce = quantity_type("force", gt=0)
SlidingForce = quantity_type("force", ge=0)
Stiffness = quantity_type("stiffness", ge=0)
PositiveStiffness = quantity_type("stiffness", gt=0)
Damping = quantity_type("damping", ge=0)
Speed = quantity_type("speed")
Duration = quantity_type("time", gt=0)
Spread = quantity_type("time", ge=0)
Pressure = quantity_type("pressure", gt=0)
HertzConstant = quantity_type("Hertz constant", gt=0)
Acceleration = quantity_type("acceleration", ge=0)
PositiveAcceleration = quantity_type("acceleration", gt=0)
Angle = quantity_type("angle")
PositiveAngle = quantity_type("angle", gt=0)
MaterialDamping = quantity_type("time", ge=0, le=2e-5)
TimePerLength = quantity_type("time per length", ge=0)
Inertia = quantity_type("moment of inertia", gt=0)
BendingStiffness = quantity_type("bending stiffness", gt=0)
MassPerLength = quantity_type("mass per length", gt=0)
InertiaPerLength = quantity_type("inertia per length", gt=0)
AngularStiffness = quantity_type("angular stiffness", ge=0)
PositiveAngularStiffness = quantity_type("angular stiffness", gt=0)
AngularDamping = quantity_type("angular damping", ge=0)
Friction = quantity_type("number", gt=0)
Coefficient = quantity_type("number", gt=0)
Share = quantity_type("number", ge=0)
Frequency = quantity_type("frequency", gt=0)
Voltage = quantity_type("voltage", gt=0)
CutoffFrequency = quantity_type("frequency", ge=100.0, le=50e3)
NoiseDensity = quantity_type("acceleration noise density", ge=0)
SignedAcceleration = quantity_type("acceleration")
