"""What notebooks show of nouns and results: small pages of HTML, readable on light and on dark ground.

A page says what is known without computing anything: it never runs a march, and draws from tables alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from functools import singledispatch
from html import escape
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.ask.study import field_unit
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.manual import field_descriptions
from wheeltapper.describe.noun import Noun
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.diagnosis.axle_box.finding import AxleBoxFinding
from wheeltapper.diagnosis.faults.base import Fault
from wheeltapper.diagnosis.finding import Finding
from wheeltapper.diagnosis.force.reconstruction import Force
from wheeltapper.diagnosis.inference.problem import Prior
from wheeltapper.diagnosis.site.neighbours import Condition
from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.faces.panels import in_unit, spaced
from wheeltapper.orbits.orbit import Orbit
from wheeltapper.record.limits.comparison import LimitCheck
from wheeltapper.record.limits.rule import Rule
from wheeltapper.record.record import Record
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]
LONG, MANY, FEW, DEEP = 100, 24, 8, 3
"""Most letters of a value, most rows of a table, most nouns in a list that are shown whole, and deepest nesting."""
WIDE, TALL, POINTS = 420, 90, 160
"""Size of a sketch in pixels, and the number of its columns."""
BLUE, HARD = "#4a90c2", "\u00a0"
"""A colour that can be seen on white and on black, and a space at which no line ends."""
SAID = {"yes": " EXCEEDED", "no": "", "not met": " NOT MET"}
"""What stands behind the value of a limit."""
STYLE = (
    "<style>.wheeltapper{font-size:.9em;line-height:1.35;max-width:60em}.wheeltapper table{border:none;margin:.2em 0}"
    ".wheeltapper tr{background:none!important}.wheeltapper td{text-align:left;vertical-align:top;"
    "padding:.1em .9em .1em 0;border:none}.wheeltapper i{font-style:normal;opacity:.65}"
    ".wheeltapper svg{display:block;max-width:100%}</style>"
)
"""No colour of text or ground is set, so that those of the notebook hold."""


class Row(NamedTuple):
    """A line of a page: a name, a value, and what it means. What is escaped already is a `Markup`."""

    name: str
    value: str
    meaning: str = ""


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


class Page(NamedTuple):
    """What a page says: a heading, a line below it, rows, and a sketch in SVG."""

    heading: str
    line: str
    rows: Sequence[Row]
    sketch: str = ""


def page(what: Any) -> str:
    """Return the page of a noun or a result as HTML."""
    found = page_of(what)
    rows = list(found.rows)
    more = [Row("", f"and {len(rows) - MANY} more")] if len(rows) > MANY else []
    line = f"<div><i>{escape(found.line)}</i></div>" if found.line else ""
    heading = f"<strong>{_text(found.heading)}</strong>"
    return f'{STYLE}<div class="wheeltapper">{heading}{line}{found.sketch}{_table(rows[:MANY] + more)}</div>'


def _text(value: str) -> str:
    """Return text as HTML, shortened where it is long."""
    if isinstance(value, Markup):
        return value
    return escape(value if len(value) <= LONG else value[: LONG - 1] + "…")


def _table(rows: Iterable[Row]) -> str:
    lines = "".join(
        f"<tr><td>{_text(row.name)}</td><td>{_text(row.value)}</td><td><i>{_text(row.meaning)}</i></td></tr>"
        for row in rows
    )
    return f"<table>{lines}</table>" if lines else ""


def quantity(value: float, unit: str) -> str:
    """Return a number with its unit, in a prefix that reads well."""
    factor, shown = in_unit(value, unit.replace("^2", "²"))
    return f"{factor * value:.5g} {shown}".rstrip().replace(" ", HARD)


# -- nouns ------------------------------------------------------------------------------------------------------------


@singledispatch
def page_of(what: Any) -> Page:
    """Return what the page of something says; of a dataclass its plain fields."""
    rows = []
    for field in dataclasses.fields(what) if dataclasses.is_dataclass(what) else ():
        value = getattr(what, field.name)
        if not field.name.startswith("_") and isinstance(value, str | int | float | tuple):
            rows.append(Row(field.name.replace("_", " "), _value_text(value, "")))
    own = "__str__" in vars(type(what))
    return Page(spaced(type(what).__name__), str(what).partition("\n")[0] if own else "", rows)


@page_of.register
def _(noun: Noun) -> Page:
    first = (type(noun).__doc__ or "").strip().partition("\n")[0]
    return Page(type(noun).__name__, first, _rows_of(noun))


@page_of.register
def _(noun: Irregularity) -> Page:
    first = (type(noun).__doc__ or "").strip().partition("\n")[0]
    stretches = noun.course(0.46).stretches
    ends = [stretch.start for stretch in stretches if np.isfinite(stretch.start)]
    low, high = (min(ends), max(ends)) if ends else (0.0, 1.0)
    room = 0.2 * (high - low) or 0.5
    x = np.linspace(low - room, high + room, POINTS)
    return Page(type(noun).__name__, first, _rows_of(noun), _sketch([_line(x, noun.course(0.46).value(x))]))


@page_of.register
def _(wagon: Wagon) -> Page:
    line = f"{len(wagon.bodies)} bodies, {len(wagon.axles)} wheelsets, {len(wagon.elements)} elements, " + (
        f"{wagon.mass / 1e3:.4g} t"
    )
    boxes = wagon.boxes.values()
    corners = np.array([(c[0] + s * e[0] / 2, c[2] + s * e[2] / 2) for c, e in boxes for s in (-1, 1)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = (WIDE - 8) / float(high[0] - low[0])
    shapes = []
    for name, (centre, edges) in wagon.boxes.items():
        x, y = 4 + scale * (centre[0] - edges[0] / 2 - low[0]), 4 + scale * (high[1] - centre[2] - edges[2] / 2)
        rounded = scale * edges[0] / 2 if name.startswith("wheelset ") else 0.0
        shapes.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{scale * edges[0]:.1f}" height="{scale * edges[2]:.1f}" '
            f'rx="{rounded:.1f}" fill="{BLUE}" fill-opacity="0.25" stroke="currentColor"/>'
        )
    tall = 8 + scale * float(high[1] - low[1])
    sketch = f'<svg width="{WIDE}" height="{tall:.0f}">{"".join(shapes)}</svg>'
    rows = [Row("bodies", ", ".join(body.name for body in wagon.bodies))]
    return Page("Wagon", line, [*rows, *(row for row in _rows_of(wagon) if row.name != "bodies")], sketch)


def _rows_of(noun: Noun, depth: int = 1) -> list[Row]:
    """Return a row for each field that is given or has a default: its value, its unit, and what it means."""
    meanings = field_descriptions(type(noun))
    return [
        Row(
            name,
            _value_text(value, field_unit(type(noun), name), depth),
            meanings.get(name, "").partition(". ")[0].replace("`", ""),
        )
        for name in type(noun).model_fields
        if (value := getattr(noun, name)) is not None and value != () and value != ""
    ]


def _value_text(value: Any, unit: str, depth: int = 1) -> str:
    if isinstance(value, Noun):
        if depth >= DEEP or not _rows_of(value, DEEP):
            return type(value).__name__
        inside = _table(_rows_of(value, depth + 1))
        return Markup(f"<details><summary>{escape(type(value).__name__)}</summary>{inside}</details>")
    if isinstance(value, dict):
        return _several([(str(key), held) for key, held in value.items()], unit, depth)
    if isinstance(value, tuple | list):
        if value and all(isinstance(one, Noun) for one in value):
            return _several([("", one) for one in value], unit, depth)
        shown = ", ".join(_value_text(one, "", depth) for one in value[:6]) + (", …" if len(value) > 6 else "")
        return f"({shown}) {unit}".rstrip()
    if isinstance(value, bool) or not isinstance(value, int | float):
        return getattr(value, "__name__", str(value))
    return quantity(float(value), unit)


def _several(items: Sequence[tuple[str, Any]], unit: str, depth: int) -> Markup:
    """Return several things below each other, as many as are read; of many their names alone."""
    if len(items) > FEW:
        names = [key or str(getattr(held, "name", "") or type(held).__name__) for key, held in items]
        return Markup(escape(", ".join(names[:MANY])) + (f" and {len(items) - MANY} more" * (len(items) > MANY)))
    parts = []
    for key, held in items:
        name = getattr(held, "name", "")
        label = escape(f"{key or name}: ") if key or name else ""
        parts.append(f"<div>{label}{_text(_value_text(held, unit, depth))}</div>")
    return Markup("".join(parts))


# -- results ----------------------------------------------------------------------------------------------------------


@page_of.register
def _(record: Record) -> Page:
    events, end = record._events, record.end
    peaks = record._peaks
    kinds = events["kind"]
    rows = [
        Row("scenario", _value_text(record.scenario, "")),
        Row("static force", quantity(record.static_force, "N"), "of the wheelset, of a wagon of the heaviest wheel"),
        Row("losses of contact", str(int((kinds == 0).sum()))),
        Row("force maxima", str(len(peaks["time"]))),
        *(Row("note", str(note)) for note in record.notes[:4]),
    ]
    marks = []
    if len(peaks["time"]):
        marks = _stems(peaks["time"] / end, peaks["normal_force"] / float(peaks["normal_force"].max()))
    return Page("Record", str(record), rows, _sketch(marks))


@page_of.register
def _(recording: Recording) -> Page:
    rows = [
        Row("samples", str(len(recording.samples)), f"of the {recording.quantity}"),
        Row("rate", f"{recording.rate:g} Hz"),
        Row("start", quantity(recording.start, "s"), "after the trigger"),
        Row("clipped", str(int(recording.clipped.sum()))),
        *(Row("note", note) for note in recording.notes[:4]),
    ]
    return Page("Recording", recording.source, rows, _sketch([_line(recording.times, recording.samples)]))


@page_of.register
def _(force: Force) -> Page:
    rows = [
        Row("largest", quantity(float(np.nanmax(force.force)), "N")),
        Row("within 1 %", f"{force.band[0]:.3g} to {force.band[1]:.3g} Hz"),
        *(Row("note", note) for note in force.notes[:4]),
    ]
    return Page("Force", f"by the method “{force.method}”", rows, _sketch([_line(force.times, force.force)]))


@page_of.register
def _(finding: Finding) -> Page:
    likely = sorted(finding.probabilities.items(), key=lambda item: -item[1])[:3]
    low, high = finding.interval
    size = [Row("size", f"{finding.size:.4g}", f"90 %: {low:.4g} to {high:.4g}")] if np.isfinite(finding.size) else []
    rows = [
        *(Row(name, f"{100.0 * share:.3g} %", "probability") for name, share in likely),
        *size,
        Row("static force", quantity(finding.static_force, "N")),
        Row("largest force", quantity(finding.largest_force, "N"), str(finding.forces_from)),
        *(Row("note", note) for note in finding.notes[:4]),
    ]
    recording = finding.recording
    return Page(
        f"Finding: {finding.verdict}", recording.source, rows, _sketch([_line(recording.times, recording.samples)])
    )


@page_of.register
def _(finding: AxleBoxFinding) -> Page:
    sizes = [
        Row(name, quantity(size, "m"), f"90 %: {quantity(ends[0], 'm')} to {quantity(ends[1], 'm')}")
        for name, (size, ends) in finding.sizes.items()
    ]
    joints = [
        Row(one.kind, quantity(one.height, "m"), f"at {one.place:.1f} m, {one.peak:.3g} m/s²")
        for one in sorted(finding.joints, key=lambda one: -abs(one.height))[:4]
    ]
    rows = [*sizes, Row("speed", quantity(finding.wheel.speed, "m/s")), *joints]
    turn = np.arange(len(finding.average)) / len(finding.average)
    return Page(
        f"AxleBoxFinding: {finding.verdict}", finding.recording.source, rows, _sketch([_line(turn, finding.average)])
    )


@page_of.register
def _(train: TrainFinding) -> Page:
    rows = []
    for row in train.table():
        force = "" if row["peak_kn"] is None else f"largest {row['peak_kn']:.0f} kN"
        static = "" if row["static_kn"] is None else f"static {row['static_kn']:.0f} kN, "
        side = f" {row['side']}" if row.get("side") else ""
        alarms = f"; alarms: {', '.join(row['alarms'])}" if row["alarms"] else ""
        rows.append(Row(f"axle {row['axle']}{side}", f"{static}{force}{alarms}", str(row["verdict"])))
    return Page(f"Train {train.name}".rstrip(), f"{len(train.axles)} axles, {len(train.alarms)} alarms", rows)


@page_of.register
def _(check: LimitCheck) -> Page:
    rows = [
        Row(row.name, f"{row.rule.text_of(row.value)}{SAID[row.verdict]}",
            f"allowed: {row.rule.text_of(row.allowed)}")
        for row in check
    ]  # fmt: skip
    unmet = f", {len(check.unmet)} not met by the run" if check.unmet else ""
    return Page("LimitCheck", f"{len(check.exceeded)} of {len(check)} limits exceeded{unmet}", rows)


@page_of.register
def _(rule: Rule) -> Page:
    bounds = [
        (quantity(low, unit), quantity(high, unit), words)
        for low, high, unit, words in (
            (rule.diameter_above, rule.diameter_up_to, "m", "diameter"),
            (rule.speed_above, rule.speed_up_to, "m/s", "speed"),
        ) if np.isfinite(high) or (np.isfinite(low) and low > 0.0)
    ]  # fmt: skip
    rows = [
        Row("allowed", rule.limit_text, f"of the {rule.quantity.replace('_', ' ')}; counts where {rule.when}"),
        Row("level", rule.level),
        *(Row(words, f"above {low}, up to {high}", "to which it applies") for low, high, words in bounds),
        *([Row("low pass", quantity(rule.low_pass, "Hz"))] if np.isfinite(rule.low_pass) else []),
        *([Row("sliding mean", quantity(rule.sliding_mean, "m"), "of the way")] if rule.sliding_mean else []),
        *(
            Row(name, getattr(rule, name))
            for name in ("body", "country", "edition", "date", "source", "basis", "applies", "verify")
            if getattr(rule, name)
        ),
    ]
    return Page(f"Rule: {rule.name}", "", rows)


@page_of.register
def _(prior: Prior) -> Page:
    return Page(
        "Prior", "", [Row(name, f"{held:.6g}" if isinstance(held, float | int) else str(held)) for name, held in
                      prior._asdict().items()],
    )  # fmt: skip


@page_of.register
def _(fault: Fault) -> Page:
    rows = [
        Row("part", fault.part, "of the wheelset"),
        Row("size", fault.size, f"usually {fault.usual:.6g} {fault.unit}".rstrip()),
        *([Row("field", fault.path, "that holds its size")] if fault.path else []),
        Row("acts", fault.acts),
    ]
    return Page(f"Fault: {fault.name}", fault.meaning, rows)


@page_of.register
def _(condition: Condition) -> Page:
    spacing = getattr(condition, "spacing", None)
    ahead = "ahead of" if spacing is not None and spacing > 0.0 else "behind"
    given = [(name, held) for name in ("size", "place") if (held := getattr(condition, name)) is not None]
    place = (
        [] if spacing is None else [Row("spacing", quantity(abs(spacing), "m"), f"{ahead} the wheelset of interest")]
    )
    rows = [
        *place,
        Row("fault", condition.fault or "none"),
        *(Row(name, _value_text(held, "")) for name, held in given),
    ]
    return Page(type(condition).__name__, condition.label, rows)


@page_of.register
def _(orbit: Orbit) -> Page:
    sizes = ", ".join(f"{size:.4g}" for size in np.abs(orbit.multipliers))
    rows = [
        Row("period", quantity(float(orbit.period), "s"), f"{orbit.waves} waves"),
        Row("multipliers", sizes, "moduli; stable while all are less than 1"),
        Row("losses", str(orbit.losses), "of contact in a period"),
        Row("largest force", quantity(float(orbit.largest_force), "N")),
    ]
    return Page("Orbit", str(orbit), rows)


# -- sketches ---------------------------------------------------------------------------------------------------------


def _sketch(marks: Sequence[str]) -> str:
    """Return a small drawing on a base line; nothing where there is nothing to draw."""
    if not marks:
        return ""
    base = f'<path d="M0 {TALL - 1}H{WIDE}" stroke="currentColor" stroke-opacity="0.4"/>'
    return f'<svg width="{WIDE}" height="{TALL}">{base}{"".join(marks)}</svg>'


def _line(x: ArrayLike, y: ArrayLike) -> str:
    """Return a curve over the whole sketch: in each column its lowest and highest value."""
    heights = np.asarray(y, dtype=float)
    known = np.isfinite(heights)
    if len(heights) < 2 or not known.any():
        return ""
    low, high = float(heights[known].min()), float(heights[known].max())
    column = np.minimum((np.arange(len(heights)) * POINTS) // len(heights), POINTS - 1)
    places = []
    for number in range(POINTS):
        here = heights[(column == number) & known]
        if len(here):
            ends = (here[0], here.min(), here.max()) if len(here) > 2 else here
            places += [(number * WIDE / POINTS, value) for value in ends]
    scale = (TALL - 6) / (high - low or 1.0)
    path = " ".join(f"{across:.1f},{TALL - 3 - scale * (value - low):.1f}" for across, value in places)
    return f'<polyline points="{path}" fill="none" stroke="{BLUE}" stroke-width="1.2"/>'


def _stems(x: FloatArray, y: FloatArray) -> list[str]:
    """Return upright lines at shares of the sketch's width, of shares of its height; of many the highest."""
    chosen = np.sort(np.argsort(-y, kind="stable")[:POINTS])
    path = "".join(f"M{x[i] * WIDE:.1f} {TALL - 1}V{TALL - 1 - (TALL - 6) * y[i]:.1f}" for i in chosen)
    return [f'<path d="{path}" stroke="{BLUE}" stroke-width="1.5"/>']
