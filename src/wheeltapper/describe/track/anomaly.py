"""What every anomaly of a track is."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

from wheeltapper.describe.noun import Noun


class Change(NamedTuple):
    """What an anomaly makes of one seat.

    Attributes
    ----------
    seat
        Its number; that at `first_sleeper` is 0.
    pad, ballast
        Factors on stiffness and damping.
    void
        Gap between sleeper and ballast at rest, m; None: there is none, and the ballast acts both ways.
    """

    seat: int
    pad: float = 1.0
    ballast: float = 1.0
    void: float | None = None


class Anomaly(Noun, abstract=True):
    """Seats of a track that differ from the others; in a scenario `track.anomalies`, in a file `[[track.anomalies]]`.

    In a run, a ring of bays replaces the endless track. Anomalies therefore recur after each length of the ring; the
    record's notes say so.
    """

    example: ClassVar[dict[str, Any]] = {}
    """Fields of an example, which the conformance tests make."""

    @property
    def of_ballast(self) -> bool:
        """Whether it needs a track with sleepers on ballast."""
        return False

    @property
    def places(self) -> tuple[int, ...]:
        """Numbers of the seats that it names; empty if it concerns all seats."""
        return ()

    def changes(self, seats: range) -> tuple[Change, ...]:
        """Return what it changes at these seats."""
        raise NotImplementedError
