"""Ride comfort: frequency weightings of whole-body vibration, and the comfort numbers of a car body's accelerations.

A weighting is a band limit, a transition from acceleration to velocity, and an upward step; ISO 8041-1:2017 writes all
three with corner frequencies f1 to f6 and quality factors Q1 to Q6. Its digital twin here has the analogue poles and
zeros where sampling puts them, and a short correction that restores modulus and phase up to a quarter of the rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.record.record import Record

__all__ = ["AXES", "RESULTS", "WEIGHTINGS", "comfort", "ride_comfort", "running_rms", "weighted", "weighting"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AXES = ("longitudinal", "lateral", "vertical")
SLOWEST = 250.0
"""Lowest admissible rate, samples per second: below, the band limit at 100 Hz is beyond 0.4 of the rate."""
BAND, BUTTERWORTH = (0.4, 100.0), 0.5**0.5
"""Corner frequencies f1 and f2 of the band limit, Hz, and its quality factors Q1 = Q2, in every edition."""
BLOCK, PERCENTILE, FACTOR = 5.0, 95.0, 6.0
"""Seconds of a block, percentile of the blocks, factor of N_MV: EN 12299:2009, 6.6.2, 6.6.3, 6.7.2."""
TRANSIENT = 1.0
"""Integration time of the running r.m.s. whose maximum is the MTVV, s: ISO 2631-1:1997, 6.3.1."""
AXIS_FACTORS = (1.0, 1.0, 1.0)
"""k_x, k_y, k_z for the comfort of a seated person on the seat: ISO 2631-1:1997, 8.2.2."""

RESULTS = {
    "weighted_rms": ("m/s^2", "r.m.s. acceleration weighted by Wd, Wd, Wk (ISO 2631-1:1997)"),
    "weighted_rms_rail": ("m/s^2", "r.m.s. acceleration weighted by Wd, Wd and the vertical weighting for rail"),
    "vibration_total_value": ("m/s^2", "vibration total value a_v, k = 1 (ISO 2631-1:1997)"),
    "maximum_transient_vibration": ("m/s^2", "maximum transient vibration value MTVV, 1 s (ISO 2631-1:1997)"),
    "vibration_dose": ("m/s^1.75", "vibration dose value VDV (ISO 2631-1:1997)"),
    "blocks": ("", "number of whole 5 s blocks; the standard method of EN 12299:2009 has 60"),
    "continuous_comfort": ("m/s^2", "continuous comfort C_C, weighted r.m.s. of 5 s blocks (EN 12299:2009)"),
    "percentile_95": ("m/s^2", "95th percentile of the blocks' weighted r.m.s. (EN 12299:2009)"),
    "mean_comfort": ("", "mean comfort N_MV, standard method (EN 12299:2009)"),
}
"""What `ride_comfort` returns: unit and meaning of each."""


class Weighting(NamedTuple):
    """A weighting's f3, f4 (Hz), Q4; its step's f5, Q5, f6, Q6 or None; K, beside (f5/f6)^2; where they stand."""

    transition: tuple[float, float, float]
    step: tuple[float, float, float, float] | None
    gain: float
    source: str


# EN 12299 and BS 6841 number the quality factors otherwise (Q2, Q3, Q4 are Q4, Q5, Q6 here) and write the step without
# (f5/f6)^2 but with K = 0.4, which is 1.024 (2.5/4)^2.
WEIGHTINGS = {
    "Wk": Weighting((12.5, 12.5, 0.63), (2.37, 0.91, 3.35, 0.91), 1.0, "ISO 2631-1:1997, Table A.1"),
    "Wd": Weighting((2.0, 2.0, 0.63), None, 1.0, "ISO 2631-1:1997, Table A.1"),
    "Wb": Weighting((16.0, 16.0, 0.55), (2.5, 0.9, 4.0, 0.95), 1.024, "ISO 8041-1:2017, Table 3"),
    "Wb EN 12299:2009": Weighting((16.0, 16.0, 0.63), (2.5, 0.8, 4.0, 0.8), 1.024, "programs for EN 12299:2009"),
}
"""By name: "Wk" vertical, "Wd" horizontal, "Wb" vertical for rail, and the form of Wb in programs for EN 12299:2009."""

VERTICAL_FOR_RAIL = ("Wb", "Wb EN 12299:2009")
TAPS, FITTED_UP_TO, FITTED_AT = 6, 0.27, 400  # the correction: length, fraction of the rate, number of frequencies


def weighting(name: str, frequency: ArrayLike) -> ComplexArray:
    """Return the complex response of an analogue frequency weighting; its modulus is the weighting factor.

    Source: ISO 8041-1:2017, Formulae (1) to (5). "Wk" and "Wd" are those of ISO 2631-1:1997, Annex A. "Wb" is that of
    ISO 8041-1:2017, which is ISO 2631-4:2001 and BS 6841:1987 with Q1 unrounded. Public programs for EN 12299:2009 have
    other quality factors, "Wb EN 12299:2009": 13 % more at 16 Hz, 8 % less at 4 Hz. The standard itself, and its
    edition of 2024, could not be consulted.

    Parameters
    ----------
    name
        "Wk", "Wd", "Wb" or "Wb EN 12299:2009".
    frequency
        Hz, of any shape.

    Returns
    -------
    numpy.ndarray
        Complex, of the shape of `frequency`; no unit.

    Raises
    ------
    InputError
        For an unknown name.
    """
    held = _named(name)
    p = np.asarray(1j * np.asarray(frequency), dtype=np.complex128)
    (f1, f2), (f3, f4, q4) = BAND, held.transition
    band = (p / f1) ** 2 / _quadratic(p, f1, BUTTERWORTH) / _quadratic(p, f2, BUTTERWORTH)
    out = held.gain * band * (1.0 + p / f3) / _quadratic(p, f4, q4)
    if held.step is None:
        return out
    f5, q5, f6, q6 = held.step
    return out * _quadratic(p, f5, q5) / _quadratic(p, f6, q6) * (f5 / f6) ** 2


def weighted(acceleration: ArrayLike, rate: float, name: str) -> FloatArray:
    """Return weighted accelerations: what a causal filter makes of the samples, starting from rest.

    Before the first sample there is nothing: an acceleration that does not begin at zero is a jump to the filter, and
    the band limit at 0.4 Hz takes some 2 s to forget it. Gravity should not be among the samples.

    Parameters
    ----------
    acceleration
        m/s^2, time along the last axis, uniformly sampled and free of content above half the rate.
    rate
        Samples per second, at least 250. Up to a quarter of it the response is right to 0.2 % and 0.002 rad.
    name
        Of the weighting, as for `weighting`.

    Returns
    -------
    numpy.ndarray
        m/s^2, of the shape of `acceleration`.

    Raises
    ------
    InputError
        For a rate below 250, an unknown name, or samples that are not finite.
    """
    from scipy import signal

    samples = np.asarray(acceleration, dtype=np.float64)
    if samples.ndim == 0 or not np.isfinite(samples).all():
        raise InputError("", "acceleration", "no finite samples over time", "an array of finite samples, time last")
    sections, correction = _digital(name, _checked_rate(rate))
    if samples.size == 0:
        return samples.copy()
    return np.asarray(signal.lfilter(correction, [1.0], signal.sosfilt(sections, samples)), dtype=np.float64)


@cache
def _digital(name: str, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return the second-order sections and the correction's coefficients of a weighting at a rate.

    Poles and zeros s go to exp(s/rate), so the two zeros at s = 0 stay exact. What is then missing is smooth up to half
    the rate, and a few coefficients, fitted by least squares of the relative error, make it up.
    """
    from scipy import signal

    zeros, poles = _roots(_named(name))
    sections = signal.zpk2sos(np.exp(zeros / rate), np.exp(poles / rate), 1.0)
    frequency = rate * np.linspace(1e-3, FITTED_UP_TO, FITTED_AT)
    response = signal.freqz_sos(sections, worN=frequency, fs=rate)[1]
    delays = np.exp(-2j * np.pi * np.outer(frequency / rate, np.arange(TAPS)))
    relative = delays * (response / weighting(name, frequency))[:, None]
    system, wanted = np.concatenate([relative.real, relative.imag]), np.repeat([1.0, 0.0], FITTED_AT)
    return np.asarray(sections), np.asarray(np.linalg.lstsq(system, wanted, rcond=None)[0])


