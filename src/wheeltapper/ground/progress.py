"""Progress of long computations: they report, and a listener shows it. Without a listener nothing is shown."""

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
    """Call `report` and `say` for the reports of the work inside this context; the innermost context listens.

    Parameters
    ----------
    report
        Called with the name of the work ("lowering the irregularity", "marching"), the amount that is done, and the
        total, in any unit (metres, seconds, pieces). The total is 0 if it is unknown. It is called often. An exception
        that it raises stops the work.
    say
        Called with a line for the user, for example that kernels are compiled; by default the line goes to stderr.

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
    """Report the amount of work that is done; `total` is 0 if it is unknown."""
    listener = _listener.get()
    if listener is not None:
        listener.report(what, done, total)


def say(line: str) -> None:
    """Show the user a line at once: by the listener, else on stderr."""
    listener = _listener.get()
    (listener.say if listener is not None else _print)(line)
