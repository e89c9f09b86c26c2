"""A dipped joint against its own formula: heights, kink, angle; on every track and vehicle it is met as it stands."""

import numpy as np
import pytest
from scipy.optimize import brentq

import wheeltapper as wt
from wheeltapper.lower.build import table_of
from wheeltapper.lower.numbers import METHODS
from wheeltapper.march.common import program as contract

WHEELSET = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
DEPTH, LENGTH, POSITION = 2e-3, 0.8, 0.7
JOINT = wt.irregularities.DippedJoint(depth=DEPTH, length=LENGTH, position=POSITION)
SCENE = wt.Scenario(
    vehicle=WHEELSET, contact=wt.Hertz(constant=1.405e11), irregularity=JOINT, speed=20.0, duration=0.08
)


def depth_below(x):
    return np.where(abs(x - POSITION) < LENGTH / 2, -DEPTH * (1 - 2 * abs(x - POSITION) / LENGTH) ** 2, 0.0)


def path(scene, end=1.6):
    return table_of(scene, end, METHODS["default"])[0]


def test_heights_and_angle_are_those_of_the_formula():
    x = np.linspace(0.0, 1.5, 997)
    course = JOINT.course(0.46)
    np.testing.assert_allclose(course.value(x), depth_below(x), atol=1e-17)
    slopes = course.slope(np.nextafter(POSITION, [0.0, 1.0]))
    assert slopes[1] - slopes[0] == pytest.approx(8 * DEPTH / LENGTH, rel=1e-13)


def test_the_path_of_a_point_has_one_kink_and_three_borders_where_the_formula_has_them():
    table = path(SCENE.replaced({"rolling": "point"}))
    np.testing.assert_array_equal(table.kink_positions(), [POSITION])
    borders = [POSITION - LENGTH / 2, POSITION, POSITION + LENGTH / 2]
    assert set(borders) <= set(table.rows[:, contract.START].tolist())


def test_a_circle_is_turned_in_the_middle_where_it_touches_both_sides():
    """By symmetry; it rests on the two places at which the slope of the dip is that of the circle."""
    table = path(SCENE)
    radius = WHEELSET.radius
    (kink,) = table.kink_positions()
    assert kink == pytest.approx(POSITION, abs=1e-12)

    def lean(s):
        return 4 * DEPTH / LENGTH * (1 - 2 * s / LENGTH) - s / np.sqrt(radius**2 - s**2)

    s = brentq(lean, 0.0, LENGTH / 2, xtol=1e-15)
    height = depth_below(POSITION + s) + np.sqrt(radius**2 - s**2) - radius
    np.testing.assert_allclose(table.height_at(kink), height, rtol=1e-9)


def test_the_angle_says_the_depth():
    by_angle = wt.irregularities.DippedJoint(angle="20 mrad", length=LENGTH, position=POSITION)
    assert by_angle.lowest == pytest.approx(DEPTH, rel=1e-14)
    in_degrees = wt.irregularities.DippedJoint(angle=f"{np.degrees(0.02)} deg", length=LENGTH, position=POSITION)
    assert in_degrees.angle == pytest.approx(0.02, rel=1e-14)
    times = [wt.simulate(SCENE.replaced({"irregularity": [one]})).peaks.time.values for one in (JOINT, by_angle)]
    np.testing.assert_allclose(*times, rtol=1e-12)


TRACKS = {
    "stiff": wt.StiffTrack(),
    "deck": wt.FloatingDeck(mass=3000, stiffness=2e8, damping=1e5),
    "ballasted": wt.tracks.Ballasted.named("Zhai2004"),
}


@pytest.mark.parametrize("rolling", ["point", "circle"])
@pytest.mark.parametrize("track", TRACKS)
def test_it_strikes_upwards_behind_its_middle_on_every_track(track, rolling):
    record = wt.simulate(SCENE.replaced({"track": TRACKS[track], "rolling": rolling}))
    peaks, behind = record.peaks, 20.0 * record.peaks.time > POSITION
    first = int(behind.argmax("peak"))
    assert POSITION < 20.0 * peaks.time[first] < POSITION + 0.05
    assert peaks.normal_force[first] > 1.3 * record.static_force
    assert peaks.normal_force[first] > peaks.normal_force[~behind].max()


def test_under_a_coach_it_may_be_on_one_rail():
    coach = wt.load("examples/coach_step.toml").replaced(
        {"irregularity": {"left": JOINT}, "speed": 20.0, "duration": 0.05}
    )
    force = wt.simulate(coach).history("5 kHz").normal_force.sel(wheelset=1)
    assert force.sel(side="left").max() > 1.2 * force.sel(side="right").max()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "neither depth nor angle; allowed: one of them, since angle = 8·depth/length"),
        ({"depth": 1e-3, "angle": 0.02}, "both depth and angle; allowed: one of them"),
        ({"depth": -1e-3}, "depth: found -0.001; allowed: "),
        ({"angle": 0.0}, "angle: found 0.0; allowed: "),
        ({"angle": "3 mm"}, "angle: found '3 mm', which is not an angle"),
    ],
)
def test_bad_sizes_are_refused_in_one_line(fields, message):
    with pytest.raises(wt.InputError, match=message) as error:
        wt.irregularities.DippedJoint(length=1.0, position=2.0, **fields)
    assert "\n" not in str(error.value)


def test_a_joint_longer_than_the_run_is_refused():
    with pytest.raises(wt.InputError, match=r"irregularity\.0\.length: found 0\.8 m, in a run over 0\.6 m; allowed"):
        wt.simulate(SCENE.replaced({"duration": 0.03}))


def test_repeated_joints_are_refused_as_one_is():
    with pytest.raises(wt.InputError, match=r"^period: found 0\.5 m; allowed: at least 0\.8 m, the length of what"):
        wt.Repeated(of=JOINT, period=0.5)
    repeated = SCENE.replaced({"irregularity": [wt.Repeated(of=JOINT, period=2.0)]})
    with pytest.raises(wt.InputError, match=r"irregularity\.0\.of\.length: found 0\.8 m, in a run over 0\.6 m"):
        wt.simulate(repeated.replaced({"duration": 0.03}))
    with pytest.raises(wt.InputError, match=r"^irregularity\.0\.period: found 0\.3 m; allowed: at least 0\.8 m"):
        repeated.replaced({"irregularity.0.period": 0.3})


STRICT_AROUND = {
    "irregularity.0.depth": JOINT,
    "irregularity.0.length": JOINT,
    "irregularity.0.angle": wt.irregularities.DippedJoint(angle=0.02, length=LENGTH, position=POSITION),
}


@pytest.mark.parametrize("rolling", ["point", "circle"])
@pytest.mark.parametrize("path", STRICT_AROUND)
def test_gradients_are_those_of_strict_runs_nearby(path, rolling):
    scene = SCENE.replaced({"irregularity": [STRICT_AROUND[path]], "rolling": rolling})
    exact = float(wt.gradient(scene, "largest_force", [path]).largest_force_gradient.item())
    held = getattr(STRICT_AROUND[path], path.rpartition(".")[2])
    low, high = (
        float(wt.simulate(scene.replaced({path: held * (1 + side)}), method="strict").peaks.normal_force.max())
        for side in (-1e-5, 1e-5)
    )
    assert exact == pytest.approx((high - low) / (2e-5 * held), rel=1e-6)
