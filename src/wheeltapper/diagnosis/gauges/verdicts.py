"""How fitted flats are weighed against each other, and the words for it: the same of gauges and of axle boxes.

Theory: docs/theory/gauges.rst, section 16.5.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import exp
from typing import Protocol, TypeVar

from wheeltapper.diagnosis.faults.rounded_flat import RoundedFlat
from wheeltapper.diagnosis.faults.wheel_flat import FreshFlat
from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.gauges.orders import OutOfRound

NAMES = {flat.shape: flat.name for flat in (FreshFlat, RoundedFlat)}
"""Of the faults, by the shapes of flats."""
OTHER = "other"
"""Name of a tread of free shape among what is likely."""
TOLD, OF_READINGS = 60.0, 0.03
"""Fresh and rounded flats are told from each other where χ² differs by so much, and by this part of the number of
readings, over the reduced χ² of the better one. Of fresh flats of 29 to 42 mm at 24 to 30 m/s, with roughness, the
rounded one was better by up to 250, or 4 % of the readings."""
TEMPER = 10.0
"""Differences of χ² count this part of themselves in probabilities: the model errs by more than noise does."""
EXPLAINED = 3.0
"""The largest χ² of a reading that a model leaves. Flats from another program, on another track, left 0.9 to 1.7."""
INTERVAL = 1.645
"""Half of an interval of 90 %, in standard deviations."""


class Fitted(Protocol):
    """A flat that was fitted."""

    @property
    def shape(self) -> str:
        """Its shape, "fresh" or "rounded"."""
        ...

    @property
    def chi(self) -> float:
        """χ², with what was known before."""
        ...

    @property
    def readings(self) -> int:
        """How many readings were compared."""
        ...

    @property
    def misfit(self) -> float:
        """What fits of the same readings differ in."""
        ...


F = TypeVar("F", bound=Fitted)


def alike_of(fits: Iterable[F], best: Fitted) -> tuple[F, ...]:
    """Return the flats that readings do not exclude besides the best one."""
    most = best.misfit + max(TOLD, OF_READINGS * best.readings) * max(1.0, best.chi / best.readings)
    return tuple(one for one in fits if best.misfit < one.misfit < most)


def probabilities_of(fits: Iterable[Fitted], best: Fitted, gain: float) -> dict[str, float]:
    """Return the probabilities of flats and of "healthy", the largest first; the best lowers χ² by `gain`."""
    misfits = {NAMES[one.shape]: one.misfit for one in fits} | {HEALTHY: best.misfit + gain}
    return odds_of(misfits, best.chi / best.readings)


def odds_of(misfits: Mapping[str, float], reduced: float) -> dict[str, float]:
    """Return the probabilities of what leaves these misfits, the largest first; the least leaves a `reduced` χ²."""
    least, scale = min(misfits.values()), 2.0 * TEMPER * max(1.0, reduced)
    odds = {name: exp(-min(misfit - least, 1e4) / scale) for name, misfit in misfits.items()}
    total = sum(odds.values())
    return {name: value / total for name, value in sorted(odds.items(), key=lambda item: -item[1])}


def flat_words(
    verdict: str, probability: float, sizes: Mapping[str, tuple[float, tuple[float, float]]], alike: Iterable[str]
) -> str:
    """Return a flat with its probability, length and interval, and what is not excluded."""
    size, (low, high) = sizes[verdict]
    said = f"{verdict} (probability {probability:.3f}), {1e3 * size:.1f} mm long "
    said += f"(90 %: {1e3 * low:.1f} to {1e3 * high:.1f})"
    return said + "".join(f"; not excluded: {name}, {1e3 * sizes[name][0]:.1f} mm" for name in alike)


def interval_over(faults: Iterable[str], sizes: Mapping[str, tuple[float, tuple[float, float]]]) -> list[float] | None:
    """Return the interval that holds those of all these faults; None if none of them has a size."""
    ends = [sizes[fault][1] for fault in faults if fault in sizes]
    return [min(low for low, _ in ends), max(high for _, high in ends)] if ends else None


def order_words(orders: OutOfRound) -> str:
    """Return the orders that are known, with their intervals."""
    sizes, halves = 1e6 * orders.amplitudes, 1e6 * INTERVAL * orders.deviations
    known = [f"order {k}: {sizes[k - 1]:.0f} ± {halves[k - 1]:.0f} um" for k in orders.known]
    return ", ".join(known) or f"mostly of order {orders.largest}"


def order_size(orders: OutOfRound) -> tuple[float, tuple[float, float]]:
    """Return the amplitude, m, of the order that stands out most, and its interval."""
    largest = orders.largest - 1
    size, half = float(orders.amplitudes[largest]), INTERVAL * float(orders.deviations[largest])
    return size, (size - half, size + half)
