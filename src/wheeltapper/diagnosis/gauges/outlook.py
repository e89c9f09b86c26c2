"""What a wheel with a flat will do at other speeds and loads: the fitted model, run again.

Runs are drawn from what the fit leaves open: the flat's kind, its length, unsprung mass, contact and track, as they go
together, and where in a bay the flat strikes.

Theory: docs/theory/gauges.rst, section 16.7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.flat import WheelFlat
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.alarms import PEAKS
from wheeltapper.diagnosis.gauges.fit import Fit
from wheeltapper.diagnosis.gauges.passing import ADVANCE, FORCE, LENGTH, POSITION, RUN_IN, SPEED
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.record.assessment.filtering import low_passed
from wheeltapper.record.simulate import simulated_quietly

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
DRAWS = 12
"""Runs at each speed and load."""
AFTER, EARLIER = 0.06, 0.01
"""How long a run goes on after the strike, and from how long before it on forces count, s."""
RATE = 20e3
"""At which forces are taken below `PEAKS`, Hz."""
QUANTILES = {"low": 0.05, "median": 0.5, "high": 0.95}
"""What is told of the draws."""
BESIDE = (POSITION, ADVANCE, SPEED, FORCE)
"""What is of the passage, not of the wheel and the track."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Kinds are drawn by multiples of this, so that each strikes all over a bay."""


class FittedFlat(NamedTuple):
    """A flat as one kind, the standard deviation of its length, m, with the error of the model, and its probability."""

    fit: Fit
    deviation: float
    probability: float = 1.0


def outlook(scene: Scenario, kinds: Sequence[FittedFlat], speeds: FloatArray, forces: FloatArray) -> xr.Dataset:
    """Return the peaks that a fitted flat will make.

    Parameters
    ----------
    scene
        One wheel without a flaw on the track.
    kinds
        The flat, as each kind that is left open.
    speeds, forces
        m/s, and static forces, N.

    Returns
    -------
    xarray.Dataset
        Over `speed` and `static_force`: largest_force and largest_below_500, N, at the quantiles "low" (5 %), "median"
        and "high" (95 %).
    """
    import xarray as xr

    drawn = _draws(kinds)
    peaks = np.empty((2, len(speeds), len(forces), len(drawn)))
    with algebra_on_one_thread():
        for i, speed in enumerate(speeds.tolist()):
            for j, force in enumerate(forces.tolist()):
                for k, (shape, values) in enumerate(drawn):
                    peaks[:, i, j, k] = _peaks(scene, shape, values, speed, force, k / len(drawn))
    raw, below = np.moveaxis(np.quantile(peaks, [*QUANTILES.values()], axis=-1), 0, -1)
    axes = ("speed", "static_force", "quantile")
    return xr.Dataset(
        {"largest_force": (axes, raw, {"units": "N"}), "largest_below_500": (axes, below, {"units": "N"})},
        {"speed": speeds, "static_force": forces, "quantile": [*QUANTILES]},
    )


def _draws(kinds: Sequence[FittedFlat]) -> list[tuple[str, dict[str, float]]]:
    """Return shapes, and values of the wheel and the track, as fits leave them open; always the same ones."""
    up_to = np.cumsum([kind.probability for kind in kinds])
    chosen = np.searchsorted(up_to, (0.5 + GOLDEN * np.arange(DRAWS)) % 1.0 * up_to[-1], side="right")
    each = [_draws_of(kind.fit, kind.deviation) for kind in kinds]
    return [(kinds[kind].fit.shape, each[kind][number]) for number, kind in enumerate(chosen.tolist())]


def _draws_of(fit: Fit, deviation: float) -> list[dict[str, float]]:
    names = [name for name in fit.names if name not in BESIDE]
    index = [fit.names.index(name) for name in names]
    covariance = fit.covariance[np.ix_(index, index)].copy()
    at = names.index(LENGTH)
    covariance[at, at] = max(covariance[at, at], (deviation / fit.values[LENGTH]) ** 2)
    steps = np.random.default_rng(0).multivariate_normal(np.zeros(len(names)), covariance, DRAWS, method="eigh")
    kept = {name: value for name, value in fit.values.items() if name not in BESIDE}
    return [kept | {n: kept[n] * float(np.exp(by)) for n, by in zip(names, step, strict=True)} for step in steps]


def _peaks(
    scene: Scenario, shape: str, values: Mapping[str, float], speed: float, force: float, share: float
) -> tuple[float, float]:
    """Return the largest force of a strike in this share of a bay, N, raw and below `PEAKS`."""
    changed = scene.replaced({path: value for path, value in values.items() if "." in path} | {"speed": speed})
    turn, strike = 2.0 * pi * float(changed.vehicle.radius), speed * RUN_IN
    first = strike % turn
    flat = WheelFlat(length=values[LENGTH], position=first + (turn if first < values[LENGTH] else 0.0), shape=shape)
    spacing = float(changed.track.spacing)
    record = simulated_quietly(changed.replaced({
        "vehicle.load": force - float(changed.vehicle.mass) * float(changed.vehicle.gravity),
        "track.first_sleeper": (strike - share * spacing) % spacing, "irregularity": [flat],
        "duration": RUN_IN + AFTER,
    }))  # fmt: skip
    begins = RUN_IN - EARLIER
    peaks = record.peaks.normal_force.values[record.peaks.time.values >= begins]
    over = record._lowered.forces(record._march, np.arange(int(record.end * RATE)) / RATE)[:, 0]
    return float(peaks.max(initial=force)), float(low_passed(over, RATE, PEAKS)[int(begins * RATE) :].max())
