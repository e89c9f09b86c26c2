"""Measuring claims, and reporting the result of each."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from pathlib import Path

from wheeltapper.faces.paper import coach, corrugation, deck, diagnosis, law, maps, missed, plastic, single
from wheeltapper.faces.paper.claims import CLAIMS, Claim
from wheeltapper.ground.errors import InputError, suggested
from wheeltapper.ground.progress import report

TOPICS = (single, maps, deck, missed, corrugation, law, coach, plastic, diagnosis)
"""The modules that register claims; importing them fills the register."""


def chosen(which: list[str]) -> list[Claim]:
    """Return the claims with given numbers or figures, or "all"."""
    found: dict[str, Claim] = {}
    figures = sorted({c.figure for c in CLAIMS.values()})
    for name in which:
        match = {n: c for n, c in CLAIMS.items() if name in ("all", n, c.figure)}
        if not match:
            groups = f"all, a claim ({min(CLAIMS)} to {max(CLAIMS)}), or those of {', '.join(figures)}"
            raise InputError("", "paper", repr(name), suggested(name, ["all", *figures, *CLAIMS], groups))
        found |= match
    return [found[n] for n in sorted(found)]


def run(
    which: list[str],
    output: Path | None = None,
    say: Callable[[str], None] = print,
) -> int:
    """Measure claims; return 0 if all hold and 1 otherwise.

    Parameters
    ----------
    which
        Numbers of claims, names of figures, or "all".
    output
        Folder for `claims.csv` and for the claims' figures.
    say
        Called with each line.
    """
    claims = chosen(which)
    rows = []
    failed: set[str] = set()
    for done, claim in enumerate(claims):
        report("claims", done, len(claims))
        say(f"{claim.number} ({claim.figure}): {claim.sentence}")
        for measure in claim.measure():
            verdict = "PASS" if measure.holds else "FAIL"
            say(f"  {verdict}  {measure.quantity}: {measure.value:.6g}, expected {measure.expected}")
            rows.append((claim.number, claim.figure, measure.quantity, measure.value, measure.expected, verdict))
            if not measure.holds:
                failed.add(claim.number)
    said = f"; failed: {', '.join(sorted(failed))}" if failed else ""
    say(f"{len(claims) - len(failed)} of {len(claims)} claims hold{said}")
    if output is not None:
        for path in _written(claims, rows, output):
            say(f"written: {path}")
    return 1 if failed else 0


def _written(claims: list[Claim], rows: list[tuple[str, str, str, float, str, str]], output: Path) -> Iterator[Path]:
    """Write the table of measures and the figures; yield each file."""
    from wheeltapper.faces.paper.figures import draw

    table = output / "claims.csv"
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("claim", "figure", "quantity", "value", "expected", "verdict"))
        writer.writerows(rows)
    yield table
    for name in sorted({claim.figure for claim in claims}):
        yield draw(name, output)
