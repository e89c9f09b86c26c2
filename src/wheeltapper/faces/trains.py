"""Pictures of trains: static and largest forces of all axles or wheels, and those that raised alarms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.faces.panels import BLUE, RED, legend_above, panels
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"left": BLUE, "right": "#17a2b8"}
STRIKE = "#d68910"
MOST_NAMES, MOST = 40, 8
"""Most axles whose numbers are all written, and most trains in a picture."""


def draw_train(train: TrainFinding) -> Figure:
    """Draw for each axle, or each wheel, its static force as a bar and its largest force as a mark above.

    Wheels that strike have a star, at the force of the hardest strike.
    """
    rows = train.table()
    figure, (forces, ratios) = panels(2, 6.5, _width([train]), sharex=True, height_ratios=(2, 1))
    _draw_forces(forces, rows)
    known = [(x, row) for x, row in _places(rows) if row["dynamic_ratio"] is not None]
    for x, row in known:
        colour, mark = COLOURS.get(row.get("side") or "", BLUE), "o"
        if row["alarms"] or row.get("strikes"):
            colour, mark = (RED, "v") if row["alarms"] else (STRIKE, "*")
        ratios.plot([x], [row["dynamic_ratio"]], mark, color=colour, markersize=7 if mark == "*" else 4)
    top = max((row["dynamic_ratio"] for _, row in known), default=1.0)
    ratios.set(xlabel="axle [number]", ylabel="largest over static", ylim=(0.0, 1.1 * top))
    figure.suptitle(_words(train), x=0.02, ha="left")
    return figure


def draw_trains(trains: Sequence[TrainFinding]) -> Figure:
    """Draw the forces of several trains, each in a panel of its own."""
    if len(trains) > MOST:
        raise InputError("", "what", f"a list of {len(trains)}", f"1 to {MOST} trains")
    figure, axes = panels(len(trains), 1.0 + 3.0 * len(trains), _width(trains))
    for axis, train in zip(axes, trains, strict=True):
        _draw_forces(axis, train.table())
        axis.set_title(_words(train))
        axis.set_xlabel("axle [number]")
    figure.suptitle(f"{len(trains)} trains", x=0.02, ha="left")
    return figure


def _width(trains: Sequence[TrainFinding]) -> float:
    return min(16.0, 5.0 + 0.25 * max(len(train.axles) for train in trains))


def _words(train: TrainFinding) -> str:
    named = f"{train.name}: " if train.name else ""
    struck = sum(bool(row.get("strikes")) for row in train.table())
    strikes = f", {struck} {'wheel strikes' if struck == 1 else 'wheels strike'}" if struck else ""
    return f"{named}{len(train.axles)} axles{strikes}, {len(train.alarms)} alarms"


def _sides(rows: Sequence[dict[str, Any]]) -> list[str]:
    return list(dict.fromkeys(row.get("side") or "" for row in rows))


def _places(rows: Sequence[dict[str, Any]]) -> Iterator[tuple[float, dict[str, Any]]]:
    """Yield the place of each row's bar beside those of the same axle, and the row."""
    sides = _sides(rows)
    for row in rows:
        number = sides.index(row.get("side") or "")
        yield row["axle"] + (number - 0.5 * (len(sides) - 1)) * 0.8 / len(sides), row


def _draw_forces(axis: Axes, rows: Sequence[dict[str, Any]]) -> None:
    sides = _sides(rows)
    for side in sides:
        mine = [(x, row) for x, row in _places(rows) if (row.get("side") or "") == side]
        x = np.array([place for place, _ in mine])
        static, peak = (np.array([row[key] for _, row in mine], dtype=float) for key in ("static_kn", "peak_kn"))
        colour = COLOURS.get(side, BLUE)
        axis.bar(x, np.nan_to_num(static), 0.72 / len(sides), color=colour, alpha=0.5, label=f"{side} static".strip())
        label = f"{side} largest".strip()
        axis.plot(x, peak, "_", color=colour, markersize=8, markeredgewidth=2, label=label)
    struck = [(x, row["strike_kn"]) for x, row in _places(rows) if row.get("strikes")]
    if struck:
        axis.plot(*np.array(struck).T, "*", color=STRIKE, markersize=8, label="hardest strike")
    alarmed = [(x, row["peak_kn"]) for x, row in _places(rows) if row["alarms"] and row["peak_kn"] is not None]
    if alarmed:
        axis.plot(*np.array(alarmed).T, "v", color=RED, markersize=6, label="alarm")
    axles = sorted({row["axle"] for row in rows})
    if len(axles) <= MOST_NAMES:
        axis.set_xticks(axles)
    per = "wheel" if sides != [""] else "wheelset"
    axis.set(ylabel=f"force per {per} [kN]", ylim=(0.0, None))
    legend_above(axis, 3)
