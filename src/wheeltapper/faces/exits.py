"""Exit codes of the commands, and checks of the paths that they write to."""

from __future__ import annotations

import os
from pathlib import Path

from wheeltapper.ground.errors import InputError

DONE, CLAIM_FAILED, WRONG_INPUT, NOT_FINISHED = 0, 1, 2, 3
"""Exit codes of the command line."""
PICTURES = (".png", ".pdf", ".svg")


def check_target(option: str, target: Path, suffixes: tuple[str, ...], folder: bool = False) -> None:
    """Refuse a path that cannot be written, before anything is computed."""
    parent = target.resolve().parent
    if target.suffix not in suffixes:
        raise InputError(str(target), option, f"the suffix {target.suffix!r}", " or ".join(suffixes))
    wrong = target.is_file() if folder else target.is_dir()
    if wrong or not parent.is_dir() or not os.access(target if target.exists() else parent, os.W_OK):
        raise InputError(
            str(target), option, "a place that cannot be written", "a place in a writable folder that exists"
        )


def make_folder(folder: Path) -> None:
    """Create a folder for output, or refuse it before anything is computed."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            str(folder), "--output", f"a place that cannot be made ({error.strerror})", "a folder"
        ) from error
    if not os.access(folder, os.W_OK):
        raise InputError(str(folder), "--output", "a folder that cannot be written", "a writable folder")


def write_whole(target: Path, text: str) -> None:
    """Write a file whole or not at all."""
    aside = target.with_name(f"{target.name}.part")
    aside.write_text(text, encoding="utf-8")
    aside.replace(target)
