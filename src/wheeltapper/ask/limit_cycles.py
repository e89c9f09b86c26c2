"""The hunting of a wagon as a limit cycle: its amplitude over speed, followed downwards to where it ends.

A wagon that hunts at a high speed is slowed down by steps; at each it runs on from where it was, until its motion
repeats. The lowest speed at which it goes on hunting is the nonlinear critical speed. Below the linear one the steady
run is stable, too: between both motions lies the smallest disturbance that grows.

Theory: docs/theory/wagon.rst, section 7.11.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.modes import fastest_growth
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_between, as_quantity, check_flag
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import MOTION_Y, PLACES
from wheeltapper.record.arguments import as_scenario
from wheeltapper.record.labels import LIMIT_CYCLES_TITLE

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
PART = 2.0
"""The motion is marched in parts of so many s, and its amplitude is that of the second half of each."""
SETTLED, LONGEST = 5e-3, 60.0
"""A motion repeats whose amplitude will change by less than this share, if it goes on to settle as it does from part to
part; it is given up after so many s."""
GONE = 5e-5
"""Amplitude of a motion that has died away, m."""
GROWN, SHRUNK, PARTS = 1.2, 0.8, 20
"""A disturbance grows, or dies away, once its amplitude is so many times the first one, within so many parts."""
HALVINGS = 7
"""So often the smallest disturbance that grows is bracketed."""


class Cycle(NamedTuple):
    """The motion at a speed.

    Attributes
    ----------
    amplitudes
        Of the lateral motion of each wheelset, m.
    frequency
        Hz; NaN if it died away.
    impacts
        Impacts of wheels in the last part, per s.
    settled
        Whether it repeats.
    state
        At its end.
    """

    amplitudes: FloatArray
    frequency: float
    impacts: float
    settled: bool
    state: FloatArray

    @property
    def hunts(self) -> bool:
        """Whether it has not died away."""
        return bool(self.amplitudes.max() > GONE)


class Runs:
    """A wagon on level rails at one speed."""

    def __init__(self, level: Scenario, speed: float) -> None:
        self.speed = speed
        self._level = level.replaced({"speed": speed, "duration": PART})

    @cached_property
    def lowered(self) -> LoweredWagon:
        """The wagon, in its steady run."""
        return lower_wagon(self._level)

    @property
    def steady(self) -> FloatArray:
        """The state of the steady run."""
        return self.lowered.assembly.start

    @cached_property
    def _sideways(self) -> NDArray[np.int64]:
        """Places of the lateral motions of the wheelsets in a state."""
        bodies = self.lowered.layout.bodies
        wheelsets = [number for number, name in enumerate(bodies) if name.startswith("wheelset ")]
        return np.array(wheelsets) * PLACES + MOTION_Y

    def disturbed(self, by: float) -> FloatArray:
        """Return the steady state with all wheelsets aside, m."""
        state = self.steady.copy()
        state[self._sideways] += by
        return state

    def part(self, state: FloatArray) -> Cycle:
        """Return the motion of one part that begins in a state."""
        march: Any = run.march(self.lowered.assembly._replace(start=state))
        if march.status != contract.DONE:
            how = "a wheel leaves the rails" if march.status == asm.DERAILED else "the march ends early"
            found = f"{self.speed:.4g} m/s, at which {how}"
            raise InputError("", "highest", found, "lower speeds, a smaller disturbance")
        late = march.steps[:, asm.STEP_TIME] > 0.5 * PART
        y, times = march.states[late][:, self._sideways], march.steps[late, asm.STEP_TIME]
        impacts = (march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum() / PART
        amplitudes = 0.5 * np.ptp(y, axis=0)
        return Cycle(amplitudes, _frequency(times, y[:, int(amplitudes.argmax())]), float(impacts), False, march.state)

    def settled(self, state: FloatArray) -> Cycle:
        """Return the motion that is reached from a state."""
        now = self.part(state)
        sizes = [float(now.amplitudes.max())]
        while now.hunts:
            now = self.part(now.state)
            sizes.append(float(now.amplitudes.max()))
            left = _left_to_settle(sizes)
            if abs(left) < SETTLED * sizes[-1]:
                return now._replace(settled=True)
            if len(sizes) * PART >= LONGEST:
                dies = _dies_away(sizes) and not fastest_growth(self.lowered) > 0.0
                return now._replace(amplitudes=np.zeros(len(now.amplitudes)), settled=True) if dies else now
        return now._replace(frequency=np.nan, settled=True)

    def grows(self, state: FloatArray) -> bool:
        """Return whether a motion grows from a state."""
        first = now = self.part(state)
        for _ in range(PARTS):
            now = self.part(now.state)
            ratio = now.amplitudes.max() / max(first.amplitudes.max(), 1e-12)
            if ratio > GROWN or ratio < SHRUNK:
                break
        return bool(now.amplitudes.max() > first.amplitudes.max())


def limit_cycles(
    scenario: Scenario | str | Path, *, highest: float | str = 70.0, lowest: float | str = 2.0,
    step: float | str = 1.0, tolerance: float = 1e-3, disturbance: float | str = 4e-3, unstable: bool = False,
    progress: Progress = True,
) -> xr.Dataset:  # fmt: skip
    """Return the limit cycles of a wagon that hunts, over speeds that fall, down to the nonlinear critical speed.

    Below that speed every motion that is followed dies away. Where flanges strike, impacts are located as ever. With
    dry friction, a motion that is too small to slide goes on differently than one that slides: this is followed as it
    comes.

    Parameters
    ----------
    scenario
        With a `Wagon` and a creep law, or the path of its TOML file; its speed and irregularities are left out.
    highest, lowest
        Speeds between which it is followed, m/s, or as "250 km/h".
    step
        Step of the speed, m/s.
    tolerance
        Relative tolerance of the speed at which the limit cycle ends.
    disturbance
        By how much all wheelsets are aside at first, m.
    unstable
        True: below the linear critical speed also the amplitude of the smallest disturbance that grows, of the shape of
        the limit cycle. It takes some ten times as long.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        Over "speed", falling: `amplitude` of the lateral motion of each "wheelset", m, `frequency` (Hz), `impacts` (per
        s), `settled` (whether the motion repeats; else it is as it was after a minute) and, if asked for,
        `unstable_amplitude` (m, of the wheelset that moves most; NaN where the steady run is unstable). Attributes:
        `nonlinear_critical_speed`, NaN if it hunts at all speeds, or at none.

    Raises
    ------
    InputError
        If the vehicle is no wagon, there is no creep law, or the speeds do not fall; or a wheel leaves the rails.
    """
    import xarray as xr

    level, speeds, by, tolerance = _arguments(scenario, highest, lowest, step, disturbance, tolerance)
    check_flag(unstable, "unstable")
    with progress_shown(progress, "speeds in m/s"):
        found = list(_followed(level, speeds, by))
        end = _end_between(level, found, tolerance)
        if end.cycle is not None:
            found[-1:] = [(end.speed, end.cycle)]
        more = {"unstable_amplitude": ("speed", [_least_growing(level, *one) for one in found])} if unstable else {}
    cycles = [cycle for _, cycle in found]
    words = {"units": "m", "long_name": "amplitude of the smallest disturbance that grows"}
    return xr.Dataset(
        {
            "amplitude": (
                ("speed", "wheelset"), np.array([cycle.amplitudes for cycle in cycles]),
                {"units": "m", "long_name": "amplitude of the lateral motion"},
            ),
            "frequency": ("speed", [cycle.frequency for cycle in cycles], {"units": "Hz", "long_name": "of hunting"}),
            "impacts": ("speed", [cycle.impacts for cycle in cycles], {"units": "1/s", "long_name": "impacts"}),
            "settled": ("speed", [cycle.settled for cycle in cycles], {"long_name": "whether the motion repeats"}),
            **{name: (*values, words) for name, values in more.items()},
        },
        {
            "speed": ("speed", [speed for speed, _ in found], {"units": "m/s", "long_name": "speed"}),
            "wheelset": np.arange(1, len(level.vehicle.axles) + 1),
        },
        {"title": LIMIT_CYCLES_TITLE, "nonlinear_critical_speed": float(end.speed)},
    )  # fmt: skip


def _arguments(
    scenario: Scenario | str | Path, highest: Any, lowest: Any, step: Any, disturbance: Any, tolerance: float
) -> tuple[Scenario, FloatArray, float, float]:
    """Return the level scenario, the falling speeds, the disturbance and the tolerance, or refuse them."""
    scenario = as_scenario(scenario)
    run.choose(run.CRITICAL_SPEED, scenario.needs)
    named = (("highest", highest), ("lowest", lowest), ("step", step))
    top, bottom, by = (as_quantity(given, name, "speed") for name, given in named)
    if not bottom < top:
        raise InputError("", "lowest, highest", f"{bottom:g} m/s and {top:g} m/s", "speeds that rise")
    speeds = np.append(np.arange(top, bottom, -by), bottom)
    aside = as_quantity(disturbance, "disturbance", "length")
    tolerance = as_between(tolerance, "tolerance", 1e-9, 1.0)
    return scenario.replaced({"irregularity": None, "start": "equilibrium"}), speeds, aside, tolerance


def _left_to_settle(sizes: list[float]) -> float:
    """Return by how much the last of some amplitudes will change if changes go on to shrink; inf if they do not."""
    if len(sizes) < 3:
        return float("inf")
    before, last = sizes[-2] - sizes[-3], sizes[-1] - sizes[-2]
    if last == 0.0:
        return 0.0
    return last * last / (before - last) if 0.0 < last / before < 1.0 else float("inf")


def _dies_away(sizes: list[float]) -> bool:
    """Return whether amplitudes fall by about the same factor in the last two thirds of the time."""
    third = len(sizes) // 3
    before, last = np.log(sizes[2 * third] / sizes[third]), np.log(sizes[-1] / sizes[2 * third])
    return bool(before < 0.0 and last < 0.5 * before)


def _frequency(times: FloatArray, y: FloatArray) -> float:
    """Return the frequency of a motion, Hz, from where it passes its middle upwards; NaN where it does so once."""
    y = y - 0.5 * (y.max() + y.min())
    rises = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    if len(rises) < 2:
        return float("nan")
    at = times[rises] - y[rises] * (times[rises + 1] - times[rises]) / (y[rises + 1] - y[rises])
    return float((len(at) - 1) / (at[-1] - at[0]))


def _followed(level: Scenario, speeds: FloatArray, by: float) -> Iterator[tuple[float, Cycle]]:
    """Yield the motions at falling speeds, until one has died away."""
    state = None
    for speed in speeds.tolist():
        report("speeds in m/s", float(speeds[0] - speed), float(speeds[0] - speeds[-1]))
        runs = Runs(level, speed)
        cycle = runs.settled(runs.disturbed(by) if state is None else state)
        yield speed, cycle
        if not cycle.hunts:
            return
        state = cycle.state


class _End(NamedTuple):
    speed: float
    cycle: Cycle | None


def _end_between(level: Scenario, found: list[tuple[float, Cycle]], tolerance: float) -> _End:
    """Return the lowest speed at which a motion goes on, between the last two; NaN where there are no two of these."""
    if len(found) < 2 or found[-1][1].hunts:
        return _End(float("nan"), None)
    (high, held), (low, _) = found[-2], found[-1]
    while high - low > tolerance * high:
        speed = 0.5 * (high + low)
        cycle = Runs(level, speed).settled(held.state)
        if cycle.hunts:
            high, held = speed, cycle
        else:
            low = speed
    return _End(high, held)


def _least_growing(level: Scenario, speed: float, cycle: Cycle) -> float:
    """Return the amplitude of the smallest disturbance of a cycle's shape that grows, m; NaN where all of them do."""
    runs = Runs(level, speed)
    apart = cycle.state - runs.steady
    low, high = 0.0, 1.0
    if not cycle.hunts or runs.grows(runs.steady + GONE / cycle.amplitudes.max() * apart):
        return float("nan")
    for _ in range(HALVINGS):
        share = 0.5 * (low + high)
        if runs.grows(runs.steady + share * apart):
            high = share
        else:
            low = share
    return float(0.5 * (low + high) * cycle.amplitudes.max())
