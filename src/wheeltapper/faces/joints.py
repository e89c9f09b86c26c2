"""Pictures of a joint's forces over speed, of a limit, and of a run beside its limits."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.faces.panels import BLUE, GREEN, RED, legend_above, panels
from wheeltapper.ground.errors import InputError
from wheeltapper.record.limits.comparison import LimitCheck
from wheeltapper.record.limits.rule import QUANTITIES, Rule

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

LINES = {
    "P1": ("P1, first maximum", BLUE, "o-"),
    "P1_jenkins": ("P1, Jenkins", BLUE, "--"),
    "P2": ("P2, below {cutoff:g} Hz", RED, "s-"),
    "P2_jenkins": ("P2, Jenkins", RED, "--"),
    "largest_force": ("largest", GREEN, ":"),
}
"""Label, colour and line of each force."""
HEAVIEST = {"wheel": 150e3, "axle": 300e3, "vehicle": 1.5e6, "train": 4e7}
"""Largest static force over which a limit is drawn, N."""
DIAMETERS, FASTEST = (0.3, 1.3), 400.0
"""Diameters of wheels (m) and speeds (km/h) among which a limit is shown to apply."""
UNITS = {"force": (1e-3, "kN"), "length": (1e3, "mm"), "speed": (3.6, "km/h"), "number": (1.0, "ratio")}
"""Factor from SI and unit in which a limit is drawn."""


def draw_joint(joint: xr.Dataset) -> Figure:
    """Draw P1 and P2 over speed, of the march and by Jenkins' formulas; several wheelsets in panels of their own."""
    from matplotlib.figure import Figure

    wheelsets = joint.wheelset.values if "wheelset" in joint.dims else [None]
    figure = Figure(figsize=(8.0, 4.8 * len(wheelsets)))
    panels = figure.subplots(len(wheelsets), 1, sharex=True, squeeze=False)[:, 0]
    for axis, wheelset in zip(panels, wheelsets, strict=True):
        for name, (label, colour, line) in LINES.items():
            if name in joint:
                force = joint[name] if wheelset is None or "wheelset" not in joint[name].dims else joint[name].sel(
                    wheelset=wheelset
                )  # fmt: skip
                words = label.format(cutoff=joint.attrs.get("cutoff", np.nan))
                axis.plot(joint.speed, force / 1e3, line, color=colour, markersize=4, label=words)
        of = "" if wheelset is None else f" {wheelset}"
        axis.set_ylabel(f"force of the wheelset{of} [kN]")
        legend_above(axis, 3)
    panels[-1].set_xlabel("speed [m/s]")
    figure.suptitle(f"joint with an angle of {1e3 * joint.attrs['angle']:.4g} mrad", x=0.02, ha="left")
    return figure


def draw_limits(found: LimitCheck) -> Figure:
    """Draw each limit's value over what is allowed."""
    from matplotlib.figure import Figure

    if not len(found):
        raise InputError("", "what", "no limit that was compared", "a check with one limit or more")
    figure = Figure(figsize=(8.0, 1.4 + 0.32 * len(found)))
    axis = figure.subplots()
    rows = np.arange(len(found))
    shares = [row.value / row.allowed for row in found]
    longest = 1.2 * max([1.0, *(share for share in shares if np.isfinite(share))])
    ends = np.minimum(shares, longest)  # of a wheel without vertical force Y/Q is infinite
    colours = [{"yes": RED, "no": BLUE, "not met": "0.6"}[row.verdict] for row in found]
    axis.barh(rows, ends, color=colours, height=0.6)
    axis.axvline(1.0, color="0.3", linewidth=1.0)
    axis.grid(visible=False)
    allowed = [row.rule.text_of(row.allowed) for row in found]
    names = [row.name if text in row.name else f"{row.name}: {text}" for row, text in zip(found, allowed, strict=True)]
    axis.set_yticks(rows, names, fontsize=8)
    box = {"facecolor": axis.get_facecolor(), "edgecolor": "none", "pad": 1.0}  # over the line of what is allowed
    for y, row, end in zip(rows, found, ends, strict=True):
        axis.annotate(
            row.rule.text_of(row.value), (end, y), (4, 0), textcoords="offset points", va="center", fontsize=8, bbox=box
        )
    axis.set(xlabel="value over what is allowed", xlim=(0.0, longest), ylim=(len(found) - 0.5, -0.5))
    exceeded = len(found.exceeded)
    unmet = f", {len(found.unmet)} not met by the run" if found.unmet else ""
    figure.suptitle(f"{exceeded} of {len(found)} limits exceeded{unmet}; verify the current editions", fontsize=9)
    return figure


def draw_rule(rule: Rule) -> Figure:
    """Draw what a limit allows over the static force, and to which wheels and speeds it applies."""
    figure, (limit, scope) = panels(2, 6.5)
    static = np.linspace(0.0, HEAVIEST[rule.per], 101)
    factor, unit = UNITS[QUANTITIES[rule.quantity]]
    allowed = factor * np.array([rule.allowed(float(one)) for one in static])
    top = 1.3 * float(allowed.max())
    limit.plot(static / 1e3, allowed, color=RED, label="allowed")
    at = "at and above" if rule.when == "reached" else "above"
    limit.fill_between(static / 1e3, allowed, top, color=RED, alpha=0.15, linewidth=0, label=f"{rule.level}: {at} it")
    limit.set(
        xlabel=f"static force of the {rule.per} [kN]", ylabel=f"{rule.quantity.replace('_', ' ')} [{unit}]",
        xlim=(0.0, static[-1] / 1e3), ylim=(0.0, top),
    )  # fmt: skip
    legend_above(limit)
    wheels = np.clip((rule.diameter_above, rule.diameter_up_to), *DIAMETERS)
    speeds = np.clip((3.6 * rule.speed_above, 3.6 * rule.speed_up_to), 0.0, FASTEST)
    scope.fill_between(
        wheels, *np.repeat(speeds[:, None], 2, axis=1), color=BLUE, alpha=0.3, linewidth=0, label="applies"
    )
    scope.set(xlabel="diameter of the wheel [m]", ylabel="speed [km/h]", xlim=DIAMETERS, ylim=(0.0, FASTEST))
    legend_above(scope)
    filtered = [f"forces below {rule.low_pass:g} Hz"] if np.isfinite(rule.low_pass) else []
    filtered += [f"means over {rule.sliding_mean:g} m"] if rule.sliding_mean else []
    stated = ", ".join(part for part in (rule.body, rule.country, rule.edition) if part)
    lines = [f"{rule.name}: {rule.limit_text}", "; ".join([*([stated] if stated else []), *filtered, rule.verify])]
    figure.suptitle("\n".join(fill(line, 110) for line in lines), x=0.02, ha="left", fontsize=9)
    return figure
