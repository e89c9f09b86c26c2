"""Whether a run exceeds limits: the largest value of every wheel against what each rule allows.

Most rules limit the force of a wheel. A wagon's forces are per wheel. Those of all other vehicles are per wheelset:
both of its wheels meet the irregularity, and each has an equal share. Forces without a filter are the located maxima;
filtered ones are sampled, and filtered without phase (docs/theory/joints.rst, section 14.1).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.arguments import check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.notes import Note
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.contacts import SIDES
from wheeltapper.lower.unmet import unmet_notes
from wheeltapper.record.assessment.filtering import (
    checked_rate,
    low_passed,
    note_of_ends,
    readings,
    settling_time,
    sliding_mean,
    usual_rate,
)
from wheeltapper.record.assessment.guidance import guidance_with_notes
from wheeltapper.record.limits.rule import (
    LATERAL,
    OF_FAULTS,
    OF_LOADS,
    OTHERWISE,
    QUANTITIES,
    VERIFY,
    Rule,
    Rules,
    as_rules,
    rule_notes,
)
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    import pandas as pd

FloatArray = NDArray[np.float64]
UNITS = {"force": "N", "length": "m", "speed": "m/s", "number": ""}
HEADINGS = ("limit", "quantity", "value", "allowed", "exceeded", "where", "edition")


@dataclass(frozen=True)
class Compared:
    """One limit, and the wheel or axle of a run that comes nearest to it, or exceeds it most.

    Attributes
    ----------
    rule
        The limit, with its document.
    value, allowed
        Value of the limited quantity, and the value that is allowed, in SI units.
    static
        Static force of this wheel or axle, N.
    exceeded
        Whether the limit is violated.
    wheelset, side
        Number of the wheelset (the leading one is 1), or 0 for the whole vehicle; "left", "right" or "both".
    time, position
        Time, s, and place of the wheel at this time, m; NaN for sizes of faults, static forces and the speed.
    met
        Whether the run met everything that its scenario describes. If not, a limit that is not exceeded does not count
        as kept.
    """

    rule: Rule
    value: float
    allowed: float
    static: float
    exceeded: bool
    wheelset: int
    side: str
    time: float
    position: float
    met: bool = True

    @property
    def name(self) -> str:
        """The limit's name."""
        return self.rule.name

    def to_dict(self) -> dict[str, Any]:
        """Return everything, in SI units; None where there is no value, or where an exceeded limit's is infinite."""
        rule = self.rule
        return {
            "limit": rule.name, "level": rule.level, "quantity": rule.quantity, "per": rule.per,
            "unit": UNITS[QUANTITIES[rule.quantity]], "value": _or_none(self.value), "allowed": self.allowed,
            "exceeded": self.exceeded, "met": self.met, "static_force": self.static, "wheelset": self.wheelset,
            "side": self.side, "time": _or_none(self.time), "position": _or_none(self.position),
            "low_pass": _or_none(rule.low_pass), "sliding_mean": rule.sliding_mean or None, "body": rule.body,
            "country": rule.country, "source": rule.source, "edition": rule.edition, "date": rule.date,
            "applies": rule.applies, "basis": rule.basis, "verify": rule.verify,
        }  # fmt: skip

    @property
    def verdict(self) -> str:
        """Whether the limit is exceeded: "yes", "no", or "not met" if the run cannot show it."""
        return "yes" if self.exceeded else "no" if self.met else "not met"

    def _cells(self) -> tuple[str, ...]:
        rule = self.rule
        where = f"wheelset {self.wheelset}" if self.wheelset else "vehicle"
        where += "" if self.side == "both" else f" {self.side}"
        where += f", {self.time:.4f} s, x = {self.position:.3f} m" if isfinite(self.time) else ""
        shown = rule.text_of(self.value), rule.text_of(self.allowed)
        return rule.name, rule.asks, *shown, self.verdict, where, rule.edition


