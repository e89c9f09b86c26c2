"""Dated limits of railways and standards as data: what each limits, its figure, its document."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from datetime import date
from functools import cache
from importlib.resources import files
from math import inf, isfinite
from pathlib import Path
from typing import Any

from wheeltapper.describe.scenario import toml_table
from wheeltapper.ground.arguments import as_list, as_names, as_path
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.notes import Note
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.plausible import Usual, is_plausible, range_note

VERIFY = "verify current edition"
"""What every rule says by default of itself: its figure is a copy of a document that changes."""
QUANTITIES = {
    "peak_force": "force", "dynamic_ratio": "number", "dynamic_increment": "number", "derailment_quotient": "number",
    "sum_of_guiding_forces": "force", "flat_length": "length", "out_of_roundness": "length", "static_force": "force",
    "left_right_ratio": "number", "front_rear_ratio": "number", "speed": "speed",
}  # fmt: skip
"""What a rule can limit, and the dimension of its limit ("number": a ratio)."""
LATERAL = ("derailment_quotient", "sum_of_guiding_forces")
"""Quantities that need lateral forces."""
OF_FAULTS = ("flat_length", "out_of_roundness")
"""Quantities that the size of a fault gives."""
OF_LOADS = ("static_force", "left_right_ratio", "front_rear_ratio")
"""Quantities that static forces give: the ratios are those of the heavier side or end to the lighter one."""
PER = {
    "static_force": ("wheel", "axle", "vehicle"), "left_right_ratio": ("axle", "vehicle"),
    "front_rear_ratio": ("vehicle",), "speed": ("train",),
}  # fmt: skip
"""Whose quantity a rule may limit, the usual first; for all others `OTHERWISE`."""
OTHERWISE = ("wheel", "axle")
CHOICES = {
    "quantity": tuple(QUANTITIES), "when": ("exceeded", "reached"), "level": ("warning", "maintain", "stop"),
}  # fmt: skip
"""The values that each of these fields of a rule may have; any other value is refused."""
COUNTRIES = 'names of countries, as ("SE", "EU")'
MEASURES = {
    "diameter_above": "length", "diameter_up_to": "length", "speed_above": "speed", "speed_up_to": "speed",
    "low_pass": "frequency", "sliding_mean": "length", "plus_static": "number",
}  # fmt: skip
"""Fields of a rule that hold a positive quantity, and the dimension of each."""
USUAL = {
    "peak_force": Usual("force", "kN", (40, 1000), 1, 1e5), "dynamic_ratio": Usual("number", "", (1.1, 8), 0.1, 50),
    "dynamic_increment": Usual("number", "", (0.1, 8), 0.01, 50),
    "derailment_quotient": Usual("number", "", (0.5, 1.5), 0.05, 10),
    "sum_of_guiding_forces": Usual("force", "kN", (5, 150), 0.1, 1e4),
    "flat_length": Usual("length", "mm", (10, 150), 0.5, 500),
    "out_of_roundness": Usual("length", "mm", (0.05, 3), 0.0, 20),
    "static_force": Usual("force", "kN", (20, 4000), 1, 1e5), "left_right_ratio": Usual("number", "", (1.02, 5), 1, 20),
    "front_rear_ratio": Usual("number", "", (1.02, 10), 1, 50),
    "speed": Usual("speed", "km/h", (5, 360), 0.5, 720, ((364, 720, ""),)),
}  # fmt: skip
"""Usual limits of each quantity: those of the package's rules (`rules.toml`), with room."""
USUAL_MEASURES = {
    "diameter_above": Usual("length", "m", (0.3, 1.3), 0.03, 3),
    "speed_above": Usual("speed", "km/h", (5, 360), 0.5, 720, ((364, 720, ""),)),
    "low_pass": Usual("frequency", "Hz", (5, 2000), 0.5, 1e5),
    "sliding_mean": Usual("length", "m", (0.1, 100), 0.01, 1e4),
    "plus_static": Usual("number", "", (0.1, 3), 0.01, 10),
}  # fmt: skip


