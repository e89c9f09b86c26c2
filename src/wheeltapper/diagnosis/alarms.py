"""Alarm rules: dated figures of railways and standards, with which a finding is compared.

Findings give forces of a wheelset, and most rules limit the force of a wheel. If both wheels do the same, a wheel has
half of the force of the wheelset. If the fault is in a wheel, or unknown, the whole dynamic part is assigned to one
wheel: static/2 + (peak - static). This is the largest force that a wheel can have had.

Rules hold for level track, but the site's irregularity makes healthy wheels bounce, too. If an entry states the force
on level track, this force is compared. If no model explains the recording, the largest force in the recording is
compared as it is: an alarm that is too early is the safe error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import date
from importlib.resources import files
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any, NamedTuple

from wheeltapper.describe.scenario import toml_table
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.faults.base import CATALOGUE
from wheeltapper.diagnosis.finding import NOT_EXPLAINED
from wheeltapper.ground.arguments import as_names, as_path
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.quantities import to_si

VERIFY = "verify current edition"
"""What every rule says by default of itself: its figure is a copy of a document that changes."""
QUANTITIES = {
    "peak_force": "force", "dynamic_ratio": "number", "dynamic_increment": "number", "flat_length": "length",
    "out_of_roundness": "length",
}  # fmt: skip
"""What a rule can limit, and the dimension of its limit ("number": a ratio)."""
CHOICES = {
    "quantity": tuple(QUANTITIES), "per": ("wheel", "axle"), "when": ("exceeded", "reached"),
    "level": ("warning", "maintain", "stop"),
}  # fmt: skip
"""The values that each of these fields of a rule may have; any other value is refused."""
COUNTRIES = 'names of countries, as ("SE", "EU")'
LENGTHS = ("diameter_above", "diameter_up_to")
"""Fields of a rule that hold a length, m; a rule applies only to wheels with diameters between them."""
OF_FAULTS = ("flat_length", "out_of_roundness")
"""Quantities that the size of a fault gives; all others are forces."""


@dataclass(frozen=True)
class Rule:
    """One figure of one document.

    Attributes
    ----------
    name, body, country
        Name of the rule here, the body that states it, and the countries in which it is in use.
    quantity
        A key of `QUANTITIES`.
    limit
        N, m or a plain number.
    level
        "warning", "maintain" or "stop".
    edition, date
        Edition and date of the document, in words and as year-month-day ("" if unknown).
    source
        The document's number and title.
    basis
        Source of the figure here, and how certain it is.
    per
        "wheel" or "axle": the force of which of them is limited.
    when
        "exceeded" or "reached": whether the limit itself already counts.
    diameter_above, diameter_up_to
        Diameters of the wheels to which the rule applies, m.
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
    per: str = "wheel"
    when: str = "exceeded"
    diameter_above: float = 0.0
    diameter_up_to: float = inf
    applies: str = ""
    verify: str = VERIFY

    @property
    def limit_text(self) -> str:
        """The limit as text."""
        if self.quantity == "peak_force":
            return f"{self.limit / 1e3:.4g} kN ({self.limit / to_si('1 kip', 'force'):.4g} kips) per {self.per}"
        return f"{1e3 * self.limit:.4g} mm" if QUANTITIES[self.quantity] == "length" else f"{self.limit:.4g}"

    def is_in(self, countries: Sequence[str]) -> bool:
        """Return whether the rule names one of these countries."""
        named = as_names(countries, "countries", COUNTRIES)
        return not {part.strip() for part in self.country.split(",")}.isdisjoint(named)

    def raised_by(self, value: float) -> bool:
        """Return whether a value raises the alarm; NaN does not."""
        value = to_si(value, QUANTITIES[self.quantity], "value")
        return value >= self.limit if self.when == "reached" else value > self.limit

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON; in SI units."""
        return {
            field.name: value for field in fields(self) if not isinstance(value := getattr(self, field.name), float)
            or isfinite(value)
        }  # fmt: skip


class Alarm(NamedTuple):
    """An alarm: a rule that a wheelset violates."""

    axle: int  # from 1
    rule: Rule
    value: float  # SI
    forces_from: str = "model"  # or "recording"

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON; in SI units."""
        return {
            "axle": self.axle, "rule": self.rule.name, "level": self.rule.level, "quantity": self.rule.quantity,
            "value": self.value, "forces_from": self.forces_from, "limit": self.rule.limit, "verify": self.rule.verify,
        }  # fmt: skip

    def __str__(self) -> str:
        value = Rule("", self.rule.quantity, self.value, "", per=self.rule.per).limit_text
        word = "at least" if self.rule.when == "reached" else "more than"
        measured = " from the recording" if self.forces_from == "recording" else ""
        edition = f", {self.rule.edition}" if self.rule.edition else ""
        text = f"axle {self.axle}: {self.rule.level}: {self.rule.quantity.replace('_', ' ')} {value}{measured}"
        return f"{text}, {word} {self.rule.limit_text}; {self.rule.name}{edition}; {self.rule.verify}"


