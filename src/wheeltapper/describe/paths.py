"""Dotted paths to what a noun holds, as "vehicle.damping" or "irregularity.0.height"."""

from __future__ import annotations

from typing import Any

from wheeltapper.describe.noun import Noun
from wheeltapper.describe.placement import Placement
from wheeltapper.ground.errors import InputError, value_text, with_suggestion


def held_at(root: Noun, path: str) -> tuple[Noun, str, Any]:
    """Return the noun that holds a field, the name of the field in it, and what stands at the path.

    Raises
    ------
    InputError
        If there is no such field.
    """
    if not isinstance(path, str):
        raise InputError("", value_text(path), "no path", 'a path of a field, as "vehicle.damping"')
    holder, name, value = root, "", root
    parts = path.split(".")
    for place, part in enumerate(parts):
        holder, name = (value, part) if isinstance(value, Noun) else (holder, name)
        if isinstance(value, Noun) and part in type(value).model_fields:
            value = getattr(value, part)
        elif isinstance(value, tuple) and part.isdigit() and int(part) < len(value):
            value = value[int(part)]
        elif isinstance(value, Placement) and part in value:
            value = value[part]
        else:
            items = value if isinstance(value, tuple) else ()
            known = type(value).model_fields if isinstance(value, Noun) else range(len(items))
            allowed = with_suggestion(part, map(str, known)) or "nothing here"
            if items and not part.isdigit():
                numbered = ".".join([*parts[:place], "0", *parts[place:]])
                allowed = f"the number of an item before it, as in {numbered!r}"
            raise InputError("", path, f"no such field {part!r}", allowed)
    return holder, name, value
