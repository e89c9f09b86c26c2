"""The figures of the paper's claims, drawn from the same simulations that the claims measure."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.charts import draw_map
from wheeltapper.faces.panels import legend_above
from wheeltapper.faces.paper import (
    coach_figures,
    corrugation,
    deck,
    diagnosis,
    law,
    maps,
    missed,
    naive,
    orbits,
    plastic_figures,
)
from wheeltapper.faces.paper.claims import Found
from wheeltapper.faces.paper.setting import CONSTANT, STATIC, bump, flat, impacts, largest, losses, sine, step
from wheeltapper.faces.plot import STYLE, save
from wheeltapper.faces.records import shade_losses
from wheeltapper.ground.warned import ModelWarning

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DRAW: dict[str, Callable[[Figure], None]] = coach_figures.DRAW | plastic_figures.DRAW | diagnosis.DRAW | orbits.DRAW
"""By figure, the function that draws it."""


def _register_figure(name: str) -> Callable[[Callable[[Figure], None]], Callable[[Figure], None]]:
    def register(function: Callable[[Figure], None]) -> Callable[[Figure], None]:
        DRAW[name] = function
        return function

    return register


def draw(name: str, folder: Path, found: list[Found]) -> Path:
    """Draw one figure into a folder, and under it what its claims show; return the file."""
    import matplotlib.style
    from matplotlib.figure import Figure

    path = folder / f"{name}.png"
    with matplotlib.style.context(STYLE):
        figure = Figure()
        DRAW[name](figure)
        width, height = figure.get_size_inches()
        lines = [part for one in found for line in shown(one) for part in _wrapped(line, int(LETTERS * width))]
        figure.set_size_inches(width, height + 0.13 * len(lines))
        figure.supxlabel("\n".join(lines), x=0.01, ha="left", fontsize=7, linespacing=1.3)
        save(figure, path)
    return path


LETTERS = 18
"""Letters of a line of small type per inch."""


def _wrapped(line: str, width: int) -> list[str]:
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.wrap(line.strip(), width, initial_indent=indent, subsequent_indent=12 * " ")


def draw_in(shared: tuple[Path, dict[str, list[Found]]], name: str) -> Path:
    """Draw one figure into a folder, with what was measured of its claims."""
    import warnings

    folder, measured = shared
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)  # the point follower of the paper, on purpose
        return draw(name, folder, measured.get(name, []))


def shown(found: Found) -> list[str]:
    """Return lines on a claim: its verdict, and which of its cases show it and which do not."""
    lines, showing = [f"{found.claim.number} {found.claim.sentence} – {found.verdict}"], []
    for case in dict.fromkeys(one.case for one in found.words if one.case.name):
        refuted = [f"{one.quantity}: {one.value:.3g}" for one in found.words if one.case == case and not one.inside]
        if refuted:
            lines.append(f"      not shown, {case.name}: {'; '.join(refuted)}")
        else:
            showing.append(case.name)
    if showing:
        lines.insert(1, f"      shown: {'; '.join(showing)}")
    return lines


def _history_with_events(record: wt.Record, begin: float = 0.0) -> Any:
    """Return the history from a time on, at times that contain every event and peak."""
    events = np.concatenate([record.events.time.values, record.peaks.time.values])
    times = np.unique(np.concatenate([np.linspace(begin, record.end, 4000), events]))
    return record.at(times[times >= begin])


def _draw_force(axis: Axes, record: wt.Record, label: str | None = None, begin: float = 0.0, **style: Any) -> None:
    history = _history_with_events(record, begin)
    axis.plot(1e3 * history.time, history.normal_force / record.static_force, label=label, **style)
    axis.set(xlabel="time [ms]", ylabel="N/N₀")


def _draw_motion(axis: Axes, record: wt.Record, begin: float = 0.0) -> None:
    history, rest = _history_with_events(record, begin), float(record.at(0.0).wheel_displacement[0])
    axis.plot(1e3 * history.time, 1e6 * history.constraint, color="0.5", label="constraint $y_{Ck}$")
    axis.plot(1e3 * history.time, 1e6 * (history.wheel_displacement - rest), label="wheel $y_C$, from rest")
    axis.set(xlabel="time [ms]", ylabel="displacement [µm]")


@_register_figure("fig2")
def fig2(figure: Figure) -> None:
    """Draw a phase of impacts, then one of vibration in contact; without much damping there is no such picture."""
    figure.set_size_inches(8, 7)
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    heavy, light = bump(5e4, 0.2), bump(8e3, 0.2)
    _draw_motion(top, heavy)
    _draw_force(middle, heavy)
    _draw_force(bottom, light)
    shade_losses(top, heavy)
    shade_losses(middle, heavy)
    shade_losses(bottom, light)
    legend_above(top)
    top.set(title=f"c = 50 kN s/m: {impacts(heavy)} impacts", xlabel="")
    figure.suptitle("Fig. 2a (C01, C02): bump 0.2 mm, 5 cm, 9 m/s")
    middle.set(xlabel="")
    bottom.set(title=f"c = 8 kN s/m: {impacts(light)} impacts in 0.2 s")


@_register_figure("fig4")
def fig4(figure: Figure) -> None:
    """Draw steps: force over time, and largest force over speed."""
    figure.set_size_inches(8, 7)
    top, bottom = figure.subplots(2, 1)
    for height, name in ((1e-4, "up"), (-1e-4, "down")):
        _draw_force(top, step(height, 0.0, 0.06), f"step {name}")
    top.set(title="step of 0.1 mm at x = 5 cm, 5 m/s, c = 0")
    legend_above(top)
    figure.suptitle("Fig. 4 (C17 to C21): steps, and the largest force over speed")
    speeds = np.geomspace(0.5, 40.0, 240)
    runs: dict[str, Callable[[float, float], wt.Record]] = {
        "step up": lambda v, end: step(1e-4, 8e3, end, v),
        "step down": lambda v, end: step(-1e-4, 8e3, end, v),
        "flat": lambda v, end: flat(8e3, end, v),
    }
    for name, run in runs.items():
        bottom.semilogx(speeds, [largest(run(float(v), 0.06 / float(v) + 0.1)) for v in speeds], label=name)
    bottom.set(xlabel="speed [m/s]", ylabel="largest N/N₀", title="c = 8 kN s/m")
    legend_above(bottom)


@_register_figure("fig5")
def fig5(figure: Figure) -> None:
    """Draw a flat on the deck: the deck's acceleration against the normal force."""
    figure.set_size_inches(8, 7)
    top, bottom = figure.subplots(2, 1)
    record = flat(0.0, 0.1, track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7))
    history = _history_with_events(record)
    _draw_force(top, flat(0.0, 0.1), "N on stiff track", color="0.7")
    _draw_force(top, record, "N on the deck")
    mirrored = 1.0 - 15_000.0 * history.deck_acceleration / record.static_force
    top.plot(1e3 * history.time, mirrored, "--", label="1 − M·ÿ$_M$/N₀")
    figure.suptitle("Fig. 5 (C22, C23): flat of 0.1 mm, 5 m/s, deck 15 t at 5 Hz")
    legend_above(top)
    force = (history.normal_force - record.static_force) / 1e3
    bottom.plot(force, -history.deck_acceleration, linewidth=0.7)
    bottom.set(xlabel="N − N₀ [kN]", ylabel="−ÿ$_M$ [m/s²]")


