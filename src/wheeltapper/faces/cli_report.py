"""The command for a wayside site: a report of the trains in a folder of recordings."""

from __future__ import annotations

import sqlite3
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, NOT_FINISHED, make_folder
from wheeltapper.ground.errors import InputError

SEVERAL = Parameter(consume_multiple=True, negative="")


def report(
    folder: Path,
    *,
    site: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    watch: Annotated[bool, Parameter(negative="")] = False,
    database: Path | None = None,
    identities: Path | None = None,
    rules: Path | None = None,
    countries: Annotated[tuple[str, ...] | None, SEVERAL] = None,
    distances: Annotated[tuple[str, ...] | None, SEVERAL] = None,
    diagnosed: Literal["none", "suspicious", "all"] = "none",
    every: str = "2 s",
    workers: int | None = None,
) -> int:
    """Report the trains in recordings of a track's sensors: a page for each, an index, CSV, JSON, and a database.

    The same command continues where it was stopped: a recording is evaluated once, and again only if its file, the
    site, the rules or its identity have changed. A file that cannot be read has a row in the index that says why.

    Exit code 3: the command was stopped, or failed on some recordings ("not measured"); the rest is done. A recording
    that cannot be read ("not read") does not count as such a failure.

    Parameters
    ----------
    folder
        Folder of recordings: files with all channels, or folders with the files of one passage.
    site
        The site in TOML, with its sensors along the track.
    output
        Folder for the pages; it is created if it does not exist.
    watch
        Run for ever: take new recordings as they come, once they have stopped growing.
    database
        The database of the findings; by default findings.db among the pages.
    identities
        Table of who passed, with columns "file" and "identity", and perhaps "vehicle" and "turned". Without it,
        "id=4711" in the name of a file names the train.
    rules
        Alarm rules in TOML instead of those of the package.
    countries
        Compare only rules that name one of these, such as SE EU.
    distances
        Distances of neighbouring axles of a vehicle that is in each train, such as "1.8 m" "7.2 m" "1.8 m": the speed
        follows from them if all sensors are at one place.
    diagnosed
        Also diagnose with a model none, suspicious or all: axles, if the acceleration of the site's deck is recorded,
        or wheels, if the site states its track.
    every
        With --watch: time between two looks at the folder.
    workers
        Processes; by default one per core.
    """
    from wheeltapper.describe.site import as_any_site
    from wheeltapper.diagnosis.processes import ProcessError
    from wheeltapper.diagnosis.wayside.measure import known_distances
    from wheeltapper.faces.report.answers import UNFINISHED, Asked
    from wheeltapper.faces.report.run import Places, make_report
    from wheeltapper.ground.arguments import as_quantity
    from wheeltapper.record.limits.rule import as_rules

    asked = Asked(as_any_site(site), as_rules(rules, countries), distances, diagnosed)
    pause = as_quantity(every, "--every", "time")
    known_distances(distances)
    if output.resolve() == folder.resolve():
        raise InputError("", "--output", f"{output}, the folder of the recordings", "another folder")
    make_folder(output)
    places = Places(folder, output, output / "findings.db" if database is None else database, identities)
    try:
        counts = make_report(asked, places, workers, pause if watch else None)
    except (KeyboardInterrupt, OSError, ProcessError, sqlite3.Error) as stop:
        kept = f"what is found is in {output}; the same command goes on"
        print(f"wheeltapper: {str(stop) or 'stopped'}; {kept}", file=sys.stderr)
        return NOT_FINISHED
    total = sum(counts.values())
    print(f"{total} recordings: {', '.join(f'{count} {answer}' for answer, count in counts.items())}")
    print(f"report: {output / 'index.html'}")
    return NOT_FINISHED if any(counts.get(answer) for answer in UNFINISHED) else DONE
