"""Pictures of statistics: probability of detection, ROC curves, and how well fields are known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.diagnosis.detection.detection import Detection
from wheeltapper.diagnosis.detection.roc import FalseCalls, Roc
from wheeltapper.diagnosis.inference.combinations import Combinations
from wheeltapper.diagnosis.inference.estimate import Estimate
from wheeltapper.diagnosis.inference.information import Information
from wheeltapper.faces.panels import BLUE, COLOURS, RED, legend_above, panels, words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST, MOST = 1e-6, 1e3
"""Range of standard deviations that are drawn, over the values."""


def draw_detection(found: Detection) -> Figure:
    """Draw the probability of detection over the size, with its lower 95 % bound."""
    figure, (axis,) = panels()
    ends = [size for size in (found.size(0.02 * found.ceiling), found.size(0.99 * found.ceiling)) if np.isfinite(size)]
    low, high = (ends[0], ends[-1]) if len(ends) == 2 and ends[0] < ends[1] else (1e-3, 1.0)
    sizes = np.geomspace(low, 2.0 * high, 200) if found.scale == "log" else np.linspace(low, 1.5 * high, 200)
    axis.plot(sizes, found.at(sizes), color=BLUE, label="estimate")
    axis.plot(sizes, found.lower(sizes), "--", color=RED, label="lower 95 % bound")
    for name, size in (("a50", found.a50), ("a90", found.a90), ("a90/95", found.a90_95)):
        if np.isfinite(size) and size <= sizes[-1]:
            axis.axvline(size, color="0.5", linewidth=0.8, linestyle=":")
            axis.annotate(name, (size, 1.0), (2, 2), textcoords="offset points", fontsize=7, rotation=60)
    axis.set(xlabel="size [unit of the data]", ylabel="probability of detection", ylim=(-0.02, 1.02))
    legend_above(axis)
    reason = f": {found.reason}" if found.reason else ""
    figure.suptitle(f"{found.kind}, {found.specimens} inspections{reason}", x=0.02, ha="left", fontsize=9)
    return figure


def draw_roc(found: Roc) -> Figure:
    """Draw the detection rate over the false-call rate."""
    figure, (axis,) = panels(1, 4.5, 5.0)
    axis.step(found.false_call_rate, found.detection_rate, where="post", color=BLUE, label=f"area {found.auc:.4f}")
    axis.plot([0.0, 1.0], [0.0, 1.0], ":", color="0.5", label="by chance")
    axis.set(xlabel="false-call rate", ylabel="detection rate", xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))
    legend_above(axis)
    figure.suptitle(f"ROC of {found.healthy} healthy and {found.faulty} faulty wheels", x=0.02, ha="left", fontsize=9)
    return figure


def draw_false_calls(found: FalseCalls) -> Figure:
    """Draw the false calls per thousand axles with their interval."""
    figure, (axis,) = panels(1, 2.0)
    below, above = found.per_thousand - found.lower, found.upper - found.per_thousand
    axis.errorbar([found.per_thousand], [0], xerr=[[below], [above]], fmt="o", color=BLUE, capsize=4)
    axis.set_yticks([0], ["healthy axles"])
    axis.set(xlabel="false calls [1 per 1000 axles]", xlim=(0.0, None))
    figure.suptitle(f"{found.count} of {found.axles} axles, interval of {100 * found.level:g} %", x=0.02, ha="left")
    return figure


def draw_information(found: Information) -> Figure:
    """Draw the smallest relative standard deviation of each field, by the speed of the passage."""
    figure, (axis,) = panels(1, 1.4 + 0.3 * len(found.paths))
    rows = np.arange(len(found.paths))
    for number, (speed, deviations) in enumerate(zip(found.speeds, found.deviations, strict=True)):
        known = np.isfinite(deviations)
        axis.plot(
            100.0 * deviations[known], rows[known], "osd^v"[number % 5], color=COLOURS[number % len(COLOURS)],
            markersize=5, label=f"at {speed:g} m/s",
        )  # fmt: skip
    axis.set_yticks(rows, [words(path) for path in found.paths])
    axis.set(xscale="log", xlabel="smallest standard deviation [%]", ylim=(len(rows) - 0.5, -0.5))
    legend_above(axis, 4)
    figure.suptitle("how well recordings determine each field, all others being uncertain", x=0.02, ha="left")
    return figure


def draw_estimate(found: Estimate) -> Figure:
    """Draw the relative standard deviation of each estimated field, and how their errors are correlated."""
    from matplotlib.figure import Figure

    count = len(found.paths)
    spread = np.sqrt(np.diag(found.covariance))
    names = [words(path) for path in found.paths]
    figure = Figure(figsize=(11.0, 1.8 + 0.4 * count))
    bars, matrix = figure.subplots(1, 2)
    rows = np.arange(count)
    bars.barh(rows, 100.0 * np.clip(spread, LEAST, MOST), color=BLUE, height=0.6)
    bars.set_yticks(rows, names)
    bars.set(xscale="log", xlabel="standard deviation [%]; of a time [10 ms]", ylim=(count - 0.5, -0.5))
    shown = matrix.imshow(found.covariance / np.outer(spread, spread), cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    matrix.set_xticks(rows, [str(number + 1) for number in rows])
    matrix.set_yticks(rows, [f"{number + 1}: {name}" for number, name in enumerate(names)], fontsize=7)
    matrix.set_xlabel("field [number]")
    matrix.grid(False)
    figure.colorbar(shown, ax=matrix, label="correlation of the errors, ratio")
    state = "converged" if found.converged else "did not converge"
    figure.suptitle(f"estimate of {count} fields: χ² per sample {found.reduced:.3g}, {state}", x=0.02, ha="left")
    return figure


def draw_combinations(found: Combinations) -> Figure:
    """Draw how well combinations of fields are known, those that a recording cannot determine in red."""
    every = [(one, RED) for one in found.unknown] + [(one, BLUE) for one in found.known]
    figure, (axis,) = panels(1, 1.4 + 0.4 * max(len(every), 1), 10.0)
    rows = np.arange(len(every))
    axis.barh(rows, [100.0 * np.clip(one.deviation, LEAST, MOST) for one, _ in every],
              color=[colour for _, colour in every], height=0.6)  # fmt: skip
    named = [" · ".join(f"{words(path)}^{power:.3g}" for path, power in one.exponents.items()) for one, _ in every]
    axis.set_yticks(rows, named, fontsize=7)
    axis.set(xscale="log", xlabel="standard deviation [%]", ylim=(len(every) - 0.5, -0.5))
    figure.suptitle("products of powers: red not determined, blue known best", x=0.02, ha="left")
    return figure
