"""A track by its traffic: values of the track that explain the readings of many healthy wheels.

Theory: docs/theory/gauges.rst, section 16.10.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.paths import value_at
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS, Known
from wheeltapper.diagnosis.gauges.traffic import LEVEL, NOISE, TILT, Told, Traffic, stepped

FloatArray = NDArray[np.float64]
OWN = {LEVEL: 3.0, TILT: 0.4, NOISE: 0.4}
"""Standard deviations before of what the traffic shows besides values of the scene, of logarithms: 13 dB, 1.2 dB per
octave, and 20 % of the noise."""
FREE = 1.5
"""The same of values of the track in a free search: a factor of 4.5."""
STARTS = (0.1, 0.3, 3.0, 10.0)
"""Factors on a stiffness with which a free search begins."""
ROUNDS, STEPS, LONGEST_STEP = 3, 4, 0.7
"""A fit takes so many rounds of so many steps, each of at most so much of a logarithm."""
DONE = 0.05
"""It ends where a round raises the likelihood by less."""


class Estimate(NamedTuple):
    """Values that explain the readings of traffic.

    Attributes
    ----------
    names, values
        What was free; and all values.
    changes, covariance
        Logarithms of the free values over the stated ones, and their covariance.
    before
        Their standard deviations before.
    likelihood
        Its logarithm, without what was known before.
    """

    names: tuple[str, ...]
    values: dict[str, float]
    changes: FloatArray
    covariance: FloatArray
    before: FloatArray
    likelihood: float

    def deviation(self, name: str) -> float:
        """Return the standard deviation of a logarithm."""
        own = self.names.index(name)
        return float(np.sqrt(self.covariance[own, own]))


def estimated(several: Sequence[Traffic], known: Known, free: bool = False) -> Estimate:
    """Return the values that explain traffic best.

    Parameters
    ----------
    several
        Readings of wheels alike.
    known
        Of the track and its wheels.
    free
        Whether the track's values are sought far from the stated ones, too.
    """
    spread = {path: share for path, share in known.spread.items() if path.startswith("track.")}
    spread = dict.fromkeys(spread, FREE) if free else spread
    spread |= {path: known.spread[path] for path in (MASS, CONTACT) if path in known.spread} | OWN
    stated = {path: float(value_at(known.scene, path)) for path in {*spread, MASS, CONTACT} - {*OWN}}
    stated |= dict.fromkeys(OWN, 0.0)
    search = _Search(several, stated, spread)
    if not free:
        return search.from_(stated)
    stiff = [path for path in spread if path.startswith("track.") and path.endswith("stiffness")]
    begun = [stated] + [stepped(stated, path, float(np.log(by))) for path in stiff for by in STARTS]
    return search.from_(max(begun, key=search.with_own_level))


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

    def mix(self, values: Mapping[str, float]) -> None:
        """Take the powers of roughness that explain most with these values."""
        for one in self.several:
            one.mix(values)

    def with_own_level(self, values: dict[str, float]) -> float:
        """Return the likelihood of values with the powers of roughness that explain most."""
        self.mix(values)
        return self.told(values, ()).likelihood

    def from_(self, values: dict[str, float]) -> Estimate:
        """Return where a search leads."""
        last = -np.inf
        for _ in range(ROUNDS):
            self.mix(values)
            values, told = self._scored(values)
            if told.likelihood < last + DONE:
                break
            last = told.likelihood
        changes = self.changes(values)
        likelihood = told.likelihood + 0.5 * float(((changes / self.before) ** 2).sum())
        return Estimate(self.names, values, changes, np.linalg.inv(told.information), self.before, likelihood)

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
