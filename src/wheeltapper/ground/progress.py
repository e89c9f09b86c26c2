"""How far a long computation is: it reports, and whoever shows it listens. Without a listener nothing is shown."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

Report = Callable[[str, float, float], None]
Say = Callable[[str], None]


def _print(line: str) -> None:
    print(f"wheeltapper: {line}", file=sys.stderr)


class _Listener(NamedTuple):
    report: Report
    say: Say


_listener: ContextVar[_Listener | None] = ContextVar("listener", default=None)


@contextmanager
def reporting(report: Report, say: Say = _print) -> Iterator[None]:
    """Call `report` and `say` with what the work inside this context tells; the innermost context listens.

    Parameters
    ----------
    report
        Called with what is being done ("lowering the irregularity", "marching"), how much of it is done and how much
        there is to do, in units of their own (metres, seconds, pieces); a total of 0 where nobody knows. It comes as
        often as the work goes round. What it raises ends the work: so it may also stop it.
    say
        Called with a line for the user, such as that kernels are compiled; by default it is printed to stderr.

    Notes
    -----
    A new thread starts without a listener.
    """
    token = _listener.set(_Listener(report, say))
    try:
        yield
    finally:
        _listener.reset(token)


def report(what: str, done: float, total: float) -> None:
    """Tell how much of something is done; `total` 0 where nobody knows how much there is."""
    listener = _listener.get()
    if listener is not None:
        listener.report(what, done, total)


def say(line: str) -> None:
    """Give the user a line at once: to whoever listens, else to stderr."""
    listener = _listener.get()
    (listener.say if listener is not None else _print)(line)
