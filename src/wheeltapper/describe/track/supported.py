"""What tracks with flexible rails on discrete supports have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

from wheeltapper.describe.noun import CutoffFrequency, Damping, Length, PositiveLength, PositiveStiffness
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.track.rail import Rail, as_rail
from wheeltapper.ground.needs import FLEXIBLE_TRACK, Need


class SupportedRail(Track, abstract=True):
    """A rail on equal supports at equal distances, without end.

    Parameters
    ----------
    rail
        The rail, or its name.
    spacing
        Distance between seats, m.
    pad_stiffness, pad_damping
        Of the rail pad, per seat: N/m and N·s/m.
    first_sleeper
        Position of a seat, m; the others are at first_sleeper + n·spacing for all whole n.
    cutoff
        Of the modes that stand for the track, Hz, 100 to 50 000; None: 5 kHz, by the strict method 8 kHz.
    bays
        Of the ring that stands for the track, at least 8; None: 80, by the strict method 100, and more where waves
        decay slowly.
    source
        Where the numbers come from; it has no effect.
    """

    rail: Annotated[Rail, BeforeValidator(as_rail, json_schema_input_type=Rail | str)]
    spacing: PositiveLength
    pad_stiffness: PositiveStiffness
    pad_damping: Damping
    first_sleeper: Length = 0.0
    cutoff: CutoffFrequency | None = None
    bays: int | None = Field(default=None, ge=8)
    source: str = ""

    @property
    def needs(self) -> frozenset[Need]:
        """Rails on sleepers."""
        return frozenset({FLEXIBLE_TRACK})

    @property
    def under_pads(self) -> tuple[float, ...]:
        """Mass, stiffness and damping under each pad, kg, N/m and N·s/m; nothing where the ground is rigid."""
        return ()
