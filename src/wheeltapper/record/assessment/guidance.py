"""Guiding forces of a wagon's wheels, and their statistics by the rules for accepting running behaviour (EN 14363).

Y is the lateral force of a wheel on its rail, outwards; Q the vertical one, downwards; both of tread and flange, of
normal and creep forces together. EN 14363 and UIC 518 low-pass them at 20 Hz or more, average Y/Q and ΣY over 2 m of
way every 0.5 m, and take the 0.15 and 99.85 % percentiles of what results. That is read from GENSYS's table of UIC 518
and the draft of EN 14363 (gensys.se/course/UIC518_tests.html, without an edition); the standards themselves could not
be consulted. T-gamma is the energy that creepage dissipates over a metre of way. The term of spin is often left out of
it (gensys.se, "Wheel/rail wear calculations", shows both); here it is in, and its share is given.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.ground.outcome import Outcome
from wheeltapper.record.assessment.filtering import (
    checked_filter,
    checked_rate,
    low_passed,
    note_of_ends,
    readings,
    sliding_mean,
    usual_rate,
)

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.record.record import Record

__all__ = ["PERCENTILES", "RESULTS", "guidance", "statistics"]

FloatArray = NDArray[np.float64]

CUTOFF, WINDOW = 20.0, 2.0
"""Low-pass of the forces, Hz, and length of the sliding mean, m (EN 14363, UIC 518)."""
PERCENTILES = (0.15, 50.0, 99.85)
"""F1, F0 and F2, %: the middle one of quasi-static values, the others of extreme ones (EN 14363, UIC 518)."""
OUTWARDS = np.array([1.0, -1.0])
"""What makes a force leftwards on the left and on the right rail one outwards."""

RESULTS = {
    "guiding_force": ("N", "Y: lateral force of the wheel on its rail, outwards, low-passed"),
    "wheel_force": ("N", "Q: vertical force of the wheel on its rail, low-passed"),
    "unloading": ("", "ΔQ/Q0: what Q lacks of the static force, over that force"),
    "derailment_quotient": ("", "Y/Q of the low-passed forces, sliding mean; infinite where Q is not above zero"),
    "sum_of_guiding_forces": ("N", "ΣY: lateral force of a wheelset on the track, leftwards, low-passed, sliding mean"),
    "t_gamma": ("N", "T-gamma: creep forces and spin moment times creepages, sliding mean"),
    "spin_t_gamma": ("N", "share of the spin moment in T-gamma, of tread and flange, sliding mean"),
}  # fmt: skip
"""What `guidance` returns: unit and meaning of each."""


def guidance(
    record: Record, *, cutoff: float | str | None = CUTOFF, order: int = 4, window: float | str = WINDOW,
    settling: float | str = 0.0, rate: float | str | None = None,
) -> xr.Dataset:  # fmt: skip
    """Return guiding forces, their quotients and T-gamma of a wagon's wheels over time; see `Record.guidance`."""
    from wheeltapper.ground.warned import warn_of

    found, notes = guidance_with_notes(record, cutoff, order, window, settling, rate)
    warn_of(notes)
    return found


