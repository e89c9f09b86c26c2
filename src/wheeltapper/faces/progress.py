"""Progress bars for long work: on a terminal, after two seconds."""

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
    """Fill a store with a progress bar, rate and remaining time; return what was not computed."""
    with progress_bar("cells") as (progress, say):
        failed = fill(path, spec, progress=progress, say=say, **options)
    print(f"store: {path}")
    return failed


class _Bar:
    """A bar on a console; it appears when the work has taken long, even if nothing was reported by then."""

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
        """Remove the bar from the console, or prevent it from appearing."""
        self._timer.cancel()
        with self._lock:
            self._ended = True
            if self._progress.live.is_started:
                self._progress.stop()

    def count(self, done: int, total: int, of: str) -> None:
        """Show the number of finished things, and their rate."""
        speed = self._progress.tasks[0].speed
        rate = f", {speed:.3g} per second" if speed else ""
        self._progress.update(
            self._task, description="", completed=done, total=total, said=f"{done}/{total} {of}{rate}"
        )

    def show(self, what: str, done: float, total: float) -> None:
        """Show the progress of one kind of work; `total` is 0 if it is unknown."""
        if what != self._what:
            self._what = what
            self._progress.reset(self._task, description=what, total=total or None)
        said = f"{done / total:.0%}" if total else ""
        self._progress.update(self._task, completed=done, total=total or None, said=said)


@contextmanager
def _bar(transient: bool) -> Iterator[tuple[_Bar, Callable[[str], None]]]:
    """Provide a bar, and a function that writes a line beside it."""
    from rich.console import Console

    console = Console(stderr=True)
    bar = _Bar(console, transient)
    try:
        yield bar, lambda line: console.print(line, markup=False, highlight=False, soft_wrap=True)
    finally:
        bar.close()


@contextmanager
def progress_bar(of: str) -> Iterator[tuple[Callable[[int, int], None], Callable[[str], None]]]:
    """Provide a function to call with the finished and the total number, and one that writes a line beside the bar."""
    with _bar(transient=False) as (bar, say), reporting(lambda *_: None, lambda line: say(f"wheeltapper: {line}")):
        yield lambda done, total: bar.count(done, total, of), say


@contextmanager
def work_bar() -> Iterator[None]:
    """Show the progress that the work inside reports."""
    with _bar(transient=True) as (bar, say), reporting(bar.show, lambda line: say(f"wheeltapper: {line}")):
        yield
