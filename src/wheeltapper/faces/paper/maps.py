"""Claims on features as functions of mass and damping: the level curves of Figs 2b and 2c."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import Measure, absolute, claim, relative, within
from wheeltapper.faces.paper.setting import HERTZ, scene

DAMPING, MASS = "vehicle.damping", "vehicle.mass"
BOTH = [DAMPING, MASS]
PAIR = [wt.features.impact_interval(), wt.features.force_ratio()]


def bump_scene(damping: float = 5e4, **changes: Any) -> wt.Scenario:
    """Return the scenario of Fig. 2a, the first nominal case."""
    shape = wt.CosineBump(height=2e-4, length=0.05, start=0.009)
    return scene(shape, damping, 9.0, 0.12, rolling="point", **changes)


def dip_scene() -> wt.Scenario:
    """Return the second nominal case: a dip at which both features are specific."""
    shape = wt.CosineBump(height=-1.01e-4, length=0.0403, start=0.009)
    return scene(shape, 4.1e4, 5.57, 0.12, rolling="point")


def chart_around(nominal: wt.Scenario, cells: int) -> Any:
    """Return both features with gradients around a scenario's damping and mass."""
    over = {
        DAMPING: nominal.vehicle.damping * np.linspace(0.5, 1.5, cells),
        MASS: nominal.vehicle.mass * np.linspace(0.6, 1.4, cells),
    }
    return wt.sweep(nominal, over, PAIR, gradient=True)


def _here(nominal: wt.Scenario) -> Any:
    return wt.gradient(nominal, PAIR, BOTH)


def random_angles(feature: str, axis: str) -> Any:
    """Return the angles of a feature to an axis over random cosine irregularities, speeds and dampings.

    Heights are log-uniform in 0.05 to 0.6 mm and of both signs, lengths in 2 to 30 cm, speeds in 2 to 40 m/s, dampings
    in 2e4 to 2e5 N s/m; first or second pair of impacts at random, kept where that pair exists.
    """
    rng = np.random.default_rng(2007)
    many = 6000

    def log_uniform(low: float, high: float) -> Any:
        return np.exp(rng.uniform(np.log(low), np.log(high), many))

    heights = log_uniform(5e-5, 6e-4) * rng.choice([-1.0, 1.0], many)
    over = {
        "irregularity.0.height": heights,
        "irregularity.0.length": log_uniform(0.02, 0.3),
        "speed": log_uniform(2.0, 40.0),
        DAMPING: log_uniform(2e4, 2e5),
    }
    first = rng.integers(1, 3, many)
    angles = []
    for pair in (1, 2):
        asked = {
            "impact_interval": wt.features.impact_interval(pair, pair + 1),
            "force_ratio": wt.features.force_ratio(pair, pair + 1),
        }[feature]
        mine = {path: values[first == pair] for path, values in over.items()}
        base = bump_scene().replaced({"duration": 0.3})
        chart = wt.sweep(base, mine, [asked], gradient=BOTH, zipped=True)
        trusted = chart[f"{feature}_angle"].sel(parameter=axis).values[chart.gradient_status.values == 0]
        angles.append(trusted[np.isfinite(trusted)])
    return np.concatenate(angles)


@claim("C03", "fig2b", "the time between two impacts is specific to the mass")
def interval_tells_mass() -> Iterator[Measure]:
    """Measure interval, elasticities and the angle to the axis of the mass."""
    here = _here(bump_scene())
    damping, mass = here.impact_interval_elasticity.values
    yield relative("interval [ms]", 1e3 * float(here.impact_interval), 8.7033, 1e-5)
    yield absolute("d ln interval / d ln c", float(damping), -0.098, 1e-3)
    yield absolute("d ln interval / d ln m", float(mass), 0.573, 1e-3)
    yield absolute("degrees off the axis of m", float(here.impact_interval_angle.sel(parameter=MASS)), 9.7, 0.1)
    exact = _here(bump_scene(**HERTZ)).impact_interval_elasticity.values
    yield absolute("d ln interval / d ln c, exact Hertz constant", float(exact[0]), -0.099, 0.01)
    yield absolute("d ln interval / d ln m, exact Hertz constant", float(exact[1]), 0.605, 0.01)


@claim("C04", "fig2b", "that holds for irregularities in general")
def interval_tells_mass_in_general() -> Iterator[Measure]:
    """Measure the angle over random irregularities."""
    angles = random_angles("impact_interval", MASS)
    yield within("median of degrees off the axis of m", float(np.median(angles)), 15.0, 22.0)
    yield within("share below 20 degrees", float(np.mean(angles < 20.0)), 0.50, 0.60)


@claim("C05", "fig2c", "the ratio of forces is specific to the damping, given a suitable irregularity")
def ratio_tells_damping() -> Iterator[Measure]:
    """Measure ratio, elasticities and angle at the bump, and the angle over random irregularities."""
    here = _here(bump_scene())
    damping, mass = here.force_ratio_elasticity.values
    yield relative("force ratio", float(here.force_ratio), 1.1155, 1e-4)
    yield absolute("d ln ratio / d ln c", float(damping), 0.098, 0.01)
    yield absolute("d ln ratio / d ln m", float(mass), -0.046, 0.01)
    yield absolute("degrees off the axis of c", float(here.force_ratio_angle.sel(parameter=DAMPING)), 25.0, 1.0)
    angles = random_angles("force_ratio", DAMPING)
    yield within("median of degrees off the axis of c, random irregularities", float(np.median(angles)), 26.0, 36.0)


@claim("C06", "fig2c", "at a well-chosen dip both features are specific, as drawn")
def dip_separates() -> Iterator[Measure]:
    """Measure both features at the dip, their angles, and where the map has no second impact."""
    here = _here(dip_scene())
    yield relative("interval [ms]", 1e3 * float(here.impact_interval), 6.270, 1e-3)
    yield relative("force ratio", float(here.force_ratio), 1.0616, 1e-3)
    yield absolute("interval: degrees off m", float(here.impact_interval_angle.sel(parameter=MASS)), 4.6, 0.2)
    yield absolute("ratio: degrees off c", float(here.force_ratio_angle.sel(parameter=DAMPING)), 0.1, 0.2)
    masses = np.linspace(0.6, 1.0, 401)
    known = np.isfinite(wt.sweep(dip_scene(), {MASS: 1500.0 * masses}, PAIR).force_ratio.values)
    yield absolute("masked below m/m0", float(masses[np.flatnonzero(~known)[-1]]), 0.77, 0.01)


@claim("C07", "fig2c", "the rate of decay follows the damping")
def decay_follows_damping() -> Iterator[Measure]:
    """Measure the elasticity of the ratio by the damping at three dampings."""
    for damping, expected in ((2e4, 0.044), (5e4, 0.098), (1e5, 0.161)):
        found = wt.gradient(bump_scene(damping), [wt.features.force_ratio()], [DAMPING])
        yield absolute(
            f"d ln ratio / d ln c at c = {damping:g}", float(found.force_ratio_elasticity[0]), expected, 0.005
        )
