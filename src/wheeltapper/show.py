"""Shows: records as moving pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.ground.lazily import lazily

if TYPE_CHECKING:
    from wheeltapper.faces.animation.animate import animate as animate

_HOMES = {"animate": "faces.animation.animate"}
"""Public names of the room, and the module that holds each."""

__all__ = [*_HOMES]

__getattr__, __dir__ = lazily(__name__, _HOMES)
