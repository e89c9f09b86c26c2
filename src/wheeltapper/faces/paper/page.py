"""What is said of claims together: how many have which verdict, and the page of the documentation."""

from __future__ import annotations

from collections import Counter

from wheeltapper.faces.paper.claims import Found, Kind, Measure, Verdict, by_figure

SECTIONS = {
    1: "Section 1: aims", 2: "Section 2: modelling", 3: "Section 3: properties of the core model",
    4: "Section 4: single irregularities", 5: "Section 5: corrugation", 6: "Section 6: conclusions",
}  # fmt: skip
HEAD = """The paper, sentence by sentence
===============================

What the paper says, in our words, and what is found of it. ``wheeltapper paper all --page docs/paper.rst``
writes this page; ``wheeltapper paper C28b`` repeats a claim with all its measures, and with ``--output FOLDER`` it
draws the figure. How claims are judged, and how the paper is read where it is silent: sections 1.7 and 1.8 of
:doc:`theory/motion`. A value stands with the bounds of the paper's word; those outside are refuted. Where a claim is
measured in several conditions each has a line; conditions that the paper does not state are *beside it*, and only limit
a claim.

The level of the contact zones' damping, 0.1 s/m, has no published source: it was found by search, so that most
sentences on Figs 4 to 7 and 9 hold. What needs it, and what holds without, stands with each claim.
"""


ALWAYS = (Verdict.CONFIRMED, Verdict.LIMITED, Verdict.CONTRADICTED)
"""Verdicts that are counted also where no claim has them."""
SOURCES = {
    Kind.PAPER: "are from the paper", Kind.ANALYSIS: "from analysis", Kind.PROGRAM: "from an independent program",
    Kind.PINNED: "only pin this program's own numbers",
}  # fmt: skip
FIGURES = "/paper"
"""Folder of the pictures within the documentation, which its build draws."""


def summary(found: list[Found]) -> str:
    """Return how many claims have which verdict, and how many measures which source; how many refute."""
    of_claims = Counter(one.verdict for one in found)
    measures = [measure for one in found for measure in one.measures]
    of_measures = Counter(one.source.kind for one in measures)
    said = ", ".join(f"{of_claims[one]} {one}" for one in Verdict if of_claims[one] or one in ALWAYS)
    refuting = sum(one.mark == "REFUTES" for one in measures)
    sources = ", ".join(f"{of_measures[kind]} {words}" for kind, words in SOURCES.items())
    refuted = f"{refuting} of those from the paper refute"
    return f"{len(found)} claims: {said}; of the {len(measures)} measures {sources}; {refuted}"


def page_text(found: list[Found]) -> str:
    """Return the page's text."""
    parts = [HEAD, f"{summary(found)}.\n"]
    for section, title in SECTIONS.items():
        own = [entry(one) for one in found if one.section == section]
        parts += [title, "-" * len(title), "", *own] if own else []
    figures = by_figure(found)
    parts += ["Figures", "-------", ""] if figures else []
    for name, ones in figures.items():
        numbers = ", ".join(one.claim.number for one in ones)
        parts += [f".. figure:: {FIGURES}/{name}.png", "   :width: 100%", "", f"   ``{name}``: {numbers}", ""]
    return "\n".join(parts)


def entry(found: Found) -> str:
    """Return the lines on a claim."""
    claim, verdict = found.claim, found.verdict
    figure = f" (``{claim.figure}``)" if claim.figure else ""
    but = f": {claim.but}" if claim.but else ""
    lines = [
        f"**{claim.number}**{figure} {_first_upper(claim.sentence)}.",
        "",
        f"  *{_first_upper(verdict)}*{but}.",
        "",
    ]
    for case in dict.fromkeys(one.case for one in found.words):
        beside, name = "" if case.own else "*beside it*, ", f"{case.name}: " if case.name else ""
        values = "; ".join(_value(one) for one in found.words if one.case == case)
        lines.append(f"  * {beside}{name}{values}.")
    if verdict is Verdict.NOT_STATED:
        lines.append(f"  * {'; '.join(_plain(one) for one in found.measures)}.")
    return "\n".join(lines).rstrip().replace("|", "\\|") + "\n"


def _value(one: Measure) -> str:
    return f"{_plain(one)}{'' if one.inside else ', refuted'} ({one.expected})"


def _plain(one: Measure) -> str:
    return f"{one.quantity}: {one.value:.3g}".replace("*", "\\*")


def _first_upper(text: str) -> str:
    return text[:1].upper() + text[1:]
