"""What a sweep refuses, and how it says so."""

import json

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.paths import value_at
from wheeltapper.faces.cli import main
from wheeltapper.record.simulate import ModelWarning

SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307),
    contact=wt.Hertz(constant=1.4e11),
    irregularity=wt.Step(height=1e-4, position=0.01),
    speed=5,
    duration=0.1,
)
INTERVAL = wt.features.impact_interval()
REFUSED = [
    ({"vehicle.wheels": [1, 2]}, {}, "vehicle.wheels", "no continuous number"),
    ({"rolling": ["point"]}, {}, "rolling", "no continuous number"),
    ({"irregularity.0.ideal": [0, 1]}, {}, "irregularity.0.ideal", "no continuous number"),
    ({"contact.hysteresis": [0.1]}, {}, "contact.hysteresis", "nothing set"),
    ({"vehicle.mas": [1.0]}, {}, "vehicle.mas", "no such field"),
    ({"irregularity.1.height": [1.0]}, {}, "irregularity.1.height", "no such field"),
    ({"irregularity.height": [1.0]}, {}, "irregularity.height", "as in 'irregularity.0.height'"),
    ({"vehicle.msas": [1.0]}, {}, "vehicle.msas", "did you mean 'mass'?"),
    ({"vehicle.mass": [1500, -1]}, {}, "vehicle.mass", "-1"),
    ({"vehicle.mass": ["5 m"]}, {}, "vehicle.mass", "5 m"),
    ({"vehicle.mass": []}, {}, "vehicle.mass", "no values"),
    ({"vehicle.mass": [float("nan")]}, {}, "vehicle.mass", "not finite"),
    ({}, {}, "over", "nothing"),
    ({"vehicle.mass": [1.0, 2.0], "speed": [1.0]}, {"zipped": True}, "over", "different lengths"),
    ({"vehicle.mass": [1.0, 2.0, 3.0]}, {"samples": 4}, "vehicle.mass", "3 values"),
    ({"vehicle.mass": [1.0, 2.0]}, {"samples": 4, "sampling": "dice"}, "sampling", "dice"),
    ({"vehicle.mass": [1.0, 2.0]}, {"method": "rough"}, "method", "rough"),
]


@pytest.mark.parametrize(("over", "more", "field", "found"), REFUSED)
def test_a_wrong_study_is_refused_before_anything_is_computed(over, more, field, found):
    with pytest.raises(wt.InputError) as error:
        wt.sweep(SCENE, over, [INTERVAL], **more)
    assert field in str(error.value)
    assert found in str(error.value)


def test_features_are_checked():
    for features in ([], [INTERVAL, wt.features.impact_interval(2, 3)]):
        with pytest.raises(wt.InputError, match="features"):
            wt.sweep(SCENE, {"speed": [5.0]}, features)
    both = [INTERVAL, wt.features.impact_interval(2, 3).renamed("second_interval")]
    assert set(wt.sweep(SCENE, {"speed": [5.0]}, both)) == {"impact_interval", "second_interval", "status"}
    with pytest.raises(wt.InputError, match="counted from 1"):
        wt.features.impact_interval(2, 2)
    with pytest.raises(wt.InputError, match="onsets"):
        wt.features.impact_interval(between="ends")


def test_cells_that_cannot_be_computed_are_said(tmp_path):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.Measured(positions=[0.0, 0.2, 0.4, 0.6, 0.8, 1.0], heights=[0, 1e-5, 0, 1e-5, 0, 0]),
        rolling="point", speed=9, duration=0.1,
    )  # fmt: skip
    with pytest.warns(ModelWarning, match=r"1 of 2 cells cannot be computed; the first: .*irregularity"):
        chart = wt.sweep(scene, {"speed": [9.0, 15.0]}, [wt.features.largest_force()])
    assert chart.status.values.tolist() == [0, 5]
    assert np.isnan(chart.largest_force[1])
    with pytest.raises(wt.InputError, match="irregularity"):
        wt.sweep(scene, {"speed": [15.0, 16.0]}, [wt.features.largest_force()])


def test_a_sweep_warns_where_the_model_means_little():
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11), irregularity=wt.CosineBump(height=2e-4, length=0.02, start=0.009),
        rolling="point", speed=9, duration=0.01,
    )  # fmt: skip
    with pytest.warns(ModelWarning, match="cannot follow"):
        wt.sweep(scene, {"speed": [9.0, 15.0]}, [wt.features.largest_force()])


def sharp(**changes):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11), irregularity=wt.CosineBump(height=2e-4, length=0.02, start=0.009),
        rolling="point", speed=9, duration=0.01,
    ).replaced(changes)  # fmt: skip


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("gradient", [False, ["speed"]])
@pytest.mark.parametrize("shared_table", [True, False])
def test_a_sweep_warns_once_of_a_cause_with_its_worst_number(threads, gradient, shared_table):
    over = {"irregularity.0.height": np.linspace(-4e-4, 3e-4, 20), "irregularity.0.length": [0.05, 0.02, 0.01]}
    scene = (
        sharp() if shared_table else sharp(irregularity=[sharp().irregularity[0], wt.Step(height=0.0, position=0.04)])
    )
    with pytest.warns(ModelWarning) as warnings:
        chart = wt.sweep(scene, over, [wt.features.largest_force()], threads=threads, gradient=gradient)
    assert len(warnings) == 1
    radius = 1e3 * 0.01**2 / (2.0 * np.pi**2 * 4e-4)
    height, length = np.meshgrid(*over.values(), indexing="ij")
    too_sharp = int((2.0 * np.pi**2 * np.abs(height) / length**2 * 0.46 > 1.0).sum())
    assert f"(radius {radius:.4g} mm" in str(warnings[0].message)
    assert f"(the worst of {too_sharp} such cells of 60)" in str(warnings[0].message)
    assert json.loads(chart.attrs["notes"]) == [str(warnings[0].message)]


