"""Tracks, one file each."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.track.base import Track as Track
    from wheeltapper.describe.track.deck import FloatingDeck as FloatingDeck
    from wheeltapper.describe.track.stiff import StiffTrack as StiffTrack
else:
    __getattr__, __dir__ = room(__name__)
