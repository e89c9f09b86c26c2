"""Files that a scene of the page may name: those that the first scene names, and those in the working folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wheeltapper.describe.scenario import names_a_file
from wheeltapper.ground.errors import InputError, value_text


def named_files(data: Any) -> Iterator[tuple[dict[str, Any], str, str]]:
    """Yield every file that a table names: the table in which it stands, its field and its path."""
    if isinstance(data, dict):
        for key, value in data.items():
            if isinstance(value, str) and names_a_file(data, key, value):
                yield data, key, value
            else:
                yield from named_files(value)
    elif isinstance(data, list | tuple):
        for value in data:
            yield from named_files(value)


class Files:
    """What a page may have read for it.

    Parameters
    ----------
    folder
        The working folder; files in it and below may be named, by paths from it.
    given
        Paths that the scene of the start names: who started the explorer has chosen them.
    """

    def __init__(self, folder: Path, given: Any = None) -> None:
        self.folder = folder.resolve()
        self._given = {path for _, _, path in named_files(given)}

    def checked(self, data: Any) -> Any:
        """Return a table in which paths are whole; refuse one that names a file elsewhere.

        Raises
        ------
        InputError
            With the field and the path.
        """
        if isinstance(data, dict):
            return {
                key: str(self.path(value, str(key)))
                if isinstance(value, str) and names_a_file(data, str(key), value)
                else self.checked(value)
                for key, value in data.items()
            }
        if isinstance(data, list | tuple):
            return [self.checked(value) for value in data]
        return data

    def path(self, text: str, field: str) -> Path:
        """Return the path of a file that may be read."""
        if text in self._given:
            return Path(text)
        try:
            found = (self.folder / text).resolve()
        except (OSError, ValueError, RuntimeError):
            found = None
        if found is None or not found.is_relative_to(self.folder):
            raise InputError("", field, value_text(text), f"a file in the working folder {self.folder}, or below it")
        return found
