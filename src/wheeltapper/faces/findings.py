"""Pictures of diagnoses: the evidence of a finding, the performance of a site, the choice of a design."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.diagnosis.finding import NOT_EXPLAINED, Finding
from wheeltapper.diagnosis.inference.identify import onset
from wheeltapper.diagnosis.performance import FaultPerformance, Performance
from wheeltapper.diagnosis.site.design import Design
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
FAINT = 1e-4
"""Probability below which a verdict is not drawn."""


def draw_finding(finding: Finding) -> Figure:
    """Draw the recording with the best model, the residual, and the probability of each verdict."""
    from matplotlib.figure import Figure

    figure = Figure()
    evidence(figure, finding)
    return figure


def evidence(figure: Figure, finding: Finding) -> None:
    """Draw a finding into a figure."""
    figure.set_size_inches(9.0, 9.0)
    whole, close, left, verdicts = figure.subplots(4, 1, height_ratios=(2, 2, 1.4, 1.4))
    recording = finding.recording
    _acceleration(whole, finding, recording.start, float(recording.times[-1]))
    begins = onset(recording, finding.noise)
    _acceleration(close, finding, begins - 0.001, min(begins + CLOSE, float(recording.times[-1])))
    whole.legend(loc="lower right", ncols=3)
    if len(finding.model_acceleration):
        off = (recording.samples - finding.model_acceleration) / finding.noise
        left.plot(1e3 * recording.times, np.where(recording.clipped, np.nan, off), linewidth=0.6)
    left.set(xlabel="time after the trigger [ms]", ylabel="difference over noise")
    shown = {name: p for name, p in finding.probabilities.items() if p > FAINT}
    verdicts.barh(list(shown), list(shown.values()))
    verdicts.invert_yaxis()
    verdicts.set(xlabel="probability", xlim=(0.0, 1.0))
    figure.suptitle(f"{Path(finding.recording.source).name}: {finding.verdict}", fontsize=10)


def _acceleration(axis: Axes, finding: Finding, start: float, end: float) -> None:
    recording = finding.recording
    part = (recording.times >= start) & (recording.times <= end)
    times = 1e3 * recording.times[part]
    axis.plot(times, recording.samples[part], color="0.75", linewidth=2.5, label="measured")
    clipped = recording.clipped[part]
    if clipped.any():
        axis.plot(times[clipped], recording.samples[part][clipped], "x", markersize=3, color="C3", label="clipped")
    if len(finding.model_acceleration):
        label = "nearest model" if finding.verdict == NOT_EXPLAINED else "best model"
        axis.plot(times, finding.model_acceleration[part], color="C1", linewidth=0.9, linestyle="--", label=label)
    axis.set_ylabel("deck acceleration [m/s²]")


def draw_performance(performance: Performance) -> Figure:
    """Draw the receiver operating characteristic of each fault, and the probability of detection against size."""
    from matplotlib.figure import Figure

    with_size = {name: found for name, found in performance.faults.items() if found.hit_miss is not None}
    figure = Figure(figsize=(5.0 * (1 + len(with_size)), 4.6))
    axes = np.atleast_1d(figure.subplots(1, 1 + len(with_size)))
    for name, found in performance.faults.items():
        axes[0].step(
            found.roc.false_call_rate, found.roc.detection_rate, where="post", label=f"{name} {found.roc.auc:.4f}"
        )
    axes[0].set(xlabel="false-call rate", ylabel="detection rate", title="ROC, with its area")
    axes[0].legend(loc="lower right")
    for axis, (name, found) in zip(axes[1:], with_size.items(), strict=True):
        _detection(axis, name, found)
    return figure


def _detection(axis: Axes, name: str, found: FaultPerformance) -> None:
    sizes = np.array([passage.size for passage in found.passages])
    hits = np.array([passage.named for passage in found.passages])
    axis.plot(sizes, np.where(hits, 1.02, -0.02), "|", color="0.5")
    x = np.linspace(float(sizes.min()), float(sizes.max()), 200)
    for words, pod in (("hit/miss", found.hit_miss), ("signal response", found.signal_response)):
        if pod is None:
            continue
        (line,) = axis.plot(x, pod.at(x), label=f"{words}: a90 {pod.a90:.3g}, a90/95 {pod.a90_95:.3g}")
        axis.plot(x, pod.lower(x), color=line.get_color(), linestyle=":")
    axis.set(xlabel="size", ylabel="probability of detection", title=name)
    axis.legend(loc="lower right")


def draw_imitation(shown: xr.Dataset) -> Figure:
    """Draw the error of decks as scales of the force, over mass and stiffness, for each frequency."""
    from matplotlib.figure import Figure

    many = shown.sizes["frequency"]
    figure = Figure(figsize=(4.2 * many, 4.2))
    for axis, frequency in zip(np.atleast_1d(figure.subplots(1, many, sharey=True)), shown.frequency, strict=True):
        error = 100.0 * shown.error.sel(frequency=frequency)
        x, y = shown["track.mass"] / 1e3, shown["track.stiffness"] / 1e6
        curves = axis.contour(x, y, error.transpose("track.stiffness", "track.mass"), levels=ERRORS)
        axis.clabel(curves, fontsize=7, fmt="%g %%")
        axis.set(
            xscale="log", yscale="log", xlabel="deck's mass [t]", title=f"error of the force at {float(frequency):g} Hz"
        )
    figure.axes[0].set_ylabel("deck's stiffness [kN/mm]")
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
    rail.plot(x, 1e3 * height.height(x))
    rail.set(xlabel="position [m]", ylabel="rail [mm]")
    chart = design.chart()
    worse = "worst_interval" if design.criterion == "worst interval" else "determinant"
    for column, (name, scale, label) in enumerate(
        (("largest_force", 1e-3, "largest force [kN]"), ("total_length", 1.0, "total length [m]"))
    ):
        axis = figure.add_subplot(whole[1, column])
        for kind in ("designed", "alike", "repeated", "single"):
            own = chart.isel(candidate=chart.kind.values == kind)
            axis.plot(scale * own[name], own[worse], ".", markersize=2, label=kind)
        front = design.front("largest_force" if name == "largest_force" else "total_length")
        values = [one.worst if design.criterion == "worst interval" else one.determinant for one in front]
        axis.step([scale * getattr(one, name) for one in front], values, where="post", color="black", linewidth=1.0)
        axis.set(xlabel=label, ylabel=design.criterion, yscale="log")
    figure.axes[-1].legend(loc="lower right", markerscale=4)
    figure.suptitle(str(design), fontsize=8, wrap=True)
    return figure
