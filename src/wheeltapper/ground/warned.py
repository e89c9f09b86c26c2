"""Warnings of results that may not mean what users expect."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterable

from wheeltapper.ground.notes import Note


class ModelWarning(UserWarning):
    """The scenario is valid, but its result may not mean what the user expects."""


def warn_caller(text: str) -> None:
    """Warn whoever called the package, however deep in it this is said."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and str(frame.f_globals.get("__name__", "")).startswith("wheeltapper."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, ModelWarning, stacklevel=level)


def warn_of(notes: Iterable[Note]) -> None:
    """Warn of those notes that put a result's meaning in doubt."""
    for note in notes:
        if note.doubtful:
            warn_caller(note)
