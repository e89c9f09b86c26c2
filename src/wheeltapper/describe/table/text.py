"""Tables in text files: comments, a header, columns of numbers; read the same for every purpose.

Separators are semicolons, tabs, commas or blanks; decimals follow points or commas. The combination is chosen with
which most lines hold only numbers. Numbers that can be read in two ways are refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.table.content import LARGEST, decoded_text, file_content, numbered_lines
from wheeltapper.describe.table.dialect import Dialect, Rows, check_unambiguous, dialect_of, usual_pattern
from wheeltapper.describe.table.stamps import ALLOWED as STAMPS
from wheeltapper.describe.table.stamps import seconds_of
from wheeltapper.describe.table.units import is_unit, name_and_unit, plain_unit
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.ground.quantities import UNITS

COMMENT = ("#", "%", "!")
ALLOWED = "a number, or NaN or nothing where a sample is missing"
IN_BRACKETS = re.compile(r"\[[^\]]*\]")
UNITS_ALONE = re.compile(r"(\[[^\]]*\]\s*){2,}")
"""Units that stand above columns, with blanks between them whatever separates the columns."""
Names = list[tuple[str, str]]
"""Names and units of columns."""


@dataclass(frozen=True, eq=False)
class TextColumn:
    """A column of a text file: name and unit as in the file; `fault`: the error of reading its values."""

    name: str
    unit: str
    values: NDArray[np.float64]
    fault: InputError | None = None


@dataclass(frozen=True, eq=False)
class TextTable:
    """The columns of a text file.

    Attributes
    ----------
    columns
        In the file's order.
    lines
        The line of each row.
    beside
        Comments, and the lines above the numbers.
    blank
        The first empty line between the numbers.
    cut
        The last line, if the file ends within it; it is left out.
    """

    columns: tuple[TextColumn, ...]
    lines: NDArray[np.int64]
    beside: Rows
    blank: int | None
    cut: int | None = None


def read_text_table(
    path: Path, dimensions: tuple[str, ...], *, largest: float = LARGEST, fewest: int = 1,
    states: Callable[[str], bool] = lambda _: False, may_be_cut: bool = False,
) -> TextTable:  # fmt: skip
    """Return the table in a text file, which may be gzipped.

    Parameters
    ----------
    path
        The file.
    dimensions
        Dimensions, keys of `UNITS`, whose units the columns may have without brackets.
    largest
        Largest unpacked size, bytes.
    fewest
        Smallest number of columns.
    states
        A function: whether a line above the numbers states a fact, so that it is neither a header nor a line of
        numbers.
    may_be_cut
        Whether the file may end within a line. Else such a line is refused.

    Raises
    ------
    InputError
        If there are no numbers, or they can be read in two ways; without the file's name.
    """
    return text_table(
        numbered_lines(decoded_text(file_content(path, largest))), dimensions, fewest=fewest, states=states,
        may_be_cut=may_be_cut,
    )  # fmt: skip


def text_table(
    lines: Rows, dimensions: tuple[str, ...], *, fewest: int = 1, states: Callable[[str], bool] = lambda _: False,
    may_be_cut: bool = False,
) -> TextTable:  # fmt: skip
    """Return the table in lines of text, as `read_text_table`."""
    comments = [(i, text.lstrip("#%! \t")) for i, text in lines if text.startswith(COMMENT)]
    rows = [(i, text) for i, text in lines if text.strip(";,\t ") and not text.startswith(COMMENT)]
    if not rows:
        raise InputError("", "samples", "an empty file", "columns of numbers")
    dialect = dialect_of(rows)
    pattern = usual_pattern(rows, dialect)
    start = _first_number_line(rows, dialect, pattern, states)
    head, body = rows[:start], rows[start:]
    if not pattern or not body:
        found = f"no line of numbers, but {rows[-1][1][:60]!r} in line {rows[-1][0]}"
        raise InputError("", "samples", found, f"columns separated alike, each value {ALLOWED}")
    width = len(pattern)
    before = [c for c in comments if c[0] < body[0][0]]
    names = _column_names([row for row in head if not states(row[1])], dialect, width, dimensions)
    if not names and before and not states(before[-1][1]):
        names = _commented_names(before[-1][1], dialect, width, dimensions)
    check_unambiguous(body, dialect, len(names), fewest)
    blank = next((i for i, text in lines if not text and body[0][0] < i < body[-1][0]), None)
    last, text = body[-1]
    width = len(names) or width
    is_cut = may_be_cut and len(body) > 1 and lines[-1][0] == last and len(dialect.line_cells(text)) < width
    body = body[:-1] if is_cut else body
    columns = _number_columns(body, names, dialect, width)
    return TextTable(columns, np.array([i for i, _ in body]), [*comments, *head], blank, last if is_cut else None)


def _first_number_line(rows: Rows, dialect: Dialect, pattern: tuple[bool, ...], states: Callable[[str], bool]) -> int:
    """Return the first line of numbers: behind the last line of words before the first typical line of numbers.

    Lines with some numbers between the two are broken; they are reported and not skipped.
    """
    start = len(rows)
    for k, (_, text) in enumerate(rows):
        found = dialect.number_pattern(text)
        if not found or states(text):
            start = len(rows)
            continue
        start = min(start, k)
        if len(found) == len(pattern) and all(here or not usual for here, usual in zip(found, pattern, strict=True)):
            return start
    return start


def _column_names(titles: Rows, dialect: Dialect, width: int, dimensions: tuple[str, ...]) -> Names:
    """Return the names and units of the columns; none if no line above the numbers has them."""
    if not titles:
        return []
    split = [_header_cells(text, dialect, width) for _, text in titles[-2:]]
    if all(is_unit(cell) for cell in split[-1]):
        units = ["" if plain_unit(unit) == "-" else plain_unit(unit) for unit in split[-1]]
        if len(split) > 1 and len(split[0]) == len(units):
            return [(name_and_unit(name, dimensions)[0], unit) for name, unit in zip(split[0], units, strict=True)]
        if all(any(unit in UNITS[dimension] for dimension in dimensions) for unit in units):
            return [("", unit) for unit in units]
    while len(split[-1]) > 1 and split[-1][-1] == "":
        split[-1].pop()
    if not width - 1 <= len(split[-1]) <= width:
        found = f"{len(split[-1])} names above {width} values"
        raise InputError("", f"line {titles[-1][0]}, header", found, "as many, separated alike; comments begin with #")
    return [name_and_unit(cell, dimensions) for cell in split[-1]]


def _commented_names(text: str, dialect: Dialect, width: int, dimensions: tuple[str, ...]) -> Names:
    """Return the names and units of columns in a comment; none if it has no unit."""
    names = [name_and_unit(cell, dimensions) for cell in _header_cells(text, dialect, width)]
    return names if len(names) == width and any(unit for _, unit in names) else []


def _header_cells(text: str, dialect: Dialect, width: int) -> list[str]:
    """Return the cells of a header; blanks do not separate a unit from its name, nor the words of a single column."""
    if width > 1 and UNITS_ALONE.fullmatch(text):
        return IN_BRACKETS.findall(text)
    if dialect.separator is not None:
        return [cell.strip('"') for cell in dialect.line_cells(text)]
    if width == 1:
        return [text]
    blanks = r"(?<!\s/)\s+(?![\[(]|/\s)"
    return re.split(blanks, text) if not re.search(r"[;\t,]", text) else re.split(r"\s*[;\t,]\s*", text)


def _number_columns(body: Rows, names: Names, dialect: Dialect, width: int) -> tuple[TextColumn, ...]:
    """Return the columns of the lines of numbers."""
    named = names or [("", "")] * width
    table = _regular_rows(body, dialect, width)
    if table is not None:
        return tuple(TextColumn(name, unit, table[:, k]) for k, (name, unit) in enumerate(named))
    rows = [_row_cells(row, dialect, width) for row in body]
    columns = []
    for k, (name, unit) in enumerate(named):
        cells = [row[k] for row in rows]
        times = seconds_of(cells)
        if times is not None:
            wrong = None if times[1] is None else _fault(body[times[1]][0], name, cells[times[1]], STAMPS)
            columns.append(TextColumn(name, unit or "s", times[0], wrong))
        elif name or any(cells):
            columns.append(TextColumn(name, unit, *_column_values(cells, body, name, dialect)))
    return tuple(columns)


def _regular_rows(body: Rows, dialect: Dialect, width: int) -> NDArray[np.float64] | None:
    """Return the numbers of lines that hold only numbers; None for other lines."""
    texts, mark = [text for _, text in body], dialect.separator
    if mark and len(dialect.line_cells(texts[0])) > width and all(text.endswith(mark) for text in texts):
        texts = [text.removesuffix(mark) for text in texts]
    if dialect.decimal == ",":
        if mark == "," or any("." in text for text in texts):
            return None
        texts = [text.replace(",", ".") for text in texts]
    try:
        table = np.loadtxt(texts, delimiter=mark, comments=None, ndmin=2)
    except ValueError:
        return None
    return table if table.shape[1] == width else None


def _row_cells(row: tuple[int, str], dialect: Dialect, width: int) -> list[str]:
    """Return the cells of a line, which may end with a separator."""
    number, text = row
    cells = dialect.line_cells(text)
    if len(cells) == width + 1 and cells[-1] == "":
        cells.pop()
    if len(cells) != width:
        found = f"{len(cells)} values in {text[:60]!r}"
        raise InputError("", f"line {number}", found, f"{width}, as in the header or the first line")
    return cells


def _column_values(
    cells: list[str], body: Rows, name: str, dialect: Dialect
) -> tuple[NDArray[np.float64], InputError | None]:
    """Return the numbers of a column, and the error of its first cell without a number."""
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        try:
            values[i] = dialect.cell_number(cell)
        except ValueError:
            mark = f"; decimals follow a {'comma' if dialect.decimal == ',' else 'point'}"
            mark = mark if re.fullmatch(r"[-+\d.,]+", cell) else ""
            return values, _fault(body[i][0], name, cell, ALLOWED + mark)
    return values, None


def _fault(line: int, name: str, cell: str, allowed: str) -> InputError:
    return InputError("", f"line {line}, {name}" if name else f"line {line}", repr(cell[:40]), allowed)


class _Named(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...


C = TypeVar("C", bound=_Named)


def column_named(columns: Sequence[C], argument: str, name: str | int, dimensions: tuple[str, ...]) -> C:
    """Return a column by its name, its header in the file, or its number from 0.

    Raises
    ------
    InputError
        If there is none, or more than one.
    """
    wanted = str(name).strip()
    small = wanted.lower()
    for found in (
        [c for c in columns if c.name == name],
        [c for c in columns if c.name.strip().lower() == small],
        [c for c in columns if c.unit and (c.name, c.unit) == name_and_unit(wanted, dimensions)],
    ):
        if len(found) == 1 and not isinstance(name, int):
            return found[0]
    if wanted.isdecimal() and not isinstance(name, bool) and int(wanted) < len(columns):
        return columns[int(wanted)]
    numbers = f"0 to {len(columns) - 1}, or " if wanted.lstrip("+-").isdecimal() else ""
    listed = f"{numbers}one of: {column_list(columns)}"
    raise InputError("", argument, repr(name), with_suggestion(wanted, [c.name for c in columns if c.name], listed))


def column_list(columns: Sequence[_Named], of: Sequence[_Named] | None = None) -> str:
    """Return the names of columns, or if they have none their numbers among all `of` the file."""
    numbers = {id(c): i for i, c in enumerate(columns if of is None else of)}
    names = [c.name or str(numbers[id(c)]) for c in columns]
    return ", ".join(names[:12]) + (" …" if len(names) > 12 else "")
