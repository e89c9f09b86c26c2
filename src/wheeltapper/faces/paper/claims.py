"""The register of the paper's claims: what is measured, where each bound comes from, and what follows for the claim."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import NamedTuple


class Kind(StrEnum):
    """Where the bounds of a measure come from."""

    PAPER = "the paper"
    ANALYSIS = "analysis"
    PROGRAM = "an independent program"
    PINNED = "pinned"


class Verdict(StrEnum):
    """What the measures say of a claim."""

    CONFIRMED = "confirmed"
    LIMITED = "confirmed within limits"
    FITTED = "fitted"
    CONTRADICTED = "contradicted"
    NOT_STATED = "not stated in the paper"
    UNMEASURED = "not measured"
    FAILED = "failed"


WORDS: dict[str, tuple[float, float]] = {
    "higher": (1.0, inf), "much higher": (2.0, inf), "several times": (3.0, inf), "lower": (0.0, 1.0),
    "about": (0.9, 1.1), "almost identical": (0.9, 1.1), "practically identical": (0.95, 1.05),
    "slightly above": (1.0, 1.1), "as much as": (1.0, inf), "small": (0.0, 0.25), "very small": (0.0, 0.1),
    "practically none": (0.0, 0.01), "not zero": (1e-3, inf), "linearly proportional": (0.99, 1.0),
    "significantly less": (0.0, 0.5), "impossible to attenuate": (0.9, inf), "overlays": (0.0, 0.1),
    "decreases": (0.0, 0.9), "very similar": (0.9, 1.0),
    "sensitive": (0.5, inf), "in most cases": (0.5, 1.0), "almost parallel": (0.0, 15.0), "in phase": (-15.0, 15.0),
    "in antiphase": (165.0, 180.0), "move in phase": (0.8, 1.0), "not in phase": (-0.5, 0.5),
}  # fmt: skip
"""The paper's words as bounds of a ratio, an angle in degrees or a correlation. No value is read off a drawing."""


@dataclass(frozen=True)
class Source:
    """Where the bounds of a measure come from: the kind, and the place, the formula or the program."""

    kind: Kind
    where: str = ""

    def __str__(self) -> str:
        return f"{self.kind}: {self.where}" if self.where else str(self.kind)

    def relative(self, quantity: str, value: float, expected: float, tolerance: float = 1e-3, why: str = "") -> Measure:
        """Return a measure that holds within a relative tolerance."""
        return self.absolute(quantity, value, expected, tolerance * abs(expected), why)

    def absolute(self, quantity: str, value: float, expected: float, tolerance: float, why: str = "") -> Measure:
        """Return a measure that holds within an absolute tolerance."""
        return Measure(quantity, value, expected - tolerance, expected + tolerance, self, why)

    def count(self, quantity: str, value: float, expected: int, tolerance: int = 0, why: str = "") -> Measure:
        """Return a measure of a count."""
        return self.absolute(quantity, value, expected, tolerance, why)

    def within(self, quantity: str, value: float, low: float, high: float, why: str = "") -> Measure:
        """Return a measure that holds in an interval."""
        return Measure(quantity, value, low, high, self, why)


PINNED = Source(Kind.PINNED)
"""The program's own earlier value: it shows a change, and says nothing of the paper."""


def analysis(formula: str) -> Source:
    """Return the source of a bound that a formula gives."""
    return Source(Kind.ANALYSIS, formula)


def program(which: str) -> Source:
    """Return the source of a bound that a program without this one's marches gives."""
    return Source(Kind.PROGRAM, which)


class Case(NamedTuple):
    """A condition in which the words of a claim are measured."""

    name: str = ""
    own: bool = True
    """Whether the paper states it. Where the paper is silent it may have several cases, which are its readings."""


STATED = Case()
"""What the paper states, without a choice."""


@dataclass(frozen=True)
class Measure:
    """One measured quantity of a claim."""

    quantity: str
    value: float
    low: float
    high: float
    source: Source
    why: str = ""
    """Why the bounds are wider than rounding needs."""
    refutes: bool = False
    """Whether the value is known to lie outside the paper's bounds."""
    case: Case = STATED
    fitted: bool = False
    """Whether a parameter was chosen so that the value lies in the bounds."""

    @property
    def inside(self) -> bool:
        """Whether the value lies in the bounds."""
        return self.low <= self.value <= self.high

    @property
    def holds(self) -> bool:
        """Whether the value lies in the bounds, or is known to lie outside the paper's."""
        return self.inside or self.refutes

    @property
    def expected(self) -> str:
        """The bounds in words."""
        if self.low == self.high:
            return f"exactly {self.low:g}"
        if self.high == inf:
            return f"at least {self.low:g}"
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        close = half <= 0.02 * abs(middle)
        return f"{middle:.6g} ± {half:.2g}" if close else f"{self.low:.6g} to {self.high:.6g}"

    @property
    def mark(self) -> str:
        """PASS, REFUTES where the value is known to contradict the paper, AGREES where it no longer does, or FAIL."""
        if self.refutes:
            return "AGREES" if self.inside else "REFUTES"
        return "PASS" if self.inside else "FAIL"

    def __str__(self) -> str:
        why = f" ({self.why})" if self.why else ""
        where = f" [{self.case.name}]" if self.case.name else ""
        return f"{self.mark}  {self.quantity}{where}: {self.value:.6g}, expected {self.expected}{why}; {self.source}"


