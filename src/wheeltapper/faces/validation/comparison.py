"""Comparisons: each measures by how much this package differs from a figure of somebody else."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from math import isfinite
from typing import Any, Literal, NamedTuple

Kind = Literal["closed form", "another program", "published figures"]
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
    measure
        Function that returns the largest difference of each quantity, by its name; relative unless the name says its
        unit.
    allowed
        The largest differences that are allowed, by the same names.
    """

    subject: str
    kind: Kind
    source: str
    measure: Callable[[], Mapping[str, float]]
    allowed: Mapping[str, float]


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


def compared(subject: str, kind: Kind, source: str, **allowed: float) -> Callable[[Any], Any]:
    """Register a function that measures differences; underscores in the names of quantities stand for blanks."""

    def register(measure: Callable[[], tuple[float, ...]]) -> Callable[[], tuple[float, ...]]:
        names = [name.replace("_", " ") for name in allowed]

        def measured() -> dict[str, float]:
            return dict(zip(names, map(float, measure()), strict=True))

        limits = dict(zip(names, allowed.values(), strict=True))
        COMPARISONS.append(Comparison(subject, kind, source, measured, limits))
        return measure

    return register


def measured(comparison: Comparison) -> list[Compared]:
    """Measure one comparison."""
    found = comparison.measure()
    return [Compared(comparison, name, found[name], limit) for name, limit in comparison.allowed.items()]


@cache
def table_of(name: str) -> Any:
    """Return the contents of a file of `DATA`: JSON and TOML as they are, CSV as rows by column."""
    text = (DATA / name).read_text(encoding="utf-8")
    if name.endswith(".json"):
        return json.loads(text)
    return tomllib.loads(text) if name.endswith(".toml") else list(csv.DictReader(text.splitlines()))
