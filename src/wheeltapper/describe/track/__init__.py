"""Tracks."""

from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.stiff import StiffTrack

__all__ = ["FloatingDeck", "StiffTrack"]