def said(
    words: str, where: str, quantity: str, value: float, refutes: bool = False, case: Case = STATED,
    fitted: bool = False,
) -> Measure:  # fmt: skip
    """Return a measure of the paper's own words; `refutes` where the value is known to contradict them."""
    source = Source(Kind.PAPER, f"{where}, “{words}”")
    return Measure(quantity, value, *WORDS[words], source, refutes=refutes, case=case, fitted=fitted)


def printed(where: str, quantity: str, value: float, low: float, high: float, case: Case = STATED) -> Measure:
    """Return a measure of a range that the paper prints."""
    return Measure(quantity, value, low, high, Source(Kind.PAPER, where), case=case)


@dataclass(frozen=True)
class Claim:
    """A claim of the paper: its number, its figure, its sentence, the function that measures it, and what limits it."""

    number: str
    figure: str
    sentence: str
    measure: Callable[[], Iterator[Measure]]
    but: str = ""
    """The limits within which it is confirmed, what contradicts it, what was fitted, or why it is not measured."""
    section: int = 0
    """Section of the paper, where no measure of its words says it."""

    @property
    def measured(self) -> bool:
        """Whether anything measures it; those have a figure."""
        return bool(self.figure)


CLAIMS: dict[str, Claim] = {}
"""The registered claims, by number."""


def claim(
    number: str, figure: str, sentence: str, but: str = "", section: int = 0
) -> Callable[[Callable[[], Iterator[Measure]]], Callable[[], Iterator[Measure]]]:
    """Register a function that measures a claim."""

    def register(function: Callable[[], Iterator[Measure]]) -> Callable[[], Iterator[Measure]]:
        CLAIMS[number] = Claim(number, figure, sentence, function, but, section)
        return function

    return register


def statement(number: str, section: int, sentence: str, why_not: str) -> None:
    """Register a statement of the paper that nothing measures."""
    CLAIMS[number] = Claim(number, "", sentence, lambda: iter(()), why_not, section)


def judged(measures: Iterable[Measure]) -> Verdict:
    """Return what the measures say of their claim.

    Measures of the paper's words decide. A claim is contradicted unless some reading of the paper's own condition meets
    all its words; it is confirmed if all values lie in their bounds, also in other conditions, and confirmed within
    limits otherwise. Where a parameter was chosen by the words it is fitted. It has failed where one does not hold.
    """
    found = list(measures)
    if not found:
        return Verdict.UNMEASURED
    if not all(one.holds for one in found):
        return Verdict.FAILED
    words = [one for one in found if one.source.kind is Kind.PAPER]
    if not words:
        return Verdict.NOT_STATED
    own = [one for one in words if one.case.own]
    readings = {one.case for one in own} - {STATED} or {STATED}
    if not any(all(one.inside for one in own if one.case in (STATED, reading)) for reading in readings):
        return Verdict.CONTRADICTED
    if any(one.fitted for one in own):
        return Verdict.FITTED
    return Verdict.CONFIRMED if all(one.inside for one in words) else Verdict.LIMITED


class Found(NamedTuple):
    """What was found of a claim."""

    claim: Claim
    measures: list[Measure]

    @property
    def verdict(self) -> Verdict:
        """What the measures say."""
        return judged(self.measures)

    @property
    def section(self) -> int:
        """The section of the paper in which the claim stands."""
        return int(self.words[0].source.where.removeprefix("section ")[0]) if self.words else self.claim.section

    @property
    def words(self) -> list[Measure]:
        """The measures of the paper's words."""
        return [one for one in self.measures if one.source.kind is Kind.PAPER]


def by_figure(found: Iterable[Found]) -> dict[str, list[Found]]:
    """Return what was found of measured claims, by their figures."""
    groups: dict[str, list[Found]] = {}
    for one in found:
        if one.claim.measured:
            groups.setdefault(one.claim.figure, []).append(one)
    return dict(sorted(groups.items()))
