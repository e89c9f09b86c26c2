"""Pictures of diagnoses: the evidence of a finding, the performance of a site, the choice of a design."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.diagnosis.faults.base import fault_named
from wheeltapper.diagnosis.finding import NOT_EXPLAINED, Finding
from wheeltapper.diagnosis.inference.estimate import onset
from wheeltapper.diagnosis.performance import FaultPerformance, Performance
from wheeltapper.diagnosis.site.design import Design
from wheeltapper.faces.panels import BLUE, RED, in_unit, legend_above, with_unit, words
from wheeltapper.lower.build import courses_of, path_table
from wheeltapper.lower.numbers import METHODS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLOSE = 0.04
"""Length of the part of the recording in the second panel, s from the first strike."""
ERRORS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Level curves of the error of the imitation, %."""
FEWEST = 4
"""Fewest rows of the panel of verdicts, so that a single bar is a bar."""
FAINT = 1e-4
"""Probability below which a verdict is not drawn."""


def draw_finding(finding: Finding) -> Figure:
    """Draw the recording with the best model, the residual, and the probability of each verdict."""
    from matplotlib.figure import Figure

    figure = Figure()
    draw_evidence(figure, finding)
    return figure


def draw_evidence(figure: Figure, finding: Finding) -> None:
    """Draw a finding into a figure."""
    figure.set_size_inches(9.0, 9.0)
    whole, close, left, verdicts = figure.subplots(4, 1, height_ratios=(2, 2, 1.4, 1.4))
    recording = finding.recording
    _draw_acceleration(whole, finding, recording.start, float(recording.times[-1]))
    begins = onset(recording, finding.noise)
    _draw_acceleration(close, finding, begins - 0.001, min(begins + CLOSE, float(recording.times[-1])))
    legend_above(whole)
    whole.set_title("the recording")
    close.set(xlabel="time after the trigger [ms]")
    close.set_title(f"from the first strike on, {1e3 * CLOSE:g} ms")
    if len(finding.model_acceleration):
        off = (recording.samples - finding.model_acceleration) / finding.noise
        left.plot(1e3 * recording.times, np.where(recording.clipped, np.nan, off), linewidth=0.6)
    left.set(xlabel="time after the trigger [ms]", ylabel="difference/noise")
    left.set_title("recording less model")
    shown = {name: p for name, p in finding.probabilities.items() if p > FAINT}
    bars = verdicts.barh(list(shown), list(shown.values()), height=0.6)
    verdicts.bar_label(bars, [f"{100.0 * p:.3g} %" for p in shown.values()], padding=3, fontsize=8)
    rows = max(len(shown), FEWEST)
    verdicts.set(xlabel="probability", xlim=(0.0, 1.1), ylim=(rows - 0.5, -0.5))
    figure.suptitle(f"{Path(finding.recording.source).name}: {finding.verdict}", fontsize=10)


def _draw_acceleration(axis: Axes, finding: Finding, start: float, end: float) -> None:
    recording = finding.recording
    part = (recording.times >= start) & (recording.times <= end)
    times = 1e3 * recording.times[part]
    axis.plot(times, recording.samples[part], color="0.75", linewidth=2.5, label="measured")
    clipped = recording.clipped[part]
    if clipped.any():
        axis.plot(times[clipped], recording.samples[part][clipped], "x", markersize=3, color=RED, label="clipped")
    if len(finding.model_acceleration):
        label = "nearest model" if finding.verdict == NOT_EXPLAINED else "best model"
        axis.plot(times, finding.model_acceleration[part], color=RED, linewidth=0.9, linestyle="--", label=label)
    axis.set_ylabel("deck acceleration [m/s²]")


def draw_performance(performance: Performance) -> Figure:
    """Draw the receiver operating characteristic of each fault, and the probability of detection against size."""
    from matplotlib.figure import Figure

    with_size = {name: found for name, found in performance.faults.items() if found.hit_miss is not None}
    figure = Figure(figsize=(5.0 * (1 + len(with_size)), 4.6))
    axes = np.atleast_1d(figure.subplots(1, 1 + len(with_size)))
    for number, (name, found) in enumerate(performance.faults.items()):
        axes[0].step(
            found.roc.false_call_rate, found.roc.detection_rate, where="post", label=f"{name} {found.roc.auc:.4f}",
            linewidth=1.0 + 1.5 * (len(performance.faults) - 1 - number), alpha=0.8,
        )  # fmt: skip
    axes[0].set(xlabel="false-call rate", ylabel="detection rate", title="ROC, with its area")
    axes[0].set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))
    _legend_below(axes[0])
    for axis, (name, found) in zip(axes[1:], with_size.items(), strict=True):
        _draw_detection(axis, name, found)
    return figure