@dataclass(frozen=True)
class Rule(Shown):
    """One limit from one document; quantities may be texts with a unit, as "350 kN".

    Attributes
    ----------
    name, body, country
        Name of the rule here, the body that states it, and the countries in which it is in use.
    quantity
        What is limited, such as "peak_force": a key of `QUANTITIES`.
    limit
        The limit, N, m, m/s or a plain number.
    level
        "warning", "maintain" or "stop".
    edition, date
        Edition and date of the document, in words and as year-month-day ("" if unknown).
    source
        The document's number and title.
    basis
        Source of the figure here, and how certain it is.
    per
        To what the quantity belongs: "wheel" or "axle"; static forces also to "vehicle". By default the first of `PER`.
    when
        "exceeded" or "reached": whether the limit itself already counts.
    diameter_above, diameter_up_to
        Diameters of the wheels to which the rule applies, m.
    speed_above, speed_up_to
        Speeds at which it applies, m/s.
    low_pass
        Cut-off of the low-pass, Hz: the limit applies to the forces below this frequency. Infinite: it applies to the
        forces at all frequencies.
    sliding_mean
        Distance over which the forces are then averaged, m; 0: no mean.
    plus_static, at_most
        The allowed value grows with the static force: limit + plus_static·static, up to `at_most`.
    applies
        Other conditions, in words.
    verify
        What to do before relying on the rule.
    """

    name: str
    quantity: str
    limit: float
    level: str
    body: str = ""
    country: str = ""
    edition: str = ""
    date: str = ""
    source: str = ""
    basis: str = ""
    per: str = ""
    when: str = "exceeded"
    diameter_above: float = 0.0
    diameter_up_to: float = inf
    speed_above: float = -inf
    speed_up_to: float = inf
    low_pass: float = inf
    sliding_mean: float = 0.0
    plus_static: float = 0.0
    at_most: float = inf
    applies: str = ""
    verify: str = VERIFY

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            given = getattr(self, name)
            if given not in choices:
                raise InputError("", name, value_text(given), with_suggestion(str(given), choices))
        allowed = PER.get(self.quantity, OTHERWISE)
        if not self.per:
            object.__setattr__(self, "per", allowed[0])
        elif self.per not in allowed:
            found = f"{value_text(self.per)} of {self.quantity}"
            raise InputError("", "per", found, with_suggestion(str(self.per), allowed))
        dimension = QUANTITIES[self.quantity]
        numbers = {"limit": dimension, "at_most": dimension} | MEASURES
        for field in fields(self):
            given = getattr(self, field.name)
            if field.name not in numbers:
                if not isinstance(given, str):
                    raise InputError("", field.name, value_text(given), "a date" if field.name == "date" else "a text")
            elif given != field.default:
                object.__setattr__(self, field.name, _positive_number(given, numbers[field.name], field.name))
        given = next((name for name in ("low_pass", "sliding_mean") if getattr(self, name) != _DEFAULTS[name]), None)
        if given is not None and not self.is_of_forces:
            found = f"{getattr(self, given):g}, of {self.quantity}"
            raise InputError("", given, found, "no filter, as it is no force that changes along the way")

    @property
    def is_of_forces(self) -> bool:
        """Whether the rule limits forces that change along the way, or their ratios."""
        return self.quantity not in (*OF_FAULTS, *OF_LOADS, "speed")

    @property
    def asks(self) -> str:
        """What is limited, in words: the quantity, to what it belongs, its frequency band and its mean."""
        text = f"{self.quantity.replace('_', ' ')} per {self.per}"
        text += f" below {self.low_pass:g} Hz" if isfinite(self.low_pass) else ""
        return text + (f", mean over {self.sliding_mean:g} m" if self.sliding_mean else "")

    @property
    def limit_text(self) -> str:
        """The limit as text."""
        if self.plus_static:
            most = f", at most {self.text_of(self.at_most)}" if isfinite(self.at_most) else ""
            return f"{self.text_of(self.limit)} and {self.plus_static:.4g} of the static force{most}"
        return self.value_text(self.limit)

    def value_text(self, value: float) -> str:
        """Return a value of the limited quantity as text, with its unit; a peak force also in kips, and per what."""
        if self.quantity == "peak_force":
            return f"{value / 1e3:.4g} kN ({value / to_si('1 kip', 'force'):.4g} kips) per {self.per}"
        return self.text_of(value)

    def text_of(self, value: float) -> str:
        """Return a value of the limited quantity as text, with its unit."""
        factor, unit = _SHOWN.get(QUANTITIES[self.quantity], (1.0, ""))
        return f"{factor * value:.4g}{unit}"

    @property
    def is_of_bare_forces(self) -> bool:
        """Whether the rule limits vertical forces as they are, neither filtered nor averaged."""
        vertical = self.is_of_forces and self.quantity not in LATERAL
        return vertical and not isfinite(self.low_pass) and not self.sliding_mean

    def allowed(self, static: float) -> float:
        """Return the allowed value for a wheel or axle with this static force (N), in SI units."""
        return min(self.limit + self.plus_static * static, self.at_most) if self.plus_static else self.limit

    def misfit(self, diameter: float, speed: float) -> str:
        """Return why the rule does not apply to wheels of this diameter (m) at this speed (m/s); "" if it does."""
        if not self.diameter_above < diameter <= self.diameter_up_to:
            return f"not for wheels of {1e3 * diameter:.4g} mm"
        if not self.speed_above < speed <= self.speed_up_to:
            return f"not for {3.6 * speed:.4g} km/h"
        return ""

    @property
    def countries(self) -> frozenset[str]:
        """Names of the countries in which the rule is in use."""
        return frozenset(part.strip() for part in self.country.split(",") if part.strip())

    def raised_by(self, value: float, static: float = 0.0) -> bool:
        """Return whether a value of a wheel or axle with this static force (N) raises the alarm; NaN does not."""
        value, allowed = to_si(value, QUANTITIES[self.quantity], "value"), self.allowed(static)
        return value >= allowed if self.when == "reached" else value > allowed

    def to_dict(self) -> dict[str, Any]:
        """Return the rule for JSON, in SI units."""
        return {
            field.name: value for field in fields(self) if not isinstance(value := getattr(self, field.name), float)
            or isfinite(value)
        }  # fmt: skip