def _roots(held: Weighting) -> tuple[ComplexArray, ComplexArray]:
    """Return the analogue zeros and poles, rad/s."""
    (f1, f2), (f3, f4, q4) = BAND, held.transition
    zeros = [0j, 0j, complex(-2.0 * np.pi * f3)]
    poles = [*_pair(f1, BUTTERWORTH), *_pair(f2, BUTTERWORTH), *_pair(f4, q4)]
    if held.step is not None:
        zeros += _pair(*held.step[:2])
        poles += _pair(*held.step[2:])
    return np.array(zeros), np.array(poles)


def _pair(corner: float, quality: float) -> list[complex]:
    """Return the two roots, rad/s, of a quadratic with a corner frequency (Hz) and a quality factor above 1/2."""
    damping = 0.5 / quality
    root = 2.0 * np.pi * corner * complex(-damping, np.sqrt(1.0 - damping**2))
    return [root, root.conjugate()]


def _quadratic(p: ComplexArray, corner: float, quality: float) -> ComplexArray:
    return np.asarray(1.0 + p / (quality * corner) + (p / corner) ** 2)


def _named(name: str) -> Weighting:
    if name not in WEIGHTINGS:
        raise InputError("", "weighting", repr(name), " | ".join(WEIGHTINGS))
    return WEIGHTINGS[name]


