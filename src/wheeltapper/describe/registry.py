"""What there is of every family, registered once: by the class statement of a noun, by the decorator of a feature.

A room is a folder of modules, one law in each. They are found by themselves when something of the room is first asked
for, and what is registered outside the package stands beside them. Whoever needs a list takes it from here: the
scenario, its files and their schema, the rooms of the front door, the documentation, the conformance tests.
"""

from __future__ import annotations

import pkgutil
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

from wheeltapper.ground.errors import InputError

PACKAGE = "wheeltapper."

_held: dict[str, dict[str, Any]] = {}
"""What is registered, by room and name."""
_abstract: set[Any] = set()
"""Nouns that only others are made of."""
_choices: dict[Any, tuple[type[Any], ...]] = {}
"""What `makeable_nouns` has found since the last registration."""
_rooms: list[str] = []
_fronts: dict[str, str] = {}
"""Modules in front of a room, which offer more than its nouns, and the room of each."""
_searched: set[str] = set()
"""Rooms whose modules are all imported."""


def room_of(kind: type[Any]) -> str:
    """Return the room of a noun's class: of one defined elsewhere, that of its nearest ancestor in the package."""
    modules = (base.__module__ for base in kind.__mro__)
    return next(module for module in modules if module.startswith(PACKAGE)).rpartition(".")[0]


def register(thing: Any, room: str, *, abstract: bool = False) -> None:
    """Add a noun's class, or the function that makes a feature, to a room.

    It replaces one of its name from the same module, as when a cell of a notebook is run again.

    Raises
    ------
    InputError
        If another module has registered something of this name.
    """
    name = thing.__name__
    if not thing.__module__.startswith(room):
        import_room(room)
    before = _held.setdefault(room, {}).setdefault(name, thing)
    if _origin_of(before) != _origin_of(thing):
        raise InputError("", name, f"a second {name}, beside that of {before.__module__}", "a name that is not taken")
    _held[room][name] = thing
    if abstract:
        _abstract.add(thing)
    _choices.clear()


def _origin_of(thing: Any) -> str:
    """Return where something was defined; a script that runs again in a worker process is the same script."""
    return str(thing.__module__).replace("__mp_main__", "__main__")


def unregister(thing: Any) -> None:
    """Undo a registration."""
    name = thing.__name__
    for held in _held.values():
        if held.get(name) is thing:
            del held[name]
    _abstract.discard(thing)
    _choices.clear()


def is_abstract(kind: type[Any]) -> bool:
    """Return True for a noun that only others are made of."""
    return kind in _abstract


def import_room(room: str) -> None:
    """Import all modules of a room, once."""
    if room not in _searched:
        for name in module_names(room):
            import_module(f"{room}.{name}")
        _searched.add(room)


@cache
def module_names(room: str) -> tuple[str, ...]:
    """Return the names of a room's modules."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(import_module(room).__path__)))


def registered_in(room: str) -> dict[str, Any]:
    """Return what is registered in a room, or in that behind a front, by name and sorted by it."""
    room = _fronts.get(room, room)
    import_room(room)
    return dict(sorted(_held.get(room, {}).items()))


def all_registered() -> dict[str, Any]:
    """Return what is registered in all rooms that were entered, and outside of rooms."""
    for room in _rooms:
        import_room(room)
    return {name: thing for held in _held.values() for name, thing in held.items()}


def makeable_nouns(family: type[Any]) -> tuple[type[Any], ...]:
    """Return all nouns of a family that can be made, sorted by their names."""
    if family not in _choices:
        kinds = registered_in(room_of(family)).values()
        _choices[family] = tuple(kind for kind in kinds if issubclass(kind, family) and not is_abstract(kind))
    return _choices[family]


def room(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions `__getattr__` and `__dir__` of a folder that becomes a room.

    It offers what is registered in it, and what its modules name in their `__all__`.
    """
    _rooms.append(package)

    def offered_by_name() -> dict[str, Any]:
        out = registered_in(package)
        for name in module_names(package):
            module = sys.modules[f"{package}.{name}"]
            out |= {word: getattr(module, word) for word in getattr(module, "__all__", ())}
        return out

    def offered_object(name: str) -> Any:
        if name == "__all__":
            return sorted(offered_by_name())
        if not name.startswith("_") and name not in module_names(package):  # a module is imported by who asks for it
            found = offered_by_name()
            if name in found:
                return found[name]
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return offered_object, lambda: sorted(offered_by_name())


def front(name: str, package: str, homes: dict[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions `__getattr__` and `__dir__` of a module in front of a room.

    It offers what the room does, and functions of floors above the descriptions, which a room cannot know.

    Parameters
    ----------
    name
        Of the module.
    package
        The room.
    homes
        Further names, and the module of each.
    """
    _fronts[name] = package

    def offered_object(word: str) -> Any:
        if word == "__all__":
            return sorted({*dir(import_module(package)), *homes})
        if word.startswith("_"):
            raise AttributeError(f"module {name!r} has no attribute {word!r}")
        return getattr(import_module(homes.get(word, package)), word)

    return offered_object, lambda: list(offered_object("__all__"))
