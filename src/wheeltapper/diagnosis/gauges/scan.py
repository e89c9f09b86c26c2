"""Where on a wheel's circumference a flat may be, and how long: one flat's readings times a factor, at all places.

The force of a flat depends little on where in a bay it strikes: it is simulated at some places, and moved to others.

Theory: docs/theory/gauges.rst, section 16.4.
"""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.gauges.fit import Problem
from wheeltapper.diagnosis.gauges.known import RADIUS
from wheeltapper.diagnosis.gauges.orders import Orders, OutOfRound
from wheeltapper.diagnosis.gauges.passing import LENGTH, POSITION, RUN_IN, SPEED, Runs, Values
from wheeltapper.diagnosis.gauges.transfer import Transfer
from wheeltapper.diagnosis.gauges.weighing import Band, Freed

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
PLACES = 6
"""Places in a bay at which a strike is simulated."""
SCREENED = 25.0
"""A wheel of which no flat lowers χ² by so much is not fitted: of 60 without a flaw it was less of 53, at most 41."""
CANDIDATES = 4
"""So many places of a flat are told."""
NEEDED = 100.0
"""What a wheel is said to have lowers χ² by so much at least."""
WAVES = 10.0
"""Waves of a wheel out of round lower χ² by so much at least, less what as many explain by chance: of wheels without a
flaw they come to -180 to -90."""
TRIED = 0.04
"""Length of the flat that is simulated, m."""
BEFORE, ENDS = 0.02, 0.01
"""A strike's force is taken from so long before it, s; at its end it is faded out over so long."""
RADIUS_STEP, FARTHEST, RADII = 0.004, 0.8, 10
"""Radii of the wheel that are tried are so far apart, over the stated one; they are so many of its standard deviations
from it at most, and so many to each side at most. With farther ones, a wheel 1.8 % larger explained a flat, and what
was left of it was a flat of its neighbour."""
FINE = 4.5
"""Places that are tried are this part of the shortest wave that is read apart."""
SHORTEST, LONGEST = 0.01, 0.08
"""Of a flat that is found, m."""
FOUND_FROM = "fresh_flat_found_from"
"""Name of `Seen.found_from` among what is told of a wheel."""
APART = 0.03
"""Flats none of whose strikes are farther apart are one, m."""


class Candidate(NamedTuple):
    """A flat that may be there.

    Attributes
    ----------
    gain
        By how much it lowers χ².
    length, position
        m.
    radius
        Of the wheel, over the stated one.
    """

    gain: float
    length: float
    position: float
    radius: float


class Seen(NamedTuple):
    """What readings show of a wheel before a model is fitted.

    Attributes
    ----------
    candidates
        Places of a flat, the one first that explains most.
    orders
        The waves of a wheel out of round that explain most.
    smallest
        Lengths of the shortest fresh flats that would be found, m, rising, over equal parts of the circumference.
    reduced
        χ² of a reading that a wheel without a flaw leaves.
    """

    candidates: tuple[Candidate, ...]
    orders: OutOfRound
    smallest: FloatArray
    reduced: float

    @property
    def gain(self) -> float:
        """By how much χ² falls, by a flat or by waves."""
        return max(self.candidates[0].gain, self.orders.gain)

    @property
    def unseen(self) -> tuple[float, float]:
        """Lengths of fresh flats, m, that would be found on half of the circumference, and on nine tenths of it."""
        half, most = np.quantile(self.smallest, [0.5, 0.9])
        return float(half), float(most)

    @property
    def found_from(self) -> dict[str, float]:
        """The same by the shares, for JSON."""
        return dict(zip(("half", "nine_tenths"), self.unseen, strict=True))

    @property
    def is_round(self) -> bool:
        """Whether waves explain less than a flat, or too little."""
        return self.orders.gain < max(self.candidates[0].gain, WAVES)


