"""What the traffic of a site says of it: gains, places of gauges, track; how that changes; and the site with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2

from wheeltapper.describe.site import Site

UNKNOWN = 0.8
"""A value stays unknown whose standard deviation is more than this part of what it was before."""
APART = 3.0
"""A stated value contradicts the traffic that is so many standard deviations away."""
CHANCE = 0.01
"""A value is said to drift where its changes are less likely than this by chance."""


class Learned(NamedTuple):
    """A value of a site, before and after it was estimated from the traffic.

    Attributes
    ----------
    path
        Path of the value in the site.
    stated, value
        The stated and the new value, in the unit.
    before, after
        Standard deviations of the stated and of the new value, in the unit.
    alone, alone_deviation
        The value from the traffic alone, without the stated one, and its standard deviation; NaN if the traffic says
        nothing.
    scatter
        Standard deviation of the value from one traffic of this kind to another.
    unit
        "N/m", "m" and so on; "dB" for a level of roughness.
    """

    path: str
    stated: float
    value: float
    before: float
    after: float
    alone: float
    alone_deviation: float
    scatter: float
    unit: str = ""

    @property
    def unknown(self) -> bool:
        """Whether the traffic says little about the value."""
        return self.after > UNKNOWN * self.before

    @property
    def apart(self) -> float:
        """Distance of the stated value from the value of the traffic alone, in standard deviations of both together."""
        return float(abs(self.alone - self.stated) / np.hypot(self.before, self.alone_deviation))

    @property
    def contradicted(self) -> bool:
        """Whether the traffic contradicts the stated value."""
        return bool(self.apart > APART)

    def __str__(self) -> str:
        """Return a line."""
        said = f"{self.path}: {self.value:.4g} ± {self.after:.2g} {self.unit}".rstrip()
        said += f" (stated {self.stated:.4g} ± {self.before:.2g})"
        if self.contradicted:
            return f"{said}: THE TRAFFIC CONTRADICTS the stated value by {self.apart:.0f} standard deviations"
        return f"{said}: stays unknown" if self.unknown else said


class Drift(NamedTuple):
    """A value over periods of time.

    Attributes
    ----------
    path
        Path of the value in the site.
    periods, values, deviations
        Names of the periods, the value in each of them, and its standard deviation from one such period to another.
    chance
        Probability of such changes if the value is constant.
    """

    path: str
    periods: tuple[str, ...]
    values: tuple[float, ...]
    deviations: tuple[float, ...]
    chance: float

    @property
    def drifts(self) -> bool:
        """Whether the value is not constant."""
        return self.chance < CHANCE

    def __str__(self) -> str:
        """Return a line."""
        over = zip(self.periods, self.values, self.deviations, strict=True)
        listed = ", ".join(f"{name} {value:.4g} ± {deviation:.2g}" for name, value, deviation in over)
        word = "drifts" if self.drifts else "constant"
        return f"{self.path}: {word} (probability by chance {self.chance:.2g}): {listed}"


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """What the traffic of a site says about the site.

    Attributes
    ----------
    site
        The site with the new gains, places, values of the track and their uncertainties; `to_toml` writes it.
    stated
        The site as it was.
    learned
        Each value before and after.
    wheels, trains
        Numbers of healthy wheels and of trains.
    notes
        What was left out.
    periods
        The calibration of each period, by its name, if periods were asked for.
    """

    site: Site
    stated: Site
    learned: tuple[Learned, ...]
    wheels: int
    trains: int
    notes: tuple[str, ...] = ()
    periods: Mapping[str, Calibration] = field(default_factory=dict)

    def __getitem__(self, path: str) -> Learned:
        """Return a value by its path."""
        return next(one for one in self.learned if one.path == path)

    @property
    def contradictions(self) -> tuple[Learned, ...]:
        """Stated values that the traffic contradicts."""
        return tuple(one for one in self.learned if one.contradicted)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Paths of values about which the traffic says little."""
        return tuple(one.path for one in self.learned if one.unknown)

    @property
    def drift(self) -> tuple[Drift, ...]:
        """Values over the periods."""
        out = []
        for one in self.learned:
            found = [(name, its[one.path]) for name, its in self.periods.items() if _has(its, one.path)]
            told = [(name, its.value, its.scatter) for name, its in found if its.scatter > 0.0]
            if len(told) < 2:
                continue
            names, values, deviations = zip(*told, strict=True)
            weights = np.array(deviations) ** -2.0
            left = np.array(values) - weights @ np.array(values) / weights.sum()
            out.append(Drift(one.path, names, values, deviations, float(chi2.sf(weights @ left**2, len(told) - 1))))
        return tuple(out)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers, in SI units."""
        values = [
            {**one._asdict(), "unknown": one.unknown, "apart": one.apart, "contradicted": one.contradicted}
            for one in self.learned
        ]
        return {
            "wheels": self.wheels, "trains": self.trains, "values": values, "notes": list(self.notes),
            "drift": [{**one._asdict(), "drifts": one.drifts} for one in self.drift],
        }  # fmt: skip

    def __repr__(self) -> str:
        return f"<Calibration: {self.wheels} wheels of {self.trains} trains>"

    def __str__(self) -> str:
        """Return a line for each value."""
        compared = f"{self.wheels} healthy wheels of " if self.stated.track is not None else ""
        lines = [f"{compared}{self.trains} trains", *map(str, self.learned)]
        return "\n".join([*lines, *map(str, self.drift), *self.notes])


def _has(one: Calibration, path: str) -> bool:
    return any(learned.path == path for learned in one.learned)