@dataclass(frozen=True)
class LimitCheck(Sequence[Compared], Shown):
    """The result of a comparison with limits: a sequence of rows, one for each limit; it prints as a table.

    Attributes
    ----------
    rows
        The compared limits, in the order of the rules.
    left_out
        Names of the rules that were not compared, and why.
    notes
        What the numbers mean.
    """

    rows: tuple[Compared, ...]
    left_out: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]

    @property
    def exceeded(self) -> tuple[Compared, ...]:
        """The rows whose limits are exceeded."""
        return tuple(row for row in self.rows if row.exceeded)

    @property
    def unmet(self) -> tuple[Compared, ...]:
        """The rows whose limits are not exceeded, if the run has not met everything that its scenario describes."""
        return tuple(row for row in self.rows if not (row.exceeded or row.met))

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: Any) -> Any:
        """Return a row by its number, or by the name of its limit."""
        if not isinstance(which, str):
            return self.rows[which]
        rows = {row.name: row for row in self.rows}
        check_choice(which, "limit", rows)
        return rows[which]

    def __iter__(self) -> Iterator[Compared]:
        return iter(self.rows)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one line per limit, in SI units, with source, edition and date."""
        import pandas as pd

        return pd.DataFrame([row.to_dict() for row in self.rows])

    def to_dict(self) -> dict[str, Any]:
        """Return everything for JSON, in SI units."""
        left_out = [{"limit": name, "reason": reason} for name, reason in self.left_out]
        return {"limits": [row.to_dict() for row in self.rows], "left_out": left_out, "notes": list(self.notes)}

    def __str__(self) -> str:
        table = [HEADINGS, *(row._cells() for row in self.rows)]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)][:-1]
        lines = [
            "  ".join([*(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=False)), row[-1]])
            for row in table
        ]
        for row in self.exceeded:
            rule = row.rule
            documents = "; ".join(part for part in (rule.source, rule.edition, rule.verify) if part)
            lines.append(f"exceeded: {rule.name}: {documents}")
        lines += [f"not compared: {name}: {reason}" for name, reason in self.left_out]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])


def check(
    record: Record, rules: Rules = None, countries: Sequence[str] | None = None, *, rate: float | str | None = None
) -> LimitCheck:
    """Compare a run with dated limits: forces of wheels, static forces, ratios, Y/Q, sizes of flats, speed.

    A limit is compared if the record has its quantity: lateral forces only for wagons, flats only if the scenario has
    one. Every figure is a copy from a document that changes, and some are quoted from memory: "verify current edition".
    Where a standard takes percentiles over many sections of track, the largest value is compared here.

    Parameters
    ----------
    record
        Record of any vehicle on any track. Forces of a wheelset are shared equally by its wheels.
    rules
        `Rule` objects, or the path of a TOML file with them; by default those of the package.
    countries
        Take only the rules that name one of these, such as ("SE", "EU").
    rate
        Samples per second of filtered forces, Hz; None: 100 per period of the cut-off, but at least 20 kHz.

    Returns
    -------
    LimitCheck
        One row per limit: the value, the allowed value, whether the limit is exceeded, where and when. Also the rules
        that are left out, with the reasons. If the run never meets an irregularity, an anomaly or a deck of its
        scenario, its forces do not show that a limit is kept: a limit that is not exceeded is then "not met".

    Raises
    ------
    InputError
        If it is no record, or a rule is wrong.
    """
    if not isinstance(record, Record):
        raise InputError("", "record", value_text(record), "a record: what `wheeltapper.simulate` returns")
    run, rows, left_out = _Run(record, rate), list[Compared](), list[tuple[str, str]]()
    chosen = as_rules(rules, countries)
    for rule in chosen:
        reason = run.missing_for(rule)
        if reason:
            left_out.append((rule.name, reason))
        else:
            rows.append(run.compared(rule))
    return LimitCheck(tuple(rows), tuple(left_out), (*run.notes(), *rule_notes(chosen)))


class _Run:
    """What limits are compared with; arrays are over wheelsets and sides, the core models' have one side: "both"."""

    def __init__(self, record: Record, rate: float | str | None) -> None:
        self.record, self.rate = record, rate
        self.speed = float(record.scenario.speed)
        self.contacts = record._contacts
        self.grid = (self.contacts.wheelsets, self.contacts.sides)
        vehicle = record.scenario.vehicle
        if self.contacts.has_sides:
            self.radii, self.wheels = [float(axle.radius) for axle in vehicle.axles], 1
        else:
            self.radii, self.wheels = [float(one.radius) for one in vehicle.plane.wheelsets], vehicle.plane.rails
        self.unmet = unmet_notes(record.scenario, record.end * self.speed)
        self.at_rest = isinstance(record.scenario.start, str)
        self._of_filters: dict[str, Note] = {}

    @property
    def sides(self) -> tuple[str, ...]:
        """Names of the sides."""
        return SIDES[:2] if self.contacts.has_sides else SIDES[2:]

    def static(self, per: str) -> FloatArray:
        """Return static forces, N, of wheels, of axles with one side, or of the vehicle with one wheelset."""
        forces = self.contacts.static_force.reshape(self.grid)
        return self._of(forces, per) if per in OTHERWISE else forces.sum(keepdims=True)

    def _of(self, forces: FloatArray, per: str) -> FloatArray:
        """Return forces of the contacts (..., wheelsets, sides) as those of wheels, or of axles."""
        return forces.sum(axis=-1, keepdims=True) if per == "axle" else forces / self.wheels

    def missing_for(self, rule: Rule) -> str:
        """Return why a rule cannot be compared, or "" if it can."""
        if rule.quantity in LATERAL and not self.contacts.has_sides:
            return "no lateral forces in this model"
        if rule.quantity == "left_right_ratio" and not self.contacts.has_sides:
            return "no sides in this model"
        if rule.quantity == "front_rear_ratio" and self.grid[0] < 2:
            return "a single wheelset"
        if rule.quantity in OF_FAULTS and not np.isfinite(self._sizes(rule.quantity)).any():
            return f"the scenario states no {rule.quantity.replace('_', ' ')}"
        reasons = [rule.misfit(2.0 * radius, self.speed) for radius in self.radii]
        if all(reasons):
            return reasons[0]
        end = self.record.end
        if isfinite(rule.low_pass):
            if end * rule.low_pass < 1.0:
                return f"{end:g} s are shorter than a period of {rule.low_pass:g} Hz"
            end -= settling_time(rule.low_pass) * (1 if self.at_rest else 2)
            if end * rule.low_pass < 0.01:
                return f"nothing is left of the run but the ends, where the filter of {rule.low_pass:g} Hz settles"
        if rule.sliding_mean and not end * self.speed > rule.sliding_mean:
            return f"{end * self.speed:.4g} m are no longer than the mean over {rule.sliding_mean:g} m"
        return ""

    def compared(self, rule: Rule) -> Compared:
        """Return a rule with the wheel or axle that comes nearest to its limit, or exceeds it most."""
        static = self.static(rule.per)
        if not rule.is_of_forces:
            values = self._steady(rule)
            times = np.full_like(values, nan)
        elif rule.quantity in LATERAL:
            values, times = self._lateral(rule)
        else:
            values, times = self._largest_forces(rule)
            if rule.quantity != "peak_force":
                values = values / static - (rule.quantity == "dynamic_increment")
        allowed = np.vectorize(rule.allowed)(static)
        fits = np.array([not rule.misfit(2.0 * radius, self.speed) for radius in self.radii])[:, None]
        if len(values) < len(fits):
            fits = np.array([[fits.any()]])
        near = np.where(fits & ~np.isnan(values), values / allowed, -np.inf)
        worst = np.unravel_index(int(np.argmax(near)), near.shape)
        wheelset, side = int(worst[0]), int(worst[1])
        value, force, time = float(values[worst]), float(static[worst]), float(times[worst])
        begin = float(self.contacts.position[wheelset * self.contacts.sides])
        return Compared(
            rule, value, float(allowed[worst]), force, rule.raised_by(value, force),
            wheelset + 1 if rule.per in OTHERWISE else 0,
            self.sides[side] if values.shape[1] == len(self.sides) else SIDES[2], time, begin + self.speed * time,
            not rule.is_of_forces or not self.unmet,
        )  # fmt: skip

    # -- values of all wheels, and their times ------------------------------------------------------------------------

    def _largest_forces(self, rule: Rule) -> tuple[FloatArray, FloatArray]:
        if rule.is_of_bare_forces and not (rule.per == "axle" and self.contacts.has_sides):
            values, times = self._located
            return self._of(values, rule.per), times
        rate = self._rate(rule.low_pass)
        forces = self._of(self._vertical(rate), rule.per)
        if isfinite(rule.low_pass):
            filtered = low_passed(forces, rate, rule.low_pass, at_rest=self.at_rest)
            forces = readings(filtered, rate, rule.low_pass, at_rest=self.at_rest)
            self._keep(note_of_ends(filtered, forces, rule.low_pass, at_rest=self.at_rest))
        late = 0.0
        if rule.sliding_mean:
            width = max(round(rule.sliding_mean / self.speed * rate), 1)
            forces, late = sliding_mean(forces, width), 0.5 * (width - 1) / rate
        forces = np.where(np.isnan(forces), -np.inf, forces)
        return forces.max(axis=0), forces.argmax(axis=0) / rate + late

    def _keep(self, *notes: Note) -> None:
        """Keep what is to be said of filters: of one cause the most severe."""
        for note in notes:
            if note.severity >= self._of_filters.setdefault(note.cause, note).severity:
                self._of_filters[note.cause] = note

    @cached_property
    def _located(self) -> tuple[FloatArray, FloatArray]:
        """The largest located maximum of each wheel's tread, or the force at an end of the run, and its time."""
        ends = np.array([0.0, self.record.end])
        at_ends = self.record.at(ends).normal_force.values.reshape(2, -1)
        peaks, count = self.record._peaks, at_ends.shape[1]
        contact = np.concatenate([peaks["contact"], np.tile(np.arange(count), 2)])
        force = np.concatenate([peaks["normal_force"], at_ends.ravel()])
        time = np.concatenate([peaks["time"], np.repeat(ends, count)])
        best = [int(np.argmax(np.where(contact == one, force, -np.inf))) for one in range(count)]
        return force[best].reshape(self.grid), time[best].reshape(self.grid)

    def _vertical(self, rate: float) -> FloatArray:
        history = self.record.history(rate)
        forces = history.vertical_force if self.contacts.has_sides else history.normal_force
        return np.asarray(forces.values).reshape(-1, *self.grid)

    def _rate(self, cutoff: float) -> float:
        if self.rate is None:
            return usual_rate(cutoff if isfinite(cutoff) else 0.0)
        return checked_rate(self.rate, cutoff if isfinite(cutoff) else 0.0)

    def _lateral(self, rule: Rule) -> tuple[FloatArray, FloatArray]:
        cutoff = rule.low_pass if isfinite(rule.low_pass) else None
        rate = self._rate(rule.low_pass)
        found, notes = guidance_with_notes(self.record, cutoff, 4, rule.sliding_mean, rate=rate)
        self._keep(*(note for note in notes if note.cause.startswith("ends")))
        size = np.abs(found[rule.quantity].values).reshape(found.sizes["time"], self.grid[0], -1)
        size = np.where(np.isnan(size), -np.inf, size)  # where the window of the mean is not all in the run
        return size.max(axis=0), found.time.values[size.argmax(axis=0)]

    def _steady(self, rule: Rule) -> FloatArray:
        """Return what does not change along the way: sizes of faults, static forces and their ratios, the speed."""
        if rule.quantity == "speed":
            return np.full((1, 1), self.speed)
        if rule.quantity not in OF_LOADS:
            return self._sizes(rule.quantity)
        if rule.quantity == "static_force":
            return self.static(rule.per)
        forces, half = self.static("wheel"), self.grid[0] // 2
        if rule.quantity == "front_rear_ratio":
            pairs = np.array([[forces[:half].sum(), forces[-half:].sum()]])
        else:
            pairs = forces if rule.per == "axle" else forces.sum(axis=0, keepdims=True)
        return np.asarray(pairs.max(axis=1, keepdims=True) / pairs.min(axis=1, keepdims=True))

    def _sizes(self, quantity: str) -> FloatArray:
        """Return the size of the worst fault of each wheel, m; NaN without one."""
        scenario, out = self.record.scenario, np.full(self.grid, nan)
        for wheelset, radius in enumerate(self.radii):
            for side, name in enumerate(SIDES[: self.grid[1]]):
                met = scenario.irregularities_on(wheelset + 1, name)
                sizes = [size for item in met if (size := item.limited(radius).get(quantity)) is not None]
                out[wheelset, side] = max(sizes, default=nan)
        return out

    def notes(self) -> tuple[str, ...]:
        """Return what the numbers mean."""
        notes = [f"figures are copies of documents that change, some remembered: {VERIFY} of each"]
        if self.wheels > 1:
            notes.append(f"the force of a wheelset is shared equally by its {self.wheels} wheels")
        notes += self._of_filters.values()
        if self.record.outcome is not Outcome.COMPLETED:
            notes.append(f"{self.record.outcome.sentence}: compared up to {self.record.end:g} s")
        return (*notes, *self.unmet)


def _or_none(value: float) -> float | None:
    return value if isfinite(value) else None
