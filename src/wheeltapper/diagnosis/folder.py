"""Diagnosis of many recordings by several processes. Each finding is kept at once, so that work can be resumed."""

from __future__ import annotations

import inspect
import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from wheeltapper.describe.site import Site, as_site
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.finding import Finding
from wheeltapper.diagnosis.kept import digest_of
from wheeltapper.diagnosis.processes import Lost, ProcessError, in_processes
from wheeltapper.ground.arguments import as_list, as_path, as_quantity, as_table, check_flag, check_function
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.progress import Progress, progress_shown, report

NOT_READ = "not read"
"""Verdict on a file that cannot be read or holds no recording of this site. Its entry says why."""
NOT_DIAGNOSED = "not diagnosed"
"""The verdict on a recording whose diagnosis failed, or died with its process. The next time it is tried again."""

After = Callable[[Finding, Path], None]


def diagnose_all(
    files: Iterable[str | Path],
    site: Site | str | Path,
    *,
    output: str | Path | None = None,
    workers: int | None = None,
    reading: Mapping[str, Any] | None = None,
    speeds: Mapping[str, float] | str | Path | None = None,
    after: After | None = None,
    raising: bool = False,
    progress: Progress = True,
) -> list[dict[str, Any]]:
    """Diagnose recordings in files.

    Parameters
    ----------
    files
        Paths of the recordings.
    site
        The site of the recordings, or the path of its TOML file.
    output
        Folder in which each finding is kept as FILE.json; it is created if it does not exist. A finding of the same
        file and site that it already holds is not computed again. None: nothing is kept.
    workers
        Processes; by default one per core.
    reading
        Arguments of `read_recording`.
    speeds
        Measured speeds, m/s or as "80 km/h", by the names of the files; or the path of a table of files and speeds. If
        speeds are given, every recording needs one.
    after
        Function that is called with each finding and the path of its JSON, in the process that computed it. An
        exception that it raises ends the work; the findings until then are kept.
    raising
        Whether a file that cannot be read, or holds no recording of this site, raises its InputError.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    list of dict
        What each finding's `to_dict` gives, in the order of the files. A file that cannot be read, or is no recording
        of this site, has the verdict "not read" with the reason; one whose diagnosis failed has the verdict "not
        diagnosed".
    """
    if after is not None:
        check_function(after, "after", "a function of a finding and its JSON's path, or None")
    what = "paths of recordings"
    site, paths = as_site(site), [as_path(file, "files", what) for file in as_list(files, "files", what)]
    folder = None if output is None else _output_folder(as_path(output, "output", "the path of a folder"), paths)
    reading = {"apart": True} | _reading_arguments(reading)
    check_flag(raising, "raising")
    readings = _with_speeds(reading, paths, speeds)
    places = _entry_files(folder, paths, digest_of(site, reading) if folder else "", readings)
    found = {
        i: kept for i, place in enumerate(places) if place is not None and (kept := place.kept_entry()) is not None
    }
    waiting = [i for i in range(len(paths)) if i not in found]
    tasks = [(paths[i], places[i], readings[i], after, raising) for i in waiting]
    with progress_shown(progress, "recordings"), closing(in_processes(_diagnose_file, site, tasks, workers)) as done:
        report("recordings", len(found), len(paths))
        for number, result in done:
            i = waiting[number]
            if isinstance(result, Lost):
                if raising:
                    raise ProcessError(f"{paths[i]}: {result}")
                result = undiagnosed_entry(str(paths[i]), str(result))
                if (place := places[i]) is not None:
                    place.keep_entry(result)
            found[i] = result
            report("recordings", len(found), len(paths))
    return [found[i] for i in range(len(paths))]


