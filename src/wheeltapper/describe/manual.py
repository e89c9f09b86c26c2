"""The manual of a noun: its signature, and the description of each field in its docstring."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from inspect import Parameter, Signature
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, BeforeValidator
from pydantic_core import PydanticUndefined

from wheeltapper.describe.choice import OneOf
from wheeltapper.describe.registry import is_abstract, makeable_nouns, registered_in

HEADING = "Parameters\n----------\n"


class _ReadableType(str):
    """The readable form of a type; signatures print it without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


def readable_signature(kind: type[BaseModel]) -> Signature:
    """Return the fields with their allowed values."""
    return Signature(
        [
            Parameter(
                name, Parameter.KEYWORD_ONLY,
                annotation=_ReadableType(_readable_type(field.annotation, field.metadata)),
                default=Parameter.empty if field.is_required() else field.get_default(call_default_factory=True),
            )
            for name, field in kind.model_fields.items()
        ]
    )  # fmt: skip


def _readable_type(annotation: Any, metadata: Sequence[Any] = ()) -> str:
    """Return the allowed values of a field, without the details of reading and checking."""
    family = next((one.family for one in metadata if isinstance(one, OneOf)), None)
    if family is not None:
        return " | ".join(kind.__name__ for kind in makeable_nouns(family))
    given = [one.json_schema_input_type for one in metadata if isinstance(one, BeforeValidator)]
    if given and given[0] is not PydanticUndefined:
        return _readable_type(given[0])
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _readable_type(inside[0], inside[1:])
    if origin in (Union, UnionType):
        return " | ".join(_readable_type(one) for one in inside)
    if origin in (tuple, dict):
        return f"{origin.__name__}[{', '.join(_readable_type(one) for one in inside)}]"
    if annotation in (..., NoneType):
        return "..." if annotation is ... else "None"
    return (
        annotation.__name__
        if isinstance(annotation, type)
        else re.sub(r"typing\.|collections\.abc\.", "", str(annotation))
    )


def room_table(room: str) -> str:
    """Return a table, in reStructuredText, of what can be made in a room: how it is written, and what it is."""
    rows = [".. list-table::", "   :widths: 45 55", ""]
    for name, thing in registered_in(room).items():
        if not is_abstract(thing):
            first = " ".join((inspect.getdoc(thing) or "").partition("\n\n")[0].split()).removeprefix("Return ")
            words = re.sub(r"([*|\\])", r"\\\1", first).replace("`", "``")
            rows += [f"   * - ``{name}({_required_arguments(thing)})``", f"     - {words}"]
    return "\n".join([*rows, ""])


def _required_arguments(thing: Any) -> str:
    """Return the fields of a noun that must be given, or the arguments of a function with their defaults."""
    fields = inspect.signature(thing).parameters.values()
    if not inspect.isclass(thing):
        return ", ".join(f"{field.name}={field.default!r}" for field in fields)
    required = [field.name for field in fields if field.default is field.empty]
    return ", ".join([*required, *(["…"] if len(required) < len(fields) else [])])


def field_descriptions(kind: type[BaseModel]) -> dict[str, str]:
    """Return the descriptions of the fields in the docstring of a noun."""
    return {name: " ".join(words.split()) for names, words in _parameter_entries(kind) for name in names}


def completed_docstring(kind: type[BaseModel]) -> str:
    """Return the docstring of a noun, with its inherited fields, which help() would not show."""
    own = _parameter_entries(kind)
    known = {name for names, _ in own for name in names}
    inherited = [
        ([name for name in names if name not in known], words)
        for base in kind.__bases__
        for names, words in _parameter_entries(base)
    ]
    text = inspect.cleandoc(kind.__doc__ or "").partition(HEADING)[0].rstrip()
    section = "\n".join(f"{', '.join(names)}\n{words}" for names, words in inherited + own if names)
    return f"{text}\n\n{HEADING}{section}" if section else text


def _parameter_entries(kind: type) -> list[tuple[list[str], str]]:
    """Return the entries of a docstring's section "Parameters": names, and the text below them."""
    section = inspect.cleandoc(kind.__doc__ or "").partition(HEADING)[2]
    entries = (entry.partition("\n") for entry in re.split(r"\n(?=\S)", section) if entry)
    return [(names.split(", "), words) for names, _, words in entries]
