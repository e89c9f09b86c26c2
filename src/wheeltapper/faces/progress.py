"""Long work with a progress bar: on a terminal, from two seconds on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock, Timer
from typing import TYPE_CHECKING, Any

from wheeltapper.ask.fill import fill
from wheeltapper.ground.progress import reporting

if TYPE_CHECKING:
    from rich.console import Console

PATIENCE = 2.0
"""Time that work may take before a progress bar appears, s."""


def filled(path: Path, spec: dict[str, Any], **options: Any) -> list[str]:
    """Fill a store, showing how far it is, how fast, and how long it will take; return what was not computed."""
    with progress_bar("cells") as (progress, say):
        failed = fill(path, spec, progress=progress, say=say, **options)
    print(f"store: {path}")
    return failed


class _Bar:
    """A bar on a console; it appears when the work has taken long, whether or not anything was told by then."""

    def __init__(self, console: Console, transient: bool) -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        self._progress = Progress(
            TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[said]}"), TimeElapsedColumn(),
            TimeRemainingColumn(), TextColumn("left"),
            console=console, transient=transient, disable=not console.is_terminal,
        )  # fmt: skip
        self._task = self._progress.add_task("working", total=None, said="")
        self._what = ""
        self._lock, self._ended = Lock(), False
        self._timer = Timer(PATIENCE, self._appear)
        self._timer.daemon = True
        self._timer.start()

    def _appear(self) -> None:
        with self._lock:
            if not self._ended:
                self._progress.start()

    def close(self) -> None:
        """Take the bar from the console, or see to it that it never appears."""
        self._timer.cancel()
        with self._lock:
            self._ended = True
            if self._progress.live.is_started:
                self._progress.stop()

    def count(self, done: int, total: int, of: str) -> None:
        """Show how many things are done, and how fast they go."""
        speed = self._progress.tasks[0].speed
        rate = f", {speed:.3g} per second" if speed else ""
        self._progress.update(
            self._task, description="", completed=done, total=total, said=f"{done}/{total} {of}{rate}"
        )

    def show(self, what: str, done: float, total: float) -> None:
        """Show how far one kind of work is; a total of 0 where nobody knows."""
        if what != self._what:
            self._what = what
            self._progress.reset(self._task, description=what, total=total or None)
        said = f"{done / total:.0%}" if total else ""
        self._progress.update(self._task, completed=done, total=total or None, said=said)


@contextmanager
def _bar(transient: bool) -> Iterator[tuple[_Bar, Callable[[str], None]]]:
    """Give a bar, and what writes a line beside it."""
    from rich.console import Console

    console = Console(stderr=True)
    bar = _Bar(console, transient)
    try:
        yield bar, lambda line: console.print(line, markup=False, highlight=False, soft_wrap=True)
    finally:
        bar.close()


@contextmanager
def progress_bar(of: str) -> Iterator[tuple[Callable[[int, int], None], Callable[[str], None]]]:
    """Give a function to call with what is done and what is to do, and one that writes a line beside the bar."""
    with _bar(transient=False) as (bar, say), reporting(lambda *_: None, lambda line: say(f"wheeltapper: {line}")):
        yield lambda done, total: bar.count(done, total, of), say


@contextmanager
def work_bar() -> Iterator[None]:
    """Show how far the work inside is, as it reports it."""
    with _bar(transient=True) as (bar, say), reporting(bar.show, lambda line: say(f"wheeltapper: {line}")):
        yield
