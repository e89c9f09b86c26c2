"""Tracks: what carries the rail."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.track.anomaly import Anomaly as Anomaly
    from wheeltapper.describe.track.ballasted import Ballasted as Ballasted
    from wheeltapper.describe.track.base import Track as Track
    from wheeltapper.describe.track.deck import FloatingDeck as FloatingDeck
    from wheeltapper.describe.track.hanging_sleeper import HangingSleeper as HangingSleeper
    from wheeltapper.describe.track.missing_pad import MissingPad as MissingPad
    from wheeltapper.describe.track.rail import Rail as Rail
    from wheeltapper.describe.track.scatter import Scatter as Scatter
    from wheeltapper.describe.track.slab import Slab as Slab
    from wheeltapper.describe.track.stiff import StiffTrack as StiffTrack
    from wheeltapper.describe.track.supported import SupportedRail as SupportedRail
else:
    __getattr__, __dir__ = room(__name__)
