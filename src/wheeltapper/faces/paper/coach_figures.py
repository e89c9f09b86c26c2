"""The paper's figures of the whole coach, drawn from the simulations that its claims measure."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.panels import legend_above
from wheeltapper.faces.paper import coach_setting as setting
from wheeltapper.faces.paper.chaos import HIGH
from wheeltapper.faces.paper.coach_setting import (
    CHANGES,
    COACH,
    FREE,
    HEIGHT,
    LATER,
    MEETS,
    STATIC,
    UNDAMPED,
    ZONES,
    body,
    force,
    step,
)
from wheeltapper.faces.paper.coach_steps import BOGIE, SIGNS, car_body
from wheeltapper.faces.paper.coach_waves import NO_CREEP, ONE_SIDED, SETTLED, right_rail

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIDES = ("right", "left")
BESIDE = (ZONES, UNDAMPED)
"""The cases that each figure shows beside each other."""


def _history_with_events(record: wt.Record, begin: float, end: float) -> Any:
    """Return the history in a span of time, with every event and peak."""
    found = np.concatenate([np.linspace(begin, end, 4000), record.events.time.values, record.peaks.time.values])
    times = np.unique(found)
    return record.at(times[(times >= begin) & (times <= end)])


def _in_milliseconds(history: Any, zero: float = 0.0) -> Any:
    return 1e3 * (history.time.values - zero)


def title_left(figure: Figure, words: str) -> None:
    """Put the title at the left, beside a legend."""
    figure.suptitle(words, x=0.01, ha="left")


def legend_on_top(figure: Figure, handles: Any, names: Any) -> None:
    """Put a legend of all panels at the right of the title."""
    figure.legend(handles, names, loc="outside upper right", ncols=len(names))


def fig4(figure: Figure) -> None:
    """Draw normal and lateral forces of both wheelsets of a bogie that meets the step, one after the other."""
    figure.set_size_inches(13, 8)
    axes = figure.subplots(4, 4, sharex="col", sharey="row")
    for pair, case in enumerate(BESIDE):
        record = step(HEIGHT, 0.62, under=BOGIE, **CHANGES[case])
        for column, begin in enumerate((0.0, LATER), 2 * pair):
            history = _history_with_events(record, begin, begin + 0.1)
            for row, (wheelset, letter) in enumerate(((1, "f"), (2, "r"))):
                normal, lateral = axes[row, column], axes[row + 2, column]
                for side, line in zip(SIDES, ("-", "--"), strict=True):
                    name = f"{letter}{side[0].upper()}"
                    normal.plot(
                        _in_milliseconds(history), force(history, wheelset, side), line, label=f"$N_{{{name}}}$"
                    )
                    across = history.lateral_force.sel(wheelset=wheelset, side=side) / 1e3
                    lateral.plot(_in_milliseconds(history), across, line, label=f"$T_{{{name}}}$")
                if column == 0:
                    normal.set(ylabel="N/N₀")
                    lateral.set(ylabel="T [kN], left +")
                for axis in (normal, lateral):
                    legend_above(axis)
            axes[3, column].set(xlabel="time [ms]")
        axes[0, 2 * pair].set_title(case.name, loc="left")
    figure.suptitle("Fig. 4 (C14 to C20, C47, C54): step of 0.1 mm on both rails, 5 m/s, coach without dampers")


def fig5(figure: Figure) -> None:
    """Draw a flat of the coach's wheelset on the deck: dynamic force, and the deck's acceleration times its mass."""
    figure.set_size_inches(8, 9)
    for axis, (case, changes) in zip(figure.subplots(3, 1, sharex=True), CHANGES.items(), strict=True):
        history = _history_with_events(setting.flat(0.1, **changes), 0.0, 0.1)
        dynamic = history.normal_force.sel(wheelset=1).sum("side") - 2 * STATIC
        axis.plot(_in_milliseconds(history), dynamic / 1e3, label="1: dynamic part of N, both wheels [kN]")
        axis.plot(_in_milliseconds(history), -15.0 * history.deck_acceleration, "--", label="2: −M·ÿ$_M$ [kN]")
        axis.set_title(case.name, loc="left")
        axis.set(ylabel="force [kN]")
        legend_above(axis)
    axis.set(xlabel="time [ms]")
    figure.suptitle("Fig. 5 (C22): flats of 0.1 mm on a wheelset of the coach, 5 m/s, deck of 15 t and 5 Hz under it")


def fig6(figure: Figure) -> None:
    """Draw the car body's vertical acceleration after a step under one bogie."""
    figure.set_size_inches(11, 7)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for column, case in enumerate(BESIDE):
        for axis, (sign, height) in zip(axes[:, column], SIGNS.items(), strict=True):
            for name, wagon in (("1: original wagon", COACH), ("2: damping-free wagon", FREE)):
                time, acceleration = car_body(step(height, 1.2, under=BOGIE, **CHANGES[case] | {"vehicle": wagon}))
                axis.plot(time, 1e3 * acceleration, label=name)
            for meets in (MEETS, MEETS + LATER):
                axis.axvline(meets, color="0.5", linestyle=":")
            axis.set_title(f"step {sign}, {case.name}", loc="left")
        axes[1, column].set(xlabel="time [s]")
    for axis in axes[:, 0]:
        axis.set(ylabel="acceleration [mm/s²]")
    legend_on_top(figure, *axes[0, 0].get_legend_handles_labels())
    title_left(figure, "Fig. 6 (C25, C26): car body's centre, step of 0.1 mm, 5 m/s; dotted: a wheelset meets it")


