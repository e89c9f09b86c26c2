"""A missing rail pad."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.track.anomaly import Anomaly, Change


class MissingPad(Anomaly):
    """A seat at which nothing holds the rail: neither pad nor fastening.

    Parameters
    ----------
    seat
        Number of the seat; the one at `first_sleeper` is 0.
    """

    example: ClassVar[dict[str, Any]] = {"seat": 1}
    seat: int

    @property
    def places(self) -> tuple[int, ...]:
        """The seat."""
        return (self.seat,)

    def changes(self, seats: range) -> tuple[Change, ...]:
        """Return what it changes at these seats."""
        return (Change(self.seat, pad=0.0),) if self.seat in seats else ()
