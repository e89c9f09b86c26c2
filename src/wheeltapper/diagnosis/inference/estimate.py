"""Estimation of the parameters of a passage from its recording, with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site, as_site
from wheeltapper.diagnosis.force.reconstruction import noise_of
from wheeltapper.diagnosis.inference.damage import without_damage
from wheeltapper.diagnosis.inference.fitting import Fit
from wheeltapper.diagnosis.inference.problem import Prior, number_at
from wheeltapper.diagnosis.inference.timing import TIME_ZERO, untimed
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.ground.arguments import as_between, as_quantity, check_choice
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.fields import Fields
from wheeltapper.record.recordings.given import as_recording
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]

SHORTEST = 32
"""Smallest number of samples that are not missing; a recording with fewer is refused."""
LOUD = 6.0
"""Standard deviations of the noise. The onset is the first sample whose magnitude exceeds this; noise alone does so
once in 5e8 samples."""


@dataclass(frozen=True)
class Estimate(Shown):
    """Estimated parameters of a passage.

    Attributes
    ----------
    paths, values
        The fields that were found, in SI units.
    covariance
        (parameters, parameters) of the values' logarithms, and of the time zero itself (path "time_zero"), in s.
    chi_squared, freedom
        χ²: sum of squared residuals over their variances, priors included. Degrees of freedom: number of samples less
        the number of parameters without a prior.
    converged
        Whether the fit has converged.
    scenario
        The best model.
    noise
        Standard deviation of the samples' noise that was assumed, m/s².
    """

    paths: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    chi_squared: float
    freedom: int
    converged: bool
    scenario: Scenario
    noise: float

    @property
    def reduced(self) -> float:
        """χ² per degree of freedom: near one if the model explains the recording."""
        return self.chi_squared / max(self.freedom, 1)

    def __getitem__(self, path: str) -> float:
        return float(self.values[self._path_index(path)])

    def _path_index(self, path: str) -> int:
        check_choice(path, "path", self.paths)
        return self.paths.index(path)

    def deviation(self, path: str) -> float:
        """Return the relative standard deviation of a value; of the time zero the deviation itself, s."""
        i = self._path_index(path)
        return float(np.sqrt(self.covariance[i, i]))

    def correlation(self, path: str, other: str) -> float:
        """Return the correlation of the errors of two values."""
        i, j = self._path_index(path), self._path_index(other)
        return float(self.covariance[i, j] / np.sqrt(self.covariance[i, i] * self.covariance[j, j]))

    def interval(self, path: str, level: float = 0.9) -> tuple[float, float]:
        """Return the interval that holds the true value with this probability."""
        from scipy.special import ndtri

        half = float(ndtri(0.5 + 0.5 * as_between(level, "level", 0.0, 1.0))) * self.deviation(path)
        if path == TIME_ZERO:
            return self[path] - half, self[path] + half
        with np.errstate(over="ignore"):
            return self[path] * float(np.exp(-half)), self[path] * float(np.exp(half))


def onset(recording: Recording, noise: float) -> float:
    """Return when the acceleration first exceeds the noise, s after the trigger; the start if it never does."""
    loud = np.flatnonzero(np.abs(np.nan_to_num(recording.samples)) > LOUD * noise)
    return float(recording.times[loud[0]]) if len(loud) else recording.start


def priors_of(site: Site, unknown: tuple[str, ...] = ()) -> dict[str, Prior]:
    """Return the priors: flat ones of the unknown fields, normal ones of the uncertain fields and of the trigger."""
    out = {path: Prior(number_at(site.passage, path)) for path in unknown}
    for path, share in site.uncertainty.items():
        if share > 0.0 and path not in out:
            out[path] = Prior(float(Fields(site.passage)(path)), share, "normal")
    if site.trigger != 0.0:
        out[TIME_ZERO] = Prior(0.0, np.inf if site.trigger is None else site.trigger, "shift")
    return out


def recorded_at(recording: Any, site: Any, noise: Any) -> tuple[Recording, Site, float]:
    """Return a recording without damaged samples, its site, and the standard deviation of its noise, m/s².

    Refuse anything else, and a recording that the site's sensor cannot have made.
    """
    recording, site = as_recording(recording), as_site(site)
    if recording.quantity != "deck acceleration":
        raise InputError(recording.source, "quantity", repr(recording.quantity), "'deck acceleration'")
    good = int(np.isfinite(recording.samples).sum())
    if good < SHORTEST:
        raise InputError(recording.source, "samples", f"{good} of them", f"at least {SHORTEST}")
    if abs(recording.rate / site.sensor.rate - 1.0) > 1e-6:
        raise InputError(
            recording.source,
            "rate",
            f"{recording.rate:g} Hz",
            f"{site.sensor.rate:g} Hz, the rate of the site's sensor",
        )
    stated = None if noise is None else as_quantity(noise, "noise", "acceleration")
    spread = stated or noise_of(recording, site.sensor)
    return without_damage(recording, spread, Scale(site.passage).period), site, spread


def site_at_speed(site: Site, speed: float | None) -> Site:
    """Return a site whose passage has the speed that a gauge has read, m/s; the same site without a reading."""
    return site if speed is None else site.model_copy(update={"passage": site.passage.replaced({"speed": speed})})


def estimate_of(found: Fit, noise: float) -> Estimate:
    """Return the result of a fit."""
    return Estimate(
        found.paths, found.values, found.covariance, found.chi_squared, found.freedom, found.converged,
        untimed(found.scenario), noise,
    )  # fmt: skip