def _checked_rate(rate: float) -> float:
    if not SLOWEST <= rate < np.inf:
        raise InputError("", "rate", f"{rate!r} samples per second", f"at least {SLOWEST:g}, for a band up to 100 Hz")
    return float(rate)


def running_rms(weighted: ArrayLike, rate: float, seconds: float) -> FloatArray:
    """Return the r.m.s. over every window of some length within the samples (ISO 2631-1:1997, 6.3.1, Equation (2)).

    Parameters
    ----------
    weighted
        Samples, time along the last axis.
    rate
        Samples per second.
    seconds
        Length of the window; rounded to whole samples.

    Returns
    -------
    numpy.ndarray
        In the samples' unit, one value for each position of the window; empty along time for a shorter record.

    Raises
    ------
    InputError
        For a window of less than one sample.
    """
    squares = np.asarray(weighted, dtype=np.float64) ** 2
    length = _window(rate, seconds)
    total = np.cumsum(np.concatenate([np.zeros_like(squares[..., :1]), squares], axis=-1), axis=-1)
    # Differences of a long sum keep its rounding errors: in the silence after a shock they may be below zero.
    return np.asarray(np.sqrt(np.maximum(total[..., length:] - total[..., :-length], 0.0) / length))


def ride_comfort(
    longitudinal: ArrayLike,
    lateral: ArrayLike,
    vertical: ArrayLike,
    rate: float,
    *,
    vertical_weighting: str = "Wb",
    settling: float = 0.0,
) -> dict[str, Any]:
    """Return comfort numbers of accelerations along a car body's axes.

    Sources: ISO 2631-1:1997, 6.1 Equation (1), 6.3.1 Equations (2) and (4), 6.3.2 Equation (5), 6.5 Equation (10) and
    8.2; EN 12299:2009, 6.6 and 6.7. EN 12299 measures on the floor, ISO 2631-1 where the vibration enters the person.

    Parameters
    ----------
    longitudinal, lateral, vertical
        (samples,) accelerations, m/s^2, uniformly sampled, without gravity.
    rate
        Samples per second, at least 250.
    vertical_weighting
        Of the vertical axis in the numbers of EN 12299: "Wb" or "Wb EN 12299:2009"; see `weighting`.
    settling
        Seconds at the beginning that are filtered but not counted, for records that begin in motion.

    Returns
    -------
    dict
        As in `RESULTS`; arrays of three are in the order of `AXES`. Weighted by Wd, Wd, Wk (ISO 2631-1):
        `weighted_rms`, (3,), m/s^2; `vibration_total_value`, a_v, m/s^2, with k = 1 for seated comfort;
        `maximum_transient_vibration`, MTVV, (3,), m/s^2, NaN for less than 1 s; `vibration_dose`, VDV, (3,), m/s^1.75.
        Weighted by Wd, Wd and the vertical weighting for rail (EN 12299): `weighted_rms_rail`, (3,), m/s^2; `blocks`,
        the number of whole 5 s blocks; `continuous_comfort`, C_Cx, C_Cy, C_Cz, (3, blocks), m/s^2; `percentile_95` over
        all blocks, linear between order statistics, (3,), m/s^2; `mean_comfort`, N_MV, no unit. The last two are NaN
        without a block, and with fewer than 60 not yet the standard's.

    Raises
    ------
    InputError
        For a low rate, samples that are not finite or not equally many, no sample left after settling, or another
        vertical weighting.
    """
    if vertical_weighting not in VERTICAL_FOR_RAIL:
        raise InputError("", "vertical_weighting", repr(vertical_weighting), " | ".join(VERTICAL_FOR_RAIL))
    samples = _three(longitudinal, lateral, vertical)
    duration = samples.shape[-1] / _checked_rate(rate)
    if not 0.0 <= settling < duration:
        raise InputError("", "settling", f"{settling!r} s", f"0 to less than the record's {duration:g} s")
    begin = int(settling * rate)
    flat = weighted(samples[:2], rate, "Wd")
    iso, rail = (
        np.concatenate([flat, weighted(samples[2:], rate, name)])[:, begin:] for name in ("Wk", vertical_weighting)
    )
    rms = _rms(iso)
    transients = running_rms(iso, rate, TRANSIENT)
    return {
        "weighted_rms": rms,
        "weighted_rms_rail": _rms(rail),
        "vibration_total_value": float(np.linalg.norm(np.array(AXIS_FACTORS) * rms)),
        "maximum_transient_vibration": transients.max(axis=-1) if transients.size else np.full(3, np.nan),
        "vibration_dose": ((iso**4).sum(axis=-1) / rate) ** 0.25,
        **_mean_comfort(rail, rate),
    }


