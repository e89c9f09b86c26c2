"""Readers of files, chosen by suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from wheeltapper.describe.table.content import refuse_foreign
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.arrays import read_mat, read_mdf, read_nc, read_npy, read_npz, read_tdms, read_wav
from wheeltapper.record.recordings.table import RecordingTable
from wheeltapper.record.recordings.text import read_text

Reader = Callable[[Path, float], RecordingTable]

READERS: dict[str, Reader] = {
    ".csv": read_text, ".txt": read_text, ".tsv": read_text, ".csv.gz": read_text, ".txt.gz": read_text,
    ".tsv.gz": read_text, ".wav": read_wav, ".mat": read_mat, ".npy": read_npy, ".npz": read_npz, ".nc": read_nc,
    ".tdms": read_tdms, ".mf4": read_mdf, ".mdf": read_mdf,
}  # fmt: skip


def reader_of(path: Path) -> Reader:
    """Return the reader for a file's suffix."""
    name = path.name.lower()
    reader = next((READERS[end] for end in sorted(READERS, key=len, reverse=True) if name.endswith(end)), None)
    if reader is None:
        refuse_foreign(path)
        raise InputError("", "path", f"the suffix {path.suffix!r}", ", ".join(READERS))
    return reader


def read_file(path: Path, largest: float) -> RecordingTable:
    """Return the contents of a file; refuse one with more than `largest` unpacked bytes."""
    reader = reader_of(path)
    try:
        if path.stat().st_size == 0:
            raise InputError("", "path", "an empty file", "a file with samples")
        return reader(path, largest)
    except OSError as error:
        raise InputError("", "path", f"no readable file ({error.strerror or error})", "a file") from None
    except MemoryError:
        raise InputError("", "path", "a file that does not fit in memory", "a smaller file") from None
