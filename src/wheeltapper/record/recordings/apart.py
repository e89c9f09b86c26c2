"""Reading files of arrays in a separate process, because a damaged file may crash its library or keep it busy for ever.

The process stays for the next file, and is replaced after it has ended. A folder therefore costs one start.
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Lock, Timer
from typing import Any

from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.files import read_file, reader_of
from wheeltapper.record.recordings.table import RecordingTable
from wheeltapper.record.recordings.text import read_text

PATIENCE = 60.0
"""Time that reading one file may take, s. After that the process that reads it is ended."""
ROOM = 2**33
"""Address space, bytes, that the reading process may use besides four times the largest file. Its libraries need it."""
MOST = 2.0**60
"""More bytes than there are; the system's limits cannot be larger than twice that."""
_SERVE = "from wheeltapper.record.recordings.apart import serve; serve()"
"""Program of the reading process."""
_READERS: dict[int, subprocess.Popen[bytes]] = {}
"""The reading process of each process, by process number."""
_ALONE = Lock()
"""Held while the reading process works: it reads one file at a time."""


def read_apart(path: Path, largest: float) -> RecordingTable:
    """Return the result of `read_file`; text is read in this process, since reading it cannot crash."""
    if reader_of(path) is read_text:
        return read_file(path, largest)
    with _ALONE:
        process = _reading_process()
        assert process.stdin is not None
        assert process.stdout is not None
        late = Timer(PATIENCE, process.kill)
        late.start()
        try:
            pickle.dump((path, largest), process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            why = _end_text(process, late.finished.is_set())
            raise InputError("", "path", f"a file whose reader {why}", "a file that is not damaged") from None
        except BaseException:
            _end_text(process, False)  # it is still busy, and would answer the next request with this file
            raise
        finally:
            late.cancel()
    if isinstance(answer, InputError):
        raise answer
    assert isinstance(answer, RecordingTable)
    return answer


def _reading_process() -> subprocess.Popen[bytes]:
    """Return the process that reads for this one; start it if there is none."""
    process = _READERS.get(os.getpid())
    if process is not None and process.poll() is not None:
        stop()
        process = None
    if process is None:
        found = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "OPENBLAS_NUM_THREADS": "1"}
        process = subprocess.Popen(
            [sys.executable, "-c", _SERVE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=found,
        )  # fmt: skip
        _READERS[os.getpid()] = process
    return process


def _end_text(process: subprocess.Popen[bytes], late: bool) -> str:
    """Remove a process; return how it ended."""
    if not late:  # it may be about to end by itself, with a more useful code
        try:
            process.wait(timeout=1.0)
        except subprocess.TimeoutExpired:
            late = process.poll() is None
    code = stop()
    if late:
        return f"had not ended after {PATIENCE:g} s"
    return how_it_ended(code)


def how_it_ended(code: int) -> str:
    """Return what an exit code says of a process."""
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


@atexit.register
def stop() -> int:
    """End the process that reads for this one; return its exit code."""
    process = _READERS.pop(os.getpid(), None)
    if process is None:
        return 0
    process.kill()
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        with suppress(OSError):
            stream.close()
    return process.wait()


def serve() -> None:
    """Read the files that are requested on the standard input; answer on the standard output, used for nothing else."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    asked, told = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            path, largest = pickle.load(asked)
        except EOFError:
            return
        _limit_memory(4 * largest + ROOM)
        answer: Any
        try:
            answer = read_file(path, largest)
        except InputError as error:
            answer = error
        pickle.dump(answer, told)
        told.flush()


def _limit_memory(room: float) -> None:
    """Limit the memory of this process, so that a request of a damaged file fails here."""
    try:
        import resource
    except ImportError:  # not on Windows
        return
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    room = int(min(room, MOST if most == resource.RLIM_INFINITY else most))
    resource.setrlimit(resource.RLIMIT_AS, (room, most))
