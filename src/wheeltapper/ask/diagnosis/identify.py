"""Parameters of a passage from its recording: least squares on the exact model, with exact derivatives.

windows grow from the first impact to the whole record, and the noise falls to its true size: in the first ones all
starts lead to the same place, in the last ones each impact adds what it knows
step    Levenberg's and Marquardt's, from a factorisation of the Jacobian itself (its condition may reach 1e8)
priors  what the site states, each with its standard deviation
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.diagnosis.force import noise_of
from wheeltapper.ask.diagnosis.synthetic import filtered
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.fields import Fields
from wheeltapper.march import program as contract
from wheeltapper.record.recording import Recording

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

WINDOWS = (0.011, 0.016, 0.022, 0.030, 0.040, 0.055, 0.075, 0.1, 0.14, 0.2, 0.3, 0.45, 0.65, 1.0, 1.5)
"""Ends of the windows, s after the onset."""
INFLATED = 20.0
"""Factor on the noise in the first window; it falls geometrically to one in the last."""
SETTLED = 0.02
"""A fit has converged where no parameter moves by more than this part of its standard deviation."""
STEPS, LAST_STEPS = 6, 40
"""Steps in a window but the last, and in the last one."""
LOUD = 6.0
"""The onset is where the acceleration first exceeds so many standard deviations of its noise."""


@dataclass(frozen=True)
class Estimate:
    """What a recording tells of its passage.

    Attributes
    ----------
    paths, values
        The fields that were found, in SI units.
    covariance
        (parameters, parameters) of the values' logarithms.
    chi_squared, freedom
        Sum of squared residuals over their variances, priors included, and their number less that of the parameters
        without a prior.
    converged
        Whether the last steps were small.
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
        """χ² per degree of freedom: near one where the model explains the recording."""
        return self.chi_squared / max(self.freedom, 1)

    def __getitem__(self, path: str) -> float:
        return float(self.values[self.paths.index(path)])

    def deviation(self, path: str) -> float:
        """Return the standard deviation of a value over the value."""
        i = self.paths.index(path)
        return float(np.sqrt(self.covariance[i, i]))

    def interval(self, path: str, level: float = 0.9) -> tuple[float, float]:
        """Return the interval that holds the true value with this probability."""
        from scipy.stats import norm

        half = float(norm.ppf(0.5 + 0.5 * level)) * self.deviation(path)
        return self[path] * float(np.exp(-half)), self[path] * float(np.exp(half))


class _Problem:
    """The residuals of one recording, and their derivatives by the logarithms of the parameters."""

    def __init__(
        self, recording: Recording, site: Site, start: Scenario, unknown: tuple[str, ...], noise: float
    ) -> None:
        self.recording, self.site, self.start, self.noise = recording, site, start, noise
        uncertain = {path: share for path, share in site.uncertainty.items() if share > 0.0 and path not in unknown}
        self.paths = (*unknown, *uncertain)
        self.first = np.array([float(Fields(start)(path)) for path in self.paths])
        if np.any(self.first == 0.0):
            path = self.paths[int(np.argmax(self.first == 0.0))]
            raise InputError("", path, "zero", "a value to start from that is not zero")
        self.stated = np.array([float(Fields(site.passage)(path)) for path in self.paths])
        self.shares = np.array([np.inf] * len(unknown) + list(uncertain.values()))
        self.sample = recording.samples
        self.used = np.isfinite(recording.samples)

    def scenario(self, logs: FloatArray) -> Scenario:
        """Return the scenario at some logarithms of values over those at the start."""
        values = self.first * np.exp(logs)
        return self.start.replaced(dict(zip(self.paths, values.tolist(), strict=True)))

    def at(self, logs: FloatArray, count: int, noise: float) -> tuple[FloatArray, FloatArray] | None:
        """Return residuals and Jacobian of the first `count` samples and the priors; None where no model is there."""
        values = self.first * np.exp(logs)
        times = self.recording.times[:count]
        try:
            found = trajectory(self.scenario(logs), self.paths, times)
        except (InputError, ValueError):
            return None
        if found.status not in (contract.DONE, contract.ENOUGH) or not np.all(np.isfinite(found.deck_acceleration)):
            return None
        sensor = self.site.sensor
        model = filtered(found.deck_acceleration, sensor)
        slopes = np.array([filtered(row, sensor) for row in found.of_deck_acceleration]) * values[:, None]
        residual = (model - self.sample[:count]) / noise
        counts = self.used[:count].copy()
        beyond = self.recording.clipped[:count]
        counts &= ~(beyond & (residual * np.sign(self.sample[:count]) > 0.0))  # there the model may be anywhere
        prior = (values / self.stated - 1.0) / self.shares
        of_prior = np.diag(values / self.stated / self.shares)
        return (
            np.concatenate([np.where(counts, residual, 0.0), prior]),
            np.vstack([np.where(counts, slopes, 0.0).T / noise, of_prior]),
        )


