"""Derivatives of trains along one direction, as imaginary parts of the trains."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.many import EPSILON
from wheeltapper.march.common import program as contract
from wheeltapper.record.trains.trains import Trains

if TYPE_CHECKING:
    from wheeltapper.lower.numbers import Units

FloatArray = NDArray[np.float64]


class Rates(NamedTuple):
    """Derivatives of the results of a march along one direction; NaN where they are unknown.

    A NaN as an imaginary part would make the real part NaN, too. Therefore gaps are filled with numbers. A feature
    whose derivative depends on these numbers has no derivative.
    """

    events: FloatArray  # (events, 2): of time, and of the rate of indentation
    peaks: FloatArray  # (peaks, 2): of time, and of force
    highest: FloatArray  # (cells,), empty without a tally
    impulses: FloatArray  # (events,)

    @property
    def has_gaps(self) -> bool:
        """Whether some are unknown."""
        return any(bool(np.isnan(rates).any()) for rates in self)

    def known(self, gap: float) -> Rates:
        """Return the same with different numbers of the order of `gap` in the gaps."""
        fills = (np.linspace(gap, 2.0 * gap, rates.size).reshape(rates.shape) for rates in self)
        return Rates(*(np.where(np.isnan(rates), fill, rates) for rates, fill in zip(self, fills, strict=True)))


class Along(NamedTuple):
    """How trains change along one direction.

    Attributes
    ----------
    trains
        The trains.
    rates
        The derivatives of their events and maxima.
    of_end
        That of their end.
    units
        Their units, with derivatives as imaginary parts.
    """

    trains: Trains
    rates: Rates
    of_end: FloatArray | float
    units: Units

    def tilted(self, gap: float) -> Trains:
        """Return the trains with their derivatives as imaginary parts; unknown ones are of the order of `gap`."""
        marched, rates = self.trains.marched, self.rates.known(gap)
        events, peaks = marched.events.astype(complex), marched.peaks.astype(complex)
        events[:, [contract.EVENT_TIME, contract.EVENT_RATE]] += 1j * EPSILON * rates.events
        peaks[:, [contract.PEAK_TIME, contract.PEAK_FORCE]] += 1j * EPSILON * rates.peaks
        changed: Any = {"events": events, "peaks": peaks, "end": marched.end + 1j * EPSILON * self.of_end}
        if marched.impulses is not None and marched.highest is not None:
            changed["impulses"] = marched.impulses + 1j * EPSILON * rates.impulses
            changed["highest"] = marched.highest + 1j * EPSILON * rates.highest
        return replace(
            self.trains, marched=marched._replace(**changed), units=self.units, unknown_part=gap * EPSILON
        )  # fmt: skip