_SHOWN = {"force": (1e-3, " kN"), "length": (1e3, " mm"), "speed": (3.6, " km/h")}
"""Factor and unit with which values of a dimension are shown."""
_DEFAULTS = {field.name: field.default for field in fields(Rule)}


def rule_notes(rules: Sequence[Rule]) -> tuple[Note, ...]:
    """Return one note for each implausible number of rules, as of a limit without its unit."""
    given = [
        (f"{field} of the rule {rule.name!r}", getattr(rule, field), usual)
        for rule in rules
        for field, usual in _judged_fields(rule)
    ]
    return tuple(range_note(*one) for one in given if isfinite(one[1]) and not is_plausible(one[1], one[2]))


def _judged_fields(rule: Rule) -> Iterator[tuple[str, Usual]]:
    usual = USUAL[rule.quantity]
    if not rule.plus_static:  # otherwise it may be any share of what is allowed
        yield "limit", usual
    yield "at_most", usual
    yield from USUAL_MEASURES.items()
    yield "diameter_up_to", USUAL_MEASURES["diameter_above"]
    yield "speed_up_to", USUAL_MEASURES["speed_above"]


Rules = str | Path | Sequence[Rule] | None
"""Rules, the path of their file, or None for those of the package."""


def as_rules(given: Rules, countries: Sequence[str] | None) -> tuple[Rule, ...]:
    """Return the rules that are given, or read, and that name one of the countries."""
    if given is None or isinstance(given, str | Path):
        return read_rules(given, countries)
    what = "Rules, or the path of their TOML file"
    rules = as_list(given, "rules", what)
    wrong = next((one for one in rules if not isinstance(one, Rule)), None)
    if wrong is not None:
        raise InputError("", "rules", value_text(wrong), what)
    return in_countries(rules, countries)


