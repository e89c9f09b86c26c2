"""Measuring claims on all cores, keeping what is measured, and reporting the result of each."""

from __future__ import annotations

import csv
import hashlib
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

from wheeltapper.diagnosis.processes import Lost, ProcessError, in_processes
from wheeltapper.faces.exits import write_whole
from wheeltapper.faces.paper import (
    coach_steps,
    coach_waves,
    corrugation,
    deck,
    diagnosis,
    law,
    maps,
    missed,
    orbits,
    plastic,
    single,
    unmeasured,
)
from wheeltapper.faces.paper.claims import CLAIMS, Case, Claim, Found, Kind, Measure, Source, Verdict, by_figure
from wheeltapper.faces.paper.page import page_text, summary
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.ground.progress import report
from wheeltapper.ground.warned import ModelWarning

TOPICS = (
    single, maps, deck, missed, corrugation, law, coach_steps, coach_waves, plastic, diagnosis, orbits, unmeasured,
)  # fmt: skip
"""The modules that register claims; importing them fills the register."""
TABLE = "claims.csv"
COLUMNS = (
    "claim", "figure", "verdict", "case", "stated", "quantity", "value", "low", "high", "source", "where", "why",
    "fitted", "result", "program",
)  # fmt: skip
FEW = 2
"""Up to so many claims or figures other processes are not worth their start."""


def chosen_claims(which: list[str]) -> list[Claim]:
    """Return the claims with given numbers or figures, or "all"."""
    found: dict[str, Claim] = {}
    figures = sorted({c.figure for c in CLAIMS.values() if c.figure})
    for name in which:
        match = {n: c for n, c in CLAIMS.items() if name in ("all", n, c.figure)}
        if not match:
            groups = f"all, a claim ({min(CLAIMS)} to {max(CLAIMS)}), or those of {', '.join(figures)}"
            raise InputError("", "paper", repr(name), with_suggestion(name, ["all", *figures, *CLAIMS], groups))
        found |= match
    return [found[n] for n in sorted(found)]


def measure_claims(
    which: list[str], output: Path | None = None, page: Path | None = None, say: Callable[[str], None] = print
) -> int:  # fmt: skip
    """Measure claims; return 0 if all measures hold and 1 otherwise.

    Parameters
    ----------
    which
        Numbers of claims, names of figures, or "all".
    output
        Folder for `claims.csv`, which grows by each claim that is measured, and for the claims' figures. What is there
        from the same program is not measured or drawn again.
    page
        File for a page of the documentation with the claims.
    say
        Called with each line.
    """
    claims = chosen_claims(which)
    kept = {} if output is None else _kept_measures(output / TABLE)
    if output is not None and not (output / TABLE).exists():
        _write_table(kept, output / TABLE)
    told: list[Found] = []
    ready = {claim.number: kept.get(claim.number, []) for claim in claims if claim.number in kept or not claim.measured}
    for number, measures in _measured([claim.number for claim in claims if claim.number not in ready]):
        ready[number] = kept[number] = measures
        if output is not None:
            _write_table(kept, output / TABLE)
        while len(told) < len(claims) and (claim := claims[len(told)]).number in ready:
            told.append(Found(claim, ready[claim.number]))
            _tell(told[-1], say)
    for claim in claims[len(told) :]:
        told.append(Found(claim, ready[claim.number]))
        _tell(told[-1], say)
    say(summary(told))
    failed = [one.claim.number for one in told if one.verdict is Verdict.FAILED]
    if failed:
        say(f"failed: {', '.join(failed)}")
    if output is not None:
        say(f"written: {output / TABLE}")
        for path in _drawn(told, output):
            say(f"written: {path}")
    if page is not None:
        write_whole(page, page_text(told))
        say(f"written: {page}")
    return 1 if failed else 0


def _measured(numbers: list[str]) -> Iterator[tuple[str, list[Measure]]]:
    """Yield numbers of claims with their measures, in the order in which they are ready."""
    for done, (task, measures) in enumerate(each_task(_measure, None, numbers)):
        yield numbers[task], measures
        report("claims", done + 1, len(numbers))


def _measure(_: None, number: str) -> list[Measure]:
    """Return the measures of a claim."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)  # the point follower of the paper, on purpose
        return list(CLAIMS[number].measure())


def each_task(function: Callable[[Any, Any], Any], shared: Any, tasks: list[str]) -> Iterator[tuple[int, Any]]:
    """Yield number and result of each task, from other processes if there are many."""
    workers = min(os.cpu_count() or 1, len(tasks))
    if len(tasks) <= FEW or workers < 2:
        yield from ((number, function(shared, task)) for number, task in enumerate(tasks))
        return
    with closing(in_processes(function, shared, tasks, workers)) as results:
        for number, result in results:
            if isinstance(result, Lost):
                raise ProcessError(f"{tasks[number]}: {result}")
            yield number, result


def _drawn(found: list[Found], folder: Path) -> Iterator[Path]:
    """Draw the figures of claims that are older than the table of measures; yield each file."""
    from wheeltapper.faces.paper.figures import draw_in

    figures = by_figure(found)
    measured = (folder / TABLE).stat().st_mtime_ns
    paths = {name: folder / f"{name}.png" for name in figures}
    old = [name for name, path in paths.items() if not path.exists() or path.stat().st_mtime_ns < measured]
    for done, _ in enumerate(each_task(draw_in, (folder, figures), old)):
        report("figures", done + 1, len(old))
    yield from paths.values()


def _tell(found: Found, say: Callable[[str], None]) -> None:
    """Say a claim's line: its sentence, the verdict, and what limits or contradicts it; and its measures."""
    claim, verdict = found.claim, found.verdict
    but = {Verdict.CONTRADICTED: " by: "}.get(verdict, ": ") + claim.but if claim.but else ""
    figure = f" ({claim.figure})" if claim.figure else ""
    say(f"{claim.number}{figure}: {claim.sentence} – {verdict}{but}")
    for measure in found.measures:
        say(f"  {measure}")


# -- the table, from which a later call goes on -----------------------------------------------------------------------


@cache
def program_digest() -> str:
    """Return a digest of the package's sources, which change more often than its version."""
    root, digest = Path(__file__).resolve().parents[2], hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        digest.update(file.relative_to(root).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()[:16]


def _write_table(found: dict[str, list[Measure]], path: Path) -> None:
    """Write all measures, in the place of the file that may be there."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for number in sorted(found):
        one = Found(CLAIMS[number], found[number])
        for m in one.measures:
            writer.writerow(
                (number, one.claim.figure, one.verdict, m.case.name, int(m.case.own), m.quantity, m.value, m.low,
                 m.high, m.source.kind, m.source.where, m.why, int(m.fitted), m.mark, program_digest())
            )  # fmt: skip
    write_whole(path, text.getvalue())


def _kept_measures(path: Path) -> dict[str, list[Measure]]:
    """Return the measures that a table has from this program, by claim; none of a table of another form."""
    if not path.exists():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found: dict[str, list[Measure]] = {}
    for row in rows:
        if row.get("program") == program_digest():
            found.setdefault(row["claim"], []).append(
                Measure(
                    row["quantity"], float(row["value"]), float(row["low"]), float(row["high"]),
                    Source(Kind(row["source"]), row["where"]), row["why"], row["result"] in ("REFUTES", "AGREES"),
                    Case(row["case"], row["stated"] == "1"), row["fitted"] == "1",
                )
            )  # fmt: skip
    return found