def test_a_study_notes_a_cause_once(tmp_path, capsys):
    sharp().to_toml(tmp_path / "sharp.toml")
    (tmp_path / "study.toml").write_text(
        'scenario = "sharp.toml"\nfeatures = "largest_force"\nchunk = 5\n'
        "[over]\nirregularity.0.height = { from = 1e-4, to = 4e-4, count = 20 }\n"
    )
    assert main(["sweep", str(tmp_path / "study.toml"), "--output", str(tmp_path / "map.zarr")]) == 0
    said = capsys.readouterr().err
    assert said.count("note:") == 1
    assert "(the worst of 20 such cells of 20)" in " ".join(said.split())
    assert f"(radius {1e3 * 0.02**2 / (2.0 * np.pi**2 * 4e-4):.4g} mm" in " ".join(said.split())


COACH = wt.Scenario(
    vehicle=wt.Wagon.erri_b176().with_element(
        wt.vehicles.Friction(name="rub", between=("car body", "bogie 1"), at=(-1.28, 1.0, 0.8), along="z", force=500.0)
    ),
    contact=wt.Hertz(), creep=wt.creep.Polach(friction=0.4), speed=36.0, duration=0.01,
    irregularity={"left": wt.CosineBump(height="0.2 mm", length="0.5 m", start=0.02)},
)  # fmt: skip
PAIR = wt.Scenario(
    vehicle=wt.vehicles.Wheelsets(
        wheelsets=[{"mass": 600.0, "load": 94e3, "wheels": 1, "stiffness": 1e6}] * 2, positions=(0.0, -2.4)
    ),
    track=wt.tracks.Ballasted.named("rolland_UIC60_example"), contact=wt.Hertz(constant=9.4125e10), speed=30.0,
    duration=0.01, irregularity=wt.CosineBump(height="0.1 mm", length="0.2 m", start=0.05),
)  # fmt: skip


@pytest.mark.parametrize(
    ("scene", "name", "number"),
    [
        (COACH, "vehicle.bodies.car body.mass", "vehicle.bodies.0.mass"),
        (COACH, "irregularity.left.0.height", "irregularity.left.0.height"),
        (PAIR, "vehicle.wheelsets.wheelset 2.mass", "vehicle.wheelsets.1.mass"),
    ],
)
def test_names_are_taken_as_numbers_are_by_sweeps_and_gradients(scene, name, number):
    held = value_at(scene, number)
    assert value_at(scene, name) == held
    assert scene.replaced({name: 1.1 * held}) == scene.replaced({number: 1.1 * held})
    by_name, by_number = (wt.sweep(scene, {path: [held, 1.1 * held]}, "largest_force") for path in (name, number))
    np.testing.assert_array_equal(by_name.largest_force, by_number.largest_force)
    if scene is PAIR:
        one, other = (wt.gradient(scene, "largest_force", [path]) for path in (name, number))
        np.testing.assert_array_equal(one.largest_force_gradient, other.largest_force_gradient)


@pytest.mark.parametrize(
    ("path", "allowed"),
    [
        ("vehicle.bodies.car bdy.mass", "car body, bogie 1, bogie 2 (did you mean 'car body'?)"),
        ("vehicle.bodies.mass", "the name of an item before it, as in 'vehicle.bodies.car body.mass'"),
        ("vehicle.elements.primary sprng 2 left.stiffness", "names (did you mean 'primary spring 2 left'?)"),
        ("vehicle.elements.Rub.force", "(did you mean 'rub'?)"),
        ("vehicle.axles.wheelset 9.mass", "(did you mean 'wheelset 4'?)"),
        ("irregularity.lft.0.height", "left (did you mean 'left'?)"),
    ],
)
def test_a_wrong_name_is_refused_alike_everywhere_with_the_one_that_is_nearest(path, allowed):
    for ask in (
        lambda: COACH.replaced({path: 1.0}),
        lambda: wt.sweep(COACH, {path: [1.0]}, "largest_force"),
        lambda: wt.gradient(COACH, "largest_force", [path]),
    ):
        with pytest.raises(wt.InputError) as error:
            ask()
        assert str(error.value).startswith(f"{path}: found no such field")
        assert allowed in str(error.value)


def test_friction_that_is_none_is_refused_with_what_would_do():
    with pytest.raises(wt.InputError, match="found 0 N; allowed: greater than 0, however little; a vehicle without"):
        wt.sweep(COACH, {"vehicle.elements.rub.force": [0.0, 500.0]}, "largest_force")
