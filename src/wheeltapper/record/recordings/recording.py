"""A recording: samples of a sensor over time, with facts about them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensitivity import QUANTITIES, Quantity
from wheeltapper.ground.arguments import as_names, as_quantity, as_table, check_choice, check_text
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown
from wheeltapper.record.arrays import as_array

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Shown):
    """Samples at a constant rate.

    Attributes
    ----------
    samples
        In SI units: m/s², N, m, or of strains a plain number; NaN where a sample is missing.
    rate
        Samples per second, Hz.
    quantity
        "deck acceleration" (upwards positive), "force" of an existing detector, "displacement", "strain" (positive in
        tension), or "vertical acceleration" of anything but a deck (upwards positive).
    start
        Time of the first sample after the trigger, s.
    clipped
        True for samples at the end of the sensor's range: the true value lies beyond.
    speed
        Measured speed of the passage, m/s; None if it was not measured.
    source
        File, or the way in which it was made.
    notes
        What was found in the file: gaps, clipping, doubled times and the like.
    truth
        For a synthetic recording: the true values.
    """

    samples: FloatArray
    rate: float
    quantity: Quantity = "deck acceleration"
    start: float = 0.0
    clipped: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    speed: float | None = None
    source: str = ""
    notes: tuple[str, ...] = ()
    truth: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_choice(self.quantity, "quantity", QUANTITIES)
        check_text(self.source, "source")
        samples = _per_sample("samples", self.samples, np.float64, QUANTITIES[self.quantity])
        clipped = _per_sample("clipped", self.clipped, np.bool_)
        if len(clipped) not in (0, len(samples)):
            raise InputError("", "clipped", f"{len(clipped)} of them", f"{len(samples)}, one for each sample")
        held = {
            "samples": samples,
            "clipped": clipped if len(clipped) else np.zeros(len(samples), dtype=bool),
            "rate": as_quantity(self.rate, "rate", "frequency"),
            "start": as_time(self.start, "start"),
            "speed": None if self.speed is None else as_quantity(self.speed, "speed", "speed", positive=False),
            "notes": as_names(self.notes, "notes", "texts"),
            "truth": as_table(self.truth, "truth", "a table of what it was made with"),
        }
        for name, value in held.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        speed = f", {self.speed:.6g} m/s" if self.speed is not None else ""
        return (
            f"<Recording {self.source!r}: {self.quantity}, {len(self.samples)} samples at {self.rate:.6g} Hz, "
            f"{self.duration:.6g} s{speed}, {int(np.isnan(self.samples).sum())} missing, {int(self.clipped.sum())} "
            f"clipped, {len(self.notes)} notes>"
        )

    @property
    def times(self) -> FloatArray:
        """Time of each sample after the trigger, s."""
        return self.start + np.arange(len(self.samples)) / self.rate

    @property
    def duration(self) -> float:
        """Length in s."""
        return len(self.samples) / self.rate

    def until(self, time: float | str) -> Recording:
        """Return the part before a time after the trigger, s, or as "20 ms"."""
        count = int(np.searchsorted(self.times, as_time(time, "time")))
        return replace(self, samples=self.samples[:count], clipped=self.clipped[:count])


def as_time(given: Any, field: str) -> float:
    """Return a finite time, s, of either sign."""
    time = to_si(given, "time", field)
    if not np.isfinite(time):
        raise InputError("", field, value_text(given), "a finite time")
    return time


def _per_sample(name: str, given: Any, kind: type[np.generic], dimension: str = "number") -> NDArray[Any]:
    """Return one value for each sample."""
    allowed = "a list of values, one for each sample"
    values = as_array(given, name, allowed, dimension, kind)
    if values.ndim != 1:
        raise InputError("", name, value_text(given), allowed)
    return values