def _legend_below(axis: Axes) -> None:
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=8)


def _reached(size: float, factor: float) -> str:
    return f"{factor * size:.3g}" if np.isfinite(size) else "not reached"


def _draw_detection(axis: Axes, name: str, found: FaultPerformance) -> None:
    sizes = np.array([passage.size for passage in found.passages])
    factor, unit = in_unit(sizes, fault_named(name).unit)
    hits = np.array([passage.named for passage in found.passages])
    axis.plot(factor * sizes, np.where(hits, 1.02, -0.02), "|", color="0.5", label="passages, named or not")
    x = np.linspace(float(sizes.min()), float(sizes.max()), 200)
    for by, pod in (("hit/miss", found.hit_miss), ("signal response", found.signal_response)):
        if pod is None:
            continue
        label = f"{by}: a90 {_reached(pod.a90, factor)}, a90/95 {_reached(pod.a90_95, factor)}"
        (line,) = axis.plot(factor * x, pod.at(x), label=label)
        axis.plot(factor * x, pod.lower(x), color=line.get_color(), linestyle=":", label=f"{by}: 95 % lower bound")
    axis.set(xlabel=with_unit("size", unit), ylabel="probability of detection", title=name, ylim=(-0.05, 1.05))
    _legend_below(axis)


def draw_imitation(shown: xr.Dataset) -> Figure:
    """Draw the error of decks as scales of the force, over mass and stiffness, for each frequency."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    many = shown.sizes["frequency"]
    figure = Figure(figsize=(4.2 * many, 4.2))
    for axis, frequency in zip(np.atleast_1d(figure.subplots(1, many, sharey=True)), shown.frequency, strict=True):
        error = 100.0 * shown.error.sel(frequency=frequency)
        x, y = shown["track.mass"] / 1e3, shown["track.stiffness"] / 1e6
        axis.set(xscale="log", yscale="log")
        curves = axis.contour(x, y, error.transpose("track.stiffness", "track.mass"), levels=ERRORS, colors=BLUE)
        axis.clabel(curves, fontsize=7, fmt="%g %%", colors="black")
        axis.set(xlabel="deck's mass [t]", title=f"at {float(frequency):g} Hz")
        for ticked, values in ((axis.xaxis, x), (axis.yaxis, y)):
            several = float(values.max() / values.min()) > 10.0
            ticked.set_major_locator(LogLocator(subs=(1.0,) if several else (1.0, 2.0, 5.0)))
            ticked.set_major_formatter(StrMethodFormatter("{x:g}"))
            ticked.set_minor_formatter(NullFormatter())
    figure.axes[0].set_ylabel("deck's stiffness [kN/mm]")
    figure.suptitle("error of the deck as a scale of the dynamic force")
    return figure


def draw_design(design: Design) -> Figure:
    """Draw the designed rail, and all layouts that were judged: criterion over largest force and over total length."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 7.0))
    whole = figure.add_gridspec(2, 2)
    rail = figure.add_subplot(whole[0, :])
    passage = design.site.passage
    end = max(one.start + one.length for one in design.best.layout.features) + 0.1
    x = np.linspace(0.0, end, 4001)
    height, _ = path_table(courses_of(passage), end, METHODS["default"], "point", passage.vehicle.radius, None)
    rail.plot(x, 1e3 * height.height_at(x))
    rail.set(xlabel="position [m]", ylabel="rail [mm]")
    chart = design.chart()
    worse = "worst_interval" if design.criterion == "worst interval" else "determinant"
    for column, (name, scale, label) in enumerate(
        (("largest_force", 1e-3, "largest force [kN]"), ("total_length", 1.0, "total length [m]"))
    ):
        axis = figure.add_subplot(whole[1, column])
        for kind in ("designed", "alike", "repeated", "single"):
            own = chart.isel(candidate=chart.kind.values == kind)
            axis.plot(scale * own[name], own[worse], ".", markersize=5, label=kind)
        front = design.front("largest_force" if name == "largest_force" else "total_length")
        values = [one.worst if design.criterion == "worst interval" else one.determinant for one in front]
        ends = [scale * getattr(one, name) for one in front]
        axis.step(ends, values, where="post", color="black", linewidth=1.0, label="front")
        best = design.best
        reached = best.worst if design.criterion == "worst interval" else best.determinant
        axis.plot([scale * getattr(best, name)], [reached], "*", color=RED, markersize=12, label="chosen", zorder=5)
        axis.set(xlabel=label, ylabel=design.criterion, yscale="log")
    handles, names = figure.axes[-1].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=6, fontsize=8)
    said = str(design)
    for path in design.information.paths:
        said = said.replace(path, words(path))
    figure.suptitle("\n".join(textwrap.wrap(said, 130)), fontsize=8)
    return figure
