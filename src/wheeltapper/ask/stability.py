"""The speed at which a wagon begins to hunt."""

from __future__ import annotations

from typing import Any

import numpy as np

from wheeltapper.ask.modes import STILL, as_wagon, linearised
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.wagon import lower_wagon

__all__ = ["critical_speed"]


def critical_speed(scenario: Scenario, *, highest: float = 150.0, tolerance: float = 1e-4) -> float:
    """Return the lowest speed, m/s, at which a small deviation from the steady run grows: the linear critical speed.

    Parameters
    ----------
    scenario
        With a `Wagon` and a creep law; its speed and irregularities are left out.
    highest
        Speeds above it are not looked at; infinity is returned where the run is stable up to there.
    tolerance
        Of the speed, relative.

    Raises
    ------
    InputError
        If the vehicle is no wagon, or there is no creep law.
    """
    from scipy.optimize import brentq

    as_wagon(scenario, "critical speed")
    if scenario.creep is None:
        raise InputError("", "creep", "none", "a creep law, without which nothing hunts")
    level = scenario.replaced({"irregularity": None})

    def growth(speed: float) -> float:
        linear = linearised(lower_wagon(level.replaced({"speed": float(speed)})))
        values: Any = np.linalg.eigvals(linear.matrix)
        return float(values[np.abs(values) > STILL].real.max())

    speeds = np.linspace(2.0, highest, 75)
    before = growth(speeds[0])
    if before > 0.0:
        return float(speeds[0])
    for slower, faster in zip(speeds[:-1], speeds[1:], strict=True):
        after = growth(faster)
        if after > 0.0:
            return float(brentq(growth, slower, faster, rtol=tolerance))
    return float("inf")
