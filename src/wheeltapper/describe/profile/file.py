"""A file with a profile of a wheel or a rail, and its contents."""

from __future__ import annotations

import re
from pathlib import Path

from wheeltapper.describe.noun import Noun
from wheeltapper.describe.profile.named import NAMED, Kind
from wheeltapper.describe.table.content import decoded_text, file_content
from wheeltapper.ground.errors import InputError

OWNER: dict[str, Kind] = {".prw": "wheel", ".whl": "wheel", ".prr": "rail", ".ban": "rail"}
PLAIN = (".txt", ".dat", ".csv")


class ProfileFile(Noun):
    """The contents of a file with a profile: a record keeps them in place of the file.

    Parameters
    ----------
    name
        Path of the file; its suffix says how the text is read, and errors name it.
    text
        What it contains.
    """

    name: str
    text: str

    def __str__(self) -> str:
        return self.name


def read_profile(given: str | ProfileFile, kind: Kind) -> str | ProfileFile:
    """Return a file with its contents; the name of a built-in profile, and what is read already, are returned as given.

    Raises
    ------
    InputError
        The file is missing, unreadable, or that of the other kind.
    """
    if isinstance(given, ProfileFile) or given in NAMED[kind]:
        return given
    try:
        return ProfileFile(name=given, text=_text_of(Path(given), kind))
    except InputError as error:
        raise error.at(given) from None


def _text_of(path: Path, kind: Kind) -> str:
    own = [name for name, owner in OWNER.items() if owner == kind]
    known = f"{', '.join(map(repr, NAMED[kind]))}, or a file with the suffix {', '.join((*PLAIN, *own, '.mpt'))}"
    if not path.is_file():
        path = path.with_name(numbered_profile(path.name)[0])
    suffix = path.suffix.lower()
    if OWNER.get(suffix, kind) != kind:
        raise InputError("", kind, f"the file of a {OWNER[suffix]} ({suffix})", known)
    if not path.is_file():
        raise InputError("", kind, "no such file", known)
    if suffix not in (*PLAIN, *OWNER, ".mpt"):
        raise InputError("", kind, f"a file with the suffix {suffix!r}", known)
    return decoded_text(file_content(path))


def numbered_profile(name: str) -> tuple[str, int]:
    """Return the name of a file, and the number of the profile in it that is meant: "worn.mpt#2"; 0: the only one."""
    several = re.fullmatch(r"(.+\.mpt)#(\d+)", name, re.IGNORECASE)
    return (several[1], int(several[2])) if several else (name, 0)
