"""Pictures of what axle boxes recorded: the wheel's average turn, its orders, and the rail's part along the track."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.diagnosis.axle_box.finding import AxleBoxFinding
from wheeltapper.faces.panels import BLUE, RED, legend_above, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_axle_box(finding: AxleBoxFinding) -> Figure:
    """Draw the average turn with the fitted flat, the orders of the wheel, and what is left along the track."""
    figure, (turn, orders, rail) = panels(3, 8.0)
    count, best, wheel = len(finding.average), finding.seen.best, finding.wheel
    part = np.arange(count) / count
    low, high = finding.average - 2.0 * finding.error, finding.average + 2.0 * finding.error
    turn.fill_between(part, low, high, color=BLUE, alpha=0.3, linewidth=0.0)
    turn.plot(part, finding.average, color=BLUE, linewidth=1.0, label=f"average of {wheel.turns.whole} turns")
    if best is not None:
        turn.plot(part, best.average, color=RED, linewidth=0.7, label=f"{best.shape} flat, {1e3 * best.length:.1f} mm")
    turn.set(xlabel="part of the wheel's turn", ylabel="acceleration [m/s²]")
    legend_above(turn)
    found = finding.seen.orders
    number = np.arange(1, len(found.amplitudes) + 1)
    orders.bar(number, 1e6 * found.amplitudes, yerr=2e6 * found.deviations, color=BLUE, ecolor="0.4")
    orders.set(xlabel="order", ylabel="amplitude [µm]", yscale="log")
    x = np.arange(len(finding.left)) * wheel.speed / finding.recording.rate
    rail.plot(x, finding.left, color=BLUE, linewidth=0.5)
    for one in finding.joints:
        rail.annotate(
            f"{1e3 * one.height:.2f} mm", (one.place, one.peak), (0, 3), textcoords="offset points", color=RED,
            ha="center", fontsize=7,
        )  # fmt: skip
    rail.set(xlabel="place after the first sample [m]", ylabel="left of it [m/s²]")
    rail.margins(y=0.15)
    figure.suptitle(f"axle box: {finding.verdict}", x=0.02, ha="left")
    return figure
