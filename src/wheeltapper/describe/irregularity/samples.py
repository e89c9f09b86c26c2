"""Reading and checking measured columns: order, duplicates, gaps, numbers; with the line named."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import UNITS, unit_factor

FloatArray = NDArray[np.float64]

GAP = 20.0
FEWEST = 4


def read_columns(path: Path, columns: tuple[str | int, str | int] | None) -> tuple[FloatArray, FloatArray, list[int]]:
    """Return two columns of a text file in SI units, and the line number of each row.

    Values are separated by commas, semicolons, tabs or blanks; lines that begin with # are comments; one header line
    may name the columns, with a unit as in "x [mm]", "x (mm)" or "x_mm" (metres without one).
    """
    lines = _lines(path)
    rows = [(i + 1, line.strip()) for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        raise InputError(str(path), "path", "an empty file", "two columns of numbers")
    header = _header(rows[0][1])
    names = header or []
    body = rows[1:] if header else rows
    chosen = [_column(path, names, c) for c in (columns or (0, 1))]
    try:
        table = np.loadtxt([_blanks(text) for _, text in body], usecols=chosen, ndmin=2)
    except (ValueError, IndexError):
        _complain(path, body, chosen)
        raise
    factors = [_factor(path, names[c]) if names else 1.0 for c in chosen]
    numbers = [number for number, _ in body]
    return np.ascontiguousarray(table[:, 0]) * factors[0], np.ascontiguousarray(table[:, 1]) * factors[1], numbers


def _lines(path: Path) -> list[str]:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(
            str(path), "path", f"no readable file ({error.strerror})", "a text file with two columns"
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(
            str(path), "path", "a file that is not text", "a text file with two columns of numbers"
        ) from error
    if "\0" in text:
        raise InputError(str(path), "path", "a file that is not text", "a text file with two columns of numbers")
    return text.splitlines()


def _blanks(text: str) -> str:
    return re.sub(r"[,;\t]+", " ", text)


def _header(text: str) -> list[str] | None:
    parts = [p.strip() for p in re.split(r"[,;\t]", text)] if re.search(r"[,;\t]", text) else text.split()
    try:
        [float(p) for p in parts]
    except ValueError:
        return parts
    return None


def _column(path: Path, names: list[str], column: str | int) -> int:
    if isinstance(column, int):
        return column
    plain = [re.sub(r"\s*[\[(].*", "", name) for name in names]
    for listing in (names, plain):
        if column in listing:
            return listing.index(column)
    raise InputError(
        str(path), "columns", repr(column), ", ".join(names) or "column numbers, as the file has no header"
    )


def _factor(path: Path, name: str) -> float:
    match = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]|_([A-Za-zµ]+)$", name)
    if match is None:
        return 1.0
    unit = match[1] or match[2]
    for dimension in ("length", "angle"):
        if unit in UNITS[dimension]:
            return unit_factor(unit, dimension)
    raise InputError(
        str(path), "header", f"{name!r}, whose unit is not one of length or angle", "m, mm, um, rad, deg …"
    )


def _complain(path: Path, body: list[tuple[int, str]], chosen: list[int]) -> None:
    for number, text in body:
        parts = _blanks(text).split()
        if len(parts) <= max(chosen):
            raise InputError(f"{path}, line {number}", "columns", f"{len(parts)} values", f"at least {max(chosen) + 1}")
        for c in chosen:
            try:
                float(parts[c])
            except ValueError as error:
                raise InputError(f"{path}, line {number}", "columns", repr(parts[c]), "a number") from error


def check(x: FloatArray, y: FloatArray, source: str, lines: list[int] | None, allow_gaps: bool) -> None:
    """Refuse samples that are too few, not finite, out of order, doubled or with gaps, naming the first bad one."""

    def place(i: int) -> str:
        return f"{source}, line {lines[i]}" if lines else (f"{source}, sample {i}" if source else f"sample {i}")

    if len(x) != len(y):
        raise InputError(source, "heights", f"{len(y)} heights for {len(x)} positions", "as many heights as positions")
    if len(x) < FEWEST:
        raise InputError(source, "positions", f"{len(x)} samples", f"at least {FEWEST}")
    for name, values in (("position", x), ("height", y)):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise InputError(place(int(bad[0])), name, str(values[bad[0]]), "a finite number")
    spacing = np.diff(x)
    bad = np.flatnonzero(spacing <= 0)
    if len(bad):
        i = int(bad[0]) + 1
        what = "a doubled position" if spacing[i - 1] == 0 else "positions out of order"
        raise InputError(place(i), "position", f"{what}: {x[i]:.9g} after {x[i - 1]:.9g}", "strictly rising positions")
    wide = np.flatnonzero(spacing > GAP * np.median(spacing))
    if len(wide) and not allow_gaps:
        i = int(wide[0]) + 1
        raise InputError(
            place(i), "position", f"a gap of {spacing[i - 1]:.6g} (the median spacing is {np.median(spacing):.6g})",
            "no gap, or allow_gaps = true to bridge it by the spline",
        )  # fmt: skip
