"""Wrong questions about orbits are refused in one line."""

import numpy as np
import pytest

import wheeltapper as wt

WHEELSET = {"mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 2e4}
WAVES = wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.1)
SCENE = wt.Scenario(
    vehicle=wt.Wheelset(**WHEELSET), contact=wt.Hertz(constant=1.405e11), irregularity=WAVES, rolling="point",
    speed=5.0, duration=1.0,
)  # fmt: skip
BUMP = wt.CosineBump(height=1e-4, length=0.05, start=0.1)
LONGER = wt.Corrugation(amplitude=1e-5, wavelength=0.05 * np.sqrt(2.0), start=0.1)
SCENES = {
    "nothing rolled over": ({"irregularity": ()}, "irregularity", "none"),
    "a bump": ({"irregularity": BUMP}, "irregularity.0", "an irregularity that does not repeat without end"),
    "an end": ({"irregularity.0.end": 2.0}, "irregularity.0", "an irregularity that does not repeat without end"),
    "ten bumps": (
        {"irregularity": wt.Repeated(of=BUMP, period=0.1, count=10)}, "irregularity.0",
        "an irregularity that does not repeat without end",
    ),
    "incommensurate": ({"irregularity": [WAVES, LONGER]}, "irregularity", "which have no common multiple"),
    "yielding": ({"contact": wt.contact.Thornton(constant=1.405e11)}, "contact", "an elastic-plastic contact"),
    "a damper's end": ({"vehicle.bush_stiffness": 1e8}, "vehicle", "a damper with play or a bush"),
    "play": ({"vehicle.damper_play": 1e-5}, "vehicle", "a damper with play or a bush"),
    "a deck that begins": (
        {"track": wt.FloatingDeck(mass=15e3, stiffness=1e8, start=1.0)}, "track.start", "a deck that begins or ends",
    ),
}  # fmt: skip


def refusal(ask):
    with pytest.raises(wt.InputError) as caught:
        ask()
    assert "\n" not in str(caught.value)
    assert caught.value.allowed
    return caught.value


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("ask", [
    lambda scene: wt.orbits.find(scene),
    lambda scene: wt.orbits.returns(scene, {"vehicle.mass": [1500.0]}),
    lambda scene: wt.orbits.fates(scene, {"vehicle.mass": [1500.0]}),
    lambda scene: wt.orbits.ramp(scene, {"vehicle.mass": [1500.0, 1501.0]}, 0.5),
], ids=["find", "returns", "fates", "ramp"])  # fmt: skip
def test_a_scenario_without_orbits_is_refused(name, ask):
    changes, field, found = SCENES[name]
    error = refusal(lambda: ask(SCENE.replaced(changes)))
    assert error.field == field
    assert found in error.found


def test_a_wagon_has_no_orbits():
    scene = wt.Scenario(vehicle=wt.Wagon.erri_b176(), irregularity=WAVES, speed=5.0, duration=0.1)
    error = refusal(lambda: wt.orbits.find(scene))
    assert error.field == "vehicle"
    assert error.found == "a Wagon, which `orbits` does not take"


@pytest.mark.parametrize("waves", [0, -1, 1.5, "two", True, None])
def test_waves_are_counted(waves):
    assert refusal(lambda: wt.orbits.find(SCENE, waves)).field == "waves"


@pytest.mark.parametrize(
    "start", [5.0, "rest", {"height": 1e-4}, {"displacement": "far"}, {"displacement": float("nan")},
    {"deck_displacement": 1e-5}],
)  # fmt: skip
def test_a_start_is_a_state(start):
    assert refusal(lambda: wt.orbits.find(SCENE, start=start)).field.startswith(("start", "displacement"))


@pytest.mark.slow
def test_a_start_far_from_every_orbit_says_how_near_newton_came():
    error = refusal(lambda: wt.orbits.find(SCENE, 5, {"displacement": 0.05, "velocity": 2.0}))
    assert error.field == "start"
    assert "closure of" in error.found
    assert "returns" in error.allowed


