"""The hunting of a wagon: the critical speed, at which it begins, and the limit cycles that it leads to."""

from __future__ import annotations

import warnings
from math import ceil
from pathlib import Path

import numpy as np

from wheeltapper.ask.limit_cycles import limit_cycles
from wheeltapper.ask.modes import ROUNDING, fastest_growth, modes
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.element import Sliding
from wheeltapper.ground.arguments import as_between, as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.warned import ModelWarning, warn_caller
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.record.arguments import as_scenario

__all__ = ["critical_speed", "limit_cycles"]

STEP = 2.0
"""Distance between the speeds at which stability is tested first, m/s. An unstable range that is narrower may be
missed."""
FINEST = 1e-15
"""Smallest tolerance that may be asked for, relative to the speed: a few units in the last place."""


def critical_speed(
    scenario: Scenario | str | Path, *, lowest: float | str = 2.0, highest: float | str = 150.0,
    tolerance: float = 1e-4, progress: Progress = True,
) -> float:  # fmt: skip
    """Return the lowest speed, m/s, at which a small deviation from the steady run grows: the linear critical speed.

    It lies between `lowest` and `highest`. Stability is tested every 2 m/s there: an unstable range of speeds that is
    narrower may be missed. A mode that neither grows nor decays (its damping ratio within 1e-9 of zero) does not count
    as hunting; a warning names it. Dry friction is taken as sticking. If there is some, a warning says how each element
    is taken, and states the critical speed without friction.

    Parameters
    ----------
    scenario
        With a `Wagon` and a creep law, or the path of its TOML file; its speed and irregularities are left out.
    lowest
        Lowest speed of the search, m/s, or as "10 km/h"; the vehicle has to be stable there.
    highest
        Highest speed of the search, m/s; infinity is returned if the run is stable, or undamped, up to it.
    tolerance
        Relative tolerance of the speed.
    progress
        As for `wheeltapper.simulate`.

    Raises
    ------
    InputError
        If the vehicle is no wagon, there is no creep law, the speeds do not rise, or a deviation grows already at the
        lowest of them: the critical speed is then below.
    """
    scenario = as_scenario(scenario)
    run.choose(run.CRITICAL_SPEED, scenario.needs)
    lowest, highest = (
        as_quantity(given, name, "speed", positive=False) for name, given in (("lowest", lowest), ("highest", highest))
    )
    tolerance = as_between(tolerance, "tolerance", FINEST, 1.0)
    if not 0.0 < lowest < highest:
        raise InputError("", "lowest, highest", f"{lowest:g} m/s and {highest:g} m/s", "speeds above zero that rise")
    level = scenario.replaced({"irregularity": None})
    with progress_shown(progress, "speeds in m/s"):
        found = _first_growth(level, lowest, highest, tolerance)
        sticking = [element for element in level.vehicle.elements if isinstance(element, Sliding)]
        if sticking:
            warn_caller(_friction_text(level, sticking, found, (lowest, highest, tolerance)))
        return found


def _first_growth(level: Scenario, lowest: float, highest: float, tolerance: float) -> float:
    """Return the lowest speed at which a deviation grows, infinity if there is none."""
    from scipy.optimize import brentq

    def growth_rate(speed: float) -> float:
        return fastest_growth(lower_wagon(level.replaced({"speed": float(speed)})))

    speeds = np.linspace(lowest, highest, ceil((highest - lowest) / STEP) + 1)
    _check_slowest(level.replaced({"speed": float(lowest)}), growth_rate(lowest))
    for slower, faster in zip(speeds[:-1], speeds[1:], strict=True):
        report("speeds in m/s", float(slower), float(highest))
        if growth_rate(faster) > 0.0:
            return float(brentq(growth_rate, slower, faster, rtol=tolerance))
    return float("inf")


def _friction_text(level: Scenario, sticking: list[Sliding], found: float, search: tuple[float, float, float]) -> str:
    """Return how friction is taken, and the critical speed without it."""
    lowest, highest, _ = search

    def speed_text(speed: float) -> str:
        return f"{speed:.4g} m/s" if np.isfinite(speed) else f"above {highest:.4g} m/s"

    ways = [f"{one.name!r} as {'rigid' if one.series_stiffness is None else 'its spring'}" for one in sticking]
    more = f" and {len(ways) - 3} more" if len(ways) > 3 else ""
    try:
        free = level.replaced({"vehicle": level.vehicle.without(*(one.name for one in sticking))})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)  # of modes that friction alone damps
            other = speed_text(_first_growth(free, *search))
    except InputError as error:
        other = f"below {lowest:.4g} m/s" if "grows already" in error.found else f"none ({error})"
    return (
        f"the critical speed, {speed_text(found)}, holds while dry friction sticks ({', '.join(ways[:3])}{more}); "
        f"without this friction it is {other}. Where friction slides, it depends on the size of a deviation whether it "
        "grows: simulate one of that size"
    )


def _check_slowest(scenario: Scenario, growth: float) -> None:
    """Refuse a wagon with a mode that grows at the scenario's speed; warn of modes that neither grow nor decay."""
    found = modes(scenario)
    ratios = found.damping_ratio.values

    def mode_text(mode: int) -> str:
        return f"'{found.name.values[mode]}' at {float(found.frequency[mode]):.3g} Hz"

    if growth > 0.0:
        raise InputError(
            "", "vehicle", f"a mode that grows already at {scenario.speed:g} m/s, {mode_text(int(np.argmin(ratios)))}",
            "a wagon that runs stably at the lowest speed searched (`lowest`)",
        )  # fmt: skip
    undamped = np.flatnonzero(np.abs(ratios) <= ROUNDING)
    if len(undamped):
        more = f" and {len(undamped) - 1} more" if len(undamped) > 1 else ""
        warn_caller(
            f"undamped: {mode_text(int(undamped[0]))}{more}; a mode that neither grows nor decays "
            "does not count as hunting"
        )
