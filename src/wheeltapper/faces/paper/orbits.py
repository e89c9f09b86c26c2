"""The claim on limit cycles near resonance: corrugation of 50 µm and 5 cm, followed by the wheel's centre."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from math import exp
from typing import TYPE_CHECKING, Literal

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import PINNED, Measure, analysis, claim, program, said
from wheeltapper.faces.paper.corrugation import AMPLITUDE, WAVELENGTH
from wheeltapper.faces.paper.setting import STATIC, scene

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

DAMPING = 2e4
DOP853 = program("SciPy's DOP853 in regularised variables, with its own events")
BOUNCING = {"displacement": 2.037e-4, "velocity": -0.1986}
"""A start near the bouncing orbit at 5 m/s."""
SPEEDS = np.linspace(1.0, 60.0, 60)
CARRIES: tuple[Literal["up", "down"], ...] = ("up", "down")
WAVES = 2000
"""Waves within which a motion has to settle."""


def corrugated(speed: float) -> wt.Scenario:
    """Return the wheel on the corrugation."""
    shape = wt.Corrugation(amplitude=AMPLITUDE, wavelength=WAVELENGTH, start=0.0)
    return scene(shape, DAMPING, speed, 1.0, rolling="point")


@cache
def main_branch() -> xr.Dataset:
    """Return the orbits of one wave from 1 to 60 m/s."""
    return wt.orbits.follow(wt.orbits.find(corrugated(5.0)), {"speed": (1.0, 60.0)})


@cache
def fates_from_rest() -> xr.Dataset:
    """Return on which orbits the motions from rest settle."""
    return wt.orbits.fates(corrugated(5.0), {"speed": SPEEDS}, WAVES)


@claim("C42", "orbits", "near resonance the motion settles on limit cycles after a long time")
def limit_cycles() -> Iterator[Measure]:
    """Measure how many motions settle, where orbits fold, double and lose contact, and two fates at one speed."""
    settled = fates_from_rest()
    share = float((settled.orbit >= 0).mean())
    yield said("in most cases", "section 5: limiting cycles are observed", f"share settled in {WAVES} waves", share)
    branch = main_branch()
    for name, kind, expected in (
        ("period 1 doubles [m/s]", "doubling", 11.515358794032), ("jump up [m/s]", "fold", 6.753010493719),
        ("bouncing ends [m/s]", "fold", 2.996075981791), ("first loss, calm [m/s]", "grazing", 6.747641791338),
    ):  # fmt: skip
        values = branch.parameter.values[branch.kind.values == kind]
        yield DOP853.relative(name, float(values[np.argmin(np.abs(values - expected))]), expected, 1e-8)
    yield PINNED.relative("period 1 is stable again [m/s]", float(branch.parameter.values[-1]), 19.1223990, 1e-7)
    for name, start, expected in (("calm", None, 1.47696340), ("bouncing", BOUNCING, 6.63994576)):
        orbit = wt.orbits.find(corrugated(5.0), start=start)
        yield DOP853.relative(f"N_max/N0 at 5 m/s, {name}", orbit.largest_force / STATIC, expected, 1e-7)
        product = float(np.prod(orbit.multipliers).real)
        shrinks = exp(-DAMPING * WAVELENGTH / (1500.0 * 5.0))
        yield analysis("exp(-c·λ/(m·V))").relative(f"product of the multipliers, {name}", product, shrinks, 1e-7)
    slow = wt.orbits.fates(corrugated(18.0), {"start.displacement": np.linspace(-4e-4, 4e-4, 16)}, 20_000)
    long = "lives of transients scatter: 16 starts"
    yield PINNED.within("share settled in 20 000 waves at 18 m/s", float((slow.orbit >= 0).mean()), 0.6, 1.0, long)
    yield PINNED.within("mean life at 18 m/s [waves]", float(slow.waves.mean()), 3000.0, 15_000.0, long)
    growth = float(wt.features.growth_exponent(10_000)(wt.simulate(corrugated(15.0))))
    yield PINNED.within("growth of small deviations at 15 m/s [1/s]", growth, 85.0, 105.0, "a mean over 10 000 waves")


def _draw_limit_cycles(figure: Figure) -> None:
    """Draw the force of the orbits of one wave over the speed, and where motions go as the speed rises and falls."""
    figure.set_size_inches(9.0, 5.0)
    axis = figure.subplots()
    branch, speeds = main_branch(), {"speed": np.linspace(1.0, 30.0, 291)}
    up, down = (wt.orbits.returns(corrugated(5.0), speeds, 200, 20, carry) for carry in CARRIES)
    for carry, found, colour in (("up", up, "tab:orange"), ("down", down, "tab:green")):
        each = np.repeat(found.speed.values, found.sizes["return"])
        name = f"speed goes {carry}"
        axis.plot(each, found.largest_force.values.ravel() / STATIC, ".", markersize=2, color=colour, label=name)
    force = branch.largest_force.values / STATIC
    stable = branch.stable.values
    axis.plot(branch.speed, np.where(stable | np.roll(stable, 1), force, np.nan), label="stable orbit of one wave")
    axis.plot(branch.speed, np.where(stable, np.nan, force), ":", color="0.4", label="unstable orbit of one wave")
    axis.set(xlim=(1.0, 30.0), ylim=(0.0, 13.0), xlabel="speed [m/s]", ylabel="largest force over static")
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=8, borderaxespad=0.1)
    figure.suptitle("C42: corrugation 50 µm, 5 cm, on a rigid rail", x=0.02, ha="left")


DRAW: dict[str, Callable[[Figure], None]] = {"orbits": _draw_limit_cycles}
