"""The closed forms of vibro-impact mechanics (docs/theory/closed_forms.rst)."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

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


def test_a_wheel_that_is_let_go_where_it_just_touches_sinks_to_the_closed_forms_indentation():
    record = wt.simulate(drop(0.0, 0.02), "strict")
    assert record.peaks.normal_force.values[0] == pytest.approx(2.5 * N0, rel=1e-9)
    deepest = record.at(record.peaks.time.values[0]).indentation.item()
    assert deepest / D0 == pytest.approx(1.84202, abs=5e-6)
    assert record.history(100e3).indentation.values.min() / D0 < 1e-4  # and comes back to the touch


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
@pytest.mark.slow
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


HEAVY = 100 * MASS
"""A mass with a resonance at 18 Hz, far too slow to follow a corrugation that is met 7200 times a second."""
WAVES = 20


def fast_corrugation(amplitude, mean):
    """Move the heavy wheel over a corrugation; amplitude and the wheel's mean indentation are over D0."""
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=HEAVY, load=N0, gravity=0.0),
        contact=wt.Hertz(constant=CONSTANT),
        irregularity=wt.Corrugation(amplitude=amplitude * D0, wavelength=0.005, start=0.0),
        rolling="point",
        speed=36.0,
        duration=WAVES / 7200,
        start={"displacement": -mean * D0},
    )


def mean_force(mean, amplitude):
    phase = np.linspace(0.0, 2.0 * pi, 20_001)
    return np.trapezoid(np.maximum(mean + amplitude * np.sin(phase), 0.0) ** 1.5, phase) / (2.0 * pi)


@pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")  # no real wheel is so heavy
@pytest.mark.parametrize(
    ("amplitude", "largest"), [(0.2, 1.306), (0.5, 1.778), (0.76, 2.178), (1.0, 2.497), (2.0, 3.367), (5.0, 4.854)]
)
def test_on_fast_corrugation_the_wheel_stays_where_the_mean_force_carries_it(amplitude, largest):
    mean = brentq(lambda mean: mean_force(mean, amplitude) - 1.0, -amplitude, 1.5)
    record = wt.simulate(fast_corrugation(amplitude, mean))
    np.testing.assert_allclose(record.peaks.normal_force / N0, largest, rtol=0.01)
    assert (len(record.events.time) > 0) == (amplitude > 0.88534)


@pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
@pytest.mark.parametrize(("share", "lost"), [(0.98, False), (1.02, True)])
def test_on_fast_corrugation_contact_is_just_lost_where_the_amplitude_is_the_mean_indentation(share, lost):
    limit = (3 * pi / (8 * sqrt(2))) ** (2 / 3)
    record = wt.simulate(fast_corrugation(share * limit, limit))
    assert (record.events.kind == "loss").sum().item() >= (WAVES - 1 if lost else 0)
    assert (len(record.events.time) > 0) == lost
    assert record.peaks.normal_force.values.max() / N0 == pytest.approx(3 * pi / 4, rel=0.03)


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


@pytest.mark.parametrize("length", [0.02, 0.06])
@pytest.mark.parametrize(("share", "comes_down"), [(0.98, True), (1.02, False)])
def test_above_the_critical_speed_a_wheel_in_the_air_outruns_the_arc_about_a_flats_end(length, share, comes_down):
    # The pivot arc falls with V²/R, a wheel in the air with N0/m: V_c = sqrt(R·N0/m) = 5.70 m/s, whatever the length.
    speed = share * sqrt(0.46 * N0 / MASS)
    half = 0.5 * length
    flat = wt.WheelFlat(depth=0.46 - sqrt(0.46**2 - half**2), position=half)  # its first end is at the start
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=LOAD, radius=0.46),
        contact=wt.Hertz(constant=CONSTANT),
        irregularity=flat,
        speed=speed,
        duration=1.5 * half / speed,
        start={"displacement": 1e-7},
    )
    landing = wt.simulate(scene, "strict").events.time.values[0]
    assert (landing < 0.99 * half / speed) == comes_down
