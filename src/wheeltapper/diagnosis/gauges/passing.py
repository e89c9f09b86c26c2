"""A wheel that passes sensors along the track: what they recorded of it, and runs of a model of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.flat import WheelFlat
from wheeltapper.describe.irregularity.out_of_round import OutOfRound
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor.along import BetweenPlaces
from wheeltapper.describe.sensor.base import ANTI_ALIAS
from wheeltapper.lower.track import waves
from wheeltapper.lower.track.section import section_of
from wheeltapper.record.assessment.filtering import RECORDER_ORDER, passed_share, recorded
from wheeltapper.record.record import Record
from wheeltapper.record.simulate import simulated_quietly

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]
"""Of what is fitted: paths of the scenario, and the names below."""
LENGTH, POSITION, SPEED, FORCE, ADVANCE = "length", "position", "speed", "static force", "advance"
"""Of a flat: length, m, and where its middle meets the rail, m along the track. Of the wheel: m/s, N, and how far it is
ahead of where `Passing.place` has it, m."""
PLACES = (POSITION, ADVANCE)
"""Of these, what is fitted and its standard deviation are in m; of all others logarithms are fitted."""
FINELY = 40e3
"""Forces a second, at least. At 20 kHz 0.1 % of a strike folds back, another part at each place: fits do not settle."""
RUN_IN = 0.08
"""For how long a run begins before the first sample, s: its start at rest has then died away."""
SAMPLES = 2.5
"""Readings are compared at so many times the cut-off frequency, a second."""
BEYOND, OWN = 1.4, 0.06
"""A wheel is fitted from so far before the first gauge to so far behind the last one, m; what a gauge reads is left out
while the wheel is so near to it, m."""
KEPT = 48
"""Runs that are kept."""
HIGHEST, BELOW_PINNED = 900.0, 0.85
"""Readings are compared up to this frequency, Hz, and at most up to this part of the track's pinned-pinned frequency:
near it rails ring for longer than `responses` know."""
PASSED = 1.4
"""Forces count up to this times the cut-off, at which the low-pass leaves a hundredth of amplitudes."""


@dataclass(frozen=True, eq=False)
class Passing:
    """What sensors of one rail recorded of one wheel that rolls towards growing x.

    Attributes
    ----------
    sensors
        Sensors of the columns; their places are in m along the track.
    rate
        Samples per second, Hz.
    readings
        Readings divided by the sensors' gains, N, (samples, sensors).
    used
        Which readings count, (samples, sensors).
    place, speed, static_force
        Where the wheel is at the first sample, m, its speed, m/s, and its static force, N, as measured without a model.
    noise
        Standard deviation of the noise of a sample, N.
    doubt
        Standard deviation of what was subtracted from the readings, (samples, sensors), N; None if nothing was.
    others
        How far ahead other wheels are, m.
    """

    sensors: tuple[BetweenPlaces, ...]
    rate: float
    readings: FloatArray
    used: NDArray[np.bool_]
    place: float
    speed: float
    static_force: float
    noise: float
    doubt: FloatArray | None = None
    others: tuple[float, ...] = ()

    @property
    def seconds(self) -> FloatArray:
        """Time of each sample after the first, s."""
        return np.arange(len(self.readings)) / self.rate

    @property
    def x(self) -> FloatArray:
        """Where the wheel is at each sample, m."""
        return self.place + self.speed * self.seconds

    def rates(self, readings: FloatArray) -> FloatArray:
        """Return how fast readings after a low-pass change, N/s, (samples, sensors).

        Differences of neighbouring samples would be a fifth too small near the cut-off.
        """
        return np.asarray(CubicSpline(self.seconds, readings)(self.seconds, 1))

    @property
    def highest(self) -> float:
        """The cut-off of the recorder's filter, Hz, up to which readings can be compared.

        A recorder that is said to have none is taken to filter as others do.
        """
        usual = ANTI_ALIAS * self.rate
        return min([usual, *(one.cutoff(self.rate) or usual for one in self.sensors)])

    def recorded_share(self, frequencies: FloatArray) -> FloatArray:
        """Return what the recorder's filter leaves of amplitudes at frequencies, Hz."""
        return passed_share(frequencies, self.finer * self.rate, self.highest, RECORDER_ORDER)

    @property
    def finer(self) -> int:
        """How many forces to a sample the recorder's filter takes."""
        return max(2, ceil(FINELY / self.rate))

    @property
    def lead(self) -> int:
        """How many samples a run begins before the first one."""
        return round(RUN_IN * self.rate)


def beside_gauges(sensors: Sequence[BetweenPlaces], x: FloatArray) -> NDArray[np.bool_]:
    """Return whether a wheel at places is not too near to the gauges of each pair, (places, sensors)."""
    return np.stack([np.minimum(abs(x - one.x1), abs(x - one.x2)) > OWN for one in sensors], axis=1)


def passing_without_readings(
    sensors: Sequence[BetweenPlaces], rate: float, noise: float, speed: float, force: float, beyond: float = BEYOND
) -> Passing:
    """Return a wheel of which nothing is recorded, from so far beyond the gauges, m, to as far behind them."""
    first, last = min(one.x1 for one in sensors), max(one.x2 for one in sensors)
    count = int(np.ceil((last - first + 2.0 * beyond) / speed * rate))
    x = np.asarray(first - beyond + speed * np.arange(count) / rate)
    nothing = np.zeros((count, len(sensors)))
    return Passing(tuple(sensors), rate, nothing, beside_gauges(sensors, x), float(x[0]), speed, force, noise)


