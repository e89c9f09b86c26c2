"""Filling a store with a progress bar."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wheeltapper.ask.fill import fill


def filled(path: Path, spec: dict[str, Any], **options: Any) -> list[str]:
    """Fill a store, showing how far it is, how fast, and how long it will take; return what was not computed."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (
        BarColumn(), MofNCompleteColumn(), TextColumn("cells,{task.fields[rate]}"), TimeRemainingColumn(),
        TextColumn("left"),
    )  # fmt: skip
    bar = Progress(*columns, console=console)
    task = bar.add_task("", total=None, rate="")

    def progress(done: int, of: int) -> None:
        bar.start()  # not before the study is known to be sound
        speed = bar.tasks[0].speed
        bar.update(task, completed=done, total=of, rate=f" {speed:.3g} per second," if speed else "")

    try:
        failed = fill(path, spec, progress=progress, say=console.print, **options)
    finally:
        bar.stop()
    print(f"store: {path}")
    return failed
