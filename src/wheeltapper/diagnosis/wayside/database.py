"""Findings of passages in an SQLite database: each recording once, whole or not at all, however the process ends.

What belongs to a recording is written in one transaction. A recording is answered if its row has the mark that its
files, site and rules have now; otherwise its old rows are replaced.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from wheeltapper.ground.errors import InputError, brief

FORMAT = 2
"""Version of the tables, kept as `user_version`."""
ADDED = {1: {"wheels": ("model TEXT", "size REAL", "told TEXT")}}
"""Columns that tables of older versions lack, by version; they are added, and are empty for what is there."""
WAITING = 30.0
"""Longest time to wait for another process that writes, s."""
TABLES = """
CREATE TABLE recordings (
    recording INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, mark TEXT NOT NULL, passed TEXT NOT NULL,
    answer TEXT NOT NULL, reason TEXT NOT NULL);
CREATE TABLE trains (
    train INTEGER PRIMARY KEY, recording INTEGER NOT NULL REFERENCES recordings ON DELETE CASCADE,
    number INTEGER NOT NULL, page TEXT NOT NULL, summary TEXT NOT NULL, UNIQUE (recording, number));
CREATE TABLE wheels (
    train INTEGER NOT NULL REFERENCES trains ON DELETE CASCADE, axle INTEGER NOT NULL, side TEXT NOT NULL,
    vehicle INTEGER, identity TEXT, speed REAL, static_force REAL, largest_force REAL, strikes INTEGER NOT NULL,
    repeats_after REAL, finding TEXT NOT NULL, model TEXT, size REAL, told TEXT, PRIMARY KEY (train, axle, side));
CREATE TABLE alarms (
    train INTEGER NOT NULL REFERENCES trains ON DELETE CASCADE, axle INTEGER NOT NULL, side TEXT NOT NULL,
    rule TEXT NOT NULL, level TEXT NOT NULL, quantity TEXT NOT NULL, value REAL NOT NULL, "limit" REAL NOT NULL);
CREATE INDEX wheels_of_identity ON wheels (identity) WHERE identity IS NOT NULL;
CREATE INDEX trains_of_recording ON trains (recording);
CREATE INDEX alarms_of_train ON alarms (train);
"""
"""The tables; forces in N, speeds in m/s, lengths in m, times as text (ISO 8601). `summary` is JSON.

