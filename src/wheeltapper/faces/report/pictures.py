"""The evidence of a wheel as a picture: what each sensor read of it, its mean, its peak and its strikes."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure

from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.wayside.wheels import Trace
from wheeltapper.faces.gauges import draw_wheel
from wheeltapper.faces.panels import BLUE, RED, legend_above
from wheeltapper.faces.plot import STYLE


def evidence(row: Mapping[str, Any], wheel: Mapping[str, Any], traces: Sequence[Trace]) -> str:
    """Return a picture of a wheel as an SVG: its force over its place along the track.

    Parameters
    ----------
    row, wheel
        The wheel's row of the train's table, and its entry in the train's JSON.
    traces
        What the sensors of its rail read.
    """
    with _drawn():
        figure = Figure(figsize=(9.0, 2.6))
        axis = figure.subplots()
        for number, trace in enumerate(traces):
            axis.plot(
                trace.x, 1e-3 * trace.force, color=BLUE, linewidth=0.9, label="" if number else "sensors, below 500 Hz"
            )
        axis.axhline(row["static_kn"], color="0.4", linestyle="--", linewidth=0.9, label="mean")
        axis.axhline(row["peak_kn"], color=RED, linestyle=":", linewidth=0.9, label="peak between gauges")
        for number, strike in enumerate(wheel["strikes"]):
            high = 1e-3 * (wheel["static_force"] + strike["excess"])
            label = "" if number else "strike, below 2 kHz"
            axis.plot([strike["x"]], [high], "v", color=RED, markersize=6, label=label)
        if wheel["repeats_after"] and wheel["strikes"]:
            _mark_turns(axis, wheel, traces)
        axis.set(xlabel="place along the track [m]", ylabel="force [kN]")
        axis.set_title(f"axle {row['axle']} {row['side'] or ''}".rstrip())
        legend_above(axis, 5)
        return _as_svg(figure)


def fitted_evidence(finding: WheelFinding) -> str:
    """Return a picture of a wheel's fitted model as an SVG."""
    with _drawn():
        figure = Figure()
        draw_wheel(figure, finding)
        return _as_svg(figure)


@contextmanager
def _drawn() -> Iterator[None]:
    """Draw as all pictures of the package are drawn, to the same text each time."""
    with matplotlib.style.context(STYLE), matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "report"}):
        yield


def _as_svg(figure: Figure) -> str:
    written = io.StringIO()
    figure.savefig(written, format="svg", metadata={"Date": None, "Creator": None})
    return written.getvalue()


def _mark_turns(axis: Any, wheel: Mapping[str, Any], traces: Sequence[Trace]) -> None:
    """Draw where the place on the wheel that struck hardest meets the rail."""
    first = max(wheel["strikes"], key=lambda one: one["excess"])["x"]
    ends = min(trace.x.min() for trace in traces), max(trace.x.max() for trace in traces)
    turn = wheel["repeats_after"]
    turns = np.arange(np.ceil((ends[0] - first) / turn), np.floor((ends[1] - first) / turn) + 1)
    for number, x in enumerate(first + turn * turns):
        axis.axvline(x, color=RED, alpha=0.3, linewidth=3.0, label="" if number else f"every {turn:.2f} m")