@_register_figure("fig7")
def fig7(figure: Figure) -> None:
    """Draw corrugation below, near and above the resonance."""
    figure.set_size_inches(11, 8)
    axes = figure.subplots(2, 3)
    for column, (speed, periods, words) in enumerate(
        ((2.25, 100, "in phase"), (9.0, 12, "bouncing"), (36.0, 24, "antiphase"))
    ):
        record = sine(-corrugation.AMPLITUDE, 8e3, speed, periods * corrugation.wavelength_time(speed))
        begin = 0.0 if column else 0.96 * record.end
        _draw_motion(axes[0, column], record, begin)
        _draw_force(axes[1, column], record, begin=begin)
        for axis in axes[:, column]:
            shade_losses(axis, record)
        axes[0, column].set(title=f"{speed:g} m/s: {words}", xlabel="")
        if column:
            axes[0, column].set(ylabel="")
            axes[1, column].set(ylabel="")
    handles, names = axes[0, 1].get_legend_handles_labels()
    coach_figures.legend_on_top(figure, handles, names)
    coach_figures.title_left(figure, "Fig. 7 (C27 to C35, C40): corrugation 50 µm, 5 cm, c = 8 kN s/m")


@_register_figure("stiffness")
def stiffness(figure: Figure) -> None:
    """Draw responses that hardly differ."""
    axis = figure.subplots()
    for k, line in ((0.0, "-"), (2.44e6, "--"), (2.44e7, ":")):
        _draw_force(axis, bump(5e4, 0.1, vehicle={"stiffness": k}), f"k = {k / 1e6:g} MN/m", linestyle=line)
    figure.suptitle("C08: bump, c = 50 kN s/m: insensitive to the suspension's stiffness")
    legend_above(axis)


