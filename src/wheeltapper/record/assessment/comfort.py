"""Ride comfort: the comfort numbers of a car body's accelerations (ISO 2631-1, EN 12299)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.ground.arguments import as_quantity, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.record.arrays import as_array
from wheeltapper.record.assessment.weighting import WEIGHTINGS, as_rate, weighted, weighting

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.record.record import Record

__all__ = ["AXES", "RESULTS", "WEIGHTINGS", "comfort", "ride_comfort", "running_rms", "weighted", "weighting"]

FloatArray = NDArray[np.float64]

AXES = ("longitudinal", "lateral", "vertical")
BLOCK, PERCENTILE, FACTOR = 5.0, 95.0, 6.0
"""Length of a block, s, percentile over the blocks, and the factor of the mean comfort N_MV (EN 12299:2009, 6.6.2,
6.6.3, 6.7.2)."""
STANDARD_BLOCKS = 60
"""Number of blocks that the standard method takes, five minutes (EN 12299:2009). With fewer a note says so."""
TRANSIENT = 1.0
"""Integration time of the running r.m.s. whose maximum is the MTVV, s: ISO 2631-1:1997, 6.3.1."""
AXIS_FACTORS = (1.0, 1.0, 1.0)
"""Factors k_x, k_y, k_z for the comfort of a seated person, on the seat (ISO 2631-1:1997, 8.2.2)."""

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

VERTICAL_FOR_RAIL = ("Wb", "Wb EN 12299:2009")
"""Weightings that may be chosen for the vertical axis of the mean comfort."""


def running_rms(weighted: ArrayLike, rate: float | str, seconds: float | str) -> FloatArray:
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
    length = _window_samples(
        as_quantity(rate, "rate", "frequency"), as_quantity(seconds, "seconds", "time", positive=False)
    )
    allowed = "an array of finite samples, time last"
    with np.errstate(over="ignore"):
        squares = np.atleast_1d(as_array(weighted, "weighted", allowed)) ** 2
    if not np.isfinite(squares).all():
        raise InputError("", "weighted", "samples whose squares are not finite", allowed)
    total = np.cumsum(np.concatenate([np.zeros_like(squares[..., :1]), squares], axis=-1), axis=-1)
    # Differences of a long sum contain its rounding errors: in the silence after a shock they may be negative.
    return np.asarray(np.sqrt(np.maximum(total[..., length:] - total[..., :-length], 0.0) / length))


def ride_comfort(
    longitudinal: ArrayLike,
    lateral: ArrayLike,
    vertical: ArrayLike,
    rate: float | str,
    *,
    vertical_weighting: str = "Wb",
    settling: float | str = 0.0,
) -> dict[str, Any]:
    """Return comfort numbers of accelerations along a car body's axes.

    Sources: ISO 2631-1:1997, 6.1 Equation (1), 6.3.1 Equations (2) and (4), 6.3.2 Equation (5), 6.5 Equation (10) and
    8.2; EN 12299:2009, 6.6 and 6.7. EN 12299 measures on the floor, ISO 2631-1 where the vibration enters the person.

    Parameters
    ----------
    longitudinal, lateral, vertical
        (samples,) accelerations, m/s^2, uniformly sampled, without gravity.
    rate
        Samples per second, 250 to 1e6, Hz or as "1 kHz".
    vertical_weighting
        Weighting of the vertical axis in the numbers of EN 12299: "Wb" or "Wb EN 12299:2009"; see `weighting`.
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
        without a whole block, and with fewer than 60 blocks they are not yet those of the standard.

    Raises
    ------
    InputError
        For a rate out of this range, samples that are not finite or not equally many, no sample left after settling, or
        another vertical weighting.
    """
    check_choice(vertical_weighting, "vertical_weighting", VERTICAL_FOR_RAIL)
    samples = _three_axes(longitudinal, lateral, vertical)
    settling = as_quantity(settling, "settling", "time", positive=False)
    return _assessed(samples, as_rate(rate), vertical_weighting, settling)[0]


def _assessed(
    samples: FloatArray, rate: float, vertical_weighting: str, settling: float
) -> tuple[dict[str, Any], FloatArray, FloatArray]:
    """Return the numbers of `ride_comfort`, the accelerations weighted for rail, and the running r.m.s., (3, …)."""
    duration = samples.shape[-1] / rate
    if not settling < duration:
        raise InputError("", "settling", f"{settling:g} s", f"0 to less than the record's {duration:g} s")
    begin, flat = int(settling * rate), weighted(samples[:2], rate, "Wd")
    iso, rail = (
        np.concatenate([flat, weighted(samples[2:], rate, name)])[:, begin:] for name in ("Wk", vertical_weighting)
    )
    rms = _root_mean_square(iso)
    transients = running_rms(iso, rate, TRANSIENT)
    numbers = {
        "weighted_rms": rms,
        "weighted_rms_rail": _root_mean_square(rail),
        "vibration_total_value": float(np.linalg.norm(np.array(AXIS_FACTORS) * rms)),
        "maximum_transient_vibration": transients.max(axis=-1) if transients.size else np.full(3, np.nan),
        "vibration_dose": ((iso**4).sum(axis=-1) / rate) ** 0.25,
        **_mean_comfort(rail, rate),
    }
    return numbers, rail, transients


def _mean_comfort(rail: FloatArray, rate: float) -> dict[str, Any]:
    """Return the numbers of EN 12299 from weighted accelerations (3, samples)."""
    length = _window_samples(rate, BLOCK)
    count = rail.shape[-1] // length
    blocks = _root_mean_square(rail[:, : count * length].reshape(3, count, length))
    high = np.percentile(blocks, PERCENTILE, axis=-1) if count else np.full(3, np.nan)
    mean = float(FACTOR * np.linalg.norm(high))
    return {"blocks": count, "continuous_comfort": blocks, "percentile_95": high, "mean_comfort": mean}


def _root_mean_square(samples: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(samples**2, axis=-1)))


def _window_samples(rate: float, seconds: float) -> int:
    if not 0.5 < rate * seconds < np.inf:
        raise InputError("", "seconds", f"{seconds!r} s at {rate!r} samples per second", "at least one sample")
    return round(rate * seconds)


def _three_axes(*axes: ArrayLike) -> FloatArray:
    allowed = "one row of samples, equally many along each axis"
    held = [as_array(axis, name, allowed, "acceleration") for name, axis in zip(AXES, axes, strict=True)]
    for name, samples in zip(AXES, held, strict=True):
        if samples.ndim != 1 or samples.shape != held[0].shape or samples.size == 0:
            raise InputError("", name, f"shape {samples.shape}", allowed)
    return np.array(held)


def comfort(
    record: Record,
    body: str = "car body",
    at: Sequence[float | str] | None = None,
    rate: float | str = 1000.0,
    *,
    vertical_weighting: str = "Wb",
    settling: float | str = 0.0,
) -> xr.Dataset:
    """Return the comfort numbers at a point of a body in the record of a wagon.

    The samples come from the record's dense solution, without an anti-aliasing filter. Accelerations are relative to
    the frame of the track. A sensor that tilts with the body would also measure a part of gravity, which is not
    included.

    Parameters
    ----------
    record
        Record of a wagon.
    body
        Name of the body.
    at
        (x, y, z) of the point from the body's centre of gravity, m: forward, left, up; None is the centre itself. The
        acceleration there is a + alpha × r, for small rotations of the body.
    rate
        Samples per second, 250 to 1e6, Hz or as "1 kHz".
    vertical_weighting, settling
        As for `ride_comfort`.

    Returns
    -------
    xarray.Dataset
        The numbers of `ride_comfort` over "axis" and "block" (its end, s), each with `units` and `long_name`. Also over
        "time", m/s^2: `weighted_acceleration` by Wd, Wd and the vertical weighting for rail, and `running_rms`, over
        the 1 s that ends there, by Wd, Wd, Wk (ISO 2631-1). The attribute `note` names the numbers for which the record
        is too short.

    Raises
    ------
    InputError
        For an unknown body, a record without bodies, a point that is not three numbers, and as `ride_comfort`.
    """
    import xarray as xr

    rate, settling = as_rate(rate), as_quantity(settling, "settling", "time", positive=False)
    check_choice(vertical_weighting, "vertical_weighting", VERTICAL_FOR_RAIL)
    allowed = "three numbers in m (x, y, z), or None"
    offset = np.zeros(3) if at is None else as_array(at, "at", allowed, "length")
    if offset.shape != (3,) or not np.isfinite(offset).all():
        raise InputError("", "at", value_text(at), allowed)
    if not hasattr(record, "history"):
        raise InputError("", "record", value_text(record), "the record of a wagon")
    samples = _three_axes(*_point_acceleration(record.history(rate), body, offset))
    found, rail, transients = _assessed(samples, rate, vertical_weighting, settling)
    counted = rail.shape[1]
    running = np.full(rail.shape, np.nan)
    running[:, counted - transients.shape[1] :] = transients
    ends = settling + BLOCK * np.arange(1, found["blocks"] + 1)
    numbers = {name: (("axis", "block")[: np.ndim(found[name])], found[name], _result_labels(name)) for name in RESULTS}
    unit, first = {"units": "m/s^2"}, samples.shape[1] - counted
    return xr.Dataset(
        numbers | {
            "weighted_acceleration": (("axis", "time"), rail, unit | {"long_name": "weighted acceleration for rail"}),
            "running_rms": (("axis", "time"), running, unit | {"long_name": "running r.m.s., 1 s (ISO 2631-1:1997)"}),
        },
        coords={
            "time": ("time", np.arange(first, first + counted) / rate, {"units": "s", "long_name": "time"}),
            "axis": ("axis", list(AXES), {"units": "", "long_name": "axis of the body"}),
            "block": ("block", ends, {"units": "s", "long_name": "end of the block"}),
        },
        attrs={
            "body": body, "at": offset, "rate": rate, "settling": settling, "vertical_weighting": vertical_weighting,
            "vertical_weighting_source": WEIGHTINGS[vertical_weighting].source,
            "note": _too_short(found["blocks"], samples.shape[1] / rate - settling),
        },
    )  # fmt: skip


def _too_short(blocks: int, seconds: float) -> str:
    """Return the numbers for which the counted seconds are too short; "" if there are none."""
    said = []
    if seconds < TRANSIENT:
        said.append(f"maximum_transient_vibration needs {TRANSIENT:g} s")
    if not blocks:
        said.append(f"mean_comfort and percentile_95 need a block of {BLOCK:g} s")
    elif blocks < STANDARD_BLOCKS:
        said.append(f"mean_comfort by the standard takes {STANDARD_BLOCKS * BLOCK:g} s")
    return f"{'; '.join(said)}; counted here: {seconds:.4g} s" if said else ""


def _result_labels(name: str) -> dict[str, str]:
    return dict(zip(("units", "long_name"), RESULTS[name], strict=True))


def _point_acceleration(history: xr.Dataset, body: str, offset: FloatArray) -> FloatArray:
    """Return (3, samples) the acceleration at an offset from a body's centre of gravity, m/s^2."""
    if "body" not in history.coords:
        raise InputError("", "record", "a record without bodies", "the record of a wagon")
    check_choice(body, "body", history.body.values.tolist())
    motions = history.acceleration.sel(body=body)
    centre = motions.sel(motion=["x", "y", "z"]).transpose("time", "motion").values
    turning = motions.sel(motion=["roll", "pitch", "yaw"]).transpose("time", "motion").values
    return np.asarray((centre + np.cross(turning, offset)).T)