def _reading_arguments(given: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return arguments of `read_recording`."""
    from wheeltapper.record.recordings.read import read_recording

    known = [name for name in inspect.signature(read_recording).parameters if name != "path"]
    reading = as_table(given, "reading", f"a table of {', '.join(known)}")
    for name in reading:
        if name not in known:
            raise InputError("", "reading", value_text(name), with_suggestion(name, known))
    return reading


def _with_speeds(
    reading: dict[str, Any], paths: list[Path], speeds: Mapping[str, float] | str | Path | None
) -> list[dict[str, Any]]:
    """Return the arguments of `read_recording` for each file, with its speed."""
    if speeds is None:
        return [reading] * len(paths)
    if reading.get("speed") is not None:
        raise InputError("", "speeds", "a speed for all files, too", "one of the two")
    source = ""
    if isinstance(speeds, str | Path):
        from wheeltapper.record.recordings.speeds import read_speeds

        source, speeds = str(speeds), read_speeds(speeds)
    given = as_table(speeds, "speeds", "speeds by the names of files, or the path of a table")
    known = {name: as_quantity(speed, f"speeds.{name}", "speed") for name, speed in given.items()}
    missing = next((path.name for path in paths if path.name not in known), None)
    if missing is not None:
        raise InputError(source, "speeds", f"no speed of {missing}", "one for each recording")
    return [reading | {"speed": known[path.name]} for path in paths]


_Task = tuple[Path, "_EntryFile | None", dict[str, Any], After | None, bool]


def _diagnose_file(site: Site, task: _Task) -> dict[str, Any]:
    from wheeltapper.record.recordings.read import read_recording

    path, place, reading, after, raising = task
    finding = None
    try:
        finding = diagnose(read_recording(path, **reading), site)
        entry = finding.to_dict() | {"paragraph": str(finding)}
    except Exception as error:  # an error in one file must not stop the others
        if raising:
            raise
        if isinstance(error, InputError):
            entry = {"source": str(path), "verdict": NOT_READ, "paragraph": " ".join(str(error).split())}
        else:
            entry = undiagnosed_entry(str(path), f"found {type(error).__name__}: {error}")
    if place is not None:
        place.keep_entry(entry)
        if after is not None and finding is not None:
            after(finding, place.target)
    return entry


def undiagnosed_entry(source: str, reason: str) -> dict[str, Any]:
    """Return the entry of a recording whose diagnosis did not come to its end."""
    return {
        "source": source,
        "verdict": NOT_DIAGNOSED,
        "paragraph": " ".join(f"{source or 'recording'}: {reason}".split()),
    }


# -- what is kept -----------------------------------------------------------------------------------------------------


def _output_folder(folder: Path, paths: list[Path]) -> Path:
    for name, count in Counter(path.name for path in paths).most_common(1):
        if count > 1:
            what = f"{count} files with the name {name}"
            raise InputError("", "files", what, "names that differ, since findings bear them")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            str(folder), "output", f"a place that cannot be made ({error.strerror})", "a folder"
        ) from error
    return folder


class _EntryFile(NamedTuple):
    """Where the entry of a file is kept, and what it depends on."""

    target: Path
    mark: dict[str, Any]

    def kept_entry(self) -> dict[str, Any] | None:
        """Return the entry that is there, if it still holds."""
        try:
            entry = json.loads(self.target.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return entry if isinstance(entry, dict) and entry.pop("of", None) == self.mark else None

    def keep_entry(self, entry: dict[str, Any]) -> None:
        """Write an entry whole or not at all; what was not diagnosed is tried again the next time."""
        whole = entry | {"of": None if entry["verdict"] == NOT_DIAGNOSED else self.mark}
        aside = self.target.with_suffix(".part")
        aside.write_text(json.dumps(whole, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        aside.replace(self.target)


def _entry_files(
    folder: Path | None, paths: list[Path], digest: str, readings: list[dict[str, Any]]
) -> list[_EntryFile | None]:
    if folder is None:
        return [None] * len(paths)
    marks = [
        {"site": digest, "speed": reading.get("speed")} | _size_and_time(path)
        for path, reading in zip(paths, readings, strict=True)
    ]
    return [_EntryFile(folder / f"{path.name}.json", mark) for path, mark in zip(paths, marks, strict=True)]


def _size_and_time(path: Path) -> dict[str, int]:
    try:
        seen = path.stat()
    except OSError:
        return {}
    return {"size": seen.st_size, "changed": seen.st_mtime_ns}
