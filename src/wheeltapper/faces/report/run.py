"""A folder of recordings to pages and a database, once or as files come."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from wheeltapper.diagnosis.gauges.growth import what_is_told
from wheeltapper.diagnosis.kept import digest_of
from wheeltapper.diagnosis.processes import Lost, in_processes
from wheeltapper.diagnosis.wayside.database import Findings
from wheeltapper.diagnosis.wayside.identities import Identity, named_wheels, read_identities, tagged
from wheeltapper.diagnosis.wayside.sources import Source, sources_in
from wheeltapper.faces.exits import write_whole
from wheeltapper.faces.report.answers import NOT_MEASURED, UNFINISHED, Answer, Asked, Train, answer_source
from wheeltapper.faces.report.flats import flats_of
from wheeltapper.faces.report.pages import LATEST, SUMMARY, courses_of, index_page, summary_of, train_page
from wheeltapper.ground.errors import InputError, printable
from wheeltapper.ground.locks import locked
from wheeltapper.ground.progress import progress_shown, report, say

SHARE = 0.1
"""Share of the time that writing the index may take while recordings are answered."""
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of a cell that spreadsheets compute, or run."""
TIME = 5.0
"""Shortest time between two writings of the index, s."""


class Places(NamedTuple):
    """Where a report reads and writes: recordings, pages, database, and the table of identities, if there is one."""

    folder: Path
    output: Path
    database: Path
    identities: Path | None


class _Task(NamedTuple):
    source: Source
    identities: list[Identity]
    mark: str


class Report:
    """A report in the making: what is answered, and what is not yet.

    Parameters
    ----------
    asked
        Site, rules, and known distances.
    places
        Where it reads and writes.
    workers
        Processes; None: one per core.
    """

    def __init__(self, asked: Asked, places: Places, workers: int | None) -> None:
        self.asked, self.places, self.workers = asked, places, workers
        self.findings = Findings(places.database, SUMMARY)
        self._digest = digest_of(asked.site, [rule.to_dict() for rule in asked.rules], *asked[2:])
        self._seen: dict[str, Any] = {}
        self._failed: dict[str, str] = {}
        self._written, self._took = 0.0, 0.0
        self._others: list[str] = []

    def close(self) -> None:
        """Close the database."""
        self.findings.close()

    def waiting(self, settled: bool) -> list[_Task]:
        """Return the recordings without an answer; if `settled`, those that have not changed since the last look."""
        table = {} if self.places.identities is None else read_identities(self.places.identities)
        beside = [self.places.output, self.places.database]
        beside += [] if self.places.identities is None else [self.places.identities]
        sources, self._others = sources_in(self.places.folder, beside)
        before, self._seen = self._seen, {source.name: source.state for source in sources}
        answered, out = self.findings.marks(), []
        for source in sources:
            own = table.get(source.name) or tagged(source.name)
            mark = hashlib.sha256(json.dumps([self._digest, source.state, own]).encode()).hexdigest()
            known, pages = answered.get(source.name, ("", []))
            done = known == mark and all((self.places.output / page).exists() for page in pages)
            quiet = not settled or before.get(source.name) == source.state
            if not done and quiet and self._failed.get(source.name) != mark:
                out.append(_Task(source, own, mark))
        return out

    def answer(self, tasks: Sequence[_Task]) -> Iterator[tuple[str, Answer]]:
        """Answer recordings; yield the name of each and its answer once it is kept."""
        sources = [task.source for task in tasks]
        shared = self.asked, self.workers if len(sources) == 1 else 1
        with closing(in_processes(answer_source, shared, sources, self.workers)) as found:
            for number, result in found:
                answer = Answer(NOT_MEASURED, str(result)) if isinstance(result, Lost) else result
                self._keep(tasks[number], answer)
                yield sources[number].name, answer
                if time.monotonic() - self._written > max(TIME, self._took / SHARE):
                    self.write_index()

    def _keep(self, task: _Task, answer: Answer) -> None:
        """Write pages and rows of a recording. Its rows come last, so that a recording with rows has its pages."""
        source, failed = task.source, answer.answer in UNFINISHED
        passed = source.when
        if failed:
            self._failed[source.name] = task.mark
        with self.findings.transaction():
            row = self.findings.keep_recording(
                source.name, "" if failed else task.mark, passed[0], answer.answer, answer.reason
            )
            for number, train in enumerate(answer.trains, 1):
                stem = source.stem(number)
                alone = len(answer.trains) == 1
                names, notes = named_wheels(train.finding.axles, task.identities if alone else [])
                if task.identities and not alone:
                    notes.append("several trains in a recording: it is not known which of them has the identity")
                self.findings.keep_train(
                    row, number, f"{stem}.html", summary_of(train), *_rows_of(train, names)
                )  # fmt: skip
                rows = self.findings.courses(sorted(names.values()), passed[0])
                courses, flats = courses_of(rows), flats_of(rows)
                self._write(f"{stem}.html", train_page(train, number, passed, names, courses, flats, notes))
                told = train.finding.to_dict() | {"identities": [[*key, name] for key, name in names.items()]}
                self._write(f"{stem}.json", json.dumps(told, indent=1, ensure_ascii=False) + "\n")
                self._write(f"{stem}.csv", _as_csv(train.wheels))

    def write_index(self) -> None:
        """Write the index: the page, and all recordings as CSV and JSON."""
        begun = time.monotonic()
        recordings = self.findings.recordings()
        rows = self.findings.courses()
        courses, flats = courses_of(rows), flats_of(rows)
        counts, site = self.findings.counts(), self.asked.site.name
        page = index_page(site, recordings[:LATEST], counts, courses, flats, self._others)
        self._write("index.html", page)
        whole = {"site": site, "counts": counts, "others": self._others, "recordings": recordings}
        whole["flats"] = [{"identity": one.identity, **one.growth.to_dict()} for one in flats]
        self._write("index.json", json.dumps(whole, indent=1, ensure_ascii=False) + "\n")
        cells = [
            {name: one[name] for name in ("passed", "name", "answer", "reason")} | _flat(train)
            for one in recordings for train in one["trains"] or [{}]
        ]  # fmt: skip
        self._write("index.csv", _as_csv(cells))
        self._written = time.monotonic()
        self._took = self._written - begun

    def _write(self, name: str, text: str) -> None:
        write_whole(self.places.output / name, printable(text))


