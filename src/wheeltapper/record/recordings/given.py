"""Arguments that are recordings, or the paths of their files."""

from __future__ import annotations

from typing import Any

from wheeltapper.ground.arguments import as_list, as_path, value_of_each
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.recording import Recording


def as_recording(given: Any) -> Recording:
    """Return a recording; for a path, the one in the file."""
    if isinstance(given, Recording):
        return given
    from wheeltapper.record.recordings.read import read_recording

    return read_recording(as_path(given, "recording", "a Recording, or the path of its file"))


def as_recordings(given: Any) -> list[Recording]:
    """Return one or more recordings from a list of recordings and paths."""
    several = as_list(given, "recordings", "a list of Recordings, or of paths of their files")
    if not several:
        raise InputError("", "recordings", "none", "one for each wheelset of the train")
    return value_of_each(several, "recordings", as_recording)
