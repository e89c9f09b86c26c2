"""Diagnosis of many recordings by several processes. Each finding is kept at once, so that work can be resumed."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from wheeltapper._version import __version__
from wheeltapper.ask.diagnosis.diagnose import diagnose
from wheeltapper.ask.diagnosis.finding import Finding
from wheeltapper.ask.diagnosis.processes import in_processes
from wheeltapper.ask.spec import contents
from wheeltapper.describe.site import Site, as_site
from wheeltapper.ground.arguments import as_list, as_path, as_table
from wheeltapper.ground.errors import InputError, shown, suggested

NOT_READ = "not read"
"""Verdict on a file that cannot be read or holds no recording of this site. Its entry says why."""

After = Callable[[Finding, Path], None]


def diagnose_all(
    files: Iterable[str | Path],
    site: Site | str | Path,
    *,
    output: str | Path | None = None,
    workers: int | None = None,
    reading: Mapping[str, Any] | None = None,
    after: After | None = None,
    raising: bool = False,
    progress: Callable[[int, int], None] | None = None,
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
    after
        Called with each finding and the path of its JSON, in the process that computed it.
    raising
        Whether a file that cannot be read, or holds no recording of this site, raises its InputError.
    progress
        Called with the number of finished recordings, and the number of all.

    Returns
    -------
    list of dict
        The result of `to_dict` of each finding, in the order of the files. A file that cannot be read, or holds no
        recording of this site, has the verdict "not read" and the reason.
    """
    what = "paths of recordings"
    site, paths = as_site(site), [as_path(file, "files", what) for file in as_list(files, "files", what)]
    folder = None if output is None else _folder(as_path(output, "output", "the path of a folder"), paths)
    reading = {"apart": True} | _reading(reading)
    found: dict[int, dict[str, Any]] = {}
    for i, path in enumerate(paths):
        kept = None if folder is None else _kept(_target(folder, path), path, site, reading)
        if kept is not None:
            found[i] = kept
    waiting = [i for i in range(len(paths)) if i not in found]
    tasks = [(paths[i], folder, reading, after, raising) for i in waiting]
    for number, entry in in_processes(_one, site, tasks, workers):
        found[waiting[number]] = entry
        if progress is not None:
            progress(len(found), len(paths))
    return [found[i] for i in range(len(paths))]


def _reading(given: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return arguments of `read_recording`."""
    from wheeltapper.record.read_recording import read_recording

    known = [name for name in inspect.signature(read_recording).parameters if name != "path"]
    reading = as_table(given, "reading", f"a table of {', '.join(known)}")
    for name in reading:
        if name not in known:
            raise InputError("", "reading", shown(name), suggested(name, known))
    return reading


_Task = tuple[Path, Path | None, dict[str, Any], After | None, bool]


def _one(site: Site, task: _Task) -> dict[str, Any]:
    from wheeltapper.record.read_recording import read_recording

    path, folder, reading, after, raising = task
    try:
        finding = diagnose(read_recording(path, **reading), site)
        entry = finding.to_dict() | {"paragraph": str(finding)}
    except Exception as error:  # an error in one file must not stop the others
        if raising:
            raise
        finding = None
        why = str(error) if isinstance(error, InputError) else f"{path}: found {type(error).__name__}: {error}"
        entry = {"source": str(path), "verdict": NOT_READ, "paragraph": " ".join(why.split())}
    if folder is not None:
        target = _target(folder, path)
        _write(target, entry | {"of": _mark(path, site, reading)})
        if after is not None and finding is not None:
            after(finding, target)
    return entry


# -- what is kept -----------------------------------------------------------------------------------------------------


def _folder(folder: Path, paths: list[Path]) -> Path:
    names = [path.name for path in paths]
    twice = next((name for name in names if names.count(name) > 1), None) if len(set(names)) < len(names) else None
    if twice is not None:
        raise InputError("", "files", f"two files with the name {twice}", "names that differ, since findings bear them")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            str(folder), "output", f"a place that cannot be made ({error.strerror})", "a folder"
        ) from error
    return folder


def _target(folder: Path, path: Path) -> Path:
    return folder / f"{path.name}.json"


def _mark(path: Path, site: Site, reading: dict[str, Any]) -> dict[str, Any]:
    """Return what a finding depends on: file, site, arguments of reading, version of this program."""
    try:
        seen = path.stat()
        size, changed = seen.st_size, seen.st_mtime_ns
    except OSError:
        size = changed = -1
    told = [site.model_dump(mode="json"), reading, *([held] if (held := contents(site.passage)) else [])]
    of = json.dumps(told, sort_keys=True, default=str)
    digest = hashlib.sha256(of.encode()).hexdigest()
    return {"size": size, "changed": changed, "site": digest, "version": __version__}


def _kept(target: Path, path: Path, site: Site, reading: dict[str, Any]) -> dict[str, Any] | None:
    try:
        entry = json.loads(target.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(entry, dict) or entry.pop("of", None) != _mark(path, site, reading):
        return None
    return entry


def _write(target: Path, entry: dict[str, Any]) -> None:
    """Write a finding; after an interruption the file is either complete or absent."""
    aside = target.with_suffix(".part")
    aside.write_text(json.dumps(entry, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    aside.replace(target)
