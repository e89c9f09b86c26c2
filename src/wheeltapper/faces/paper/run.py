"""Measuring claims, and reporting the result of each."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from wheeltapper.faces.paper import coach, corrugation, deck, diagnosis, law, maps, missed, orbits, plastic, single
from wheeltapper.faces.paper.claims import CLAIMS, Claim, Kind, Measure, Verdict, judged
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.ground.progress import report

TOPICS = (single, maps, deck, missed, corrugation, law, coach, plastic, diagnosis, orbits)
"""The modules that register claims; importing them fills the register."""


def chosen_claims(which: list[str]) -> list[Claim]:
    """Return the claims with given numbers or figures, or "all"."""
    found: dict[str, Claim] = {}
    figures = sorted({c.figure for c in CLAIMS.values()})
    for name in which:
        match = {n: c for n, c in CLAIMS.items() if name in ("all", n, c.figure)}
        if not match:
            groups = f"all, a claim ({min(CLAIMS)} to {max(CLAIMS)}), or those of {', '.join(figures)}"
            raise InputError("", "paper", repr(name), with_suggestion(name, ["all", *figures, *CLAIMS], groups))
        found |= match
    return [found[n] for n in sorted(found)]


def measure_claims(
    which: list[str],
    output: Path | None = None,
    say: Callable[[str], None] = print,
) -> int:
    """Measure claims; return 0 if all measures hold and 1 otherwise.

    Parameters
    ----------
    which
        Numbers of claims, names of figures, or "all".
    output
        Folder for `claims.csv` and for the claims' figures.
    say
        Called with each line.
    """
    claims = chosen_claims(which)
    found: list[tuple[Claim, Verdict, list[Measure]]] = []
    for done, claim in enumerate(claims):
        report("claims", done, len(claims))
        measures = list(claim.measure())
        found.append((claim, judged(measures), measures))
        say(_line(claim, found[-1][1]))
        for measure in measures:
            say(f"  {measure}")
    say(summary([verdict for _, verdict, _ in found], [one for *_, measures in found for one in measures]))
    failed = [claim.number for claim, verdict, _ in found if verdict is Verdict.FAILED]
    if failed:
        say(f"failed: {', '.join(failed)}")
    if output is not None:
        for path in _write_results(found, output):
            say(f"written: {path}")
    return 1 if failed else 0


def _line(claim: Claim, verdict: Verdict) -> str:
    """Return a claim's line: its sentence, the verdict, and what limits or contradicts it."""
    but = {Verdict.LIMITED: ": ", Verdict.CONTRADICTED: " by: "}.get(verdict)
    return f"{claim.number} ({claim.figure}): {claim.sentence} – {verdict}{but + claim.but if but else ''}"


def summary(verdicts: list[Verdict], measures: list[Measure]) -> str:
    """Return how many claims have which verdict, and how many measures which source."""
    of_claims, of_measures = Counter(verdicts), Counter(one.source.kind for one in measures)
    said = ", ".join(f"{of_claims[one]} {one}" for one in Verdict if of_claims[one] or one is not Verdict.FAILED)
    sources = ", ".join(f"{of_measures[kind]} {words}" for kind, words in SOURCES.items())
    return f"{len(verdicts)} claims: {said}; of the {len(measures)} measures {sources}"


SOURCES = {
    Kind.PAPER: "are from the paper", Kind.ANALYSIS: "from analysis", Kind.PROGRAM: "from an independent program",
    Kind.PINNED: "pinned",
}  # fmt: skip


def _write_results(found: list[tuple[Claim, Verdict, list[Measure]]], output: Path) -> Iterator[Path]:
    """Write the table of measures and the figures; yield each file."""
    from wheeltapper.faces.paper.figures import draw

    table = output / "claims.csv"
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(
            ("claim", "figure", "verdict", "quantity", "value", "low", "high", "source", "where", "why", "result")
        )
        for claim, verdict, measures in found:
            for one in measures:
                bounds = (one.value, one.low, one.high, one.source.kind, one.source.where, one.why, one.mark)
                writer.writerow((claim.number, claim.figure, verdict, one.quantity, *bounds))
    yield table
    for name in sorted({claim.figure for claim, *_ in found}):
        yield draw(name, output)
