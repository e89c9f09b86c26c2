"""Maps and borders of contacts that yield, and of dampers with ends of their own."""

import numpy as np
import pytest

import wheeltapper as wt

from ..marks import slow

WHEEL = {"mass": 1390.0, "load": 8.4e4, "stiffness": 2.2e6, "damping": 4e4}
DIP = wt.Scenario(
    vehicle=wt.Wheelset(**WHEEL), contact=wt.Hertz(constant=1.6e11), speed=12.0, duration=0.015, rolling="point",
    irregularity=wt.CosineBump(height=-9e-5, length=0.07, start=0.01),
)  # fmt: skip
YIELDS = {"contact": wt.contact.Thornton(constant=1.6e11, yield_force=1.1e5)}
CASES = {
    "a yield": YIELDS,
    "a yield on a deck": YIELDS
    | {"track": wt.FloatingDeck(mass=9e3, stiffness=2e7, damping=4e4, start=0.03, length=1.0)},
    "play": {"vehicle.damper_play": 2e-5},
    "a bush, damped": {"vehicle.bush_stiffness": 3e7, "contact": wt.Hertz(constant=1.6e11, hysteresis=0.4)},
    "play, and friction": {
        "vehicle": wt.Wheelset(**WHEEL, damper_play=2e-5, friction=2e3, friction_stiffness=2e7),
    },
    "a spot": YIELDS | {"speed": 0.0, "irregularity": (), "start": {"displacement": 1e-4, "velocity": 0.0}},
}  # fmt: skip
HEIGHT = "irregularity.0.height"


@pytest.mark.parametrize("name", slow(CASES, "play, and friction"))
def test_each_cell_is_the_run_of_its_scenario(name):
    scene, loads = DIP.replaced(CASES[name]), [7e4, 8.4e4, 9e4]
    features = ["largest_force", "time_in_air", "first_loss", "impulse", "largest_displacement"]
    chart = wt.sweep(scene, {"vehicle.load": loads}, features)
    assert not chart.status.any()
    for i, load in enumerate(loads):
        record = wt.simulate(scene.replaced({"vehicle.load": load}))
        for feature in features:
            one = getattr(wt.features, feature)()(record)
            np.testing.assert_allclose(chart[feature][i], one, rtol=1e-9, equal_nan=True)


def test_a_map_in_which_play_begins_has_it_in_every_cell():
    plays = [0.0, 1e-5, 1e-4]
    chart = wt.sweep(DIP, {"vehicle.damper_play": plays}, ["largest_force"])
    alone = [wt.simulate(DIP.replaced({"vehicle.damper_play": play})) for play in plays]
    np.testing.assert_allclose(chart.largest_force, [one.peaks.normal_force.max() for one in alone], rtol=1e-12)
    assert len(set(chart.largest_force.values)) == 3


def losses_of(scene):
    return int((wt.simulate(scene).events.kind == "loss").sum())


@pytest.mark.slow
@pytest.mark.parametrize(("name", "many"), [*((name, 1) for name in CASES if name != "a spot"), ("a yield", 2)])
def test_bisection_of_plain_runs_finds_the_same_border(name, many):
    scene = DIP.replaced(CASES[name] | ({"duration": 0.05} if many > 1 else {}))
    curve = wt.border(scene, {HEIGHT: [-4e-4, -2e-5], "speed": [11.0, 13.0]}, losses=many, resolution=6)
    assert np.abs(curve.margin.values).max() < 1e-12
    assert curve.sizes["point"] >= 7
    for height, speed in zip(curve[HEIGHT].values[::3], curve.speed.values[::3], strict=True):
        kept, lost = (losses_of(scene.replaced({HEIGHT: height * (1 + d), "speed": speed})) for d in (-1e-6, 1e-6))
        assert sorted([kept >= many, lost >= many]) == [False, True]


UNFELT = {"vehicle.bumpstop_gap": 0.5, "vehicle.bumpstop_stiffness": 1e6}
PAIR = {"vehicle": wt.vehicles.Wheelsets(wheelsets=(wt.Wheelset(**WHEEL), wt.Wheelset(**WHEEL)), positions=(0.0, -9.0))}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "beside"), [("a yield", PAIR), ("play", UNFELT), ("a bush, damped", UNFELT)])
def test_a_map_is_that_of_the_general_march(name, beside):
    """A bumpstop that is never touched, or a wheelset far behind, makes it the map of another program."""
    scene = DIP.replaced(CASES[name] | {"duration": 0.05})
    over = {"speed": [11.0, 12.0, 13.0], HEIGHT: [-1.5e-4, -9e-5]}
    features = ["largest_force", "time_in_air", "impulse", "largest_displacement", "number_of_impacts"]
    own, general = (wt.sweep(one, over, features, method="strict") for one in (scene, scene.replaced(beside)))
    for feature in features:
        other = general[feature].isel(wheelset=0) if beside is PAIR else general[feature]
        np.testing.assert_allclose(own[feature], other, rtol=1e-9, atol=1e-12)


def test_a_bush_so_stiff_that_it_is_none_has_the_border_of_the_plain_wheel():
    over = {HEIGHT: [-4e-4, -2e-5], "speed": [11.0, 13.0]}
    plain, bushed = (
        wt.border(scene, over, resolution=2) for scene in (DIP, DIP.replaced({"vehicle.bush_stiffness": 3.9e10}))
    )
    np.testing.assert_allclose(bushed[HEIGHT].values, plain[HEIGHT].values, rtol=5e-5)
