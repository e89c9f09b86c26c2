"""The paper's figures of the whole coach, drawn from the simulations that its claims measure."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.panels import legend_above
from wheeltapper.faces.paper import coach_setting as setting
from wheeltapper.faces.paper.coach import BOGIE, ONE_SIDED, car_body, right_rail
from wheeltapper.faces.paper.coach_setting import COACH, HEIGHT, LATER, MEETS, STATIC, WAGONS, body, force, step

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIDES = ("right", "left")


def _history_with_events(record: wt.Record, begin: float, end: float) -> Any:
    """Return the history in a span of time, with every event and peak."""
    found = np.concatenate([np.linspace(begin, end, 4000), record.events.time.values, record.peaks.time.values])
    times = np.unique(found)
    return record.at(times[(times >= begin) & (times <= end)])


def _in_milliseconds(history: Any, zero: float = 0.0) -> Any:
    return 1e3 * (history.time.values - zero)


def fig4(figure: Figure) -> None:
    """Draw normal and lateral forces of both wheelsets of a bogie that meets the step, one after the other."""
    figure.set_size_inches(11, 8)
    axes = figure.subplots(4, 2, sharex="col", sharey="row")
    record = step(HEIGHT, 0.62, under=BOGIE)
    for column, begin in enumerate((0.0, LATER)):
        history = _history_with_events(record, begin, begin + 0.1)
        for row, (wheelset, letter) in enumerate(((1, "f"), (2, "r"))):
            normal, lateral = axes[row, column], axes[row + 2, column]
            for side, line in zip(SIDES, ("-", "--"), strict=True):
                name = f"{letter}{side[0].upper()}"
                normal.plot(_in_milliseconds(history), force(history, wheelset, side), line, label=f"$N_{{{name}}}$")
                across = history.lateral_force.sel(wheelset=wheelset, side=side) / 1e3
                lateral.plot(_in_milliseconds(history), across, line, label=f"$T_{{{name}}}$")
            if column == 0:
                normal.set(ylabel="N/N₀")
                lateral.set(ylabel="T [kN], left +")
            for axis in (normal, lateral):
                legend_above(axis)
        axes[3, column].set(xlabel="time [ms]")
    figure.suptitle("Fig. 4 (C14 to C20, C47): step of 0.1 mm on both rails, 5 m/s, damping-free")


def fig5(figure: Figure) -> None:
    """Draw a flat of the coach's wheelset on the deck: dynamic force, and the deck's acceleration times its mass."""
    figure.set_size_inches(8, 7)
    for axis, (name, wagon) in zip(figure.subplots(2, 1, sharex=True), WAGONS.items(), strict=True):
        history = _history_with_events(setting.flat(0.1, wagon), 0.0, 0.1)
        dynamic = history.normal_force.sel(wheelset=1).sum("side") - 2 * STATIC
        axis.plot(_in_milliseconds(history), dynamic / 1e3, label="1: dynamic part of N, both wheels [kN]")
        axis.plot(_in_milliseconds(history), -15.0 * history.deck_acceleration, "--", label="2: −M·ÿ$_M$ [kN]")
        axis.set_title(f"{name} wagon", loc="left")
        axis.set(ylabel="force [kN]")
        legend_above(axis)
    axis.set(xlabel="time [ms]")
    figure.suptitle("Fig. 5 (C22): flats of 0.1 mm on a wheelset of the coach, 5 m/s, deck of 15 t and 5 Hz under it")


def fig6(figure: Figure) -> None:
    """Draw the car body's vertical acceleration after a step under one bogie."""
    figure.set_size_inches(8, 7)
    signs = {"up": HEIGHT, "down": -HEIGHT}
    for axis, (sign, height) in zip(figure.subplots(2, 1, sharex=True), signs.items(), strict=True):
        for number, (name, wagon) in enumerate(reversed(WAGONS.items()), 1):
            time, acceleration = car_body(step(height, 1.2, wagon, BOGIE))
            axis.plot(time, 1e3 * acceleration, label=f"{number}: {name} wagon")
        for meets in (MEETS, MEETS + LATER):
            axis.axvline(meets, color="0.5", linestyle=":")
        axis.set_title(f"step {sign} by 0.1 mm", loc="left")
        axis.set(ylabel="acceleration [mm/s²]")
        legend_above(axis)
    axis.set(xlabel="time [s]")
    figure.suptitle("Fig. 6 (C25, C26): car body's centre, 5 m/s; dotted: a wheelset of the front bogie meets the step")


def fig7(figure: Figure) -> None:
    """Draw the rear wheelset's motion and force over corrugation below, near and above the resonance."""
    figure.set_size_inches(11, 8)
    axes = figure.subplots(2, 3)
    for column, (speed, periods, shown, words) in enumerate(
        ((2.25, 60, 10, "settled, in phase"), (9.0, 12, 13, "bouncing"), (36.0, 24, 25, "antiphase"))
    ):
        period = setting.WAVELENGTH / speed
        record, start = setting.corrugation(speed, periods * period, COACH)
        history = _history_with_events(record, max(record.end - shown * period, 0.0), record.end)
        time, height = _in_milliseconds(history, start), body(history, "wheelset 4")
        rest = body(record.at([0.0]), "wheelset 4")[0]
        path = history.constraint.sel(wheelset=4, side="right")
        top, bottom = axes[:, column]
        top.plot(time, 1e6 * path, color="0.5", linewidth=3.0, alpha=0.5, label="1: irregularity")
        top.plot(time, 1e6 * (height - rest), label="2: wheelset, from rest")
        bottom.plot(time, force(history, 4), label="3: N/N₀")
        top.set_title(f"{speed:g} m/s: {words}", loc="left")
        bottom.set(xlabel="time after its start [ms]")
    axes[0, 0].set(ylabel="displacement [µm]")
    axes[1, 0].set(ylabel="N/N₀ of one wheel")
    lines = [*axes[0, 0].lines, *axes[1, 0].lines]
    figure.legend(lines, [str(line.get_label()) for line in lines], loc="outside lower center", ncols=3)
    figure.suptitle("Fig. 7 (C28, C29, C33): rear wheelset of the original wagon, corrugation 50 µm, 5 cm")


