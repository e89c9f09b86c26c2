"""Sensors along the track: between two places of the rail, at one place of it, or at a seat."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from wheeltapper.describe.noun import Length, Share, Voltage
from wheeltapper.describe.sensitivity import WRITTEN, Bridge, Quantity, meaning_of
from wheeltapper.describe.sensor.base import FilteredSensor, FloatArray, Seen
from wheeltapper.ground.errors import InputError

FARTHEST_SEAT = 1_000_000
"""Largest number of a seat."""


class AlongTrack(FilteredSensor, abstract=True):
    """A sensor along the track, on one rail or on both.

    Parameters
    ----------
    side
        "left" or "right": the rail, seen in the direction of growing x. None: not stated, or both rails.
    unit
        What a 1 in the file means, if the file does not state its unit: "kN", "1.3 kN". If the file holds the output of
        the sensor, its sensitivity: "250 kN/V" (files in V, mV), "12 kN/(mV/V)", "0.8 kN/(um/m)", "4 mV/kN". For a
        sensor of strains, "um/m" is the strain itself, and "500 (um/m)/V" its sensitivity.
    excitation, gauge_factor, bridge_factor
        Of a bridge of strain gauges: voltage of the excitation, V; gauge factor k; number B of the arms that feel the
        strain. The output is k·B·strain/4 of the excitation. They are needed if the file holds another of V, mV/V and
        um/m than the sensitivity.
    gain
        A reading divided by the true value; readings are divided by the gain.
    gain_uncertainty
        Relative standard deviation of the gain.
    """

    quantity: ClassVar[Quantity] = "force"
    side: Literal["left", "right"] | None = None
    unit: str | None = None
    excitation: Voltage | None = None
    gauge_factor: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    bridge_factor: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    gain: float = Field(default=1.0, gt=0, allow_inf_nan=False)
    gain_uncertainty: Share = 0.0

    @model_validator(mode="after")
    def _check_unit(self) -> AlongTrack:
        if self.unit is not None and meaning_of(self.unit, self.quantity).quantity != self.quantity:
            allowed = f"a {self.quantity}, as {WRITTEN[self.quantity]}"
            raise InputError("", "unit", f"{self.unit!r} of a {self.kind}", allowed)
        return self

    @property
    def bridge(self) -> Bridge:
        """What is known of its bridge."""
        volts = None if self.excitation is None else float(self.excitation)
        return Bridge(volts, self.gauge_factor, self.bridge_factor)

    @property
    def ends(self) -> tuple[float, float] | None:
        """Where the piece of rail on which it reads wheels begins and ends, m; None at a seat."""
        return None

    @property
    def rail_places(self) -> tuple[float, ...]:
        """Places along the rail at which it reads the track, m."""
        return ()

    def extent(self, spacing: float | None) -> tuple[float, float]:
        """Return the two ends of the part of the track that it reads, m; `spacing` is the distance between seats, m."""
        raise InputError("", "kind", f"{self.kind!r}, of which nobody says where it is", "a method `extent`")

    def true_values(self, seen: Seen) -> FloatArray:
        """Return its readings of a run as with a gain of 1, in SI units, (times,)."""
        found = f"{self.kind!r}, of which nobody says what it reads of a run"
        raise InputError("", "kind", found, "a method `true_values`")

    def samples(self, seen: Seen) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return the samples that it would record of a run, in SI units; no sample is clipped."""
        values = self.gain * seen.behind_filter(self._checked_values, self.cutoff(self.rate))
        return values, np.zeros(len(values), dtype=bool)

    def _checked_values(self, seen: Seen) -> FloatArray:
        """Return the `true_values`, of which there must be as many as times."""
        values = np.asarray(self.true_values(seen), dtype=float)
        if values.shape != seen.times.shape:
            found = f"values of a {self.kind} in the shape {values.shape}"
            raise InputError("", "true_values", found, f"one for each of the {len(seen.times)} times")
        return values


class BetweenPlaces(AlongTrack, abstract=True):
    """A sensor that reads the force on the rail between two places.

    Parameters
    ----------
    x1, x2
        Positions along the track, m: of two gauges, or of both ends of an instrumented length.
    """

    place_words: ClassVar[str] = "x1 and x2"
    example: ClassVar[dict[str, Any]] = {"x1": 0.1, "x2": 0.5}
    x1: Length
    x2: Length

    @model_validator(mode="before")
    @classmethod
    def _check_places_given(cls, data: Any) -> Any:
        known = isinstance(data, dict) and {*data} <= {*cls.model_fields, "type"}  # else the wrong name is told
        if known and (data.get("x1") is None or data.get("x2") is None):
            raise InputError("", "x1", f"no places of a {cls.model_fields['kind'].default}", cls._field_words())
        return data

    @model_validator(mode="after")
    def _check_order(self) -> BetweenPlaces:
        if not self.x1 < self.x2:
            raise InputError("", "x2", f"{self.x2:g} m with x1 at {self.x1:g} m", "a place beyond x1")
        return self

    @property
    def ends(self) -> tuple[float, float]:
        """Where the piece of rail on which it reads wheels begins and ends, m."""
        return float(self.x1), float(self.x2)

    def extent(self, spacing: float | None) -> tuple[float, float]:
        """Return its ends, m."""
        return self.ends


class AtPlace(AlongTrack, abstract=True):
    """A sensor at one place of the rail.

    Parameters
    ----------
    x
        Position along the track, m.
    """

    place_words: ClassVar[str] = "x"
    example: ClassVar[dict[str, Any]] = {"x": 0.3}
    x: Length

    @property
    def rail_places(self) -> tuple[float, ...]:
        """Where it reads the rail, m."""
        return (float(self.x),)

    def extent(self, spacing: float | None) -> tuple[float, float]:
        """Return its place, m, twice."""
        return float(self.x), float(self.x)


class AtSeat(AlongTrack, abstract=True):
    """A sensor at a seat.

    Parameters
    ----------
    x
        Position along the track of the seat, m.
    seat
        Number of the seat, instead of x. On a site the seat lies at this number times the site's spacing. Without a
        site it is a seat of the run's own track, where number 0 is at `first_sleeper`.
    """

    place_words: ClassVar[str] = "x or seat"
    example: ClassVar[dict[str, Any]] = {"seat": 3}
    x: Length | None = None
    seat: int | None = Field(default=None, ge=-FARTHEST_SEAT, le=FARTHEST_SEAT)

    @model_validator(mode="after")
    def _check_place(self) -> AtSeat:
        if (self.x is None) == (self.seat is None):
            found = "both x and seat" if self.seat is not None else f"no place of a {self.kind}"
            raise InputError("", "x", found, "either x or seat")
        return self

    def extent(self, spacing: float | None) -> tuple[float, float]:
        """Return the place of the seat, m, twice."""
        place = float(self.x) if self.x is not None else (self.seat or 0) * float(spacing or 0.0)
        return place, place
