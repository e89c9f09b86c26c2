"""Ctrl-C at any moment: also while a kernel computes or is compiled, where Python hears of it only afterwards."""

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
"""Seconds that Python has to hear of Ctrl-C by itself; then the process ends where it stands."""
SHOW_CURSOR = "\x1b[?25h"


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise KeyboardInterrupt at Ctrl-C; where Python does not come to it, say so and end the process with code 3.

    The signal's own handler, in C, wakes a thread. Kernels and their compiler leave that thread running.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = threading.Event()

    def hear(number: int, frame: FrameType | None) -> None:
        heard.set()
        signal.default_int_handler(number, frame)

    def watch() -> None:
        while byte := reader.recv(1):  # the number of the signal; nothing when the other end is closed
            if byte[0] == signal.SIGINT and not heard.wait(GRACE):
                _end()
            heard.clear()

    reader, writer = socket.socketpair()
    writer.setblocking(False)
    held = signal.signal(signal.SIGINT, hear)
    wake = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wake)
        signal.signal(signal.SIGINT, held)
        writer.close()
        watcher.join()
        reader.close()


def _end() -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"{SHOW_CURSOR}\n")
    sys.stderr.write("wheeltapper: interrupted\n")
    sys.stderr.flush()
    os._exit(NOT_FINISHED)
