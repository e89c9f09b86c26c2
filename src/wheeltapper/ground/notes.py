"""Notes for the user of a computation: sentences, grouped by cause."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    doubtful
        Whether it puts in doubt what the result means.
    """

    cause: str
    severity: float
    doubtful: bool

    def __new__(cls, text: str, cause: str = "", severity: float = 0.0, *, doubtful: bool = False) -> Note:
        """Return the text with what is known of it."""
        note = super().__new__(cls, text)
        note.cause, note.severity, note.doubtful = cause or str(text), severity, doubtful
        return note

    def reworded(self, text: str) -> Note:
        """Return the same note in other words."""
        return Note(text, self.cause, self.severity, doubtful=self.doubtful)


def first_places(places: Sequence[float]) -> str:
    """Return the first three places, and how many there are beside them."""
    more = f" and {len(places) - 3} more" if len(places) > 3 else ""
    return ", ".join(f"{x:.6g}" for x in places[:3]) + more


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

    def sentence_of(self, total: int) -> Note:
        """Return the note as a sentence about `total` cells."""
        if total == 1:
            return self.note
        return self.note.reworded(f"{self.note} (the worst of {self.cells} such cells of {total})")


def shared_notes(notes: Iterable[Shared]) -> tuple[Shared, ...]:
    """Return one note for each cause: the most severe (the first of equals), with the number of cells of all."""
    by_cause: dict[str, Shared] = {}
    for one in notes:
        held = by_cause.setdefault(one.note.cause, Shared(one.note, 0))
        note = one.note if one.note.severity > held.note.severity else held.note
        by_cause[one.note.cause] = Shared(note, held.cells + one.cells)
    return tuple(by_cause.values())
