"""Registrations that end with a test."""

from collections.abc import Iterator
from contextlib import contextmanager

from wheeltapper.describe.registry import PACKAGE, all_registered, register, room_of, unregister


@contextmanager
def undone() -> Iterator[None]:
    """Forget at the end whatever was registered inside by others than the package, whose rooms are searched late.

    Nouns that were forgotten inside are registered again.
    """
    before = all_registered()
    try:
        yield
    finally:
        for name, thing in all_registered().items():
            if name not in before and not thing.__module__.startswith(PACKAGE):
                unregister(thing)
        for name, thing in before.items():
            if name not in all_registered() and isinstance(thing, type):
                register(thing, room_of(thing))
