"""Reading the cases and the modes of the rails, writing answers: what all programs of this folder share."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
COLUMNS = ("kind", "number", "time", "value")
STATE = ("displacement", "velocity")
"""Kinds of rows that are neither events nor force maxima."""
FAMILIES = ("core", "deck", "friction", "bogie", "rails", "plastic")


class Row(NamedTuple):
    """One row of an answer."""

    kind: str
    number: int
    time: Any
    value: Any


def names() -> list[str]:
    """Return the names of all cases, family by family."""
    found = [path.stem for path in (HERE / "cases").glob("*.toml")]
    return sorted(found, key=lambda name: (FAMILIES.index(name.split("_")[0]), name))


def read(name: str, number: Callable[[str], Any] = float) -> dict[str, Any]:
    """Return a case, its decimal numbers as `number` makes them of their text."""
    return tomllib.loads((HERE / "cases" / f"{name}.toml").read_text(encoding="utf-8"), parse_float=number)


def read_modes(name: str, number: Callable[[str], Any] = float) -> list[dict[str, Any]]:
    """Return the rows of a file of modes: dictionaries of columns, `powers` as a list of numbers."""
    with (HERE / "cases" / name).open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    keys = ("quantity", "element", "mode", "part")
    return [dict(zip(keys, row[:4], strict=True)) | {"powers": [number(one) for one in row[4:] if one]} for row in rows]


def ordered(rows: Iterable[Row]) -> list[Row]:
    """Return the events in the order of time, then the force maxima, then the state at the end."""
    return sorted(
        rows, key=lambda row: (row.kind in STATE, row.kind == "maximum", 0 if row.kind in STATE else row.time)
    )


def digits(value: Any) -> str:
    """Return a number as text of 16 digits."""
    import numpy as np

    return np.format_float_scientific(value, precision=15, unique=False, trim="k")


def write(path: Path, rows: Iterable[Row], text: Callable[[Any], str] = digits) -> None:
    """Write an answer."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [",".join(COLUMNS)]
    for row in ordered(rows):
        value = "" if row.value is None else text(row.value)
        lines.append(f"{row.kind},{row.number},{text(row.time)},{value}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
