"""The register of the paper's claims. Each is measured by a function, and holds or does not hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Measure:
    """One measured quantity of a claim."""

    quantity: str
    value: float
    expected: str
    holds: bool


@dataclass(frozen=True)
class Claim:
    """A claim of the paper: its number, its figure, its sentence, and the function that measures it."""

    number: str
    figure: str
    sentence: str
    measure: Callable[[], Iterator[Measure]]


CLAIMS: dict[str, Claim] = {}
"""The registered claims, by number."""


def claim(
    number: str, figure: str, sentence: str
) -> Callable[[Callable[[], Iterator[Measure]]], Callable[[], Iterator[Measure]]]:
    """Register a function that measures a claim."""

    def register(function: Callable[[], Iterator[Measure]]) -> Callable[[], Iterator[Measure]]:
        CLAIMS[number] = Claim(number, figure, sentence, function)
        return function

    return register


def relative(quantity: str, value: float, expected: float, tolerance: float) -> Measure:
    """Return a measure that holds within a relative tolerance."""
    return Measure(
        quantity, value, f"{expected:g} ± {100 * tolerance:g} %", abs(value - expected) <= tolerance * abs(expected)
    )


def absolute(quantity: str, value: float, expected: float, tolerance: float) -> Measure:
    """Return a measure that holds within an absolute tolerance."""
    return Measure(quantity, value, f"{expected:g} ± {tolerance:g}", abs(value - expected) <= tolerance)


def count(quantity: str, value: float, expected: int, tolerance: int = 0) -> Measure:
    """Return a measure of a count."""
    text = f"{expected} ± {tolerance}" if tolerance else f"exactly {expected}"
    return Measure(quantity, value, text, abs(value - expected) <= tolerance)


def within(quantity: str, value: float, low: float, high: float) -> Measure:
    """Return a measure that holds in an interval."""
    return Measure(quantity, value, f"{low:g} to {high:g}", low <= value <= high)
