"""What healthy wheels show of a track: the likelihood of their readings, whose covariance depends on the track.

Wheels of like speed and load have the same model. What is free of each wheel is taken out of its readings. What is left
is a signal of the seats, which all wheels share, roughness of rail and wheels, and noise.

Theory: docs/theory/gauges.rst, section 16.10.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, null_space, solve_triangular

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.gauges.known import CONTACT, MASS
from wheeltapper.diagnosis.gauges.passing import ADVANCE, FORCE, SPEED, Passing, Runs
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness, rough_columns
from wheeltapper.diagnosis.gauges.scan import free_columns
from wheeltapper.diagnosis.gauges.sizing import responses_around
from wheeltapper.diagnosis.gauges.weighing import Band, band_of

FloatArray = NDArray[np.float64]
LEVEL, TILT, NOISE = "roughness level", "roughness tilt", "noise"
"""Logarithms of what the traffic shows besides values of the scene: the power of roughness over that of the level, its
tilt as in `rough_columns`, and the noise's power over the measured one."""
HIGHEST = 800.0
"""Readings of wheels without a flaw are compared up to this frequency, Hz."""
KEPT = 3
"""Models that are kept."""
STEP, NEAR = 0.02, 0.12
"""Of differences by which derivatives are taken, of logarithms; derivatives are kept for values so near to theirs."""
FAR = 0.35
"""The signal of the seats is a line through values whose logarithms are no farther away: it costs runs."""
LEVELS = np.linspace(-4.0, 4.0, 65)
"""Logarithms of a wheel's power of roughness, over the usual one, that are tried."""
OF_WHEELS = 0.9
"""Their standard deviation: 4 dB."""
SHARES = np.array([0.0, 0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9])
"""Shares of the rail in the power of roughness that are tried."""


class Alike(NamedTuple):
    """Wheels of like speed and load, whose readings are taken at equal places.

    Attributes
    ----------
    passing
        A wheel like them; its `used` says which readings are compared.
    readings
        (samples, sensors, wheels), N.
    forces
        Static force of each wheel, N.
    """

    passing: Passing
    readings: FloatArray
    forces: FloatArray


class Mixed(NamedTuple):
    """How roughness of wheels alike is made up.

    Attributes
    ----------
    powers
        Of each wheel's roughness over the usual one.
    rail
        Share of the rail's, which all wheels roll over.
    """

    powers: FloatArray
    rail: float

    @property
    def between(self) -> FloatArray:
        """Covariance of roughness between wheels, over the usual power, (wheels, wheels)."""
        return np.diag((1.0 - self.rail) * self.powers) + self.rail


class Told(NamedTuple):
    """What readings say of values: logarithm of the likelihood, its slope, and Fisher's information."""

    likelihood: float
    slope: FloatArray
    information: FloatArray


