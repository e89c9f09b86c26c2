"""Long work with a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wheeltapper.ask.fill import fill


def filled(path: Path, spec: dict[str, Any], **options: Any) -> list[str]:
    """Fill a store, showing how far it is, how fast, and how long it will take; return what was not computed."""
    with progress_bar("cells") as (progress, say):
        failed = fill(path, spec, progress=progress, say=say, **options)
    print(f"store: {path}")
    return failed


@contextmanager
def progress_bar(of: str) -> Iterator[tuple[Callable[[int, int], None], Callable[[str], None]]]:
    """Give a function to call with what is done and what is to do, and one that writes a line beside the bar."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (
        BarColumn(), MofNCompleteColumn(), TextColumn(f"{of},{{task.fields[rate]}}"), TimeRemainingColumn(),
        TextColumn("left"),
    )  # fmt: skip
    bar = Progress(*columns, console=console)
    task = bar.add_task("", total=None, rate="")

    def progress(done: int, total: int) -> None:
        bar.start()  # not before the work is known to be sound
        speed = bar.tasks[0].speed
        bar.update(task, completed=done, total=total, rate=f" {speed:.3g} per second," if speed else "")

    try:
        yield progress, console.print
    finally:
        if bar.live.is_started:
            bar.stop()
