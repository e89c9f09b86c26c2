"""Alarm rules: dated figures of railways and standards, with which findings are compared, and what was not measured.

A rule limits a force in a band of frequencies, anywhere on a wheel. A model of a deck's recording states the largest
force without a filter. Sensors along a track read a wheel only between their gauges, below `PEAKS`, and strikes below
`STRIKES`: what they show is at least there, so that it may raise an alarm, but does not show that a limit of all
frequencies, or of the whole wheel, is kept. `compared` says which rules were not measured, and what was.

Findings of a model are of a wheelset, and most rules limit the force of a wheel. If both wheels do the same, a wheel
has half of the force of the wheelset. If the fault is in a wheel, or unknown, the whole dynamic part is assigned to one
wheel: static/2 + (peak - static). This is the largest force that a wheel can have had.

Rules hold for level track, but the site's irregularity makes healthy wheels bounce, too. If an entry states the force
on level track, this force is compared. If no model explains the recording, the largest force in the recording is
compared as it is: an alarm that is too early is the safe error.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import inf, isfinite, isnan, nan
from typing import Any, NamedTuple

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.faults.base import CATALOGUE
from wheeltapper.diagnosis.finding import HEALTHY, NOT_EXPLAINED
from wheeltapper.record.limits.rule import LATERAL, OF_FAULTS, Rule

PEAKS = 500.0
"""Sensors along a track measure edges and peaks of forces below this frequency, Hz,"""
STRIKES = 2000.0
"""and strikes below this one, Hz: at high speeds those of flats are short."""


class Alarm(NamedTuple):
    """An alarm: a rule that a wheel, an axle, a vehicle or a train violates.

    Attributes
    ----------
    axle
        Number of the axle, from 1; for a vehicle its first one, for a train the one with the largest value.
    rule, value
        The rule, and the value that it limits, in SI units.
    forces_from
        "model" or "recording".
    side
        Side of the wheel, if it is known.
    vehicle
        Number of the vehicle, from 1, if the rule is one for vehicles; otherwise 0.
    band
        Frequency, Hz, below which the recorded force was compared, if it is not that of the rule.
    """

    axle: int
    rule: Rule
    value: float
    forces_from: str = "model"
    side: str = ""
    vehicle: int = 0
    band: float = inf

    @property
    def of_wheels(self) -> bool:
        """Whether it is an alarm of a wheel or an axle, and not of a vehicle or a train."""
        return self.rule.per in ("wheel", "axle")

    @property
    def where(self) -> str:
        """Whose alarm it is, in words."""
        return _whose(self.rule, self)

    @property
    def value_text(self) -> str:
        """The value as text, with the frequency below which it was compared if that is not the rule's."""
        text = self.rule.value_text(self.value)
        return f"at least {text}, below {self.band:g} Hz" if isfinite(self.band) else text

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON; in SI units."""
        side = {"side": self.side} if self.side else {}
        more: dict[str, Any] = {"vehicle": self.vehicle} if self.vehicle else {}
        more |= {"compared_below": self.band} if isfinite(self.band) else {}
        return {
            "axle": self.axle, **side, "rule": self.rule.name, "level": self.rule.level, "quantity": self.rule.quantity,
            "value": self.value, "forces_from": self.forces_from, "limit": self.rule.limit, "verify": self.rule.verify,
            **more,
        }  # fmt: skip

    def __str__(self) -> str:
        word = "at least" if self.rule.when == "reached" else "more than"
        measured = " from the recording" if self.forces_from == "recording" else ""
        edition = f", {self.rule.edition}" if self.rule.edition else ""
        text = f"{self.where}: {self.rule.level}: {self.rule.quantity.replace('_', ' ')} {self.value_text}{measured}"
        return f"{text}, {word} {self.rule.limit_text}; {self.rule.name}{edition}; {self.rule.verify}"


class Untested(NamedTuple):
    """A rule that a train was not, or not wholly, compared with.

    Attributes
    ----------
    rule
        The rule.
    reason
        Why.
    found
        The largest value that was measured, which does not raise the alarm, in SI units; NaN if there is none.
    where
        Whose it is.
    fits
        Whether the rule applies to such wheels and speeds at all.
    """

    rule: Rule
    reason: str
    found: float = nan
    where: str = ""
    fits: bool = True

    @property
    def word(self) -> str:
        """What is said about it: "not measured" or "not compared"."""
        return "not measured" if self.fits else "not compared"

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON; in SI units."""
        found = self.found if isfinite(self.found) else None
        return {
            "rule": self.rule.name, "reason": self.reason, "found": found, "where": self.where, "applies": self.fits,
        }  # fmt: skip


