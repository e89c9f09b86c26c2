"""Model of a sensor: its filter, its offset and drift, its converter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensor import Sensor

FloatArray = NDArray[np.float64]

OVERSAMPLED = 8
"""The sensor's filter is computed at this multiple of the sample rate, where it is close to the analogue filter that it
stands for."""
AROUND = 3
"""Number of samples on either side from which a value between two samples is interpolated, by a polynomial of degree
five."""


def filtered(samples: FloatArray, sensor: Sensor, finer: int = 1) -> FloatArray:
    """Return samples behind a sensor's filter, at the sensor's rate; before the first sample all is at rest.

    Parameters
    ----------
    samples
        At the sensor's rate, or `finer` (OVERSAMPLED) times that.
    """
    if sensor.cutoff is None:
        return samples[::finer]
    from scipy.signal import butter, sosfilt

    whole = samples if finer == OVERSAMPLED else _interpolated_samples(samples)
    sections = butter(sensor.order, sensor.cutoff, fs=sensor.rate * OVERSAMPLED, output="sos")
    return np.asarray(sosfilt(sections, whole - whole[0]) + whole[0])[::OVERSAMPLED]


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


def drifted(samples: FloatArray, times: FloatArray, sensor: Sensor) -> FloatArray:
    """Return samples with the sensor's offset and drift."""
    return np.asarray(samples + sensor.offset + sensor.drift * times)


def converted(samples: FloatArray, sensor: Sensor) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the samples after the converter, and which of them are clipped."""
    if sensor.range is None:
        return samples, np.zeros(len(samples), dtype=bool)
    clipped = np.abs(samples) >= sensor.range
    samples = np.clip(samples, -sensor.range, sensor.range)
    if sensor.bits is not None:
        step = 2.0 * sensor.range / 2**sensor.bits
        samples = np.round(samples / step) * step
    return samples, clipped
