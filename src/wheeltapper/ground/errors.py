"""The two errors that users meet: wrong input, and a computation that could not finish."""

from __future__ import annotations

from wheeltapper.ground.outcome import Outcome


class InputError(ValueError):
    """The input is wrong: one line that says where, what was found and what is allowed.

    Parameters
    ----------
    source
        File, or the empty string where the input came from Python.
    field
        Dotted path of the field.
    found
        What stands there.
    allowed
        What may stand there.
    """

    def __init__(self, source: str, field: str, found: str, allowed: str) -> None:
        self.source, self.field, self.found, self.allowed = source, field, found, allowed
        super().__init__(source, field, found, allowed)

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.source, self.field) if part)
        text = f"{where}: found {self.found}" if where else f"found {self.found}"
        return f"{text}; allowed: {self.allowed}" if self.allowed else text

    def at(self, source: str) -> InputError:
        """Return the same error with the file named, if none is named yet."""
        return self if self.source else InputError(source, self.field, self.found, self.allowed)


class ComputationError(RuntimeError):
    """A computation could not finish; `outcome` says why and what one can do."""

    def __init__(self, outcome: Outcome) -> None:
        self.outcome = outcome
        super().__init__(f"{outcome.sentence}; {outcome.remedy}")
