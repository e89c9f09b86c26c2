"""Draw the pictures of the first page, those that are not there yet: its example, and one for each kind of reader."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import wheeltapper as wt
from wheeltapper.diagnosis import read_channels

FOLDER = Path(__file__).parent / "front"
EXAMPLES = Path(__file__).parents[1] / "examples"
SIZE, DOTS = (4.0, 2.6), 150
"""Of a picture, inches, and its dots per inch."""


def detector(axes: Axes) -> None:
    """Draw what one pair of gauges recorded of a train with a wheel that strikes."""
    first = min((EXAMPLES / "data" / "passages").glob("*.csv.gz"))
    recordings = read_channels(first, EXAMPLES / "detector.toml")
    loudest = max(recordings.values(), key=lambda one: float(one.samples.max()))
    seconds = loudest.start + np.arange(len(loudest.samples)) / loudest.rate
    axes.plot(seconds, 1e-3 * loudest.samples, lw=0.8)
    axes.set(xlabel="time [s]", ylabel="gauges [kN]", title="one pair of gauges, one train")


def vehicle(axes: Axes) -> None:
    """Draw the wheel forces of a coach over a step."""
    coach = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(), creep=wt.creep.Polach(friction=0.35), speed=5.0,
        irregularity={"right": wt.Step(height="0.1 mm", position=0.05)}, duration=0.05,
    )  # fmt: skip
    history = wt.simulate(coach).history("10 kHz").sel(wheelset=1)
    for side in ("left", "right"):
        axes.plot(1e3 * history.time, 1e-3 * history.normal_force.sel(side=side), lw=1.0, label=side)
    axes.legend(frameon=False, fontsize=9)
    axes.set(xlabel="time [ms]", ylabel="wheel force [kN]", title="a coach, one wheel on a step")


def track(axes: Axes) -> None:
    """Draw the force of a flat on sleepers, and on a rigid rail."""
    flat = wt.load(EXAMPLES / "flat_on_ballast.toml")
    for name, one in (("rigid rail", wt.StiffTrack()), ("rail on sleepers", flat.track)):
        record = wt.simulate(flat.replaced({"track": one}))
        history = record.history("20 kHz")
        axes.plot(1e3 * history.time, history.normal_force / record.static_force, lw=1.0, label=name)
    axes.legend(frameon=False, fontsize=9, ncols=2, loc="upper center", columnspacing=1.0)
    axes.set(xlabel="time [ms]", ylabel="force / static force", title="a wheel flat on two tracks")
    axes.set(xlim=(100, 150), ylim=(-0.3, 7.5))


def research(axes: Axes) -> None:
    """Draw the motions that repeat on a corrugated rail, over the speed."""
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4),
        contact=wt.Hertz(constant=1.405e11), rolling="point", speed=5.0, duration=1.0,
        irregularity=wt.Corrugation(amplitude="50 µm", wavelength="5 cm", start=0.0),
    )  # fmt: skip
    branch = wt.orbits.follow(wt.orbits.find(scene), {"speed": (2.5, 12.0)})
    force = branch.largest_force / branch.static_force
    axes.plot(branch.speed, force.where(branch.stable), lw=1.8, label="stable")
    axes.plot(branch.speed, force.where(~branch.stable), lw=1.0, ls="--", label="unstable")
    axes.legend(frameon=False, fontsize=9)
    axes.set(xlabel="speed [m/s]", ylabel="largest / static force", title="motions that repeat on waves")


def teaching(axes: Axes) -> None:
    """Draw a wheel that leaves the rail on a bump, and comes down again and again."""
    record = wt.simulate(wt.load(EXAMPLES / "bump.toml"))
    history = record.history("50 kHz")
    axes.plot(1e3 * history.time, 1e6 * history.wheel_displacement, lw=1.0, label="wheel")
    axes.fill_between(1e3 * history.time, 1e6 * history.constraint, -250.0, alpha=0.3, label="rail")
    axes.legend(frameon=False, fontsize=9)
    axes.set(xlabel="time [ms]", ylabel="height [µm]", title="a wheel that jumps off a bump", ylim=(-250, None))


READERS: tuple[Callable[[Axes], None], ...] = (detector, vehicle, track, research, teaching)


def draw_example(folder: Path) -> None:
    """Draw the example of the first page."""
    wt.plot(wt.simulate(wt.load(EXAMPLES / "bump.toml")), folder / "example.png")


def draw(reader: Callable[[Axes], None], folder: Path) -> Path:
    """Draw the picture of one reader; return its path."""
    figure = Figure(SIZE, layout="constrained")
    reader(figure.add_subplot())
    path = folder / f"{reader.__name__}.png"
    figure.savefig(path, dpi=DOTS)
    return path


def draw_missing() -> None:
    """Draw those that are not there."""
    FOLDER.mkdir(exist_ok=True)
    for reader in READERS:
        if not (FOLDER / f"{reader.__name__}.png").exists():
            draw(reader, FOLDER)
    if not (FOLDER / "example.png").exists():
        draw_example(FOLDER)


if __name__ == "__main__":
    draw_missing()
