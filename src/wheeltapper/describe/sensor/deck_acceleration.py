"""The accelerometer of a deck: its filter, its offset and drift, its converter."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from wheeltapper.describe.noun import Frequency, NoiseDensity, PositiveAcceleration, SignedAcceleration
from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.base import DECK, FloatArray, Seen, Sensor
from wheeltapper.ground.errors import InputError

OVERSAMPLED = 8
"""The filter is computed at this multiple of the sample rate, where it is close to the analogue filter that it stands
for."""
AROUND = 3
"""Number of samples on either side from which a value between two samples is interpolated, by a polynomial of degree
five."""


class DeckAcceleration(Sensor):
    """An accelerometer on a deck, m/s², upwards.

    Parameters
    ----------
    noise
        Density of its white noise, m/s²/√Hz. The standard deviation of a sample is this times √(rate/2).
    range
        Largest acceleration of either sign, m/s²; beyond it samples are clipped. None: without bound.
    bits
        Resolution of the converter, in bits over twice the range; None: without steps.
    cutoff, order
        Cutoff frequency, Hz, and order of the Butterworth filter before the converter. None: no filter.
    offset, drift
        Offset that is added, m/s², and its growth, m/s² per s.
    """

    quantity: ClassVar[Quantity] = DECK
    kind: Literal["deck acceleration"] = DECK
    noise: NoiseDensity = 0.0
    range: PositiveAcceleration | None = None
    bits: int | None = Field(default=None, ge=4, le=32)
    cutoff: Frequency | None = None
    order: int = Field(default=8, ge=1, le=12)
    offset: SignedAcceleration = 0.0
    drift: float = 0.0

    @model_validator(mode="after")
    def _check_cutoff(self) -> DeckAcceleration:
        if self.cutoff is not None and not self.cutoff < 0.5 * OVERSAMPLED * self.rate:
            allowed = f"less than {0.5 * OVERSAMPLED * self.rate:g} Hz, {OVERSAMPLED // 2} times its rate"
            raise InputError("", "cutoff", f"{self.cutoff:g} Hz", allowed)
        return self

    def filtered(self, samples: FloatArray, finer: int = 1) -> FloatArray:
        """Return samples behind the filter, at the sensor's rate; before the first sample all is at rest.

        Parameters
        ----------
        samples
            At the sensor's rate, or `finer` (OVERSAMPLED) times that.
        finer
            1 or OVERSAMPLED.
        """
        if self.cutoff is None:
            return samples[::finer]
        from scipy.signal import butter, sosfilt

        whole = samples if finer == OVERSAMPLED else _interpolated_samples(samples)
        sections = butter(self.order, self.cutoff, fs=self.rate * OVERSAMPLED, output="sos")
        return np.asarray(sosfilt(sections, whole - whole[0]) + whole[0])[::OVERSAMPLED]

    def drifted(self, samples: FloatArray, times: FloatArray) -> FloatArray:
        """Return samples with the offset and its drift."""
        return np.asarray(samples + self.offset + self.drift * times)

    @property
    def step(self) -> float:
        """Step of the converter, m/s²; 0 without steps."""
        return 0.0 if self.range is None or self.bits is None else float(2.0 * self.range / 2**self.bits)

    @property
    def linear(self) -> DeckAcceleration:
        """The same sensor without offset, drift and converter."""
        return self.model_copy(update={"offset": 0.0, "drift": 0.0, "range": None, "bits": None})

    def spread(self, rate: float) -> float:
        """Return the standard deviation of a sample at a rate, m/s², from the noise and the steps together."""
        return float(np.hypot(self.noise * np.sqrt(0.5 * rate), self.step / np.sqrt(12.0)))

    def converted(self, samples: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return the samples after the converter, and which of them are clipped."""
        if self.range is None:
            return samples, np.zeros(len(samples), dtype=bool)
        clipped = np.abs(samples) >= self.range
        samples = np.clip(samples, -self.range, self.range)
        if self.step:
            samples = np.round(samples / self.step) * self.step
        return samples, clipped

    def samples(self, seen: Seen) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return the samples that it would record of a run, m/s², and which of them are clipped."""
        noise = self.noise * np.sqrt(0.5 * self.rate) * seen.white_noise(len(seen.times))
        return self.recorded(seen.deck_acceleration, seen.times, noise)

    def recorded(
        self, acceleration: Callable[[FloatArray], FloatArray], times: FloatArray, noise: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:  # fmt: skip
        """Return the samples that it would record of an acceleration at `times`, from 0 on, and which are clipped.

        `acceleration` gives m/s² at any times; `noise` is added behind the filter.
        """
        if self.cutoff is None:
            samples = acceleration(times)
        else:
            finer = np.arange((len(times) - 1) * OVERSAMPLED + 1) / (self.rate * OVERSAMPLED)
            samples = self.filtered(acceleration(finer), OVERSAMPLED)
        return self.converted(self.drifted(samples + noise, times))


def _interpolated_samples(samples: FloatArray) -> FloatArray:
    """Return the samples at OVERSAMPLED times the rate, by Lagrange interpolation between the nearest ones."""
    if len(samples) < AROUND:
        return np.repeat(samples, OVERSAMPLED)
    nodes = np.arange(1 - AROUND, AROUND + 1)
    places = np.arange(OVERSAMPLED) / OVERSAMPLED
    weights = np.ones((OVERSAMPLED, len(nodes)))
    for i, node in enumerate(nodes):
        for other in nodes[nodes != node]:
            weights[:, i] *= (places - other) / (node - other)
    ahead = samples[-1] + np.arange(1, AROUND + 1) * (samples[-1] - samples[-2])
    padded = np.concatenate([np.full(AROUND - 1, samples[0]), samples, ahead])
    near = np.lib.stride_tricks.sliding_window_view(padded, len(nodes))[: len(samples)]
    return np.asarray((near @ weights.T).ravel())