class _Value(NamedTuple):
    """A value to compare with a rule; `static` is the force, N, with which the limit grows."""

    axle: int
    value: float
    static: float = nan
    side: str = ""
    vehicle: int = 0
    source: str = "recording"
    band: float = inf


def _whose(rule: Rule, one: Alarm | _Value) -> str:
    """Return whose value it is that a rule limits, in words."""
    if rule.per == "train":
        return "train"
    return f"vehicle {one.vehicle}" if one.vehicle else f"axle {one.axle} {one.side}".strip()


class Compared(NamedTuple):
    """The alarms of a train, and the rules that it was not, or not wholly, compared with."""

    alarms: tuple[Alarm, ...]
    untested: tuple[Untested, ...]


class Together(NamedTuple):
    """Rules that were not measured for one reason: their names, the largest value that was found, and whose it is."""

    word: str
    names: tuple[str, ...]
    reason: str
    found: str
    where: str

    def __str__(self) -> str:
        found = f"; found {self.found}, {self.where}" if self.found else ""
        return f"{self.word}: {'; '.join(self.names)}: {self.reason}{found}"


def together(untested: Sequence[Untested]) -> list[Together]:
    """Return what was not measured, rules with the same reason together."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for one in untested:
        found = (one.rule.value_text(one.found), one.where) if isfinite(one.found) else ("", "")
        groups.setdefault((one.word, one.reason, *found), []).append(one.rule.name)
    return [Together(word, tuple(names), *rest) for (word, *rest), names in groups.items()]


def compared(
    entries: Sequence[Mapping[str, Any]], rules: Sequence[Rule], site: Site,
    vehicles: Sequence[Mapping[str, Any]] = (),
) -> Compared:  # fmt: skip
    """Compare a train with rules.

    Parameters
    ----------
    entries
        What is known of each axle, the leading one first: `Finding.to_dict`, possibly with `level_force`, N; or with
        the wheels that were measured each by itself.
    rules, site
        The rules, and the site.
    vehicles
        What is known of its vehicles.
    """
    alarms: list[Alarm] = []
    untested: list[Untested] = []
    measured = any("wheels" in entry for entry in entries)
    for rule in rules:
        misfit = _misfit(entries, rule, site)
        if misfit:
            untested.append(Untested(rule, misfit, fits=False))
            continue
        values, reason = (_measured if measured else _of_models)(entries, rule, site, vehicles)
        raised = [one for one in values if rule.raised_by(one.value, one.static)]
        if rule.per == "train":
            raised = sorted(raised, key=lambda one: -one.value)[:1]
        alarms += [Alarm(one.axle, rule, one.value, one.source, one.side, one.vehicle, one.band) for one in raised]
        if reason:
            held = [one for one in values if one not in raised and isfinite(one.value)]
            most = max(held, key=lambda one: one.value / rule.allowed(one.static), default=None)
            where = "" if most is None else _whose(rule, most)
            untested.append(Untested(rule, reason, nan if most is None else most.value, where))
    return Compared(tuple(sorted(alarms, key=lambda one: one.axle)), tuple(untested))


def _misfit(entries: Sequence[Mapping[str, Any]], rule: Rule, site: Site) -> str:
    """Return why a rule applies to no axle of a train, "" if it does to some."""
    diameter, usual = _diameter(rule, site), None if site.passage is None else float(site.passage.speed)
    if isnan(diameter):
        return "for wheels of certain diameters, and the site states no radius"
    reasons = [rule.misfit(diameter, float(entry.get("speed") or usual or 1.0)) for entry in entries]
    return reasons[0] if all(reasons) else ""


def _diameter(rule: Rule, site: Site) -> float:
    """Return the diameter of the wheels, m; NaN if a rule asks for it and nobody knows it."""
    if site.wheel_radius is not None:
        return 2.0 * site.wheel_radius
    return 1.0 if rule.diameter_above == 0.0 and rule.diameter_up_to == inf else nan


Found = tuple[list[_Value], str]
"""Values to compare with a rule, and why it is not, or not wholly, measured; "" if it is."""


# -- of a deck's model ------------------------------------------------------------------------------------------------


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
    if rule.quantity == "speed":
        return speed
    if rule.misfit(2.0 * float(vehicle.radius), speed):
        return nan
    if rule.quantity in OF_FAULTS:
        return nan if fault is None else fault.alarms.get(rule.quantity, nan) * size
    static, peak = _wheelset_forces(entry) if rule.per == "axle" else wheel_forces(entry, vehicle.wheels)
    if rule.quantity == "static_force":
        return static
    if not rule.is_of_bare_forces:
        return nan
    return _of_forces(rule, static, peak)


def _of_forces(rule: Rule, static: float, peak: float) -> float:
    """Return what a rule limits, of a static and a largest force, N."""
    return peak if rule.quantity == "peak_force" else peak / static - (rule.quantity == "dynamic_increment")


def _of_models(
    entries: Sequence[Mapping[str, Any]], rule: Rule, site: Site, vehicles: Sequence[Mapping[str, Any]]
) -> Found:
    """Return what wheelsets, each by its model, have of what a rule limits."""
    if rule.per == "vehicle" or rule.quantity == "left_right_ratio":
        return [], "limits what wheelsets alone do not tell: sides, ends and vehicles"
    if rule.quantity in LATERAL:
        return [], "limits lateral forces"
    if rule.is_of_forces and not rule.is_of_bare_forces:
        return [], f"limits forces below {rule.low_pass:g} Hz; a finding states the largest without a filter"
    values = []
    for axle, entry in enumerate(entries, 1):
        static = _wheelset_forces(entry)[0] / (1 if rule.per == "axle" else site.passage.vehicle.wheels)
        source = str(entry.get("forces_from") or "model")
        values.append(_Value(axle, compared_value(entry, rule, site), static, source=source))
    known = [HEALTHY, *CATALOGUE]
    lost = [str(axle) for axle, entry in enumerate(entries, 1) if entry.get("verdict") not in known]
    if rule.quantity in OF_FAULTS and lost:
        return values, f"limits the size of a fault, which no model states of axles {', '.join(lost)}"
    return values, ""


# -- of sensors along a track -----------------------------------------------------------------------------------------


def _measured(
    entries: Sequence[Mapping[str, Any]], rule: Rule, site: Site, vehicles: Sequence[Mapping[str, Any]]
) -> Found:
    """Return what axles whose wheels were measured each by itself have of what a rule limits."""
    if rule.quantity == "speed":
        return [_Value(axle, entry["speed"]) for axle, entry in enumerate(entries, 1)], ""
    if rule.quantity in OF_FAULTS:
        return [], "limits the size of a fault; sensors along the track measure forces"
    if rule.quantity in LATERAL:
        return [], "limits lateral forces"
    if rule.sliding_mean:
        return [], f"limits a mean over {rule.sliding_mean:g} m, for which no wheel is on a sensor"
    fitting = [
        (axle, entry) for axle, entry in enumerate(entries, 1) if not rule.misfit(_diameter(rule, site), entry["speed"])
    ]
    if rule.is_of_forces:
        values, reason = _of_peaks(fitting, rule)
    else:
        values = list(_of_vehicles(vehicles, rule) if rule.per == "vehicle" else _of_axles(fitting, rule))
        reason = "" if values else "limits loads of both rails, and there is no force of one of them"
    lost = [str(axle) for axle, entry in fitting if any(one["static_force"] is None for one in entry["wheels"])]
    return values, reason or (f"some wheels of axles {', '.join(lost)} have no force" if lost else "")


def _ratio(one: float, other: float) -> float:
    """Return the ratio of the larger of two loads to the smaller one."""
    return max(one, other) / min(one, other) if min(one, other) > 0.0 else inf


def _of_axles(entries: Iterable[tuple[int, Mapping[str, Any]]], rule: Rule) -> Iterable[_Value]:
    """Yield static forces of wheels or axles, or their ratio."""
    for axle, entry in entries:
        wheels = [(str(one["side"] or ""), one["static_force"]) for one in entry["wheels"]]
        known = [(side, force) for side, force in wheels if force is not None]
        if rule.per == "wheel":
            yield from (_Value(axle, force, force, side) for side, force in known)
        elif len(known) == 2:
            (_, one), (_, other) = known
            value = one + other if rule.quantity == "static_force" else _ratio(one, other)
            yield _Value(axle, value, one + other)


def _of_vehicles(vehicles: Iterable[Mapping[str, Any]], rule: Rule) -> Iterable[_Value]:
    """Yield the loads of vehicles, or the ratios of their sides or ends."""
    key = {"static_force": "load", "left_right_ratio": "left_right", "front_rear_ratio": "front_rear"}[rule.quantity]
    for one in vehicles:
        if one[key] is None or one["load"] is None:
            continue
        value = one[key] if key == "load" else _ratio(1.0 + one[key], 1.0 - one[key])
        yield _Value(one["first_axle"], value, one["load"], vehicle=one["vehicle"])


def _of_peaks(entries: Sequence[tuple[int, Mapping[str, Any]]], rule: Rule) -> Found:
    """Return the largest forces of wheels or axles in the band of a rule, or the largest that are known to be there.

    The largest force of an axle is at most the sum of its wheels' largest.
    """
    whole = not isfinite(rule.low_pass)
    asked = PEAKS if whole else rule.low_pass
    values: list[_Value] = []
    seen: list[float | None] = []
    for axle, entry in entries:
        forces: list[tuple[str, float, float, float]] = []
        for one in entry["wheels"]:
            below = next((each for each in one["largest_below"] if each["frequency"] == asked), None)
            if below is None or one["static_force"] is None:
                continue
            peak, band = _largest(one, below["force"]) if whole else (below["force"], inf)
            forces.append((str(one["side"] or ""), one["static_force"], peak, band))
            seen.append(below["turn_seen"])
        if rule.per == "axle":
            static, peak = sum(one[1] for one in forces), sum(one[2] for one in forces)
            forces = [("", static, peak, min(one[3] for one in forces))] if len(forces) == 2 else []
        values += [
            _Value(axle, _of_forces(rule, static, peak), static, side, band=band) for side, static, peak, band in forces
        ]
    least = min((nan if one is None else one for one in seen), default=nan)
    share = "an unknown share of a turn" if isnan(least) else f"{100 * least:.0f} % of a turn"
    if whole:
        return values, (
            f"limits a wheel's force at all frequencies; measured was that below {PEAKS:g} Hz, of strikes below "
            f"{STRIKES:g} Hz, between the gauges: on {share}"
        )
    if not values:
        return [], f"limits the force below {rule.low_pass:g} Hz; no wheel is between gauges for a period of that"
    return values, "" if least >= 1.0 else f"limits the force of a whole turn; measured was {share}"


def _largest(wheel: Mapping[str, Any], peak: float) -> tuple[float, float]:
    """Return the largest force that is known of a wheel with such a peak, N, and the band of it, Hz."""
    struck = wheel["static_force"] + max((one["excess"] for one in wheel["strikes"]), default=0.0)
    return (struck, STRIKES) if struck > peak else (peak, PEAKS)


def _number_or_nan(value: Any) -> float:
    return nan if value is None else float(value)
