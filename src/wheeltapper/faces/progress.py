"""The bar: on a terminal or in a notebook, of work that takes two seconds or more."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from threading import Lock, Timer
from typing import TYPE_CHECKING

from wheeltapper.ground.progress import reporting

if TYPE_CHECKING:
    from rich.console import Console

PATIENCE = 2.0
"""Time that work may take before a progress bar appears, s."""


def time_text(elapsed: float, remaining: float | None) -> str:
    """Return how long work has taken, s, and how much longer it will, where that is known."""
    left = "" if remaining is None else f", {timedelta(seconds=int(remaining))} left"
    return f"{timedelta(seconds=int(elapsed))} so far{left}"


class _Bar:
    """A bar on a console; it appears when the work has taken long, even if nothing was reported by then."""

    def __init__(self, console: Console) -> None:
        from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
        from rich.text import Text

        class TimeColumn(ProgressColumn):
            def render(self, task: Task) -> Text:
                return Text(time_text(task.elapsed or 0.0, task.time_remaining))

        # What is printed meanwhile goes above the bar, except to a file or a pipe, which must not lose it to stderr.
        self._progress = Progress(
            TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[said]}"), TimeColumn(),
            console=console, transient=True, redirect_stdout=sys.stdout.isatty(),
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

    def show(self, what: str, done: float, total: float) -> None:
        """Show how far one kind of work is: whole numbers are counted, others a share; a total of 0: nobody knows."""
        if what != self._what:
            self._what = what
            self._progress.reset(self._task, description=what, total=total or None)
        said = f"{done / total:.0%}" if total else ""
        if total and isinstance(total, int):
            speed = self._progress.tasks[0].speed
            said = f"{done}/{total}" + (f", {speed:.3g} per second" if speed else "")
        self._progress.update(self._task, completed=done, total=total or None, said=said)


@contextmanager
def progress_bar() -> Iterator[None]:
    """Show how far the work inside is, as it reports it, and the lines that it says."""
    from rich.console import Console

    # In a notebook, too, as text: it needs no package for widgets there.
    console = Console(stderr=True, force_terminal=True, force_jupyter=False)
    shows = _Bar(console)

    def say_line(line: str) -> None:
        console.print(f"wheeltapper: {line}", markup=False, highlight=False, soft_wrap=True)

    try:
        with reporting(shows.show, say_line):
            yield
    finally:
        shows.close()
