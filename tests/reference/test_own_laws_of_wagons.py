"""Laws of one's own, and contacts that pull, below wagons: against other marches, and the laws that they repeat."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.properties.test_wagon_on_rails import NARROW
from tests.reference.test_laws_of_wagons import LEVEL, lone, of_side
from tests.reference.test_wagon_on_rails import NUMBERS, TRACK, half_coach
from wheeltapper.ask.reduced import compare_responses

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
C = 1.6e11


def stiffening(delta):
    return C * delta**1.5 * (1.0 + 300.0 * delta)


def damped(delta, rate):
    return C * delta**1.5 * (1.0 + 300.0 * delta) * (1.0 + 0.8 * rate + 0.02 * np.sin(3.0 * rate))


def nearly_straight(delta):
    return 1.9e9 * delta * (1.0 + 1e3 * delta)


LAWS = {
    "stiffening": wt.contact.Law(stiffening),
    "damped": wt.contact.Law(damped),
    "nearly straight": wt.contact.Law(nearly_straight, exponent=1.0),
    "pulls": wt.Linear(stiffness=1.9e9, bilateral=True),
}


def drawn_ride(rng):
    bump, height = rng.uniform() < 0.5, float(rng.choice([-1, 1]) * rng.uniform(5e-5, 3e-4))
    length = float(rng.uniform(0.03, 0.15))
    return {
        "irregularity": (
            wt.CosineBump(height=height, length=length, start=0.01) if bump
            else wt.Corrugation(amplitude=height / 5, wavelength=length, start=0.01)
        ),
        "rolling": "point", "speed": float(rng.uniform(4, 25)), "duration": 0.04,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.few(3)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("method", "allowed", "force"), [("default", 3e-8, 1e-6), ("strict", 2e-11, 1e-9)])
def test_a_wagon_that_only_bounces_is_a_wheelset(law, method, allowed, force):
    rng, seen = np.random.default_rng(12), 0
    for _ in range(6):
        scene = {"contact": LAWS[law], **drawn_ride(rng)}
        wagon = wt.simulate(wt.Scenario(vehicle=lone(), profiles=LEVEL, **scene), method)
        wheelset = wt.simulate(wt.Scenario(vehicle=wt.Wheelset(mass=1e4, load=0.0), **scene), method)
        times = np.linspace(0.0, 0.04, 333)
        expected, scale = wheelset.at(times).normal_force.values, wheelset.peaks.normal_force.values.max()
        for side in ("left", "right"):
            events = of_side(wagon.events, side)
            assert list(events.kind.values) == list(wheelset.events.kind.values)
            np.testing.assert_allclose(events.time, wheelset.events.time, rtol=0, atol=allowed)
            own = 2.0 * wagon.at(times).normal_force.sel(side=side).values[:, 0]
            np.testing.assert_allclose(own, expected, rtol=0, atol=force * scale)
            tops = of_side(wagon.peaks, side).normal_force.values.max()
            assert 2.0 * tops == pytest.approx(scale, rel=force)
        seen += len(wheelset.events.time)
        assert float(wagon.energy.relative_imbalance) < (1e-6 if method == "default" else 1e-8)
    assert seen >= 16 or (law == "pulls" and seen == 0)


# Hunt and Crossley's rate along the normal takes the inclination from the slope of the tables and the roll instead.
@pytest.mark.slow
@pytest.mark.parametrize(("chi", "events", "forces"), [(0.0, 1e-12, 1e-9), (2.0, 2e-5, 3e-3)])
def test_a_law_that_is_hertzs_is_hertzs_on_treads_and_flanges(chi, events, forces):
    force = (lambda d, rate: C * d**1.5 * (1.0 + chi * rate)) if chi else (lambda d: C * d**1.5)
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(),
        contact=wt.Hertz(constant_per_wheel=0.5 * C, hysteresis=chi or None, curvature=False),
        creep=wt.creep.Polach(friction=0.35), profiles=NARROW, speed=5.0, duration=0.03,
        irregularity={"left": wt.Step(height=1e-4, position=0.02)},
    )  # fmt: skip
    known = wt.simulate(scene, "strict")
    own = wt.simulate(scene.replaced({"contact": wt.contact.Law(force)}), "strict")
    assert len(own.events.time) == len(known.events.time) >= 2
    np.testing.assert_allclose(own.events.time, known.events.time, rtol=0, atol=events)
    times = np.linspace(0.0, 0.03, 301)
    one, other = own.at(times), known.at(times)
    assert float(other.flange_force.max()) > 0.05 * known.static_force
    for name in ("normal_force", "flange_force", "lateral_force", "longitudinal_force"):
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=forces * known.static_force)
    assert float(own.energy.relative_imbalance) < 1e-8
    for name in ("kinetic", "elastic", "dissipated_creep", "work_of_shape"):
        near = forces * float(known.energy.exchanged)
        assert float(own.energy[name]) == pytest.approx(float(known.energy[name]), rel=0, abs=near)


ON_RAILS = {
    "stiffening": {"default": (3e-9, 1e-5), "strict": (2e-11, 1e-6)},
    "damped": {"default": (3e-8, 1e-3), "strict": (1e-8, 3e-4)},
    "pulls": {"default": (0.0, 1e-5), "strict": (0.0, 1e-6)},
}


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize(("law", "seed"), [("stiffening", 7), ("stiffening", 11), ("damped", 7), ("pulls", 11)])
@pytest.mark.parametrize("method", ["default", "strict"])
def test_half_a_coach_is_a_bogie_on_rails(law, method, seed):
    rng = np.random.default_rng(seed)
    height, length = float(rng.uniform(3e-4, 6e-4)), float(rng.uniform(0.06, 0.12))
    common = {
        "contact": LAWS[law], "speed": float(rng.uniform(12, 30)), "duration": 0.03, "rolling": "point", "track": TRACK,
        "irregularity": wt.CosineBump(height=height, length=length, start=0.05),
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=LEVEL, **common), method)
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), method)
    assert coach.outcome.name == bogie.outcome.name == "COMPLETED"
    events, forces = ON_RAILS[law][method]
    times = np.linspace(0.0, 0.03, 601)
    force = bogie.at(times).normal_force.values
    for side in ("left", "right"):
        own = coach.events.time[coach.events.side == side]
        assert len(own) == len(bogie.events.time)
        assert len(own) >= 2 or law == "pulls"
        np.testing.assert_allclose(own, bogie.events.time, rtol=0, atol=events)
        away = np.abs(2.0 * coach.at(times).normal_force.sel(side=side) - force) / load
        assert np.quantile(away, 0.99) < forces
    assert float(coach.energy.relative_imbalance) < (1e-6 if method == "default" else 1e-8)
    assert len(coach.peaks.time) < 3 * len(bogie.peaks.time)  # none where macro steps meet


def test_a_contact_that_pulls_is_never_lost_and_has_no_border():
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=LAWS["pulls"], creep=wt.creep.Polach(friction=0.35), profiles=NARROW,
        irregularity=wt.Step(height=3e-4, position=0.02), speed=5.0, duration=0.02,
    )  # fmt: skip
    record = wt.simulate(scene)
    force = record.at(np.linspace(0.0, 0.02, 801))
    assert set(record.events.surface.values) == {"flange"}
    assert float(force.normal_force.min()) < -0.1 * record.static_force
    pulling = force.normal_force.values < 0.0
    assert (force.lateral_creep_force.values[pulling] == 0.0).all()  # no patch, no creep
    assert float(force.flange_force.min()) >= 0.0
    with pytest.raises(wt.InputError, match="a contact that also pulls"):
        wt.border(scene, {"speed": (2.0, 6.0), "irregularity.0.height": (1e-5, 3e-4)})


def test_the_table_of_a_law_is_told_of_as_below_a_wheelset():
    law = wt.contact.Law(damped, largest=1e-4)
    ride = {"contact": law, "irregularity": wt.Step(height=3e-4, position=0.02), "speed": 5.0, "duration": 0.02}
    wagon = wt.simulate(wt.Scenario(vehicle=lone(), profiles=LEVEL, **ride))
    wheelset = wt.simulate(wt.Scenario(vehicle=wt.Wheelset(mass=1e4, load=0.0), **ride))

    one, other = ([note for note in record.notes if note.cause == "own law"] for record in (wagon, wheelset))
    assert str(one[0]) == str(other[0])
    assert ["the indentation reached" in str(note) for note in one] == [False, True]
    assert [note.severity for note in one] == pytest.approx([note.severity for note in other], rel=2e-3)


def test_the_reduced_model_keeps_the_law():
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=LAWS["damped"], profiles=LEVEL, rolling="point", speed=20.0,
        duration=0.01, irregularity=wt.CosineBump(height=1e-4, length=0.05, start=0.02),
    )  # fmt: skip
    wagon, wheelset = wt.simulate(scene), wt.simulate(wt.reduced(scene))
    assert wheelset.scenario.contact is scene.contact
    assert wheelset.static_force == pytest.approx(2.0 * float(wagon.static_forces[0, 0]), rel=1e-9)
    found = compare_responses(wagon, wheelset)
    np.testing.assert_allclose(found.peak_ratio, 1.0, atol=0.02)


def test_small_vibrations_on_a_law_that_is_hertzs_are_hertzs():
    hertz = wt.Hertz(constant_per_wheel=0.5 * C, curvature=False)
    scene = wt.Scenario(vehicle=wt.Wagon.erri_b176(), contact=hertz, speed=20.0, duration=0.1)
    own = wt.modes(scene.replaced({"contact": wt.contact.Law(lambda delta: C * delta**1.5)}))
    known = wt.modes(scene)
    np.testing.assert_allclose(own.frequency, known.frequency, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(own.damping_ratio, known.damping_ratio, rtol=1e-5, atol=1e-6)
