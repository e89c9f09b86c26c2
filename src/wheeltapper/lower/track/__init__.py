"""Tracks lowered: the waves of an infinite track, and rings of complex modes (docs/theory/track.rst)."""
