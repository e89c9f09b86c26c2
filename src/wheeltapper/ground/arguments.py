"""Arguments of verbs: a wrong one is refused in one line, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import inf, isfinite
from numbers import Integral
from pathlib import Path
from typing import Any, TypeVar

from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.quantities import to_si

T = TypeVar("T")


def as_path(given: Any, field: str, allowed: str) -> Path:
    """Return a path."""
    if not isinstance(given, str | Path) or not str(given).strip():
        raise InputError("", field, value_text(given), allowed)
    return Path(given)


def as_count(given: Any, field: str, least: int = 1, most: int | None = None) -> int:
    """Return a whole number within bounds."""
    whole = isinstance(given, Integral) and not isinstance(given, bool)
    if not whole or not least <= int(given) <= (inf if most is None else most):
        bounds = f"at least {least}" if most is None else f"{least} to {most}"
        raise InputError("", field, value_text(given), f"a whole number, {bounds}")
    return int(given)


def as_quantity(given: Any, field: str, dimension: str, *, positive: bool = True) -> float:
    """Return a finite quantity in SI units, positive or at least not negative."""
    number = to_si(given, dimension, field)
    if not isfinite(number):
        raise InputError("", field, value_text(given), f"a finite {dimension}")
    if number < 0.0 or (positive and number == 0.0):
        raise InputError("", field, value_text(given), "more than 0" if positive else "0 or more")
    return number


def as_list(given: Any, field: str, what: str) -> list[Any]:
    """Return a list; a single name becomes a list of one."""
    if isinstance(given, str):
        return [given]
    if isinstance(given, Mapping) or not isinstance(given, Iterable) or getattr(given, "ndim", 1) == 0:
        raise InputError("", field, value_text(given), what)
    return list(given)


def as_names(given: Any, field: str, what: str) -> tuple[str, ...]:
    """Return names; a single name becomes a list of one."""
    names = as_list(given, field, what)
    for name in names:
        if not isinstance(name, str):
            raise InputError("", field, value_text(name), what)
    return tuple(names)


def check_text(given: Any, field: str) -> None:
    """Refuse what is no text."""
    if not isinstance(given, str):
        raise InputError("", field, value_text(given), "a text")


def check_flag(given: Any, field: str) -> None:
    """Refuse what is neither true nor false."""
    if not isinstance(given, bool):
        raise InputError("", field, value_text(given), "True or False")


def check_function(given: Any, field: str, what: str) -> None:
    """Refuse what cannot be called."""
    if not callable(given):
        raise InputError("", field, value_text(given), what)


def as_table(given: Any, field: str, what: str) -> dict[str, Any]:
    """Return values by name; an empty table for None."""
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise InputError("", field, value_text(given), what)
    return dict(given)


def as_quantities(given: Any, field: str, dimension: str, what: str) -> list[float]:
    """Return one or more positive quantities in SI units; a single text becomes a list of one."""
    listed = as_list(given, field, what)
    try:
        found = [as_quantity(one, field, dimension) for one in listed]
    except InputError as error:
        raise InputError("", field, value_text(listed), what) from error
    if not found:
        raise InputError("", field, "[]", what)
    return found


def as_bounds(given: Any, field: str, dimension: str) -> tuple[float, float]:
    """Return two positive bounds in SI units, the smaller one first."""
    what = "two positive bounds, the smaller one first"
    bounds = as_quantities(given, field, dimension, what)
    if len(bounds) != 2 or bounds[0] > bounds[1]:
        raise InputError("", field, value_text(given), what)
    return bounds[0], bounds[1]


def as_between(given: Any, field: str, low: float, high: float) -> float:
    """Return a number, or a percentage, that lies between two others."""
    number = to_si(given, "number", field)
    if not low < number < high:
        raise InputError("", field, value_text(given), f"between {low:g} and {high:g}")
    return number


def check_choice(given: Any, field: str, allowed: Iterable[str]) -> None:
    """Refuse a value that is not one of the allowed names."""
    names = list(allowed)
    if not isinstance(given, str) or given not in names:
        raise InputError("", field, value_text(given), with_suggestion(str(given), names, ", ".join(map(repr, names))))


def value_of_each(several: Iterable[Any], field: str, as_one: Callable[[Any], T]) -> list[T]:
    """Return what each of several stands for; of what is none of a kind, the message names the place."""
    out = []
    for i, one in enumerate(several):
        try:
            out.append(as_one(one))
        except InputError as error:
            raise error if error.source else InputError("", f"{field}.{i}", error.found, error.allowed) from None
    return out
