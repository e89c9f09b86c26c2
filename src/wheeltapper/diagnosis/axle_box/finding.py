"""What the acceleration of an axle box shows: the wheel's fault and its size, and the flaws of the rail."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.axle_box.joints import RailFlaw, distance_of
from wheeltapper.diagnosis.axle_box.wheel import Flat, Wheel, WheelSeen
from wheeltapper.diagnosis.faults.out_of_round import OutOfRoundWheel
from wheeltapper.diagnosis.finding import HEALTHY, NOT_EXPLAINED
from wheeltapper.diagnosis.gauges.known import RADIUS
from wheeltapper.diagnosis.gauges.scan import FOUND_FROM, NEEDED
from wheeltapper.diagnosis.gauges.verdicts import (
    EXPLAINED,
    INTERVAL,
    NAMES,
    alike_of,
    flat_words,
    interval_over,
    order_size,
    order_words,
    probabilities_of,
)
from wheeltapper.ground.shown import Shown
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class AxleBoxFinding(Shown):
    """What the acceleration of an axle box shows about its wheel and the rail.

    Attributes
    ----------
    recording
        The acceleration.
    wheel
        The model of the wheel on its track, with the turns and the speed of the recording.
    seen
        What the average turn shows.
    average, error
        The average turn and its standard error, m/s², (bins,).
    left
        The acceleration without the parts that repeat with the wheel and with the seats, m/s².
    joints
        Flaws of the rail, in the order of their places.
    passing
        Frequency at which seats are passed, Hz; None if the recording does not show it.
    """

    recording: Recording
    wheel: Wheel
    seen: WheelSeen
    average: FloatArray
    error: FloatArray
    left: FloatArray
    joints: tuple[RailFlaw, ...]
    passing: float | None

    @property
    def reduced(self) -> float | None:
        """χ² per bin that the best flat leaves; None without a flat."""
        best = self.seen.best
        return None if best is None else best.chi / best.readings

    @property
    def verdict(self) -> str:
        """The wheel's fault by its name in the catalogue, "healthy" or "not explained"."""
        if self.seen.best is not None:
            return NOT_EXPLAINED if (self.reduced or 0.0) > EXPLAINED else NAMES[self.seen.best.shape]
        return OutOfRoundWheel.name if self.seen.orders.gain > NEEDED else HEALTHY

    @property
    def alike(self) -> tuple[str, ...]:
        """Other verdicts that the recording does not exclude."""
        best = self.seen.best
        if best is None or self.verdict == NOT_EXPLAINED:
            return ()
        return tuple(NAMES[one.shape] for one in alike_of(self.seen.flats, best))

    @property
    def probabilities(self) -> dict[str, float]:
        """Probabilities of the fitted flats and of "healthy"; without a flat, of the verdict alone."""
        best = self.seen.best
        if best is None:
            return {self.verdict: 1.0}
        return probabilities_of(self.seen.flats, best, self.seen.gain)

    @property
    def sizes(self) -> dict[str, tuple[float, tuple[float, float]]]:
        """Size, m, and its 90 % interval of each fault that was found, by its name.

        The size of a flat is its length. That of a wheel out of round is the amplitude of the order that stands out
        most.
        """
        if self.verdict == OutOfRoundWheel.name:
            return {self.verdict: order_size(self.seen.orders)}
        flats = self.seen.flats if self.seen.best is not None else ()
        return {NAMES[one.shape]: (one.length, _interval(one)) for one in flats}

    @property
    def rail_length(self) -> float | None:
        """Distance at which joints repeat, m; None if they do not."""
        return distance_of(np.array([one.place for one in self.joints]))

    @property
    def place(self) -> float | None:
        """Where the flat is, as a part of the turn after the wheel's point at the first sample; None without one."""
        best = self.seen.best
        return None if best is None else (best.shift / self.wheel.period) % 1.0

    def __repr__(self) -> str:
        return f"<AxleBoxFinding: {self}>"

    def __str__(self) -> str:
        """Return two or three sentences."""
        return f"{self._wheel_words()}. {self._rail_words()}"

    def _wheel_words(self) -> str:
        if self.verdict == NOT_EXPLAINED:
            return f"wheel: not explained: the nearest flat leaves χ² = {self.reduced:.2g} per place of the turn"
        if self.verdict == HEALTHY:
            half, most = (1e3 * length for length in self.seen.lengths)
            found = f"a fresh flat would be found from {half:.0f} mm on at half of the circumference"
            return f"wheel: {HEALTHY}: {found}, from {most:.0f} mm on at nine tenths of it"
        if self.verdict == OutOfRoundWheel.name:
            return f"wheel: {self.verdict}: {order_words(self.seen.orders)}"
        said = f"wheel: {flat_words(self.verdict, self.probabilities[self.verdict], self.sizes, self.alike)}"
        return f"{said}; out of round, too: {order_words(self.seen.orders)}" if self.seen.orders.gain > NEEDED else said

    def _rail_words(self) -> str:
        if not self.joints:
            return "Rail: no joint, weld or dip stands out."
        deepest = max(self.joints, key=lambda one: abs(one.height))
        ends = sorted(1e3 * abs(end) for end in deepest.interval)
        many = f"{len(self.joints)} places stand out" if len(self.joints) > 1 else "one place stands out"
        said = f"Rail: {many}, most a {deepest.kind} at {deepest.place:.1f} m, {1e3 * abs(deepest.height):.2f} mm "
        said += f"(90 %: {ends[0]:.2f} to {ends[1]:.2f})"
        apart = self.rail_length
        return f"{said}." if apart is None else f"{said}; they come every {apart:.2f} m."

    def to_dict(self) -> dict[str, Any]:
        """Return everything except samples, in SI units."""
        size, _ = self.sizes.get(self.verdict, (None, None))
        turns, best = self.wheel.turns, self.seen.best
        return {
            "source": self.recording.source,
            "verdict": self.verdict,
            "probabilities": self.probabilities,
            "alike": list(self.alike),
            "size": size,
            "size_interval": interval_over((self.verdict, *self.alike), self.sizes),
            "size_unit": "" if size is None else "m",
            "sizes": {name: {"size": one, "size_interval": list(ends)} for name, (one, ends) in self.sizes.items()},
            "place": self.place,
            "speed": self.wheel.speed,
            "speed_from": "radius" if self.passing is None else "seats",
            "radius": self.wheel.speed * self.wheel.period / (2.0 * pi),
            "radius_deviation": self.wheel.known.spread.get(RADIUS, 0.0) * self.wheel.values[RADIUS],
            "turns": turns.whole,
            "turn": self.wheel.period,
            "chi_squared_reduced": self.reduced,
            "gain": self.seen.gain,
            "estimates": {} if best is None else {name: best.values[name] for name in best.names},
            "orders": self.seen.orders.rows(),
            "orders_gain": self.seen.orders.gain,
            FOUND_FROM: {"half": self.seen.lengths[0], "nine_tenths": self.seen.lengths[1]},
            "joints": [one.to_dict() for one in self.joints],
            "joints_every": self.rail_length,
        }


def _interval(flat: Flat) -> tuple[float, float]:
    half = INTERVAL * flat.deviation
    return flat.length - half, flat.length + half
