"""Dampers with play or a bush in the general march: against the march with a damper's end, limits, and itself."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.scenario import Start
from wheeltapper.lower.plane import lower_plane
from wheeltapper.march.general.contract import STRICT
from wheeltapper.march.general.march import march

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
WHEEL = {"mass": 1420.0, "load": 89e3, "damping": 5.3e4}
HERTZ = wt.Hertz(constant=1.37e11)
DECK = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
BASE = wt.Scenario(
    vehicle=wt.Wheelset(**WHEEL), contact=HERTZ, irregularity=wt.CosineBump(height=2.2e-4, length=0.05, start=0.009),
    rolling="point", speed=8.7, duration=0.05,
)  # fmt: skip
TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(update={"cutoff": 2000.0, "bays": 40})
CASES = {
    "bush": {"bush_stiffness": 1e8},
    "stiff bush": {"bush_stiffness": 4e10},
    "play": {"damper_play": 1e-5},
    "more play, begun near a stop": {"damper_play": 6e-5, "damper_play_start": -0.95},
    "both": {"damper_play": 2e-5, "bush_stiffness": 9e7, "damper_play_start": 0.4},
}
OTHERS = {
    "on a deck": {"track": DECK},
    "with hysteresis": {"contact": wt.Hertz(constant=1.37e11, hysteresis=0.1), "duration": 0.03},
    "dropped": {"start": Start(displacement=1.2e-4, velocity=-0.01)},
    "linear": {"contact": wt.Linear(stiffness=1.9e9)},
}


def with_damper(case):
    return wt.Wheelset(**WHEEL, **CASES[case])


def several(*wheelsets, apart=2.5):
    return wt.vehicles.Wheelsets(wheelsets=wheelsets, positions=tuple(-apart * i for i in range(len(wheelsets))))


def check_as_alone(scene, method, most):
    """Compare the general march of one wheelset with the march that knows a damper's end."""
    expected = wt.simulate(scene, method)
    found = wt.simulate(scene.replaced({"vehicle": several(scene.vehicle)}), method)
    assert found.events.kind.values.tolist() == expected.events.kind.values.tolist()
    np.testing.assert_allclose(found.events.time.values, expected.events.time.values, rtol=0, atol=most)
    stops, others = found.damper_events, expected.damper_events
    for name in ("kind", "side"):
        assert stops[name].values.tolist() == others[name].values.tolist()
    np.testing.assert_allclose(stops.time.values, others.time.values, rtol=0, atol=most)
    times = np.linspace(0.0, scene.duration, 301)
    away = np.abs(times[:, None] - others.time.values).min(axis=1, initial=1.0) > 1e-8  # there the force jumps
    seen, known = found.at(times[away]), expected.at(times[away])
    assert set(seen.data_vars) == set(known.data_vars)
    for name, values in known.data_vars.items():
        size = float(np.abs(values).max())
        near = 3e5 * most if name == "damper_force" else 1e4 * most  # a derivative, read inside a macro step
        np.testing.assert_allclose(seen[name].values, values.values, rtol=0, atol=near * size, err_msg=name)
    return expected


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("method", "most"), [("default", 1e-9), ("strict", 3e-11)])
def test_one_wheelset_is_that_of_the_march_with_a_dampers_end(name, method, most):
    scene = BASE.replaced({"vehicle": with_damper(name)})
    if name == "stiff bush":
        scene = scene.replaced({"duration": 0.01})
    expected = check_as_alone(scene, method, most)
    assert (expected.damper_events.sizes["damper_event"] > 10) == ("damper_play" in CASES[name])


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("name", ["play", "both"])
def test_so_it_is_with_other_contacts_tracks_and_starts(name, other):
    expected = check_as_alone(BASE.replaced({"vehicle": with_damper(name)} | OTHERS[other]), "default", 1e-9)
    assert expected.damper_events.sizes["damper_event"] > 3


@pytest.mark.parametrize("name", ["bush", "play", "both"])
def test_two_wheelsets_that_do_the_same_on_a_deck_are_one_on_half_of_it(name):
    one = BASE.replaced({"vehicle": with_damper(name), "track": DECK})
    bump = one.irregularity[0]
    pair = one.replaced({
        "vehicle": several(one.vehicle, one.vehicle),
        "track": DECK.model_copy(update={"mass": 30_000, "stiffness": 3e7, "damping": 1e5}),
        "irregularity": {"wheelset 1": bump, "wheelset 2": bump.model_copy(update={"start": bump.start - 2.5})},
    })  # fmt: skip
    alone, found = wt.simulate(one, "strict"), wt.simulate(pair, "strict")
    for number in (1, 2):
        events = found.events.time.values[found.events.wheelset.values == number]
        np.testing.assert_allclose(events, alone.events.time.values, rtol=0, atol=3e-11)
        stops = found.damper_events.time.values[found.damper_events.wheelset.values == number]
        np.testing.assert_allclose(stops, alone.damper_events.time.values, rtol=0, atol=3e-11)


