"""Shows: the explorer in the browser and in notebooks, and records as moving pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.ground.lazily import lazily

if TYPE_CHECKING:
    from wheeltapper.faces.animation.animate import animate as animate
    from wheeltapper.faces.explore.launch import Explorer as Explorer
    from wheeltapper.faces.explore.launch import explore as explore
    from wheeltapper.faces.explore.notebook import widget as widget

_HOMES = {
    "animate": "faces.animation.animate",
    "Explorer": "faces.explore.launch",
    "explore": "faces.explore.launch",
    "widget": "faces.explore.notebook",
}
"""Public names of the room, and the module that holds each."""

__all__ = [*_HOMES]

__getattr__, __dir__ = lazily(__name__, _HOMES)
