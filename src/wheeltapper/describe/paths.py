"""Dotted paths to what a noun holds, as "vehicle.damping", "irregularity.0.height" or "vehicle.bodies.car body.mass".

Items of a list are found by their number from 0, by their name, or, where they have none, as "wheelset 1" and so on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from wheeltapper.describe.noun import Noun, nouns_by_name
from wheeltapper.describe.placement import Placement
from wheeltapper.ground.errors import InputError, value_text, with_suggestion

Key = str | int


def _names_of(items: tuple[Any, ...]) -> list[str]:
    """Return names of items of a list; a wheelset, which has a radius but no name, has its number from 1."""
    unnamed = [f"wheelset {i + 1}" if hasattr(item, "radius") else str(i) for i, item in enumerate(items)]
    named = (item.get("name") if isinstance(item, dict) else getattr(item, "name", None) for item in items)
    return [name if own is None else own for own, name in zip(named, unnamed, strict=True)]


def _child(value: Any, part: str) -> tuple[Key, Any] | None:
    """Return the key by which a noun, a list or a table holds a part of a path, and what it is; None if it does not."""
    if isinstance(value, tuple):
        names = _names_of(value)
        number = names.index(part) if part in names else int(part) if part.isdecimal() else len(value)
        return (number, value[number]) if number < len(value) else None
    if isinstance(value, Placement):
        return (part, value[part]) if part in value else None
    if isinstance(value, dict):  # a noun that is changed already
        kind: Any = nouns_by_name().get(str(value.get("type")))
        return (part, value.get(part)) if part in (value if kind is None else kind.model_fields) else None
    return (part, getattr(value, part)) if isinstance(value, Noun) and part in type(value).model_fields else None


def no_such_field(value: Any, parts: Sequence[str], place: int) -> InputError:
    """Return the refusal of a part of a path, at some place in it, that what is there does not hold."""
    part, names = parts[place], list[str]()
    if isinstance(value, Noun):
        names = list(type(value).model_fields)
    elif isinstance(value, dict):
        kind: Any = nouns_by_name().get(str(value.get("type")))
        names = list(value if kind is None else kind.model_fields)
    elif isinstance(value, tuple):
        names = _names_of(value)
        named = names[:1] != ["0"]
        if not part.isdecimal() and any(_child(item, part) is not None for item in value):
            numbered = ".".join([*parts[:place], names[0], *parts[place:]])
            allowed = f"the {'name' if named else 'number'} of an item before it, as in {numbered!r}"
            return InputError("", ".".join(parts), f"no such field {part!r}", allowed)
    allowed = with_suggestion(part, names) or "nothing in it"
    return InputError("", ".".join(parts), f"no such field {part!r}", allowed)


def _walked(root: Noun, path: str) -> list[tuple[Any, Key, Any]]:
    """Return for each part of a path what holds it, its key in that, and what stands there."""
    if not isinstance(path, str):
        raise InputError("", value_text(path), "no path", 'a path of a field, as "vehicle.damping"')
    parts, value, found = path.split("."), root, list[tuple[Any, Key, Any]]()
    for place, part in enumerate(parts):
        child = _child(value, part)
        if child is None:
            raise no_such_field(value, parts, place)
        found.append((value, *child))
        value = child[1]
    return found


def keys_of(root: Noun, path: str) -> tuple[Key, ...]:
    """Return the keys of a path: items of lists by their numbers, however they are named in it."""
    return tuple(key for _, key, _ in _walked(root, path))


def plain_path(root: Noun, path: str) -> str:
    """Return a path in which items of lists have their numbers."""
    return ".".join(map(str, keys_of(root, path)))


def value_at(root: Noun, path: str) -> Any:
    """Return what stands at a path."""
    return _walked(root, path)[-1][2]


def held_at(root: Noun, path: str) -> tuple[Noun, str, Any]:
    """Return the noun that holds a field, the name of the field in it, and what stands at the path.

    Raises
    ------
    InputError
        If there is no such field.
    """
    walked = _walked(root, path)
    holder, name = next((held, key) for held, key, _ in reversed(walked) if isinstance(held, Noun))
    return holder, str(name), walked[-1][2]


def with_value(value: Any, keys: Sequence[Key], new: Any) -> Any:
    """Return a noun, or nouns, with another value at a path; nothing is checked, as steps may lead beyond a bound."""
    if not keys:
        return new
    head, *deeper = keys
    if isinstance(value, Placement):
        return Placement(value | {str(head): with_value(value[str(head)], deeper, new)})
    if isinstance(head, int):
        return (*value[:head], with_value(value[head], deeper, new), *value[head + 1 :])
    return value.model_copy(update={head: with_value(getattr(value, head), deeper, new)})


def changed_values(root: Noun, changes: Any) -> dict[str, Any]:
    """Return the fields of a noun with other values at some paths, as a table that is to be checked.

    Raises
    ------
    InputError
        If a path leads nowhere.
    """
    if not isinstance(changes, dict) or not all(isinstance(path, str) for path in changes):
        raise InputError("", "changes", value_text(changes), 'paths with their values, as {"vehicle.mass": 1600}')
    values: dict[str, Any] = {name: getattr(root, name) for name in type(root).model_fields}
    for path, value in changes.items():
        parts = path.split(".")
        if parts[0] not in values:
            raise no_such_field(root, parts, 0)
        values[parts[0]] = _changed(values[parts[0]], parts, 1, value)
    return values


def _changed(value: Any, parts: list[str], place: int, new: Any) -> Any:
    """Return what the parts of a path before a place lead to, with another value at its end; None removes an item."""
    if place == len(parts):
        return new
    child = _child(value, parts[place])
    if child is None:
        raise no_such_field(value, parts, place)
    key, held = child
    changed = _changed(held, parts, place + 1, new)
    if isinstance(value, tuple):
        return (*value[: int(key)], *(() if changed is None else (changed,)), *value[int(key) + 1 :])
    if isinstance(value, dict):
        return dict(value) | {key: changed}
    given = {name: getattr(value, name) for name in value.model_fields_set}
    return {"type": type(value).__name__} | given | {key: changed}
