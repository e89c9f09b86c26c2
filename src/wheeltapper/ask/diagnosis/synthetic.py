"""Recordings of passages that are computed: with what the site does not know drawn, through its sensor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.fields import Fields
from wheeltapper.record.recording import Recording
from wheeltapper.record.simulate import simulate

FloatArray = NDArray[np.float64]

OVERSAMPLED = 8
"""Times as many samples are filtered where the sensor has a filter before its converter."""


def synthesise(
    site: Site, count: int = 1, *, changes: Mapping[str, float] | None = None, label: str = "healthy", seed: int = 0,
    vary: bool = True, noise: float | None = None,
) -> list[Recording]:  # fmt: skip
    """Compute recordings of passages over a site.

    Parameters
    ----------
    site
        The deck, its sensor, and how well all of it is known.
    count
        How many passages.
    changes
        By path, values that differ from the site's passage: a fault. What is uncertain is drawn about them.
    label
        Said in the recordings' `truth`.
    seed
        Of everything drawn. Recording n is the same however many there are.
    vary
        Whether what the site is uncertain of is drawn; otherwise it is as stated.
    noise
        Standard deviation of the samples' noise, m/s²; by default the sensor's.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError("", "count", repr(count), "a number of passages, at least 1")
    stated = site.passage.replaced(dict(changes or {}))
    return [_passage(site, stated, label, np.random.default_rng([seed, n]), vary, noise) for n in range(count)]


def _passage(
    site: Site, stated: Scenario, label: str, random: np.random.Generator, vary: bool, noise: float | None
) -> Recording:
    drawn = {}
    for path, share in site.uncertainty.items():
        value = float(Fields(stated)(path))
        drawn[path] = value * (1.0 + share * random.standard_normal()) if vary else value
    scenario = stated.replaced(drawn) if drawn else stated
    record = simulate(scenario)
    sensor = site.sensor
    count = int(np.floor(record.end * sensor.rate * (1.0 + 1e-12))) + 1
    times = np.arange(count) / sensor.rate
    if sensor.cutoff is None:
        samples = record.at(times).deck_acceleration.values
    else:
        finer = np.arange((count - 1) * OVERSAMPLED + 1) / (sensor.rate * OVERSAMPLED)
        samples = filtered(record.at(np.minimum(finer, record.end)).deck_acceleration.values, sensor, OVERSAMPLED)
        samples = samples[::OVERSAMPLED]
    spread = sensor.noise * np.sqrt(0.5 * sensor.rate) if noise is None else noise
    samples = samples + spread * random.standard_normal(count) + sensor.offset + sensor.drift * times
    samples, clipped = converted(samples, sensor)
    truth = {"label": label, "scenario": scenario, **drawn}
    return Recording(samples, float(sensor.rate), clipped=clipped, source=f"synthetic: {label}", truth=truth)


def filtered(samples: FloatArray, sensor: Sensor, finer: int = 1) -> FloatArray:
    """Return samples, so many times finer than the sensor's, behind its filter, at rest before the first."""
    if sensor.cutoff is None:
        return samples
    from scipy.signal import butter, sosfilt

    sections = butter(sensor.order, sensor.cutoff, fs=sensor.rate * finer, output="sos")
    return np.asarray(sosfilt(sections, samples - samples[0]) + samples[0])


def converted(samples: FloatArray, sensor: Sensor) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return what the converter makes of samples, and which of them it clips."""
    if sensor.range is None:
        return samples, np.zeros(len(samples), dtype=bool)
    clipped = np.abs(samples) >= sensor.range
    samples = np.clip(samples, -sensor.range, sensor.range)
    if sensor.bits is not None:
        step = 2.0 * sensor.range / 2**sensor.bits
        samples = np.round(samples / step) * step
    return samples, clipped
