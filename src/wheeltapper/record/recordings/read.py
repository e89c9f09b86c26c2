"""Reading a measured recording: it is checked and converted to SI units, and nothing is guessed or silently dropped."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from numbers import Integral
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensitivity import QUANTITIES, UNKNOWN, Bridge, Quantity, has_number, quantity_of
from wheeltapper.describe.table.content import LARGEST
from wheeltapper.describe.table.text import column_list, column_named
from wheeltapper.describe.table.units import plain_unit
from wheeltapper.ground.arguments import as_path, as_quantity, check_choice, check_flag
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.quantities import UNITS, unit_factor
from wheeltapper.record.recordings.apart import read_apart
from wheeltapper.record.recordings.checks import (
    FEWEST,
    Grid,
    check_samples,
    clipped_samples,
    on_grid,
    rates_differ,
    size_notes,
)
from wheeltapper.record.recordings.files import read_file
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.recordings.table import (
    TIMES,
    Column,
    RecordingTable,
    choose_columns,
    clipped_column,
    plain_name,
    speed_column,
)
from wheeltapper.record.recordings.units import DIMENSIONS, check_place, column_meaning

LONG = 3600.0
"""Largest plausible time of the first sample, s. Beyond it the file counts time from another moment than the trigger,
and a note says so."""


def read_recording(
    path: str | Path,
    *,
    quantity: Quantity | None = None,
    unit: str | None = None,
    rate: float | str | None = None,
    column: str | int | None = None,
    time: str | int | None = None,
    speed: float | str | None = None,
    largest: float = LARGEST,
    apart: bool = False,
) -> Recording:
    """Read a recording.

    The file may be text (.csv, .txt, .tsv, also with .gz), WAV, MATLAB (.mat, any version), numpy (.npy, .npz), netCDF
    (.nc), TDMS (with the package nptdms) or MDF (.mf4, .mdf with asammdf). Arguments are needed only for what the file
    does not state. An argument that contradicts the file is an error.

    Parameters
    ----------
    path
        The file; its suffix states the format.
    quantity
        "deck acceleration", "force", "displacement", "strain" or "vertical acceleration". The first two follow from the
        unit: for them this argument only chooses among columns. The others are read only if they are named here.
    unit
        What the number 1 in the file means, if the file does not state it: "g", "kN", "10 g"; negative for a sensor
        that is upside down. Or the sensor's sensitivity, for files in V, mV, mV/V or um/m: "100 mV/g", "250 kN/V". A
        WAV file of integers needs its full scale, such as "10 g".
    rate
        Samples per second, Hz or as "20 kHz", if the file has neither rate nor times.
    column, time
        Column (channel, variable) of the samples and of the times, if there are several: by name, by its header in the
        file, or by number from 0. Times without a unit are in s.
    speed
        Measured speed of the passage, m/s or as "80 km/h". It replaces the speed in the file, which is a line
        "# speed: 80 km/h", or a column "speed [km/h]", of which the median is taken.
    largest
        Largest size of the unpacked file, bytes; a larger one is refused before it is read.
    apart
        Whether files other than text are read in a separate process. A damaged file that crashes this process, or keeps
        it busy for a minute, is refused.

    Returns
    -------
    Recording
        In SI units. Missing samples, also those in gaps of the times, are NaN. Clipped samples are marked: all samples
        at the largest or smallest value, if this value occurs three times or more in a row. `notes` state what was
        found.

    Raises
    ------
    InputError
        The file is missing, empty, broken or of another format; has no unit, no rate, fewer than 16 samples; has
        several columns that may be meant; doubled or falling times, jitter above 1 %, gaps that are no whole number of
        steps; or an argument contradicts it (rates by more than 0.1 %).
    """
    path = as_path(path, "path", "the path of a recording")
    try:
        largest = as_quantity(largest, "largest", "number")
        check_flag(apart, "apart")
        if quantity is not None:
            check_place(str(quantity), "deck acceleration")
            check_choice(quantity, "quantity", QUANTITIES)
        for name, given in (("column", column), ("time", time)):
            if not (given is None or isinstance(given, str | Integral)) or isinstance(given, bool):
                raise InputError("", name, value_text(given), "a name, a header or a number from 0")
        table = (read_apart if apart else read_file)(path, largest)
        stated = _stated_rate(table.facts.get("rate"), rate)
        samples, clock = choose_columns(table, column, time, quantity)
        return _checked_recording(path, table, samples, clock, quantity, unit, stated, speed)
    except InputError as error:
        raise error.at(str(path)) from None


class Channel(NamedTuple):
    """A channel that a file may hold: what it measures, its unit and rate if the file has none, its bridge.

    `column` is the name or number of its column, where none bears its name.
    """

    quantity: Quantity
    unit: str | None = None
    rate: float | None = None
    bridge: Bridge = UNKNOWN
    column: str | int | None = None


def read_channels_of(
    path: Path, wanted: Mapping[str, Channel], *, largest: float = LARGEST, apart: bool = False
) -> tuple[dict[str, Recording], str]:
    """Return the recordings of those channels, by their names, that are columns of a file, and a list of its columns.

    The file is read once. One with one column has the channel that is called like the file, without its suffix. Where
    channels are lost, columns that are none of them are noted: they may bear a wrong name.
    """
    try:
        table = (read_apart if apart else read_file)(path, largest)
        out: dict[str, Recording] = {}
        taken: dict[int, str] = {}
        clocks, dead = set[int](), dict[str, InputError]()
        for name, channel in wanted.items():
            column = _column_of(table, name, channel.column, path)
            if column is None:
                continue
            samples, clock = choose_columns(table, column, None, channel.quantity)
            if taken.setdefault(id(samples), name) != name:
                found = f"the column {column!r}, which is that of {taken[id(samples)]!r}"
                raise InputError("", name, found, "a column for each channel")
            in_file = table.facts.get("rate")
            stated = _stated_rate(in_file, channel.rate)
            own = quantity_of(_own_unit(table, samples), channel.quantity)
            unit = channel.unit if own is None else None  # the file knows it
            clocks.add(id(clock))
            try:
                out[name] = _checked_recording(
                    path, table, samples, clock, channel.quantity, unit, stated, None, channel.bridge
                )
            except InputError as error:
                if np.isfinite(samples.values).sum() >= FEWEST:
                    raise
                dead[name] = error
        if dead and not out:
            raise next(iter(dead.values()))
        if dead:
            note = f"without values in {path.name}: {', '.join(map(repr, dead))}"
            out = {name: replace(one, notes=(*one.notes, note)) for name, one in out.items()}
        others = [one for one in table.columns if id(one) not in {*taken, *clocks}]
        if out and len(out) < len(wanted) and others:
            note = f"there are columns of no channel: {column_list(others, table.columns)}"
            out = {name: replace(one, notes=(*one.notes, note)) for name, one in out.items()}
        return out, column_list(table.columns)
    except InputError as error:
        raise error.at(str(path)) from None


def _column_of(table: RecordingTable, name: str, other: str | int | None, path: Path) -> str | int | None:
    """Return which column of a file a channel is; None if there is none. A single column has no number.

    Formats spell names in their own ways: "left 1" is "left_1", or "WILD/left 1".
    """
    alone = len(table.columns) == 1
    for asked in (name, other):
        if asked is None or (alone and str(asked).isdecimal()):
            continue
        try:
            column_named(table.columns, "column", asked, DIMENSIONS)
            return asked
        except InputError:
            alike = [i for i, one in enumerate(table.columns) if _spelt(one.name) == _spelt(str(asked))]
            if len(alike) == 1 and _spelt(str(asked)):
                return alike[0]
    if path.name.split(".")[0] != name:
        return None
    only, _ = choose_columns(table, None, None, None)
    return next(i for i, one in enumerate(table.columns) if one is only)


def _spelt(name: str) -> str:
    """Return a name as all formats spell it: without groups, and with one mark for all that is no letter or number."""
    return re.sub(r"[\W_]+", "_", name.rsplit("/", 1)[-1].casefold()).strip("_")


def _checked_recording(
    path: Path, table: RecordingTable, column: Column, clock: Column | None, quantity: Quantity | None,
    unit: str | None, stated: float | None, speed: float | str | None, bridge: Bridge = UNKNOWN,
) -> Recording:  # fmt: skip
    """Return the checked recording of a column."""
    facts = table.facts
    meant = quantity or _stated_quantity(facts)
    kind, factor, unit_notes = column_meaning(_own_unit(table, column), unit, meant, bridge)
    if meant is None:
        check_place(f"{column.name} {facts.get('quantity', '')}".strip(), kind)
    if table.full_scale and unit is not None and not has_number(unit):
        raise InputError("", "unit", f"{unit!r} for samples whose 1 is full scale", f'the full scale, as "10 {unit}"')
    grid = _sample_grid(table, column, clock, stated)
    values, found = check_samples(_placed_values(np.asarray(column.values, dtype=float), grid, np.nan))
    samples = factor * values
    marked = clipped_column(table, column)
    clipped, ends = (_placed_values(marked, grid, False), ()) if marked is not None else clipped_samples(samples, kind)
    written = [str(note) for note in _list_or_empty(facts.get("notes"))]
    written += [f"not understood in the file: {text}" for text in facts.get("words", ())]
    told, told_notes = speed_column(table) if speed is None else (None, ())
    pace, pace_notes = _speed_and_note(facts.get("speed", told), speed)
    written += [] if table.cut is None else [f"the file is cut off within its line {table.cut}, which is left out"]
    notes = (*written, *unit_notes, *grid.notes, *found, *ends, *size_notes(samples, kind), *told_notes, *pace_notes)
    truth = facts.get("truth", {})
    return Recording(
        samples, grid.rate, kind, grid.start, clipped, pace, str(path), tuple(dict.fromkeys(notes)),
        truth if isinstance(truth, dict) else {},
    )  # fmt: skip


def _own_unit(table: RecordingTable, column: Column) -> str:
    """Return the unit of a column, or of the whole file, "" if there is none."""
    return plain_unit(column.unit or str(table.facts.get("unit", "")))


def _list_or_empty(value: object) -> list[Any]:
    """Return a list; an empty one for anything else."""
    return value if isinstance(value, list) else []


def _stated_quantity(facts: dict[str, Any]) -> Quantity | None:
    """Return the quantity that a file states, if it uses the names of this package."""
    return next((q for q in QUANTITIES if q == facts.get("quantity")), None)


def _stated_rate(in_file: float | None, rate: float | str | None) -> float | None:
    """Return the rate that the file or the caller states, Hz."""
    if rate is None:
        return in_file
    stated = as_quantity(rate, "rate", "frequency")
    if in_file is not None and rates_differ(stated, in_file):
        raise InputError(
            "", "rate", f"{stated:.9g} Hz, where the file says {in_file:.9g} Hz", "the file's rate, or none"
        )
    return stated if in_file is None else in_file


def _sample_grid(table: RecordingTable, column: Column, clock: Column | None, stated: float | None) -> Grid:
    """Return the times of the samples as a grid."""
    start = float(table.facts.get("start", 0.0) if column.start is None else column.start)
    if clock is None and column.times is None:
        if table.blank is not None:
            found = "an empty line between samples without times"
            raise InputError("", f"line {table.blank}", found, "NaN for a missing sample, or no empty line")
        stated = _stated_rate(column.rate, stated)
        if stated is None:
            raise InputError("", "rate", "neither a rate nor times", 'rate="20 kHz", or a column of times')
        return Grid(np.arange(len(column.values)), stated, start)
    times = column.times if clock is None else clock.values
    assert times is not None
    if clock is not None and clock.loose and clock.unit == "" and _is_numbering(clock):
        return _numbered_grid(times, clock.name, stated, table)
    unit = plain_unit(clock.unit) if clock is not None else ""
    if unit not in ("", *UNITS["time"]):
        raise InputError("", "time", f"a column in {unit!r}", "a column in s, ms, us, min or h")
    grid = on_grid(times, unit_factor(unit, "time") if unit else 1.0, stated, table.row_place)
    notes = list(grid.notes)
    if clock is not None and not unit:
        notes.append(f"the times {clock.name!r} have no unit and are taken in s".replace(" ''", ""))
    if abs(grid.start) > LONG:
        notes.append(f"the first sample lies at {grid.start:.10g} s, as the file counts")
    return Grid(grid.numbers, grid.rate, grid.start, tuple(notes))


def _is_numbering(clock: Column) -> bool:
    """Return whether a column without unit numbers the samples."""
    if plain_name(clock) in TIMES:
        return False
    values = np.asarray(clock.values, dtype=float)
    steps = np.diff(values)
    return bool(np.median(steps) == 1.0 and (np.rint(values) == values).all())


def _numbered_grid(values: NDArray[Any], name: str, stated: float | None, table: RecordingTable) -> Grid:
    """Return the grid that follows from a column with the numbers of the samples."""
    if stated is None:
        found = f"numbers of samples {name!r} and no rate".replace(" ''", "")
        raise InputError("", "rate", found, 'rate="20 kHz", or a column of times with a unit, as "t [s]"')
    grid = on_grid(values - values[0], 1.0 / stated, stated, table.row_place)
    notes = (f"whole numbers {name!r} are taken as numbers of samples".replace(" ''", ""), *grid.notes)
    return Grid(grid.numbers, stated, float(table.facts.get("start", 0.0)), notes)


def _placed_values(values: NDArray[Any], grid: Grid, filling: float) -> NDArray[Any]:
    """Return values on their grid, and a filling in its gaps."""
    count = int(grid.numbers[-1]) + 1 if len(grid.numbers) else 0
    if count == len(grid.numbers):  # there are no gaps
        return values
    placed = np.full(count, filling, dtype=values.dtype)
    placed[grid.numbers] = values
    return placed


def _speed_and_note(in_file: float | None, speed: float | str | None) -> tuple[float | None, tuple[str, ...]]:
    """Return the speed in m/s, and a note if the caller's and the file's differ."""
    if speed is None:
        return in_file, ()
    given = as_quantity(speed, "speed", "speed")
    differs = in_file is not None and rates_differ(given, in_file)
    return given, ((f"speed {given:.6g} m/s as given; the file says {in_file:.6g} m/s",) if differs else ())