def onset(recording: Recording, noise: float) -> float:
    """Return when the acceleration first exceeds its noise, s after the trigger; the start if it never does."""
    loud = np.flatnonzero(np.abs(np.nan_to_num(recording.samples)) > LOUD * noise)
    return float(recording.times[loud[0]]) if len(loud) else recording.start


def identify(
    recording: Recording,
    site: Site,
    unknown: tuple[str, ...] = ("vehicle.mass", "vehicle.damping"),
    *,
    start: Mapping[str, float] | None = None,
    noise: float | None = None,
) -> Estimate:
    """Find the parameters of a passage.

    Parameters
    ----------
    recording
        The deck's acceleration.
    site
        Where it was made. What it is uncertain of is found, too, with that as its prior.
    unknown
        Paths of fields of which nothing is known beforehand.
    start
        By path, values to begin with instead of the site's.
    noise
        Standard deviation of the samples' noise, m/s²; by default the sensor's, or what the recording shows.
    """
    if recording.quantity != "deck acceleration":
        raise InputError(recording.source, "quantity", repr(recording.quantity), "'deck acceleration'")
    spread = noise or noise_of(recording, site.sensor)
    problem = _Problem(recording, site, site.passage.replaced(dict(start or {})), unknown, spread)
    begins = onset(recording, spread)
    ends = [begins + window for window in WINDOWS if begins + window < recording.times[-1]]
    counts = [int(np.searchsorted(recording.times, end)) for end in ends] + [len(recording.samples)]
    logs = np.zeros(len(problem.paths))
    converged = False
    for number, count in enumerate(counts):
        last = number + 1 == len(counts)
        inflated = spread * INFLATED ** (1.0 - (number + 1) / len(counts))
        logs, converged = _fitted(problem, logs, count, inflated, LAST_STEPS if last else STEPS)
    return _estimate(problem, logs, spread, converged)


def _fitted(problem: _Problem, logs: FloatArray, count: int, noise: float, steps: int) -> tuple[FloatArray, bool]:
    """Return where least squares over one window lead, and whether they settled."""
    here = problem.at(logs, count, noise)
    damping = 1e-3
    settled = False
    for _ in range(steps):
        if here is None:
            return logs, False
        residual, jacobian = here
        size = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
        scaled = jacobian / size
        covariance = _covariance(scaled)
        while damping < 1e8:
            padded = np.vstack([scaled, np.sqrt(damping) * np.eye(len(logs))])
            target = np.concatenate([-residual, np.zeros(len(logs))])
            step = np.linalg.lstsq(padded, target, rcond=None)[0]
            settled = bool(np.all(np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))))
            trial = logs + np.clip(step / size, -0.5, 0.5)
            there = problem.at(trial, count, noise)
            if there is not None and (there[0] ** 2).sum() <= (residual**2).sum():
                logs, here, damping = trial, there, max(0.1 * damping, 1e-12)
                break
            if settled:
                return logs, True
            damping *= 10.0
        else:
            return logs, settled
        if settled:
            return logs, True
    return logs, settled


def _covariance(jacobian: FloatArray) -> FloatArray:
    """Return the inverse of JᵀJ, from a singular value decomposition of J."""
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
    scaled = rows.T / np.maximum(singular, 1e-14 * singular[0])
    return np.asarray(scaled @ scaled.T)


def _estimate(problem: _Problem, logs: FloatArray, noise: float, converged: bool) -> Estimate:
    count = len(problem.sample)
    found = problem.at(logs, count, noise)
    many = len(problem.paths)
    if found is None:
        nothing = np.full((many, many), np.inf)
        return Estimate(problem.paths, problem.first, nothing, np.inf, count, False, problem.start, noise)
    residual, jacobian = found
    size = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
    covariance = _covariance(jacobian / size) / np.outer(size, size)
    freedom = int(problem.used.sum()) - int(np.isinf(problem.shares).sum())
    return Estimate(
        problem.paths, problem.first * np.exp(logs), covariance, float((residual**2).sum()), freedom, converged,
        problem.scenario(logs), noise,
    )  # fmt: skip