@dataclass(frozen=True, eq=False)
class Tread:
    """A tread of free shape.

    Attributes
    ----------
    deviations
        From a circle, m, at equal angles of a turn; missing material is negative. Between them runs a spline.
    place
        Where along the track angle zero meets the rail, m.
    """

    deviations: FloatArray
    place: float

    @property
    def angles(self) -> FloatArray:
        """Angles of the deviations, rad."""
        return 2.0 * pi * np.arange(len(self.deviations)) / len(self.deviations)

    def irregularity(self, begins: float, radius: float) -> Irregularity:
        """Return it on a wheel of a radius, in a run that begins at a place, both in m."""
        at = (self.place - begins) % (2.0 * pi * radius)
        places, heights = tuple(self.angles.tolist()), tuple(self.deviations.tolist())
        return OutOfRound(places=places, deviations=heights, over="angle", position=at)


Shape = str | Tread
"""Of a wheel: "fresh" or "rounded", of a flat whose length and place are among the values, or a tread."""


@dataclass(eq=False)
class Runs:
    """Runs of a model of a passing wheel.

    Attributes
    ----------
    passing
        What was recorded.
    scene
        One wheel without a flaw on the site's track, whose x is that of the site; speed, load and duration are not its
        own.
    count
        How many runs there were.
    """

    passing: Passing
    scene: Scenario
    count: int = 0
    _records: dict[Any, Record] = field(default_factory=dict, repr=False)
    _readings: dict[Any, FloatArray] = field(default_factory=dict, repr=False)
    _forces: dict[Any, FloatArray] = field(default_factory=dict, repr=False)

    @cached_property
    def highest(self) -> float:
        """Up to which frequency readings are compared, Hz."""
        pinned = waves.pinned(section_of(self.scene.track)) / (2.0 * pi)
        return min(HIGHEST, BELOW_PINNED * pinned, self.passing.highest)

    def start(self, values: Values) -> float:
        """Return where along the track a run begins, m."""
        return self.passing.place + values[ADVANCE] - values[SPEED] * self.passing.lead / self.passing.rate

    def scenario(self, values: Values, shape: Shape) -> Scenario:
        """Return a wheel with these values; its x counts from `start`."""
        own = {path: value for path, value in values.items() if "." in path}
        begins, track = self.start(values), self.scene.track
        changed = self.scene.replaced({**own, SPEED: values[SPEED]})
        mass, radius = float(changed.vehicle.mass), float(changed.vehicle.radius)
        flaws: list[Irregularity] = []
        if isinstance(shape, Tread):
            flaws = [shape.irregularity(begins, radius)]
        elif values.get(LENGTH, 0.0) > 0.0:
            turn = 2.0 * pi * radius
            first = (values[POSITION] - begins) % turn
            first += turn if first < values[LENGTH] else 0.0
            flaws = [WheelFlat(length=values[LENGTH], position=first, shape=shape)]
        samples = self.passing.lead + len(self.passing.readings)
        return changed.replaced({
            "vehicle.load": values[FORCE] - mass * float(changed.vehicle.gravity),
            "track.first_sleeper": (float(track.first_sleeper) - begins) % float(track.spacing),
            "irregularity": flaws, "duration": samples / self.passing.rate,
        })  # fmt: skip

    def record(self, values: Values, shape: Shape) -> Record:
        """Return a run."""
        key = shape, tuple(sorted(values.items()))
        if key not in self._records:
            self.count += 1
            self._records[key] = simulated_quietly(self.scenario(values, shape))
            while len(self._records) > KEPT:
                self._records.pop(next(iter(self._records)))
        return self._records[key]

    def readings(self, values: Values, shape: Shape) -> FloatArray:
        """Return what the sensors would have recorded of a run, N, (samples, sensors); see `forces`."""
        key = shape, tuple(sorted(values.items()))
        if key not in self._readings:
            begins, passing = self.start(values), self.passing
            moved = [_moved(one, -begins, number, passing) for number, one in enumerate(passing.sensors)]
            found = self.record(values, shape).recordings(moved).values()
            whole = np.stack([one.samples for one in found], axis=1)
            self._readings[key] = whole[passing.lead :][: len(passing.readings)]
        return self._readings[key]

    def forces(self, values: Values, shape: Shape) -> FloatArray:
        """Return the contact's force in a run, N, at the samples and at those of the run-in before.

        It is what the filter of the recorder would leave: impacts are shorter than a sample.
        """
        key = shape, tuple(sorted(values.items()))
        if key not in self._forces:
            self._forces[key] = self.sampled(self.fine_forces(values, shape))
        return self._forces[key]

    def fine_forces(self, values: Values, shape: Shape) -> FloatArray:
        """Return the same `finer` times as often as samples, with all that is in them."""
        finer = self.passing.finer
        times = np.arange(finer * (self.passing.lead + len(self.passing.readings))) / (finer * self.passing.rate)
        record = self.record(values, shape)
        return np.asarray(record._lowered.forces(record._march, times)[:, 0])

    def sampled(self, fine: FloatArray) -> FloatArray:
        """Return values at samples, from those `finer` times as often."""
        return recorded(fine, self.passing.rate, self.passing.highest, self.passing.finer)


def _moved(sensor: BetweenPlaces, by: float, number: int, passing: Passing) -> BetweenPlaces:
    """Return a sensor of gain 1 that lies further on, m, under the name of its number."""
    own = {"name": str(number), "rate": passing.rate, "anti_alias": passing.highest, "gain": 1.0}
    return sensor.model_copy(update=own | {"x1": sensor.x1 + by, "x2": sensor.x2 + by})
