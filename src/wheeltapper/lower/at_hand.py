"""Paths of a wheel's centre that were computed a moment ago, for fits that ask for nearly the same passages."""

from __future__ import annotations

from collections.abc import Hashable
from functools import lru_cache
from math import ceil

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import table_of
from wheeltapper.lower.numbers import Method
from wheeltapper.lower.paths.table import PathTable

REACH = 0.25
"""The path of the wheel's centre is computed up to a multiple of this, m. Passages at other speeds, which end a little
earlier or later, then use the same path."""


class _IdentityKey:
    """An object that equals only itself: the file that it names may have changed since an equal object was used."""

    def __init__(self, of: object) -> None:
        self.of = of

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _IdentityKey) and self.of is other.of

    def __hash__(self) -> int:
        return id(self.of)


class _PathKey:
    """A scenario as a key; two of them are equal if the path of the wheel's centre is the same."""

    def __init__(self, scenario: Scenario, end: float, method: Method) -> None:
        self.scenario, self.end, self.method = scenario, REACH * ceil(end / REACH), method
        contact = scenario.contact if getattr(scenario.contact, "follows_curvature", False) else None
        items = tuple(_IdentityKey(item) for item in scenario.irregularities)
        self._key: Hashable = (items, scenario.rolling, scenario.vehicle.radius, contact, self.end, method)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _PathKey) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=8)
def _table(path: _PathKey) -> tuple[PathTable, list[Note]]:
    return table_of(path.scenario, path.end, path.method)


def table_at_hand(scenario: Scenario, end: float, method: Method) -> tuple[PathTable, list[Note]]:
    """Return the path of the wheel's centre to x = end (m) or farther, from the cache if it is the same."""
    return _table(_PathKey(scenario, end, method))