Of wheels that a model of wheel and track tells of, `model` is its verdict, `size` the length of the flat or the
amplitude, and `told` what growth needs (JSON of `wheeltapper.diagnosis.gauges.growth.what_is_told`).
"""
OF_WHEELS = (
    "axle", "side", "vehicle", "identity", "speed", "static_force", "largest_force", "strikes", "repeats_after",
    "finding", "model", "size", "told",
)  # fmt: skip
OF_ALARMS = ("axle", "side", "rule", "level", "quantity", "value", "limit")

OWN = ("recordings", "trains", "wheels", "alarms")
TYPED = {
    "recordings": {"name": "text", "mark": "text", "passed": "text", "answer": "text", "reason": "text"},
    "trains": {"number": "integer", "page": "text", "summary": "text"},
}
"""Columns of which nothing else than these types is written, by table; SQLite takes any."""
TOLD = {"verdict", "alike", "flats", "fresh_flat_found_from"}
"""What `told` of every wheel has."""
BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def _columns_of(held: sqlite3.Connection, table: str) -> list[str]:
    return [row[1] for row in held.execute(f"PRAGMA table_info({table})")]


class Findings:
    """A database of findings; it is created if it does not exist.

    Parameters
    ----------
    path
        Path of the file.
    names_in_summary
        What every summary of a train has.

    Raises
    ------
    InputError
        If the file is no such database, is damaged, or cannot be written.
    """

    def __init__(self, path: Path, names_in_summary: Iterable[str] = ()) -> None:
        self._names_in_summary = frozenset(names_in_summary)
        self.path = path
        with self._checked():
            self._held = sqlite3.connect(path, timeout=WAITING, isolation_level=None)
            self._held.row_factory = sqlite3.Row
            self._held.execute("PRAGMA foreign_keys = ON")
            self._held.execute("PRAGMA journal_mode = WAL")
            self._create_or_check(path)
            self._check_contents()

    @contextmanager
    def _checked(self) -> Iterator[None]:
        """Refuse what cannot be read, or another process holds."""
        try:
            yield
        except sqlite3.Error as error:
            if getattr(error, "sqlite_errorcode", 0) in BUSY:
                found = f"one that another process has held for {WAITING:g} s"
                raise self._refusal(found, "one process at a time") from None
            raise self._refusal(f"a file that is no database of findings ({error})") from None

    def _refusal(self, found: str, allowed: str = "a new or an own file") -> InputError:
        return InputError(str(self.path), "database", found, allowed)

    def _create_or_check(self, path: Path) -> None:
        with self.transaction():
            (version,) = self._held.execute("PRAGMA user_version").fetchone()
            (tables,) = self._held.execute("SELECT count(*) FROM sqlite_master").fetchone()
            if version == FORMAT:
                return
            if version in ADDED:
                for table, columns in ADDED[version].items():
                    for column in columns:
                        self._held.execute(f"ALTER TABLE {table} ADD COLUMN {column}")
                self._held.execute(f"PRAGMA user_version = {FORMAT}")
                return
            if version or tables:
                found = f"a database with the version {version} and {tables} tables and indices"
                raise InputError(str(path), "database", found, f"a new file, or findings of the version {FORMAT}")
            for statement in TABLES.split(";")[:-1]:
                self._held.execute(statement)
            self._held.execute(f"PRAGMA user_version = {FORMAT}")

    def _check_contents(self) -> None:
        """Refuse a database that is damaged, lacks columns, or has rows of what is not there, or no texts."""
        (sound,) = self._held.execute("PRAGMA quick_check(1)").fetchone()
        if sound != "ok":
            raise self._refusal(f"a damaged file ({brief(sound)})")
        with closing(sqlite3.connect(":memory:")) as own:
            own.executescript(TABLES)
            expected = {table: _columns_of(own, table) for table in OWN}
        for table, names in expected.items():
            there = _columns_of(self._held, table)
            lost = [name for name in names if name not in there]
            if lost:
                raise self._refusal(f"a table {table} without {lost[0]}" if there else f"no table {table}")
        loose = self._held.execute("PRAGMA foreign_key_check").fetchone()
        if loose is not None:
            raise self._refusal(f"a row of {loose['table']} without its row of {loose['parent']}")
        for table, columns in TYPED.items():
            wrong = " OR ".join(f"typeof({name}) <> '{kind}'" for name, kind in columns.items())
            row = self._held.execute(f"SELECT {table[:-1]} FROM {table} WHERE {wrong} LIMIT 1").fetchone()
            if row is not None:
                raise self._refusal(f"{table[:-1]} {row[0]} with numbers for texts, or texts for numbers")

    def close(self) -> None:
        """Close the file."""
        self._held.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Write all that is written inside, or nothing."""
        self._held.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._held.execute("ROLLBACK")
            raise
        self._held.execute("COMMIT")

    def marks(self) -> dict[str, tuple[str, list[str]]]:
        """Return the mark of each recording and the pages of its trains, by its name."""
        out: dict[str, tuple[str, list[str]]] = {}
        for name, mark, page in self._held.execute(
            "SELECT name, mark, page FROM recordings LEFT JOIN trains USING (recording)"
        ):
            out.setdefault(name, (mark, []))[1].extend([page] if page else [])
        return out

    def keep_recording(self, name: str, mark: str, passed: str, answer: str, reason: str) -> int:
        """Keep a recording instead of what there is of it; return its number."""
        self._held.execute("DELETE FROM recordings WHERE name = ?", (name,))
        row = self._held.execute(
            "INSERT INTO recordings (name, mark, passed, answer, reason) VALUES (?, ?, ?, ?, ?)",
            (name, mark, passed, answer, reason),
        )
        assert row.lastrowid is not None
        return row.lastrowid

    def keep_train(
        self,
        recording: int,
        number: int,
        page: str,
        summary: Mapping[str, Any],
        wheels: Sequence[Mapping[str, Any]],
        alarms: Sequence[Mapping[str, Any]],
    ) -> None:
        """Keep a train of a recording, with its wheels and alarms (`OF_WHEELS`, `OF_ALARMS`)."""
        row = self._held.execute(
            "INSERT INTO trains (recording, number, page, summary) VALUES (?, ?, ?, ?)",
            (recording, number, page, json.dumps(summary, ensure_ascii=False)),
        )
        for table, names, entries in (("wheels", OF_WHEELS, wheels), ("alarms", OF_ALARMS, alarms)):
            columns = ", ".join(f'"{name}"' for name in names)
            self._held.executemany(
                f"INSERT INTO {table} (train, {columns}) VALUES (?{', ?' * len(names)})",
                [(row.lastrowid, *(entry[name] for name in names)) for entry in entries],
            )

    def recordings(self) -> list[dict[str, Any]]:
        """Return the recordings, the latest passage first: name, passed, answer, reason, and trains.

        Each train has number, page, and what its summary holds.
        """
        with self._checked():
            rows = self._held.execute(
                "SELECT recording, name, passed, answer, reason FROM recordings ORDER BY passed DESC, name"
            )
            found = {row["recording"]: dict(row) | {"trains": []} for row in rows}
            trains = self._held.execute(
                "SELECT train, recording, number, page, summary FROM trains ORDER BY recording, number"
            ).fetchall()
        for row in trains:
            train = {"number": row["number"], "page": row["page"], **self._summary(row["train"], row["summary"])}
            found[row["recording"]]["trains"].append(train)
        return list(found.values())

    def _summary(self, train: int, text: str) -> dict[str, Any]:
        """Return the summary of a train; refuse one without what every summary has."""
        try:
            held = json.loads(text)
        except ValueError:
            held = None
        if not isinstance(held, dict) or not held.keys() >= self._names_in_summary:
            raise self._refusal(f"train {train} without a whole summary")
        return held

    def counts(self) -> dict[str, int]:
        """Return how many recordings have each answer, the most frequent first."""
        rows = self._held.execute("SELECT answer, count(*) AS n FROM recordings GROUP BY answer ORDER BY n DESC")
        return {row["answer"]: row["n"] for row in rows}

    def courses(self, identities: Sequence[str] | None = None, until: str = "9999") -> list[dict[str, Any]]:
        """Return the passages of wheels with an identity till some time, by identity and time; of some wheels, or all.

        Each has passed, name, page, and what `OF_WHEELS` names; `told` is read.
        """
        known = "" if identities is None else " AND identity IN (SELECT value FROM json_each(?))"
        rows = self._held.execute(
            "SELECT recordings.passed, recordings.name, trains.page, wheels.* FROM wheels JOIN trains USING (train) "
            f"JOIN recordings USING (recording) WHERE identity IS NOT NULL AND passed <= ?{known} "
            "ORDER BY identity, passed, recordings.name, number",
            (until,) if identities is None else (until, json.dumps(list(identities))),
        )
        return [dict(row) | {"told": self._told(row)} for row in rows]

    def _told(self, row: sqlite3.Row) -> dict[str, Any] | None:
        """Return what a model has told of a wheel; refuse what is no such thing."""
        if row["told"] is None:
            return None
        try:
            held = json.loads(row["told"])
        except (TypeError, ValueError):
            held = None
        if not isinstance(held, dict) or not held.keys() >= TOLD:
            raise self._refusal(f"a wheel of train {row['train']} without all that a model has told of it")
        return held
