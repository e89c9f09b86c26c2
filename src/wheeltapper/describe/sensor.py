"""The sensor: between what it is placed on and the numbers in a file."""

from __future__ import annotations

from typing import ClassVar, Final, Literal

from pydantic import Field, model_validator

from wheeltapper.describe.noun import (
    Frequency,
    Length,
    NoiseDensity,
    Noun,
    PositiveAcceleration,
    Share,
    SignedAcceleration,
    Voltage,
)
from wheeltapper.describe.sensitivity import Bridge, meaning_of
from wheeltapper.ground.errors import InputError

DECK: Final = "deck acceleration"
BETWEEN_GAUGES = ("contact force", "rail shear force")
"""Kinds that read the force of a wheel while it is between two places, and nothing of it elsewhere."""
AT_A_SEAT = ("pad force", "sleeper force")
"""Kinds that share the force of a wheel with the seats beside them."""
OF_A_BRIDGE = ("excitation", "gauge_factor", "bridge_factor")
"""Fields of a bridge of strain gauges."""
OF_THE_DECK = ("noise", "range", "bits", "cutoff", "order", "offset", "drift")
"""Fields of the deck's accelerometer alone."""


class Sensor(Noun):
    """A sensor on the deck or on the track: an accelerometer with its filter and converter, or a channel of forces.

    Parameters
    ----------
    kind
        "deck acceleration", m/s², upwards; or a force, N, compression positive: "contact force" of an instrumented
        length from x1 to x2; "rail shear force" between two gauges at x1 and x2 (the difference of the two shear
        forces: what stands on the rail between them); "pad force" of a seat; "sleeper force" (on the ballast, or of a
        load cell under the sleeper).
    name
        Name of its column (channel) in the files, or of its file where a file has one column. "left 1" is also "left_1"
        and "WILD/left 1", as formats spell it.
    column
        Number of its column from 0, or another name of it, for files in which no column bears its name.
    x1, x2
        Positions along the track, m: of the two gauges, or of both ends of an instrumented length.
    x
        Position along the track of a seat, m.
    seat
        Number of the seat, instead of x: it lies at this times the site's spacing.
    side
        "left" or "right": the rail, seen in the direction of growing x. None: not told, or of both rails.
    unit
        What a 1 in the file is, if the file does not say it: "kN", "1.3 kN". Or the sensitivity, for files of what the
        sensor puts out: "250 kN/V" (files in V, mV), "12 kN/(mV/V)", "0.8 kN/(um/m)", "4 mV/kN".
    excitation, gauge_factor, bridge_factor
        Of a bridge of strain gauges, where the file holds another of V, mV/V and um/m than the sensitivity: voltage of
        the excitation, V; gauge factor k; number B of the arms that feel the strain. The output is k·B·strain/4 of the
        excitation.
    gain
        What it reads, over the true value; readings are divided by it.
    gain_uncertainty
        Relative standard deviation of the gain.
    rate
        Samples per second, Hz.
    noise
        Density of its white noise, m/s²/√Hz. The standard deviation of a sample is this times √(rate/2).
    range
        Largest acceleration of either sign, m/s²; beyond it samples are clipped. None: without bound.
    bits
        Resolution of the converter over twice the range; None: without steps.
    cutoff, order
        Cutoff frequency, Hz, and order of the Butterworth filter before the converter. None: no filter.
    offset, drift
        Offset that is added, m/s², and its growth, m/s² per s.
    """

    written_if_given: ClassVar[tuple[str, ...]] = ("rate",)
    """Fields whose default is not written back: where they are not given, a recording's own count."""
    kind: Literal["deck acceleration", "contact force", "rail shear force", "pad force", "sleeper force"] = DECK
    name: str = ""
    column: int | str | None = None
    x1: Length | None = None
    x2: Length | None = None
    x: Length | None = None
    seat: int | None = None
    side: Literal["left", "right"] | None = None
    unit: str | None = None
    excitation: Voltage | None = None
    gauge_factor: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    bridge_factor: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    gain: float = Field(default=1.0, gt=0, allow_inf_nan=False)
    gain_uncertainty: Share = 0.0
    rate: Frequency = 20_000.0
    noise: NoiseDensity = 0.0
    range: PositiveAcceleration | None = None
    bits: int | None = Field(default=None, ge=4, le=32)
    cutoff: Frequency | None = None
    order: int = Field(default=8, ge=1, le=12)
    offset: SignedAcceleration = 0.0
    drift: float = 0.0

    @model_validator(mode="after")
    def _check_place(self) -> Sensor:
        places = ("x1", "x2") if self.kind in BETWEEN_GAUGES else ("x", "seat") if self.kind in AT_A_SEAT else ()
        others = {"x1", "x2", "x", "seat"} - set(places)
        if self.kind == DECK:
            others |= {"side", "gain", "gain_uncertainty", "unit", *OF_A_BRIDGE}
        else:
            others |= set(OF_THE_DECK)
        fields = type(self).model_fields
        for name in fields:
            if name in others and getattr(self, name) != fields[name].default:
                raise InputError("", name, f"it for a sensor of the kind {self.kind!r}", _fields_text(self.kind))
        if self.unit is not None and meaning_of(self.unit).quantity != "force":
            raise InputError("", "unit", f"{self.unit!r} of a {self.kind}", 'a force, as "kN", "1.3 kN", "250 kN/V"')
        if self.x1 is not None and self.x2 is not None:
            if not self.x1 < self.x2:
                raise InputError("", "x2", f"{self.x2:g} m with x1 at {self.x1:g} m", "a place beyond x1")
        elif self.kind in BETWEEN_GAUGES:
            raise InputError("", "x1", f"no places of a {self.kind}", _fields_text(self.kind))
        if self.kind in AT_A_SEAT and (self.x is None) == (self.seat is None):
            found = "both x and seat" if self.seat is not None else f"no place of a {self.kind}"
            raise InputError("", "x", found, "either x or seat")
        return self

    @property
    def bridge(self) -> Bridge:
        """What is known of its bridge."""
        volts = None if self.excitation is None else float(self.excitation)
        return Bridge(volts, self.gauge_factor, self.bridge_factor)

    @property
    def ends(self) -> tuple[float, float] | None:
        """Where the piece of rail that it weighs begins and ends, m; None for other kinds."""
        return None if self.x1 is None or self.x2 is None else (float(self.x1), float(self.x2))


def _fields_text(kind: str) -> str:
    """Return which fields a sensor of a kind has, for messages."""
    if kind == DECK:
        return "name, rate, noise, range, bits, cutoff, order, offset, drift"
    place = "x1 and x2" if kind in BETWEEN_GAUGES else "x or seat"
    return f"{place}, name, column, side, unit, {', '.join(OF_A_BRIDGE)}, gain, gain_uncertainty, rate"
