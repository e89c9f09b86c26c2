"""Tracks: rigid, or with a floating deck. Both are also names of `wheeltapper`."""

from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.stiff import StiffTrack

__all__ = ["FloatingDeck", "StiffTrack"]
