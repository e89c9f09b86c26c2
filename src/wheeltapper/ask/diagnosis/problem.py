"""One recording against one family of models: what is known of the parameters, residuals, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.diagnosis.sensing import drifted, filtered
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor import Sensor
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.fields import Fields
from wheeltapper.march import program as contract
from wheeltapper.record.recording import Recording

FloatArray = NDArray[np.float64]
Motion = Callable[[Scenario, tuple[str, ...], FloatArray], tuple[FloatArray, FloatArray] | None]
"""The deck's acceleration at some times and its derivatives (parameters, times); None where no model is there."""

DIFFERENCE, BETWEEN = 1e-5, ("vehicle.damper_play_start",)
"""Step of differences, over the value; over one where the value lies about zero."""


class Prior(NamedTuple):
    """What is known of a parameter beforehand: nothing, or a distribution.

    normal: centre and relative standard deviation; lognormal: centre and standard deviation of the logarithm;
    uniform: between centre - deviation and centre + deviation; flat: nothing, but that it is positive.
    """

    centre: float
    deviation: float = np.inf
    kind: Literal["flat", "normal", "lognormal", "uniform"] = "flat"


def by_tangents(scenario: Scenario, paths: tuple[str, ...], times: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return the motion of the core model with its exact derivatives."""
    found = trajectory(scenario, paths, times)
    if found.status not in (contract.DONE, contract.ENOUGH):
        return None
    return found.deck_acceleration, found.of_deck_acceleration


def by_differences(
    scenario: Scenario, paths: tuple[str, ...], times: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return the motion of a wheelset whose damper has an end of its own, with central differences."""
    from wheeltapper.ask.loose import damper_motion

    def moved(model: Scenario) -> FloatArray:
        status, _, acceleration = damper_motion(model, times)
        return acceleration if status in (contract.DONE, contract.ENOUGH) else np.full(len(times), np.nan)

    def slope(path: str) -> FloatArray:
        value = float(Fields(scenario)(path))
        step = DIFFERENCE * (abs(value) if path not in BETWEEN else 1.0)
        up, down = (scenario.replaced({path: value + side * step}) for side in (1, -1))
        return (moved(up) - moved(down)) / (2.0 * step)

    slopes = [slope(path) for path in paths]
    return moved(scenario), np.array(slopes).reshape(len(paths), len(times))


class Problem:
    """The residuals of one recording against one family of models, and their derivatives by the coordinates.

    Parameters
    ----------
    recording, sensor, noise
        The samples, what they went through, and the standard deviation of their noise, m/s².
    start
        The model to start from.
    priors
        The parameters, by path.
    motion
        How the models move.
    """

    def __init__(
        self, recording: Recording, sensor: Sensor, noise: float, start: Scenario, priors: Mapping[str, Prior],
        motion: Motion = by_tangents,
    ) -> None:  # fmt: skip
        self.recording, self.sensor, self.noise, self.start, self.motion = recording, sensor, noise, start, motion
        self.paths, self.priors = tuple(priors), tuple(priors.values())
        self.first = np.array([float(Fields(start)(path)) for path in self.paths])
        self.linear = np.array([prior.kind == "uniform" for prior in self.priors], dtype=bool)
        self.scale = np.where(self.linear, [prior.deviation for prior in self.priors], 1.0)
        if np.any((self.first <= 0.0) & ~self.linear):
            path = self.paths[int(np.argmax((self.first <= 0.0) & ~self.linear))]
            raise InputError("", path, f"{float(Fields(start)(path)):g}", "a positive value to start from")
        self.times = recording.times
        self.samples = np.nan_to_num(recording.samples)
        self.there = np.isfinite(recording.samples)
        self._known: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def until(self, time: float) -> Problem:
        """Return the same with the part of the recording before a time after the trigger, s."""
        part = self.recording.until(time)
        return Problem(
            part, self.sensor, self.noise, self.start, dict(zip(self.paths, self.priors, strict=True)), self.motion
        )

    def values(self, at: FloatArray) -> FloatArray:
        """Return the parameters' values at some coordinates, counted from the start."""
        near = np.where(self.linear, 0.0, at)
        return np.asarray(np.where(self.linear, self.first + self.scale * at, self.first * np.exp(near)))

    def scenario(self, at: FloatArray) -> Scenario:
        """Return the model at some coordinates."""
        return self.start.replaced(dict(zip(self.paths, self.values(at).tolist(), strict=True)))

    def within(self, at: FloatArray) -> FloatArray:
        """Return the nearest coordinates that uniform priors allow."""
        centre = np.array([prior.centre for prior in self.priors])
        middle = (centre - self.first) / self.scale
        return np.where(self.linear, np.clip(at, middle - 1.0, middle + 1.0), at)

    def residuals(self, at: FloatArray, count: int) -> tuple[FloatArray, FloatArray] | None:
        """Return differences from the first `count` samples, m/s², and their derivatives (samples, parameters)."""
        if not count:
            return np.empty(0), np.empty((0, len(self.paths)))
        if self._known is None or not np.array_equal(self._known[0], at) or len(self._known[1]) < count:
            found = self._computed(at, count)
            if found is None:
                return None
            self._known = (at.copy(), *found)
        _, residual, slopes = self._known
        return residual[:count], slopes[:count]

    def _computed(self, at: FloatArray, count: int) -> tuple[FloatArray, FloatArray] | None:
        times = self.times[:count]
        try:
            model = self.scenario(at).replaced({"duration": float(times[-1] + 0.5 / self.recording.rate)})
            found = self.motion(model, self.paths, times)
        except (InputError, ValueError):
            return None
        if found is None or not np.all(np.isfinite(found[0])):
            return None
        per = np.where(self.linear, self.scale, self.values(at))
        slopes = np.array([filtered(row, self.sensor) for row in found[1]]).reshape(len(per), count) * per[:, None]
        residual = drifted(filtered(found[0], self.sensor), times, self.sensor) - self.samples[:count]
        beyond = self.recording.clipped[:count] & (residual * np.sign(self.samples[:count]) > 0.0)
        counts = self.there[:count] & ~beyond  # beyond a clipped sample the model may be anywhere
        return np.where(counts, residual, 0.0), np.where(counts, slopes, 0.0).T

    def prior_residuals(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far the parameters are from what is known of them, over its deviation, and the derivatives."""
        out, slopes = [], []
        for prior, value in zip(self.priors, self.values(at).tolist(), strict=True):
            if prior.kind == "normal":
                out.append((value / prior.centre - 1.0) / prior.deviation)
                slopes.append(value / prior.centre / prior.deviation)
            elif prior.kind == "lognormal":
                out.append(np.log(value / prior.centre) / prior.deviation)
                slopes.append(1.0 / prior.deviation)
            else:
                out.append(0.0)
                slopes.append(0.0)
        return np.array(out), np.diag(slopes)

    def at(self, at: FloatArray, count: int, noise: float) -> tuple[FloatArray, FloatArray] | None:
        """Return all residuals over their deviations and the Jacobian."""
        found = self.residuals(at, count)
        if found is None:
            return None
        beliefs, slopes = self.prior_residuals(at)
        return np.concatenate([found[0] / noise, beliefs]), np.vstack([found[1] / noise, slopes])
