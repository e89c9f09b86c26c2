"""Creep laws that count spin as lateral slip, against FASTSIM: where they are near it, and notes beyond."""

from math import pi, sqrt

import numpy as np
import pytest

import wheeltapper as wt
from tests.reference.test_creep import fastsim
from wheeltapper.lower.laws.kalker import coefficients
from wheeltapper.record.creep_range import spin_use

LAWS = [wt.creep.Polach(), wt.creep.ShenHedrickElkins()]
LIMIT, POISSON = 0.2, 0.3


def apart(law, ratio, along, across, spin):
    """Return how far a law is from FASTSIM, over μ·N, where linear forces over μ·N are these and a/b is the ratio."""
    a, b = sqrt(ratio), 1.0 / sqrt(ratio)
    c = coefficients(a, b, POISSON)
    # creepages with a shear modulus and a μ·N of one
    xi, eta, phi = along / c.c11, across / c.c22, spin / c.c23
    top = 2.0 / pi
    l1, l2, l3 = 8 * a / (3 * c.c11), 8 * a / (3 * c.c22), pi * a * sqrt(ratio) / (4 * c.c23)
    exact = fastsim(
        a * xi / (top * l1), a * eta / (top * l2), b * a * phi / (top * l3), a * a * phi / (top * l3), 24, 24
    )
    linear = np.array([along, across + spin])
    found = -linear * law.saturation(np.hypot(*linear))
    return np.hypot(*(found - exact))


def worst(law, ratio, spin):
    return max(
        apart(law, ratio, size * np.cos(angle), size * np.sin(angle), spin)
        for size in (0.0, 0.2, 0.5, 1.0, 2.0, 4.0)
        for angle in np.linspace(-pi / 2, pi / 2, 9)
    )


@pytest.mark.parametrize("law", LAWS)
def test_within_their_range_of_spin_the_laws_are_near_fastsim(law):
    assert law.spin_range == LIMIT
    assert max(worst(law, ratio, LIMIT) for ratio in (1.0, 1.33, 2.0, 4.0)) < 0.12
    assert worst(law, 0.5, LIMIT) < 0.15


@pytest.mark.parametrize("law", LAWS)
def test_beyond_it_they_are_wrong(law):
    assert worst(law, 1.0, 1.0) == pytest.approx(0.4, abs=0.03)
    assert worst(law, 0.5, 1.0) == pytest.approx(0.55, abs=0.03)
    assert 0.7 < worst(law, 0.5, 4.0) < 0.9


def coach(creep, **changes):
    fields = {"vehicle": wt.Wagon.erri_b176(), "contact": wt.Hertz(), "creep": creep, "speed": 10.0, "duration": 0.02}
    return wt.Scenario(**fields | changes)


def said(record):
    return [note for note in record.notes if "spin" in note or "flange" in note]


def test_the_use_of_friction_by_spin_is_that_of_a_straight_run():
    law = wt.creep.KalkerLinear(friction=0.35)
    scene = coach(law)
    history = wt.simulate(scene).at([0.01])  # no lateral slip here: the force is that of spin
    found = np.abs(history.lateral_creep_force / (0.35 * history.normal_force)).values
    np.testing.assert_allclose(found, spin_use(scene, 0.35, 0.46, np.zeros(1))[0], rtol=2e-3)


def test_a_run_on_the_treads_of_dry_rails_says_nothing_and_one_on_slippery_rails_its_number():
    assert said(wt.simulate(coach(wt.creep.Polach(friction=0.35)))) == []
    (note,) = said(wt.simulate(coach(wt.creep.Polach(friction=0.1))))
    assert "would use 0.28 of the friction limit on wheelset" in note
    assert "Polach is close to FASTSIM up to 0.2" in note
    assert said(wt.simulate(coach(wt.creep.Fastsim(friction=0.1)))) == []


def test_a_wheelset_that_cannot_move_sideways_is_looked_at_too():
    axle = wt.vehicles.Axle(
        mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, load=91_307.0, held=("x", "y", "roll", "yaw")
    )
    held = wt.Wagon(bodies=(), axles=(axle,))
    (note,) = said(wt.simulate(coach(wt.creep.Polach(friction=0.1), vehicle=held)))
    assert "on wheelset 1" in note


def test_a_flange_that_touches_is_said_with_its_time():
    kick = {"left": wt.CosineBump(height=1e-3, length=3.0, start=1.0)}
    scene = coach(wt.creep.Polach(friction=0.35), irregularity=kick, speed=95.0, duration=1.0)
    record = wt.simulate(scene)
    (note,) = said(record)
    on_flange = record.events.surface.values == "flange"
    assert f"flanges touch from t = {record.events.time.values[on_flange][0]:.4g} s on" in note
