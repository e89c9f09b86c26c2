"""The contents of a measured file before the checks: columns and facts; and the choice of the column."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensitivity import Quantity, quantity_of
from wheeltapper.describe.table.text import column_list, column_named
from wheeltapper.describe.table.units import is_time, plain_unit
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import UNITS
from wheeltapper.record.recordings.units import DIMENSIONS

TIMES = ("t", "time", "times", "timestamp", "time stamp", "elapsed time", "zeit", "temps", "tiempo")
"""Names of a column of times."""
RATES = ("rate", "fs", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency", "sample_frequency")
"""Names under which a file may state its sample rate."""
INTERVALS = ("dt", "interval", "sample_interval", "sampling_interval")
"""Names under which a file may state the time between samples."""
SAMPLES = "samples"
"""Name of the column of samples, if several could be it."""
CLIPPED = "clipped"
"""Name of the column that marks clipped samples."""
STEADY = 0.01
"""Largest range of the speeds in a file, over their median, that is no more than the reading's resolution."""
SPEED = "speed"
"""Name of the column that repeats the measured speed of the passage."""
RISING = 0.9
"""Smallest share of the steps of a column that rise, for the column to be taken as times. The other steps are errors,
which are named."""


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a file.

    Attributes
    ----------
    name, unit
        As in the file; "" if it has none.
    values
        In the file's unit.
    times
        Times, s, if each channel has separate ones.
    rate, start
        Rate, Hz, and start, s, if each channel has separate ones.
    loose
        Whether it may be the column of times although its name does not say so.
    fault
        Error of reading the values; it is raised only if the column is used.
    """

    name: str
    values: NDArray[Any]
    unit: str = ""
    times: NDArray[Any] | None = None
    rate: float | None = None
    start: float | None = None
    loose: bool = False
    fault: InputError | None = None


@dataclass(frozen=True, eq=False)
class RecordingTable:
    """The columns of a file, and the facts that it states.

    Attributes
    ----------
    columns
        In the file's order.
    facts
        rate (Hz), start (s), speed (m/s), unit, quantity, truth, notes, if the file states them.
    lines
        The line of each row in a text file.
    full_scale
        Whether a 1 is the end of a range that the file does not state.
    blank
        The first empty line between samples; it is an error if there are no times that show what is missing there.
    cut
        The last line, if the file ends within it.
    """

    columns: tuple[Column, ...]
    facts: dict[str, Any] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    full_scale: bool = False
    blank: int | None = None
    cut: int | None = None

    def row_place(self, row: int) -> str:
        """Return the place of a row in the file."""
        return f"line {self.lines[row]}" if self.lines is not None else f"sample {row}"


def rate_fact(key: str, value: object) -> float | None:
    """Return the rate in Hz that a key such as "sample rate" or "dt" and its value state; None for other keys."""
    name = key.strip().lower().replace(" ", "_").replace("-", "_")
    if name not in (*RATES, *INTERVALS):
        return None
    dimension = "frequency" if name in RATES else "time"
    number = as_quantity(value, name, dimension)
    return number if name in RATES else 1.0 / number


def choose_columns(
    table: RecordingTable, column: str | int | None, time: str | int | None, quantity: Quantity | None
) -> tuple[Column, Column | None]:
    """Return the column of samples, and that of times or None.

    Raises
    ------
    InputError
        If a named column does not exist, or several columns are possible.
    """
    columns = [c for c in table.columns if plain_name(c) not in (CLIPPED, SPEED)]
    wanted = None if column is None else column_named(table.columns, "column", column, DIMENSIONS)
    clock = column_named(table.columns, "time", time, DIMENSIONS) if time is not None else _time_column(columns, wanted)
    if clock is not None and clock is wanted:
        raise InputError("", "time", f"the column {time!r} for times and samples", "two columns")
    samples = wanted if wanted is not None else _sample_column(table, [c for c in columns if c is not clock], quantity)
    for each in (samples, clock):
        if each is not None and each.fault:
            raise each.fault
    if clock is not None and len(clock.values) != len(samples.values):
        found = f"{len(clock.values)} times for {len(samples.values)} samples"
        raise InputError("", "time", found, "as many times as samples")
    return samples, clock


def clipped_column(table: RecordingTable, samples: Column) -> NDArray[np.bool_] | None:
    """Return the samples that the file itself marks as clipped."""
    for column in table.columns:
        if plain_name(column) == CLIPPED and len(column.values) == len(samples.values):
            if column.fault:
                raise column.fault
            return np.array(np.nan_to_num(np.asarray(column.values, dtype=float)) != 0.0, dtype=bool)
    return None


def speed_column(table: RecordingTable) -> tuple[float | None, tuple[str, ...]]:
    """Return the speed that a column of the file states, m/s, and notes on it; None without such a column."""
    column = next((column for column in table.columns if plain_name(column) == SPEED), None)
    if column is None:
        return None, ()
    if column.fault:
        raise column.fault
    unit, values = plain_unit(column.unit), np.asarray(column.values, dtype=float)
    values = values[np.isfinite(values)]
    if unit not in ("", *UNITS["speed"]):
        raise InputError("", column.name, f"a column in {unit!r}", f"a unit of a speed: {', '.join(UNITS['speed'])}")
    if not len(values):
        return None, (f"the column {column.name!r} is empty",)
    speed = float(np.median(values))
    notes: tuple[str, ...] = () if unit else (f"the speeds {column.name!r} have no unit and are taken in m/s",)
    if np.ptp(values) > STEADY * abs(speed):
        ends = f"{values.min():g} and {values.max():g}"
        notes += (f"the speeds {column.name!r} lie between {ends} {unit or 'm/s'}; the median is taken",)
    return as_quantity(f"{speed!r} {unit}" if unit else speed, column.name, "speed"), notes


def plain_name(column: Column) -> str:
    """Return a name without regard to capitals."""
    return column.name.strip().lower()


def _time_column(columns: list[Column], wanted: Column | None) -> Column | None:
    """Return the column of times: by its name, its unit, or as the first one that rises."""
    others = [c for c in columns if c is not wanted]
    called = [c for c in others if plain_name(c) in TIMES and (c.unit == "" or is_time(c.unit))]
    sure = called + [c for c in others if is_time(c.unit)]
    if sure:
        return sure[0]
    if len(columns) < 2:
        return None
    return next((c for c in others if c.loose and c.unit == "" and not c.fault and _is_rising(c.values)), None)


def _is_rising(values: NDArray[Any]) -> bool:
    numbers = np.asarray(values, dtype=float)
    return len(numbers) > 1 and float(np.mean(numbers[1:] > numbers[:-1])) >= RISING


def _sample_column(table: RecordingTable, columns: list[Column], quantity: Quantity | None) -> Column:
    """Return the only column that can be the samples."""
    if not columns:
        raise InputError("", "column", "no column of samples", "a column of an acceleration or a force")
    if len(columns) == 1:
        return columns[0]
    meant = [(c, quantity_of(plain_unit(c.unit), quantity)) for c in columns if c.unit]
    fitting = [c for c, unit in meant if unit is not None and quantity in (None, unit[0])]
    for narrowed in (fitting, [c for c in columns if plain_name(c) == SAMPLES]):
        if len(narrowed) == 1:
            return narrowed[0]
    listed = column_list(columns, table.columns)
    raise InputError("", "column", f"{len(columns)} columns that may be meant", f"one of: {listed}")