def _mean_comfort(rail: FloatArray, rate: float) -> dict[str, Any]:
    """Return the numbers of EN 12299 from weighted accelerations (3, samples)."""
    length = _window(rate, BLOCK)
    count = rail.shape[-1] // length
    blocks = _rms(rail[:, : count * length].reshape(3, count, length))
    high = np.percentile(blocks, PERCENTILE, axis=-1) if count else np.full(3, np.nan)
    mean = float(FACTOR * np.linalg.norm(high))
    return {"blocks": count, "continuous_comfort": blocks, "percentile_95": high, "mean_comfort": mean}


def _rms(samples: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(samples**2, axis=-1)))


def _window(rate: float, seconds: float) -> int:
    if not 0.5 < rate * seconds < np.inf:
        raise InputError("", "seconds", f"{seconds!r} s at {rate!r} samples per second", "at least one sample")
    return round(rate * seconds)


def _three(*axes: ArrayLike) -> FloatArray:
    held = [np.asarray(axis, dtype=np.float64) for axis in axes]
    for name, samples in zip(AXES, held, strict=True):
        if samples.ndim != 1 or samples.shape != held[0].shape or samples.size == 0:
            raise InputError("", name, f"shape {samples.shape}", "one row of samples, equally many along each axis")
    return np.array(held)


def comfort(
    record: Record,
    body: str = "car body",
    at: Sequence[float] | None = None,
    rate: float = 1000.0,
    *,
    vertical_weighting: str = "Wb",
    settling: float = 0.0,
) -> xr.Dataset:
    """Return the comfort numbers at a point of a body in the record of a wagon.

    The samples are those of the record's own solution, without an anti-aliasing filter. Accelerations are relative to
    the track's frame: a sensor that leans with the body would also see a part of gravity, which is not in them.

    Parameters
    ----------
    record
        Of a wagon.
    body
        Name of the body.
    at
        (x, y, z) of the point from the body's centre of gravity, m: forward, left, up; None is the centre itself.
        There the acceleration is a + alpha × r, the body turning little.
    rate
        Samples per second, at least 250.
    vertical_weighting, settling
        As for `ride_comfort`.

    Returns
    -------
    xarray.Dataset
        The numbers of `ride_comfort` over "axis" and "block" (its end, s), each with `units` and `long_name`.

    Raises
    ------
    InputError
        For an unknown body, a record without bodies, a point that is not three numbers, and as `ride_comfort`.
    """
    import xarray as xr

    _checked_rate(rate)
    offset = np.asarray((0.0, 0.0, 0.0) if at is None else at, dtype=np.float64)
    if offset.shape != (3,) or not np.isfinite(offset).all():
        raise InputError("", "at", repr(at), "three numbers in m (x, y, z), or None")
    x, y, z = _point_acceleration(record.history(rate), body, offset)
    found = ride_comfort(x, y, z, rate, vertical_weighting=vertical_weighting, settling=settling)
    ends = settling + BLOCK * np.arange(1, found["blocks"] + 1)
    return xr.Dataset(
        {name: (("axis", "block")[: np.ndim(found[name])], found[name], _labels(name)) for name in RESULTS},
        coords={
            "axis": ("axis", list(AXES), {"units": "", "long_name": "axis of the body"}),
            "block": ("block", ends, {"units": "s", "long_name": "end of the block"}),
        },
        attrs={
            "body": body, "at": offset, "rate": rate, "settling": settling, "vertical_weighting": vertical_weighting,
            "vertical_weighting_source": WEIGHTINGS[vertical_weighting].source,
        },
    )  # fmt: skip


def _labels(name: str) -> dict[str, str]:
    return dict(zip(("units", "long_name"), RESULTS[name], strict=True))


def _point_acceleration(history: xr.Dataset, body: str, offset: FloatArray) -> FloatArray:
    """Return (3, samples) the acceleration at an offset from a body's centre of gravity, m/s^2."""
    if "body" not in history.coords:
        raise InputError("", "record", "a record without bodies", "the record of a wagon")
    bodies = [str(name) for name in history.body.values]
    if body not in bodies:
        raise InputError("", "body", repr(body), " | ".join(bodies))
    motions = history.acceleration.sel(body=body)
    centre = motions.sel(motion=["x", "y", "z"]).transpose("time", "motion").values
    turning = motions.sel(motion=["roll", "pitch", "yaw"]).transpose("time", "motion").values
    return np.asarray((centre + np.cross(turning, offset)).T)
