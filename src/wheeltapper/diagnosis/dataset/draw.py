"""From what the values of a field of a data set are drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from wheeltapper.ground.errors import InputError, value_text

Spacing = Literal["linear", "log"]
FARTHEST = 4.0
"""Normally distributed values are cut at this number of standard deviations, so that they have a range."""
ALLOWED = 'a list of values, { from = a, to = b, spacing = "log" }, or { mean = a, deviation = b }'


class Draw(NamedTuple):
    """The values that one field may have.

    Attributes
    ----------
    way
        "one of": each of `values` as often as the others. "uniform", and "log uniform" (uniform in the logarithm):
        between two values. "normal": mean and standard deviation, cut at `FARTHEST` deviations.
    values
        In SI units.
    """

    way: Literal["one of", "uniform", "log uniform", "normal"]
    values: tuple[float, ...]

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value."""
        if self.way == "normal":
            mean, deviation = self.values
            return mean - FARTHEST * deviation, mean + FARTHEST * deviation
        return min(self.values), max(self.values)

    def drawn(self, random: np.random.Generator) -> float:
        """Return a value."""
        if self.way == "one of":
            return self.values[int(random.integers(len(self.values)))]
        if self.way == "normal":
            mean, deviation = self.values
            return mean + deviation * float(np.clip(random.standard_normal(), -FARTHEST, FARTHEST))
        low, high = self.values
        share = float(random.uniform())
        return low * (high / low) ** share if self.way == "log uniform" else low + (high - low) * share

    @property
    def words(self) -> str:
        """The same in words, with values in SI units."""
        values = [f"{value:.6g}" for value in self.values]
        if self.way == "one of":
            return "one of " + ", ".join(values)
        if self.way == "normal":
            return f"normal, mean {values[0]}, standard deviation {values[1]}"
        return f"{self.way}, {values[0]} to {values[1]}"


def draw_of(given: Any, path: str, in_si: Callable[[Any], float]) -> Draw:
    """Return the draw that a list or a table describes; `in_si` reads one value of the field.

    Raises
    ------
    InputError
        If it is neither.
    """
    names = set(given) if isinstance(given, Mapping) else set()
    if isinstance(given, list | tuple) and given:
        found = Draw("one of", tuple(in_si(value) for value in given))
    elif {"from", "to"} <= names <= {"from", "to", "spacing"}:
        spacing = given.get("spacing", "linear")
        if spacing not in get_args(Spacing):
            raise InputError("", path, value_text(given), 'spacing "linear" or "log"')
        ends = tuple(in_si(given[name]) for name in ("from", "to"))
        if not ends[0] <= ends[1]:
            raise InputError("", path, value_text(given), "ends in order")
        if spacing == "log" and not ends[0] * ends[1] > 0.0:
            raise InputError("", path, value_text(given), "ends of one sign, not zero, for spacing in logarithms")
        found = Draw("uniform" if spacing == "linear" else "log uniform", ends)
    elif names == {"mean", "deviation"}:
        found = Draw("normal", (in_si(given["mean"]), in_si(given["deviation"])))
        if not found.values[1] >= 0.0:
            raise InputError("", path, value_text(given), "a deviation of 0 or more")
    else:
        raise InputError("", path, value_text(given), ALLOWED)
    if not np.all(np.isfinite(found.values)):
        raise InputError("", path, value_text(given), "finite values")
    return found
