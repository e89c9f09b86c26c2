"""Checks of a measured signal: its times, missing values, clipping and size; each finding becomes a note."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.units import SI

FloatArray = NDArray[np.float64]
Place = Callable[[int], str]
"""A function from a row to its place in the file, such as "line 12"."""

FEWEST = 16
"""Smallest number of samples of a recording."""
JITTER = 0.01
"""Largest deviation of a step of time from the usual one, over the usual one. A recording with more is not evenly
sampled."""
DRIFT = 0.5
"""Largest deviation of a time from the constant rate, in steps. A recording with more is refused."""
CONTRADICTION = 1e-3
"""Relative difference from which on two statements of a rate contradict each other."""
RUN = 3
"""Number of equal extreme samples in a row from which on they count as clipped."""
LARGEST, SMALLEST = 1e5, 1e-6
"""Accelerations, m/s². A recording whose largest sample is above the first or below the second probably has another
unit than the stated one."""
COARSEST = 0.25
"""Largest rounding of the times, over a step. Uneven steps that such a rounding explains are accepted."""
LONGEST = 2.0**40
"""Largest number of steps in one gap; a longer gap counts as this many, which is refused anyway."""
MISSING = 1.0
"""Largest number of samples that are missing in gaps, per sample that is there. A file with more is not one
recording."""


@dataclass(frozen=True)
class Grid:
    """Positions of samples on a grid: their numbers, the rate, Hz, the start, s, and notes."""

    numbers: NDArray[np.int64]
    rate: float
    start: float
    notes: tuple[str, ...] = ()


def rates_differ(a: float, b: float) -> bool:
    """Return whether two rates differ by more than 0.1 %."""
    return abs(a - b) > CONTRADICTION * b


def on_grid(values: NDArray[Any], factor: float, stated: float | None, place: Place) -> Grid:
    """Return the grid that times lie on.

    Parameters
    ----------
    values, factor
        Times as in the file, and the seconds of its unit.
    stated
        Rate in Hz, if it is known otherwise. If it differs from that of the times by at most 0.1 %, the times decide.

    Raises
    ------
    InputError
        Times that are missing, doubled or falling, steps that differ by more than 1 % (beyond the rounding of the
        times), a gap that is no whole number of steps, a clock that drifts by half a step, or another rate than stated.
    """
    times = np.asarray(values, dtype=float) * factor
    _check_order(times, place)
    steps = np.diff(times)
    usual = float(steps[steps < 1.5 * float(np.median(steps))].mean())
    numbers = np.concatenate(([0], np.cumsum(np.rint(np.minimum(steps / usual, LONGEST)).astype(np.int64))))
    missing = int(numbers[-1]) + 1 - len(numbers)
    if missing > MISSING * len(numbers):
        raise InputError("", "time", f"{missing} missing samples between {len(numbers)}", "fewer than there are")
    step = _mean_step(numbers, times)
    rounding = _time_rounding(values) * factor
    notes = _check_steps(numbers, times, usual, rounding, place)
    if stated is not None and rates_differ(1.0 / step, stated):
        found = f"{stated:.9g} Hz, where the times rise by {step:.6g} s ({1.0 / step:.9g} Hz)"
        raise InputError("", "rate", found, "the rate of the times within 0.1 %, or none")
    rate, more = _agreeing_rate(numbers, times, step, rounding, stated)
    return Grid(numbers, rate, float(times[0]), (*notes, *more, *_gap_notes(numbers, times)))


def _check_order(times: FloatArray, place: Place) -> None:
    if len(times) < FEWEST:
        raise InputError("", "samples", f"{len(times)} samples", f"at least {FEWEST}")
    bad = np.flatnonzero(~np.isfinite(times))
    if len(bad):
        raise InputError("", f"{place(int(bad[0]))}, time", "a missing time", "a finite number")
    bad = np.flatnonzero(np.diff(times) <= 0.0)
    if len(bad):
        i = int(bad[0]) + 1
        what = "a doubled time" if times[i] == times[i - 1] else "a falling time"
        found = f"{what}, {times[i]:.12g} s after {times[i - 1]:.12g} s"
        raise InputError("", f"{place(i)}, time", found, "strictly rising times")


def _mean_step(numbers: NDArray[np.int64], times: FloatArray) -> float:
    """Return the step of the straight line nearest to the times."""
    n = numbers - numbers.mean()
    return float(n @ (times - times.mean()) / (n @ n))


def _grid_deviation(numbers: NDArray[np.int64], times: FloatArray, step: float) -> float:
    """Return the largest deviation of times from a grid, s."""
    off = (times - times[0]) - step * numbers
    return float(0.5 * np.ptp(off))


def _time_rounding(values: NDArray[Any]) -> float:
    """Return the rounding of times, in their unit: the last decimal of those at the end."""
    last = np.abs(np.asarray(values, dtype=float))
    largest = float(last.max())
    if largest == 0.0:
        return 0.0
    single = values.dtype.kind == "f" and values.dtype.itemsize <= 4
    floor = 2.0 * float(np.finfo(np.float32 if single else np.float64).eps) * largest
    last = last[
        last >= 0.999 * 10.0 ** np.floor(np.log10(largest))
    ]  # with a fixed number of digits the early ones have more decimals
    for digits in range(13):
        scaled = last * 10.0**digits
        if np.abs(scaled - np.rint(scaled)).max() <= 4.0 * np.finfo(float).eps * scaled.max():
            return max(10.0**-digits, floor)
    return floor


def _check_steps(
    numbers: NDArray[np.int64], times: FloatArray, step: float, rounding: float, place: Place
) -> tuple[str, ...]:
    """Refuse jitter, broken gaps and drift; steps that differ by no more than the rounding of the times may."""
    off = np.abs(np.diff(times) / step - np.diff(numbers))
    deviation = _grid_deviation(numbers, times, _mean_step(numbers, times))
    worst = int(np.argmax(off))
    if off[worst] > JITTER:
        if rounding <= COARSEST * step and deviation <= 0.6 * rounding:
            return (f"times rounded to {rounding:.3g} s",)
        where = f"{place(worst + 1)}, time"
        if numbers[worst + 1] - numbers[worst] > 1:
            found = f"a gap of {(times[worst + 1] - times[worst]) / step:.6g} steps"
            raise InputError("", where, found, "gaps of a whole number of steps within 1 %")
        found = f"a step {100.0 * off[worst]:.3g} % off the mean step of {step:.6g} s"
        raise InputError("", where, found, "steps equal within 1 %; resample unequal ones first")
    if deviation > DRIFT * step:
        found = f"times that leave a constant rate by {deviation / step:.3g} steps"
        raise InputError("", "time", found, f"up to {DRIFT:g}; resample it first, or read a shorter part")
    return ()


def _agreeing_rate(
    numbers: NDArray[np.int64], times: FloatArray, step: float, rounding: float, stated: float | None
) -> tuple[float, tuple[str, ...]]:
    """Return the rate (the stated one or a round one, if the times agree with it), and notes."""
    best = _grid_deviation(numbers, times, step)

    def agrees_with_times(rate: float) -> bool:
        return rate > 0.0 and _grid_deviation(numbers, times, 1.0 / rate) <= best + max(1e-3 * step, 0.5 * rounding)

    measured = 1.0 / step
    if stated is not None and agrees_with_times(stated):
        return stated, ()
    near = (round(measured, digits) for digits in range(4))
    rate = next((r for r in near if agrees_with_times(r)), measured)
    if stated is None:
        return rate, ()
    return rate, (f"the rate of the times, {rate:.9g} Hz, is used and not the stated {stated:.9g} Hz",)


def _gap_notes(numbers: NDArray[np.int64], times: FloatArray) -> tuple[str, ...]:
    gaps = np.flatnonzero(np.diff(numbers) > 1)
    if not len(gaps):
        return ()
    missing = int(numbers[-1]) + 1 - len(numbers)
    return (f"{missing} samples missing in {len(gaps)} gaps of the times, the first after {times[gaps[0]]:.6g} s",)


def check_samples(samples: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Return samples with NaN for missing ones; refuse fewer than 16 others."""
    notes = []
    there = samples
    if not np.isfinite(samples).all():
        infinite, missing = np.isinf(samples), int(np.isnan(samples).sum())
        notes += [f"{missing} missing values of {len(samples)}"] if missing else []
        notes += [f"{int(infinite.sum())} infinite values taken as missing"] if infinite.any() else []
        samples = np.where(infinite, np.nan, samples)
        there = samples[~np.isnan(samples)]
    if len(there) < FEWEST:
        found = f"{len(there)} samples" + (f" besides {len(samples) - len(there)} missing" if notes else "")
        raise InputError("", "samples", found, f"at least {FEWEST}")
    if np.ptp(there) == 0.0:
        notes.append(f"a constant signal: every sample is {there[0]:.6g} in the file")
    return samples, tuple(notes)


