"""The dialect of a text file with numbers: the separator, and a point or a comma before decimals."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from wheeltapper.ground.errors import InputError

Rows = list[tuple[int, str]]
"""Line numbers and lines."""

NOTHING = {"", "nan", "-nan", "+nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "missing", "1.#qnan", "nan(ind)"}
"""Texts that stand for a missing value, in small letters."""
SEEN = 200
"""Number of lines that are examined to find the dialect."""
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""A number whose comma may separate thousands."""
_WHOLE = re.compile(r"[-+]?\d+")
"""A whole number."""
_PADDED = re.compile(r"[-+]?0\d")
"""A number with a leading zero, as the decimals of a number that a comma has cut."""


@dataclass(frozen=True)
class Dialect:
    """Separator of the values of a line (None: blanks), and the mark before their decimals."""

    separator: str | None
    decimal: str = "."

    def line_cells(self, text: str) -> list[str]:
        """Return the cells of a line."""
        if self.separator is None:
            return text.split()
        if '"' in text:
            return [cell.strip() for cell in next(csv.reader([text], delimiter=self.separator, skipinitialspace=True))]
        return [cell.strip() for cell in text.split(self.separator)]

    def cell_number(self, cell: str) -> float:
        """Return a cell's number; NaN for a missing value; ValueError for anything else."""
        text = cell.strip('" \t').replace("\u2212", "-")
        if text.lower() in NOTHING:
            return float("nan")
        other = "," if self.decimal == "." else "."
        if "_" in text or other in text:
            raise ValueError(text)
        return float(text.replace(",", "."))

    def is_number(self, cell: str) -> bool:
        """Return whether a cell holds a number, or stands for a missing value."""
        try:
            self.cell_number(cell)
        except ValueError:
            return False
        return True

    def number_pattern(self, text: str) -> tuple[bool, ...]:
        """Return which cells of a line are numbers; none if less than half are, or if all are missing but not "nan"."""
        cells = self.line_cells(text)
        found = tuple(self.is_number(cell) for cell in cells)
        there = sum(cell.lower() not in NOTHING for cell, good in zip(cells, found, strict=True) if good)
        is_said = all(cell.lower() == "nan" for cell in cells)
        return found if (there or is_said) and 2 * sum(found) >= len(found) else ()


CANDIDATES = (
    *(Dialect(mark, decimal) for mark in (";", "\t") for decimal in (".", ",")),
    Dialect(",", "."), Dialect(",", ","), Dialect(None, "."), Dialect(None, ","),
)  # fmt: skip
"""Dialects, in the order in which they are tried. Decimal commas between separating commas are possible only if cells
are quoted; the cells of each line show it."""


def dialect_of(rows: Rows) -> Dialect:
    """Return the dialect in which most lines hold only numbers; the first of CANDIDATES among equals."""
    texts = [text for _, text in rows[:: max(1, len(rows) // SEEN)]]
    held = "".join(texts)
    possible = [d for d in CANDIDATES if (d.separator or "") in held and (d.decimal == "." or "," in held)]

    def fitting_lines(dialect: Dialect) -> tuple[int, int]:
        patterns = [dialect.number_pattern(text) for text in texts]
        return sum(all(found) for found in patterns if found), sum(map(bool, patterns))

    return max(possible, key=fitting_lines)


def usual_pattern(rows: Rows, dialect: Dialect) -> tuple[bool, ...]:
    """Return which cells are numbers in most lines with numbers; none if no line has any."""
    found = Counter(dialect.number_pattern(text) for _, text in rows[:: max(1, len(rows) // SEEN)])
    found.pop((), None)
    return max(found, key=lambda pattern: (found[pattern], sum(pattern)), default=())


def check_unambiguous(body: Rows, dialect: Dialect, named: int, fewest: int) -> None:
    """Refuse numbers that can be read in two ways.

    Parameters
    ----------
    body
        The lines of numbers.
    dialect
        Dialect of the lines.
    named
        Number of columns in the header; 0 without a header.
    fewest
        Smallest number of columns.
    """
    number, text = body[0]
    if dialect == Dialect(",", "."):
        width = len(dialect.line_cells(text.rstrip(", ")))
        halves = width >= 2 * fewest
        if (
            named != width
            and not _has_other_form(_WHOLE, body, dialect)
            and (halves or _any_number_matches(_PADDED, body, dialect))
        ):
            found = f"{text[:60]!r}, whole numbers or decimal commas between commas"
            allowed = "a header with a name for each column, decimal points, or semicolons between the columns"
            raise InputError("", f"line {number}", found, allowed)
    elif dialect.decimal == "," and not _has_other_form(_THOUSANDS, body, dialect, ","):
        found = f"{text[:60]!r}, where commas may stand before decimals or thousands"
        raise InputError("", f"line {number}", found, "another number of decimals, or decimal points")


def _number_cells(body: Rows, dialect: Dialect) -> Iterable[str]:
    return (cell for _, text in body for cell in dialect.line_cells(text) if cell.lower() not in NOTHING)


def _any_number_matches(form: re.Pattern[str], body: Rows, dialect: Dialect) -> bool:
    return any(form.match(cell) for cell in _number_cells(body, dialect))


def _has_other_form(form: re.Pattern[str], body: Rows, dialect: Dialect, holding: str = "") -> bool:
    """Return whether a number that holds a mark has another form."""
    return any(
        not form.fullmatch(cell) for cell in _number_cells(body, dialect) if holding in cell and dialect.is_number(cell)
    )
