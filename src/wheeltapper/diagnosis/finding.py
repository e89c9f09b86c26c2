"""The result of a diagnosis: as numbers, as one paragraph, as JSON."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.trajectory import is_derivable
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.faults.base import CATALOGUE, DAMPING, MASS, PLAIN
from wheeltapper.diagnosis.inference.combinations import Combination, Combinations, combinations
from wheeltapper.diagnosis.inference.estimate import Estimate
from wheeltapper.diagnosis.inference.information import information
from wheeltapper.diagnosis.inference.timing import TIME_ZERO
from wheeltapper.ground.arguments import check_choice
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.fields import Fields
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]

HEALTHY, NOT_EXPLAINED, NO_WHEEL = "healthy", "not explained", "no wheel"
"""Verdicts that are no fault of the catalogue."""
FORMAT = 1
"""Version of the layout of a finding's JSON."""
KIP = 4448.2216152605
"""One kip (1000 pounds-force), N."""
ASKED = (MASS, DAMPING)
"""Fields among which, together with the uncertain ones, combinations are looked for."""
MOST = 3
"""Largest number of known combinations that the paragraph lists."""


@dataclass(frozen=True, eq=False)
class Finding(Shown):
    """What one recording shows about a wheelset.

    Attributes
    ----------
    verdict
        The most probable fault of the catalogue, or "healthy". "not explained" if no model fits, "no wheel" if nothing
        exceeds the noise.
    probabilities
        Posterior probabilities of "healthy" and of each fault that was compared; empty without a wheel. If the verdict
        is "not explained", they only rank the models.
    estimate
        The parameters of the best model, with intervals. None without a wheel, and if no model explains the recording:
        intervals that allow for noise alone would be meaningless.
    reduced
        χ² per degree of freedom of the best model; near one if it explains the recording.
    size, interval
        Size of the fault and its 90 % interval, in the unit of the catalogue; NaN without a fault. If the recording
        hardly determines the size, there is only the interval.
    alike
        Other verdicts that this recording does not exclude.
    speed, static_force, largest_force
        Speed, m/s, and forces, N, of the wheelset. If the verdict is "not explained", the forces are reconstructed from
        the recording, and the speed is the measured or stated one, corrected by the time at which the recording begins.
    impacts
        Number of impacts after losses of contact; None if the verdict is "not explained".
    notes
        What the user should know.
    recording, site
        The recording, and its site.
    noise
        Standard deviation of the samples' noise, m/s².
    weights
        Logarithms of the probabilities, up to a constant. They also rank faults whose probability is rounded to zero.
    forces_from
        "model" or "recording": the source of the forces; "" without a wheel.
    largest_force_deviation
        Standard error of a largest force that is reconstructed from the recording, due to the sensor's noise, N.
        Infinite if samples are clipped there, NaN if the force is a model's.
    """

    verdict: str
    probabilities: dict[str, float]
    estimate: Estimate | None
    reduced: float
    size: float
    interval: tuple[float, float]
    alike: tuple[str, ...]
    speed: float
    static_force: float
    largest_force: float
    impacts: int | None
    notes: tuple[str, ...]
    recording: Recording
    site: Site
    noise: float
    weights: dict[str, float] = field(repr=False, default_factory=dict)
    forces_from: str = ""
    _acceleration: FloatArray = field(repr=False, default_factory=lambda: np.empty(0))
    largest_force_deviation: float = np.nan

    @property
    def model(self) -> Scenario | None:
        """The passage that fits best; None without an estimate."""
        return self.estimate.scenario if self.estimate is not None else None

    @property
    def part(self) -> str:
        """Part of the wheelset that has the fault: "suspension", "damper", "wheel", "load"; "" without a fault."""
        return CATALOGUE[self.verdict].part if self.verdict in CATALOGUE else ""

    @cached_property
    def combinations(self) -> Combinations | None:
        """What this passage cannot determine, and the products of powers that it determines best.

        The information matrix decides both. None without a model, if the model has no exact derivatives, or if the
        trigger is uncertain and the rail has no places that it could shift.
        """
        if self.model is None or not is_derivable(self.model):
            return None
        named = tuple(path for path in ASKED if float(Fields(self.model)(path)) > 0.0)
        here = self.site.model_copy(update={"passage": self.model})
        trigger = np.inf if self.site.trigger is None else self.site.trigger
        try:
            return combinations(information(here, named, trigger=trigger, noise=self.noise))
        except InputError:
            if trigger == 0.0:
                raise
            return None

    @property
    def model_acceleration(self) -> FloatArray:
        """The deck's acceleration of the best or nearest model at the recording's times, m/s²."""
        return self._acceleration

    @property
    def dynamic_ratio(self) -> float:
        """Largest over static force."""
        return self.largest_force / self.static_force

    def score(self, part: str) -> float:
        """Return the logarithm of the odds of a fault in one part of the wheelset, against health.

        It is minus infinity if no fault of that part was compared.
        """
        check_choice(part, "part", dict.fromkeys(fault.part for fault in CATALOGUE.values()))
        faulty = [weight for name, weight in self.weights.items() if name != HEALTHY and CATALOGUE[name].part == part]
        if not faulty or not np.isfinite(max(faulty)):
            return -np.inf
        return float(np.logaddexp.reduce(faulty) - self.weights[HEALTHY])

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the samples, for JSON; in SI units."""
        values = {}
        if self.estimate is not None:
            for path in self.estimate.paths:
                low, high = self.estimate.interval(path)
                values[path] = {"value": self.estimate[path], "interval_90": [_or_none(low), _or_none(high)]}
        return {
            "format": FORMAT,
            "source": self.recording.source,
            "site": self.site.name,
            "verdict": self.verdict,
            "probabilities": dict(self.probabilities),
            "alike": list(self.alike),
            "size": _or_none(self.size),
            "size_interval_90": [_or_none(end) for end in self.interval],
            "size_unit": CATALOGUE[self.verdict].unit if self.verdict in CATALOGUE else "",
            "chi_squared_reduced": _or_none(self.reduced),
            "noise": self.noise,
            "speed": _or_none(self.speed),
            "static_force": _or_none(self.static_force),
            "largest_force": _or_none(self.largest_force),
            "largest_force_deviation": _or_none(self.largest_force_deviation),
            "forces_from": self.forces_from or None,
            "impacts": self.impacts,
            "estimates": values,
            "combinations": self._combinations_table(),
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        """Return one paragraph."""
        said = [f"{self.recording.source or 'recording'}: {self._headline_text()}."]
        if self.verdict in CATALOGUE:
            fault = CATALOGUE[self.verdict]
            said.append(f"{_capitalised(fault.meaning)}.")
            if np.isfinite(self.size):
                said.append(f"{_capitalised(fault.size)}: {_range_text(self.size, *self.interval, fault.unit)}.")
            elif np.all(np.isfinite(self.interval)):
                ends = " to ".join(_range_text(end, np.nan, np.nan, fault.unit) for end in self.interval)
                said.append(f"{_capitalised(fault.size)} hardly determined by this recording: {ends} (90 %).")
        if self.verdict != NO_WHEEL:
            said += self._model_and_forces()
        if self.alike:
            said.append(f"This recording does not exclude: {', '.join(self.alike)}.")
        said += [f"{_capitalised(note)}." for note in self.notes]
        return " ".join(said)

    def _model_and_forces(self) -> list[str]:
        """Return sentences on the forces, the parameters, and how well a model explains the recording."""
        explained = self.verdict != NOT_EXPLAINED
        said = [self._values_text()] if explained else []
        start = "Static force" if explained else "From the recording: static force"
        within = f" ± {1e-3 * self.largest_force_deviation:.1f} kN" if isfinite(self.largest_force_deviation) else ""
        end = f"; {self.impacts} impacts after losses of contact" if explained else " as measured or stated"
        said.append(
            f"{start} {_force_text(self.static_force)}, largest {_force_text(self.largest_force)}{within}, "
            f"{self.dynamic_ratio:.2f} times the static one, at {3.6 * self.speed:.1f} km/h{end}."
        )
        if self.combinations is not None:
            said += [f"Not known: {one}." for one in self.combinations.unknown]
            best = [str(one) for one in self.combinations.known[:MOST]]
            said += [f"Better known than each by itself: {'; '.join(best)}."] if best else []
        said.append(f"The {'best' if explained else 'nearest'} model leaves χ² = {self.reduced:.3g} per sample.")
        return said

    def _combinations_table(self) -> dict[str, list[dict[str, Any]]]:
        told = self.combinations
        if told is None:
            return {}
        return {
            "not_known": [_combination_table(one) for one in told.unknown],
            "known": [_combination_table(one) for one in told.known],
        }

    def _headline_text(self) -> str:
        if self.verdict == NO_WHEEL:
            return "no wheel: nothing rises from the noise"
        if self.verdict == NOT_EXPLAINED:
            best = max(self.probabilities, key=self.probabilities.__getitem__, default="none")
            return f"not explained: neither a healthy wheelset nor a fault of the catalogue fits (nearest: {best})"
        return f"{self.verdict} (probability {_percent_text(self.probabilities[self.verdict])})"

    def _values_text(self) -> str:
        assert self.estimate is not None
        parts = []
        fields = {**PLAIN, **{path: told for fault in CATALOGUE.values() for path, told in fault.fields.items()}}
        for path, (words, unit, factor) in fields.items():
            if path in self.estimate.paths:
                ends = [factor * end for end in self.estimate.interval(path)]
                parts.append(f"{words} {_range_text(factor * self.estimate[path], ends[0], ends[1], unit)}")
        said = f"{_capitalised(', '.join(parts))}." if parts else "Mass and damping as stated."
        if TIME_ZERO in self.estimate.paths:
            value, low, high = (1e3 * t for t in (self.estimate[TIME_ZERO], *self.estimate.interval(TIME_ZERO)))
            said += f" Time zero {value:+.3f} ms after the trigger (90 %: {low:+.3f} to {high:+.3f})."
        return said


def _combination_table(one: Combination) -> dict[str, Any]:
    return {"exponents": one.exponents, "deviation": _or_none(one.deviation), "reason": one.reason}


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _percent_text(probability: float) -> str:
    if 0.0005 < probability < 0.9995:
        return f"{100.0 * probability:.1f} %"
    return ">99.9 %" if probability > 0.5 else "<0.1 %"


def _force_text(force: float) -> str:
    return f"{force / 1e3:.1f} kN ({force / KIP:.1f} kips)"


def _range_text(value: float, low: float, high: float, unit: str) -> str:
    said = {"m": (1e3, "mm"), "": (1.0, "")}.get(unit, (1.0, unit))
    factor, unit = said
    if unit == "mm" and abs(value) < 1e-3:
        factor, unit = 1e6, "um"
    text = f"{factor * value:.4g} {unit}".strip()
    return f"{text} (90 %: {factor * low:.4g} to {factor * high:.4g})" if np.isfinite(low + high) else text


def _capitalised(text: str) -> str:
    return text[:1].upper() + text[1:]