def clipped_samples(samples: FloatArray, quantity: Quantity) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Return the samples at the ends of the sensor's range, SI units, and notes.

    The largest or smallest value is an end of the range if it occurs three times or more in a row; then all samples at
    it are marked. Zero is never an end, since an unloaded detector may rest there. A constant signal has no ends.
    """
    marked = np.zeros(len(samples), dtype=bool)
    notes = []
    lowest, highest = np.nanmin(samples), np.nanmax(samples)
    if lowest < highest:
        for name, end in (("largest", highest), ("smallest", lowest)):
            runs = _long_runs(samples == end)
            if not len(runs):
                continue
            if end == 0.0:
                notes.append(f"the {name} value, 0, stands {int(runs.max())} times in a row; taken as rest")
                continue
            marked |= samples == end
            count = int((samples == end).sum())
            notes.append(
                f"{count} samples marked as clipped at the {name} value, {end:.6g} {SI[quantity]}, in {len(runs)} runs"
            )
    return marked, tuple(notes)


def _long_runs(there: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the lengths of the runs of three or more."""
    places = np.flatnonzero(there)
    begins = np.flatnonzero(np.diff(places, prepend=-2) > 1)
    lengths = np.diff(begins, append=len(places))
    return lengths[lengths >= RUN].astype(np.int64)


def size_notes(samples: FloatArray, quantity: Quantity) -> tuple[str, ...]:
    """Return a note if the largest acceleration makes the unit doubtful."""
    if quantity != "deck acceleration":
        return ()
    largest = float(np.nanmax(np.abs(samples)))
    if largest > LARGEST:
        return (f"the largest acceleration, {largest:.4g} m/s^2, is implausibly large: is the unit right?",)
    if largest < SMALLEST:
        return (f"the largest acceleration, {largest:.4g} m/s^2, is implausibly small: is the unit right?",)
    return ()