def fig7(figure: Figure) -> None:
    """Draw the rear wheelset's motion and force over corrugation below, near and above the resonance, by case."""
    figure.set_size_inches(15, 11)
    axes = figure.subplots(2 * len(CHANGES), 4)
    shown = (
        (2.25, SETTLED, 4, "after 60 waves"), (9.0, 18, 19, "bouncing"), (36.0, 18, 19, "first waves"),
        (36.0, 400, 18, "after 380 waves"),
    )  # fmt: skip
    for row, (case, changes) in enumerate(CHANGES.items()):
        for column, (speed, periods, last, words) in enumerate(shown):
            period = setting.WAVELENGTH / speed
            record, start = setting.corrugation(speed, periods * period, **changes)
            history = _history_with_events(record, max(record.end - last * period, 0.0), record.end)
            time, height = _in_milliseconds(history, start), body(history, "wheelset 4")
            path = history.constraint.sel(wheelset=4, side="right").values
            zero = height.mean() - path.mean() if column == 0 else body(record.at([0.0]), "wheelset 4")[0]
            top, bottom = axes[2 * row : 2 * row + 2, column]
            top.plot(time, 1e6 * path, color="0.5", linewidth=3.0, alpha=0.5, label="1: irregularity")
            top.plot(time, 1e6 * (height - zero), label="2: wheelset, from rest (at 2.25 m/s: from its mean)")
            bottom.plot(time, force(history, 4), color="C1", label="3: N/N₀ of one wheel")
            top.set_title(f"{speed:g} m/s, {words}" if column else f"{case.name}: {speed:g} m/s, {words}", loc="left")
            if column == 1:
                top.axhline(1e6 * HIGH, color="0.7", linestyle=":")
        axes[2 * row, 0].set(ylabel="y [µm]")
        axes[2 * row + 1, 0].set(ylabel="N/N₀")
    for axis in axes[-1]:
        axis.set(xlabel="time after its start [ms]")
    handles, names = (
        top + bottom for top, bottom in zip(*(a.get_legend_handles_labels() for a in axes[:2, 0]), strict=True)
    )
    legend_on_top(figure, handles, names)
    title_left(figure, "Fig. 7 (C28 to C31, C33, C50, C51, C57): rear wheelset, corrugation −50 µm, 5 cm; dotted: 1 mm")


