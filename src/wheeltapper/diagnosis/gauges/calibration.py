"""A track by its traffic: values of the track that explain the readings of many healthy wheels.

Theory: docs/theory/gauges.rst, section 16.10.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from wheeltapper.describe.paths import value_at
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS, Known
from wheeltapper.diagnosis.gauges.traffic import LEVEL, NOISE, TILT, Told, Traffic, stepped

FloatArray = NDArray[np.float64]
OWN = {LEVEL: 3.0, TILT: 0.4, NOISE: 0.4}
"""Standard deviations before of what the traffic shows besides values of the scene, of logarithms: 13 dB, 1.2 dB per
octave, and 20 % of the noise."""
FREE = 1.5
"""The same of values of the track in a free search: a factor of 4.5."""
MODEL = 0.15
"""Error of the model in values of the track, of logarithms. Of finite elements with roughness pads come out 0.13 to
0.3 too stiff, and ballast up to 0.07 too soft."""
STARTS = (0.1, 10.0)
"""Factors on a stiffness with which a free search begins."""
ROUNDS, STEPS, LONGEST_STEP = 4, 3, 0.7
"""A fit takes so many rounds of so many steps, each of at most so much of a logarithm."""
DONE = 0.2
"""It ends where a round raises the likelihood by less."""
ODD, LOUD = 1.6, 2.3
"""Wheels count as healthy whose χ² of a reading is less than this, and whose roughness has a power that exceeds that of
usual ones by a logarithm of less than the other: 10 dB."""


class Estimate(NamedTuple):
    """Values that explain the readings of traffic.

    Attributes
    ----------
    names, values
        What was free; and all values.
    changes, covariance
        Logarithms of the free values over the stated ones, and their covariance, with the error of the model.
    before, spread
        Their standard deviations before, and from one such traffic to another.
    likelihood
        Its logarithm, without what was known before.
    """

    names: tuple[str, ...]
    values: dict[str, float]
    changes: FloatArray
    covariance: FloatArray
    before: FloatArray
    spread: FloatArray
    likelihood: float

    def deviation(self, name: str) -> float:
        """Return the standard deviation of a logarithm."""
        own = self.names.index(name)
        return float(np.sqrt(self.covariance[own, own]))

    def scatter(self, name: str) -> float:
        """Return its standard deviation from one such traffic to another."""
        return float(self.spread[self.names.index(name)])


def estimated(several: Sequence[Traffic], known: Known, begun: Estimate | None = None) -> Estimate:
    """Return the values that explain traffic best; wheels that are not healthy are left out.

    Parameters
    ----------
    several
        Readings of wheels alike.
    known
        Of the track and its wheels.
    begun
        With what was known before. If it is given, values of the track are sought without that, and from far away, too.
    """
    spread = {path: share for path, share in known.spread.items() if path.startswith("track.")}
    spread = dict.fromkeys(spread, FREE) if begun is not None else spread
    spread |= {path: known.spread[path] for path in (MASS, CONTACT) if path in known.spread} | OWN
    stated = {path: float(value_at(known.scene, path)) for path in {*spread, MASS, CONTACT} - {*OWN}}
    stated |= dict.fromkeys(OWN, 0.0)
    search = _Search(several, stated, spread)
    if begun is None:
        return search.from_(stated)
    stiff = [path for path in spread if path.startswith("track.") and path.endswith("stiffness")]
    far = [stepped(stated, path, float(np.log(by))) for path in stiff for by in STARTS]
    start = max([begun.values, *far], key=search.mix)
    return search.from_(start, 1 if start is begun.values else ROUNDS)


class _Search:
    """A search for values by Fisher's scoring."""

    def __init__(self, several: Sequence[Traffic], stated: dict[str, float], spread: Mapping[str, float]) -> None:
        self.several, self.stated, self.names = several, stated, tuple(spread)
        self.before = np.array([*spread.values()])

    def changes(self, values: Mapping[str, float]) -> FloatArray:
        """Return logarithms of values over the stated ones."""
        own = [values[n] - self.stated[n] if n in OWN else np.log(values[n] / self.stated[n]) for n in self.names]
        return np.array(own)

    def told(self, values: Mapping[str, float], names: Sequence[str]) -> Told:
        """Return what all readings say of values, and what was known before."""
        told = [one.told(values, names) for one in self.several]
        changes = self.changes(values)
        likelihood = sum(one.likelihood for one in told) - 0.5 * float(((changes / self.before) ** 2).sum())
        if not names:
            return told[0]._replace(likelihood=likelihood)
        slope = sum(one.slope for one in told) - changes / self.before**2
        return Told(likelihood, slope, sum(one.information for one in told) + np.diag(self.before**-2.0))

    def mix(self, values: Mapping[str, float]) -> float:
        """Take the powers of roughness that explain most with these values; return the likelihood."""
        return sum(one.mix(values) for one in self.several)

    def from_(self, values: dict[str, float], rounds: int = ROUNDS) -> Estimate:
        """Return where a search leads."""
        last = -np.inf
        for _ in range(rounds):
            for one in self.several:
                one.anchor(values)
            self.mix(values)
            values, told = self._scored(values)
            for one in self.several:
                odd = (one.left_over(values) > ODD) | (np.log(one.mixed.powers) > LOUD)
                if odd.any() and odd.mean() < 0.5:
                    one.without(odd)
                    last = -np.inf
            if told.likelihood < last + DONE:
                break
            last = told.likelihood
        changes, covariance = self.changes(values), np.asarray(np.linalg.inv(told.information))
        likelihood = told.likelihood + 0.5 * float(((changes / self.before) ** 2).sum())
        spread = scatter_of(covariance, told.information - np.diag(self.before**-2.0))
        covariance = covariance + np.diag([MODEL**2 if name.startswith("track.") else 0.0 for name in self.names])
        return Estimate(self.names, values, changes, covariance, self.before, spread, likelihood)

    def _scored(self, values: dict[str, float]) -> tuple[dict[str, float], Told]:
        told = self.told(values, self.names)
        for _ in range(STEPS):
            step = np.linalg.solve(told.information, told.slope)
            for _ in range(4):
                change = step * min(1.0, LONGEST_STEP / float(np.abs(step).max()))
                tried = values
                for name, by in zip(self.names, change.tolist(), strict=True):
                    tried = stepped(tried, name, by)
                if self.told(tried, ()).likelihood > told.likelihood:
                    break
                step = 0.3 * change
            else:
                break
            fell, values = told.likelihood, tried
            told = self.told(values, self.names)
            if told.likelihood < fell + DONE:
                break
        return values, told