@_register_figure("deck")
def dynamic_deck(figure: Figure) -> None:
    """Draw the deck's dynamic stiffness; impacts and largest force over its mass."""
    figure.set_size_inches(8, 13)
    top, middle, bottom, ballast = figure.subplots(4, 1)
    frequency = np.linspace(20.0, 300.0, 400)
    top.semilogy(frequency, np.abs(1e9 - 1500.0 * (2 * np.pi * frequency) ** 2), label="|K − M·ω²|")
    points = [60.0, 100.0, 180.0, 240.0]
    top.plot(points, [deck.dynamic_stiffness(1500.0, 1e9, f) for f in points], "o", label="measured")
    printed = [deck.printed_stiffness(1500.0, 1e9, float(f)) for f in frequency]
    top.plot(frequency, printed, color="0.5", linestyle=":", label="M·ω² + K, as printed")
    top.set(xlabel="frequency [Hz]", ylabel="dynamic stiffness [N/m]", title="deck 1500 kg, 1 GN/m")
    legend_above(top)
    masses = np.geomspace(150.0, 15_000.0, 300)
    records, damped = (
        [bump(5e4, 0.25, track=deck.tuned(float(m), 10.0, damping)) for m in masses] for damping in (0.0, 0.5)
    )
    flats = [largest(flat(8e3, 0.25, track=deck.tuned(float(m), 10.0))) for m in masses]
    middle.semilogx(masses, [largest(r) for r in records], label="bump")
    middle.semilogx(masses, [largest(r) for r in damped], "--", label="bump, bearings half damped")
    middle.semilogx(masses, flats, label="flat at 5 m/s")
    middle.set(ylabel="largest N/N₀", title="deck at 10 Hz")
    bottom.step(masses, [impacts(r) for r in records], where="mid", label="bump")
    bottom.step(masses, [impacts(r) for r in damped], "--", where="mid", label="bearings half damped")
    bottom.axhline(impacts(bump(5e4, 0.25)), color="0.5", linestyle="--", label="on stiff track")
    bottom.set(xscale="log", ylabel="impacts in 0.25 s", title="deck at 10 Hz")
    for axis in (middle, bottom):
        axis.set(xlabel="mass of the deck [kg]")
        legend_above(axis)
    _draw_force(ballast, step(1e-4, 8e3, 0.04), "stiff track")
    for number, track in enumerate(deck.TRACKS.values()):
        label = "four published tracks" if number == 0 else None
        _draw_force(ballast, step(1e-4, 8e3, 0.04, track=track), label, color="C1", linewidth=0.8)
    ballast.set(title="step up by 0.1 mm, 5 m/s")
    legend_above(ballast)
    figure.suptitle("C09 to C11, C48, C49, C55: the deck's dynamic stiffness, and what the wheel does on it")


@_register_figure("missed")
def lost(figure: Figure) -> None:
    """Draw the number of losses of contact that integrators without event location find."""
    axis = figure.subplots()
    record = missed.corrugation_benchmark()
    sizes = np.geomspace(1e-5, 1e-3, 15)
    for name, method in (("Runge-Kutta 4", naive.runge_kutta), ("backward Euler", naive.backward_euler)):
        axis.semilogx(1e6 * sizes, [naive.losses(method(record, float(h))) for h in sizes], "o-", label=name)
    axis.axhline(losses(record), color="0.5", linestyle="--", label="located")
    axis.set(xlabel="step [µs]", ylabel="losses of contact found in 0.2 s")
    figure.suptitle("C12, C13: corrugation 50 µm, 5 cm, 36 m/s, with losses of 0.04 to 0.24 ms")
    legend_above(axis)


