"""Ctrl-C at any moment, also while a kernel runs or is compiled; Python alone would react only afterwards."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from wheeltapper.faces.exits import NOT_FINISHED

GRACE = 2.0
"""Time in which Python should react to Ctrl-C, s. If it does not, the process ends at once."""
CLEARING = 20.0
"""Time in which a command should end after Python has reacted, s. An exception can get lost, for example in a callback
from C; then the process ends."""
COMPILERS = ("numba.", "llvmlite.")
"""First parts of the names of the modules that compile kernels."""
SHOW_CURSOR = "\x1b[?25h"
"""Escape sequence that shows the cursor of a terminal again."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise KeyboardInterrupt at Ctrl-C; if Python does not react, print a line and end the process with code 3.

    The handler of the signal, in C, wakes a thread. This thread runs even during kernels and their compilation.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard, left = threading.Event(), threading.Event()

    def on_signal(number: int, frame: FrameType | None) -> None:
        heard.set()
        if _is_compiling(frame):  # the compiler has no results to keep, and loses exceptions
            _end_process()
        signal.default_int_handler(number, frame)

    def watch_signals() -> None:
        while byte := reader.recv(1):  # the number of the signal; empty when the other end is closed
            if byte[0] == signal.SIGINT and not (heard.wait(GRACE) and left.wait(CLEARING)):
                _end_process()

    reader, writer = socket.socketpair()
    writer.setblocking(False)
    held = signal.signal(signal.SIGINT, on_signal)
    wake = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    watcher = threading.Thread(target=watch_signals, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        left.set()
        signal.set_wakeup_fd(wake)
        signal.signal(signal.SIGINT, held)
        writer.close()
        watcher.join()
        reader.close()


def _is_compiling(frame: FrameType | None) -> bool:
    """Return True if a frame, or one of its callers, belongs to the compiler of the kernels."""
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(COMPILERS):
            return True
        frame = frame.f_back
    return False


def _end_process() -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"{SHOW_CURSOR}\n")
    sys.stderr.write("wheeltapper: interrupted\n")
    sys.stderr.flush()
    os._exit(NOT_FINISHED)
