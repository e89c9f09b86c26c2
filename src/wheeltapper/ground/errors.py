"""The two errors that users meet: wrong input, and a computation that could not finish."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from wheeltapper.ground.outcome import Outcome

LONGEST = 80
"""Largest number of characters of a found value that a message shows."""
MANY = 30
"""Names that a message lists beside the one that was probably meant."""


def value_text(value: object) -> str:
    """Return a value as a message shows it: on one line, and not too long."""
    text = " ".join(line.strip() for line in repr(value).splitlines())
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def brief(told: object) -> str:
    """Return the beginning of what another library tells, in one line."""
    return " ".join(str(told).split())[:120]


def printable(text: str) -> str:
    """Return a text that can be written, also of names of files that are no UTF-8: their bytes stand as escapes."""
    return text.encode(errors="backslashreplace").decode()


def nearest_name(name: str, names: Iterable[str]) -> str | None:
    """Return the name that was probably meant, also in other capitals or as a part of it; None if there is none."""
    by_small = {one.casefold(): one for one in names}
    small = name.casefold()
    close = difflib.get_close_matches(small, by_small, n=1)
    holding = [one for one in by_small if len(small) > 2 and small in one]
    found = close[0] if close else holding[0] if len(holding) == 1 else None
    return None if found is None else by_small[found]


def with_suggestion(name: str, names: Iterable[str], listed: str | None = None) -> str:
    """Return the allowed names (or `listed`, their text) with the one that was probably meant.

    Many names are counted, where one of them is near.
    """
    names = list(names)
    close = nearest_name(name, names)
    if close is None:
        return ", ".join(names) if listed is None else listed
    told = f"one of {len(names)} names" if len(names) > MANY else ", ".join(names)
    return f"{told if listed is None else listed} (did you mean {close!r}?)"


class InputError(ValueError):
    """The input is wrong. The message is one line: place, what was found, and what is allowed.

    Parameters
    ----------
    source
        File, or "" if the input came from Python.
    field
        Dotted path of the field.
    found
        What was found there.
    allowed
        What is allowed there.
    """

    def __init__(self, source: str, field: str, found: str, allowed: str) -> None:
        self.source, self.field, self.found, self.allowed = source, field, found, allowed
        super().__init__(source, field, found, allowed)

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.source, self.field) if part)
        text = f"{where}: found {self.found}" if where else f"found {self.found}"
        return printable(" ".join((f"{text}; allowed: {self.allowed}" if self.allowed else text).splitlines()))

    def at(self, source: str) -> InputError:
        """Return the same error with the file named, if none is named yet."""
        return self if self.source else InputError(source, self.field, self.found, self.allowed)

    def within(self, field: str) -> InputError:
        """Return the same error, with a prefix before its field."""
        path = ".".join(part for part in (field, self.field) if part)
        return InputError(self.source, path, self.found, self.allowed)


class ComputationError(RuntimeError):
    """A computation could not finish; `outcome` states the reason and a remedy."""

    def __init__(self, outcome: Outcome) -> None:
        self.outcome = outcome
        super().__init__(f"{outcome.sentence}; {outcome.remedy}")
