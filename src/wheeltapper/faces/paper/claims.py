"""The register of the paper's claims: what is measured, where each bound comes from, and what follows for the claim."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import inf


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
    CONTRADICTED = "contradicted"
    NOT_STATED = "not stated in the paper"
    FAILED = "failed"


WORDS: dict[str, tuple[float, float]] = {
    "higher": (1.0, inf), "much higher": (2.0, inf), "several times": (3.0, inf), "lower": (0.0, 1.0),
    "about": (0.9, 1.1), "almost identical": (0.9, 1.1), "practically identical": (0.95, 1.05),
    "slightly above": (1.0, 1.1), "as much as": (1.0, inf), "small": (0.0, 0.25), "very small": (0.0, 0.1),
    "practically none": (0.0, 0.01), "not zero": (1e-3, inf), "linearly proportional": (0.99, 1.0),
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

    @property
    def inside(self) -> bool:
        """Whether the value lies in the bounds."""
        return self.low <= self.value <= self.high

    @property
    def holds(self) -> bool:
        """Whether the value lies where it is known to lie."""
        return self.inside != self.refutes

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
        """PASS, REFUTES where the value is known to contradict the paper, or FAIL."""
        return ("REFUTES" if self.refutes else "PASS") if self.holds else "FAIL"

    def __str__(self) -> str:
        why = f" ({self.why})" if self.why else ""
        return f"{self.mark}  {self.quantity}: {self.value:.6g}, expected {self.expected}{why}; {self.source}"


def said(words: str, where: str, quantity: str, value: float, refutes: bool = False) -> Measure:
    """Return a measure of the paper's own words; `refutes` where the value is known to contradict them."""
    return Measure(quantity, value, *WORDS[words], Source(Kind.PAPER, f"{where}, “{words}”"), refutes=refutes)


def printed(where: str, quantity: str, value: float, low: float, high: float) -> Measure:
    """Return a measure of a range that the paper prints."""
    return Source(Kind.PAPER, where).within(quantity, value, low, high)


@dataclass(frozen=True)
class Claim:
    """A claim of the paper: its number, its figure, its sentence, the function that measures it, and what limits it."""

    number: str
    figure: str
    sentence: str
    measure: Callable[[], Iterator[Measure]]
    but: str = ""
    """The limits within which it is confirmed, or what contradicts it."""


CLAIMS: dict[str, Claim] = {}
"""The registered claims, by number."""


def claim(
    number: str, figure: str, sentence: str, but: str = ""
) -> Callable[[Callable[[], Iterator[Measure]]], Callable[[], Iterator[Measure]]]:
    """Register a function that measures a claim."""

    def register(function: Callable[[], Iterator[Measure]]) -> Callable[[], Iterator[Measure]]:
        CLAIMS[number] = Claim(number, figure, sentence, function, but)
        return function

    return register


def judged(measures: Iterable[Measure]) -> Verdict:
    """Return what the measures say of their claim.

    Measures of the paper's words decide: it is confirmed if all values lie in their bounds, contradicted if none does,
    and confirmed within limits otherwise. It has failed where any measure does not hold.
    """
    found = list(measures)
    if not all(one.holds for one in found):
        return Verdict.FAILED
    inside = [one.inside for one in found if one.source.kind is Kind.PAPER]
    if not inside:
        return Verdict.NOT_STATED
    return Verdict.CONFIRMED if all(inside) else Verdict.LIMITED if any(inside) else Verdict.CONTRADICTED
