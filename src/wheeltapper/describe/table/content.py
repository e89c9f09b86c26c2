"""The contents of a file: its bytes, unpacked up to a limit, and their text."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from pathlib import Path

from wheeltapper.ground.errors import InputError

LARGEST = 1e9
"""Largest size of an unpacked file, bytes, unless the caller allows more."""
MICRO_IN_GBK = b"\xa6\xccm"
"""A micrometre in the encoding of Chinese Windows: the one unit that another encoding would lose."""
FOREIGN = {
    ".json": ("a JSON file", "its columns as .csv"), ".xlsx": ("a spreadsheet", "the sheet saved as .csv"),
    ".xls": ("a spreadsheet", "the sheet saved as .csv"), ".ods": ("a spreadsheet", "the sheet saved as .csv"),
    ".uff": ("a universal file", "its data sets written as .csv, .npz or .mat"),
    ".unv": ("a universal file", "its data sets written as .csv, .npz or .mat"),
    ".parquet": ("a Parquet file", "its columns as .csv or .npz"), ".h5": ("an HDF5 file", "its data as .nc or .npz"),
}  # fmt: skip
"""Kinds of files that people bring, but that are not read: what they are, and the way out."""


def refuse_foreign(path: Path) -> None:
    """Refuse a file of a known kind that is not read, with the way out."""
    kind = FOREIGN.get(path.suffix.lower())
    if kind is not None:
        raise InputError("", "path", f"{kind[0]} ({path.suffix})", kind[1])


def file_content(path: Path, largest: float = LARGEST) -> bytes:
    """Return the contents of a file, unpacked if its name ends with .gz.

    Raises
    ------
    InputError
        If it cannot be read, is broken, or holds more bytes than `largest`.
    """
    refuse_foreign(path)
    try:
        if path.suffix.lower() != ".gz":
            check_size(path.stat().st_size, largest)
            return path.read_bytes()
        with gzip.open(path) as file:
            unpacked = file.read(int(largest) + 1)  # never unpack more than that
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError("", "path", f"a broken gzip file ({error})", "a whole .gz file") from None
    except OSError as error:
        raise InputError("", "path", f"no readable file ({error.strerror or error})", "a file") from None
    check_size(len(unpacked), largest)
    return unpacked


def digest(path: Path) -> str:
    """Return a digest of a file's contents; "" for a file that cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def check_size(count: float, largest: float) -> None:
    """Refuse more bytes than a file may hold."""
    if count > largest:
        allowed = f"up to {largest:.4g} bytes, or largest= as many as it may hold"
        raise InputError("", "path", f"a file that holds more than {largest:.4g} bytes unpacked", allowed)


def decoded_text(whole: bytes) -> str:
    """Return text, in any encoding that measuring programs use."""
    if whole.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = whole.decode("utf-16", errors="replace")
    else:
        try:
            text = whole.decode("utf-8-sig")
        except UnicodeDecodeError:  # in latin-1 every byte is a character; a wrong one does not change numbers
            text = whole.decode("gbk" if MICRO_IN_GBK in whole else "latin-1", errors="replace")
    if "\0" in text:
        raise InputError("", "path", "a file that is not text", "a text file with columns of numbers")
    return text


def numbered_lines(text: str) -> list[tuple[int, str]]:
    """Return the lines of a text with their numbers, from 1."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return [(i, line.strip(" \xa0\f\x1a")) for i, line in enumerate(lines, start=1)]
