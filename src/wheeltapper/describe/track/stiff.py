"""A stiff track (the paper, Fig. 1a)."""

from __future__ import annotations

from wheeltapper.describe.noun import Noun


class StiffTrack(Noun):
    """A rail on a rigid foundation; only the contact deforms."""
