"""What a sweep refuses, and how it says so."""

import json

import numpy as np
import pytest

import wheeltapper as wt
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