class Pooled(NamedTuple):
    """What wheels say of quantities: changes, covariance, and their scatter from one such traffic to another."""

    changes: FloatArray
    covariance: FloatArray
    scatter: FloatArray


def pooled(
    seen: FloatArray, free: FloatArray, before: FloatArray, floor: float, known: tuple[FloatArray, FloatArray] | None
) -> Pooled:
    """Return changes of quantities that each wheel shows, but for combinations that are free of each wheel.

    Parameters
    ----------
    seen
        Changes as wheels show them, (wheels, quantities); those with NaN do not count.
    free
        Combinations that are free, (quantities, combinations).
    before
        Standard deviations before, (quantities).
    floor
        Standard deviation of what all wheels have in common.
    known
        Changes that are known besides, and the inverse of their covariance.
    """
    whole = seen[np.isfinite(seen).all(axis=1)]
    precision, sums = np.zeros((len(before), len(before))), np.zeros(len(before))
    if len(whole) > 1:
        basis = null_space(free.T)
        each = whole @ basis
        middle = np.median(each, axis=0)
        spread = 1.4826 * np.median(np.abs(each - middle), axis=0) * np.sqrt(np.pi / 2.0 / len(each))
        own = basis @ np.diag(1.0 / (spread**2 + floor**2)) @ basis.T
        precision, sums = own, own @ (basis @ middle)
    if known is not None:
        precision, sums = precision + known[1], sums + known[1] @ known[0]
    covariance = np.asarray(np.linalg.inv(precision + np.diag(before**-2.0)))
    return Pooled(covariance @ sums, covariance, scatter_of(covariance, precision))


def scatter_of(covariance: FloatArray, precision: FloatArray) -> FloatArray:
    """Return the standard deviations of values with such a covariance, due to readings with such a precision."""
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance @ precision @ covariance), 0.0)))