@pytest.mark.parametrize(
    ("over", "field"),
    [({}, "over"), ({"speed": (5.0,)}, "speed"), ({"speed": (5.0, 5.0)}, "speed"), ({"speed": (6.0, 4.0)}, "speed"),
     ({"speed": (6.0, 7.0)}, "speed"), ({"speed": (0.0, 7.0)}, "speed"), ({"speed": (4.0, 5.0, 6.0)}, "speed"),
     ({"speed": (4.0, 6.0), "vehicle.mass": (1400.0, 1600.0)}, "over"), ({"sped": (4.0, 6.0)}, "sped"),
     ({"irregularity.0.start": (0.0, 0.2)}, "irregularity.0.start"), ({"duration": (0.5, 2.0)}, "duration"),
     ({"start.velocity": (0.0, 1.0)}, "start.velocity"), ({"rolling": ("point", "circle")}, "rolling"), (5.0, "over")],
)  # fmt: skip
def test_a_branch_needs_a_range_around_the_orbit(over, field):
    orbit = wt.orbits.find(SCENE)
    assert refusal(lambda: wt.orbits.follow(orbit, over)).field == field


def test_only_an_orbit_is_followed():
    assert refusal(lambda: wt.orbits.follow(SCENE, {"speed": (4.0, 6.0)})).field == "orbit"


@pytest.mark.parametrize(
    ("given", "field"),
    [({"skip": -1}, "skip"), ({"keep": 0}, "keep"), ({"carry": "sideways"}, "carry"), ({"over": {}}, "over"),
     ({"over": {"speed": [0.0, 5.0]}}, "speed"), ({"threads": 0}, "threads"), ({"method": "best"}, "method"),
     ({"over": {"speed": []}}, "speed"), ({"over": {"irregularity.0.start": [0.1]}}, "irregularity.0.start")],
)  # fmt: skip
def test_returns_need_whole_numbers_and_fields(given, field):
    given = {"over": {"speed": [5.0, 6.0]}} | given
    assert refusal(lambda: wt.orbits.returns(SCENE, **given)).field == field


@pytest.mark.parametrize(("settle", "field"), [(0, "settle"), (2.5, "settle")])
def test_fates_need_a_number_of_waves(settle, field):
    assert refusal(lambda: wt.orbits.fates(SCENE, {"speed": [5.0]}, settle)).field == field


@pytest.mark.parametrize(
    ("over", "per_wave", "field"),
    [({"speed": (6.0, 6.0)}, 1e-3, "over"), ({"speed": (6.0, 6.5)}, 0.0, "per_wave"),
     ({"speed": (6.0, 6.5)}, -1e-3, "per_wave"), ({"speed": (6.0, 6.5)}, "slow", "per_wave"),
     ({"speed": (0.0, 6.5)}, 1e-3, "speed"), ({"start.velocity": (0.0, 1.0)}, 0.1, "over")],
)  # fmt: skip
def test_a_ramp_needs_two_values_and_a_change(over, per_wave, field):
    assert refusal(lambda: wt.orbits.ramp(SCENE, over, per_wave)).field == field


def test_without_damping_there_are_orbits_but_no_fates():
    scene = SCENE.replaced({"vehicle.damping": 0.0})
    orbit = wt.orbits.find(scene)
    assert orbit.undamped
    assert not orbit.stable
    assert abs(orbit.determinant_error) < 1e-8
    assert abs(orbit.multipliers[0] * orbit.multipliers[1]) == pytest.approx(1.0, abs=1e-8)
    assert refusal(lambda: wt.orbits.fates(scene, {"speed": [5.0]})).field == "vehicle.damping"


def test_only_a_special_point_is_traced_over_another_field():
    orbit = wt.orbits.find(SCENE)
    branch = wt.orbits.follow(orbit, {"speed": (4.9, 7.0)})
    amplitude = {"irregularity.0.amplitude": [4.9e-5]}
    assert refusal(lambda: wt.orbits.trace(orbit, branch, amplitude)).field == "special"
    assert refusal(lambda: wt.orbits.trace(orbit, branch.isel(special=0), {"speed": [6.0]})).field == "over"
    assert refusal(lambda: wt.orbits.trace(SCENE, branch.isel(special=0), amplitude)).field == "orbit"


@pytest.mark.parametrize("waves", [0, 10, 2.5])
def test_the_growth_exponent_needs_enough_waves(waves):
    assert refusal(lambda: wt.features.growth_exponent(waves)).field == "waves"
