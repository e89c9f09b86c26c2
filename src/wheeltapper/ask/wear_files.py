"""The file of an evolution while wheels pass: one process locks it, and temporary files are removed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.locks import locked


@contextmanager
def locked_file(file: Path | None) -> Iterator[None]:
    """Lock an evolution's file for this process, and remove temporary files of a killed one."""
    if file is None:
        yield
        return
    if file.suffix != ".nc":
        raise InputError(str(file), "store", f"the suffix {file.suffix!r}", ".nc")
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(file))
        except OSError as error:
            raise unwritable_error(file, error) from error
        beside_of(file).unlink(missing_ok=True)
        yield


def beside_of(file: Path) -> Path:
    """Return the path at which an evolution is written before it replaces its file."""
    return file.with_name(f".{file.name}.partial")


def unwritable_error(file: Path, error: OSError) -> InputError:
    """Return the error of a file that cannot be written."""
    what = f"a place that cannot be written ({error.strerror or error})"
    return InputError(str(file), "store", what, "a writable path")
