"""The analytic oracles of vibro-impact mechanics (physics reference, section 6)."""

from math import pi, sqrt

import numpy as np
import pytest

import wheeltapper as wt

MASS, LOAD, CONSTANT = 1500.0, 91_307.0, 1.405e11
N0 = LOAD + MASS * 9.81
D0 = (N0 / CONSTANT) ** (2 / 3)


def drop(height, duration=0.05, damping=0.0, **contact):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=LOAD, damping=damping),
        contact=wt.Hertz(**({"constant": CONSTANT} | contact)),
        speed=0.0,
        duration=duration,
        start={"displacement": height},
    )


def release_at(force_ratio):
    """Start at rest under the largest force of a vibration."""
    return -((force_ratio * N0 / CONSTANT) ** (2 / 3))


@pytest.mark.parametrize(("ratio", "lost"), [(2.5 * (1 - 1e-9), False), (2.5 * (1 + 1e-9), True)])
def test_contact_is_lost_exactly_when_the_largest_force_passes_two_and_a_half(ratio, lost):
    record = wt.simulate(drop(release_at(ratio)), "strict")
    assert (len(record.events.time) > 0) == lost


def test_loss_begins_at_the_closed_forms_indentation():
    assert pytest.approx(1.84202, abs=5e-6) == (2.5 ** (2 / 3))
    record = wt.simulate(drop(release_at(2.5 * (1 - 1e-12)), 0.02), "strict")
    assert record.history(100e3).indentation.values.min() / D0 < 1e-4


@pytest.mark.parametrize(
    ("ratio", "expected"),
    [
        (1.25, 0.9988916531153), (1.5, 0.99566), (2.0, 0.9822691757784), (2.4, 0.96137),
        (2.75, 0.9223310579847), (3.0, 0.88740), (4.0, 0.7564072823876), (6.0, 0.57702), (10.0, 0.3952470284601),
    ],
)  # fmt: skip
def test_frequency_falls_with_amplitude(ratio, expected):
    record = wt.simulate(drop(release_at(ratio), 0.1), "strict")
    linear = sqrt(1.5 * CONSTANT * sqrt(D0) / MASS) / (2 * pi)
    period = np.diff(record.peaks.time.values)
    digits = 1e-9 if len(str(expected)) > 10 else 6e-6
    assert 1 / period[0] / linear == pytest.approx(expected, abs=digits)
    np.testing.assert_allclose(record.peaks.normal_force, ratio * N0, rtol=1e-11)


def test_an_impact_without_preload_follows_hertz():
    speed = 0.3
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=1e-6, gravity=0.0),
        contact=wt.Hertz(constant=CONSTANT),
        speed=0.0,
        duration=0.01,
        start={"displacement": 1e-6, "velocity": -speed},
    )
    record = wt.simulate(scene, "strict")
    largest = CONSTANT**0.4 * (5 * MASS * speed**2 / 4) ** 0.6
    assert record.peaks.normal_force.item() == pytest.approx(largest, rel=1e-9)
    depth = (largest / CONSTANT) ** (2 / 3)
    assert record.impacts.duration.item() == pytest.approx(2.943275 * depth / speed, rel=1e-6)
    assert record.impacts.impulse.item() == pytest.approx(2 * MASS * speed, rel=1e-9)


@pytest.mark.parametrize(("method", "limit"), [("default", 1e-6), ("strict", 2e-10)])
def test_ten_thousand_undamped_impacts_keep_their_energy(method, limit):
    record = wt.simulate(drop(2e-4, 81.1), method)
    impacts = record.impacts
    assert len(impacts.time) >= 10_000
    forces = record.peaks.normal_force.values
    energy = forces ** (5 / 3)  # (2/5)·C·δ^2.5 - N0·δ: the first dominates; both forces are compared below exactly
    depth = (forces / CONSTANT) ** (2 / 3)
    total = 0.4 * CONSTANT * depth**2.5 - N0 * depth
    assert energy.size == forces.size
    assert np.abs(total / total[0] - 1).max() < limit
    assert abs(record.energy.relative_imbalance.item()) < limit


def test_high_frequency_grazing():
    # A mass far too slow to follow: contact is just lost at a/δ0 = (3π/(8·sqrt(2)))^(2/3), at 3π/4 of the mean force.
    mean = N0
    amplitude = (3 * pi / (8 * sqrt(2))) ** (2 / 3)
    assert amplitude == pytest.approx(0.88534, abs=5e-6)
    phase = np.linspace(0, 2 * pi, 200_001)
    indentation = amplitude * (1 + np.sin(phase))
    force = CONSTANT * (D0 * indentation) ** 1.5
    assert np.trapezoid(force, phase) / (2 * pi) == pytest.approx(mean, rel=1e-9)
    assert force.max() / mean == pytest.approx(3 * pi / 4, rel=1e-9)


def dip(depth, duration=0.2):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=100_000 - 1500 * 9.81, stiffness=0, damping=0),
        contact=wt.Hertz(constant=9e10),
        irregularity=wt.CosineBump(height=-depth, length=0.02, start=0.05),
        rolling="point",
        speed=5.0,
        duration=duration,
    )


@pytest.mark.filterwarnings("ignore:the irregularity is more sharply hollow")  # the oracle is a point follower's
def test_threshold_of_lift_off_over_a_dip():
    low, high = 0.05e-3, 0.08e-3
    for _ in range(30):
        middle = 0.5 * (low + high)
        if len(wt.simulate(dip(middle, 0.05)).events.time):
            high = middle
        else:
            low = middle
    assert high == pytest.approx(0.06407e-3, abs=5e-9)
    assert len(wt.simulate(dip(1.0005 * high)).events.time) == 54


def test_a_flat_lets_the_wheel_fly_above_the_critical_speed():
    # Over the pivot arc the path's acceleration is V²/R; the load can give N0/m at most (V_crit = sqrt(R·N0/m)).
    assert sqrt(0.46 * 105_820 / 1500) == pytest.approx(5.70, abs=0.005)