def fig8(figure: Figure) -> None:
    """Draw the rear wheelset's motion, and the bogie frame's above it, before and after it meets the corrugation."""
    figure.set_size_inches(9, 10)
    causes, drawn, close, early = figure.subplots(4, 1)
    record, own = setting.both_of_the_rear_bogie(18.0)
    history = _history_with_events(record, 0.0, record.end)
    time, before = _in_milliseconds(history), history.time.values < own
    parts = {name: 1e6 * moved for name, moved in setting.rear_bogie(history).items()}
    styles = {name: {"color": f"C{number}", "linewidth": 0.9} for number, name in enumerate(parts)}
    rear = "rear wheelset"
    for name, moved in parts.items():
        if name != rear:
            causes.plot(time, moved / 1e3, label=name, **styles[name])
    for name in ("frame above the rear wheelset", rear):
        drawn.plot(time, parts[name] / 1e3, label=name, **styles[name])
    close.plot(time, parts[rear], label=rear, **styles[rear])
    early.plot(time[before], parts[rear][before], label=rear, **styles[rear])
    for axis, words, unit in (
        (causes, "what swings the frame: the front wheelset's bounces", "mm"), (drawn, "as the paper draws it", "mm"),
        (close, "the rear wheelset", "µm"), (early, "the rear wheelset before its own start", "µm"),
    ):  # fmt: skip
        axis.axvline(1e3 * setting.WAVELENGTH / 18.0, color="0.5", linestyle="--", label="front wheelset meets it")
        if axis is not early:
            axis.axvline(1e3 * own, color="0.5", linestyle=":", label="rear wheelset meets it")
        axis.set(ylabel=f"height [{unit}]", title=words)
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
    early.set(xlabel="time [ms]")
    figure.suptitle("Fig. 8 (C36, C36b): corrugation 50 µm, 5 cm, 18 m/s, rear bogie of the damping-free wagon")


def _one_sided(figure: Figure, draw: Callable[[Axes, Any, Any, str], None], unit: str, words: str) -> None:
    """Draw the run with corrugation on the right rail, with creep and without."""
    figure.set_size_inches(10, 7)
    axes = figure.subplots(2, 1, sharex=True, sharey=True)
    for axis, name in zip(axes, ("damping-free", "no creep"), strict=True):
        record, start = right_rail(**ONE_SIDED[name])
        history = _history_with_events(record, 0.0, record.end)
        for side in SIDES:
            draw(axis, _in_milliseconds(history, start), history, side)
        axis.set_title(f"damping-free wagon{', no creep' * (name == 'no creep')}", loc="left")
        axis.set(ylabel=unit)
    legend_above(axes[0])
    axes[1].set(xlabel="time after the start [ms]")
    figure.suptitle(f"{words}: rear wheelset, corrugation 50 µm, 5 cm on the right rail, 36 m/s")


def fig9(figure: Figure) -> None:
    """Draw both normal forces of the rear wheelset."""

    def draw(axis: Axes, time: Any, history: Any, side: str) -> None:
        axis.plot(time, force(history, 4, side), label=side, linewidth=0.8 if side == "right" else 1.4)

    _one_sided(figure, draw, "N/N₀", "Fig. 9 (C37)")


def fig10(figure: Figure) -> None:
    """Draw the motions of both wheels' centres."""

    def draw(axis: Axes, time: Any, history: Any, side: str) -> None:
        height = setting.wheel_centre_heights(history)[side]
        axis.plot(time, 1e6 * (height - height[0]), label=side)

    _one_sided(figure, draw, "displacement [µm]", "Fig. 10 (C38, C39)")


def onesided(figure: Figure) -> None:
    """Draw the right front wheel's force maxima after a step on both rails, and on the right one only."""
    figure.set_size_inches(8, 7)
    for axis, (name, wagon) in zip(figure.subplots(2, 1, sharex=True, sharey=True), WAGONS.items(), strict=True):
        for words, under in (("both rails", "wheelset 1"), ("right rail only", "wheelset 1 right")):
            time, height = setting.wheel_peaks(step(HEIGHT, 0.4, wagon, (under,)))
            axis.plot(1e3 * (time - MEETS), height, ".", label=words)
        axis.set_title(f"{name} wagon", loc="left")
        axis.set(ylabel="maxima of N/N₀, right")
        legend_above(axis)
    axis.set(xlabel="time after the step [ms]")
    figure.suptitle("C46: step up by 0.1 mm, 5 m/s")


DRAW: dict[str, Callable[[Figure], None]] = {
    "fig4coach": fig4, "fig5coach": fig5, "fig6": fig6, "fig7coach": fig7, "fig8": fig8, "fig9": fig9, "fig10": fig10,
    "onesided": onesided,
}  # fmt: skip
"""By figure, the function that draws it."""
