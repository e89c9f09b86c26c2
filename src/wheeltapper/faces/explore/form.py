"""The form of a scenario: every field with its meaning, unit, range and value, read from the nouns themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from math import isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from wheeltapper.describe.choice import OneOf
from wheeltapper.describe.manual import field_descriptions
from wheeltapper.describe.noun import Noun
from wheeltapper.describe.paths import held_at
from wheeltapper.describe.placement import Placement
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.scenario import Scenario
from wheeltapper.faces.explore.scenes import start_scene
from wheeltapper.faces.panels import words
from wheeltapper.ground.errors import InputError, with_suggestion
from wheeltapper.ground.quantities import UNITS, si_unit, unit_factor

Entry = dict[str, Any]
SPAN = 10.0
"""A slider of what cannot be negative reaches from a tenth to ten times the value that the form was made for."""
READABLE = {
    "length": ("m", "mm", "µm"), "mass": ("t", "kg"), "force": ("MN", "kN", "N"), "stiffness": ("GN/m", "MN/m", "kN/m"),
    "damping": ("MN s/m", "kN s/m", "N s/m"), "speed": ("m/s", "mm/s"), "time": ("s", "ms", "µs"),
    "pressure": ("GPa", "MPa", "Pa"), "frequency": ("kHz", "Hz"), "angle": ("rad", "mrad"),
    "bending stiffness": ("MN m^2", "kN m^2"), "angular stiffness": ("MN m/rad", "kN m/rad"),
}  # fmt: skip
"""For each dimension the units in which a form may show a number, from the largest on."""
ZERO = {
    "length": 1e-3, "force": 1e4, "stiffness": 1e6, "damping": 1e4, "speed": 1.0, "time": 1e-3, "angle": 1e-3,
    "mass": 1e3, "acceleration": 1.0, "number": 1.0,
}  # fmt: skip
"""How far a slider reaches from a zero, which says nothing of what is usual, in SI units."""
MOST_NUMBERS = 24
"""Longest list of numbers that has a field for each; longer ones are told by their length."""


@dataclass
class Meaning:
    """What a field may hold, read from its annotation."""

    dimension: str | None = None
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    optional: bool = False
    kinds: set[type] = field(default_factory=set)
    words: list[str] = field(default_factory=list)
    families: list[type[Any]] = field(default_factory=list)
    nouns: list[type[Noun]] = field(default_factory=list)
    inside: Meaning | None = None

    @property
    def choices(self) -> list[type[Noun]]:
        """Nouns that may stand there, in the order of their names."""
        of_families = [kind for family in self.families for kind in makeable_nouns(family)]
        return [*of_families, *(kind for kind in self.nouns if kind not in of_families)]


def meaning_of(info: FieldInfo) -> Meaning:
    """Return what a field may hold."""
    found = Meaning()
    _read_extra(info.json_schema_extra, found)
    _read(info.annotation, info.metadata, found)
    return found


def _read_extra(extra: Any, into: Meaning) -> None:
    if isinstance(extra, dict) and "description" in extra:
        dimension = str(extra["description"]).partition(":")[0]
        into.dimension = dimension if dimension in UNITS else into.dimension


def _read(annotation: Any, metadata: Sequence[Any], into: Meaning) -> None:
    for one in metadata:
        if isinstance(one, OneOf):
            into.families.append(one.family)
        elif isinstance(one, FieldInfo):
            _read_extra(one.json_schema_extra, into)
            _read(None, one.metadata, into)
        for name in ("gt", "ge"):
            if isinstance(getattr(one, name, None), int | float):
                into.low, into.open_low = float(getattr(one, name)), name == "gt"
        if isinstance(getattr(one, "le", None), int | float):
            into.high = float(one.le)
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        _read(inside[0], inside[1:], into)
    elif origin in (Union, UnionType):
        for one in inside:
            _read(one, (), into)
    elif origin is Literal:
        into.words += [str(word) for word in inside]
    elif origin is tuple:
        into.inside = into.inside or Meaning()
        for one in inside:
            if one is not ...:
                _read(one, (), into.inside)
        into.kinds.add(tuple)
    elif annotation is NoneType:
        into.optional = True
    elif isinstance(annotation, type):
        into.kinds.add(annotation)
        if issubclass(annotation, Noun) and not into.families:
            into.nouns.append(annotation)


def form_of(scenario: Scenario) -> Entry:
    """Return the form of a scenario as nested tables.

    Each entry has its `kind`: quantity, count, switch, choice, text, noun, list, numbers, or fixed (what a form cannot
    change); the dotted `path` of its field, its name, and what the field's documentation says.
    """
    return _noun_entry(scenario, "", "scene", Meaning(nouns=[Scenario]))


def _noun_entry(noun: Any, path: str, name: str, meaning: Meaning) -> Entry:
    types = [*meaning.words, *(kind.__name__ for kind in meaning.choices if _is_offered(kind, noun))]
    out: Entry = {"kind": "noun", "path": path, "name": name, "types": types, "optional": meaning.optional}
    if not isinstance(noun, Noun):
        return out | {"type": None if noun is None else str(noun), "fields": []}
    said = field_descriptions(type(noun))
    fields = [
        _entry(getattr(noun, held), meaning_of(info), f"{path}.{held}" if path else held, held, said.get(held, ""))
        for held, info in type(noun).model_fields.items()
    ]
    return out | {"type": type(noun).__name__, "fields": fields}


def _entry(value: Any, meaning: Meaning, path: str, name: str, said: str) -> Entry:
    base = {"path": path, "name": name.replace("_", " "), "description": said, "optional": meaning.optional}
    if isinstance(value, Placement):
        items = [
            _noun_entry(item, f"{path}.{where}.{i}", f"{where}, {i + 1}", meaning.inside or Meaning())
            for where, held in value.items() for i, item in enumerate(held)
        ]  # fmt: skip
        return base | {"kind": "list", "items": items, "types": []}
    if meaning.families or meaning.nouns:
        return _noun_entry(value, path, str(base["name"]), meaning) | {"description": said}
    inside = meaning.inside
    if inside is not None and (inside.families or inside.nouns):
        held = value or ()
        items = [_noun_entry(item, f"{path}.{i}", f"{i + 1}", inside) for i, item in enumerate(held)]
        types = [kind.__name__ for kind in inside.choices if _is_offered(kind, None)]
        return base | {"kind": "list", "items": items, "types": types}
    several = isinstance(value, tuple) and 0 < len(value) <= MOST_NUMBERS
    if several and inside is not None and all(isinstance(one, float) for one in value):
        items = [_quantity(one, inside, f"{path}.{i}") | {"name": f"{i + 1}"} for i, one in enumerate(value)]
        return base | {"kind": "numbers", "items": items}
    return base | _plain_entry(value, meaning, path)


def _plain_entry(value: Any, meaning: Meaning, path: str) -> Entry:
    if meaning.words:
        return {"kind": "choice", "options": meaning.words, "value": None if value is None else str(value)}
    if bool in meaning.kinds:
        return {"kind": "switch", "value": bool(value)}
    if float in meaning.kinds and (value is None or isinstance(value, float | int)):
        return _quantity(value, meaning, path)
    if int in meaning.kinds and tuple not in meaning.kinds:
        return {"kind": "count", "value": value, "low": meaning.low, "high": meaning.high}
    if {str, Path} & meaning.kinds and (value is None or isinstance(value, str | Path)):
        return {"kind": "text", "value": None if value is None else str(value)}
    many = isinstance(value, tuple) and len(value) > MOST_NUMBERS
    return {"kind": "fixed", "value": f"{len(value)} values" if many else str(value)}


def _quantity(value: float | None, meaning: Meaning, path: str) -> Entry:
    """Return the entry of a continuous field; its numbers are in SI units, and a shown one is that over `factor`."""
    dimension = meaning.dimension or "number"
    unit, factor = shown_unit(value, dimension)
    out: Entry = {
        "kind": "quantity", "path": path, "words": words(path), "unit": unit, "factor": factor, "value": value,
    }  # fmt: skip
    return out if value is None else out | _range(float(value), meaning, dimension)


def shown_unit(value: float | None, dimension: str) -> tuple[str, float]:
    """Return the unit in which a number of a dimension reads well, and its size in SI units."""
    units = READABLE.get(dimension)
    if units is None:
        return si_unit(dimension), 1.0
    sizes = [(unit, unit_factor(unit, dimension)) for unit in units]
    if not value:
        return min(sizes, key=lambda one: abs(one[1] - 1.0))
    return next(((unit, size) for unit, size in sizes if abs(value) >= 0.0999 * size), sizes[-1])


def _range(value: float, meaning: Meaning, dimension: str) -> Entry:
    """Return from where to where a slider goes, and whether its places are in proportion to the logarithm."""
    low, high = meaning.low, meaning.high
    if low == 0.0 and value > 0.0:
        top = min(SPAN * value, high) if high is not None else SPAN * value
        return {"low": value / SPAN, "high": max(top, value), "log": True}
    reach = 2.0 * abs(value) or ZERO.get(dimension, 1.0)
    bottom, top = (-reach if value <= 0.0 else 0.0), (reach if value >= 0.0 else 0.0)
    bottom = bottom if low is None else max(low, bottom)
    top = top if high is None else min(high, top)
    if not (isfinite(bottom) and isfinite(top) and bottom < top):
        bottom, top = value - 1.0, value + 1.0
    return {"low": bottom, "high": top, "log": False}


def changed(scenario: Scenario, path: str, value: Any) -> Scenario:
    """Return the scenario with one field changed; `value` may name a kind of noun, of which a usual one is made.

    Raises
    ------
    InputError
        With the field, if the scenario cannot be so.
    """
    if not path:
        raise InputError("", "path", "nothing", "the path of a field")
    if isinstance(value, dict) and set(value) == {"type"}:
        _, _, held = held_at(scenario, path)
        value = _usual(str(value["type"]), held)
    return scenario.replaced({path: value})


def added(scenario: Scenario, path: str, kind: str) -> Scenario:
    """Return the scenario with one more noun in a list."""
    _, _, held = held_at(scenario, path)
    if isinstance(held, Placement) or not isinstance(held, tuple):
        raise InputError("", path, "no list to which anything could be added", "a list of irregularities or anomalies")
    return scenario.replaced({path: [*held, _usual(kind, None)]})


def _usual(name: str, before: Any) -> Any:
    """Return a usual noun of a kind, with what it shares with the one that stood there before."""
    from wheeltapper.describe.noun import nouns_by_name

    kinds = nouns_by_name()
    if name not in kinds:
        if isinstance(before, str) or name.islower():
            return name  # a word instead of a noun, such as "equilibrium"
        raise InputError("", "type", repr(name), with_suggestion(name, kinds, "the name of a noun"))
    usual = _usual_fields(kinds[name])
    if isinstance(before, Noun):
        names = [held for held in before.model_fields_set if _is_shared(kinds[name], before, held)]
        shared = {held: getattr(before, held) for held in names}
        try:
            return kinds[name](**(usual or {}) | shared)
        except InputError:  # what it had does not go together with what this one is
            pass
    return kinds[name](**(usual or {}))


def _is_shared(kind: type[Noun], before: Noun, name: str) -> bool:
    theirs = kind.model_fields.get(name)
    if theirs is None:
        return False
    ours = meaning_of(type(before).model_fields[name])
    return ours.dimension == meaning_of(theirs).dimension and ours.kinds == meaning_of(theirs).kinds


@cache
def _usual_fields(kind: type[Noun]) -> dict[str, Any] | None:
    """Return fields that make a usual noun of a kind; None where nothing says what is usual."""
    of_start = start_scene().vehicle
    if isinstance(of_start, kind):
        return {name: getattr(of_start, name) for name in of_start.model_fields_set}
    examples: tuple[dict[str, Any] | None, ...] = (getattr(kind, "example", None), {})
    for fields in examples:
        if fields is not None:
            try:
                kind(**fields)
            except InputError:
                continue
            return dict(fields)
    return None


def _is_offered(kind: type[Noun], held: Any) -> bool:
    """Return True for a kind that can be chosen: one that can be made here, or the one that is there."""
    return type(held) is kind or (_usual_fields(kind) is not None and not _has_function(kind))


@cache
def _has_function(kind: type[Noun]) -> bool:
    fields = _usual_fields(kind) or {}
    return any(callable(value) for value in fields.values())