def _rows_of(train: Train, names: dict[tuple[int, str | None], str]) -> tuple[list[Any], list[Any]]:
    """Return the rows of a train's wheels and of its alarms for the database."""
    entries = {(n, one["side"]): (axle, one) for n, axle in enumerate(train.finding.axles, 1) for one in axle["wheels"]}
    wheels = []
    for row in train.wheels:
        axle, own = entries[row["axle"], row["side"]]
        wheels.append({
            "axle": row["axle"], "side": row["side"] or "", "vehicle": row["vehicle"],
            "identity": names.get((row["axle"], row["side"])), "speed": axle["speed"],
            "static_force": own["static_force"], "largest_force": own["largest_force"], "strikes": row["strikes"],
            "repeats_after": row["repeats_after"], "finding": row["finding"], **_of_model(own),
        })  # fmt: skip
    alarms = [
        {"axle": one.axle, "side": one.side, "rule": one.rule.name, "level": one.rule.level,
         "quantity": one.rule.quantity, "value": one.value, "limit": one.rule.limit}
        for one in train.finding.alarms
    ]  # fmt: skip
    return wheels, alarms


def _of_model(wheel: dict[str, Any]) -> dict[str, Any]:
    """Return the cells of what a model of a wheel on the track told of it; empty ones without such a model."""
    told, own = what_is_told(wheel), wheel.get("finding", {})
    text = None if told is None else json.dumps(told)
    return {"model": own.get("verdict", told and told["verdict"]), "size": own.get("size"), "told": text}


def _flat(train: dict[str, Any]) -> dict[str, Any]:
    """Return the summary of a train as cells of one row."""
    left_out = ("findings", "notes")
    own = {name: value for name, value in train.items() if name not in left_out}
    return own | {f"wheels: {name}": count for name, count in train.get("findings", {}).items()}


def _as_csv(rows: Sequence[dict[str, Any]]) -> str:
    """Return rows as text with a first line of names; lists are joined."""
    written = io.StringIO()
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = csv.DictWriter(written, names, lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: _cell(one) for name, one in row.items()})
    return written.getvalue()


def _cell(value: Any) -> Any:
    """Return what a table holds: lists joined, and no text that a spreadsheet would take for a formula."""
    text = "; ".join(value) if isinstance(value, list) else value
    return f"'{text}" if isinstance(text, str) and text.startswith(FORMULA) else text


def make_report(asked: Asked, places: Places, workers: int | None, watch: float | None) -> dict[str, int]:
    """Answer the recordings of a folder; return how many have each answer.

    Parameters
    ----------
    asked, places, workers
        As for `Report`.
    watch
        Time between two looks at the folder, s, for ever; None: what is there now. A recording is taken once it has not
        changed between two looks.
    """
    with closing(Report(asked, places, workers)) as making, locked(places.database, "database"):
        if watch is None:
            with progress_shown(True, "recordings"):
                tasks = making.waiting(False)
                report("recordings", 0, len(tasks))
                for done, _ in enumerate(making.answer(tasks), 1):
                    report("recordings", done, len(tasks))
            making.write_index()
            return making.findings.counts()
        while True:
            _look(making)
            time.sleep(watch)


def _look(making: Report) -> None:
    """Answer what is new in the folder; a table that is being written is looked at again the next time."""
    try:
        tasks = making.waiting(True)
    except InputError as error:
        say(f"wheeltapper: {error}; the next look may find it in order")
        return
    for name, answer in making.answer(tasks):
        print(f"{name}: {answer.answer}{': ' if answer.reason else ''}{answer.reason}", flush=True)
    if tasks or not (making.places.output / "index.html").exists():
        making.write_index()
