"""Measuring claims and saying how each came out."""

from __future__ import annotations

from collections.abc import Callable

from wheeltapper.faces.paper import corrugation, deck, law, missed, single
from wheeltapper.faces.paper.claims import CLAIMS, Claim
from wheeltapper.ground.errors import InputError

TOPICS = (single, deck, missed, corrugation, law)
"""The modules that register claims; importing them fills the register."""


def chosen(which: list[str]) -> list[Claim]:
    """Return the claims that numbers, figures or "all" name."""
    found: dict[str, Claim] = {}
    figures = sorted({c.figure for c in CLAIMS.values()})
    for name in which:
        match = {n: c for n, c in CLAIMS.items() if name in ("all", n, c.figure)}
        if not match:
            raise InputError("", "paper", repr(name), ", ".join(["all", *figures, *sorted(CLAIMS)]))
        found |= match
    return [found[n] for n in sorted(found)]


def run(which: list[str], say: Callable[[str], None] = print) -> int:
    """Measure claims; return 0 if all hold and 1 otherwise."""
    failed = []
    claims = chosen(which)
    for claim in claims:
        say(f"{claim.number} ({claim.figure}): {claim.sentence}")
        for measure in claim.measure():
            verdict = "PASS" if measure.holds else "FAIL"
            say(f"  {verdict}  {measure.quantity}: {measure.value:.6g}, expected {measure.expected}")
            if not measure.holds and claim.number not in failed:
                failed.append(claim.number)
    say(
        f"{len(claims) - len(failed)} of {len(claims)} claims hold"
        + (f"; failed: {', '.join(failed)}" if failed else "")
    )
    return 1 if failed else 0
