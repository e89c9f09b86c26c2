"""Claims on features as functions of mass and damping: the level curves of Figs 2b and 2c."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import wheeltapper as wt
from wheeltapper.faces.paper.claims import PINNED, Case, Measure, claim, said
from wheeltapper.faces.paper.setting import HERTZ, scene
from wheeltapper.faces.paper.single import DIGITS

DAMPING, MASS = "vehicle.damping", "vehicle.mass"
BOTH = [DAMPING, MASS]
FEW = "a share of some thousand irregularities, of which rounding may move one"
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


BUMP, DIP = Case("bump of Fig. 2a"), Case("chosen dip")
"""Readings: the paper tells a cosine profile, and not which."""


def _features_at(nominal: wt.Scenario) -> Any:
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
    here = _features_at(bump_scene())
    damping, mass = here.impact_interval_elasticity.values
    angle = float(here.impact_interval_angle.sel(parameter=MASS))
    yield said("almost parallel", "section 3, Fig. 2b", "degrees off the axis of m", angle)
    yield DIGITS.relative("interval [ms]", 1e3 * float(here.impact_interval), 8.703293, 1e-6)
    yield PINNED.relative("d ln interval / d ln c", float(damping), -0.0984481)
    yield PINNED.relative("d ln interval / d ln m", float(mass), 0.573435)
    yield PINNED.relative("degrees off the axis of m", angle, 9.74165)
    exact = _features_at(bump_scene(**HERTZ)).impact_interval_elasticity.values
    yield PINNED.relative("d ln interval / d ln c, exact Hertz constant", float(exact[0]), -0.100435)
    yield PINNED.relative("d ln interval / d ln m, exact Hertz constant", float(exact[1]), 0.606637)


@claim(
    "C04", "fig2b", "the frequency of impacts depends strongly on the mass, for irregularities in general",
    "more on the mass than on the damping in nearly all cases, almost on the mass alone in fewer than half",
)  # fmt: skip
def interval_tells_mass_in_general() -> Iterator[Measure]:
    """Measure the angle over random irregularities."""
    angles = random_angles("impact_interval", MASS)
    nearer = float(np.mean(angles < 45.0))
    yield said("in most cases", "section 6: strongly", "share of irregularities nearer to the axis of m", nearer)
    middle = float(np.median(angles))
    words, many = "median of degrees off the axis of m", Case("random irregularities", own=False)
    yield said("almost parallel", "section 3", words, middle, refutes=True, case=many)
    yield PINNED.relative(words, middle, 17.7122)
    yield PINNED.relative("share below 20 degrees", float(np.mean(angles < 20.0)), 0.560802, 2e-3, FEW)


@claim(
    "C05", "fig2c", "the ratio of forces is specific to the damping",
    "it depends on the damping more than on the mass, and is specific to it only over a chosen irregularity (C06)",
)  # fmt: skip
def ratio_tells_damping() -> Iterator[Measure]:
    """Measure ratio, elasticities and angle at the bump, and the angle over random irregularities."""
    here = _features_at(bump_scene())
    damping, mass = here.force_ratio_elasticity.values
    angle = float(here.force_ratio_angle.sel(parameter=DAMPING))
    yield said("higher", "section 3", "dependence on c over that on m", abs(float(damping / mass)))
    dip = float(_features_at(dip_scene()).force_ratio_angle.sel(parameter=DAMPING))
    for case, off in ((BUMP, angle), (DIP, dip)):
        yield said("almost parallel", "section 3, Fig. 2c", "degrees off the axis of c", off, case is BUMP, case)
    yield DIGITS.relative("force ratio", float(here.force_ratio), 1.115494, 1e-6)
    yield PINNED.relative("d ln ratio / d ln c", float(damping), 0.0979506)
    yield PINNED.relative("d ln ratio / d ln m", float(mass), -0.0457055)
    yield PINNED.relative("degrees off the axis of c", angle, 25.0146)
    middle = float(np.median(random_angles("force_ratio", DAMPING)))
    yield PINNED.relative("median of degrees off the axis of c, random irregularities", middle, 31.0501)


@claim("C06", "fig2c", "at a well-chosen dip both features are specific, as drawn")
def dip_separates() -> Iterator[Measure]:
    """Measure both features at the dip, their angles, and where the map has no second impact."""
    here = _features_at(dip_scene())
    of_mass = float(here.impact_interval_angle.sel(parameter=MASS))
    of_damping = float(here.force_ratio_angle.sel(parameter=DAMPING))
    yield said("almost parallel", "section 3, Fig. 2b", "interval: degrees off m", of_mass)
    yield said("almost parallel", "section 3, Fig. 2c", "ratio: degrees off c", of_damping)
    yield PINNED.relative("interval [ms]", 1e3 * float(here.impact_interval), 6.27049)
    yield PINNED.relative("force ratio", float(here.force_ratio), 1.06162)
    yield PINNED.relative("interval: degrees off m", of_mass, 4.60881)
    yield PINNED.relative("ratio: degrees off c", of_damping, 0.10798, 1e-2, "a small angle, the difference of two")
    masses = np.linspace(0.6, 1.0, 401)
    known = np.isfinite(wt.sweep(dip_scene(), {MASS: 1500.0 * masses}, PAIR).force_ratio.values)
    yield PINNED.relative("masked below m/m0", float(masses[np.flatnonzero(~known)[-1]]), 0.774)


@claim(
    "C56", "fig2c", "the ratio of forces is specific to the damping in a large neighbourhood of the nominal case",
    "around the chosen dip; nowhere around the bump of Fig. 2a",
)  # fmt: skip
def specific_around() -> Iterator[Measure]:
    """Measure the share of cells with both parameters within 30 % at which the gradient is along the axis of c."""
    near = np.linspace(0.7, 1.3, 31)
    for case, nominal in ((BUMP, bump_scene()), (DIP, dip_scene())):
        over = {DAMPING: nominal.vehicle.damping * near, MASS: nominal.vehicle.mass * near}
        angles = wt.sweep(nominal, over, [PAIR[1]], gradient=True).force_ratio_angle.sel(parameter=DAMPING).values
        share = float(np.mean(angles < 15.0))  # where there is no second impact the angle is NaN
        words = "share of cells within 30 % at which it is almost parallel to the axis of c"
        yield said("in most cases", "section 3, Fig. 2c: relatively large", words, share, case is BUMP, case)


@claim("C55", "deck", "on a deck the frequency is sensitive to the mass, and the rate of decay to the damping")
def sensitive_on_a_deck() -> Iterator[Measure]:
    """Measure the elasticities of interval and decay on a deck of ten wheelsets."""
    nominal = bump_scene(track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7))
    here = _features_at(nominal)
    _, mass = here.impact_interval_elasticity.values
    damping, _ = here.force_ratio_elasticity.values / float(np.log(here.force_ratio))
    yield said("sensitive", "section 3", "d ln interval / d ln m", float(mass))
    yield said("sensitive", "section 3", "d ln (ln ratio) / d ln c", float(damping))


@claim("C07", "fig2c", "the rate of decay follows the damping")
def decay_follows_damping() -> Iterator[Measure]:
    """Measure the elasticity of the ratio by the damping at three dampings, and of its logarithm, the decay."""
    for damping, expected in ((2e4, 0.0445523), (5e4, 0.0979506), (1e5, 0.161129)):
        found = wt.gradient(bump_scene(damping), [wt.features.force_ratio()], [DAMPING])
        elasticity = float(found.force_ratio_elasticity[0])
        yield PINNED.relative(f"d ln ratio / d ln c at c = {damping:g}", elasticity, expected)
        decay = elasticity / float(np.log(found.force_ratio))
        yield said("sensitive", "section 3", f"d ln (ln ratio) / d ln c at c = {damping:g}", decay)
