"""Progress of long computations: they report, and a listener shows it. Without a listener nothing is shown."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from time import monotonic
from typing import NamedTuple, TypeVar

T = TypeVar("T")
Report = Callable[[str, float, float], None]
Say = Callable[[str], None]
Progress = bool | Report
"""What verbs take as `progress`: True, a bar where someone watches; False, nothing; or a function, see `reporting`."""


def _print_line(line: str) -> None:
    print(f"wheeltapper: {line}", file=sys.stderr)


class _Listener(NamedTuple):
    report: Report
    say: Say


PERIOD = 0.1
"""Time between two reports of work that does not report itself, s."""
_listener: ContextVar[_Listener | None] = ContextVar("listener", default=None)
bar: Callable[[], AbstractContextManager[None]] | None = None
"""What shows a bar of the work inside its context. The front door sets it: bars are drawn some floors above."""


@contextmanager
def reporting(report: Report, say: Say = _print_line) -> Iterator[None]:
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


@contextmanager
def progress_shown(progress: Progress, of: str = "") -> Iterator[None]:
    """Let the user see how far a verb is that works inside this context.

    A verb that works for another one is not heard: the outer one tells how far the whole is.

    Parameters
    ----------
    progress
        A function, called as `reporting` says; True: a bar where someone watches, unless another listens; False: none.
    of
        What the verb counts; what else is done for it is then not heard.

    Raises
    ------
    InputError
        If it is none of these.
    """
    heard, say = _listener.get(), sayer()
    context: AbstractContextManager[None] = nullcontext()
    if callable(progress):
        context = reporting(progress, say)
    elif not isinstance(progress, bool):
        _refuse_progress(progress)
    elif heard is not None or not progress:
        context = reporting(_ignore_report, say)
    elif bar is not None and _someone_watches():
        context = bar()
    with context, _reports_of_one(of):
        yield


@contextmanager
def _reports_of_one(of: str) -> Iterator[None]:
    """Let only reports of one thing be heard."""
    listener = _listener.get()
    if listener is None or not of:
        yield
        return
    with reporting(lambda what, *much: listener.report(what, *much) if what == of else None, listener.say):
        yield


def _refuse_progress(progress: object) -> None:
    from wheeltapper.ground.errors import InputError, value_text

    what = "True, False, or a function of what is done, how much of it, and how much there is"
    raise InputError("", "progress", value_text(progress), what)


def _ignore_report(what: str, done: float, total: float) -> None:
    """Hear nothing."""


def report(what: str, done: float, total: float) -> None:
    """Report the amount of work that is done; `total` is 0 if it is unknown."""
    listener = _listener.get()
    if listener is not None:
        listener.report(what, done, total)


def progress_counter(what: str, total: int, done: int = 0) -> Callable[[int], None]:
    """Return what adds to the number of things done, from any thread, and tells whoever listens in this one."""
    listener, lock = _listener.get(), threading.Lock()

    def add_done(more: int) -> None:
        nonlocal done
        with lock:
            done += more
            if listener is not None:
                listener.report(what, done, total)

    return add_done


def patiently(work: Callable[[], T], what: str, seconds: float) -> T:
    """Return what a long call to a library returns, which by itself neither tells how far it is nor can be interrupted.

    It works in a thread of its own, while this one reports which share of the time that is expected, s, has passed. An
    interruption leaves the call to itself. What is expected to take less than a second is called at once.
    """
    if seconds < 1.0:
        return work()
    from concurrent.futures import Future, wait

    found, began = Future[T](), monotonic()

    def finish() -> None:
        try:
            found.set_result(work())
        except BaseException as error:  # raised again where it is waited for
            found.set_exception(error)

    threading.Thread(target=finish, daemon=True).start()
    while wait([found], PERIOD).not_done:
        report(what, min(monotonic() - began, 0.99 * seconds), seconds)
    return found.result()


@contextmanager
def counted_from(before: int, total: int) -> Iterator[None]:
    """Let what is counted inside go on from what was done before, out of a larger total."""
    outer = _listener.get()
    if outer is None:
        yield
        return
    with reporting(lambda what, done, _: outer.report(what, before + done, total), outer.say):
        yield


def sayer() -> Say:
    """Return what shows the user a line: the listener, else stderr. Threads may have it from who started them."""
    listener = _listener.get()
    return listener.say if listener is not None else _print_line


def say(line: str) -> None:
    """Show the user a line at once."""
    sayer()(line)


def _someone_watches() -> bool:
    """Return True on a terminal and in a notebook, but not in a thread or a process that works for another one."""
    if threading.current_thread() is not threading.main_thread():
        return False
    processes = sys.modules.get("multiprocessing.process")
    if processes is not None and processes.parent_process() is not None:
        return False
    in_notebook = type(sys.stderr).__module__.startswith("ipykernel.")
    return in_notebook or sys.stderr.isatty()
