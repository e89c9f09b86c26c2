"""Measured columns of a surface: read from a file, and checked for order, duplicates, gaps and numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.table.text import TextColumn, TextTable, column_list, column_named, read_text_table
from wheeltapper.describe.table.units import plain_unit
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import UNITS

FloatArray = NDArray[np.float64]

GAP = 20.0
"""Ratio of the distance of two samples to the median distance from which on it is a gap."""
FEWEST = 4
"""Smallest number of samples of a measured irregularity."""
_SCALED = {
    unit
    for kind in ("length", "angle")
    for unit, size in UNITS[kind].items()
    if size != 1.0 and unit not in ("in", "°")
}
"""Units other than SI that a heading may name. Without them the numbers would mean something else."""


def checked_columns(
    path: Path | None, columns: tuple[str | int, str | int] | None, given: tuple[Any, Any], *, place: str = "length",
    allow_gaps: bool,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the two columns of a file, or those that are given instead, in SI units, after `check_samples`."""
    if path is None:
        x, y = (np.array(column, dtype=float) for column in given)
        check_samples(x, y, "", None, allow_gaps)
    else:
        x, y, lines = read_columns(path, columns, place)
        check_samples(x, y, str(path), lines, allow_gaps)
    return x, y


def read_columns(
    path: Path, columns: tuple[str | int, str | int] | None, place: str = "length"
) -> tuple[FloatArray, FloatArray, list[int]]:
    """Return two columns of a text file in SI units, and the line number of each row.

    Parameters
    ----------
    path
        The file, in any dialect of `read_text_table`. Without units it is in m, or in rad.
    columns
        Names or numbers of the two columns; None if there are no others.
    place
        Dimension of the first column: "length" or "angle". The second one is a length.
    """
    try:
        table = read_text_table(path, ("length", "angle"), fewest=2)
        x, y = _chosen_columns(table.columns, columns)
        _check_words(table, x)
        return *converted_values(table, (x, place, ""), (y, "length", "")), table.lines.tolist()
    except InputError as error:
        raise error.at(str(path)) from None


def _chosen_columns(
    held: tuple[TextColumn, ...], columns: tuple[str | int, str | int] | None
) -> tuple[TextColumn, TextColumn]:
    """Return the two chosen columns."""
    if columns is None:
        if len(held) != 2:
            allowed = f"two, or columns = two of: {column_list(held)}" if len(held) > 2 else "two: places and heights"
            raise InputError("", "columns", f"{len(held)} columns", allowed)
        return held[0], held[1]
    first, second = (column_named(held, "columns", column, ("length", "angle")) for column in columns)
    if first is second:
        raise InputError("", "columns", f"{columns[0]!r} for places and heights", "two columns")
    return first, second


def _check_words(table: TextTable, x: TextColumn) -> None:
    """Refuse units in lines above the header instead of in the header."""
    for number, text in table.beside if not x.unit else []:
        unit = next((word for word in re.findall(r"[^\W\d_]+", text) if word in _SCALED), None)
        if unit is not None:
            found = f"the unit {unit} in {text[:60]!r}, and none in the header"
            raise InputError("", f"line {number}", found, "units in the header, as in 'x [mm]'")


def converted_values(table: TextTable, *wanted: tuple[TextColumn, str, str]) -> tuple[FloatArray, ...]:
    """Return the values of columns, each for its dimension and in the given unit ("": the SI unit).

    Without units in the header the values are in those units already. A unit of one column only is refused.
    """
    above = [number for number, _ in table.beside if number < table.lines[0]]
    field = f"line {above[-1]}, header" if above else "header"
    out = []
    for column, dimension, base in wanted:
        if column.fault is not None:
            raise column.fault
        word = column.name.split()[-1].casefold() if column.name.split() and not column.unit else ""
        if word in _SCALED:
            found = f"the name {column.name!r}, which is like the unit {word}"
            raise InputError("", field, found, f"a unit in brackets, as in 'x [{word}]' or 'x [m]', or another name")
        other = next((c for c, _, _ in wanted if bool(c.unit) != bool(column.unit)), None)
        if other is not None:
            has, lacks = (column, other) if column.unit else (other, column)
            found = f"no unit of {lacks.name!r}, and {has.unit} of {has.name!r}"
            raise InputError("", field, found, "units of both, as in 'x [mm]', or of none")
        unit = plain_unit(column.unit)
        if unit and unit not in UNITS[dimension]:
            found = f"the unit {column.unit!r} of {column.name!r}"
            raise InputError("", field, found, f"a unit of {dimension}: {', '.join(UNITS[dimension])}")
        factor = UNITS[dimension][unit] / (UNITS[dimension][base] if base else 1.0) if unit else 1.0
        out.append(np.ascontiguousarray(column.values) * factor)
    return tuple(out)


def check_samples(x: FloatArray, y: FloatArray, source: str, lines: list[int] | None, allow_gaps: bool) -> None:
    """Refuse samples that are too few, not finite, out of order, doubled or with gaps; name the first bad one."""

    def sample_place(i: int) -> str:
        return f"{source}, line {lines[i]}" if lines else (f"{source}, sample {i}" if source else f"sample {i}")

    if len(x) != len(y):
        raise InputError(source, "heights", f"{len(y)} heights for {len(x)} positions", "as many heights as positions")
    if len(x) < FEWEST:
        raise InputError(source, "positions", f"{len(x)} samples", f"at least {FEWEST}")
    for name, values in (("position", x), ("height", y)):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise InputError(sample_place(int(bad[0])), name, str(values[bad[0]]), "a finite number")
    spacing = np.diff(x)
    bad = np.flatnonzero(spacing <= 0)
    if len(bad):
        i = int(bad[0]) + 1
        what = "a doubled position" if spacing[i - 1] == 0 else "positions out of order"
        raise InputError(
            sample_place(i), "position", f"{what}: {x[i]:.9g} after {x[i - 1]:.9g}", "strictly rising positions"
        )
    wide = np.flatnonzero(spacing > GAP * np.median(spacing))
    if len(wide) and not allow_gaps:
        i = int(wide[0]) + 1
        raise InputError(
            sample_place(i), "position",
            f"a gap of {spacing[i - 1]:.6g} (the median spacing is {np.median(spacing):.6g})",
            "no gap, or allow_gaps = true to bridge it by the spline",
        )  # fmt: skip
