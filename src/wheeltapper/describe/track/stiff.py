"""A stiff track (the paper, Fig. 1a)."""

from __future__ import annotations

from wheeltapper.describe.track.base import Track


class StiffTrack(Track):
    """A rail on a rigid foundation; only the contact deforms."""
