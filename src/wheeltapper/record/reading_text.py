"""Recordings in text files: comments, a header, columns of numbers."""

from __future__ import annotations

import gzip
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import to_si
from wheeltapper.record.reading_table import INTERVALS, RATES, Column, Table, positive, rate_fact
from wheeltapper.record.reading_units import is_unit, name_and_unit, plain

Rows = list[tuple[int, str]]
"""Line numbers and lines."""

COMMENT = ("#", "%")
NOTHING = {"", "nan", "-nan", "+nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "missing", "1.#qnan", "nan(ind)"}
"""What stands for a missing value, in small letters."""
ALLOWED = "a number, or NaN or nothing where a sample is missing"
TEXTS = ("unit", "quantity")
JSON = ("truth", "notes")
_FACT = re.compile(r"\s*([^:=;,\t]+?)\s*[:=;,\t]+\s*(.+?)[\s;,]*")


def read_text(path: Path) -> Table:
    """Return the columns of a text file, which may be gzipped.

    Separators are semicolons, tabs, commas or blanks; between semicolons or tabs a comma is a decimal one. Lines that
    begin with # or % are comments and may state rate, unit, quantity or speed ("# rate: 20 kHz"). Above the numbers, a
    line may name the columns, and another give their units.
    """
    lines = [(i, line.strip()) for i, line in enumerate(_decoded(_content(path)).splitlines(), start=1)]
    comments = [(i, text.lstrip("#% \t")) for i, text in lines if text.startswith(COMMENT)]
    rows = [(i, text) for i, text in lines if text.strip(";,") and not text.startswith(COMMENT)]
    if not rows:
        raise InputError("", "samples", "an empty file", "columns of numbers")
    separator = _separator(rows[len(rows) // 2][1])
    start = next((k for k, (_, text) in enumerate(rows) if _is_data(text, separator)), len(rows))
    head, body = rows[:start], rows[start:]
    if not body:
        raise InputError("", "samples", "no line of numbers", f"columns separated alike, each value {ALLOWED}")
    facts = _facts([*comments, *head])
    width = len(_cells(body[0][1], separator))
    names = _names(head, [c for c in comments if c[0] < body[0][0]], separator, width)
    blank = next((i for i, text in lines if not text and body[0][0] < i < body[-1][0]), None)
    columns = _columns(body, names, separator, len(names) or width)
    return Table(columns, facts, np.array([i for i, _ in body]), blank=blank)


def _content(path: Path) -> bytes:
    """Return what a file holds, unpacked."""
    content = path.read_bytes()
    if path.suffix.lower() != ".gz":
        return content
    try:
        return gzip.decompress(content)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError("", "path", f"a broken gzip file ({error})", "a whole .gz file") from None


def _decoded(content: bytes) -> str:
    """Return text, of whatever encoding measuring programs write."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = content.decode("utf-16", errors="replace")
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("latin-1")  # every byte is a letter; a wrong one makes no number
    if "\0" in text:
        raise InputError("", "path", "a file that is not text", "a text file with columns of numbers")
    return text


def _separator(text: str) -> str | None:
    """Return what separates the values of a line; None for blanks."""
    return next((mark for mark in (";", "\t", ",") if mark in text), None)


def _cells(text: str, separator: str | None) -> list[str]:
    return text.split() if separator is None else [cell.strip() for cell in text.split(separator)]


def _number(cell: str, separator: str | None) -> float:
    """Return a cell's number, NaN where it says that there is none; ValueError for anything else."""
    text = cell.strip().strip('"').strip()
    if text.lower() in NOTHING:
        return float("nan")
    if "_" in text:
        raise ValueError(text)
    return float(text.replace(",", ".") if separator in (";", "\t") else text)


def _is_number(cell: str, separator: str | None) -> bool:
    try:
        return not np.isnan(_number(cell, separator))
    except ValueError:
        return False


def _is_data(text: str, separator: str | None) -> bool:
    """Return whether at least half of a line's cells are numbers."""
    cells = _cells(text, separator)
    count = sum(_is_number(cell, separator) for cell in cells)
    return count > 0 and 2 * count >= len(cells) and not _fact(text)


def _fact(text: str) -> tuple[str, str] | None:
    """Return the key and the value of a line such as "sample rate [Hz] = 20000"; None if its key is not known."""
    match = _FACT.fullmatch(text)
    if match is None:
        return None
    name, unit = name_and_unit(match[1])
    key = name.strip().lower().replace(" ", "_").replace("-", "_")
    if key not in (*RATES, *INTERVALS, *TEXTS, *JSON, "speed", "start"):
        return None
    return key, f"{match[2]} {plain(unit)}" if unit else match[2]


def _facts(lines: Rows) -> dict[str, Any]:
    """Return what comments and the lines above the numbers state."""
    facts: dict[str, Any] = {}
    for number, text in lines:
        found = _fact(text)
        if found is None:
            continue
        name, value = _understood(*found)
        if name == "words":
            facts.setdefault("words", []).append(text[:80])
            continue
        if name in facts and facts[name] != value:
            raise InputError("", f"line {number}, {name}", f"{found[1]} after another one", f"one {name}")
        facts[name] = value
    return facts


def _understood(key: str, value: str) -> tuple[str, Any]:
    """Return the name and the value in SI units of what a file states, or "words" if it cannot be understood."""
    try:
        rate = rate_fact(key, value.strip('"'))
        if rate is not None:
            return "rate", rate
        if key in TEXTS:
            return key, value
        if key == "speed":
            return key, positive(key, value, "speed")
        return key, json.loads(value) if key in JSON else to_si(value, "time")
    except ValueError:
        return "words", value


def _names(head: Rows, comments: Rows, separator: str | None, width: int) -> list[tuple[str, str]]:
    """Return the names and units of the columns; none where no line above the numbers gives them."""
    titles = [row for row in head if not _fact(row[1])]
    split = [_header_cells(text, separator, width) for _, text in titles]
    if len(split) > 1 and len(split[-1]) == len(split[-2]) and all(is_unit(cell) for cell in split[-1]):
        units = ["" if plain(unit) == "-" else plain(unit) for unit in split[-1]]
        return [(name_and_unit(name)[0], unit) for name, unit in zip(split[-2], units, strict=True)]
    if split:
        while len(split[-1]) > 1 and split[-1][-1] == "":
            split[-1].pop()
        if not width - 1 <= len(split[-1]) <= width:
            found = f"{len(split[-1])} names above {width} values"
            raise InputError(
                "", f"line {titles[-1][0]}, header", found, "as many, separated alike; comments begin with #"
            )
        return [name_and_unit(cell) for cell in split[-1]]
    last = [name_and_unit(cell) for cell in _header_cells(comments[-1][1], separator, width)] if comments else []
    return last if len(last) == width and any(unit for _, unit in last) and not _fact(comments[-1][1]) else []


def _header_cells(text: str, separator: str | None, width: int) -> list[str]:
    """Return the cells of a header; blanks separate no unit from its name, and nothing where there is one column."""
    if separator is not None:
        return [cell.strip().strip('"') for cell in text.split(separator)]
    if width == 1:
        return [text]
    return re.split(r"\s+(?![\[(])", text) if not re.search(r"[;\t,]", text) else re.split(r"\s*[;\t,]\s*", text)


def _columns(body: Rows, names: list[tuple[str, str]], separator: str | None, width: int) -> tuple[Column, ...]:
    """Return the columns of the lines of numbers."""
    named = names or [("", "")] * width
    table = _regular(body, separator, width)
    if table is not None:
        return tuple(Column(name, table[:, k], unit, loose=True) for k, (name, unit) in enumerate(named))
    rows = [_row(row, separator, width) for row in body]
    columns = []
    for k, (name, unit) in enumerate(named):
        cells = [row[k] for row in rows]
        if name or any(cells):
            values, fault = _values(cells, body, name, separator)
            columns.append(Column(name, values, unit, loose=True, fault=fault))
    return tuple(columns)


def _regular(body: Rows, separator: str | None, width: int) -> NDArray[np.float64] | None:
    """Return the numbers of lines that hold nothing else; None for others."""
    texts = [text for _, text in body]
    if separator in (";", "\t"):
        texts = [text.replace(",", ".") for text in texts]
    try:
        table = np.loadtxt(texts, delimiter=separator, comments=None, ndmin=2)
    except ValueError:
        return None
    return table if table.shape[1] == width else None


def _row(row: tuple[int, str], separator: str | None, width: int) -> list[str]:
    """Return the cells of a line, which may end with a separator."""
    number, text = row
    cells = _cells(text, separator)
    if len(cells) == width + 1 and cells[-1] == "":
        cells.pop()
    if len(cells) != width:
        raise InputError("", f"line {number}", f"{len(cells)} values", f"{width}, as in the header or the first line")
    return cells


def _values(
    cells: list[str], body: Rows, name: str, separator: str | None
) -> tuple[NDArray[np.float64], InputError | None]:
    """Return the numbers of a column, and what is wrong with the first that is none."""
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        try:
            values[i] = _number(cell, separator)
        except ValueError:
            field = f"line {body[i][0]}, {name}" if name else f"line {body[i][0]}"
            return values, InputError("", field, repr(cell[:40]), ALLOWED)
    return values, None
