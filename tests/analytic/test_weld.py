"""A weld against its own formulas: a cosine, and a measured shape over its straightedge."""

import numpy as np
import pytest

import wheeltapper as wt

Weld = wt.irregularities.Weld
WHEELSET = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
SCENE = wt.Scenario(
    vehicle=WHEELSET, contact=wt.Hertz(constant=1.405e11), irregularity=Weld(height=-3e-4, length=0.2, position=0.3),
    speed=20.0, duration=0.03,
)  # fmt: skip
X = np.linspace(-0.5, 0.5, 21)


def shape(x):
    """Return a measured weld on a slope and a step, as a laid straightedge has them."""
    return 2e-4 * np.exp(-((x / 0.12) ** 2)) + 3e-4 * x + 5e-3


@pytest.mark.parametrize("height", [2e-4, -2e-4])
def test_a_cosine_has_its_height_in_its_middle(height):
    x = np.linspace(1.6, 2.4, 401)
    exact = np.where(abs(x - 2.0) < 0.25, 0.5 * height * (1 + np.cos(2 * np.pi * (x - 2.0) / 0.5)), 0.0)
    np.testing.assert_allclose(Weld(height=height, length=0.5, position=2.0).course(0.46).value(x), exact, atol=1e-18)


def test_it_is_the_bump_that_begins_half_a_length_before_it():
    bump = wt.CosineBump(height=-3e-4, length=0.2, start=0.2)
    times = [wt.simulate(SCENE.replaced({"irregularity": [one]})).peaks.time for one in (*SCENE.irregularity, bump)]
    np.testing.assert_allclose(*times, rtol=1e-9)


@pytest.mark.parametrize("turned", [False, True])
def test_a_measured_shape_stands_on_the_line_through_its_ends(turned, tmp_path):
    path = tmp_path / "weld.csv"
    lines = [f"{1e3 * x:.6f},{1e3 * y:.9f}" for x, y in zip(X + 7.0, shape(X), strict=True)]
    path.write_text("position [mm],height [mm]\n" + "\n".join(lines), encoding="utf-8")
    read = Weld(path=path, position=2.0, turned=turned)
    given = Weld(positions=tuple(X), heights=tuple(shape(X)), position=2.0, turned=turned)
    exact = (shape(X) - shape(X[0]) - 3e-4 * (X - X[0])) * (-1 if turned else 1)
    for one in (read, given):
        course = one.course(0.46)
        np.testing.assert_allclose(course.value(2.0 + X), exact, atol=1e-11)
        np.testing.assert_allclose(course.value(np.array([-3.0, 1.4, 2.6, 50.0])), 0.0, atol=1e-18)


def test_a_measured_weld_is_written_moved_and_met(tmp_path):
    weld = Weld(positions=tuple(X), heights=tuple(shape(X)), position=0.5)
    scene = SCENE.replaced({"irregularity": [weld], "duration": 0.06})
    scene.to_toml(tmp_path / "weld.toml")
    assert wt.load(tmp_path / "weld.toml") == scene
    later = scene.replaced({"irregularity": [weld.moved(0.1)]})
    first, second = (wt.simulate(one).peaks.normal_force.max() for one in (scene, later))
    assert first > 1.05 * 105_820 > 1.0
    np.testing.assert_allclose(first, second, rtol=1e-6)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "found no whole shape; allowed: one of: height and length, positions and heights, path"),
        ({"height": 1e-4}, "found no whole shape"),
        ({"height": 1e-4, "length": 0.1, "path": "weld.csv"}, "found more than height and length; allowed: one of"),
        ({"height": 1e-4, "length": 0.1, "heights": (0, 1)}, "found more than height and length"),
        ({"height": 1e-4, "length": 0.1, "noise": 1e-6}, "noise: found 1e-06, which does nothing beside height"),
        (
            {"positions": tuple(X), "heights": tuple(shape(X)), "columns": (0, 1)},
            r"columns: found \(0, 1\), which does nothing without a path; allowed: no columns",
        ),
        ({"height": 1e-4, "length": -0.1}, r"length: found -0\.1; allowed: "),
    ],
)
def test_bad_shapes_are_refused_in_one_line(fields, message):
    with pytest.raises(wt.InputError, match=message) as error:
        Weld(position=2.0, **fields)
    assert "\n" not in str(error.value)


def test_unsorted_samples_and_a_run_shorter_than_the_weld_are_refused():
    unsorted = Weld(positions=(0.0, 0.1, 0.05, 0.2), heights=(0.0, 1e-4, 1e-4, 0.0), position=0.3)
    with pytest.raises(wt.InputError, match=r"positions out of order: 0\.05 after 0\.1"):
        wt.simulate(SCENE.replaced({"irregularity": [unsorted]}))
    with pytest.raises(wt.InputError, match=r"irregularity\.0\.length: found 0\.2 m, in a run over 0\.1 m; allowed"):
        wt.simulate(SCENE.replaced({"duration": 0.005}))
