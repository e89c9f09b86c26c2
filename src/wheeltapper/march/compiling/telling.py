"""What users are told while a kernel is compiled: the compiler itself tells, so it is said whenever it is so.

How long it takes is known from a table, measured on another machine, and corrected by what was compiled on this one.
"""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

from wheeltapper.ground.progress import report, say

COSTS = Path(__file__).with_name("costs.toml")
FORGETTING = 0.7
"""What earlier compilations count for beside the next one, in how fast this machine is."""
SLOWEST, FASTEST = 20.0, 0.05
"""Bounds of how much slower and faster a machine may be than that of the table."""

_said: set[str] = set()


def say_once(line: str) -> None:
    """Tell the user something, once in this process."""
    if line not in _said:
        _said.add(line)
        say(line)


def told_once() -> list[str]:
    """Return the lines that are told once in a process, and were in this one."""
    return sorted(_said)


@cache
def costs() -> dict[str, dict[str, Any]]:
    """Return what is known of kernels: `what` they do, and `seconds` that their compilation took on one machine.

    A name without a dot stands for each kernel of a module, or of a folder, that has no entry of its own.
    """
    return tomllib.loads(COSTS.read_text(encoding="utf-8"))


class _Pace:
    """How fast this machine compiles, beside the table; kept in a file where there is a place for it."""

    def __init__(self) -> None:
        self.expected, self.took = 1.0, 1.0
        self._file: Path | None = None

    def read(self, folder: Path) -> None:
        """Read what earlier processes have measured."""
        if self._file is not None:
            return
        self._file = folder / "pace.json"
        with suppress(OSError, ValueError, KeyError, TypeError):
            found = json.loads(self._file.read_text(encoding="utf-8"))
            expected, took = float(found["expected"]), float(found["took"])
            if expected > 0.0 and FASTEST < took / expected < SLOWEST:
                self.expected, self.took = expected, took

    def learn(self, expected: float, took: float) -> None:
        """Take a compilation into account."""
        self.expected = FORGETTING * self.expected + expected
        self.took = FORGETTING * self.took + took
        if self._file is None:
            return
        beside = self._file.with_name(f".{uuid4().hex}")
        with suppress(OSError):
            beside.write_text(json.dumps({"expected": self.expected, "took": self.took}), encoding="utf-8")
            beside.replace(self._file)

    @property
    def factor(self) -> float:
        """Seconds here over seconds of the table."""
        return min(max(self.took / self.expected, FASTEST), SLOWEST)


class Compilation:
    """A kernel that is being compiled with its parts.

    Attributes
    ----------
    error
        What a listener has raised. The compiler would lose it; it is raised afterwards.
    """

    def __init__(self, kernel: str) -> None:
        known, self._is_one_of_many = costs().get(kernel), False
        if known is None:
            known = costs().get(kernel.partition(".")[0], {})
            self._is_one_of_many = bool(known)
        self.what = f"compiling {known.get('what', kernel)}"
        self.expected = float(known.get("seconds", 0.0))
        self.seconds = self.expected * pace.factor
        self.begin = time.perf_counter()
        self.error: BaseException | None = None
        self._say()
        self.tick()

    def _say(self) -> None:
        long = f"; about {self.seconds:.0f} s" if self.seconds >= 1.0 else ""
        (say_once if self._is_one_of_many else say)(f"{self.what} for this machine, once{long}")

    def tick(self) -> None:
        """Report how much of the time that is expected has passed."""
        passed = time.perf_counter() - self.begin
        try:
            report(self.what, min(passed, 0.99 * self.seconds), self.seconds)
        except BaseException as error:
            self.error = self.error or error

    def end(self) -> None:
        """Learn from how long it took."""
        if self.expected:
            pace.learn(self.expected, time.perf_counter() - self.begin)


pace = _Pace()
_running: list[Compilation] = []  # the compiler works for one thread at a time


@contextmanager
def told(kernel: str, folder: Path) -> Iterator[None]:
    """Tell the user that a kernel is compiled inside; `folder` is where the machine's pace is kept.

    What another kernel needs, which is compiled just now, belongs to that one.
    """
    if _running:
        yield
        return
    pace.read(folder)
    one = Compilation(kernel)
    _running.append(one)
    try:
        yield
    finally:
        _running.clear()
    one.end()
    if one.error is not None:
        raise one.error


def tick() -> None:
    """Report that one more part is compiled."""
    for one in _running:
        one.tick()


def tell_waiting(kernel: str) -> None:
    """Tell the user that another process compiles a kernel, for which this one waits."""
    say(f"another process is compiling {costs().get(kernel, {}).get('what', kernel)}; waiting for it")
