"""Pictures of trains: static and largest forces of all axles or wheels, and those that raised alarms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.faces.panels import BLUE, RED, legend_above, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {"left": BLUE, "right": "#17a2b8"}
MOST_NAMES = 40
"""Most axles whose numbers are all written."""


def draw_train(train: TrainFinding) -> Figure:
    """Draw for each axle, or each wheel, its static force as a bar and its largest force as a mark above."""
    rows = train.table()
    sides = list(dict.fromkeys(row.get("side") or "" for row in rows))
    axles = sorted({row["axle"] for row in rows})
    figure, (forces, ratios) = panels(2, 6.5, min(16.0, 5.0 + 0.25 * len(axles)), sharex=True, height_ratios=(2, 1))
    width = 0.8 / len(sides)
    for number, side in enumerate(sides):
        of_side = [row for row in rows if (row.get("side") or "") == side]
        x = np.array([row["axle"] for row in of_side]) + (number - 0.5 * (len(sides) - 1)) * width
        static, peak = (np.array([row[key] for row in of_side], dtype=float) for key in ("static_kn", "peak_kn"))
        alarmed = np.array([bool(row["alarms"]) for row in of_side])
        colour = COLOURS.get(side, BLUE)
        forces.bar(x, np.nan_to_num(static), 0.9 * width, color=colour, alpha=0.5, label=f"{side} static".strip())
        label = f"{side} largest".strip()
        forces.plot(x, peak, "_", color=colour, markersize=8, markeredgewidth=2, label=label)
        ratios.plot(x, peak / static, "o", color=colour, markersize=3)
        if alarmed.any():
            forces.plot(x[alarmed], peak[alarmed], "v", color=RED, markersize=6,
                        label=None if "alarm" in forces.get_legend_handles_labels()[1] else "alarm")  # fmt: skip
            ratios.plot(x[alarmed], (peak / static)[alarmed], "v", color=RED, markersize=5)
    if len(axles) <= MOST_NAMES:
        ratios.set_xticks(axles)
    per = "wheel" if any(row.get("side") for row in rows) else "wheelset"
    forces.set(ylabel=f"force per {per} [kN]", ylim=(0.0, None))
    ratios.set(xlabel="axle [number]", ylabel="largest over static", ylim=(0.0, None))
    legend_above(forces, 5)
    named = f"{train.name}: " if train.name else ""
    figure.suptitle(f"{named}{len(axles)} axles, {len(train.alarms)} alarms", x=0.02, ha="left")
    return figure
