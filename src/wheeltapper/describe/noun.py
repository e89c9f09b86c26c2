"""What all nouns share: frozen, strict about names, with units in strings."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_serializer, model_validator

from wheeltapper.ground.quantities import to_si


class Noun(BaseModel):
    """A frozen description: equal by value, hashable, picklable, printable; unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, validate_default=False)

    @model_validator(mode="before")
    @classmethod
    def _take_type(cls, data: Any) -> Any:
        if isinstance(data, dict) and "type" in data and "type" not in cls.model_fields:
            if data["type"] != cls.__name__:
                raise ValueError(f"found type {data['type']!r}; allowed: {cls.__name__!r}")
            return {name: value for name, value in data.items() if name != "type"}
        return data

    @model_serializer(mode="wrap")
    def _give_type(self, handler: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        plain = {name: value for name, value in handler(self).items() if value is not None}
        return {"type": type(self).__name__} | plain

    def __eq__(self, other: object) -> bool:
        # Fields only: what a noun has computed once (a spline, say) is kept beside them and says nothing new.
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)


def _reader(dimension: str) -> Callable[[Any], float]:
    def read(value: Any) -> float:
        number = to_si(value, dimension)
        if not isfinite(number):
            raise ValueError(f"found {value!r}; allowed: a finite {dimension}")
        return number

    return read


def quantity(dimension: str, **bounds: Any) -> Any:
    """Return the annotated type of a quantity: a float in SI units, or a string with a unit."""
    schema: dict[str, Any] = {
        "type": ["number", "string"],
        "description": f"{dimension}: a number in SI units, or with a unit",
    }
    return Annotated[
        float,
        BeforeValidator(_reader(dimension), json_schema_input_type=float | str),
        Field(json_schema_extra=schema, **bounds),
    ]


Length = quantity("length")
PositiveLength = quantity("length", gt=0)
Mass = quantity("mass", gt=0)
Force = quantity("force")
PositiveForce = quantity("force", gt=0)
Stiffness = quantity("stiffness", ge=0)
PositiveStiffness = quantity("stiffness", gt=0)
Damping = quantity("damping", ge=0)
Speed = quantity("speed")
Duration = quantity("time", gt=0)
Pressure = quantity("pressure", gt=0)
HertzConstant = quantity("Hertz constant", gt=0)
Acceleration = quantity("acceleration", ge=0)
PositiveAcceleration = quantity("acceleration", gt=0)
Angle = quantity("angle")
TimePerLength = quantity("time per length", ge=0)
Inertia = quantity("moment of inertia", gt=0)
AngularStiffness = quantity("angular stiffness", ge=0)
Friction = quantity("number", gt=0)
Share = quantity("number", ge=0)
Frequency = quantity("frequency", gt=0)
NoiseDensity = quantity("acceleration noise density", ge=0)
SignedAcceleration = quantity("acceleration")