# -- what is compared -------------------------------------------------------------------------------------------------


def wheel_forces(entry: Mapping[str, Any], wheels: int = 2) -> tuple[float, float]:
    """Return static and largest force of one wheel, N, from those of the wheelset; NaN without a wheel.

    The whole dynamic force is assigned to one of the two wheels if the fault is in a wheel, or unknown: this is the
    largest force that one wheel can have had.
    """
    static, peak = _wheelset_forces(entry)
    fault = CATALOGUE.get(str(entry.get("verdict")))
    if entry.get("verdict") == NOT_EXPLAINED or (fault is not None and fault.part == "wheel"):
        return static / wheels, static / wheels + (peak - static)
    return static / wheels, peak / wheels


def _wheelset_forces(entry: Mapping[str, Any]) -> tuple[float, float]:
    """Return static and largest force of the wheelset, N; the latter on level track if the entry states it."""
    level = entry.get("level_force")
    return _number_or_nan(entry.get("static_force")), _number_or_nan(
        entry.get("largest_force") if level is None else level
    )


def compared_value(entry: Mapping[str, Any], rule: Rule, site: Site) -> float:
    """Return the value that a rule limits, in SI units; NaN if the entry has none.

    Parameters
    ----------
    entry
        The result of `Finding.to_dict`, possibly with `level_force`, N.
    rule, site
        The rule, and the site of the finding, which states the wheels.
    """
    fault, size = CATALOGUE.get(str(entry.get("verdict"))), _number_or_nan(entry.get("size"))
    vehicle = site.passage.vehicle
    if not rule.diameter_above < 2.0 * float(vehicle.radius) <= rule.diameter_up_to:
        return nan
    if rule.quantity in OF_FAULTS:
        return nan if fault is None else fault.alarms.get(rule.quantity, nan) * size
    static, peak = _wheelset_forces(entry) if rule.per == "axle" else wheel_forces(entry, vehicle.wheels)
    if rule.quantity == "peak_force":
        return peak
    return peak / static - (rule.quantity == "dynamic_increment")


def alarms_of(entries: Sequence[Mapping[str, Any]], rules: Sequence[Rule], site: Site) -> tuple[Alarm, ...]:
    """Return all alarms of the wheelsets, beginning with the leading one."""
    out = []
    for axle, entry in enumerate(entries, 1):
        values = [(rule, compared_value(entry, rule, site)) for rule in rules]
        source = str(entry.get("forces_from") or "model")
        out += [Alarm(axle, rule, value, source) for rule, value in values if rule.raised_by(value)]
    return tuple(out)


def _number_or_nan(value: Any) -> float:
    return nan if value is None else float(value)


# -- rules in a file --------------------------------------------------------------------------------------------------


def read_rules(path: str | Path | None = None, countries: Sequence[str] | None = None) -> tuple[Rule, ...]:
    """Read alarm rules.

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
    given = None if path is None else as_path(path, "path", "the path of a TOML file with alarm rules")
    source = "" if given is None else str(given)
    data = toml_table(given or Path(str(files(__package__) / "alarm_rules.toml")), "alarm rules")
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
    return in_countries(rules, countries)


def in_countries(rules: Sequence[Rule], countries: Sequence[str] | None) -> tuple[Rule, ...]:
    """Return the rules that name one of the countries; all rules for None."""
    if countries is None:
        return tuple(rules)
    names = as_names(countries, "countries", COUNTRIES)
    return tuple(rule for rule in rules if rule.is_in(names))


def _checked_rule(entry: dict[str, Any], where: str, source: str) -> Rule:
    known = [field.name for field in fields(Rule)]
    for name in entry:
        if name not in known:
            raise InputError(source, f"{where}.{name}", f"the unknown name {name!r}", ", ".join(known))
    for name in ("name", "quantity", "limit", "level"):
        if name not in entry:
            raise InputError(source, f"{where}.{name}", "nothing", "a value, which is required here")
    values = dict(entry)
    for name, choices in CHOICES.items():
        if name in values and values[name] not in choices:
            raise InputError(source, f"{where}.{name}", repr(values[name]), ", ".join(choices))
    values["limit"] = _positive_number(values["limit"], QUANTITIES[values["quantity"]], f"{where}.limit", source)
    for name in LENGTHS:
        if name in values:
            values[name] = _positive_number(values[name], "length", f"{where}.{name}", source)
    if isinstance(values.get("date"), date):
        values["date"] = values["date"].isoformat()
    for name, value in values.items():
        if name not in ("limit", *LENGTHS) and not isinstance(value, str):
            raise InputError(source, f"{where}.{name}", repr(value), "a text" if name != "date" else "a date")
    return Rule(**values)


def _positive_number(value: Any, dimension: str, where: str, source: str) -> float:
    try:
        number = to_si(value, dimension)
    except ValueError as error:
        found, _, allowed = str(error).removeprefix("found ").partition("; allowed: ")
        raise InputError(source, where, found, allowed) from error
    if not 0.0 < number < inf:
        raise InputError(source, where, repr(value), f"a positive {dimension}")
    return number
