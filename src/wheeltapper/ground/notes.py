"""Notes for the user of a computation: sentences, grouped by cause."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


class Note(str):
    """A sentence for the user; of several with the same cause only the most severe is shown.

    Parameters
    ----------
    text
        The sentence, numbers included.
    cause
        Cause of the note; by default the sentence itself.
    severity
        Severity among notes of the same cause.
    """

    cause: str
    severity: float

    def __new__(cls, text: str, cause: str = "", severity: float = 0.0) -> Note:
        """Return the text with cause and severity."""
        note = super().__new__(cls, text)
        note.cause, note.severity = cause or str(text), severity
        return note


@dataclass(frozen=True)
class Shared:
    """A note that holds in some of many cells, for all notes of its cause.

    Attributes
    ----------
    note
        The most severe note.
    cells
        Number of cells with this cause.
    """

    note: Note
    cells: int

    def told(self, total: int) -> str:
        """Return the note as a sentence about `total` cells."""
        return str(self.note) if total == 1 else f"{self.note} (the worst of {self.cells} such cells of {total})"


def shared(notes: Iterable[Shared]) -> tuple[Shared, ...]:
    """Return one note for each cause: the most severe (the first of equals), with the number of cells of all."""
    by_cause: dict[str, Shared] = {}
    for one in notes:
        held = by_cause.setdefault(one.note.cause, Shared(one.note, 0))
        note = one.note if one.note.severity > held.note.severity else held.note
        by_cause[one.note.cause] = Shared(note, held.cells + one.cells)
    return tuple(by_cause.values())
