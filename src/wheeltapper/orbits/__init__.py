"""Orbits: periodic motions of a wheel over a periodic irregularity, their branches, and on which of them starts end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.ground.lazily import lazily

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

__getattr__, __dir__ = lazily(__name__, _HOMES)
