"""Orbits: periodic motions of a wheel over a periodic irregularity, their branches, and on which of them starts end."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wheeltapper.orbits.basin import fates as fates
    from wheeltapper.orbits.borders import trace as trace
    from wheeltapper.orbits.branch import follow as follow
    from wheeltapper.orbits.diagram import ramp as ramp
    from wheeltapper.orbits.diagram import returns as returns
    from wheeltapper.orbits.orbit import Orbit as Orbit
    from wheeltapper.orbits.orbit import find as find

_HOMES = {
    "Orbit": "orbits.orbit",
    "fates": "orbits.basin",
    "find": "orbits.orbit",
    "follow": "orbits.branch",
    "ramp": "orbits.diagram",
    "returns": "orbits.diagram",
    "trace": "orbits.borders",
}
"""Public names of the room, and the module that holds each."""

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Import a name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"wheeltapper.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
