"""Pages: the templates, filled; each stands alone and asks for nothing from outside."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import groupby
from operator import itemgetter
from statistics import median
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from wheeltapper._version import __version__
from wheeltapper.diagnosis.alarms import together
from wheeltapper.diagnosis.train import TrainFinding, cell_text
from wheeltapper.diagnosis.wayside.measure import NO_FORCE, NO_STRIKES, STRIKES
from wheeltapper.faces.report.answers import FINDINGS, FLAWED, Train
from wheeltapper.faces.report.drawing import drawing_of
from wheeltapper.faces.report.flats import Flat

if TYPE_CHECKING:
    from jinja2 import Environment

MARKS = {
    "stop": ("stop", "S"), "maintain": ("maintain", "M"), "warning": ("warning", "W"),
    FLAWED: ("flaw", "F"), STRIKES: ("strikes", "*"),
    NO_STRIKES: ("fine", ""), NO_FORCE: ("none", "?"),
}  # fmt: skip
"""Class in the style sheet, and mark in a wheel, of each finding."""
COURSES = 24
"""Largest number of wheels whose courses over the passages a page shows."""
LEFT_OUT = ("peak_kips", "dynamic_increment", "forces_from")
"""Columns of a train's table that a page leaves out; the table beside it has all."""
FIRST = ("vehicle", "axle", "side", "alarms", "verdict")
"""Columns with which a page's table begins, in sight of every window."""
LATEST = 1000
"""Largest number of recordings in the index; the table beside it has all."""
SPARK = (150.0, 26.0, 4.0)
"""Width, height and margin of the picture of a course, pixels."""
INSIDE = re.compile(r" (?=±|[mu]m\b)|(?<=±) ")
"""Spaces inside a size with its unit and half its interval, at which no line ends."""


