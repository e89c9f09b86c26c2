"""Suspensions and decks that are much faster than the contact, against SciPy's implicit Radau."""

import warnings
from math import cos

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wheeltapper as wt

pytestmark = pytest.mark.filterwarnings("ignore:.*is implausible")
G = 9.81


def drawn(rng):
    """A light wheel with a heavy damper over a long dip or bump that it does not leave."""
    mass = float(10 ** rng.uniform(0.7, 2.5))
    return wt.Scenario(
        vehicle=wt.Wheelset(
            mass=mass, load=float(10 ** rng.uniform(4, 5)), gravity=G,
            stiffness=float(10 ** rng.uniform(5, 8)), damping=mass * float(10 ** rng.uniform(4, 6)),
        ),
        contact=wt.Hertz(constant=float(10 ** rng.uniform(10.3, 11.5))),
        irregularity=wt.CosineBump(
            height=float(rng.choice([-1, 1]) * rng.uniform(0.5e-5, 2e-5)), length=0.5, start=0.02
        ),
        rolling="point", speed=float(rng.uniform(1, 10)), duration=0.02,
    )  # fmt: skip


def solved(scene, times):
    """Return displacement and force at the times; the contact is never lost."""
    v, bump, constant = scene.vehicle, scene.irregularity[0], scene.contact.constant
    k = 2 * np.pi / bump.length

    def depth(t, y):
        x = scene.speed * t - bump.start
        height = 0.5 * bump.height * (1 - cos(k * x)) if 0 <= x <= bump.length else 0.0
        return max(height - y, 0.0)

    def force(t, y):
        return constant * depth(t, y) ** 1.5

    def jacobian(t, s):
        return [[0.0, 1.0], [-(1.5 * constant * depth(t, s[0]) ** 0.5 + v.stiffness) / v.mass, -v.damping / v.mass]]

    def rates(t, s):
        return [s[1], (force(t, s[0]) - v.load - v.mass * G - v.stiffness * s[0] - v.damping * s[1]) / v.mass]

    start = [wt.simulate(scene).at(0.0).wheel_displacement.item(), 0.0]
    assert abs(rates(0.0, start)[1]) * v.mass < 1e-6 * v.load
    found = solve_ivp(rates, (0, times[-1]), start, "Radau", times, jac=jacobian, rtol=1e-8, atol=[1e-14, 1e-11])
    return found.y[0], np.array([force(t, y) for t, y in zip(times, found.y[0], strict=True)])


def check(scene):
    times = np.linspace(0, scene.duration, 41)
    displacement, force = solved(scene, times)
    for method in ("default", "strict"):
        record = wt.simulate(scene, method)
        assert abs(record.energy.relative_imbalance.item()) < 1e-9
        assert (record.history(50e3).normal_force.values < 100 * record.static_force).all()
        if record.events.sizes["event"]:
            return False
        found = record.at(times)
        size = abs(displacement[0])
        np.testing.assert_allclose(found.wheel_displacement.values, displacement, rtol=0, atol=1e-7 * size)
        np.testing.assert_allclose(found.normal_force.values, force, rtol=1e-6)
    return True


def test_a_light_wheel_with_a_heavy_damper_stays_at_rest():
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=9.74, load=18_473, stiffness=1.19e5, damping=9.7e6),
        contact=wt.Hertz(constant=1.08e10),
        speed=0,
        duration=0.01,
    )
    for method in ("default", "strict"):
        record = wt.simulate(scene, method)
        np.testing.assert_allclose(record.history().normal_force.values, record.static_force, rtol=1e-12)


def test_stiff_suspensions_follow_an_implicit_solver():
    rng = np.random.default_rng(3)
    assert sum(check(drawn(rng)) for _ in range(6)) >= 3


@pytest.mark.whole
@pytest.mark.slow
def test_stiff_suspensions_follow_an_implicit_solver_in_many_cases():
    rng = np.random.default_rng(4)
    assert sum(check(drawn(rng)) for _ in range(300)) >= 150


@pytest.mark.whole
@pytest.mark.slow
def test_stiff_decks_suspensions_and_contacts_are_balanced():
    rng = np.random.default_rng(1)
    for _ in range(300):
        speed = 10 ** rng.uniform(0, 1.6)
        damping = {"restitution": rng.uniform(0.05, 0.7), "impact_speed": 10 ** rng.uniform(-2, -0.3)}
        mass = 10 ** rng.uniform(0.5, 3.5)
        scene = wt.Scenario(
            vehicle=wt.Wheelset(
                mass=mass, load=10 ** rng.uniform(3.5, 5.3), stiffness=10 ** rng.uniform(4, 8),
                damping=min(10 ** rng.uniform(5, 7.3), 1e6 * mass),
            ),
            track=wt.FloatingDeck(
                mass=10 ** rng.uniform(1.5, 4), stiffness=10 ** rng.uniform(6, 9.5), damping=10 ** rng.uniform(3, 7)
            ),
            contact=wt.Hertz(constant=1e11, **damping),
            irregularity=wt.CosineBump(height=rng.uniform(-1, 1) * 1e-3, length=0.05, start=0.01),
            rolling="point", speed=speed, duration=min(0.2 / speed, 0.1),
        )  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for method in ("default", "strict"):
                assert abs(wt.simulate(scene, method).energy.relative_imbalance.item()) < 1e-9
