"""Comparisons: each measures by how much this package differs from a figure of somebody else."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from math import isfinite
from typing import Any, Literal, NamedTuple, TypeVar

Kind = Literal["closed form", "another program", "published figures"]
Measure = TypeVar("Measure", bound=Callable[[], tuple[float, ...]])
DATA = files(__package__) / "data"
"""Figures of others, with their sources in README.md there."""


class Comparison(NamedTuple):
    """What is compared with whom.

    Attributes
    ----------
    subject
        What is computed, in some words.
    kind, source
        Whose figures they are, and where they are from.
    allowed
        The largest difference that is allowed of each quantity, by its name; relative unless the name says its unit.
    measure
        Function that returns the largest difference of each of them, in the same order.
    """

    subject: str
    kind: Kind
    source: str
    allowed: Mapping[str, float]
    measure: Callable[[], tuple[float, ...]]


class Compared(NamedTuple):
    """One quantity of a comparison: by how much it differs, and by how much it may."""

    comparison: Comparison
    quantity: str
    difference: float
    allowed: float

    @property
    def agrees(self) -> bool:
        """Whether the difference is allowed."""
        return isfinite(self.difference) and abs(self.difference) <= self.allowed


COMPARISONS: list[Comparison] = []
"""All comparisons, in the order of their pages."""


def compared(subject: str, kind: Kind, source: str, allowed: Mapping[str, float]) -> Callable[[Measure], Measure]:
    """Register a function that measures differences, as a `Comparison` has it."""

    def register(measure: Measure) -> Measure:
        COMPARISONS.append(Comparison(subject, kind, source, allowed, measure))
        return measure

    return register


def measured(one: Comparison) -> list[Compared]:
    """Measure one comparison."""
    both = zip(one.allowed.items(), one.measure(), strict=True)
    return [Compared(one, name, float(difference), limit) for (name, limit), difference in both]


@cache
def table_of(name: str) -> Any:
    """Return the contents of a file of `DATA`: JSON and TOML as they are, CSV as rows by column."""
    text = (DATA / name).read_text(encoding="utf-8")
    if name.endswith(".json"):
        return json.loads(text)
    return tomllib.loads(text) if name.endswith(".toml") else list(csv.DictReader(text.splitlines()))
