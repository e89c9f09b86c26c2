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
from dataclasses import replace
from math import inf, nan
from typing import Any, NamedTuple

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.faults.base import CATALOGUE
from wheeltapper.diagnosis.finding import NOT_EXPLAINED
from wheeltapper.record.limits.rule import OF_FAULTS, Rule


class Alarm(NamedTuple):
    """An alarm: a rule that a wheelset violates."""

    axle: int  # from 1
    rule: Rule
    value: float  # SI
    forces_from: str = "model"  # or "recording"
    side: str = ""  # of the wheel, if it is known

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON; in SI units."""
        side = {"side": self.side} if self.side else {}
        return {
            "axle": self.axle, **side, "rule": self.rule.name, "level": self.rule.level, "quantity": self.rule.quantity,
            "value": self.value, "forces_from": self.forces_from, "limit": self.rule.limit, "verify": self.rule.verify,
        }  # fmt: skip

    def __str__(self) -> str:
        value = replace(self.rule, limit=self.value, plus_static=0.0).limit_text
        word = "at least" if self.rule.when == "reached" else "more than"
        measured = " from the recording" if self.forces_from == "recording" else ""
        edition = f", {self.rule.edition}" if self.rule.edition else ""
        where = f"axle {self.axle} {self.side}".strip()
        text = f"{where}: {self.rule.level}: {self.rule.quantity.replace('_', ' ')} {value}{measured}"
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
    """Return the value that a rule limits, in SI units; NaN if the entry has none, as of forces that are filtered.

    Parameters
    ----------
    entry
        The result of `Finding.to_dict`, possibly with `level_force`, N.
    rule, site
        The rule, and the site of the finding, which states the wheels.
    """
    fault, size = CATALOGUE.get(str(entry.get("verdict"))), _number_or_nan(entry.get("size"))
    vehicle = site.passage.vehicle
    speed = float(entry.get("speed") or site.passage.speed)
    if not rule.is_of_bare_forces or rule.misfit(2.0 * float(vehicle.radius), speed):
        return nan
    if rule.quantity in OF_FAULTS:
        return nan if fault is None else fault.alarms.get(rule.quantity, nan) * size
    static = _static_force(entry, rule, site)
    peak = (_wheelset_forces(entry) if rule.per == "axle" else wheel_forces(entry, vehicle.wheels))[1]
    if rule.quantity == "peak_force":
        return peak
    return peak / static - (rule.quantity == "dynamic_increment")


def _static_force(entry: Mapping[str, Any], rule: Rule, site: Site) -> float:
    """Return the static force of the wheel or axle that a rule limits, N."""
    return _wheelset_forces(entry)[0] / (1 if rule.per == "axle" else site.passage.vehicle.wheels)


def alarms_of(entries: Sequence[Mapping[str, Any]], rules: Sequence[Rule], site: Site) -> tuple[Alarm, ...]:
    """Return all alarms of the wheelsets, beginning with the leading one."""
    out = []
    for axle, entry in enumerate(entries, 1):
        if "wheels" in entry:
            out += _alarms_of_wheels(axle, entry, rules, site)
            continue
        source = str(entry.get("forces_from") or "model")
        for rule in rules:
            value = compared_value(entry, rule, site)
            if rule.raised_by(value, _static_force(entry, rule, site)):
                out.append(Alarm(axle, rule, value, source))
    return tuple(out)


def _alarms_of_wheels(axle: int, entry: Mapping[str, Any], rules: Sequence[Rule], site: Site) -> list[Alarm]:
    """Return the alarms of an axle whose wheels were measured each by itself.

    A rule for wheels of certain diameters is compared only if the site states the radius. The largest force of an axle
    is at most the sum of its wheels' largest.
    """
    out = []
    radius, wheels = site.wheel_radius, [one for one in entry["wheels"] if one["static_force"] is not None]
    forces = [(str(one["side"] or ""), one["static_force"], one["largest_force"]) for one in wheels]
    both = [("", sum(one[1] for one in forces), sum(one[2] for one in forces))] if len(forces) == 2 else []
    for rule in rules:
        any_diameter = rule.diameter_above == 0.0 and rule.diameter_up_to == inf
        diameter = 2.0 * radius if radius is not None else 1.0 if any_diameter else nan
        if rule.quantity in OF_FAULTS or not rule.is_of_bare_forces or rule.misfit(diameter, entry["speed"]):
            continue
        for side, static, peak in both if rule.per == "axle" else forces:
            value = peak if rule.quantity == "peak_force" else peak / static - (rule.quantity == "dynamic_increment")
            if rule.raised_by(value, static):
                out.append(Alarm(axle, rule, value, "recording", side))
    return out


def _number_or_nan(value: Any) -> float:
    return nan if value is None else float(value)
