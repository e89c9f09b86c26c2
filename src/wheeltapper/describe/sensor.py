"""The sensor: between the deck's acceleration and the numbers in a file."""

from __future__ import annotations

from pydantic import Field

from wheeltapper.describe.noun import Frequency, NoiseDensity, Noun, PositiveAcceleration, SignedAcceleration


class Sensor(Noun):
    """An accelerometer on the deck, with its filter and converter.

    Parameters
    ----------
    rate
        Samples per second, Hz.
    noise
        Density of its white noise, m/s²/√Hz. The standard deviation of a sample is this times √(rate/2).
    range
        Largest acceleration of either sign, m/s²; beyond it samples are clipped. None: without bound.
    bits
        Resolution of the converter over twice the range; None: without steps.
    cutoff, order
        Cutoff frequency, Hz, and order of the Butterworth filter before the converter. None: no filter.
    offset, drift
        Offset that is added, m/s², and its growth, m/s² per s.
    """

    rate: Frequency = 20_000.0
    noise: NoiseDensity = 0.0
    range: PositiveAcceleration | None = None
    bits: int | None = Field(default=None, ge=4, le=32)
    cutoff: Frequency | None = None
    order: int = Field(default=8, ge=1, le=12)
    offset: SignedAcceleration = 0.0
    drift: float = 0.0
