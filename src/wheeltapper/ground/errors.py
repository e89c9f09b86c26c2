"""The two errors that users meet: wrong input, and a computation that could not finish."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from wheeltapper.ground.outcome import Outcome

LONGEST = 80
"""Largest number of characters of a found value that a message shows."""


def value_text(value: object) -> str:
    """Return a value as a message shows it: on one line, and not too long."""
    text = " ".join(line.strip() for line in repr(value).splitlines())
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def with_suggestion(name: str, names: Iterable[str], listed: str | None = None) -> str:
    """Return the allowed names (or `listed`, their text) with the one that was probably meant."""
    names = list(names)
    close = difflib.get_close_matches(name, names, n=1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    return (", ".join(names) if listed is None else listed) + hint


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
        return " ".join((f"{text}; allowed: {self.allowed}" if self.allowed else text).splitlines())

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