# -- rules in a file --------------------------------------------------------------------------------------------------


def read_rules(path: str | Path | None = None, countries: Sequence[str] | None = None) -> tuple[Rule, ...]:
    """Read rules, each with one limit.

    Parameters
    ----------
    path
        A file like the one in the package, which is the default.
    countries
        Take only the rules that name one of these, such as ("SE", "EU").

    Raises
    ------
    InputError
        If the file cannot be read, or a rule in it is wrong; the message names the rule and its field.
    """
    if path is None:
        return in_countries(_own_rules(), countries)
    file = as_path(path, "path", "the path of a TOML file with rules")
    return in_countries(_rules_in(file, str(file)), countries)


@cache
def _own_rules() -> tuple[Rule, ...]:
    """Return the rules of the package, whose file stays as it is."""
    return _rules_in(Path(str(files(__package__) / "rules.toml")), "")


def _rules_in(file: Path, source: str) -> tuple[Rule, ...]:
    """Return the rules in a file; errors name `source`."""
    data = toml_table(file, "rules")
    table = data.pop("rule", None)
    if data:
        name = next(iter(data))
        raise InputError(source, name, f"the unknown name {name!r}", "format, rule")
    if not isinstance(table, list) or not table or not all(isinstance(entry, dict) for entry in table):
        raise InputError(
            source, "rule", "none" if not table else repr(table)[:80], "tables [[rule]], one for each rule"
        )
    rules = tuple(_checked_rule(entry, f"rule.{number}", source) for number, entry in enumerate(table, 1))
    names = [rule.name for rule in rules]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(source, "rule", f"the name {twice!r} twice", "names that differ")
    return rules


def in_countries(rules: Sequence[Rule], countries: Sequence[str] | None) -> tuple[Rule, ...]:
    """Return the rules that name one of the countries; all rules for None; refuse a country that no rule names."""
    if countries is None:
        return tuple(rules)
    names, known = as_names(countries, "countries", COUNTRIES), frozenset().union(*(rule.countries for rule in rules))
    if not names:
        raise InputError("", "countries", "none", f"{COUNTRIES}, or None for all")
    lost = next((name for name in names if name not in known), None)
    if lost is not None:
        allowed = with_suggestion(lost, sorted(known)) if known else "None, as these rules name no country"
        raise InputError("", "countries", f"{value_text(lost)}, which no rule names", allowed)
    return tuple(rule for rule in rules if not rule.countries.isdisjoint(names))


def _checked_rule(entry: dict[str, Any], where: str, source: str) -> Rule:
    """Return the rule that a table of a file describes."""
    known = [field.name for field in fields(Rule)]
    for name in entry:
        if name not in known:
            raise InputError(source, f"{where}.{name}", f"the unknown name {name!r}", with_suggestion(name, known))
    for name in ("name", "quantity", "limit", "level"):
        if name not in entry:
            raise InputError(source, f"{where}.{name}", "nothing", "a value, which is required here")
    day = entry.get("date")
    values = entry | ({"date": day.isoformat()} if isinstance(day, date) else {})
    try:
        return Rule(**values)
    except InputError as error:
        raise error.within(where).at(source) from None


def _positive_number(value: Any, dimension: str, field: str) -> float:
    number = to_si(value, dimension, field)
    if not 0.0 < number < inf:
        raise InputError("", field, value_text(value), f"a positive {dimension}")
    return number