def fig8(figure: Figure) -> None:
    """Draw the rear wheelset's motion, and the bogie frame's above it, before and after it meets the corrugation."""
    figure.set_size_inches(12, 10)
    axes = figure.subplots(4, 2, sharex="row")
    cases = (UNDAMPED, ZONES)
    for column, case in enumerate(cases):
        causes, drawn, close, early = axes[:, column]
        record, own = setting.both_of_the_rear_bogie(18.0, **CHANGES[case])
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
            (causes, "what swings the frame", "mm"), (drawn, "as the paper draws it", "mm"),
            (close, "rear wheelset", "µm"), (early, "rear wheelset before its start", "µm"),
        ):  # fmt: skip
            axis.axvline(1e3 * setting.WAVELENGTH / 18.0, color="0.5", linestyle="--", label="front wheelset meets it")
            if axis is not early:
                axis.axvline(1e3 * own, color="0.5", linestyle=":", label="rear wheelset meets it")
            axis.set(title=f"{case.name}: {words}")
            if column == 0:
                axis.set(ylabel=f"height [{unit}]")
            else:
                axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
        early.set(xlabel="time [ms]")
    figure.suptitle("Fig. 8 (C36, C36b): corrugation −50 µm, 5 cm, 18 m/s, rear bogie of the coach without dampers")


def _one_sided(figure: Figure, read: Callable[[Any, str], Any], unit: str, words: str, from_rest: bool) -> None:
    """Draw the run with corrugation on the right rail by case: its first waves, and the motion that is left later."""
    figure.set_size_inches(12, 9)
    cases = (ZONES, UNDAMPED, NO_CREEP)
    axes = figure.subplots(len(cases), 2, sharey="row", width_ratios=(2, 1))
    for (early, late), case in zip(axes, cases, strict=True):
        record, start = right_rail(0.44, **ONE_SIDED[case])
        for axis, begin, end in ((early, 0.0, start + 0.12), (late, start + 0.4, record.end)):
            history, at_rest = _history_with_events(record, begin, end), record.at([0.0])
            for side, width in zip(SIDES, (0.8, 1.4), strict=True):
                off = read(at_rest, side)[0] if from_rest else 0.0
                axis.plot(_in_milliseconds(history, start), read(history, side) - off, label=side, linewidth=width)
        early.set_title(case.name, loc="left")
        early.set(ylabel=unit)
    legend_above(axes[0, 0])
    for axis in axes[-1]:
        axis.set(xlabel="time after the start [ms]")
    figure.suptitle(f"{words}: rear wheelset, corrugation 50 µm, 5 cm on the right rail, 36 m/s")


def fig9(figure: Figure) -> None:
    """Draw both normal forces of the rear wheelset."""
    _one_sided(figure, lambda history, side: force(history, 4, side), "N/N₀", "Fig. 9 (C37, C52)", False)


def fig10(figure: Figure) -> None:
    """Draw the motions of both wheels' centres."""

    def heights(history: Any, side: str) -> Any:
        return 1e6 * setting.wheel_centre_heights(history)[side]

    _one_sided(figure, heights, "displacement [µm]", "Fig. 10 (C38, C39)", True)


def onesided(figure: Figure) -> None:
    """Draw the right front wheel's force maxima after a step on both rails, and on the right one only."""
    figure.set_size_inches(8, 10)
    axes = figure.subplots(4, 1)
    for axis, (case, changes) in zip(axes, CHANGES.items(), strict=False):
        for words, under in (("both rails", "wheelset 1"), ("right rail only", "wheelset 1 right")):
            time, height = setting.wheel_peaks(step(HEIGHT, 0.4, under=(under,), **changes))
            axis.plot(1e3 * (time - MEETS), height, ".", label=words)
        axis.set_title(case.name, loc="left")
        axis.set(ylabel="maxima of N/N₀, right")
        legend_above(axis)
    record = step(HEIGHT, 0.1, under=("wheelset 1 right",), **CHANGES[ZONES])
    history = _history_with_events(record, MEETS - 0.005, MEETS + 0.08)
    for side in SIDES:
        axes[-1].plot(_in_milliseconds(history, MEETS), force(history, 1, side), label=side)
    axes[-1].set_title(f"{ZONES.name}, right rail only", loc="left")
    axes[-1].set(ylabel="N/N₀", xlabel="time after the step [ms]")
    legend_above(axes[-1])
    figure.suptitle("C46, C53: step up by 0.1 mm, 5 m/s")


DRAW: dict[str, Callable[[Figure], None]] = {
    "fig4coach": fig4, "fig5coach": fig5, "fig6": fig6, "fig7coach": fig7, "fig8": fig8, "fig9": fig9, "fig10": fig10,
    "onesided": onesided,
}  # fmt: skip
"""By figure, the function that draws it."""