# -- on rails that give way --------------------------------------------------------------------------------------------

FLAT = BASE.replaced({
    "track": TRACK, "irregularity": wt.CosineBump(height=4e-4, length=0.06, start=0.05), "speed": 20.0,
    "duration": 0.02,
})  # fmt: skip


def test_a_stiff_bush_and_a_small_play_on_rails_are_next_to_a_plain_damper():
    """What differs is proportional to 1/k_b, and to the play."""
    times = np.linspace(0.0, FLAT.duration, 400)

    def force(**damper):
        scene = FLAT.replaced({"vehicle": wt.Wheelset(**WHEEL, **damper)})
        return wt.simulate(scene, "strict").at(times).normal_force.values

    plain = force()
    for weaker, sizes in (("bush_stiffness", (1e9, 1e10)), ("damper_play", (1e-6, 1e-7))):
        large, small = (np.abs(force(**{weaker: size}) - plain).max() for size in sizes)
        assert large > 1.0
        assert small == pytest.approx(0.1 * large, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["play", "both"])
def test_finer_steps_change_nothing_on_rails(name):
    scene = FLAT.replaced({"vehicle": several(with_damper(name), with_damper(name))})
    for method, most in (("default", 1e-8), ("strict", 1e-11)):  # a slow wheel turns at a time that is worse known
        task = lower_plane(scene, method).program
        found = march(task.system, task.method, task.duration)
        finest = march(task.system, STRICT._replace(step=2.5e-5), task.duration)
        assert len(finest.events) >= 6
        assert found.events[:, [1, 3]].tolist() == finest.events[:, [1, 3]].tolist()
        np.testing.assert_allclose(found.events[:, 0], finest.events[:, 0], rtol=0, atol=most)


@pytest.mark.parametrize("name", ["bush", "play", "both"])
@pytest.mark.slow
def test_energy_closes_and_files_keep_what_dampers_did(name, tmp_path):
    scene = FLAT.replaced({"vehicle": several(with_damper(name), wt.Wheelset(**WHEEL))})
    record = wt.simulate(scene, "strict")
    energy = record.energy
    assert abs(float(energy.relative_imbalance)) < 1e-8
    assert float(energy.dissipated) > 0.1
    stops = record.damper_events
    assert (stops.sizes["damper_event"] > 0) == (name != "bush")
    assert not (stops.wheelset.values == 2).any()
    record.save(tmp_path / "run.nc")
    again = wt.load(tmp_path / "run.nc")
    times = np.linspace(0.0, record.end, 30)
    assert again.at(times).equals(record.at(times))
    assert again.damper_events.equals(stops)
    motion = record.at(times)
    plain = motion.sel(wheelset=2)
    np.testing.assert_allclose(plain.damper_force.values, -WHEEL["damping"] * plain.wheel_velocity.values, rtol=1e-12)
    assert np.isnan(plain.damper_end_displacement).all()


def test_an_end_stays_between_its_stops_and_its_force_only_brakes():
    scene = FLAT.replaced({"vehicle": with_damper("play")})
    seen = wt.simulate(scene).at(np.linspace(0.0, FLAT.duration, 2000))
    apart = (seen.wheel_displacement - seen.damper_end_displacement).values
    gap = CASES["play"]["damper_play"]
    assert np.abs(apart).max() <= gap * (1.0 + 1e-9)
    assert (seen.damper_force.values * seen.wheel_velocity.values <= 1e-9).all()
    held = np.abs(seen.damper_force.values) > 1.0
    np.testing.assert_allclose(np.abs(apart[held]), gap, rtol=1e-9)
    expected = -WHEEL["damping"] * seen.wheel_velocity.values[held]
    np.testing.assert_allclose(seen.damper_force.values[held], expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_maps_take_dampers_on_rails():
    scene = FLAT.replaced({"vehicle": with_damper("play"), "contact": HERTZ})
    over = {"vehicle.damper_play": [0.0, 1e-5, 4e-5], "vehicle.damping": [2e4, 5e4]}
    asked = [wt.features.largest_force(), wt.features.time_in_air()]
    chart = wt.sweep(scene, over, asked, progress=False)
    for i, play in enumerate(over["vehicle.damper_play"]):
        for j, damping in enumerate(over["vehicle.damping"]):
            one = wt.simulate(scene.replaced({"vehicle.damper_play": play, "vehicle.damping": damping}))
            for each in asked:
                np.testing.assert_allclose(chart[each.name].values[i, j], each(one).values, rtol=1e-9)