class Traffic:
    """Readings of wheels alike without what is free of each wheel, over the noise.

    Parameters
    ----------
    alike
        The wheels.
    scene
        One wheel on the stated track.
    """

    def __init__(self, alike: Alike, scene: Scenario) -> None:
        passing = alike.passing
        self.passing, self._runs = passing, Runs(passing, scene)
        self._band = band_of(passing, min(HIGHEST, passing.highest))
        level = self._band.smooth(self._level({}))
        noise = np.linalg.cholesky(_noise_covariance(self._band))
        free = solve_triangular(noise, free_columns(self._band, level, passing.speed), lower=True)
        self._kept = solve_triangular(noise, null_space(free.T), lower=True, trans="T").T
        each = np.moveaxis(alike.readings, 2, 0)
        self._read = self._kept @ np.stack([self._band.taken(self._band.smooth(one)) for one in each], axis=1)
        self._share = alike.forces / passing.static_force
        self.mixed = Mixed(np.ones(len(each)), 0.0)
        self._line: tuple[Mapping[str, float], FloatArray, dict[str, FloatArray]] | None = None
        self._models: dict[Any, tuple[FloatArray, FloatArray]] = {}
        self._changed: dict[str, tuple[FloatArray, FloatArray]] = {}
        self._changed_at: Mapping[str, float] = {}

    @property
    def wheels(self) -> int:
        """How many there are."""
        return len(self._share)

    def _level(self, values: Mapping[str, float]) -> FloatArray:
        own = {SPEED: self.passing.speed, FORCE: self.passing.static_force, ADVANCE: 0.0}
        return self._runs.readings({**values, **own}, "fresh")

    def _signal(self, values: Mapping[str, float]) -> FloatArray:
        """Return the signal of a wheel: by a run, or along the line."""
        if self._line is not None and _way(values, self._line[0]) < FAR:
            held, signal, slopes = self._line
            return np.asarray(signal + sum(slope * np.log(values[n] / held[n]) for n, slope in slopes.items()))
        of_scene = {path: value for path, value in values.items() if "." in path}
        return np.asarray(self._kept @ self._band.taken(self._band.smooth(self._level(of_scene))))

    def anchor(self, values: Mapping[str, float]) -> None:
        """Draw the line of the signal through these values, if it is far from them."""
        if self._line is not None and _way(values, self._line[0]) < 0.5 * FAR:
            return
        self._line = None
        signal = self._signal(values)
        paths = [path for path in values if "." in path]
        slopes = {path: (self._signal(stepped(values, path, STEP)) - signal) / STEP for path in paths}
        self._line = dict(values), signal, slopes
        self._models.clear()

    def model(self, values: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
        """Return the signal of a wheel, (readings), and the covariance of roughness, (readings, readings)."""
        key = tuple(values.values())
        if key not in self._models:
            of_scene = {path: value for path, value in values.items() if "." in path}
            responses = responses_around(self.passing, self._runs.scene.replaced(of_scene))
            stiffness = contact_stiffness(values[CONTACT], self.passing.static_force)
            rough = self._kept @ rough_columns(self._band, responses, stiffness, values[MASS], tilt=values[TILT])
            if len(self._models) == KEPT:
                self._models.pop(next(iter(self._models)))
            self._models[key] = self._signal(values), np.exp(values[LEVEL]) * (rough @ rough.T)
        return self._models[key]

    def told(self, values: Mapping[str, float], names: Sequence[str] = ()) -> Told:
        """Return the likelihood of values; with names, how it changes with them, by logarithms."""
        signal, rough = self.model(values)
        sizes, basis = np.linalg.eigh(rough)
        parts, turned = np.linalg.eigh(self.mixed.between)
        left = basis.T @ ((self._read - np.outer(signal, self._share)) @ turned)
        variance = np.exp(values[NOISE]) + np.maximum(parts, 0.0) * np.maximum(sizes, 0.0)[:, None]
        likelihood = float(_log_likelihood(left, variance))
        if not names:
            return Told(likelihood, np.zeros(0), np.zeros((0, 0)))
        changes = self._changes(values, names, signal, rough)
        weighed, noisy = left / variance, NOISE in names
        share = (self._share @ turned) ** 2
        signals = np.stack([basis.T @ one for one, _ in changes], axis=1)
        roughs = np.stack([basis.T @ one @ basis for _, one in changes])
        outer = (weighed * parts) @ weighed.T
        slope = 0.5 * (roughs * outer).sum(axis=(1, 2)) - 0.5 * np.einsum("jaa,a->j", roughs, (parts / variance).sum(1))
        slope += signals.T @ (weighed @ (self._share @ turned))
        both = (parts**2 / variance) @ (1.0 / variance).T
        flat = roughs.reshape(len(names), -1)
        information = 0.5 * (flat * both.ravel()) @ flat.T + signals.T @ (signals * (share / variance).sum(1)[:, None])
        if noisy:
            own, power = names.index(NOISE), float(np.exp(values[NOISE]))
            slope[own] = 0.5 * power * float((weighed**2 - 1.0 / variance).sum())
            across = 0.5 * power * np.einsum("jaa,a->j", roughs, (parts / variance**2).sum(axis=1))
            across[own] = 0.5 * power**2 * float((1.0 / variance**2).sum())
            information[own], information[:, own] = across, across
        return Told(likelihood, slope, information)

    def _changes(
        self, values: Mapping[str, float], names: Sequence[str], signal: FloatArray, rough: FloatArray
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return how signal and covariance change with the logarithms of values."""
        new = not self._changed or _way(values, self._changed_at) > NEAR
        if new or abs(values[TILT] - self._changed_at[TILT]) > NEAR:
            others = {name: self.model(stepped(values, name, STEP)) for name in names if name not in (LEVEL, NOISE)}
            self._changed = {n: ((one - signal) / STEP, (its - rough) / STEP) for n, (one, its) in others.items()}
            self._changed_at = values
        nothing = np.zeros_like(signal)
        of_powers = {LEVEL: (nothing, rough), NOISE: (nothing, np.zeros_like(rough))}
        return [{**self._changed, **of_powers}[name] for name in names]

    def mix(self, values: Mapping[str, float]) -> float:
        """Take the powers of each wheel's roughness and the rail's share that explain most; return the likelihood."""
        signal, rough = self.model(values)
        sizes, basis = np.linalg.eigh(rough)
        sizes, noise = np.maximum(sizes, 0.0)[:, None], np.exp(values[NOISE])
        left = basis.T @ (self._read - np.outer(signal, self._share))
        found = np.array([_log_likelihood(left, noise + np.exp(one) * sizes, axis=0) for one in LEVELS])
        powers = np.exp(LEVELS[np.argmax(found - 0.5 * (LEVELS[:, None] / OF_WHEELS) ** 2, axis=0)])
        tried = []
        for share in SHARES.tolist():
            parts, turned = np.linalg.eigh(Mixed(powers, share).between)
            tried.append(float(_log_likelihood(left @ turned, noise + np.maximum(parts, 0.0) * sizes)))
        self.mixed = Mixed(powers, float(SHARES[int(np.argmax(tried))]))
        return max(tried)

    def left_over(self, values: Mapping[str, float]) -> FloatArray:
        """Return χ² of a reading of each wheel, with the power of roughness that it has."""
        signal, rough = self.model(values)
        sizes, basis = np.linalg.eigh(rough)
        left = basis.T @ (self._read - np.outer(signal, self._share))
        variance = np.exp(values[NOISE]) + np.maximum(sizes, 0.0)[:, None] * self.mixed.powers
        return np.asarray((left**2 / variance).mean(axis=0))

    def without(self, wheels: NDArray[np.bool_]) -> None:
        """Leave wheels out."""
        self._read, self._share = self._read[:, ~wheels], self._share[~wheels]
        self.mixed = self.mixed._replace(powers=self.mixed.powers[~wheels])


def stepped(values: Mapping[str, float], name: str, by: float) -> dict[str, float]:
    """Return values of which one is changed by a step of its logarithm."""
    held = values[name]
    return {**values, name: held + by if name in (LEVEL, TILT, NOISE) else held * float(np.exp(by))}


def _log_likelihood(left: FloatArray, variance: FloatArray, axis: int | None = None) -> Any:
    return -0.5 * (left**2 / variance + np.log(variance)).sum(axis=axis)


def _way(values: Mapping[str, float], others: Mapping[str, float]) -> float:
    """Return the largest difference of the logarithms of two sets of values of a scene."""
    return max(abs(float(np.log(values[name] / others[name]))) for name in values if "." in name)


def _noise_covariance(band: Band) -> FloatArray:
    """Return the covariance of the readings that are compared, N², of white noise after the low-pass."""
    passing = band.passing
    count = 2 * len(passing.readings)
    frequencies = np.asarray(np.fft.rfftfreq(count, 1.0 / passing.rate))
    along = np.fft.irfft(band.gain(frequencies) ** 2, count) * passing.noise**2
    blocks = []
    for own in band.picked.T:
        rows = np.flatnonzero(own)
        blocks.append(along[np.abs(rows[:, None] - rows)])
    covariance = np.asarray(block_diag(*blocks))
    return covariance + 1e-3 * np.diag(np.diag(covariance))
