"""Errors of a description in one line: pydantic's errors become `InputError`s."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, get_args

from pydantic import ValidationError

from wheeltapper.ground.errors import InputError, value_text, with_suggestion

TAGS = {"all", "places", "literal['equilibrium']"}
"""Parts of the locations in pydantic's messages that are neither fields nor names of nouns."""
Location = tuple[int | str, ...]


def one_line_error(error: ValidationError, root: Any, kinds: Mapping[str, Any]) -> InputError:
    """Return pydantic's first error as one clear message.

    Parameters
    ----------
    error
        Pydantic's error.
    root
        The noun that was asked for; that whose construction failed may be made of it.
    kinds
        All nouns by name.
    """
    first: Any = min(
        error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden"
    )  # a misspelt name explains what is missing
    location, given, context = first["loc"], first.get("input"), first.get("ctx", {})
    field = ".".join(str(part) for part in location if part not in kinds and part not in TAGS)
    match first["type"]:
        case "extra_forbidden":
            name = str(location[-1])
            allowed = with_suggestion(name, _fields_at(location, kinds.get(error.title, root), kinds)) or "no fields"
            return InputError("", field, f"the unknown name {name!r}", allowed)
        case "missing":
            return InputError("", field, "nothing", "a value, which is required here")
        case "union_tag_not_found":
            return InputError("", f"{field}.type", "nothing", "the type of the noun, which is required here")
        case "union_tag_invalid":
            return _of_another_kind(field, given, context)
        case "value_error":
            error = context["error"]
            return error.within(field) if isinstance(error, InputError) else InputError("", field, str(error), "")
        case "too_short" | "too_long":
            some = "at least" if first["type"] == "too_short" else "at most"
            bound = context.get("min_length", context.get("max_length"))
            return InputError("", field, f"{context['actual_length']} values", f"{some} {bound}")
        case "literal_error" if isinstance(given, str):
            names = re.findall("'([^']*)'", context["expected"])
            return InputError("", field, value_text(given), with_suggestion(given, names, context["expected"]))
        case "model_type" | "model_attributes_type":
            return InputError("", field, value_text(given), f"{context['class_name']}, or a table of its fields")
        case "tuple_type" | "dict_type":
            return InputError("", field, value_text(given), "a list" if first["type"] == "tuple_type" else "a table")
    return InputError("", field, value_text(given), re.sub(r"^(Input should be |\w+ should have )", "", first["msg"]))


def _of_another_kind(field: str, given: Any, context: dict[str, Any]) -> InputError:
    expected = str(context["expected_tags"])
    if not isinstance(given, dict):
        return InputError("", field, value_text(given), expected)
    kind = str(given["type"])
    return InputError(
        "",
        f"{field}.type",
        value_text(given["type"]),
        with_suggestion(kind, re.findall("'([^']*)'", expected), expected),
    )


def _fields_at(location: Location, root: Any, kinds: Mapping[str, Any]) -> list[str]:
    """Return the names that are allowed in place of an unknown one."""
    here: Any = root
    for part in location[:-1]:
        if part in kinds:
            here = kinds[str(part)]
            continue
        field = getattr(here, "model_fields", {}).get(part)
        candidates = [field.annotation, *get_args(field.annotation)] if field else []
        here = next((c for c in candidates if hasattr(c, "model_fields")), here)
    return list(here.model_fields)