@_register_figure("parametric")
def parametric(figure: Figure) -> None:
    """Draw a contact constant that follows the curvature against displacement alone."""
    figure.set_size_inches(8, 7)
    top, bottom = figure.subplots(2, 1)
    _draw_force(top, bump(2e4, 0.06), "displacement alone")
    _draw_force(top, bump(2e4, 0.06, contact=law.FOLLOWING), "and curvature")
    top.set(title="bump, c = 20 kN s/m", xlabel="")
    legend_above(top)
    _draw_force(bottom, law.parametric_alone(2e4, 0.1), color="C2")
    bottom.set(title="corrugation 50 µm, 5 cm, 9 m/s, as a change of the contact's stiffness only")
    figure.suptitle("C24: the contact constant follows the curvature of the irregularity")


@_register_figure("law")
def contact_law(figure: Figure) -> None:
    """Draw the frequency of free vibration over its largest force, for three laws."""
    axis = figure.subplots()
    ratios = np.linspace(1.05, 10.0, 180)
    linear = 1.5 * (CONSTANT**2 * STATIC) ** (1 / 3)
    for name, contact in (
        ("linear, pulls", wt.Linear(stiffness=linear, bilateral=True)),
        ("linear, cannot pull", wt.Linear(stiffness=linear)),
        ("Hertz", wt.Hertz(constant=CONSTANT)),
    ):
        axis.plot(ratios, [law.free_vibration(contact, float(r)) for r in ratios], label=name)
    axis.axvline(2.5, color="0.5", linestyle=":", label="first loss, Hertz")
    axis.axvline(2.0, color="0.8", linestyle=":", label="first loss, linear")
    axis.set(xlabel="largest force over static", ylabel="frequency over linear frequency")
    legend_above(axis)
    figure.suptitle("C43: free vibration: that the contact cannot pull matters more than that it is not linear")


@_register_figure("spectra")
def spectra(figure: Figure) -> None:
    """Draw the spectra of the wheel's motion and of the irregularity."""
    axis = figure.subplots()
    record = sine(corrugation.AMPLITUDE, 8e3, 9.0, 180 * corrugation.wavelength_time(9.0))
    for name, label in (("constraint", "irregularity"), ("wheel_displacement", "wheel")):
        frequency, amplitude = corrugation.spectrum(record, name)
        axis.semilogy(frequency, 1e6 * amplitude, label=label)
    axis.set(xlim=(0.0, 600.0), ylim=(1e-3, None), xlabel="frequency [Hz]", ylabel="amplitude [µm]")
    figure.suptitle("C45: corrugation 50 µm, 5 cm, 9 m/s, bouncing")
    legend_above(axis)


def _level_curves(figure: Figure, feature: str, said: str) -> None:
    """Draw one feature around both nominal cases, over the paper's axes."""
    figure.set_size_inches(11.0, 5.2)
    cases = (("bump 0.2 mm x 50 mm, 9 m/s", maps.bump_scene()), ("dip 0.101 mm x 40.3 mm, 5.57 m/s", maps.dip_scene()))
    for axis, (name, nominal) in zip(figure.subplots(1, 2), cases, strict=True):
        draw_map(axis, maps.chart_around(nominal, 81), feature)
        axis.set_title(f"{name}: {axis.get_title(loc='left')}", fontsize=8)
        c, m = nominal.vehicle.damping, nominal.vehicle.mass
        axis.set(xlabel=f"c/c₀, c₀ = {c / 1e3:g} kN s/m", ylabel=f"m/m₀, m₀ = {m:g} kg")
    figure.suptitle(said)


@_register_figure("fig2b")
def _draw_interval(figure: Figure) -> None:
    _level_curves(figure, "impact_interval", "Fig. 2b (C03, C04): interval of impacts; arrows: its gradient")


@_register_figure("fig2c")
def _draw_ratio(figure: Figure) -> None:
    _level_curves(figure, "force_ratio", "Fig. 2c (C05 to C07, C56): ratio of the largest forces; arrows: its gradient")
