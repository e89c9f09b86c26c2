"""Arguments of verbs: a wrong one is refused in one line, before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, isfinite
from numbers import Integral
from pathlib import Path
from typing import Any

from wheeltapper.ground.errors import InputError, shown
from wheeltapper.ground.quantities import to_si


def as_path(given: Any, field: str, allowed: str) -> Path:
    """Return a path."""
    if not isinstance(given, str | Path) or not str(given).strip():
        raise InputError("", field, shown(given), allowed)
    return Path(given)


def as_count(given: Any, field: str, least: int = 1, most: int | None = None) -> int:
    """Return a whole number within bounds."""
    whole = isinstance(given, Integral) and not isinstance(given, bool)
    if not whole or not least <= int(given) <= (inf if most is None else most):
        bounds = f"at least {least}" if most is None else f"{least} to {most}"
        raise InputError("", field, shown(given), f"a whole number, {bounds}")
    return int(given)


def as_quantity(given: Any, field: str, dimension: str, *, positive: bool = True) -> float:
    """Return a finite quantity in SI units, positive or at least not negative."""
    number = to_si(given, dimension, field)
    if not isfinite(number):
        raise InputError("", field, shown(given), f"a finite {dimension}")
    if number < 0.0 or (positive and number == 0.0):
        raise InputError("", field, shown(given), "more than 0" if positive else "0 or more")
    return number


def as_list(given: Any, field: str, what: str) -> list[Any]:
    """Return a list; one name stands for a list of it."""
    if isinstance(given, str):
        return [given]
    if isinstance(given, dict) or not isinstance(given, Iterable):
        raise InputError("", field, shown(given), what)
    return list(given)
