"""Registrations that end with a test."""

from collections.abc import Iterator
from contextlib import contextmanager

from wheeltapper.describe.registry import everything, forget


@contextmanager
def undone() -> Iterator[None]:
    """Forget at the end whatever was registered inside."""
    before = everything()
    try:
        yield
    finally:
        for name, thing in everything().items():
            if name not in before:
                forget(thing)
