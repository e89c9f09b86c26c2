"""Fields that hold one of several nouns, whichever are registered."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Union

from pydantic import Discriminator, GetCoreSchemaHandler, GetJsonSchemaHandler, Tag, TypeAdapter
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from wheeltapper.describe.registry import is_abstract, makeable_nouns


class OneOf:
    """In the type of a field: any noun of a family that is registered by then; in a table, `type` says which.

    Parameters
    ----------
    family
        What all of them are made of.
    """

    def __init__(self, family: type[Any]) -> None:
        self.family = family

    def read_noun(self, value: Any) -> Any:
        """Return the noun that is given, or that a table describes."""
        if isinstance(value, self.family) and not is_abstract(type(value)):
            return value
        return union_of_nouns(makeable_nouns(self.family)).validator.validate_python(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read_noun)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return handler(union_of_nouns(makeable_nouns(self.family)).core_schema)


def _type_tag(value: Any) -> str | None:
    return value.get("type") if isinstance(value, dict) else type(value).__name__


@lru_cache(maxsize=32)
def union_of_nouns(kinds: tuple[type[Any], ...]) -> TypeAdapter[Any]:
    """Return what makes one of these nouns from a table."""
    union: Any = Union[tuple(Annotated[kind, Tag(kind.__name__)] for kind in kinds)]  # noqa: UP007 - of a tuple
    return TypeAdapter(Annotated[union, Discriminator(_type_tag)])
