"""Every question of the diagnosis, of every contact and damper: the answer is that of `simulate`, or it is refused."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.motion import motion_at
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.site.neighbours import deck_motion, motion_under_one_wheelset
from wheeltapper.diagnosis.train import healthy_ratio

C = 1.405e11
MODELS = {
    "Hertz": {},
    "hysteresis": {"contact": wt.Hertz(constant=C, hysteresis=0.2)},
    "curvature": {"contact": wt.Hertz(constant=C, curvature=True)},
    "Linear": {"contact": wt.Linear(stiffness=1.2e9)},
    "bilateral": {"contact": wt.Linear(stiffness=1.2e9, bilateral=True)},
    "Thornton": {"contact": wt.contact.Thornton(constant=C)},
    "Stronge": {"contact": wt.contact.Stronge(constant=C)},
    "JacksonGreen": {"contact": wt.contact.JacksonGreen(constant=C, yield_strength=8e8)},
    "KogutEtsion": {"contact": wt.contact.KogutEtsion(constant=C)},
    "play": {"vehicle.damper_play": 5e-5},
    "bush": {"vehicle.bush_stiffness": 1e7},
}
PLASTIC = ("Thornton", "Stronge", "JacksonGreen", "KogutEtsion")
ENDED = ("play", "bush")
UNDERIVABLE = {
    **dict.fromkeys(PLASTIC, ("contact", "an elastic-plastic contact, which `")),
    **dict.fromkeys(ENDED, ("vehicle", "a damper with play or a bush, which `")),
}
UNCOUPLED = {
    **dict.fromkeys(PLASTIC, ("contact", "an elastic-plastic contact, which `coupled=True` does not take")),
    **dict.fromkeys(("Linear", "bilateral"), ("contact", "a linear contact, which `coupled=True` does not take")),
    "hysteresis": ("contact", "a contact with hysteresis"), "play": ("vehicle.damper_play", "play of the damper"),
}  # fmt: skip
SENSOR = Sensor(rate=20e3, noise=6.66e-4)


def passage(name, **changes):
    healthy = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=C),
        track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
        irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
        speed=9.0,
        duration=0.1,
    )
    return healthy.replaced(MODELS[name] | changes)


def site(name, **changes):
    return Site(passage=passage(name, **changes), sensor=SENSOR, uncertainty={"speed": 0.01, "vehicle.load": 0.05})


def answered(name, refused, call):
    """Return what a call gives, or None where it is refused in one line that names what is not known there."""
    if name not in refused:
        return call()
    field, found = refused[name]
    with pytest.raises(wt.InputError) as caught:
        call()
    assert caught.value.field == field
    assert found in caught.value.found
    assert caught.value.allowed
    assert "\n" not in str(caught.value)
    return None


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("method", ["default", "strict"])
def test_motions_at_given_times_are_those_of_the_record(name, method):
    one = passage(name)
    record, times = wt.simulate(one, method), np.sort(np.random.default_rng(1).uniform(0.0, 0.1, 5000))
    found, history = motion_at(one, times, method), record.at(times)
    np.testing.assert_allclose(found.force, history.normal_force, rtol=0, atol=1e-12 * record.static_force)
    largest = np.abs(history.deck_acceleration).max()
    np.testing.assert_allclose(found.deck_acceleration, history.deck_acceleration, rtol=0, atol=1e-12 * largest)
    assert record.impacts.sizes["impact"] >= 2 or name == "bilateral"


def test_motions_of_a_spot_that_remembers_are_those_of_the_record():
    drop = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.contact.Thornton(constant=C), start={"displacement": 2e-3, "velocity": 0.0}, speed=0.0, duration=0.1,
    )  # fmt: skip
    times = np.linspace(0.0, 0.1, 3000)
    record = wt.simulate(drop)
    assert len(record.events.time[record.events.kind == "yield"]) >= 1
    np.testing.assert_allclose(
        motion_at(drop, times).force, record.at(times).normal_force, rtol=0, atol=1e-12 * record.static_force
    )


@pytest.mark.parametrize("name", MODELS)
def test_motions_with_derivatives_are_those_of_the_record_or_refused(name):
    one, times = passage(name), np.arange(0.0, 0.1, 2e-4)
    found = answered(name, UNDERIVABLE, lambda: trajectory(one, ("vehicle.mass",), times))
    if found is not None:
        record = wt.simulate(one)
        np.testing.assert_allclose(found.force, record.at(times).normal_force, rtol=0, atol=1e-9 * record.static_force)


@pytest.mark.parametrize("name", MODELS)
def test_information_is_of_the_passage_that_is_simulated_or_refused(name):
    told = answered(name, UNDERIVABLE, lambda: wt.diagnosis.information(site(name)))
    if told is not None:
        record = wt.simulate(passage(name))
        times = np.arange(2001) / 20e3
        assert told.largest_force[0] == pytest.approx(float(record.peaks.normal_force.max()), rel=1e-9)
        assert told.signal[0] == pytest.approx(
            np.sqrt((record.at(times).deck_acceleration.values ** 2).mean()), rel=1e-9
        )
        assert told.deviation("vehicle.mass")[0] > 0.0


@pytest.mark.parametrize("name", UNDERIVABLE)
def test_sites_without_derivatives_are_not_designed(name):
    answered(name, UNDERIVABLE, lambda: wt.design_site(site(name), budget=20))


@pytest.mark.parametrize("name", MODELS)
def test_computed_recordings_are_what_is_simulated(name):
    (recording,) = wt.synthesise(site(name), vary=False, noise=0.0)
    (again,) = wt.diagnosis.synthesise_train(site(name), [None], vary=False, noise=0.0)
    record = wt.simulate(passage(name))
    np.testing.assert_array_equal(recording.samples, record.at(recording.times).deck_acceleration)
    np.testing.assert_array_equal(again.samples, recording.samples)


@pytest.mark.parametrize("name", MODELS)
def test_a_neighbour_is_felt_as_it_is_or_refused(name):
    """One that is not on the deck changes nothing, though both march as one wagon."""
    own = passage(
        name, duration=0.05, track=wt.FloatingDeck(mass=15e3, stiffness=1.5e7, damping=5e4, start=-0.05, length=2)
    )
    times = np.arange(0.0, 0.05, 1e-4)
    both = answered(name, UNCOUPLED, lambda: deck_motion(own, [(-2.56, own)]).at(times))
    by_itself = motion_under_one_wheelset(own).at(times)
    if both is None:
        both = deck_motion(own, [(-2.56, own)], coupled=False).at(times)
    np.testing.assert_allclose(both, by_itself, rtol=0, atol=1e-4 * np.abs(by_itself).max())


@pytest.mark.parametrize("name", MODELS)
def test_the_healthy_ratio_is_that_of_the_record(name):
    record = wt.simulate(passage(name))
    assert healthy_ratio(site(name)) == pytest.approx(
        float(record.peaks.normal_force.max()) / record.static_force, rel=1e-12
    )


@pytest.mark.parametrize("name", MODELS)
def test_the_reconstructed_force_is_that_of_the_record(name):
    (recording,) = wt.synthesise(site(name), vary=False, noise=0.0)
    force = wt.diagnosis.reconstructed(recording, site(name), "bearing")
    record = wt.simulate(passage(name))
    largest = float(record.peaks.normal_force.max())
    np.testing.assert_allclose(force.force, record.at(recording.times).normal_force, rtol=0, atol=0.03 * largest)


@pytest.mark.parametrize("name", MODELS)
def test_a_healthy_wheelset_is_healthy_whatever_its_site(name):
    where = site(name)
    (recording,) = wt.synthesise(where, seed=1)
    finding = wt.diagnose(recording, where)
    assert finding.verdict == "healthy"
    assert finding.reduced < 1.1
    record = wt.simulate(recording.truth["scenario"])
    assert finding.largest_force == pytest.approx(float(record.peaks.normal_force.max()), rel=0.05)
    assert (finding.combinations is None) == (name in UNDERIVABLE)
    left_out = [note for note in finding.notes if note.startswith("not compared: ")]
    assert any("free play, soft bush" in note for note in left_out) == (name in (*PLASTIC, "bilateral"))
    assert any("load deviation" in note for note in left_out) == (name == "bilateral")  # linear: no load is felt


@pytest.mark.parametrize("name", MODELS)
def test_the_mass_is_found_within_its_error_whatever_the_site(name):
    where = site(name)
    (recording,) = wt.synthesise(where, changes={"vehicle.mass": 1550.0}, seed=2)
    estimate = wt.diagnosis.identify(recording, where)
    assert estimate.reduced < 1.1
    assert abs(estimate["vehicle.mass"] / 1550.0 - 1.0) < 4.0 * estimate.deviation("vehicle.mass")
    assert estimate.deviation("vehicle.mass") < 0.02


@pytest.mark.slow
def test_faults_of_a_yielding_site_are_told():
    told = wt.diagnosis.assess(site("Thornton"), {"broken spring": None}, count=2, workers=1)
    assert told.faults["broken spring"].named == 1.0
    assert told.false_calls.per_thousand == 0.0


def test_the_usual_faults_are_those_that_a_site_can_have(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "wheeltapper.diagnosis.performance.in_processes",
        lambda _, site, tasks, workers: asked.extend(tasks) or (done for done in ()),
    )
    with pytest.raises(KeyError):  # nothing was computed
        wt.diagnosis.assess(site("Thornton"), count=2)
    assert {task[0] for task in asked} == {
        "broken spring", "lost damper", "weak damper", "mass deviation", "wheel flat", "healthy",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["free play", "soft bush"])
def test_a_fault_that_a_site_cannot_have_is_refused_when_it_is_asked_for(name):
    where = site("Thornton")
    (recording,) = wt.synthesise(where, seed=1)
    for call in (
        lambda: wt.diagnose(recording, where, faults=[name]),
        lambda: wt.synthesise(where, fault=name),
        lambda: wt.diagnosis.assess(where, [name], count=2, workers=1),
    ):
        with pytest.raises(wt.InputError, match="elastic-plastic contact together with a damper with play or a bush"):
            call()


def test_a_wagon_is_refused():
    wagon = wt.load("examples/coach_step.toml")
    for call in (lambda: motion_at(wagon, np.zeros(1)), lambda: trajectory(wagon, ("speed",), np.zeros(1))):
        with pytest.raises(
            wt.InputError,
            match=r"vehicle: found a Wagon, which `[a-z_]+` does not take; allowed: a Wheelset; `simulate`",
        ):
            call()
    with pytest.raises(Exception, match=r"passage.vehicle: found a Wagon, which `diagnose` does not take"):
        Site(passage=wagon)