def guidance_with_notes(
    record: Record, cutoff: float | str | None, order: int, window: float | str, settling: float | str = 0.0,
    rate: float | str | None = None,
) -> tuple[xr.Dataset, list[Note]]:  # fmt: skip
    """Return what `guidance` does, and what is to be said of it, which is also the attribute `note`."""
    import xarray as xr

    from wheeltapper.march import run

    scenario = record.scenario
    run.choose(run.GUIDANCE, scenario.needs)
    cutoff, order = (None, order) if cutoff is None else checked_filter(cutoff, order)
    window = as_quantity(window, "window", "length", positive=False)
    settling = as_quantity(settling, "settling", "time", positive=False)
    rate = usual_rate(cutoff or CUTOFF) if rate is None else checked_rate(rate, cutoff or 0.0)
    speed = float(scenario.speed)
    if not settling < record.end:
        raise InputError("", "settling", f"{settling:g} s", f"less than the run's {record.end:g} s")
    way = speed * (record.end - settling)
    if window and not window < way:
        wide = f"{window:g} m, in {way:.4g} m of way after settling"
        raise InputError("", "window", wide, "less than that way, or 0 for no mean")
    history = record.history(rate)
    begin, half = int(np.ceil(settling * rate)), round(0.5 * window * rate / speed) if window else 0

    def mean(samples: FloatArray) -> FloatArray:
        out = np.full(samples.shape, np.nan)
        out[half : len(out) - half] = sliding_mean(samples, 2 * half + 1)
        return out

    forces, notes = np.stack([-history.lateral_force.values, history.vertical_force.values]), list[Note]()
    if cutoff is not None:
        forces, note = _read(forces, rate, cutoff, order, begin, isinstance(scenario.start, str))
        notes.append(note)
    if record.outcome is not Outcome.COMPLETED:
        notes.append(Note(f"{record.outcome.sentence}: computed up to {record.end:g} s", doubtful=True))
    leftwards, pressing = forces[:, begin:]
    outwards, lifted = OUTWARDS * leftwards, pressing <= 0.0
    quotient = mean(np.where(lifted, 0.0, outwards) / np.where(lifted, 1.0, pressing))
    quotient[mean(np.where(np.isnan(pressing), np.nan, lifted)) > 0.0] = np.inf
    if np.isfinite(pressing).any() and np.isnan(quotient).all():
        short = f"what is read of the run is shorter than the mean over {window:g} m: Y/Q and ΣY are NaN"
        notes.append(Note(f"{short}; lengthen it, or shorten `window`", doubtful=True))
    flange = history.flange_t_gamma.values[begin:]
    tread = history.t_gamma.values[begin:] - flange
    wheels = ("time", "wheelset", "side")
    held: dict[str, tuple[tuple[str, ...], FloatArray]] = {
        "guiding_force": (wheels, outwards),
        "wheel_force": (wheels, pressing),
        "unloading": (wheels, 1.0 - pressing / record.static_forces.values),
        "derailment_quotient": (wheels, quotient),
        "sum_of_guiding_forces": (wheels[:2], mean(leftwards.sum(axis=-1))),
        "t_gamma": (("time", "surface", *wheels[1:]), mean(np.stack([tread, flange], axis=1))),
        "spin_t_gamma": (wheels, mean(history.spin_t_gamma.values[begin:])),
    }
    labels = {name: {"units": unit, "long_name": meaning} for name, (unit, meaning) in RESULTS.items()}
    found = xr.Dataset(
        {name: (*held[name], labels[name]) for name in RESULTS},
        {
            "time": history.time[begin:], "surface": ["tread", "flange"], "wheelset": history.wheelset,
            "side": history.side,
        },
        {"cutoff": cutoff or np.inf, "order": order, "window": window, "settling": settling, "rate": rate,
         "note": "; ".join(notes)},
    )  # fmt: skip
    return found, notes


def _read(
    forces: FloatArray, rate: float, cutoff: float, order: int, begin: int, at_rest: bool
) -> tuple[FloatArray, Note]:
    """Return the readings of forces, (lateral and vertical, time, ...), and what is not read of them."""
    over_time = np.moveaxis(forces, 0, -1)
    filtered = low_passed(over_time, rate, cutoff, order, at_rest=at_rest)
    read = readings(filtered, rate, cutoff, order, at_rest=at_rest)
    all_of, known = (np.concatenate([one, -one], axis=-1)[begin:] for one in (filtered, read))  # the least count, too
    return np.moveaxis(read, -1, 0), note_of_ends(all_of, known, cutoff, order, at_rest=at_rest)


def statistics(found: xr.Dataset) -> xr.Dataset:
    """Return extremes, percentiles and mean over time of what `guidance` returns.

    Over "statistic": "least", "0.15 %", "50 %", "99.85 %", "largest" and "mean". A percentile is a value that occurs
    (the inverse of the empirical distribution).
    """
    import xarray as xr

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)  # of runs that are all end
        parts = [
            found.min("time"),
            *(found.quantile(p / 100.0, "time", method="inverted_cdf").drop_vars("quantile") for p in PERCENTILES),
            found.max("time"),
            found.mean("time"),
        ]
    names = ["least", *(f"{p:g} %" for p in PERCENTILES), "largest", "mean"]
    table = xr.concat(parts, xr.Variable("statistic", names), combine_attrs="override")
    for name in table.data_vars:
        table[name].attrs.update(found[name].attrs)
    return table.assign_attrs(found.attrs)
