"""Tracks, and what can be asked of a track alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import front

if TYPE_CHECKING:
    from wheeltapper.ask.joints import jenkins as jenkins
    from wheeltapper.ask.joints import joint_forces as joint_forces
    from wheeltapper.ask.tracks import decay_rate as decay_rate
    from wheeltapper.ask.tracks import pinned_pinned as pinned_pinned
    from wheeltapper.ask.tracks import receptance as receptance
    from wheeltapper.ask.tracks import static_deflection as static_deflection
    from wheeltapper.describe.track import Anomaly as Anomaly
    from wheeltapper.describe.track import Ballasted as Ballasted
    from wheeltapper.describe.track import FloatingDeck as FloatingDeck
    from wheeltapper.describe.track import HangingSleeper as HangingSleeper
    from wheeltapper.describe.track import MissingPad as MissingPad
    from wheeltapper.describe.track import Rail as Rail
    from wheeltapper.describe.track import Scatter as Scatter
    from wheeltapper.describe.track import Slab as Slab
    from wheeltapper.describe.track import StiffTrack as StiffTrack
    from wheeltapper.describe.track import SupportedRail as SupportedRail
    from wheeltapper.describe.track import Track as Track
else:
    _ASKED = ("decay_rate", "pinned_pinned", "receptance", "static_deflection")
    _OF_JOINTS = ("jenkins", "joint_forces")
    __getattr__, __dir__ = front(
        __name__,
        "wheeltapper.describe.track",
        dict.fromkeys(_ASKED, "wheeltapper.ask.tracks") | dict.fromkeys(_OF_JOINTS, "wheeltapper.ask.joints"),
    )
