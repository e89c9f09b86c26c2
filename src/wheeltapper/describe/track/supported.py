"""What tracks with flexible rails on discrete supports have in common."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from wheeltapper.describe.choice import OneOf
from wheeltapper.describe.noun import CutoffFrequency, Damping, Length, PositiveLength, PositiveStiffness
from wheeltapper.describe.track.anomaly import Anomaly
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.track.rail import Rail, as_rail
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import ANOMALY, FLEXIBLE_TRACK, VOID, Need


def _as_tuple(value: Any) -> Any:
    return (value,) if isinstance(value, Anomaly | dict) else value


class SupportedRail(Track, abstract=True):
    """An endless rail on equal supports at equal distances.

    Parameters
    ----------
    rail
        The rail, or its name.
    spacing
        Distance between seats, m.
    pad_stiffness, pad_damping
        Stiffness and damping of the rail pad, per seat, N/m and N·s/m.
    first_sleeper
        Position of a seat, m; the others are at first_sleeper + n·spacing for all whole n.
    cutoff
        Cut-off frequency of the track's modes, Hz, 100 to 50 000; None: 5 kHz, by the strict method 8 kHz.
    bays
        Number of bays of the ring that replaces the endless track, at least 8; None: 80, by the strict method 100, and
        more where waves decay slowly.
    source
        Where the numbers come from; it has no effect.
    anomalies
        Seats that differ from the others: `HangingSleeper`, `MissingPad`, `Scatter`.
    """

    rail: Annotated[Rail, BeforeValidator(as_rail, json_schema_input_type=Rail | str)]
    spacing: PositiveLength
    pad_stiffness: PositiveStiffness
    pad_damping: Damping
    first_sleeper: Length = 0.0
    cutoff: CutoffFrequency | None = None
    bays: int | None = Field(default=None, ge=8)
    source: str = ""
    anomalies: Annotated[tuple[Annotated[Any, OneOf(Anomaly)], ...], BeforeValidator(_as_tuple)] = ()

    @model_validator(mode="after")
    def _check_anomalies(self) -> SupportedRail:
        for i, item in enumerate(self.anomalies):
            field, name = f"anomalies.{i}", type(item).__name__
            if item.of_ballast and not self.under_pads:
                raise InputError("", field, f"a {name} of ballast on a {type(self).__name__}", "anomalies of pads")
            same = [other for other in self.anomalies[:i] if type(other) is type(item)]
            if any(other.places == item.places for other in same):
                where = f" at seat {item.places[0]}" if item.places else ""
                raise InputError("", field, f"a second {name}{where}", "one")
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: rails on sleepers, and their anomalies."""
        own = {FLEXIBLE_TRACK, *([ANOMALY] if self.anomalies else [])}
        for item in self.anomalies:
            seats = range(min(item.places), max(item.places) + 1) if item.places else range(0)
            if any(change.void is not None for change in item.changes(seats)):
                own.add(VOID)
        return frozenset(own)

    @property
    def under_pads(self) -> tuple[float, ...]:
        """Mass, stiffness and damping under each pad, kg, N/m and N·s/m; empty where the ground is rigid."""
        return ()

    @property
    def rolls(self) -> bool:
        """Whether sleepers that roll differ from half-sleepers that move independently."""
        return self.under_rolling_pads != self.under_pads

    @property
    def under_rolling_pads(self) -> tuple[float, ...]:
        """As `under_pads`, where the two rails move against each other, so that sleepers roll."""
        return self.under_pads
