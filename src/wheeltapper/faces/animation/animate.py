"""The verb `animate`: a record as a moving picture."""

from __future__ import annotations

from math import ceil, floor
from pathlib import Path
from typing import TYPE_CHECKING

from wheeltapper.ground.arguments import as_path, as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.progress import Progress, progress_shown

if TYPE_CHECKING:
    from wheeltapper.record.record import Record

SUFFIXES = (".html", ".gif", ".mp4")
MOST = 2000
"""Most frames of a film."""
SECONDS, RATE = 6.0, 20.0


def animate(
    record: Record,
    path: str | Path,
    *,
    start: float | str = 0.0,
    stop: float | str | None = None,
    seconds: float = SECONDS,
    frames_per_second: float = RATE,
    exaggeration: float | None = None,
    progress: Progress = True,
) -> Path:
    """Write a record as a moving picture, with the contact force beside it and losses of contact shaded.

    A wheel on a stiff track or a deck is shown close up, where it touches. Heights, also those of the wheel's arc, are
    drawn far larger than lengths, so that indentations and gaps can be seen. If the wheel rolls as a point, a small
    disc stands for it. Several wheelsets, and rails on sleepers, are shown from the side. So is a wagon: its bodies
    move from where they stood at `start`, on a rail that is drawn straight. Sizes are to the scale of lengths,
    and a bar tells that of displacements. The title says how slow the motion is, and how exaggerated.

    Parameters
    ----------
    record
        What `wheeltapper.simulate` or `load` returned.
    path
        A .html, which needs no other files and can be stopped and stepped; a .gif; or a .mp4, if the program ffmpeg is
        installed.
    start, stop
        The part of the run that is shown, s; by default all of it.
    seconds
        Duration of the film, s.
    frames_per_second
        Frames per second of the film.
    exaggeration
        How many times larger heights are drawn than lengths; None: as large as fits.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        If an argument is wrong, the run is too short, or the file needs a program that is not installed.
    """
    from wheeltapper.record.record import Record

    if not isinstance(record, Record):
        raise InputError("", "record", value_text(record), "a Record")
    path = as_path(path, "path", "the path of a .html, .gif or .mp4")
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(str(path), "path", f"the suffix {path.suffix!r}", ", ".join(SUFFIXES))
    if suffix == ".mp4":
        _check_ffmpeg(path)
    first = as_quantity(start, "start", "time", positive=False)
    last = record.end if stop is None else as_quantity(stop, "stop", "time")
    if not 0.0 <= first < last <= record.end * (1.0 + 1e-12):
        found = f"a film from {first:g} to {last:g} s"
        raise InputError("", "start, stop", found, f"a part of the run from 0 to {record.end:g} s")
    seconds = as_quantity(seconds, "seconds", "time")
    pace = as_quantity(frames_per_second, "frames_per_second", "frequency")
    if exaggeration is not None:
        exaggeration = as_quantity(exaggeration, "exaggeration", "number")
    count = round(seconds * pace)
    if not 2 <= count <= MOST:
        raise InputError("", "seconds", f"{count} frames", f"2 to {MOST} of them, seconds·frames_per_second")
    with progress_shown(progress):
        _write(record, path, (first, last), (seconds, pace, count), exaggeration)
    return path


def _write(
    record: Record, path: Path, part: tuple[float, float], film: tuple[float, float, int], exaggeration: float | None
) -> None:
    import matplotlib.style
    import numpy as np

    from wheeltapper.faces.animation.page import write_page
    from wheeltapper.faces.animation.pictures import write_gif, write_mp4
    from wheeltapper.faces.animation.scenes import Interval, film_of
    from wheeltapper.faces.plot import STYLE

    (first, last), (seconds, pace, count) = part, film
    rate = (count - 1) / (last - first)
    begin = ceil(first * rate - 1e-9)  # frames at whole numbers of 1/rate, as readings of the track are
    end = min(begin + count, floor(record.end * rate * (1.0 + 1e-12)) + 1)
    shown = film_of(Interval(record, np.arange(begin, end) / rate, seconds, pace), exaggeration)
    writers = {".html": write_page, ".gif": write_gif, ".mp4": write_mp4}
    with matplotlib.style.context(STYLE), matplotlib.rc_context({"figure.constrained_layout.use": False}):
        try:
            writers[path.suffix.lower()](shown, path)
        except OSError as error:
            raise InputError(str(path), "path", f"a place that cannot be written ({error})", "a writable one") from (
                error
            )


def _check_ffmpeg(path: Path) -> None:
    """Refuse a film for which the program ffmpeg is needed and not found."""
    from matplotlib.animation import FFMpegWriter

    if not FFMpegWriter.isAvailable():
        allowed = ".html or .gif, or install ffmpeg (https://ffmpeg.org)"
        raise InputError(str(path), "path", "a .mp4 without the program ffmpeg, which is not installed", allowed)
