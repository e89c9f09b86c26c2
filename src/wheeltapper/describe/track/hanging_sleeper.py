"""A hanging sleeper."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.noun import Gap
from wheeltapper.describe.track.anomaly import Anomaly, Change


class HangingSleeper(Anomaly):
    """A sleeper without ballast, or above a void.

    From the instant at which the sleeper's deflection s closes a void v, the ballast presses with k_b·(s - v) + c_b·ṡ,
    as long as this is positive: it never pulls. As everywhere on the track, deflections count from the rail without a
    load, and the weight of rail and sleepers is left out. The record's `events` say when the void closes and opens.

    Parameters
    ----------
    seat
        Number of the seat; the one at `first_sleeper` is 0.
    void
        Gap under the sleeper without a load, m, 0 or more; None: the ballast is gone.
    """

    example: ClassVar[dict[str, Any]] = {"seat": 1}
    seat: int
    void: Gap | None = None

    @property
    def of_ballast(self) -> bool:
        """True: it needs a track with sleepers on ballast."""
        return True

    @property
    def places(self) -> tuple[int, ...]:
        """The seat."""
        return (self.seat,)

    def changes(self, seats: range) -> tuple[Change, ...]:
        """Return what it changes at these seats."""
        if self.seat not in seats:
            return ()
        return (Change(self.seat, ballast=0.0) if self.void is None else Change(self.seat, void=float(self.void)),)