class Scan:
    """A wheel without a flaw, and what a flat at any place of its circumference would add to its readings.

    Parameters
    ----------
    problem
        The wheel's readings.
    values
        Of a wheel without a flaw.
    """

    def __init__(self, problem: Problem, values: Values) -> None:
        runs, band, transfer = problem.runs, problem.band, problem.anchor.transfer
        passing, speed, radius = runs.passing, values[SPEED], float(runs.scene.vehicle.radius)
        self.band, self.weights = band, problem.weights
        self.level = problem.read(values, "fresh")
        self.turn = 2.0 * pi * radius
        self._freed = freed = Freed(self.weights, self.weights.over(free_columns(band, self.level, speed)))
        self.orders = Orders(problem, freed, radius)
        strikes = Strikes(runs, values, transfer)
        begin, end = float(passing.x[0]), float(passing.x[-1])
        first, step = begin - 0.2, speed / (FINE * band.cutoff)
        most = min(RADII, round(FARTHEST * problem.spread.get(RADIUS, 0.0) / RADIUS_STEP))
        self._tried = [
            (place, factor)
            for factor in (1.0 + RADIUS_STEP * np.arange(-most, most + 1)).tolist()
            for place in np.arange(first, first + self.turn * factor, step)
        ]
        spectra = [strikes.at(np.arange(place, end, self.turn * factor)) for place, factor in self._tried]
        columns = self.weights.over(transfer.of_spectra(np.stack(spectra, axis=1)))
        self._weighed = freed.weighed(columns)
        self._size = (columns * self._weighed).sum(axis=0)

    def explained(self, left: FloatArray) -> FloatArray:
        """Return by what flats at all places explain readings over their deviations, for `gains`, (columns, ...)."""
        return np.asarray(self._weighed.T @ left)

    def gains(self, along: FloatArray) -> FloatArray:
        """Return by how much the best flat lowers χ² of wheels, (wheels,), from what is `explained`."""
        return np.asarray(self._factors(along, self._size[:, None])[1].max(axis=0))

    @property
    def smallest(self) -> FloatArray:
        """Lengths of the shortest flats that would be found; see `Seen`."""
        stated = [number for number, (_, factor) in enumerate(self._tried) if factor == 1.0]
        return np.sort(TRIED * (SCREENED / self._size[stated]) ** 0.25)

    def seen(self, readings: FloatArray, used: NDArray[np.bool_], share: float = 1.0) -> Seen:
        """Return what readings, (samples, sensors), show of a wheel.

        Those that are not `used` count as explained. `share` is the wheel's static force over that of the scan's.
        """
        beside = self.band.smooth(readings) - share * self.level
        left = self.weights.over(self.band.taken(np.where(used, beside, 0.0)))
        reduced = float(left @ self._freed.weighed(left)) / (used & self.band.picked).sum()
        return Seen(self._candidates(left), self.orders.found(left), self.smallest, float(reduced))

    def _candidates(self, left: FloatArray) -> tuple[Candidate, ...]:
        """Return the places at which a fresh flat explains most of what is left, the best first."""
        factor, gain = self._factors(self.explained(left), self._size)
        found: list[Candidate] = []
        for number in np.argsort(-gain):
            place, own = self._tried[number]
            if all(self._apart(place - one.position, own - one.radius) > APART for one in found):
                length = float(np.clip(TRIED * np.sqrt(factor[number]), SHORTEST, LONGEST))
                found.append(Candidate(float(gain[number]), length, float(place), own))
            if len(found) == CANDIDATES:
                break
        return tuple(found)

    def _apart(self, place: float, radius: float) -> float:
        """Return how far two flats strike from each other, m, at this turn or the next; differences are given."""
        ways = np.array([place, place + radius * self.turn])
        return float(np.abs((ways + 0.5 * self.turn) % self.turn - 0.5 * self.turn).max())

    @staticmethod
    def _factors(along: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the best factor on each column, at least 0, and by how much χ² falls with it."""
        factor = np.clip(along / size, 0.0, (LONGEST / TRIED) ** 2)
        return factor, factor * (2.0 * along - factor * size)


def free_columns(band: Band, level: FloatArray, speed: float) -> FloatArray:
    """Return the readings of what is free besides: gain and zero line of each sensor, arrival, and speed."""
    slope = band.passing.rates(level) * 2e-3 / speed
    along = np.linspace(-1.0, 1.0, len(level))[:, None]
    moved = np.stack([band.taken(slope), band.taken(slope * along)], axis=1)
    return np.concatenate([band.of_each(level), band.of_each(1e3 * np.ones_like(level)), moved], axis=1)


class Strikes:
    """Spectra of what one strike adds to the force, wherever it is.

    `values` are those of a wheel without a flaw, `length`, m, and `shape` those of its flat.
    """

    def __init__(
        self, runs: Runs, values: Values, transfer: Transfer, length: float = TRIED, shape: str = "fresh"
    ) -> None:
        passing, speed = runs.passing, values[SPEED]
        self._transfer, self._speed, self._rate = transfer, speed, passing.rate
        self._begin = runs.start(values)
        self._spacing = float(runs.scene.track.spacing)
        self._seat = float(runs.scene.track.first_sleeper)
        smooth = runs.forces(values, "fresh")
        turn = 2.0 * pi * float(runs.scene.vehicle.radius) / speed
        self._before = round(BEFORE * passing.rate)
        longest, fade = round(0.95 * turn * passing.rate), round(ENDS * passing.rate)
        spectra = []
        settled = self._begin + max(0.5 * RUN_IN * speed, 1.1 * BEFORE * speed)
        for number in range(PLACES):
            inside = self._seat + number * self._spacing / PLACES
            place = inside + ceil((settled - inside) / self._spacing) * self._spacing
            struck = runs.forces({**values, LENGTH: length, POSITION: place}, shape) - smooth
            at = round((place - self._begin) / speed * passing.rate)
            part = struck[at - self._before : at - self._before + longest].copy()
            part[-fade:] *= np.linspace(1.0, 0.0, fade)
            late = place - self._begin - at / passing.rate * speed
            spectrum = transfer.spectra(part)
            spectra.append(spectrum * np.exp(2j * np.pi * transfer.frequencies * late / speed))
        self._spectra = np.array(spectra)

    def at(self, places: FloatArray) -> ComplexArray:
        """Return the spectrum of strikes at places, m."""
        total = np.zeros(len(self._transfer.frequencies), dtype=complex)
        for place in places:
            lower, share = divmod(((place - self._seat) / self._spacing) % 1.0 * PLACES, 1.0)
            one, other = self._spectra[int(lower) % PLACES], self._spectra[(int(lower) + 1) % PLACES]
            after = (place - self._begin) / self._speed - self._before / self._rate
            total += ((1.0 - share) * one + share * other) * np.exp(-2j * np.pi * self._transfer.frequencies * after)
        return total
