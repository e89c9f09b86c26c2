"""The command for a wayside site: a report of the trains in a folder of recordings."""

from __future__ import annotations

import sqlite3
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, NOT_FINISHED, make_folder

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

    The same command goes on where it was stopped: a recording is answered once, and again only if its file, the site or
    the rules have changed. What cannot be read is a row of the index that says why.

    Exit code 3: the command was stopped, or failed on some recordings ("not measured"); the rest is done. A recording
    that cannot be read ("not read") is answered: it does not count.

    Parameters
    ----------
    folder
        Folder of recordings: files with all channels, or folders with the files of one passage.
    site
        The site in TOML, with its sensors along the track.
    output
        Folder for the pages; it is created if it does not exist.
    watch
        Go on for ever: take new recordings as they come, once they have stopped growing.
    database
        The database of the findings; by default findings.db among the pages.
    identities
        Table with columns "file" and "identity", and perhaps "vehicle" and "turned": who passed. Without it, "id=4711"
        in the name of a file names the train.
    rules
        Alarm rules in TOML instead of those of the package.
    countries
        Compare only rules that name one of these, such as SE EU.
    distances
        Distances of neighbouring axles of a vehicle that is in each train, such as "1.8 m" "7.2 m" "1.8 m": where all
        sensors are at one place, the speed follows from them.
    diagnosed
        Axles that are diagnosed with the site's deck, too, where its acceleration is recorded, or wheels to which a
        model is fitted, where the site states its track: none, suspicious, all.
    every
        Time between two looks at the folder.
    workers
        Processes; by default one per core.
    """
    from wheeltapper.describe.site import as_any_site
    from wheeltapper.diagnosis.processes import ProcessError
    from wheeltapper.faces.report.answers import NOT_MEASURED, Asked
    from wheeltapper.faces.report.run import Places, make_report
    from wheeltapper.ground.arguments import as_quantity
    from wheeltapper.record.limits.rule import as_rules

    asked = Asked(as_any_site(site), as_rules(rules, countries), distances, diagnosed)
    pause = as_quantity(every, "--every", "time")
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
    return NOT_FINISHED if counts.get(NOT_MEASURED) else DONE
