"""Both methods list the same force maxima: none that rounding makes, and none is missed."""

import warnings

import numpy as np
import pytest

import wheeltapper as wt


def irregularity(rng):
    """Something on the way, or nothing; with level stretches before and after."""
    start, sign = rng.uniform(0, 0.2), rng.choice([-1, 1])
    return [
        None,
        wt.CosineBump(height=sign * 10 ** rng.uniform(-6, -3.3), length=10 ** rng.uniform(-1.7, 0), start=start),
        wt.CosineBump(height=sign * 2e-4, length=0.05, start=start),
        wt.Corrugation(amplitude=10 ** rng.uniform(-6, -4), wavelength=10 ** rng.uniform(-1.7, 0), start=start),
        wt.Step(height=sign * 10 ** rng.uniform(-5, -3.5), position=start + 0.02, ideal=bool(rng.integers(2))),
        wt.WheelFlat(depth=10 ** rng.uniform(-5, -3.5), position=start + 0.06),
        wt.OutOfRound(orders=(1, 7), amplitudes=(10 ** rng.uniform(-5, -3.5), 10 ** rng.uniform(-6, -4.5))),
    ][int(rng.integers(7))]


def drawn(rng):
    contacts = [
        lambda: wt.Hertz(constant=10 ** rng.uniform(10.5, 11.6)),
        lambda: wt.Hertz(constant=1e11, restitution=rng.uniform(0.05, 0.9), impact_speed=10 ** rng.uniform(-2, -0.3)),
        lambda: wt.Linear(stiffness=10 ** rng.uniform(8.7, 9.6), bilateral=bool(rng.integers(2))),
        lambda: wt.Hertz(rail_radius=0.3),
    ]
    deck = {"mass": 10 ** rng.uniform(2.5, 4.3), "stiffness": 10 ** rng.uniform(6, 9)}
    tracks = [
        wt.StiffTrack(),
        wt.StiffTrack(),
        wt.FloatingDeck(**deck, damping=rng.choice([0, 2e4])),
        wt.FloatingDeck(**deck, damping=1e4, start=rng.uniform(0.01, 0.2), length=rng.uniform(0.1, 0.6)),
    ]
    start = {"displacement": rng.uniform(-2e-4, 1e-4), "velocity": rng.uniform(-0.1, 0.1)}
    speed = 10 ** rng.uniform(-0.3, 1.6)
    return wt.Scenario(
        vehicle=wt.Wheelset(
            mass=rng.uniform(300, 2500), load=rng.uniform(2e4, 1.5e5), stiffness=rng.choice([0, 3e6]),
            damping=rng.choice([0, 10 ** rng.uniform(3.5, 6)]),
        ),
        track=tracks[int(rng.integers(4))], contact=contacts[int(rng.choice(4, p=[0.4, 0.3, 0.2, 0.1]))](),
        irregularity=irregularity(rng), rolling=str(rng.choice(["point", "circle"])), speed=speed,
        duration=min(10 ** rng.uniform(-2, 0), 20 / speed),
        start=start if rng.uniform() < 0.25 else "equilibrium",
    )  # fmt: skip


def known_until(a, b):
    """Return up to when two records have the same events."""
    times, others = a.events.time.values, b.events.time.values
    shorter = min(len(times), len(others))
    same = np.abs(times[:shorter] - others[:shorter]) < 1e-6 * np.maximum(1e-3, others[:shorter])
    many = shorter if same.all() else int(np.argmin(same))
    if many == len(times) == len(others):
        return min(a.end, b.end)
    return others[many - 1] if many else 0.0


def check(scene):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            default, strict = wt.simulate(scene), wt.simulate(scene, "strict")
        except wt.InputError:  # a hollow more curved than the wheel
            return
    until = known_until(default, strict) - 1e-6
    one, other = (r.peaks.normal_force.values[r.peaks.time.values < until] for r in (default, strict))
    assert len(one) == len(other), scene
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-4 * default.static_force)


@pytest.mark.slow
def test_both_methods_list_the_same_force_maxima():
    rng = np.random.default_rng(11)
    for _ in range(60):
        check(drawn(rng))


@pytest.mark.whole
@pytest.mark.slow
def test_both_methods_list_the_same_force_maxima_in_a_thousand_cases():
    rng = np.random.default_rng(12)
    for _ in range(1000):
        check(drawn(rng))


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("restitution", [None, 0.05, 0.5])
@pytest.mark.parametrize("track", [wt.StiffTrack(), wt.FloatingDeck(mass=2000, stiffness=1e8)])
def test_a_wheel_at_rest_has_no_force_maximum(method, restitution, track):
    damping = {} if restitution is None else {"restitution": restitution, "impact_speed": 0.01}
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6), track=track,
        contact=wt.Hertz(constant=1.405e11, **damping), irregularity=wt.CosineBump(height=2e-4, length=0.05, start=9.0),
        rolling="point", speed=9.0, duration=0.5,
    )  # fmt: skip
    record = wt.simulate(scene, method)
    assert record.peaks.sizes["peak"] == 0


def test_a_force_that_jumps_up_from_nothing_has_its_maximum_there():
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, damping=1e5), contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.Step(height=2e-3, position=0.01, ideal=True), rolling="point", speed=5.0, duration=0.01,
        start={"displacement": 1e-3, "velocity": 0.6},
    )  # fmt: skip
    record = wt.simulate(scene)
    first = record.peaks.isel(peak=0)
    assert record.events.kind.values[0] == "impact"
    assert first.corner.item()
    assert first.time.item() == record.events.time.values[0] == pytest.approx(0.002)
    history = record.at([0.002, 0.0021])
    assert first.normal_force.item() == pytest.approx(history.normal_force.values[0], rel=1e-12)
    assert history.normal_force.values[1] < history.normal_force.values[0]