@cache
def _templates() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    held = Environment(
        loader=PackageLoader("wheeltapper.faces.report"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    held.filters |= {
        "number": lambda value, digits: cell_text(value, f".{digits}f"),
        "signed": lambda value, digits: cell_text(value, f"+.{digits}f"),
        "scaled": lambda value, factor, digits: cell_text(None if value is None else factor * value, f".{digits}f"),
        "cell": lambda value, form: INSIDE.sub("\u00a0", cell_text(value, form)),
        "shade": lambda finding: MARKS[finding][0],
        "letter": lambda finding: MARKS[finding][1],
    }
    held.globals |= {"version": __version__, "findings": FINDINGS}
    return held


SUMMARY = (
    "axles", "vehicles", "speed_kmh", "direction", "load_kn", "highest_ratio", "findings", "alarms", "notes",
)  # fmt: skip
"""What the summary of every train has."""


def summary_of(train: Train) -> dict[str, Any]:
    """Return a train as one row of the index."""
    finding, wheels = train.finding, train.wheels
    loads = [axle["static_force"] for axle in finding.axles]
    ratios = [row["dynamic_ratio"] for row in wheels if row["dynamic_ratio"] is not None]
    kinds = [row["finding"] for row in wheels]
    return {
        "axles": len(finding.axles),
        "vehicles": len(finding.vehicles),
        "speed_kmh": 3.6 * float(median(axle["speed"] for axle in finding.axles)),
        "direction": finding.axles[0]["direction"],
        "load_kn": None if None in loads else 1e-3 * sum(loads),
        "highest_ratio": max(ratios, default=None),
        "findings": {name: kinds.count(name) for name in FINDINGS if name in kinds},
        "alarms": len(finding.alarms),
        "notes": list(finding.notes),
    }


def train_page(
    train: Train, number: int, passed: tuple[str, bool], identities: Mapping[tuple[int, str | None], str],
    courses: Sequence[Mapping[str, Any]], flats: Sequence[Flat], notes: Sequence[str],
) -> str:  # fmt: skip
    """Return the page of a train.

    Parameters
    ----------
    train, number
        The train, and its number in the recording.
    passed
        Time of the passage, and whether the recording states it.
    identities
        Names of its wheels, by axle and side.
    courses, flats
        Of these wheels, `courses_of` and `flats_of`.
    notes
        What else is to be said.
    """
    finding = train.finding
    rows = {(row["axle"], row["side"]): row for row in train.wheels}
    pictures: list[dict[str, Any]] = [
        {"axle": one.axle, "side": one.side, "row": rows[one.axle, one.side], "uri": _data_uri(one.svg),
         "model": _data_uri(one.model) if one.model else "", "said": one.said,
         "identity": identities.get((one.axle, one.side))}
        for one in train.pictures
    ]  # fmt: skip
    return _templates().get_template("train.html").render(
        title=f"{finding.name}, {finding.site.name}", name=finding.name, number=number, site=finding.site.name,
        passed=passed[0], stated=passed[1], summary=summary_of(train), pictures=pictures, alarms=finding.alarms,
        untested=together(finding.untested), kept=_kept(finding),
        bad=any(one["row"]["finding"] not in (NO_STRIKES, NO_FORCE) for one in pictures), rules=finding.rules,
        drawing=drawing_of(finding.axles, finding.vehicles, train.wheels), wheels=train.wheels,
        columns=_columns(finding),
        vehicles=finding.vehicles, notes=[*notes, *finding.notes],
        courses=courses[:COURSES], known=len(courses), flats=flats[:COURSES],
    )  # fmt: skip


def _columns(finding: TrainFinding) -> list[tuple[str, str, str]]:
    """Return the columns of a page's table of wheels, from those that are read first."""
    shown = [column for column in finding.columns() if column[0] not in LEFT_OUT]
    return sorted(shown, key=lambda column: FIRST.index(column[0]) if column[0] in FIRST else len(FIRST))


def _kept(finding: TrainFinding) -> list[str]:
    """Return the names of the rules that were measured in full."""
    lost = {one.rule.name for one in finding.untested}
    return [rule.name for rule in finding.rules if rule.name not in lost]


def index_page(
    site: str, recordings: Sequence[Mapping[str, Any]], counts: Mapping[str, int],
    courses: Sequence[Mapping[str, Any]], flats: Sequence[Flat], others: Sequence[str],
) -> str:  # fmt: skip
    """Return the index: recordings (the latest first), how many have each answer, courses, and what is no recording."""
    return _templates().get_template("index.html").render(
        title=site or "trains", recordings=recordings, counts=counts, total=sum(counts.values()),
        courses=courses[:COURSES], known=len(courses), flats=flats[:COURSES], others=others,
    )  # fmt: skip


def _data_uri(svg: str) -> str:
    return f"data:image/svg+xml,{quote(svg)}"


# -- wheels over their passages ---------------------------------------------------------------------------------------


def courses_of(passages: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each wheel's course over its passages, those first whose peak over mean rose most since their median.

    `passages` are rows of wheels with an identity, in the order of the identities and then of time. Wheels with fewer
    than two passages that show a force have no course.
    """
    out = []
    for identity, rows in groupby(passages, key=itemgetter("identity")):
        shown = [row for row in rows if row["static_force"]]
        if len(shown) < 2:
            continue
        ratios = [row["largest_force"] / row["static_force"] for row in shown]
        before, last = median(ratios[:-1]), shown[-1]
        points = _spark(ratios)
        out.append({
            "identity": identity, "passages": len(shown), "before": before, "last": ratios[-1],
            "change": ratios[-1] - before, "passed": last["passed"], "page": last["page"], "finding": last["finding"],
            "mean_before": 1e-3 * median(row["static_force"] for row in shown[:-1]),
            "mean_last": 1e-3 * last["static_force"],
            "points": " ".join(f"{x:.1f},{y:.1f}" for x, y in points), "end": [round(part, 1) for part in points[-1]],
        })  # fmt: skip
    return sorted(out, key=lambda one: -one["change"])


def _spark(values: Sequence[float]) -> list[tuple[float, float]]:
    """Return a course as points of a small picture, pixels: the lowest value is 1, that of a force without dynamics."""
    width, height, margin = SPARK
    low, high = min(1.0, *values), max(1.5, *values)
    x_step, y_step = (width - 2 * margin) / (len(values) - 1), (height - 2 * margin) / (high - low)
    return [(margin + x_step * i, height - margin - y_step * (value - low)) for i, value in enumerate(values)]
